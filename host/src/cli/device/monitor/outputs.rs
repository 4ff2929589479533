//! What `jointwatch monitor` writes beside what it shows: JSON lines, and the raw frames.

use crate::cli::console::Console;
use crate::device::telemetry::listen::{Heard, Tally};
use crate::device::telemetry::steady::Caught;
use crate::device::telemetry::words::Reader;
use crate::text::error::{Error, Result};
use crate::text::output;
use jointwatch_shared::wire::telemetry::{Received, Report};
use serde::Serialize;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// Set by Ctrl-C; a signal's handler reaches nothing else.
pub(super) static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// What the user asked for beside the line.
pub(super) struct Settings {
    pub(super) stream: Option<u16>,
    pub(super) seconds: Option<f64>,
}

/// Where JSON lines go, if anywhere.
enum JsonLines {
    Nowhere,
    StandardOutput,
    To(PathBuf, File),
}

impl JsonLines {
    fn open(console: &Console) -> Result<Self> {
        match console.json_file() {
            None => Ok(Self::Nowhere),
            Some(_) if console.json_to_stdout() => Ok(Self::StandardOutput),
            Some(path) => match File::create(path) {
                Ok(file) => Ok(Self::To(path.clone(), file)),
                Err(e) => Err(Error::failed(format!(
                    "{}: could not be written ({e}); check that its folder exists and may be written to",
                    path.display()
                ))),
            },
        }
    }

    fn write(&mut self, lines: &str) -> Result<()> {
        match self {
            Self::Nowhere => Ok(()),
            Self::StandardOutput => output::print(lines.as_bytes()),
            Self::To(path, file) => file.write_all(lines.as_bytes()).map_err(|e| {
                Error::failed(format!("{}: could not be written ({e})", path.display()))
            }),
        }
    }
}

/// One line of JSON.
#[derive(Serialize)]
#[serde(untagged)]
enum JsonLine<'a> {
    Message {
        sequence: u16,
        #[serde(flatten)]
        report: &'a Report,
        /// The line that is printed without --json.
        text: &'a str,
    },
    Count {
        message: &'static str,
        count: u16,
    },
    Unknown {
        message: &'static str,
        tag: u8,
    },
    End {
        message: &'static str,
        #[serde(flatten)]
        tally: Tally,
    },
}

fn json_line(line: &JsonLine) -> Result<String> {
    serde_json::to_string(line)
        .map(|text| text + "\n")
        .map_err(|e| Error::failed(format!("a message could not be written as JSON ({e})")))
}

/// What is written beside what is printed.
pub(super) struct Outputs {
    json: JsonLines,
    record: Record,
    reader: Reader,
}

impl Outputs {
    /// Opens the files that were asked for.
    pub(super) fn open(console: &Console, record: Option<&Path>) -> Result<Self> {
        Ok(Self {
            json: JsonLines::open(console)?,
            record: Record::open(record)?,
            reader: Reader::default(),
        })
    }

    /// Keeps what arrived; gives the lines to print.
    pub(super) fn keep(&mut self, caught: &Caught) -> Result<String> {
        self.record.write(&caught.bytes)?;
        let (mut text, mut json) = (String::new(), String::new());
        for heard in &caught.heard {
            text += &self.heard(heard, &mut json)?;
            text.push('\n');
        }
        if !json.is_empty() {
            self.json.write(&json)?;
        }
        Ok(text)
    }

    /// One line for a person; the same for a program goes to the end of `json`.
    fn heard(&mut self, heard: &Heard, json: &mut String) -> Result<String> {
        Ok(match heard {
            Heard::Message(Received { sequence, message }) => {
                let line = self.reader.line(message);
                *json += &self.if_json(JsonLine::Message {
                    sequence: *sequence,
                    report: message,
                    text: &line,
                })?;
                line
            }
            Heard::Lost(count) => {
                *json += &self.if_json(JsonLine::Count {
                    message: "lost",
                    count: *count,
                })?;
                format!("--        {count} messages lost")
            }
            Heard::Restarted => {
                *json += &self.if_json(JsonLine::Count {
                    message: "restarted",
                    count: 1,
                })?;
                "--        the device has started anew".to_string()
            }
            Heard::Unknown(tag) => {
                *json += &self.if_json(JsonLine::Unknown {
                    message: "unknown",
                    tag: *tag,
                })?;
                format!("--        a message that this program does not know (tag {tag})")
            }
        })
    }

    fn if_json(&self, line: JsonLine) -> Result<String> {
        match self.json {
            JsonLines::Nowhere => Ok(String::new()),
            _ => json_line(&line),
        }
    }

    /// The last line of JSON: what was heard altogether.
    pub(super) fn end(&mut self, tally: &Tally) -> Result<()> {
        let line = self.if_json(JsonLine::End {
            message: "end",
            tally: *tally,
        })?;
        self.json.write(&line)
    }
}

/// The file that keeps what arrives, if one was asked for.
enum Record {
    Nowhere,
    To(PathBuf, File),
}

impl Record {
    fn open(path: Option<&Path>) -> Result<Self> {
        let Some(path) = path else {
            return Ok(Self::Nowhere);
        };
        // What was recorded cannot be had again.
        if std::fs::metadata(path).is_ok_and(|found| found.is_file() && found.len() > 0) {
            return Err(Error::usage(format!(
                "{}: --record would write over this file; name another one, or remove it first",
                path.display()
            )));
        }
        match File::create(path) {
            Ok(file) => Ok(Self::To(path.to_path_buf(), file)),
            Err(e) => Err(Error::failed(format!(
                "{}: could not be written ({e}); check that its folder exists and may be written to",
                path.display()
            ))),
        }
    }

    fn write(&mut self, bytes: &[u8]) -> Result<()> {
        let Self::To(path, file) = self else {
            return Ok(());
        };
        file.write_all(bytes)
            .map_err(|e| Error::failed(format!("{}: could not be written ({e})", path.display())))
    }
}
