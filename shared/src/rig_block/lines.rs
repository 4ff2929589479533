//! The lines of the mains in the force channels, as they lie in a rig block: what the device takes out, then the same in SI.

use super::{LINES_OFFSET, Seen};
use crate::error::{Checks, Error};
use crate::hum::Hum;
use crate::layout::laid_out;
use crate::pipeline::Chain;
use crate::pipeline::line::Line;

laid_out! {
/// Both axes; all zero for a force channel without a line.
pub(super) struct LinesMessage {
    lines: [Line; 2],
    reserved: [u8; 2],
}
}

laid_out! {
/// Both axes in SI, for people and the host.
pub(super) struct HumMessage {
    axis: [AxisMessage; 2],
}
}

laid_out! {
#[derive(Clone, Copy)]
struct AxisMessage {
    frequency_hz: f64,
    amplitude: f64,
}
}

impl LinesMessage {
    pub(super) fn of(chain: &Chain) -> Self {
        Self {
            lines: chain.lines(),
            reserved: [0; 2],
        }
    }

    /// Puts the lines into a chain that has everything else.
    #[inline(never)]
    pub(super) fn put(&self, chain: &mut Chain, seen: &mut Seen) -> Result<(), Error> {
        seen.zeros(LINES_OFFSET + Self::END, &self.reserved);
        let mut checks = Checks::new();
        for (number, line) in self.lines.iter().enumerate() {
            line.check(&mut checks);
            let wrong = number >= chain.axes() && !line.is_none();
            let quantity = "lines of an axis that is not there";
            checks.whole(quantity, i32::from(wrong), 0, 0);
        }
        chain.put_lines(&self.lines);
        checks.done()
    }

    const END: usize = <Self as crate::layout::Field>::LEN - 2;
}

impl HumMessage {
    pub(super) fn of(hums: [Hum; 2]) -> Self {
        // A zero has one form: this makes that of a negative one.
        let axis = |hum: Hum| AxisMessage {
            frequency_hz: hum.frequency_hz + 0.0,
            amplitude: hum.amplitude + 0.0,
        };
        Self {
            axis: hums.map(axis),
        }
    }

    /// Both lines; what they hold is checked by the caller.
    pub(super) fn hums(&self, seen: &mut Seen) -> [Hum; 2] {
        self.axis.map(|axis| {
            for value in [axis.frequency_hz, axis.amplitude] {
                seen.signless(value);
            }
            Hum {
                frequency_hz: axis.frequency_hz,
                amplitude: axis.amplitude,
            }
        })
    }
}
