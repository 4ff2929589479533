//! `jointwatch monitor`: prints what a device says, one line per message, as text or as JSON lines.

use super::console::{Console, print_to_stdout};
use crate::device::telemetry::line::{Piece, Source, TelemetryLine};
use crate::device::telemetry::listen::{Heard, Listener, Tally};
use crate::device::telemetry::words::{Reader, closing};
use crate::text::error::{Error, Result};
use clap::{ArgGroup, Args};
use jointwatch_shared::wire::telemetry::{BAUD, Received, Report, Request};
use serde::Serialize;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Options of `jointwatch monitor`.
#[derive(Args)]
#[command(group(ArgGroup::new("source").required(true).args(["file", "port"])))]
pub(crate) struct Monitor {
    /// A file or FIFO that holds what a device sent; - for standard input.
    file: Option<PathBuf>,
    /// The device's serial port, such as /dev/ttyACM0 or COM3; it is asked to introduce itself.
    #[arg(long, value_name = "PORT")]
    port: Option<String>,
    /// Bits per second of the serial port; 1000000, as the firmware has it, when left out.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    baud: Option<u32>,
    /// Ask the device for its samples: 1 for every one, 10 for every tenth.
    #[arg(long, value_name = "EVERY", value_parser = clap::value_parser!(u16).range(1..))]
    stream: Option<u16>,
    /// End after so many seconds.
    #[arg(long, value_name = "S", value_parser = seconds)]
    seconds: Option<f64>,
}

/// Set by Ctrl-C; a signal's handler reaches nothing else.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);
/// How long one waits for bytes before looking whether to end.
const WAIT: Duration = Duration::from_millis(50);
/// How long a device may say nothing before the user is told what may be wrong; it reports ten times a second.
const SILENCE: Duration = Duration::from_secs(3);

fn seconds(text: &str) -> std::result::Result<f64, String> {
    match text.parse() {
        Ok(value) if (0.0..=1e9).contains(&value) => Ok(value),
        _ => Err("a number of seconds from 0 to 1000000000 is wanted".to_string()),
    }
}

impl Monitor {
    pub(super) fn run(self, console: &Console) -> Result<()> {
        let source = self.source()?;
        let json = JsonLines::open(console)?;
        ctrlc::set_handler(|| {
            if INTERRUPTED.swap(true, Ordering::Relaxed) {
                // As a shell counts a program that SIGINT ended.
                std::process::exit(130);
            }
        })
        .map_err(|e| Error::failed(format!("Ctrl-C could not be listened for ({e})")))?;
        let mut line = TelemetryLine::open(source.clone())?;
        if let Source::Port(..) = source {
            line.send(&Request::Hello)?;
        }
        if let Some(every) = self.stream {
            line.send(&Request::Stream { every })?;
        }
        let mut session = Session {
            console,
            json,
            listener: Listener::default(),
            reader: Reader::default(),
        };
        let heard = session.listen(&line, &source, self.seconds);
        if self.stream.is_some() && heard.is_ok() {
            line.send(&Request::Stream { every: 0 })?;
        }
        let tally = session.end()?;
        heard?;
        of_use(&source, &tally)
    }

    fn source(&self) -> Result<Source> {
        for (given, option) in [
            (self.baud.is_some(), "--baud"),
            (self.stream.is_some(), "--stream"),
        ] {
            if given && self.port.is_none() {
                return Err(Error::usage(format!(
                    "{option} is for a serial port: name it with --port"
                )));
            }
        }
        match (&self.port, &self.file) {
            (Some(port), _) => Ok(Source::Port(port.clone(), self.baud.unwrap_or(BAUD))),
            (None, Some(file)) if file.as_os_str() == "-" => Ok(Source::StandardInput),
            (None, Some(file)) if is_port(file) => Err(Error::usage(format!(
                "{} is a serial port: name it with --port",
                file.display()
            ))),
            (None, Some(file)) => Ok(Source::File(file.clone())),
            (None, None) => Err(Error::usage("name a file, - or --port")),
        }
    }
}

/// Whether a file is a serial port by its name, as Linux, macOS and Windows name them.
fn is_port(file: &Path) -> bool {
    let name = file.to_string_lossy();
    let windows = name.strip_prefix("COM").is_some_and(|rest| {
        !rest.is_empty() && rest.bytes().all(|byte| byte.is_ascii_digit()) && !file.exists()
    });
    windows
        || ["/dev/tty", "/dev/cu."]
            .iter()
            .any(|start| name.starts_with(start))
}

