//! One block of residuals of one axis: how large the error is beside the force, and whether it goes
//! with displacement or velocity.

use super::limits::AxisLimits;
use super::logarithm::{OCTAVE, SHARE, exp2, log2};

/// Between which forces one is counted, in the monitor's units: 128 times the validation records'
/// RMS force at least. The bounds of a number of 24 bits, to which a processor saturates in one
/// instruction.
const FORCES: [i32; 2] = [-(1 << 23), (1 << 23) - 1];

/// What of one output has to wait for the low-pass over the residual, of one axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Waiting {
    /// Displacement and velocity in 2⁻¹⁵ of their training half-range.
    states: [i16; 2],
    /// Measured force and the model's, as the output has them.
    measured: i32,
    predicted: i32,
}

/// One sample of one axis, in the monitor's units.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    states: [i16; 2],
    measured: i32,
    predicted: i32,
    /// The residual in the band.
    residual: i32,
}

/// A force in the monitor's units, rounded half up.
#[inline(always)]
fn force(value: i32, shift: u8) -> i32 {
    let rounded = crate::scalar::fixed::round_shift_32(value, u32::from(shift & 31));
    let [least, most] = FORCES;
    rounded.clamp(least, most)
}

impl Waiting {
    /// Of an axis at an output's states, measured and predicted force.
    #[inline(always)]
    pub(super) fn new([x, v]: [i32; 2], [measured, predicted]: [i32; 2]) -> Self {
        Self {
            states: [(x >> 16) as i16, (v >> 16) as i16],
            measured,
            predicted,
        }
    }

    /// With the residual of the same instant. Only what is summed up is brought into the monitor's
    /// units.
    #[inline(always)]
    pub(super) fn with(&self, residual: i32, limits: &AxisLimits) -> Sample {
        let shift = limits.force_shift;
        Sample {
            states: self.states,
            measured: force(self.measured, shift),
            predicted: force(self.predicted, shift),
            residual: force(residual, shift),
        }
    }
}

/// Sums over the residuals in the band that come within a block, in the monitor's units.
///
/// They are 2¹⁰ at most, a force at most 2²³ and a state at most 2¹⁵: no sum reaches 2⁵⁷.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sums {
    /// Σ e², e the residual in the common band.
    pub error: i64,
    /// Σ r², r the measured force at the same instants.
    pub force: i64,
    /// Σ r, from which the mean force follows.
    pub force_sum: i64,
    /// Σ u² of displacement and velocity.
    pub state: [i64; 2],
    /// Σ e·u of displacement and velocity.
    pub along: [i64; 2],
}

impl Sums {
    /// Adds one sample of an axis.
    #[inline(always)]
    pub(super) fn add(&mut self, at: &Sample) {
        let (e, r, [x, v]) = (at.residual, at.measured, at.states);
        let (x, v) = (i32::from(x), i32::from(v));
        // Widened where it is used, so that it and an addition are one instruction.
        let product = |a: i32, b: i32| i64::from(a) * i64::from(b);
        let ([power_x, power_v], [along_x, along_v]) = (&mut self.state, &mut self.along);
        self.error += product(e, e);
        self.force += product(r, r);
        self.force_sum += i64::from(r);
        *power_x += product(x, x);
        *power_v += product(v, v);
        *along_x += product(e, x);
        *along_v += product(e, v);
    }

    /// The statistics of a full block of 2^`log_values` residuals in the band.
    pub fn statistics(&self, limits: &AxisLimits, log_values: u32) -> Statistics {
        let log_values = log_values & 15;
        // log₂ of Σr² + n·P̄.
        let log_force = log2(self.force as u64 + (limits.force_power << log_values));
        let share = |input| self.share(limits, log_values, log_force, input);
        // Displacement: the joint's nonlinearity, which a model misses some of, is one of
        // displacement first of all.
        let [travel, _] = self.state;
        let [usual, _] = limits.state_power;
        let level = log2(travel as u64) - log2(usual << log_values);
        let level = level.clamp(-LEVELS * OCTAVE, LEVELS * OCTAVE);
        let [of_error, of_stiffness, of_friction] = limits.per_octave;
        let expected = |per_octave: i32| ((i64::from(per_octave) * i64::from(level)) >> 10) as i32;
        Statistics {
            level,
            error: log2(self.error as u64) - log_force - expected(of_error),
            stiffness: share(0) - expected(of_stiffness),
            friction: share(1) - expected(of_friction),
            moves: self.force as u64 >= (limits.force_power << log_values) / GENTLEST
                && level > -LEVELS * OCTAVE,
        }
    }

