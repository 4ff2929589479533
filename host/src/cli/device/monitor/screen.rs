//! The loop of the terminal screen: line, keys, a picture twenty times a second, and a terminal
//! that is given back as it was.

use super::draw::draw;
use super::outputs::{INTERRUPTED, Outputs, Settings};
use crate::device::live::LiveView;
use crate::device::telemetry::line::Source;
use crate::device::telemetry::listen::{Heard, Tally};
use crate::device::telemetry::steady::{Caught, News, SteadyLine, Wanted};
use crate::text::error::{Error, Result};
use jointwatch_shared::wire::telemetry::Report;
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers};
use std::collections::VecDeque;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// From one picture to the next.
const FRAME: Duration = Duration::from_millis(50);

/// Shows a device until the user has seen enough; gives what was heard.
///
/// # Errors
/// When there is no terminal to draw on, when the line cannot be opened, and when what is to be
/// written cannot be.
pub(super) fn show(source: Source, settings: &Settings, outputs: &mut Outputs) -> Result<Tally> {
    let wanted = settings.stream.map_or(Wanted::Shown, Wanted::Every);
    let mut line = SteadyLine::open(source, wanted)?;
    let mut terminal = ratatui::try_init().map_err(|e| {
        Error::failed(format!(
            "the terminal cannot be drawn on ({e}); add --plain for lines"
        ))
    })?;
    // A panic gives the terminal back as well: `try_init` has seen to it.
    let shown = watch(&mut terminal, &mut line, settings, outputs);
    ratatui::restore();
    let tally = line.tally();
    line.close();
    shown.map(|()| tally)
}

fn watch(
    terminal: &mut DefaultTerminal,
    line: &mut SteadyLine,
    settings: &Settings,
    outputs: &mut Outputs,
) -> Result<()> {
    let begun = Instant::now();
    let mut view = LiveView::new(&line.source().name());
    let mut pace = Pace::of(line.source());
    // What the user holds still to look at; meanwhile everything goes on.
    let mut held: Option<(LiveView, Duration)> = None;
    let mut drawn = None::<Instant>;
    while !INTERRUPTED.load(Ordering::Relaxed) {
        let now = begun.elapsed();
        if settings
            .seconds
            .is_some_and(|most| now.as_secs_f64() >= most)
        {
            break;
        }
        if drawn.is_none_or(|at| at.elapsed() >= FRAME) {
            drawn = Some(Instant::now());
            let (shown, at) = held.as_ref().map_or((&view, now), |(view, at)| (view, *at));
            terminal
                .draw(|frame| draw(frame, shown, at, held.is_some()))
                .map_err(|e| Error::failed(format!("the terminal was lost ({e})")))?;
            match key()? {
                Key::Quit => break,
                Key::Pause => held = held.is_none().then(|| (view.clone(), now)),
                Key::None => {}
            }
        }
        let left = FRAME.saturating_sub(drawn.map_or(FRAME, |at| at.elapsed()));
        if pace.is_waiting() || pace.ended {
            std::thread::sleep(left);
        } else {
            let caught = line.next(left)?;
            outputs.keep(&caught)?;
            pace.take(caught);
        }
        pace.feed(&mut view, line.tally(), begun.elapsed());
    }
    Ok(())
}

enum Key {
    Quit,
    Pause,
    None,
}

/// The first key that means something, without waiting.
fn key() -> Result<Key> {
    let failed = |e: std::io::Error| Error::failed(format!("the keyboard was lost ({e})"));
    while event::poll(Duration::ZERO).map_err(failed)? {
        let Event::Key(key) = event::read().map_err(failed)? else {
            continue;
        };
        if key.kind != KeyEventKind::Press {
            continue;
        }
        let control = key.modifiers.contains(KeyModifiers::CONTROL);
        match key.code {
            KeyCode::Char('c') if control => return Ok(Key::Quit),
            KeyCode::Char('q' | 'Q') | KeyCode::Esc => return Ok(Key::Quit),
            KeyCode::Char(' ') => return Ok(Key::Pause),
            _ => {}
        }
    }
    Ok(Key::None)
}

/// Messages that wait for their time: those of a file come as fast as the device sent them, those
/// of a device at once.
pub(super) struct Pace {
    is_file: bool,
    waiting: VecDeque<Heard>,
    news: VecDeque<News>,
    ended: bool,
    rate_hz: Option<f64>,
    /// The device's time and the clock's when the first message with a time came.
    first: Option<(f64, Duration)>,
}

impl Pace {
    pub(super) fn of(source: &Source) -> Self {
        Self {
            is_file: matches!(source, Source::File(_)),
            waiting: VecDeque::new(),
            news: VecDeque::new(),
            ended: false,
            rate_hz: None,
            first: None,
        }
    }

    /// Whether enough of a file was read for now.
    fn is_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    pub(super) fn take(&mut self, caught: Caught) {
        self.waiting.extend(caught.heard);
        self.ended |= caught.news == Some(News::End);
        self.news.extend(caught.news);
    }

    /// Hands on what is due.
    pub(super) fn feed(&mut self, view: &mut LiveView, tally: Tally, now: Duration) {
        let end = News::End;
        while let Some(news) = self.news.pop_front_if(|news| *news != end) {
            view.learn(&news, now);
        }
        let mut due = Vec::new();
        while let Some(heard) = self.waiting.pop_front() {
            if self.is_file && self.is_early(&heard, now) {
                self.waiting.push_front(heard);
                break;
            }
            due.push(heard);
        }
        view.hear(&due, tally, now);
        if self.waiting.is_empty() && self.ended && !view.has_ended() {
            view.learn(&end, now);
        }
    }

    /// Whether the device sent it later than the clock is now.
    fn is_early(&mut self, heard: &Heard, now: Duration) -> bool {
        let Heard::Message(received) = heard else {
            return false;
        };
        let sample = match &received.message {
            Report::Hello(hello) => {
                self.rate_hz = hello.rig.as_ref().map(|rig| rig.sample_rate_hz);
                self.first = None;
                return false;
            }
            Report::Sample(sample) => sample.sample,
            Report::Status(status) => status.sample,
            _ => return false,
        };
        let Some(rate) = self.rate_hz.filter(|rate| *rate > 0.0) else {
            return false;
        };
        let time_s = sample as f64 / rate;
        let (began_s, at) = *self.first.get_or_insert((time_s, now));
        // What jumps by more than a pause in front of the file would be worth is not waited for.
        let ahead = time_s - began_s - now.saturating_sub(at).as_secs_f64();
        if ahead > LONGEST_S {
            self.first = Some((time_s, now));
        }
        (0.0..=LONGEST_S).contains(&ahead) && ahead > 0.0
    }
}

/// The longest gap in a file that is waited for.
const LONGEST_S: f64 = 10.0;
