//! The limits of the monitor: what a healthy joint's residual looks like, and how far from it is
//! too far.
//!
//! They are integers, set once on the host from validation records that went through the device's
//! own chain, and travel in the rig block. They hold for one model: [`Limits::model_checksum`] says
//! for which.

use super::logarithm::OCTAVE;
use crate::fault::{Checks, Error};
use heapless::Vec;
use serde::{Deserialize, Serialize};

/// Sensor channels of one axis: both displacement counters, the body's, the accelerometer, the
/// force, the input that effects follow.
pub const CHANNELS: usize = 6;
/// The force's place among them.
pub const FORCE_CHANNEL: usize = 4;
/// The fewest and the most samples of a block.
pub const BLOCK: [u16; 2] = [16, 1024];
/// The fewest residuals in the band that a block sums up.
pub const MIN_VALUES: i32 = 16;
/// Statistics with a limit, per axis: error, both sides of stiffness and friction, and both sides
/// of a gross change of the force.
pub const SIDES: usize = 7;
/// The largest drift and the largest threshold of a [`Cusum`].
pub const MAX_CUSUM: i32 = 1 << 24;

/// The least threshold of a gross change, in quarters of an octave: six blocks of an octave each.
pub const MIN_GROSS: u8 = 24;
/// The error, in octaves, that is all of a force of usual size, less what of it is outside the
/// common band.
const ALL_OF_FORCE: i32 = -3 * OCTAVE / 2;
/// Between which errors a gross change begins, beside a force that is large: a third of it and
/// seven tenths. Beside one of usual size the [usual power](AxisLimits::usual_power) in the
/// denominator lowers the former.
const GROSS_DRIFTS: [i32; 2] = [-3 * OCTAVE, -2 * OCTAVE];
/// The most octaves of power that a model has to [spare](AxisLimits::spare): an eighth of the usual
/// force is judged then, and a joint is never that gentle for long.
const MAX_SPARE: i32 = 4;

/// One side of a cumulative sum (Page 1954): S ← max(0, S + y − drift), alarm at S ≥ threshold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Cusum {
    /// What a healthy joint stays below in the mean, in units of the statistic; above 0 or not.
    pub drift: i32,
    /// The sum that raises the alarm, in units of the statistic; above 0.
    pub threshold: i32,
}

/// The two sides of a statistic with a sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TwoSided {
    /// Of the statistic itself.
    pub more: Cusum,
    /// Of its negative, which grows where the statistic falls.
    pub less: Cusum,
}

/// What is normal on one axis.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AxisLimits {
    /// True where a stiffer joint lowers the measured force at a positive displacement, by the
    /// signs of the study's columns.
    pub reversed: bool,
    /// The monitor counts force in the model's force unit times 2^this, 0 to 30: the least with
    /// which the RMS force of the validation records is under 2¹⁶.
    pub force_shift: u8,
    /// Mean square of the measured force on the validation records, in the square of that unit; at
    /// least 1.
    pub force_power: u64,
    /// Mean square of displacement and velocity there, both in units of 2⁻¹⁵ of their training
    /// half-range; at least 1.
    pub state_power: [u64; 2],
    /// By how much error, stiffness and friction change on a healthy joint per octave of Σx², in
    /// the units of their limits: a model that is a little wrong is wrong by another share of
    /// the force at another amplitude.
    pub per_octave: [i32; 3],
    /// Of the logarithm of the error's share of the force, in 1/1024 octaves of power.
    pub error: Cusum,
    /// Of the part of the residual that goes with the displacement, in 2⁻¹⁶ of the force.
    pub stiffness: TwoSided,
    /// Of the part of the residual that goes with the velocity, in 2⁻¹⁶ of the force.
    pub friction: TwoSided,
    /// Thresholds of a force that is gone and of one that nobody expects, in quarters of an
    /// octave; under [`MIN_GROSS`] stands for it.
    pub gross: [u8; 2],
    /// Per channel (far and near displacement counter, body counter, accelerometer, force, input),
    /// the span in counts within a block that is a real motion; 0 for a channel that the rig
    /// has not, and for the input, which may stand still.
    pub moving_counts: [u32; CHANNELS],
}

