//! The verdict: which of what is wrong is told, per axis and of the whole joint.

use super::level::CAUSES;
use super::limits::CHANNELS;
use super::sensors::SensorFault;
use super::verdict::{Cause, State, Verdict};
use super::{Monitor, MonitorState, permille_of};

/// The rate of faults of a sensor that makes the verdict suspect (0.5 %) and raises the alarm (10
/// %), in 2⁻¹⁶; half of it ends them.
const FAULT_RATES: [i32; 2] = [328, 6554];

/// What comes first of two reasons that are equally grave: how much they are judged, the range, the
/// joint, a sensor; of the joint whether it is a gross change, whether it has a direction, whether
/// it was said before, and how far it is.
type Rank = (u8, u8, bool, bool, bool, u16);

fn rank(verdict: &Verdict, before: &Verdict) -> Rank {
    let cause = verdict.cause;
    let kind = match cause {
        Cause::OutsideRange => 1,
        cause if cause.is_damage() => 2,
        cause if cause.is_sensor() => 3,
        _ => 0,
    };
    let gross = matches!(cause, Cause::ForceGone | Cause::ForceUnexpected);
    let told = before.cause == cause && before.axis == verdict.axis;
    let directed = kind == 2 && cause != Cause::ErrorGrew;
    let far = if kind == 2 { verdict.permille } else { 0 };
    (verdict.state.gravity(), kind, gross, directed, told, far)
}

/// The graver of two verdicts, the first of two that are alike.
fn graver(one: Verdict, other: Verdict, before: &Verdict) -> Verdict {
    if rank(&other, before) > rank(&one, before) {
        other
    } else {
        one
    }
}

impl Monitor {
    /// Comes to the verdicts of the axes and to that of the joint.
    pub(super) fn review(&self, state: &mut MonitorState) {
        let worst = state.sensors.worst();
        state.sensor_state = sensor_state(&worst, state.sensor_state);
        let before = state.verdict;
        let mut joint: Option<Verdict> = None;
        for number in 0..self.limits.axes.len().min(2) {
            let axis = number as u8 & 1;
            let own = usize::from(axis);
            let mut verdict = self.of_range(state, axis);
            let told = state.axes[own].verdict;
            for found in self.of_joint(state, axis) {
                verdict = graver(verdict, found, &told);
            }
            if let Some(found) = of_sensors(&worst, state.sensor_state, axis) {
                verdict = graver(verdict, found, &told);
            }
            state.axes[own].verdict = verdict;
            joint = Some(match joint {
                Some(first) => graver(first, verdict, &before),
                None => verdict,
            });
        }
        state.verdict = joint.unwrap_or_default();
    }

    /// What is to be said of an axis where neither joint nor sensors are ill.
    fn of_range(&self, state: &mut MonitorState, axis: u8) -> Verdict {
        let own = &mut state.axes[usize::from(axis & 1)];
        let limit = i32::from(self.limits.outside_permille) * 65;
        let least = if own.is_outside { limit / 2 } else { limit };
        own.is_outside = own.outside_rate >= least;
        let outside = permille_of(own.outside_rate);
        let (said, cause, permille) = if own.is_outside {
            (State::Suspect, Cause::OutsideRange, outside)
        } else if own.judged.is_healthy() {
            (State::Healthy, Cause::AsExpected, 0)
        } else if own.judged.is_starting() {
            (State::Unjudged, Cause::Starting, 0)
        } else {
            match own.judged.reason() {
                Cause::OutsideRange => (State::Unjudged, Cause::OutsideRange, outside),
                cause => (State::Unjudged, cause, own.judged.permille()),
            }
        };
        Verdict {
            state: said,
            cause,
            axis,
            channel: 0,
            permille,
        }
    }

    /// The changes of the joint on one axis that are suspect or worse.
    fn of_joint(&self, state: &mut MonitorState, axis: u8) -> impl Iterator<Item = Verdict> {
        let number = usize::from(axis & 1);
        let mut found = [None; CAUSES.len()];
        if let Some(limits) = self.limits.axes.get(number) {
            let all = state.levels[number].iter_mut().zip(limits.sides());
            for ((place, (level, side)), cause) in found.iter_mut().zip(all).zip(CAUSES) {
                level.review(side);
                if level.state >= State::Suspect {
                    *place = Some(Verdict {
                        state: level.state,
                        cause,
                        axis,
                        channel: level.onset.tag(),
                        permille: level.permille(side),
                    });
                }
            }
        }
        found.into_iter().flatten()
    }
}

/// What a sensor's fault makes of the verdict; it ends at half of what it began at.
fn sensor_state(worst: &SensorFault, was: State) -> State {
    let [suspect, alarm] = FAULT_RATES;
    let over = |limit: i32, was: bool| worst.rate >= if was { limit / 2 } else { limit };
    if over(alarm, was == State::Alarm) {
        State::Alarm
    } else if over(suspect, was >= State::Suspect) {
        State::Suspect
    } else {
        State::Healthy
    }
}

/// The fault of a sensor, where it is one of this axis.
fn of_sensors(worst: &SensorFault, state: State, axis: u8) -> Option<Verdict> {
    let own = (worst.channels >> (CHANNELS as u8 * (axis & 1))) & ((1 << CHANNELS) - 1);
    (state >= State::Suspect && own != 0).then(|| Verdict {
        state,
        cause: worst.cause,
        axis,
        channel: own.trailing_zeros() as u8,
        permille: permille_of(worst.rate),
    })
}
