//! A record as the models see it: states, acceleration and applied force, row by row.
//!
//! The equation of motion of the body that carries the inertia `m`, with a known spring `k` and
//! damper `c` from the body (position `b`) to ground, an applied force `F` and the joint, is the
//! paper's Eq. (8) (Eq. (9) for a rotation):
//!
//! | convention | equation of motion | restoring force |
//! | --- | --- | --- |
//! | `force_minus_inertia` (the joint opposes) | `m·a = F − k·b − c·ḃ − r` | `r = (F − k·b − c·ḃ) − m·a` |
//! | `inertia_minus_force` (the joint pulls) | `m·a = F − k·b − c·ḃ + r` | `r = m·a − (F − k·b − c·ḃ)` |
//!
//! Spring and damper act on the body in the same way in both, so both take them off the applied
//! force first.

use crate::signal::earlier::remembered;
use crate::signal::fir::apply;
use crate::signal::lead_in::AxisRecord;
use crate::signal::standstill;
use crate::study::{Axis, Convention, Record, Study};
use crate::text::error::{Error, Result, in_order};
use rayon::prelude::*;
use std::borrow::Cow;
use std::ops::Range;

pub use crate::signal::filters::Filters;

/// A record after differentiation: what a model's inputs and its output are made of.
///
/// All series have the same length; the rows at both ends where a filter has no full support are
/// gone.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Which record of the study.
    pub record: usize,
    /// The record's row that became row 0 here.
    pub first_row: usize,
    /// Sample rate of these rows, Hz.
    pub sample_rate_hz: f64,
    /// [x, ẋ] or [x, ẋ, φ, φ̇]: relative displacement and velocity of each axis, SI, wide-band.
    pub states: Vec<Vec<f64>>,
    /// The same before row 0, as far as what remembers it has to know: the logged rows that the
    /// filters cost, and before them the records whose rows come straight before in the same
    /// log, or else the travel by which the joint came to the first row, where the record
    /// tells of one. All equally long; none where nothing is known.
    pub before: Vec<Vec<f64>>,
    /// Absolute acceleration of the body, per axis.
    pub acceleration: Vec<Vec<f64>>,
    /// Applied force per axis, known ground spring and damper already subtracted (Eqs. 8, 9).
    pub force: Vec<Vec<f64>>,
    /// What the known spring and damper to ground take of the applied force, per axis; none where
    /// there is neither.
    pub ground: Vec<Option<Vec<f64>>>,
    /// Inputs of the study with their names, in their own units, wide-band.
    pub inputs: Vec<(String, Vec<f64>)>,
    /// Rows that count for nothing, as no axis moves there and the study leaves such rows out;
    /// empty where every row counts.
    pub still: Vec<bool>,
}

impl Motion {
    /// What counts of a series along these rows that went through a symmetric filter of so many
    /// taps and of which every so-manieth row was kept.
    pub(crate) fn counted(&self, filtered: Vec<f64>, taps: usize, every: usize) -> Vec<f64> {
        if self.still.is_empty() {
            return filtered;
        }
        let still = self.still.iter().skip(taps / 2).step_by(every);
        let counted = filtered
            .into_iter()
            .zip(still)
            .filter(|(_, still)| !**still);
        counted.map(|(value, _)| value).collect()
    }

