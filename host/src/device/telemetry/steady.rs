//! A line that is opened again when it was lost, and the device at its other end asked again for
//! what is wanted of it.

use super::line::{Piece, Source, TelemetryLine};
use super::listen::{Heard, Listener, Tally};
use crate::text::error::Result;
use jointwatch_shared::wire::telemetry::{Answered, Occasion, Report, Request};
use std::time::{Duration, Instant};

/// How long to wait before a lost line is tried again.
const AGAIN: Duration = Duration::from_secs(1);
/// Samples per second that are asked for where nobody says how many: enough for every force that a
/// screen can show.
const SHOWN_HZ: f64 = 500.0;
/// Statuses without an answer after which a request is repeated: two seconds.
const UNANSWERED: u32 = 20;

/// What became of the line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum News {
    /// It is open, for the first time or again.
    Open,
    /// It is lost, for this reason, and tried again.
    Lost(String),
    /// There is no more.
    End,
}

/// What a wait for the line gave.
#[derive(Clone, Debug, Default)]
pub struct Caught {
    /// The bytes as they arrived.
    pub bytes: Vec<u8>,
    /// What was in them.
    pub heard: Vec<Heard>,
    /// What became of the line.
    pub news: Option<News>,
}

/// Which samples are wanted of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// No samples are asked for.
    Nothing,
    /// One of every so many samples.
    Every(u16),
    /// As many as a screen can show, and fewer where the line is too slow.
    Shown,
}

/// A line that comes back.
pub struct SteadyLine {
    source: Source,
    line: Option<TelemetryLine>,
    opened: bool,
    again: Instant,
    listener: Listener,
    asker: Asker,
}

impl SteadyLine {
    /// Opens it; that has to succeed, and only a line that was lost later is tried again.
    ///
    /// # Errors
    /// As [`TelemetryLine::open`].
    pub fn open(source: Source, wanted: Wanted) -> Result<Self> {
        let line = TelemetryLine::open(source.clone())?;
        Ok(Self {
            source,
            line: Some(line),
            opened: true,
            again: Instant::now(),
            listener: Listener::default(),
            asker: Asker::new(wanted),
        })
    }

    /// Where the line leads, as it was opened.
    pub fn source(&self) -> &Source {
        &self.source
    }

    /// What was heard so far.
    pub fn tally(&self) -> Tally {
        self.listener.tally()
    }

    /// Waits for bytes or for the line, but not for longer than this.
    ///
    /// # Errors
    /// When what is read is no device's line and breaks.
    pub fn next(&mut self, wait: Duration) -> Result<Caught> {
        let Some(line) = &self.line else {
            return Ok(self.open_again(wait));
        };
        if std::mem::take(&mut self.opened) {
            return Ok(self.greet());
        }
        match line.next(wait) {
            Ok(Piece::Bytes(bytes)) => Ok(self.take(bytes)),
            Ok(Piece::Nothing) => Ok(Caught::default()),
            Ok(Piece::End) if self.source.is_device() => {
                Ok(self.lose("the other end closed it".to_string()))
            }
            Ok(Piece::End) => Ok(Caught::of(News::End)),
            Err(e) if self.source.is_device() => Ok(self.lose(e.sentence)),
            Err(e) => Err(e),
        }
    }

    /// Asks the device to send no more samples, where it was asked for some.
    pub fn close(mut self) {
        if self.asker.asks_for_samples()
            && let Some(line) = &mut self.line
        {
            // A device that is gone sends none either.
            let _ = line.send(&Request::Stream { every: 0 });
        }
    }

    fn take(&mut self, bytes: Vec<u8>) -> Caught {
        let heard = self.listener.hear(&bytes);
        let mut request = None;
        for heard in &heard {
            request = self.asker.hear(heard).or(request);
        }
        let mut caught = Caught {
            bytes,
            heard,
            news: None,
        };
        if let Some(request) = request
            && self.source.is_device()
        {
            caught.news = self.ask(&request).news;
        }
        caught
    }