/// A file that held no message at all is not what the user meant.
fn of_use(source: &Source, tally: &Tally) -> Result<()> {
    let name = match source {
        Source::Port(..) => return Ok(()),
        Source::File(path) => path.display().to_string(),
        Source::StandardInput => "standard input".to_string(),
    };
    if tally.messages + tally.unknown > 0 || INTERRUPTED.load(Ordering::Relaxed) {
        return Ok(());
    }
    Err(Error::data(format!(
        "{name}: there is no undamaged message in its {} bytes; is it what a device sent, or what replay --frames wrote?",
        tally.bytes
    )))
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

    /// Writes whole lines.
    fn write(&mut self, lines: &str) -> Result<()> {
        match self {
            Self::Nowhere => Ok(()),
            Self::StandardOutput => print_to_stdout(lines),
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

/// One time of listening.
struct Session<'a> {
    console: &'a Console,
    json: JsonLines,
    listener: Listener,
    reader: Reader,
}

impl Session<'_> {
    /// Prints until there is no more, the time is over, or Ctrl-C.
    fn listen(
        &mut self,
        line: &TelemetryLine,
        source: &Source,
        seconds: Option<f64>,
    ) -> Result<()> {
        let begun = Instant::now();
        let mut silent = matches!(source, Source::Port(..));
        while !INTERRUPTED.load(Ordering::Relaxed) {
            if seconds.is_some_and(|most| begun.elapsed().as_secs_f64() >= most) {
                break;
            }
            match line.next(WAIT)? {
                Piece::Bytes(bytes) => {
                    let heard = self.listener.hear(&bytes);
                    self.show(&heard)?;
                }
                Piece::Nothing => {}
                Piece::End => break,
            }
            if silent && self.listener.tally().messages > 0 {
                silent = false;
            }
            if silent && begun.elapsed() > SILENCE {
                silent = false;
                eprintln!("{}", silence(&self.listener.tally()));
            }
        }
        Ok(())
    }

    fn show(&mut self, heard: &[Heard]) -> Result<()> {
        let (mut text, mut json) = (String::new(), String::new());
        for heard in heard {
            let line = match heard {
                Heard::Message(Received { sequence, message }) => {
                    let line = self.reader.line(message);
                    json += &self.if_json(JsonLine::Message {
                        sequence: *sequence,
                        report: message,
                        text: &line,
                    })?;
                    line
                }
                Heard::Lost(count) => {
                    json += &self.if_json(JsonLine::Count {
                        message: "lost",
                        count: *count,
                    })?;
                    format!("--        {count} messages lost")
                }
                Heard::Restarted => {
                    json += &self.if_json(JsonLine::Count {
                        message: "restarted",
                        count: 1,
                    })?;
                    "--        the device has started anew".to_string()
                }
                Heard::Unknown(tag) => {
                    json += &self.if_json(JsonLine::Unknown {
                        message: "unknown",
                        tag: *tag,
                    })?;
                    format!("--        a message that this program does not know (tag {tag})")
                }
            };
            text += &line;
            text.push('\n');
        }
        if !json.is_empty() {
            self.json.write(&json)?;
        }
        match text.strip_suffix('\n') {
            Some(lines) => self.console.say(lines),
            None => Ok(()),
        }
    }

    fn if_json(&self, line: JsonLine) -> Result<String> {
        match self.json {
            JsonLines::Nowhere => Ok(String::new()),
            _ => json_line(&line),
        }
    }

    /// The last line: what was heard altogether.
    fn end(&mut self) -> Result<Tally> {
        let tally = self.listener.tally();
        let line = self.if_json(JsonLine::End {
            message: "end",
            tally,
        })?;
        self.json.write(&line)?;
        self.console.say(closing(&tally))?;
        Ok(tally)
    }
}

/// What may be wrong with a port over which no message has come.
fn silence(tally: &Tally) -> String {
    let seconds = SILENCE.as_secs();
    if tally.bytes == 0 {
        format!(
            "jointwatch: nothing has arrived for {seconds} s; is the device powered, its transmit line wired, and this its port?"
        )
    } else {
        format!(
            "jointwatch: {} bytes have arrived in {seconds} s, but no undamaged message; is --baud what the firmware has \
             ({BAUD}), and is this a Jointwatch device?",
            tally.bytes
        )
    }
}
