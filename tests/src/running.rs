//! Programs that run beside a test and end with it.

use crate::program::{Words, jointwatch};
use std::io::{BufRead, BufReader, Lines, Write};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};

/// A process that is ended when it is dropped.
pub struct Ended(pub Child);

impl Drop for Ended {
    fn drop(&mut self) {
        // Whether it has ended by itself does not matter any more.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The `jointwatch` program, which is told things and whose lines are read as they come.
pub struct Running {
    process: Ended,
    lines: Lines<BufReader<ChildStdout>>,
}

impl Running {
    /// Starts it in a folder.
    ///
    /// # Panics
    /// When it does not start.
    pub fn start(folder: &Path, arguments: &(impl Words + ?Sized)) -> Self {
        let mut process = Command::new(jointwatch())
            .current_dir(folder)
            .args(arguments.words())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let lines = BufReader::new(process.stdout.take().expect("it was piped")).lines();
        let process = Ended(process);
        Self { process, lines }
    }

    /// Tells it a line.
    ///
    /// # Panics
    /// When it has ended.
    pub fn say(&mut self, words: &str) {
        let input = self.process.0.stdin.as_mut().expect("it was piped");
        writeln!(input, "{words}").expect("it reads");
    }

    /// Reads until a line fits, and gives it.
    ///
    /// # Panics
    /// When none does.
    pub fn until(&mut self, what: &str, mut fits: impl FnMut(&str) -> bool) -> String {
        let mut last = String::new();
        for line in self.lines.by_ref().map_while(Result::ok) {
            if fits(&line) {
                return line;
            }
            last = line;
        }
        panic!("{what} never came; the last line: {last}");
    }
}
