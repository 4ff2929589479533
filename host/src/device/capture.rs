//! Fetching the counts that a device keeps around an alarm, piece by piece, over its serial line.

use super::line::Line;
use super::telemetry::frames::Sender;
use crate::text::error::{Error, Result};
use jointwatch_shared::wire::telemetry::{Answered, CapturePiece, Hello, Report, Request};
use std::io::{Read, Write};
use std::time::{Duration, Instant};

/// How long to wait for an answer before the request is sent again.
const WAIT: Duration = Duration::from_millis(300);
/// How often a request is sent.
const TRIES: u32 = 20;
/// How long to wait for a device that still records what follows its alarm.
const RECORDING: Duration = Duration::from_secs(30);

/// The counts around an alarm, as the device sent them.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Fetched {
    /// The frames: who the device is, and every piece.
    #[serde(skip)]
    pub frames: Vec<u8>,
    /// The sample, counted since the restart, at which the alarm was raised.
    pub alarm: u64,
    /// Pieces in which the counts came.
    pub pieces: u16,
    /// Requests that were sent again.
    pub repeated: u32,
}

/// Fetches everything; `progress` is told pieces, and of how many.
///
/// A read of `line` that brings nothing gives no bytes, or fails as timed out.
///
/// # Errors
/// [`crate::text::error::Kind::Failed`] when the device does not answer, when it keeps no counts,
/// and when it keeps those of another alarm before all are fetched.
pub fn fetch(
    line: &mut (impl Read + Write),
    mut progress: impl FnMut(u16, u16),
) -> Result<Fetched> {
    let mut asking = Asking {
        line: Line::new(line, "fetch again"),
        repeated: 0,
    };
    let mut frames = Sender::default();
    let hello = asking.hello()?;
    frames.send(&Report::Hello(hello));
    let first = asking.first_piece()?;
    let (alarm, pieces) = (first.alarm, first.pieces);
    frames.send(&Report::Capture(first));
    for number in 1..pieces {
        progress(number, pieces);
        let piece = match asking.piece(number)? {
            Ok(piece) if piece.alarm == alarm => piece,
            _ => {
                return Err(Error::failed(
                    "the device forgot the counts before all were fetched, for its alarm was acknowledged or it has restarted",
                ));
            }
        };
        frames.send(&Report::Capture(piece));
    }
    Ok(Fetched {
        frames: frames.bytes,
        alarm,
        pieces,
        repeated: asking.repeated,
    })
}

/// The host's end of the line.
struct Asking<'a, L> {
    line: Line<'a, L>,
    repeated: u32,
}

impl<L: Read + Write> Asking<'_, L> {
    fn hello(&mut self) -> Result<Hello> {
        self.ask(&Request::Hello, |_, report| match report {
            Report::Hello(hello) => Some(hello),
            _ => None,
        })
    }

    /// The first piece, as soon as the device has recorded all.
    fn first_piece(&mut self) -> Result<CapturePiece> {
        let begun = Instant::now();
        loop {
            match self.piece(0)? {
                Ok(piece) => return Ok(piece),
                Err(Answered::Busy) if begun.elapsed() < RECORDING => std::thread::sleep(WAIT),
                Err(Answered::Busy) => {
                    return Err(Error::failed(
                        "the device still records what follows its alarm; ask again in some seconds",
                    ));
                }
                Err(_) => {
                    return Err(Error::failed(
                        "the device keeps no counts: it has raised no alarm since its restart or since the last one was \
                         acknowledged, or it has no memory for them",
                    ));
                }
            }
        }
    }

    fn piece(&mut self, number: u16) -> Result<std::result::Result<CapturePiece, Answered>> {
        self.ask(
            &Request::Capture { piece: number },
            |to, report| match report {
                Report::Capture(piece) if piece.piece == number => Some(Ok(piece)),
                Report::Answer(answer) if answer.to == to => Some(Err(answer.answered)),
                _ => None,
            },
        )
    }

    /// Sends a request until an answer comes.
    fn ask<T>(
        &mut self,
        request: &Request,
        wanted: impl Fn(u16, Report) -> Option<T>,
    ) -> Result<T> {
        for attempt in 0..TRIES {
            self.repeated += u32::from(attempt > 0);
            let to = self.line.send(request)?;
            if let Some(found) = self.line.heard(WAIT, |report| wanted(to, report))? {
                return Ok(found);
            }
        }
        Err(Error::failed(format!(
            "the device did not answer {TRIES} requests in a row; check the port, the baud rate and that its firmware is not older \
             than this program"
        )))
    }
}
