//! `jointwatch monitor`: shows what a device says, on a screen, or as one line per message, as text
//! or as JSON lines.

mod draw;
mod outputs;
mod screen;
#[cfg(test)]
mod tests;

use crate::cli::console::Console;
use crate::device::telemetry::line::{Piece, Source, TelemetryLine};
use crate::device::telemetry::listen::{Listener, Tally};
use crate::device::telemetry::steady::{Caught, News, SteadyLine, Wanted};
use crate::text::error::{Error, Result};
use crate::text::printable;
use clap::{ArgGroup, Args};
use jointwatch_shared::wire::telemetry::{BAUD, Request};
use outputs::{INTERRUPTED, Outputs, Settings};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// Options of `jointwatch monitor`.
#[derive(Args)]
#[command(group(ArgGroup::new("source").required(true).args(["file", "named", "port", "tcp"])))]
pub(crate) struct Monitor {
    /// A file or FIFO that holds what a device sent; - for standard input.
    file: Option<PathBuf>,
    /// The same file or FIFO, named by an option.
    #[arg(long = "file", id = "named", value_name = "FILE")]
    named: Option<PathBuf>,
    /// The device's serial port, such as /dev/ttyACM0 or COM3; it is asked to introduce itself.
    #[arg(long, value_name = "PORT")]
    port: Option<String>,
    /// Where a program hands on what a device sends, such as 127.0.0.1:4000 of `emulate --serve
    /// 4000`.
    #[arg(long, value_name = "HOST:PORT")]
    tcp: Option<String>,
    /// Bits per second of the serial port; 1000000, as the firmware has it, when left out.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    baud: Option<u32>,
    /// Ask the device for its samples: 1 for every one, 10 for every tenth. The screen asks for
    /// some 500 a second when it is left out.
    #[arg(long, value_name = "EVERY", value_parser = clap::value_parser!(u16).range(1..))]
    stream: Option<u16>,
    /// End after so many seconds.
    #[arg(long, value_name = "S", value_parser = seconds)]
    seconds: Option<f64>,
    /// Print a line per message on a terminal too, in place of the screen.
    #[arg(long)]
    plain: bool,
    /// Keep what arrives, byte for byte, in this file; `monitor --file` shows it again.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Open a lost line again, as the screen always does; without it a line that is lost ends the
    /// run.
    #[arg(long)]
    reconnect: bool,
}

/// How long one waits for bytes before looking whether to end.
const WAIT: Duration = Duration::from_millis(50);
/// How long a device may say nothing before the user is told what may be wrong; it reports ten
/// times a second.
const SILENCE: Duration = Duration::from_secs(3);

pub(super) fn seconds(text: &str) -> std::result::Result<f64, String> {
    match text.parse() {
        Ok(value) if (0.0..=1e9).contains(&value) => Ok(value),
        _ => Err("a number of seconds from 0 to 1000000000 is wanted".to_string()),
    }
}

impl Monitor {
    pub(crate) fn run(self, console: &Console) -> Result<()> {
        let source = self.source()?;
        let mut outputs = Outputs::open(console, self.record.as_deref())?;
        ctrlc::set_handler(|| {
            if INTERRUPTED.swap(true, Ordering::Relaxed) {
                // As a shell counts a program that SIGINT ended.
                std::process::exit(130);
            }
        })
        .map_err(|e| Error::failed(format!("Ctrl-C could not be listened for ({e})")))?;
        let settings = Settings {
            stream: self.stream,
            seconds: self.seconds,
        };
        if self.has_screen(console, &source) {
            let tally = screen::show(source.clone(), &settings, &mut outputs)?;
            outputs.end(&tally)?;
            console.say(tally.to_string())?;
            return of_use(&source, &tally);
        }
        let mut session = Session { console, outputs };
        let heard = if self.reconnect && source.is_device() {
            session.follow(&source, &settings)
        } else {
            session.listen(&source, &settings)
        };
        let (tally, heard) = heard?;
        session.end(&tally)?;
        heard?;
        of_use(&source, &tally)
    }

    /// Whether somebody looks at a terminal that can be drawn on.
    fn has_screen(&self, console: &Console, source: &Source) -> bool {
        let printed = self.plain || console.is_quiet() || console.json_to_stdout();
        !printed && *source != Source::StandardInput && std::io::stdout().is_terminal()
    }

