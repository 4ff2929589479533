//! The messages in a stream of bytes, and what was lost on the way.

use jointwatch_shared::wire::telemetry::{Damage, Decoder, Occasion, Received, Report};
use serde::Serialize;
use std::fmt;

/// A gap in the sequence numbers that is larger than this is taken for a restart whose [`Hello`]
/// was lost: the numbers begin anew then, and never go backwards otherwise.
///
/// [`Hello`]: jointwatch_shared::wire::telemetry::Hello
const LARGEST_GAP: u16 = u16::MAX / 2;

/// Something that was heard.
#[derive(Clone, Debug, PartialEq)]
#[allow(
    clippy::large_enum_variant,
    reason = "one at a time is looked at, and dropped"
)]
pub enum Heard {
    /// A message whose checksum holds.
    Message(Received<Report>),
    /// So many messages were sent between the last one and the next one, and did not arrive.
    Lost(u16),
    /// The device has started anew; how many messages were lost before that is not known.
    Restarted,
    /// An undamaged frame with a message that this program does not know, by its tag.
    Unknown(u8),
}

/// What was heard, counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Tally {
    /// Bytes that arrived, in whole frames or not.
    pub bytes: u64,
    /// Messages that were decoded.
    pub messages: u64,
    /// Damaged frames. The rest of a frame that was under way when listening began is none.
    pub damaged: u64,
    /// Undamaged frames that this program does not know.
    pub unknown: u64,
    /// Messages that were sent and did not arrive, by their sequence numbers. A damaged frame is
    /// one of them.
    pub lost: u64,
    /// How often the device started anew while it was listened to.
    pub restarts: u64,
    /// Bytes after the last frame's end, as when the stream ends in the middle of one.
    pub torn_end: bool,
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} messages in {} bytes", self.messages, self.bytes)?;
        for (count, what) in [
            (self.lost, "lost on the way"),
            (self.damaged, "damaged frames"),
            (self.unknown, "frames that this program does not know"),
            (self.restarts, "restarts of the device"),
        ] {
            write!(f, ", {count} {what}")?;
        }
        f.write_str(".")?;
        if self.torn_end {
            f.write_str(" The end is in the middle of a frame.")?;
        }
        Ok(())
    }
}

/// Listens to a device.
#[derive(Clone, Debug, Default)]
pub struct Listener {
    decoder: Decoder<Report>,
    expected: Option<u16>,
    /// Whether a frame's beginning has been seen; what comes before is the rest of one.
    begun: bool,
    tally: Tally,
}

impl Listener {
    /// Takes the next bytes, and tells in order what is in them.
    pub fn hear(&mut self, bytes: &[u8]) -> Vec<Heard> {
        self.tally.bytes += bytes.len() as u64;
        let mut heard = Vec::new();
        for &byte in bytes {
            match self.decoder.push(byte) {
                None => {}
                Some(Ok(received)) => self.message(received, &mut heard),
                Some(Err(Damage::Unknown { tag })) => {
                    self.tally.unknown += 1;
                    heard.push(Heard::Unknown(tag));
                }
                Some(Err(_)) => self.tally.damaged += u64::from(self.begun),
            }
            self.begun |= byte == 0;
        }
        heard
    }

    /// The line was lost and is there again: a frame that had begun is cut off, and what was sent
    /// meanwhile is not counted as lost.
    pub fn begin_anew(&mut self) {
        (self.decoder, self.expected, self.begun) = (Decoder::default(), None, false);
    }

    /// What was heard so far.
    pub fn tally(&self) -> Tally {
        Tally {
            torn_end: self.decoder.in_frame(),
            ..self.tally
        }
    }

    fn message(&mut self, received: Received<Report>, heard: &mut Vec<Heard>) {
        let sequence = received.sequence;
        let restarts = matches!(&received.message, Report::Hello(hello)
            if hello.occasion == Occasion::Restart);
        let gap = self
            .expected
            .map(|expected| sequence.wrapping_sub(expected));
        match gap {
            // The first message, and the next one.
            None | Some(0) => {}
            Some(gap) if restarts || gap > LARGEST_GAP => {
                self.tally.restarts += 1;
                heard.push(Heard::Restarted);
                if !restarts {
                    // Numbers begin at 0.
                    self.lose(sequence, heard);
                }
            }
            Some(gap) => self.lose(gap, heard),
        }
        self.expected = Some(sequence.wrapping_add(1));
        self.tally.messages += 1;
        heard.push(Heard::Message(received));
    }

    fn lose(&mut self, count: u16, heard: &mut Vec<Heard>) {
        if count > 0 {
            self.tally.lost += u64::from(count);
            heard.push(Heard::Lost(count));
        }
    }
}
