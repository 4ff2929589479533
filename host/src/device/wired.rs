//! A logged record as the chips of a wired rig would give it: the wiring gone through from the
//! chain back to the chips.
//!
//! Where the wiring puts two quantities onto one chip, a log has to hold the same of both. What a
//! converter cannot reach stands at its rail, as on the board. A channel comes as late as the rig
//! block says that this board reads it, and the chain puts it in time again.

use crate::device::followed::Followed;
use crate::model::corrections::later;
use crate::signal::motion::Filters;
use crate::study::{Channels, Record, Study};
use crate::text::error::{Error, Result};
use jointwatch_shared::base::Model;
use jointwatch_shared::chain::RawSample;
use jointwatch_shared::monitor::Faults;
use jointwatch_shared::wire::rig::{Rig, RigAxis};
use jointwatch_shared::wire::wiring::{AxisWiring, Readings, Signed, SignedDirection, Wiring};

/// Lowest and highest code of the bridge converter.
const CONVERTER_RAILS: [i64; 2] = [-(1 << 23), (1 << 23) - 1];
/// Lowest and highest code of an accelerometer.
const ACCELEROMETER_RAILS: [i64; 2] = [-(1 << 19), (1 << 19) - 1];

/// Places of an axis's channels, in the monitor's order.
const ACCELERATION: usize = 3;
const FORCE: usize = 4;
const INPUT: usize = 5;

/// A rig as its block describes it, with what its converters read before a model's corrections.
#[derive(Clone, Debug)]
pub struct Wired {
    converters: Rig,
    followed: Followed,
}

/// What one axis of one row comes to in counts; `None` where the record has no such channel and
/// another one gives it.
struct Wanted {
    far: i64,
    near: Option<i64>,
    body: Option<i64>,
    acceleration: Option<i64>,
    force: i64,
    input: i64,
}

impl Wired {
    /// The rig fed with the records of a study.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when the block is for another rate or other filters than
    /// the model, when a record lacks a channel that the rig measures, and when the wiring
    /// gives two channels from one chip that differ in a record.
    pub fn new(study: &Study, model: &Model, filters: &Filters, rig: &Rig) -> Result<Self> {
        let axes = study.axes.len();
        if rig.axes.len() != axes || rig.wiring.axes.len() != axes {
            return Err(Error::data(format!(
                "the rig block has {} axes and the study {axes}; export the block for this model with `export --rig`",
                rig.axes.len()
            )));
        }
        if (rig.sample_rate_hz / study.sample_rate_hz - 1.0).abs() > 1e-9 {
            return Err(Error::data(format!(
                "the rig block is for {} Hz and the study has {} Hz; export the block for this model with `export --rig`",
                rig.sample_rate_hz, study.sample_rate_hz
            )));
        }
        let (velocity, acceleration, band) = filters.taps()?;
        if (&rig.velocity, &rig.acceleration, &rig.band) != (&velocity, &acceleration, &band) {
            return Err(Error::data(
                "the rig block has other filters than the model asks for; export it again for this model with `export --rig`",
            ));
        }
        let mut converters = rig.clone();
        for (axis, correction) in converters.axes.iter_mut().zip(model.corrections()) {
            axis.force_step /= 1.0 - correction.excess;
            // By how much the model's own force channel is late, the records are as well.
            axis.force_delay_samples -= correction.delay_s * rig.sample_rate_hz;
        }
        let followed = Followed::of(model);
        followed.check(study)?;
        let wired = Self {
            converters,
            followed,
        };
        study
            .records
            .iter()
            .try_for_each(|record| wired.check(study, record))?;
        Ok(wired)
    }

    /// Which chip measures what.
    pub fn wiring(&self) -> &Wiring {
        &self.converters.wiring
    }

    /// What every chip gives for each row of a record.
    pub fn readings(&self, record: &Record) -> impl Iterator<Item = Readings> {
        let record = self.as_read(record);
        (0..record.rows).map(move |row| self.row(&record, row).0)
    }

