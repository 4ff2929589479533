//! The lines of the mains in the force channels, as they lie in a rig block: what the device takes out, then the same in SI.

use super::{HUMS_OFFSET, LINES_OFFSET, Refusal, Seen};
use crate::base::hum::Hum;
use crate::chain::Chain;
use crate::chain::adaptive_notch::AdaptiveNotch;
use crate::wire::layout::{Field, Reader, laid_out};
use crate::wire::rig::RigAxis;

/// Both axes; all zero for a force channel without a line.
pub(super) type LinesMessage = [AdaptiveNotch; 2];
/// Both axes in SI, for people and the host.
pub(super) type HumsMessage = [HumMessage; 2];

laid_out! {
#[derive(Clone, Copy)]
pub(super) struct HumMessage {
    frequency_hz: f64,
    amplitude: f64,
}
}

/// Puts the lines in `bytes` into a chain that has everything else.
#[inline(never)]
pub(super) fn put(bytes: &[u8], chain: &mut Chain, seen: &mut Seen) {
    let mut reader = Reader::new(bytes);
    chain.put_lines(|| {
        let line = AdaptiveNotch::read(&mut reader);
        if !line.is_usable() {
            let field = "line of the mains in a force channel";
            seen.say(Refusal::Field { field, seen: 1 });
        }
        line
    });
    let used = chain.axes() * AdaptiveNotch::LEN;
    seen.zeros(LINES_OFFSET + used, bytes.get(used..).unwrap_or_default());
}

/// The lines of a rig in SI.
pub(super) fn hums(axes: &[RigAxis]) -> HumsMessage {
    let mut hums = [Hum::NONE; 2];
    for (hum, axis) in hums.iter_mut().zip(axes) {
        *hum = axis.hum;
    }
    // A zero has one form: this makes that of a negative one.
    hums.map(|hum| HumMessage {
        frequency_hz: hum.frequency_hz + 0.0,
        amplitude: hum.amplitude + 0.0,
    })
}

/// Puts the lines in SI in `bytes` into a rig; what they hold is checked by the caller.
pub(super) fn put_hums(bytes: &[u8], axes: &mut [RigAxis], seen: &mut Seen) {
    let hums = HumsMessage::read(&mut Reader::new(bytes));
    for (number, hum) in hums.iter().enumerate() {
        let Some(axis) = axes.get_mut(number) else {
            let from = number * HumMessage::LEN;
            seen.zeros(HUMS_OFFSET + from, bytes.get(from..).unwrap_or_default());
            continue;
        };
        seen.signless(hum.frequency_hz);
        seen.signless(hum.amplitude);
        axis.hum = Hum {
            frequency_hz: hum.frequency_hz,
            amplitude: hum.amplitude,
        };
    }
}