    fn greet(&mut self) -> Caught {
        if !self.source.is_device() {
            return Caught::of(News::Open);
        }
        let lost = self.ask(&Request::Hello);
        match lost.news {
            None => Caught::of(News::Open),
            Some(_) => lost,
        }
    }

    fn ask(&mut self, request: &Request) -> Caught {
        let Some(line) = &mut self.line else {
            return Caught::default();
        };
        match line.send(request) {
            Ok(sequence) => {
                self.asker.sent(sequence);
                Caught::default()
            }
            Err(e) => self.lose(e.sentence),
        }
    }

    fn lose(&mut self, why: String) -> Caught {
        self.line = None;
        self.again = Instant::now() + AGAIN;
        Caught::of(News::Lost(why))
    }

    fn open_again(&mut self, wait: Duration) -> Caught {
        let left = self.again.saturating_duration_since(Instant::now());
        if left > wait {
            std::thread::sleep(wait);
            return Caught::default();
        }
        std::thread::sleep(left);
        match TelemetryLine::open(self.source.clone()) {
            Ok(line) => {
                (self.line, self.opened) = (Some(line), true);
                self.listener.begin_anew();
                self.asker = Asker::new(self.asker.wanted);
            }
            Err(_) => self.again = Instant::now() + AGAIN,
        }
        Caught::default()
    }
}

impl Caught {
    fn of(news: News) -> Self {
        Self {
            news: Some(news),
            ..Self::default()
        }
    }
}

/// Asks a device to introduce itself and to stream, and again when it does not answer or has
/// restarted.
#[derive(Clone, Debug)]
struct Asker {
    wanted: Wanted,
    /// Samples per second, once the device has told.
    rate_hz: Option<f64>,
    /// Only every so many of the samples, for a line that is too slow.
    fewer: u16,
    /// The number of the last request, which is one for samples or for an introduction.
    last: Option<u16>,
    answered: bool,
    statuses: u32,
}

impl Asker {
    fn new(wanted: Wanted) -> Self {
        Self {
            wanted,
            rate_hz: None,
            fewer: 1,
            last: None,
            answered: false,
            statuses: 0,
        }
    }

    fn asks_for_samples(&self) -> bool {
        self.wanted != Wanted::Nothing
    }

    fn sent(&mut self, sequence: u16) {
        (self.last, self.answered, self.statuses) = (Some(sequence), false, 0);
    }

    /// What to ask for after this.
    fn hear(&mut self, heard: &Heard) -> Option<Request> {
        let Heard::Message(received) = heard else {
            return None;
        };
        match &received.message {
            Report::Hello(hello) => {
                let first = self.rate_hz.is_none();
                // Without a rate nothing but every sample can be asked for.
                let rig = hello.rig.as_ref().map(|rig| rig.sample_rate_hz);
                self.rate_hz = Some(rig.unwrap_or(0.0));
                let anew = first || hello.occasion != Occasion::Asked;
                anew.then(|| self.stream()).flatten()
            }
            Report::Answer(answer) if Some(answer.to) == self.last => {
                self.answered = true;
                let too_slow = answer.answered == Answered::LineTooSlow;
                if !too_slow || self.wanted != Wanted::Shown || self.fewer > 1000 {
                    return None;
                }
                self.fewer *= 2;
                self.stream()
            }
            Report::Status(_) if !self.answered => {
                self.statuses += 1;
                let again = self.statuses.is_multiple_of(UNANSWERED);
                again.then(|| match self.rate_hz {
                    None => Some(Request::Hello),
                    Some(_) => self.stream(),
                })?
            }
            _ => None,
        }
    }

    fn stream(&self) -> Option<Request> {
        let every = match self.wanted {
            Wanted::Nothing => return None,
            Wanted::Every(every) => every,
            Wanted::Shown => {
                let every = (self.rate_hz.unwrap_or(0.0) / SHOWN_HZ).ceil();
                // `as` saturates; a rate that is none comes to 0.
                (every as u16).max(1).saturating_mul(self.fewer)
            }
        };
        Some(Request::Stream { every })
    }
}