/// The limits of the monitor for one model on one rig.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Limits {
    /// The checksum of the model blob for which they were set.
    pub model_checksum: u32,
    /// Samples of one block of statistics; a power of two from 16 to 1024, and so long that
    /// [`MIN_VALUES`] residuals in the band come meanwhile.
    pub block: u16,
    /// The part of the time outside the training range that makes the verdict *suspect*, in
    /// 1/1000; 1 to 1000.
    pub outside_permille: u16,
    /// The mean time between false alarms for which the thresholds were set, in hours; at least 1.
    pub false_alarm_hours: u32,
    /// As many as the rig has axes.
    pub axes: Vec<AxisLimits, 2>,
}

impl Limits {
    /// Checks what the arithmetic of the monitor relies on.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] names the first quantity that is not usable.
    pub fn check(&self) -> Result<(), Error> {
        let mut checks = Checks::new();
        let [shortest, longest] = BLOCK.map(i32::from);
        let quantity = "samples of a block of the monitor";
        checks.whole(quantity, i32::from(self.block), shortest, longest);
        let quantity = "bits set in the samples of a block of the monitor, a power of two";
        checks.whole(quantity, self.block.count_ones().cast_signed(), 1, 1);
        let quantity = "part of the time outside the training range, in 1/1000";
        checks.whole(quantity, i32::from(self.outside_permille), 1, 1000);
        let (hours, most) = (u64::from(self.false_alarm_hours), u64::from(u32::MAX));
        checks.long("hours between false alarms", hours, 1, most);
        let quantity = "axes of the monitor's limits";
        checks.whole(quantity, self.axes.len() as i32, 1, 2);
        for axis in &self.axes {
            axis.check(&mut checks);
        }
        checks.done()
    }

    /// Residuals in the band that come within a block, with one at every 2^`every_log2` samples; a
    /// power of two.
    pub(super) fn values(&self, every_log2: u32) -> i32 {
        i32::from(self.block) >> (every_log2 & 15)
    }

    /// Checks that they are for so many axes, with enough residuals in the band per block.
    pub(crate) fn check_for(&self, axes: usize, every_log2: u32, checks: &mut Checks) {
        let (seen, wanted) = (self.axes.len() as i32, axes as i32);
        checks.whole("axes of the monitor's limits", seen, wanted, wanted);
        let (most, quantity) = (i32::from(self.block), "residuals in the band per block");
        checks.whole(quantity, self.values(every_log2), MIN_VALUES, most);
    }
}

impl AxisLimits {
    /// By how many octaves the error of the model could be larger before the drift of a gross
    /// change, halfway between it and all of the force, stood above the least one. A good model
    /// spends them on gentler motion and on motion outside its range.
    fn spare(&self) -> u32 {
        let [least, _] = GROSS_DRIFTS;
        // Far from the rails: a drift is at most 2²⁴.
        let spare = (2 * (least - OCTAVE) - ALL_OF_FORCE - self.error.drift) / OCTAVE;
        spare.clamp(0, MAX_SPARE).unsigned_abs() & 7
    }

    /// The power of a usual force, over 2^`log_values` of them, where a gross change is judged: P̄,
    /// less the octaves that the model has to spare. Beside it the model's error is larger by
    /// those at most.
    pub(super) fn usual_power(&self, log_values: u32) -> u64 {
        (self.force_power << (log_values & 15)) >> self.spare()
    }

    /// What of its predicted power a force may have at most to be evidence outside the training
    /// range: a sixteenth, and more by the octaves that the model has to spare, so that it may
    /// be wrong by those there.
    pub(super) fn gone_outside(&self, predicted: i64) -> i64 {
        predicted >> (MAX_SPARE.unsigned_abs() - self.spare())
    }

