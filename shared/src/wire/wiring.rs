//! How the rig is wired: which counter, bridge and accelerometer measures what of which axis, with
//! which sign and setting.
//!
//! The [`Rig`](crate::wire::rig::Rig) says what a count is worth; this says where the count comes
//! from. [`Wiring::raw_sample`] puts what the chips gave into the order of the chain, in integers.

use crate::chain::{RawAxis, RawSample};
use crate::fault::{Checks, Error};
use heapless::Vec;
use serde::{Deserialize, Serialize};

/// Quadrature counters on a board.
pub const COUNTERS: usize = 4;
/// Channels of the converter.
pub const CHANNELS: usize = 4;
/// Accelerometers on a board.
pub const ACCELEROMETERS: usize = 2;
/// Directions that an accelerometer measures.
pub const DIRECTIONS: usize = 3;

/// How a quadrature counter is set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counter {
    /// Counts per cycle of the encoder's two signals: 1, 2 or 4.
    pub quadrature: u8,
    /// The count at power-on; with `index`, also the count at every index pulse.
    pub start: i32,
    /// Whether the encoder's index pulse sets the count.
    pub index: bool,
}

/// How the converter of the strain bridges is set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Converter {
    /// Binary logarithm of each channel's gain: 0 to 7 for 1 to 128.
    pub gain_log2: [u8; CHANNELS],
    /// The oversampling is 128·2ⁿ modulator clocks, n from 0 to 7: 32,000 to 250 conversions per
    /// second at 8.192 MHz.
    pub oversampling: u8,
}

/// How an accelerometer is set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Accelerometer {
    /// Range: 1 is ±2.048 g, 2 is ±4.096 g, 3 is ±8.192 g.
    pub range: u8,
    /// Its low-pass: 0 is 4000 samples/s with a corner at 1000 Hz; each step halves both, up
    /// to 10.
    pub filter: u8,
    /// Whether the board's sync line, not the chip's own clock, says when a sample is taken.
    pub external_sync: bool,
}

/// A counter or a converter channel, and whether it counts against the axis's positive direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Signed {
    /// Its number, from 0.
    pub place: u8,
    /// True when its sign is turned round.
    pub negative: bool,
}

/// One direction of an accelerometer, and its sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SignedDirection {
    /// Which accelerometer, from 0.
    pub chip: u8,
    /// 0, 1 or 2 for its x, y or z.
    pub direction: u8,
    /// True when its sign is turned round.
    pub negative: bool,
}

/// Where the counts of one axis come from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisWiring {
    /// Counter of the displacement's far side; of the relative displacement itself where there is
    /// no near side.
    pub far: Signed,
    /// Counter of the near side, which is subtracted.
    pub near: Option<Signed>,
    /// Counter of the body that carries the inertia; may be one of the two above.
    pub body: Option<Signed>,
    /// Converter channel of the force or torque.
    pub force: Signed,
    /// Converter channel of what effects of the axis follow: a voltage, a temperature, a pressure,
    /// a normal load.
    pub input: Option<Signed>,
    /// What adds up to the acceleration's code: nothing where it is derived from the position, one
    /// direction of one chip, or two: with equal signs twice their mean, with opposite signs
    /// the turning of a pair.
    pub acceleration: [Option<SignedDirection>; 2],
    /// Distance between the two accelerometers of a pair that measures a rotation, m; 0 where
    /// there is none.
    #[serde(serialize_with = "crate::scalar::zero::plain_zero")]
    pub pair_distance_m: f64,
}

/// The chips of a board, and which of them measures what of which axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wiring {
    /// The counters that are fitted.
    pub counters: [Option<Counter>; COUNTERS],
    /// How the converter of the strain bridges is set.
    pub converter: Converter,
    /// The accelerometers that are fitted.
    pub accelerometers: [Option<Accelerometer>; ACCELEROMETERS],
    /// One or two axes, as the rig's.
    pub axes: Vec<AxisWiring, 2>,
}

/// What every chip gave for one instant; 0 for a chip that is not fitted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Readings {
    /// Counts, 32 bits that wrap.
    pub counters: [i32; COUNTERS],
    /// Converter codes, 24 bits.
    pub channels: [i32; CHANNELS],
    /// Codes of each accelerometer's x, y and z, 20 bits.
    pub accelerations: [[i32; DIRECTIONS]; ACCELEROMETERS],
}

/// The value with its sign; a counter at its lowest value stays there, as it is its own negative
/// modulo 2³².
fn signed(value: i32, negative: bool) -> i32 {
    if negative {
        value.wrapping_neg()
    } else {
        value
    }
}

impl Signed {
    fn of(self, values: &[i32]) -> i32 {
        let value = values.get(usize::from(self.place)).copied().unwrap_or(0);
        signed(value, self.negative)
    }
}

impl SignedDirection {
    fn of(self, readings: &Readings) -> i32 {
        let chip = readings.accelerations.get(usize::from(self.chip));
        let value = chip.and_then(|codes| codes.get(usize::from(self.direction)));
        signed(value.copied().unwrap_or(0), self.negative)
    }
}

