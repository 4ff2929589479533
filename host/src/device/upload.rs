//! Sending a signed model to the device over a line that loses and damages frames.
//!
//! One request is under way at a time. When its answer does not come, it is sent again; the device
//! answers a step that it has taken already as it did the first time. A device that restarted in
//! the middle is begun with again, and an upload that this program did not finish goes on where it
//! stopped.

use super::line::Line;
use crate::device::signing::SignedModel;
use crate::text::error::{Error, Result};
use jointwatch_shared::wire::telemetry::{
    MAX_CHUNK, Refusal, Report, Request, Signature, Slot, UploadReply, UploadRequest,
};
use std::io::{Read, Write};
use std::time::{Duration, Instant};

/// How long to wait for answers.
#[derive(Clone, Copy, Debug)]
pub struct Patience {
    /// Reads in a row that bring nothing before a request is sent again. A serial port's read
    /// waits [`READ_TIMEOUT`].
    pub silent_reads: u32,
    /// The same while the device erases a sector and while it checks a signature.
    pub silent_reads_at_work: u32,
    /// The longest wait while other frames come in all the time.
    pub longest: Duration,
    /// How often a request is sent before the device is given up.
    pub tries: u32,
    /// How often the upload is begun anew, because the device restarted or got other bytes.
    pub beginnings: u32,
}

/// How long a read of a serial port waits for the first byte.
pub const READ_TIMEOUT: Duration = Duration::from_millis(50);

impl Default for Patience {
    fn default() -> Self {
        Self {
            silent_reads: 10,
            // A sector takes up to 2 s to erase (DS8626, “Flash memory programming”, 128 KiB at
            // 32-bit parallelism).
            silent_reads_at_work: 80,
            longest: Duration::from_secs(8),
            tries: 30,
            beginnings: 3,
        }
    }
}

/// How an upload went.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Uploaded {
    /// Bytes of model and rig block.
    pub bytes: u32,
    /// The slot that the model went into. The device restarts by itself about a second later, and
    /// runs it on trial.
    pub slot: Option<Slot>,
    /// Where an earlier upload of the same model had stopped, if this one went on from there.
    pub went_on_at: u32,
    /// Requests that had to be sent again.
    pub repeated: u32,
}

/// Uploads a signed model; `progress` is told how many bytes the device has, after every step.
///
/// A read of `line` that brings nothing gives no bytes, or fails as timed out.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the device refuses the model,
/// [`crate::text::error::Kind::Failed`] when it does not answer or cannot take a model now.
pub fn upload(
    line: &mut (impl Read + Write),
    model: &SignedModel,
    patience: Patience,
    mut progress: impl FnMut(u32),
) -> Result<Uploaded> {
    let mut device = UploadSession {
        line: Line::new(line, "upload again"),
        patience,
        repeated: 0,
    };
    let bytes = model.content().len() as u32;
    let begin = UploadRequest::Begin {
        header: *model.header(),
        signature: model.signature().map(|bytes| Signature::new(*bytes)),
    };
    let mut went_on_at = None;
    for beginning in 1..=patience.beginnings {
        let last = beginning == patience.beginnings;
        let mut next = match device.ask(&begin, |reply| {
            matches!(reply, UploadReply::Accepted { .. })
        })? {
            UploadReply::Accepted { next } => next,
            other => return Err(refusal(other)),
        };
        let _ = went_on_at.get_or_insert(next);
        progress(next);
        match device.send(model.content(), &mut next, &mut progress)? {
            None => {}
            Some(UploadReply::Refused(Refusal::NotBegun)) if !last => continue,
            Some(other) => return Err(refusal(other)),
        }
        match device.ask(&UploadRequest::Finish, |reply| {
            matches!(reply, UploadReply::Activated { .. })
        })? {
            UploadReply::Activated { slot, .. } => {
                return Ok(Uploaded {
                    bytes,
                    slot,
                    went_on_at: went_on_at.unwrap_or(0),
                    repeated: device.repeated,
                });
            }
            UploadReply::Refused(
                Refusal::NotBegun | Refusal::Checksum { .. } | Refusal::Incomplete { .. },
            ) if !last => {}
            other => return Err(refusal(other)),
        }
    }
    Err(Error::failed(format!(
        "the upload was begun {} times and never came to its end; look at the device's supply and the line",
        patience.beginnings
    )))
}

