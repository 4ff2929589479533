//! Progress as lines on standard error, for a program that shows it in its own way (the lab does).

use crate::lab::PROGRESS_MARK;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle, TermLike};
use std::io::{self, Write};
use std::sync::Mutex;
use std::time::Duration;

/// Lines are written at most so often.
const PER_SECOND: u8 = 4;

/// A bar that writes a line whenever its message changes.
pub(super) fn bar(what: &'static str) -> ProgressBar {
    let target = ProgressDrawTarget::term_like_with_hz(Box::new(Lines::default()), PER_SECOND);
    let bar = ProgressBar::with_draw_target(None, target).with_message(what);
    if let Ok(style) = ProgressStyle::with_template("{msg}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(150));
    bar
}

/// A terminal that only goes on: what is drawn anew and has not changed is left out.
#[derive(Debug, Default)]
struct Lines(Mutex<String>);

impl Lines {
    fn show(&self, text: &str) -> io::Result<()> {
        // Without what turns and grows: the words are what is new.
        let text = text
            .trim_start_matches(|c: char| !c.is_alphanumeric())
            .trim_end();
        let mut last = self.0.lock().map_err(|_| io::ErrorKind::Other)?;
        if text.is_empty() || *last == text {
            return Ok(());
        }
        text.clone_into(&mut last);
        writeln!(io::stderr(), "{PROGRESS_MARK}{text}")
    }
}

impl TermLike for Lines {
    fn width(&self) -> u16 {
        200
    }
    fn move_cursor_up(&self, _: usize) -> io::Result<()> {
        Ok(())
    }
    fn move_cursor_down(&self, _: usize) -> io::Result<()> {
        Ok(())
    }
    fn move_cursor_right(&self, _: usize) -> io::Result<()> {
        Ok(())
    }
    fn move_cursor_left(&self, _: usize) -> io::Result<()> {
        Ok(())
    }
    fn write_line(&self, text: &str) -> io::Result<()> {
        self.show(text)
    }
    fn write_str(&self, text: &str) -> io::Result<()> {
        self.show(text)
    }
    fn clear_line(&self) -> io::Result<()> {
        Ok(())
    }
    fn flush(&self) -> io::Result<()> {
        Ok(())
    }
}
