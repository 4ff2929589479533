//! The host's end of a line to a device: requests go out with a number, reports come in, and
//! silence is no error.

use crate::text::error::{Error, Result};
use jointwatch_shared::wire::telemetry::{Decoder, MAX_FRAME, Report, Request, encode};
use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

/// A line that requests go over and reports come from.
///
/// A read of it that brings nothing gives no bytes, or fails as timed out.
pub(super) struct Line<'a, L> {
    line: &'a mut L,
    decoder: Decoder<Report>,
    sequence: u16,
    /// What to do about a line that broke, beside plugging it in.
    cure: &'static str,
}

impl<'a, L: Read + Write> Line<'a, L> {
    pub(super) fn new(line: &'a mut L, cure: &'static str) -> Self {
        Self {
            line,
            decoder: Decoder::default(),
            sequence: 0,
            cure,
        }
    }

    fn broken(&self, why: &std::io::Error) -> Error {
        Error::failed(format!(
            "the line to the device broke ({why}); plug it in and {}",
            self.cure
        ))
    }

    /// Sends a request; gives its number.
    pub(super) fn send(&mut self, request: &Request) -> Result<u16> {
        let number = self.sequence;
        self.sequence = self.sequence.wrapping_add(1);
        let mut room = [0; MAX_FRAME];
        let frame = encode(request, number, &mut room)
            .map_err(|_| Error::failed("a request did not fit into a frame"))?;
        let sent = self.line.write_all(frame);
        let sent = sent.and_then(|()| self.line.flush());
        sent.map_err(|e| self.broken(&e))?;
        Ok(number)
    }

    /// Reads until a report is wanted or so much time is over.
    pub(super) fn heard<T>(
        &mut self,
        wait: Duration,
        mut wanted: impl FnMut(Report) -> Option<T>,
    ) -> Result<Option<T>> {
        let begun = Instant::now();
        let mut found = None;
        while found.is_none() && begun.elapsed() < wait {
            self.read(|report| {
                if let Some(one) = wanted(report) {
                    found = Some(one);
                }
            })?;
        }
        Ok(found)
    }

    /// Reads once, and hands on every report that is whole then; gives how many bytes came.
    pub(super) fn read(&mut self, mut each: impl FnMut(Report)) -> Result<usize> {
        let mut bytes = [0; 256];
        let count = match self.line.read(&mut bytes) {
            Ok(count) => count,
            Err(e)
                if matches!(
                    e.kind(),
                    ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted
                ) =>
            {
                0
            }
            Err(e) => return Err(self.broken(&e)),
        };
        for &byte in &bytes[..count] {
            if let Some(Ok(frame)) = self.decoder.push(byte) {
                each(frame.message);
            }
        }
        Ok(count)
    }
}