    /// The part of the residual that goes with the displacement (0) or the velocity (1), before the
    /// level of motion is taken off.
    fn share(&self, limits: &AxisLimits, log_values: u32, log_force: i32, input: usize) -> i32 {
        let input = input & 1;
        let (along, power) = (self.along[input], self.state[input] as u64);
        let log_state = log2(power + (limits.state_power[input] << (log_values & 15)));
        let log_share = log2(along.unsigned_abs()) - (log_force + log_state) / 2;
        let size = if along == 0 { 0 } else { exp2(log_share) };
        if (along < 0) != limits.reversed {
            -size
        } else {
            size
        }
    }
}

/// A gross change is judged where the power of the force that the model expects, or of the one that
/// is there, is at least this part of the [usual](AxisLimits::usual_power) one: a joint that has
/// lost its force is judged by the one that should be there. The other statistics are shares of the
/// measured force, and take blocks in which that has this part of the validation records' power,
/// and the travel is above the bottom of [`LEVELS`]: how large a healthy share is was not measured
/// below. Where only the model expects a force, the share is that of the model's worst moments, and
/// limits that allow for those find a small change late.
const GENTLEST: u64 = 4;

/// Sums over the residuals of a block that no fault of a sensor spoils, whether the states are
/// inside the training range or not, in the monitor's units.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GrossSums {
    /// Σ e², e the residual in the common band.
    pub error: i64,
    /// Σ r², r the measured force at the same instants.
    pub force: i64,
    /// Σ p², p the model's force at the same instants.
    pub predicted: i64,
}

/// What a block says of a gross change of the force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gross {
    /// 0: less force than the model expects; 1: more.
    pub side: usize,
    /// log₂(Σe²/(the larger of Σr² and Σp² + the usual power)) in 1/1024 octaves: 0 where all of a
    /// large force is missing, or none was expected.
    pub value: i32,
}

impl GrossSums {
    /// Adds one sample of an axis.
    #[inline(always)]
    pub(super) fn add(&mut self, at: &Sample) {
        let square = |a: i32| i64::from(a) * i64::from(a);
        self.error += square(at.residual);
        self.force += square(at.measured);
        self.predicted += square(at.predicted);
    }

    /// What a full block of 2^`log_values` residuals says; none where neither force is large
    /// enough. `outside`: whether some of them were spoilt by a state outside the training
    /// range.
    pub fn judged(&self, limits: &AxisLimits, log_values: u32, outside: bool) -> Option<Gross> {
        let usual = limits.usual_power(log_values);
        let (larger, side) = if self.force < self.predicted {
            (self.predicted, 0)
        } else {
            (self.force, 1)
        };
        // The prediction is held at the edge of the range: there only a force that is gone is
        // evidence.
        let beyond = outside && self.force >= limits.gone_outside(self.predicted);
        if (larger as u64) < usual / GENTLEST || beyond {
            return None;
        }
        Some(Gross {
            side,
            value: log2(self.error as u64) - log2(larger as u64 + usual),
        })
    }
}

/// The dependence on the level of motion is followed for so many octaves of power either way.
const LEVELS: i32 = 3;

/// What a block says about one axis. P̄ and Ū² are the mean squares on the validation records
/// ([`AxisLimits`]), which stand in the denominators so that a joint that is driven gently is not
/// judged by the quotient of two small numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// log₂(Σx²/(n·Ū²)) in 1/1024 octaves, held to ±3 octaves: how far the joint travels, beside
    /// the validation records. What a healthy joint's statistics owe to it
    /// ([`AxisLimits::per_octave`]) is taken off those below.
    pub level: i32,
    /// log₂(Σe²/(Σr² + n·P̄)) in 1/1024 octaves.
    pub error: i32,
    /// Σe·x/√((Σr² + n·P̄)·(Σx² + n·Ū²)) in 2⁻¹⁶, positive for a stiffer joint; ±2⁴ at most.
    pub stiffness: i32,
    /// The same with the velocity, positive for more friction.
    pub friction: i32,
    /// Whether measured force and travel are large enough for the others to be judged.
    pub moves: bool,
}