    /// What the force channel of an axis reads, N or N·m: the applied force with nothing taken off.
    pub fn applied_force(&self, axis: usize) -> Cow<'_, [f64]> {
        let force = &self.force[axis];
        match &self.ground[axis] {
            None => Cow::Borrowed(force),
            Some(ground) => force.iter().zip(ground).map(|(f, g)| f + g).collect(),
        }
    }

    /// What a polynomial or a network is evaluated on: the states, and the input that it follows,
    /// where the record has it.
    pub(crate) fn base_states(&self, input: Option<&str>) -> Vec<&[f64]> {
        let states = self.states.iter().map(Vec::as_slice);
        states
            .chain(input.and_then(|name| self.input(name)))
            .collect()
    }

    /// An input of the study, where the record has it.
    pub(crate) fn input(&self, name: &str) -> Option<&[f64]> {
        series_named(&self.inputs, name)
    }

    /// Rows that count.
    pub(crate) fn counted_rows(&self) -> usize {
        self.rows() - self.still.iter().filter(|still| **still).count()
    }

    /// Rows of every series.
    pub fn rows(&self) -> usize {
        self.force[0].len()
    }

    /// The `rows` rows in the middle, or all where there are fewer.
    pub fn middle(&self, rows: usize) -> Self {
        let all = self.rows();
        let count = rows.min(all);
        let start = (all - count) / 2;
        self.cut(start..start + count)
    }

    /// Some of its rows.
    pub(crate) fn cut(&self, rows: Range<usize>) -> Self {
        let all = self.before.iter().zip(&self.states);
        let before = all.map(|(b, s)| [b, &s[..rows.start]].concat());
        Self {
            first_row: self.first_row + rows.start,
            before: remembered(&before.collect::<Vec<_>>(), self.sample_rate_hz),
            still: self.still.get(rows.clone()).unwrap_or_default().to_vec(),
            ..self.picked(|series| series[rows.clone()].to_vec())
        }
    }

    /// The rows that count, for laws without memory: they no longer follow each other in time.
    pub(crate) fn moving(&self) -> Cow<'_, Self> {
        match self.still.is_empty() {
            true => Cow::Borrowed(self),
            false => Cow::Owned(self.picked(|series| self.counted(series.to_vec(), 1, 1))),
        }
    }

    /// The same with what `pick` makes of every series along its rows; nothing is known of what
    /// came before, and every row counts.
    fn picked(&self, pick: impl Fn(&[f64]) -> Vec<f64>) -> Self {
        let all = |series: &[Vec<f64>]| series.iter().map(|s| pick(s)).collect();
        let inputs = self.inputs.iter();
        Self {
            record: self.record,
            first_row: self.first_row,
            sample_rate_hz: self.sample_rate_hz,
            states: all(&self.states),
            before: Vec::new(),
            acceleration: all(&self.acceleration),
            force: all(&self.force),
            ground: self
                .ground
                .iter()
                .map(|g| g.as_deref().map(&pick))
                .collect(),
            inputs: inputs.map(|(name, s)| (name.clone(), pick(s))).collect(),
            still: Vec::new(),
        }
    }

    /// The measured force that errors of an axis are held against, in N or N·m, wide-band: the
    /// restoring force; where the inertia was identified, so that the restoring force is not
    /// measured by itself, the applied force with its sign.
    pub fn measured_force(
        &self,
        axis: usize,
        inertia: f64,
        identified: bool,
        convention: Convention,
    ) -> Vec<f64> {
        self.restoring_force(axis, if identified { 0.0 } else { inertia }, convention)
    }

    /// Restoring force of one axis in N or N·m, wide-band: `F − m·a` or `m·a − F`, as the
    /// convention says.
    ///
    /// `inertia` in kg or kg·m²; with 0 the force channel (or its negative) already is the
    /// restoring force.
    pub fn restoring_force(&self, axis: usize, inertia: f64, convention: Convention) -> Vec<f64> {
        let sign = convention.sign();
        self.force[axis]
            .iter()
            .zip(&self.acceleration[axis])
            .map(|(force, acceleration)| sign * (force - inertia * acceleration))
            .collect()
    }
}

/// The series of this name.
pub(crate) fn series_named<'a>(inputs: &'a [(String, Vec<f64>)], name: &str) -> Option<&'a [f64]> {
    let found = inputs.iter().find(|(known, _)| known == name);
    found.map(|(_, series)| series.as_slice())
}

