//! The monitor's limits as they lie in a rig block.

use super::message::Message;
use super::{LIMITS_OFFSET, Seen};
use crate::layout::{Field, Reader, laid_out};
use crate::monitor::limits::{AxisLimits, CHANNELS, Cusum, Limits, TwoSided};
use heapless::Vec;

laid_out! {
/// The limits; all zero where there are none.
pub(super) struct LimitsMessage {
    model_checksum: u32,
    false_alarm_hours: u32,
    block: u16,
    outside_permille: u16,
    axes: u8,
    reserved: [u8; 3],
    axis: [AxisLimitsMessage; 2],
}
}

laid_out! {
/// The limits of one axis; all zero where there is none.
#[derive(Clone, Copy, Default)]
struct AxisLimitsMessage {
    force_power: u64,
    state_power: [u64; 2],
    per_octave: [i32; 3],
    error: Cusum,
    stiffer: Cusum,
    softer: Cusum,
    more_friction: Cusum,
    less_friction: Cusum,
    moving_counts: [u32; CHANNELS],
    reversed: u8,
    force_shift: u8,
    gross: [u8; 2],
}
}

impl LimitsMessage {
    pub(super) fn of(limits: &Limits) -> Self {
        let mut axis = [AxisLimitsMessage::default(); 2];
        for (place, limits) in axis.iter_mut().zip(&limits.axes) {
            *place = AxisLimitsMessage::of(limits);
        }
        Self {
            model_checksum: limits.model_checksum,
            false_alarm_hours: limits.false_alarm_hours,
            block: limits.block,
            outside_permille: limits.outside_permille,
            // Two at most.
            axes: limits.axes.len() as u8,
            reserved: [0; 3],
            axis,
        }
    }
}

impl AxisLimitsMessage {
    fn of(limits: &AxisLimits) -> Self {
        Self {
            force_power: limits.force_power,
            state_power: limits.state_power,
            per_octave: limits.per_octave,
            error: limits.error,
            stiffer: limits.stiffness.more,
            softer: limits.stiffness.less,
            more_friction: limits.friction.more,
            less_friction: limits.friction.less,
            moving_counts: limits.moving_counts,
            reversed: u8::from(limits.reversed),
            force_shift: limits.force_shift,
            gross: limits.gross,
        }
    }

    fn limits(&self, seen: &mut Seen) -> AxisLimits {
        AxisLimits {
            reversed: seen.mark("sign of the monitor's stiffness", self.reversed),
            force_shift: self.force_shift,
            force_power: self.force_power,
            state_power: self.state_power,
            per_octave: self.per_octave,
            error: self.error,
            stiffness: TwoSided {
                more: self.stiffer,
                less: self.softer,
            },
            friction: TwoSided {
                more: self.more_friction,
                less: self.less_friction,
            },
            gross: self.gross,
            moving_counts: self.moving_counts,
        }
    }
}

/// The limits in their bytes, when there are any; what they hold is checked by the caller.
#[inline(never)]
pub(super) fn read(message: &Message, bytes: &[u8], seen: &mut Seen) -> Option<Limits> {
    if !seen.mark("mark of the monitor's limits", message.limits) {
        seen.zeros(LIMITS_OFFSET, bytes);
        return None;
    }
    let limits = LimitsMessage::read(&mut Reader::new(bytes));
    seen.zeros(LIMITS_OFFSET + 13, &limits.reserved);
    let mut axes = Vec::new();
    for (number, axis) in limits.axis.iter().enumerate() {
        let offset = LIMITS_OFFSET + 16 + number * AxisLimitsMessage::LEN;
        if number < usize::from(limits.axes) {
            // Two at most, as the array that is walked.
            let _ = axes.push(axis.limits(seen));
        } else {
            let place = 16 + number * AxisLimitsMessage::LEN;
            seen.zeros(offset, bytes.get(place..).unwrap_or_default());
        }
    }
    if limits.axes > 2 {
        seen.say(super::Refusal::Field {
            field: "number of axes of the monitor's limits",
            seen: limits.axes,
        });
    }
    Some(Limits {
        model_checksum: limits.model_checksum,
        block: limits.block,
        outside_permille: limits.outside_permille,
        false_alarm_hours: limits.false_alarm_hours,
        axes,
    })
}
