//! The verdict: which of what is wrong is told, a piece at a time.

use super::level::CAUSES;
use super::limits::CHANNELS;
use super::verdict::{Cause, State, Verdict};
use super::{Monitor, MonitorState, REVIEW, permille_of};

/// The rate of faults of a sensor that makes the verdict suspect (0.5 %) and raises the alarm (10 %), in 2⁻¹⁶; half of
/// it ends them.
const FAULT_RATES: [i32; 2] = [328, 6554];

/// A verdict that is being come to.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Review {
    pub(super) verdict: Verdict,
    /// Of the change of the joint that it names: how grave it is, whether it has a direction, whether it was said before, how far it is.
    preference: (State, bool, bool, u16),
}

impl Monitor {
    /// A piece of the state machine.
    pub(super) fn review(&self, state: &mut MonitorState) {
        let axis = REVIEW.saturating_sub(state.to_end);
        state.to_end -= 1;
        if axis == 0 {
            self.review_range(state);
        }
        if axis < 2 {
            self.review_joint(state, axis);
        } else {
            review_sensors(state);
            state.verdict = state.review.verdict;
        }
    }

    /// What is to be said where neither joint nor sensors are ill.
    fn review_range(&self, state: &mut MonitorState) {
        let mut verdict = Verdict {
            state: State::Healthy,
            cause: Cause::AsExpected,
            ..Verdict::default()
        };
        if !state.moved {
            verdict.state = State::Unjudged;
            verdict.cause = if state.blocks == 0 {
                Cause::Starting
            } else {
                Cause::TooGentle
            };
        }
        let limit = i32::from(self.limits.outside_permille) * 65;
        state.outside_state = match state.outside_rate {
            rate if rate >= limit => State::Suspect,
            rate if state.outside_state == State::Suspect && rate >= limit / 2 => State::Suspect,
            _ => State::Healthy,
        };
        if state.outside_state == State::Suspect {
            verdict = Verdict {
                state: State::Suspect,
                cause: Cause::OutsideRange,
                permille: permille_of(state.outside_rate),
                ..Verdict::default()
            };
        }
        state.review = Review {
            verdict,
            preference: (State::Suspect, false, false, 0),
        };
    }

    /// Puts a change of the joint on one axis into the verdict where that is as grave as what stands there: a stiffness or a friction
    /// rather than an error that grew, and what was said before rather than something else.
    fn review_joint(&self, state: &mut MonitorState, axis: u8) {
        let (before, number) = (state.verdict, usize::from(axis));
        let Review {
            verdict,
            preference,
        } = &mut state.review;
        let (Some(levels), Some(limits)) =
            (state.levels.get_mut(number), self.limits.axes.get(number))
        else {
            return;
        };
        for ((level, cause), side) in levels.iter_mut().zip(CAUSES).zip(limits.sides()) {
            level.state = level.next(side);
            if level.state < State::Suspect {
                continue;
            }
            let permille = level.permille(side);
            let told = before.cause == cause && before.axis == axis;
            let own = (level.state, cause != Cause::ErrorGrew, told, permille);
            if own > *preference && level.state >= verdict.state {
                *preference = own;
                *verdict = Verdict {
                    state: level.state,
                    cause,
                    axis,
                    channel: 0,
                    permille,
                };
            }
        }
    }
}

/// Puts a fault of a sensor into the verdict where that is as grave as what stands there.
fn review_sensors(state: &mut MonitorState) {
    let (verdict, worst) = (&mut state.review.verdict, state.sensors.worst());
    let [suspect, alarm] = FAULT_RATES;
    let over = |limit: i32, was: bool| worst.rate >= if was { limit / 2 } else { limit };
    state.sensor_state = if over(alarm, state.sensor_state == State::Alarm) {
        State::Alarm
    } else if over(suspect, state.sensor_state >= State::Suspect) {
        State::Suspect
    } else {
        State::Healthy
    };
    if state.sensor_state >= State::Suspect && state.sensor_state >= verdict.state {
        let bit = worst.channels.trailing_zeros() as u8;
        let (axis, channel) = if bit < CHANNELS as u8 {
            (0, bit)
        } else {
            (1, (bit - CHANNELS as u8).min(CHANNELS as u8 - 1))
        };
        *verdict = Verdict {
            state: state.sensor_state,
            cause: worst.cause,
            axis,
            channel,
            permille: permille_of(worst.rate),
        };
    }
}