    /// What the chain gets for each row of a record, and which channels stand at a rail, as the
    /// firmware tells its monitor.
    pub fn counts(&self, record: &Record) -> Vec<(RawSample, Faults)> {
        let wiring = self.wiring();
        let counts = |r: Readings| {
            let faults = Faults {
                saturated: saturated(wiring, &r),
                ..Faults::default()
            };
            (wiring.raw_sample(&r), faults)
        };
        self.readings(record).map(counts).collect()
    }

    /// A record with every channel as late as the board reads it.
    fn as_read(&self, record: &Record) -> Record {
        let mut record = record.clone();
        let late = |channel: &mut Vec<f64>, samples: f64| {
            if samples != 0.0 {
                *channel = later(channel, -samples);
            }
        };
        for (number, (channels, rig)) in record
            .axes
            .iter_mut()
            .zip(&self.converters.axes)
            .enumerate()
        {
            let delays = rig.delays;
            late(&mut channels.displacement_first, delays.displacement);
            for (channel, samples) in [
                (&mut channels.displacement_second, delays.displacement),
                (&mut channels.body_position, delays.body),
                (&mut channels.acceleration, delays.acceleration),
            ] {
                channel.iter_mut().for_each(|c| late(c, samples));
            }
            late(&mut channels.force, rig.force_delay_samples);
            // Two axes that follow one input have it from one channel.
            let follows_first = number == 1 && self.followed.name(0) == self.followed.name(1);
            if let Some(name) = self.followed.name(number).filter(|_| !follows_first)
                && let Some((_, input)) = record.inputs.iter_mut().find(|(known, _)| known == name)
            {
                late(input, delays.input);
            }
        }
        record
    }

    fn check(&self, study: &Study, record: &Record) -> Result<()> {
        let refuse = |what: String| {
            Err(Error::data(format!(
                "{}: {what}",
                study.path.with_file_name(&record.file).display()
            )))
        };
        for ((wired, channels), axis) in
            self.wiring().axes.iter().zip(&record.axes).zip(&study.axes)
        {
            let shared = |place: Signed| {
                place.place == wired.far.place
                    || wired.near.is_some_and(|near| near.place == place.place)
            };
            let lacks_body =
                channels.body_position.is_none() && wired.body.is_some_and(|p| !shared(p));
            let lacks_acceleration =
                channels.acceleration.is_none() && wired.acceleration[0].is_some();
            let lacking = match (lacks_body, lacks_acceleration) {
                (true, _) => "body_position",
                (_, true) => "acceleration",
                _ => continue,
            };
            return refuse(format!(
                "the rig measures the {lacking} of axis {}, and this record does not hold it; leave it out of rig.toml",
                axis.name
            ));
        }
        let read = self.as_read(record);
        for row in 0..record.rows {
            if let Some(chip) = self.row(&read, row).1 {
                return refuse(format!(
                    "row {row}: the wiring gives two channels from {chip}, and they differ here; wire them apart in rig.toml"
                ));
            }
        }
        Ok(())
    }

    /// One row, and the chip that would have to give two values at once.
    fn row(&self, record: &Record, row: usize) -> (Readings, Option<String>) {
        let axes = self.wiring().axes.iter().zip(&self.converters.axes);
        let wanted: Vec<(&AxisWiring, Wanted)> = axes
            .zip(&record.axes)
            .enumerate()
            .map(|(axis, ((wiring, rig), channels))| {
                let mut wanted = wanted(wiring, rig, channels, row);
                wanted.input = i64::from(self.followed.count(axis, record, rig, row));
                (wiring, wanted)
            })
            .collect();
        let mut chips = Chips::default();
        for (wiring, wanted) in &wanted {
            chips.counter(Some(wiring.far), Some(wanted.far));
            chips.counter(wiring.near, wanted.near);
            chips.counter(wiring.body, wanted.body);
            chips.converter(Some(wiring.force), wanted.force);
            chips.converter(wiring.input, wanted.input);
        }
        // What one direction gives alone comes first: a pair that shares it then has its other half
        // left.
        for alone in [true, false] {
            for (wiring, wanted) in &wanted {
                if wiring.acceleration[1].is_none() == alone
                    && let Some(value) = wanted.acceleration
                {
                    chips.acceleration(&wiring.acceleration, value);
                }
            }
        }
        (chips.readings, chips.conflict)
    }
}