/// Turns every record of the study into a motion, in the study's order.
///
/// # Errors
/// A record with no row left between the ends that the filters cost.
pub fn motions(study: &Study, filters: &Filters) -> Result<Vec<Motion>> {
    let records = study.records.par_iter().enumerate();
    in_order(records.map(|(index, record)| motion(study, index, record, filters)))
}

/// Turns one record of the study, the one at `index`, into a motion.
///
/// # Errors
/// A record with no row left between the ends that the filters cost.
pub fn motion(study: &Study, index: usize, record: &Record, filters: &Filters) -> Result<Motion> {
    let half = filters.half_length();
    let least = filters.velocity.len() + filters.band.len() - 1;
    if record.rows < least {
        return Err(Error::data(format!(
            "{}: {} rows are too few for filters that need {least}; try a longer record or a higher band_hz",
            record.file, record.rows
        )));
    }
    let mut motion = Motion {
        record: index,
        first_row: half,
        sample_rate_hz: study.sample_rate_hz,
        states: Vec::new(),
        before: Vec::new(),
        acceleration: Vec::new(),
        force: Vec::new(),
        ground: Vec::new(),
        inputs: record
            .inputs
            .iter()
            .map(|(name, s)| (name.clone(), s[half..s.len() - half].to_vec()))
            .collect(),
        still: match study.leave_out_standstill {
            true => standstill::left_out(study, record, (filters.state_band_hz, half))?,
            false => Vec::new(),
        },
    };
    let earlier = study.continued(record);
    for (axis, channels) in study.axes.iter().zip(&record.axes) {
        let inner = |series: &[f64]| series[half..series.len() - half].to_vec();
        let relative = channels.relative_displacement();
        let velocity = match &channels.velocity {
            Some(logged) => inner(logged),
            None => apply(&relative, &filters.velocity),
        };
        let body = channels.body_position.as_deref().unwrap_or(&relative);
        // The logged acceleration is used where there is one, because the device uses it as well.
        motion.acceleration.push(match &channels.acceleration {
            Some(logged) => inner(logged),
            None => apply(body, &filters.acceleration),
        });
        let mut force = inner(&channels.force);
        let ground = to_ground(axis, body, &filters.velocity, half);
        for (f, g) in force.iter_mut().zip(ground.iter().flatten()) {
            *f -= g;
        }
        let number = motion.force.len();
        let along = AxisRecord {
            earlier: earlier
                .iter()
                .flat_map(|record| record.axes[number].relative_displacement())
                .collect(),
            displacement: &relative,
            first_row: half,
            velocity: &velocity,
            force: &force,
            first_force: channels.force.first().copied().unwrap_or(0.0),
            acceleration: motion.acceleration.last().map_or(&[], Vec::as_slice),
            sample_rate_hz: study.sample_rate_hz,
            band: &filters.band,
        };
        motion.before.extend(along.before());
        motion.force.push(force);
        motion.ground.push(ground);
        motion.states.push(inner(&relative));
        motion.states.push(velocity);
    }
    motion.before = remembered(&motion.before, study.sample_rate_hz);
    Ok(motion)
}

/// What the known spring and damper from the body to ground take of the applied force.
fn to_ground(axis: &Axis, body: &[f64], velocity: &[f64], half: usize) -> Option<Vec<f64>> {
    if axis.ground_stiffness == 0.0 && axis.ground_damping == 0.0 {
        return None;
    }
    let inner = &body[half..body.len() - half];
    let mut force: Vec<f64> = inner.iter().map(|b| axis.ground_stiffness * b).collect();
    if axis.ground_damping != 0.0 {
        for (f, v) in force.iter_mut().zip(apply(body, velocity)) {
            *f += axis.ground_damping * v;
        }
    }
    Some(force)
}

/// Low-passes a series with zero phase; `taps.len() − 1` rows are lost, half of them at each end.
pub fn low_pass(series: &[f64], taps: &[f64]) -> Vec<f64> {
    apply(series, taps)
}