    /// The cumulative sums of a force that is gone and of one that nobody expects: halfway between
    /// the error's own drift, larger by the octaves that are spent, and all of the force.
    pub fn gross_sums(&self) -> [Cusum; 2] {
        let spare = self.spare();
        let [least, most] = GROSS_DRIFTS;
        let halfway = (self.error.drift + OCTAVE * spare.cast_signed() + ALL_OF_FORCE) / 2;
        let drift = halfway.clamp(least - (OCTAVE >> spare), most);
        self.gross.map(|quarters| Cusum {
            drift,
            threshold: i32::from(quarters.max(MIN_GROSS)) * (OCTAVE / 4),
        })
    }

    /// The limits of every statistic, in the order of its causes: the error, both sides of
    /// stiffness and friction, and those of a gross change.
    pub fn sides(&self) -> [Cusum; SIDES] {
        let (stiffness, friction) = (self.stiffness, self.friction);
        let [gone, unexpected] = self.gross_sums();
        [
            self.error,
            stiffness.more,
            stiffness.less,
            friction.more,
            friction.less,
            gone,
            unexpected,
        ]
    }

    fn check(&self, checks: &mut Checks) {
        let shift = i32::from(self.force_shift);
        checks.whole("force shift of the monitor", shift, 0, 30);
        // Forces are held to ±2²³ and states to ±2¹⁵ of the monitor's units.
        let quantity = "force power of the monitor";
        checks.long(quantity, self.force_power, 1, 1 << 46);
        for power in self.state_power {
            checks.long("state power of the monitor", power, 1, 1 << 30);
        }
        let most = MAX_CUSUM;
        for slope in self.per_octave {
            let quantity = "change per octave of the monitor's statistics";
            checks.whole(quantity, slope, -most, most);
        }
        for side in self.sides() {
            checks.whole("drift of the monitor", side.drift, -most, most);
            checks.whole("threshold of the monitor", side.threshold, 1, most);
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    extern crate std;
    use super::*;

    pub(in super::super) fn axis() -> AxisLimits {
        let side = Cusum {
            drift: 1600,
            threshold: 6000,
        };
        let both = TwoSided {
            more: side,
            less: side,
        };
        AxisLimits {
            reversed: false,
            force_shift: 12,
            force_power: 1 << 31,
            state_power: [1 << 27; 2],
            per_octave: [0; 3],
            error: side,
            stiffness: both,
            friction: both,
            gross: [0; 2],
            moving_counts: [100, 100, 0, 5000, 4000, 0],
        }
    }

    pub(in super::super) fn limits() -> Limits {
        Limits {
            model_checksum: 0x1234_5678,
            block: 64,
            outside_permille: 200,
            false_alarm_hours: 720,
            axes: Vec::from_slice(&[axis(), axis()]).unwrap(),
        }
    }

    #[test]
    fn check_names_every_quantity_that_the_arithmetic_cannot_take() {
        assert_eq!(limits().check(), Ok(()));
        type Break = fn(&mut Limits);
        let broken: [(&str, Break); 11] = [
            ("samples of a block", |l| l.block = 8),
            ("power of two", |l| l.block = 96),
            ("part of the time", |l| l.outside_permille = 1001),
            ("hours between", |l| l.false_alarm_hours = 0),
            ("axes of the monitor", |l| l.axes.clear()),
            ("force shift", |l| l.axes[1].force_shift = 31),
            ("force power", |l| l.axes[0].force_power = 0),
            ("state power", |l| l.axes[0].state_power[1] = 1 << 33),
            ("change per octave", |l| l.axes[0].per_octave[2] = i32::MAX),
            ("drift", |l| l.axes[1].friction.less.drift = i32::MIN),
            ("threshold", |l| l.axes[0].stiffness.more.threshold = 0),
        ];
        for (words, spoil) in broken {
            let mut limits = limits();
            spoil(&mut limits);
            let said = std::format!("{}", limits.check().expect_err(words));
            assert!(said.contains(words), "{words}: {said}");
        }
    }
}