/// The device at the other end of the line.
struct UploadSession<'a, L> {
    line: Line<'a, L>,
    patience: Patience,
    repeated: u32,
}

impl<L: Read + Write> UploadSession<'_, L> {
    /// Sends the content from `next` on; gives the refusal that stopped it, if one did.
    fn send(
        &mut self,
        content: &[u8],
        next: &mut u32,
        progress: &mut impl FnMut(u32),
    ) -> Result<Option<UploadReply>> {
        while let Some(rest) = content
            .get(*next as usize..)
            .filter(|rest| !rest.is_empty())
        {
            let offset = *next;
            let chunk = UploadRequest::Chunk {
                offset,
                data: rest.iter().copied().take(MAX_CHUNK).collect(),
            };
            // An answer that does not go beyond this chunk's beginning belongs to an earlier one
            // that was sent twice.
            let reply = self.ask(
                &chunk,
                |reply| matches!(reply, UploadReply::Accepted { next } if *next > offset),
            )?;
            match reply {
                UploadReply::Accepted { next: now } => *next = now,
                UploadReply::Refused(Refusal::WrongOffset { next: now }) => *next = now,
                other => return Ok(Some(other)),
            }
            progress(*next);
        }
        Ok(None)
    }

    /// Sends a request until an answer comes: one that `wanted` takes, or a refusal.
    fn ask(
        &mut self,
        request: &UploadRequest,
        wanted: impl Fn(&UploadReply) -> bool,
    ) -> Result<UploadReply> {
        let silent = match request {
            UploadRequest::Begin { .. } | UploadRequest::Finish => {
                self.patience.silent_reads_at_work
            }
            _ => self.patience.silent_reads,
        };
        let request = Request::Upload(request.clone());
        for attempt in 0..self.patience.tries {
            self.repeated += u32::from(attempt > 0);
            self.line.send(&request)?;
            if let Some(reply) = self.answer(silent, &wanted)? {
                return Ok(reply);
            }
        }
        Err(Error::failed(format!(
            "the device did not answer {} requests in a row; check the port, the baud rate and that the device runs",
            self.patience.tries
        )))
    }

    /// Reads until an answer has come or patience has run out.
    fn answer(
        &mut self,
        silent: u32,
        wanted: impl Fn(&UploadReply) -> bool,
    ) -> Result<Option<UploadReply>> {
        let begun = Instant::now();
        let mut silent_reads = 0;
        while silent_reads < silent && begun.elapsed() < self.patience.longest {
            let mut answer = None;
            let count = self.line.read(|report| {
                if let Report::Upload(reply) = report
                    && (wanted(&reply) || matches!(reply, UploadReply::Refused(_)))
                {
                    answer = Some(reply);
                }
            })?;
            silent_reads = if count == 0 { silent_reads + 1 } else { 0 };
            if answer.is_some() {
                return Ok(answer);
            }
        }
        Ok(None)
    }
}

/// The sentence for an answer that ends the upload.
fn refusal(reply: UploadReply) -> Error {
    let UploadReply::Refused(why) = reply else {
        return Error::failed(
            "the device gave up the upload; something else talks to it at the same time",
        );
    };
    let sentence = format!("the device refused the model: {why}");
    match why {
        Refusal::Busy => Error::failed(
            "the device refused the model: the one that runs is still on trial; try again in a minute, when that is over in any case",
        ),
        Refusal::Length { .. }
        | Refusal::Unsigned
        | Refusal::Signature
        | Refusal::Class
        | Refusal::NotNewer { .. }
        | Refusal::Model(_)
        | Refusal::Rig(_)
        | Refusal::Mismatch => Error::data(sentence),
        _ => Error::failed(sentence),
    }
}