impl Wiring {
    /// Readings of a rig at rest: encoders at their start counts, forces and accelerations zero.
    pub fn at_rest(&self) -> Readings {
        Readings {
            counters: self.counters.map(|counter| counter.map_or(0, |c| c.start)),
            ..Readings::default()
        }
    }

    /// Every chip of the board with a plain setting and no axes: what a board without a rig block
    /// reads its raw counts with.
    pub fn unconfigured() -> Self {
        let counter = Counter {
            quadrature: 4,
            start: 0,
            index: false,
        };
        let accelerometer = Accelerometer {
            range: 3,
            filter: 0,
            external_sync: false,
        };
        Self {
            counters: [Some(counter); COUNTERS],
            converter: Converter {
                gain_log2: [0; CHANNELS],
                oversampling: 3,
            },
            accelerometers: [Some(accelerometer); ACCELEROMETERS],
            axes: Vec::new(),
        }
    }

    /// The chain's sample from what the chips gave at one instant.
    pub fn raw_sample(&self, readings: &Readings) -> RawSample {
        let mut sample = RawSample::default();
        for (raw, axis) in sample.iter_mut().zip(&self.axes) {
            let counter = |place: Option<Signed>| place.map_or(0, |p| p.of(&readings.counters));
            let directions = axis.acceleration.iter().flatten();
            *raw = RawAxis {
                displacement: [counter(Some(axis.far)), counter(axis.near)],
                body: counter(axis.body),
                acceleration: directions.fold(0_i32, |sum, d| sum.wrapping_add(d.of(readings))),
                force: axis.force.of(&readings.channels),
                input: axis.input.map_or(0, |p| p.of(&readings.channels)),
            };
        }
        sample
    }

    /// Checks settings against what the chips have, and that everything an axis names is fitted.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] names the first quantity that is not usable.
    pub fn check(&self) -> Result<(), Error> {
        let mut checks = Checks::new();
        self.check_board(&mut checks);
        checks.done()
    }

    /// [`Wiring::check`] among other checks.
    pub(crate) fn check_board(&self, checks: &mut Checks) {
        for counter in self.counters.iter().flatten() {
            let quantity = "counts per encoder cycle (1, 2 or 4)";
            let least = if counter.quadrature == 3 { 4 } else { 1 };
            checks.whole(quantity, i32::from(counter.quadrature), least, 4);
        }
        for gain in self.converter.gain_log2 {
            let quantity = "binary logarithm of a bridge channel's gain";
            checks.whole(quantity, i32::from(gain), 0, 7);
        }
        let oversampling = i32::from(self.converter.oversampling);
        checks.whole("oversampling step of the converter", oversampling, 0, 7);
        for chip in self.accelerometers.iter().flatten() {
            checks.whole("range of an accelerometer", chip.range.into(), 1, 3);
            checks.whole("filter of an accelerometer", chip.filter.into(), 0, 10);
        }
        checks.whole("axes of the wiring", self.axes.len() as i32, 1, 2);
        for axis in &self.axes {
            self.check_axis(axis, checks);
        }
    }

    fn check_axis(&self, axis: &AxisWiring, checks: &mut Checks) {
        for counter in [Some(axis.far), axis.near, axis.body].into_iter().flatten() {
            let (place, most) = (usize::from(counter.place), COUNTERS as i32 - 1);
            checks.whole("number of a counter", place as i32, 0, most);
            let fitted = self.counters.get(place).is_some_and(Option::is_some);
            let quantity = "counters fitted where an axis has one";
            checks.whole(quantity, i32::from(fitted), 1, 1);
        }
        if let Some(near) = axis.near {
            let same = i32::from(near.place == axis.far.place);
            checks.whole("far and near sides on one counter", same, 0, 0);
        }
        for channel in [Some(axis.force), axis.input].into_iter().flatten() {
            let (channel, most) = (i32::from(channel.place), CHANNELS as i32 - 1);
            checks.whole("number of a converter channel", channel, 0, most);
        }
        for direction in axis.acceleration.iter().flatten() {
            let (chip, most) = (usize::from(direction.chip), ACCELEROMETERS as i32 - 1);
            checks.whole("number of an accelerometer", chip as i32, 0, most);
            let fitted = self.accelerometers.get(chip).is_some_and(Option::is_some);
            let quantity = "accelerometers fitted where an axis has one";
            checks.whole(quantity, i32::from(fitted), 1, 1);
            let (number, most) = (i32::from(direction.direction), DIRECTIONS as i32 - 1);
            checks.whole("direction of an accelerometer", number, 0, most);
        }
        let turning = match axis.acceleration {
            [Some(one), Some(other)] => {
                let same = one.chip == other.chip && one.direction == other.direction;
                let quantity = "one direction of an accelerometer used twice";
                checks.whole(quantity, i32::from(same), 0, 0);
                one.negative != other.negative
            }
            [None, Some(_)] => {
                // One way to write it down: the first place is the first to be used.
                checks.whole("first accelerometer of an axis", 0, 1, 1);
                false
            }
            _ => false,
        };
        let (least, most) = if turning { (1e-6, 1e3) } else { (0.0, 0.0) };
        let quantity = "distance of a pair of accelerometers in m";
        checks.within(quantity, axis.pair_distance_m, least, most);
    }
}