    fn source(&self) -> Result<Source> {
        if self.baud.is_some() && self.port.is_none() {
            return Err(Error::usage(
                "--baud is for a serial port: name it with --port",
            ));
        }
        if self.stream.is_some() && self.port.is_none() && self.tcp.is_none() {
            return Err(Error::usage(
                "--stream is for a device: name its serial port with --port, or its address with --tcp",
            ));
        }
        if let Some(address) = &self.tcp {
            return Ok(Source::Tcp(address.clone()));
        }
        match (&self.port, self.file.as_ref().or(self.named.as_ref())) {
            (Some(port), _) => Ok(Source::Port(port.clone(), self.baud.unwrap_or(BAUD))),
            (None, Some(file)) if file.as_os_str() == "-" => Ok(Source::StandardInput),
            (None, Some(file)) if is_port(file) => Err(Error::usage(format!(
                "{} is a serial port: name it with --port",
                file.display()
            ))),
            (None, Some(file)) => Ok(Source::File(file.clone())),
            (None, None) => Err(Error::usage("name a file, -, --port or --tcp")),
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
    if source.is_device() {
        return Ok(());
    }
    let name = source.name();
    if tally.messages + tally.unknown > 0 || INTERRUPTED.load(Ordering::Relaxed) {
        return Ok(());
    }
    Err(Error::data(format!(
        "{name}: there is no undamaged message in its {} bytes; is it what a device sent, or what replay --frames wrote?",
        tally.bytes
    )))
}

/// One time of listening, printed.
struct Session<'a> {
    console: &'a Console,
    outputs: Outputs,
}

/// What was heard, and how listening ended.
type Ended = (Tally, Result<()>);

impl Session<'_> {
    /// Prints until the line ends or is lost, the time is over, or Ctrl-C.
    fn listen(&mut self, source: &Source, settings: &Settings) -> Result<Ended> {
        let mut line = TelemetryLine::open(source.clone())?;
        if source.is_device() {
            line.send(&Request::Hello)?;
        }
        if let Some(every) = settings.stream {
            line.send(&Request::Stream { every })?;
        }
        let mut listener = Listener::default();
        let heard = self.print(&line, &mut listener, source, settings);
        if settings.stream.is_some() && heard.is_ok() {
            // A line that the other end has closed asks for nothing more.
            let _ = line.send(&Request::Stream { every: 0 });
        }
        Ok((listener.tally(), heard))
    }

    fn print(
        &mut self,
        line: &TelemetryLine,
        listener: &mut Listener,
        source: &Source,
        settings: &Settings,
    ) -> Result<()> {
        let begun = Instant::now();
        let mut silent = source.is_device();
        while !is_over(begun, settings) {
            match line.next(WAIT)? {
                Piece::Bytes(bytes) => {
                    let heard = listener.hear(&bytes);
                    self.show(&Caught {
                        bytes,
                        heard,
                        news: None,
                    })?;
                }
                Piece::Nothing => {}
                Piece::End => break,
            }
            if silent && listener.tally().messages > 0 {
                silent = false;
            }
            if silent && begun.elapsed() > SILENCE {
                silent = false;
                eprintln!("{}", silence(&listener.tally()));
            }
        }
        Ok(())
    }

    /// The same with a line that is opened again, and a word when it was lost and when it is back.
    fn follow(&mut self, source: &Source, settings: &Settings) -> Result<Ended> {
        let wanted = settings.stream.map_or(Wanted::Nothing, Wanted::Every);
        let mut line = SteadyLine::open(source.clone(), wanted)?;
        let begun = Instant::now();
        let mut lost = false;
        let heard = loop {
            if is_over(begun, settings) {
                break Ok(());
            }
            let caught = match line.next(WAIT) {
                Ok(caught) => caught,
                Err(e) => break Err(e),
            };
            if let Err(e) = self.show(&caught) {
                break Err(e);
            }
            match caught.news {
                Some(News::Lost(why)) => {
                    lost = true;
                    eprintln!(
                        "jointwatch: the line is lost and tried again: {}",
                        printable::message(&why)
                    );
                }
                Some(News::Open) if lost => eprintln!("jointwatch: the line is back"),
                _ => {}
            }
        };
        let tally = line.tally();
        line.close();
        Ok((tally, heard))
    }

    fn show(&mut self, caught: &Caught) -> Result<()> {
        let text = self.outputs.keep(caught)?;
        match text.strip_suffix('\n') {
            Some(lines) => self.console.say(lines),
            None => Ok(()),
        }
    }

    /// The last line: what was heard altogether.
    fn end(&mut self, tally: &Tally) -> Result<()> {
        self.outputs.end(tally)?;
        self.console.say(tally.to_string())
    }
}

/// Whether the time is over, or Ctrl-C was pressed.
fn is_over(begun: Instant, settings: &Settings) -> bool {
    let most = settings.seconds;
    INTERRUPTED.load(Ordering::Relaxed)
        || most.is_some_and(|most| begun.elapsed().as_secs_f64() >= most)
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