/// The shift of [`Statistics::stiffness`] or `friction` that a change by this part of the RMS force
/// makes on a joint driven as on the validation records, where either denominator is twice the sum.
pub fn share_of_change(part: f64) -> f64 {
    part * f64::from(SHARE) / 2.0
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::super::limits::tests::axis;
    use super::*;

    /// A block of a sine motion of the validation level whose residual is `stiffer` of the force
    /// along x and `rougher` along v.
    fn block(stiffer: f64, rougher: f64, level: f64) -> Sums {
        let limits = axis();
        let mut sums = Sums::default();
        for n in 0..64 {
            let (sin, cos) = (f64::from(n) * core::f64::consts::TAU / 16.0).sin_cos();
            let force = 65536.0 * level * sin * 4096.0;
            let residual = 65536.0 * level * (stiffer * sin + rougher * cos) * 4096.0;
            let half = f64::from(1 << 30) * level;
            let states = [(half * sin) as i32, (half * cos) as i32];
            let expected = (force - residual) as i32;
            let waiting = Waiting::new(states, [force as i32, expected]);
            sums.add(&waiting.with(residual as i32, &limits));
        }
        sums
    }

    #[test]
    fn a_changed_stiffness_or_friction_shows_as_its_share_of_the_force() {
        let wanted = share_of_change(0.1);
        for (stiffer, rougher) in [(0.1, 0.0), (-0.1, 0.0), (0.0, 0.1), (0.0, -0.1)] {
            let seen = block(stiffer, rougher, 1.0).statistics(&axis(), 6);
            let sign = |part: f64| part / 0.1 * wanted;
            for (name, seen, wanted) in [
                ("stiffness", seen.stiffness, sign(stiffer)),
                ("friction", seen.friction, sign(rougher)),
            ] {
                let off = (f64::from(seen) - wanted).abs();
                assert!(
                    off < 0.02 * share_of_change(0.1),
                    "{name}: {seen}, {wanted}"
                );
            }
            let octaves = f64::from(seen.error) / 1024.0;
            assert!((octaves - (0.005_f64).log2()).abs() < 0.03, "{octaves}");
        }
        let mut reversed = axis();
        reversed.reversed = true;
        let seen = block(0.1, 0.0, 1.0).statistics(&reversed, 6);
        assert!(f64::from(seen.stiffness) < -0.9 * wanted);
    }

    #[test]
    fn a_gentle_motion_is_not_judged_and_rails_do_not_overflow() {
        assert!(block(0.0, 0.0, 0.6).statistics(&axis(), 6).moves);
        assert!(!block(0.0, 0.0, 0.4).statistics(&axis(), 6).moves);
        assert!(!Sums::default().statistics(&axis(), 10).moves);
        let mut limits = axis();
        limits.force_shift = 0;
        limits.force_power = 1 << 46;
        limits.state_power = [1 << 30; 2];
        for rail in [i32::MIN, i32::MAX] {
            let mut sums = Sums::default();
            for _ in 0..1024 {
                sums.add(&Waiting::new([rail; 2], [rail; 2]).with(rail, &limits));
            }
            let seen = sums.statistics(&limits, 10);
            assert!(seen.moves && seen.error.abs() <= 1032, "{seen:?}");
        }
    }

    #[test]
    fn a_force_that_is_gone_is_judged_by_the_one_that_was_expected() {
        let mut limits = axis();
        let usual = 1_i64 << (31 + 6);
        let gone = Sums {
            error: usual,
            state: [1 << 33; 2],
            ..Sums::default()
        };
        // Only the gross change is judged by what the model expects.
        assert!(!gone.statistics(&limits, 6).moves);
        let gross = |limits: &AxisLimits, error, force, predicted, outside| {
            let sums = GrossSums {
                error,
                force,
                predicted,
            };
            sums.judged(limits, 6, outside)
        };
        let octave = -OCTAVE;
        let side = |side| {
            Some(Gross {
                side,
                value: octave,
            })
        };
        for (force, predicted, outside, wanted) in [
            (0, usual, false, side(0)),
            (usual, 0, false, side(1)),
            // Outside the range only a force that is nearly gone counts.
            (0, usual, true, side(0)),
            (usual / 4, usual, true, None),
            (usual, 0, true, None),
            (usual / 8, usual / 8, false, None),
        ] {
            assert_eq!(gross(&limits, usual, force, predicted, outside), wanted);
        }
        // A model with four octaves to spare is judged by a sixteenth of what it takes else, and
        // outside its range by any missing force.
        limits.error.drift = -11 * OCTAVE;
        let gentle = usual / 16;
        for (force, predicted, outside, wanted) in [
            (0, gentle, false, side(0)),
            (gentle, 0, false, side(1)),
            (gentle / 2, gentle, true, side(0)),
            (gentle, 0, true, None),
            (gentle / 8, gentle / 8, false, None),
        ] {
            let said = gross(&limits, gentle, force, predicted, outside);
            assert_eq!(said, wanted);
        }
    }
}