/// The channels of the chain that a chip at a rail feeds, a bit each.
fn saturated(wiring: &Wiring, readings: &Readings) -> u16 {
    let at_rail =
        |code: i32, [least, most]: [i64; 2]| i64::from(code) == least || i64::from(code) == most;
    let mut bits = 0;
    for (axis, wired) in wiring.axes.iter().enumerate() {
        let converted = [Some(wired.force), wired.input];
        for (channel, place) in [FORCE, INPUT].into_iter().zip(converted) {
            let code = place.and_then(|p| readings.channels.get(usize::from(p.place)));
            if code.is_some_and(|code| at_rail(*code, CONVERTER_RAILS)) {
                bits |= Faults::bit(axis, channel);
            }
        }
        for one in wired.acceleration.iter().flatten() {
            let (chip, direction) = (usize::from(one.chip), usize::from(one.direction));
            if at_rail(readings.accelerations[chip][direction], ACCELEROMETER_RAILS) {
                bits |= Faults::bit(axis, ACCELERATION);
            }
        }
    }
    bits
}

/// The counts of one row, rounded as the device's counts are.
fn wanted(wiring: &AxisWiring, rig: &RigAxis, channels: &Channels, row: usize) -> Wanted {
    // `as` saturates.
    let count = |value: f64, step: f64| i64::from((value / step).round() as i32);
    let at = |series: &Option<Vec<f64>>| series.as_ref().map(|values| values[row]);
    let (first, second) = (
        channels.displacement_first[row],
        at(&channels.displacement_second),
    );
    let (far, near) = match wiring.near {
        Some(_) => (first, second.unwrap_or(0.0)),
        None => (first - second.unwrap_or(0.0), 0.0),
    };
    let step = rig.displacement_step;
    let acceleration = at(&channels.acceleration).filter(|_| rig.acceleration_step > 0.0);
    Wanted {
        far: count(far, step),
        near: wiring.near.map(|_| count(near, step)),
        body: at(&channels.body_position)
            .filter(|_| rig.body_step > 0.0)
            .map(|body| count(body, rig.body_step)),
        acceleration: acceleration.map(|a| count(a, rig.acceleration_step)),
        force: count(channels.force[row], rig.force_step),
        input: 0,
    }
}

fn turned(value: i64, negative: bool) -> i64 {
    if negative { -value } else { value }
}

/// Chips that are given their values one after the other.
#[derive(Default)]
struct Chips {
    readings: Readings,
    counters: [bool; 4],
    directions: [[bool; 3]; 2],
    conflict: Option<String>,
}

impl Chips {
    fn counter(&mut self, place: Option<Signed>, value: Option<i64>) {
        let (Some(signed), Some(value)) = (place, value) else {
            return;
        };
        let place = usize::from(signed.place);
        // A counter wraps; the lowest count is its own negative.
        let value = turned(value, signed.negative) as i32;
        if self.counters[place] && self.readings.counters[place] != value {
            self.conflict = Some(format!("counter {place}"));
        }
        self.counters[place] = true;
        self.readings.counters[place] = value;
    }

    fn converter(&mut self, place: Option<Signed>, value: i64) {
        let Some(signed) = place else {
            return;
        };
        let [least, most] = CONVERTER_RAILS;
        let place = &mut self.readings.channels[usize::from(signed.place)];
        *place = turned(value, signed.negative).clamp(least, most) as i32;
    }

    fn acceleration(&mut self, directions: &[Option<SignedDirection>; 2], value: i64) {
        let known = |chips: &Self, d: &SignedDirection| {
            let (chip, direction) = (usize::from(d.chip), usize::from(d.direction));
            chips.directions[chip][direction].then(|| {
                turned(
                    chips.readings.accelerations[chip][direction].into(),
                    d.negative,
                )
            })
        };
        let parts = match directions {
            [Some(one), None] => match known(self, one) {
                Some(part) if part != value => return self.differs(one),
                _ => [Some((*one, value)), None],
            },
            [Some(one), Some(other)] => {
                let parts = match (known(self, one), known(self, other)) {
                    (Some(a), Some(b)) if a + b != value => return self.differs(one),
                    (Some(a), _) => [a, value - a],
                    (None, Some(b)) => [value - b, b],
                    (None, None) => [value - value / 2, value / 2],
                };
                [Some((*one, parts[0])), Some((*other, parts[1]))]
            }
            _ => return,
        };
        let [least, most] = ACCELEROMETER_RAILS;
        for (d, part) in parts.into_iter().flatten() {
            let (chip, direction) = (usize::from(d.chip), usize::from(d.direction));
            self.directions[chip][direction] = true;
            self.readings.accelerations[chip][direction] =
                turned(part, d.negative).clamp(least, most) as i32;
        }
    }

    fn differs(&mut self, direction: &SignedDirection) {
        self.conflict = Some(format!("accelerometer {}", direction.chip));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signed(place: u8, negative: bool) -> Signed {
        Signed { place, negative }
    }

    fn direction(chip: u8, direction: u8, negative: bool) -> Option<SignedDirection> {
        Some(SignedDirection {
            chip,
            direction,
            negative,
        })
    }

    /// Every sign, a body on the near side's counter, a mean and a turning pair that share a chip.
    #[test]
    fn what_the_chips_get_is_what_the_wiring_makes_of_it() {
        let axis = |place: u8, acceleration| AxisWiring {
            far: signed(place, place == 0),
            near: Some(signed(place + 1, true)),
            body: Some(signed(place + 1, true)),
            force: signed(3 - place, place == 2),
            input: None,
            acceleration,
            pair_distance_m: 0.0,
        };
        let mut wiring = Wiring::unconfigured();
        let alone = [direction(1, 2, true), None];
        let pair = [direction(0, 2, false), direction(1, 2, true)];
        for axes in [[alone, pair], [pair, alone], [pair, [None, None]]] {
            wiring.axes.clear();
            wiring.axes.push(axis(0, axes[0])).unwrap();
            wiring.axes.push(axis(2, axes[1])).unwrap();
            for scale in [1_i64, -7, 300] {
                let mut chips = Chips::default();
                let accelerations = [101 * scale, -57 * scale];
                for alone in [true, false] {
                    for (of, value) in wiring.axes.iter().zip(accelerations) {
                        if of.acceleration[1].is_none() == alone {
                            chips.acceleration(&of.acceleration, value);
                        }
                    }
                }
                for (n, of) in (1..).zip(&wiring.axes) {
                    chips.counter(Some(of.far), Some(5 * n * scale));
                    chips.counter(of.near, Some(-3 * n * scale));
                    chips.counter(of.body, Some(-3 * n * scale));
                }
                assert_eq!(chips.conflict, None);
                let sample = wiring.raw_sample(&chips.readings);
                for (n, raw) in (1..).zip(&sample) {
                    let wanted = [5 * n * scale, -3 * n * scale].map(|v| v as i32);
                    assert_eq!(raw.displacement, wanted);
                    assert_eq!(raw.body, wanted[1]);
                }
                for ((raw, wanted), of) in sample.iter().zip(accelerations).zip(&axes) {
                    if of[0].is_some() {
                        assert_eq!(i64::from(raw.acceleration), wanted);
                    }
                }
            }
        }
    }

    #[test]
    fn two_values_for_one_chip_are_named_and_rails_hold() {
        let mut chips = Chips::default();
        chips.counter(Some(signed(2, false)), Some(4));
        chips.counter(Some(signed(2, true)), Some(-4));
        assert_eq!(chips.conflict, None);
        chips.counter(Some(signed(2, false)), Some(5));
        assert_eq!(chips.conflict.as_deref(), Some("counter 2"));

        let mut chips = Chips::default();
        chips.acceleration(&[direction(1, 0, true), None], 1 << 25);
        assert_eq!(chips.readings.accelerations[1][0], -(1 << 19));
        chips.acceleration(&[direction(1, 0, false), None], 1);
        assert_eq!(chips.conflict.as_deref(), Some("accelerometer 1"));
    }
}
