//! What a force law contributes to every measured force, as columns of a least-squares problem.
//!
//! Laws are evaluated on the wide-band states and low-passed afterwards, with the filter that the
//! measured force goes through: a law has corners, and filtering the states first would round them.
//! Behind the low-pass neighbours say nearly the same, so the rows are thinned out to what the
//! filter's stop band allows.

use crate::model::corrections::of_the_joint;
use crate::model::effects::AxisEffect;
use crate::model::per_record;
use crate::model::time_history::{TimeHistory, add_forces};
use crate::signal::fir::{apply_every, thinning};
use crate::signal::motion::Motion;
use crate::study::series::extent;
use crate::study::{Axis, Convention};
use jointwatch_shared::base::terms::EffectValues;
use jointwatch_shared::effect::about::{Parameter, Role, Shape};
use jointwatch_shared::units::{Dimension, References};
use std::collections::BTreeMap;
use std::ops::Range;

/// Takes out of a column (both axes, one after the other) what something that is fitted beside the
/// laws makes of it.
pub(crate) type Projection<'a> = &'a (dyn Fn(&mut [f64]) + Sync);

/// One row of a record, as far as one axis moves.
pub(crate) struct Sample {
    /// Since the record began, s.
    pub(crate) time_s: f64,
    /// Relative displacement, m or rad.
    pub(crate) displacement: f64,
    /// Relative velocity, m/s or rad/s.
    pub(crate) velocity: f64,
}

/// The training records, ready to hold force laws against.
pub(crate) struct Records<'a> {
    pub(super) histories: Vec<TimeHistory<'a>>,
    motions: &'a [&'a Motion],
    pub(super) axes: usize,
    pub(super) taps: &'a [f64],
    /// Of so many rows one is kept.
    pub(crate) every: usize,
    pub(super) projection: Option<Projection<'a>>,
    /// Whether a base beside the terms has a constant of its own, so that zeros of records are
    /// known only relative to one another.
    pub(crate) beside_constant: bool,
    /// Thinned rows per second.
    pub(crate) thinned_rate_hz: f64,
    /// The rate of the samples, Hz.
    pub(crate) sample_rate_hz: f64,
    /// Thinned rows of each record.
    pub(crate) rows: Vec<usize>,
    /// The largest displacement and velocity of each axis, and the RMS of its force: what
    /// parameters are relative to.
    pub(crate) references: References,
    /// The smallest and the largest displacement of each axis, over all records, m or rad.
    pub(crate) extent: Vec<[f64; 2]>,
    /// The measured force of each axis, record after record, the first axis's before the second's.
    pub(crate) measured: Vec<f64>,
    /// The inertia that is stated, per axis, kg or kg·m².
    pub(crate) inertias: Vec<Option<f64>>,
    /// Whether a force is applied, per axis; where none is, the inertia force is all that is
    /// measured.
    pub(crate) forced: Vec<bool>,
    /// One column per axis whose inertia is not stated: the acceleration, with the sign it has in
    /// the force.
    pub(crate) accelerations: Vec<Option<Vec<f64>>>,
}

impl<'a> Records<'a> {
    /// Low-passes and thins out the measured side. With an inertia that is not stated the applied
    /// force takes the place of the restoring force, and the acceleration becomes a column.
    pub(crate) fn new(axes: &[Axis], motions: &'a [&'a Motion], low_pass: &'a [f64]) -> Self {
        let rate = motions.first().map_or(1.0, |m| m.sample_rate_hz);
        let every = thinning(low_pass, rate);
        let largest = |input: usize| {
            let series = motions.iter().filter_map(|m| m.states.get(input)).flatten();
            let most = series.fold(0.0, |most: f64, v| most.max(v.abs()));
            if most > 0.0 { most } else { 1.0 }
        };
        let extent_of = |axis: usize| {
            let series = motions.iter().flat_map(|m| &m.states[2 * axis]);
            extent(series.copied())
        };
        let conventions: Vec<Convention> = axes.iter().map(|a| a.restoring_force).collect();
        let histories = motions.iter();
        let mut records = Self {
            histories: histories
                .map(|m| TimeHistory::of_motion(m, &conventions))
                .collect(),
            motions,
            axes: axes.len(),
            taps: low_pass,
            every,
            projection: None,
            beside_constant: false,
            thinned_rate_hz: rate / every as f64,
            sample_rate_hz: rate,
            rows: Vec::new(),
            references: References {
                force: [1.0; 2],
                displacement: [largest(0), largest(2)],
                velocity: [largest(1), largest(3)],
                time: 1.0,
            },
            extent: (0..axes.len()).map(extent_of).collect(),
            measured: Vec::new(),
            inertias: axes.iter().map(|axis| axis.inertia).collect(),
            forced: (0..axes.len())
                .map(|axis| {
                    let mut applied = motions.iter().map(|m| m.applied_force(axis));
                    applied.any(|force| force.iter().any(|f| *f != 0.0))
                })
                .collect(),
            accelerations: Vec::new(),
        };
        let thin = |m: &Motion, series: &[f64]| {
            m.counted(apply_every(series, low_pass, every), low_pass.len(), every)
        };
        let kept = |m: &&Motion| {
            let kept = m.rows().saturating_sub(low_pass.len() - 1).div_ceil(every);
            m.counted(vec![0.0; kept], low_pass.len(), every).len()
        };
        records.rows = motions.iter().map(kept).collect();
        for (index, axis) in axes.iter().enumerate() {
            let force = |m: &&Motion| {
                let inertia = axis.inertia.unwrap_or(0.0);
                thin(m, &m.restoring_force(index, inertia, axis.restoring_force))
            };
            let force: Vec<f64> = motions.iter().flat_map(force).collect();
            let square: f64 = force.iter().map(|f| f * f).sum();
            let rms = (square / force.len().max(1) as f64).sqrt();
            records.references.force[index] = if rms > 0.0 { rms } else { 1.0 };
            records.measured.extend(force);
        }
        for (index, axis) in axes.iter().enumerate() {
            // With r = s·(F − m·a), the force s·F is r + m·(s·a).
            let inertial = |m: &&Motion| {
                let without = m.restoring_force(index, 0.0, axis.restoring_force);
                let with = m.restoring_force(index, 1.0, axis.restoring_force);
                let column: Vec<f64> = without.iter().zip(&with).map(|(a, b)| a - b).collect();
                thin(m, &column)
            };
            records.accelerations.push(axis.inertia.is_none().then(|| {
                let column = motions.iter().flat_map(inertial).collect();
                records.on_axis(index, column)
            }));
        }
        records
    }

    /// What is known of the displacement of an axis before each record, m or rad, not thinned.
    pub(crate) fn displacement_before(&self, axis: usize) -> Vec<&'a [f64]> {
        let histories = self.histories.iter();
        histories.map(|h| h.displacement_before(axis)).collect()
    }

    /// The inertia of an axis that may be stated wrong: one that is stated, if only as nothing, and
    /// whose force is not all that there is.
    pub(crate) fn doubtful_inertia(&self, axis: usize) -> Option<f64> {
        self.inertias[axis].filter(|_| self.forced[axis])
    }

    /// Lets the effects of instruments work on the applied force that a model asks for, see
    /// [`TimeHistory::predict`]; `terms` are the model's effects and `inertia` has one entry
    /// per axis, kg or kg·m².
    pub(crate) fn predict(&mut self, terms: &[EffectValues], inertia: &[f64]) {
        let joint = of_the_joint(terms);
        for history in &mut self.histories {
            let mut forces = vec![vec![0.0; history.rows()]; self.axes];
            add_forces(&joint, history, &mut forces);
            history.predict(&forces, inertia);
        }
    }

    /// The same with something fitted beside the laws: it is taken out of the measured force and of
    /// every column.
    pub(crate) fn orthogonal_to(mut self, projection: Projection<'a>) -> Self {
        projection(&mut self.measured);
        self.accelerations
            .iter_mut()
            .flatten()
            .for_each(|c| projection(c));
        self.projection = Some(projection);
        self
    }

    /// Names of the inputs that change in these records, or from one to another.
    pub(crate) fn inputs(&self) -> Vec<&'static str> {
        let mut names: Vec<&'static str> = Vec::new();
        let mut firsts: BTreeMap<&str, f64> = BTreeMap::new();
        for (name, series) in self.histories.iter().flat_map(TimeHistory::inputs) {
            let Some(value) = series.first() else {
                continue;
            };
            let first = *firsts.entry(name).or_insert(*value);
            let bound = AxisEffect::kept_input(name);
            if !names.contains(&bound) && series.iter().any(|v| *v != first) {
                names.push(bound);
            }
        }
        names
    }

    /// The value of an input in every record, where it stands still in each.
    pub(crate) fn standing(&self, name: &str) -> Option<Vec<f64>> {
        let all = self.histories.iter().flat_map(TimeHistory::inputs);
        let own = all.filter(|(own, _)| own == name);
        own.map(|(_, series)| {
            let first = series.first().copied()?;
            series.iter().all(|value| *value == first).then_some(first)
        })
        .collect()
    }

    /// An input along the rows of an axis, as a column of that axis is.
    pub(crate) fn of_input(&self, axis: usize, name: &'static str) -> Vec<f64> {
        let parts = self.histories.iter().enumerate().map(|(record, history)| {
            let factor = history.input(Some(name));
            self.thinned(record, &factor.times(&vec![1.0; history.rows()]))
        });
        self.on_axis(axis, parts.flatten().collect())
    }

    /// A series along the record at `record`, low-passed and thinned out as the forces are.
    pub(crate) fn thinned(&self, record: usize, series: &[f64]) -> Vec<f64> {
        let filtered = apply_every(series, self.taps, self.every);
        self.motions[record].counted(filtered, self.taps.len(), self.every)
    }

    /// Lets them work on what the force channels read again.
    pub(crate) fn as_logged(&mut self) {
        self.histories.iter_mut().for_each(TimeHistory::as_logged);
    }

    /// RMS over all records of the applied force of an axis, N or N·m, wide-band.
    pub(crate) fn applied_rms(&self, axis: usize) -> f64 {
        let (sum, rows) = self
            .histories
            .iter()
            .map(|history| history.applied(axis))
            .fold((0.0, 0), |(sum, rows), force| {
                (
                    sum + force.iter().map(|f| f * f).sum::<f64>(),
                    rows + force.len(),
                )
            });
        (sum / rows.max(1) as f64).sqrt()
    }

    /// A function of an axis's motion as a column, in one record alone or in all.
    pub(crate) fn of_motion(
        &self,
        axis: usize,
        only: Option<usize>,
        function: impl Fn(&Sample) -> f64,
    ) -> Vec<f64> {
        let parts = self.histories.iter().enumerate().map(|(record, history)| {
            if only.is_some_and(|only| only != record) {
                return vec![0.0; self.rows[record]];
            }
            let states = history
                .displacement(axis)
                .iter()
                .zip(history.velocity(axis));
            let values = states.enumerate().map(|(row, (&displacement, &velocity))| {
                function(&Sample {
                    time_s: row as f64 * history.period_s(),
                    displacement,
                    velocity,
                })
            });
            self.thinned(record, &values.collect::<Vec<_>>())
        });
        self.on_axis(axis, parts.flatten().collect())
    }

    /// How long the longest record lasts, s.
    pub(crate) fn longest_s(&self) -> f64 {
        let rows = self.rows.iter().max();
        rows.map_or(0.0, |rows| *rows as f64 / self.thinned_rate_hz)
    }

    /// Rows of one axis.
    pub(crate) fn rows_per_axis(&self) -> usize {
        self.rows.iter().sum()
    }

    /// A column of zeros.
    pub(super) fn nothing(&self) -> Vec<f64> {
        vec![0.0; self.axes * self.rows_per_axis()]
    }

    /// A column that is 0 on every axis but one.
    fn on_axis(&self, axis: usize, column: Vec<f64>) -> Vec<f64> {
        let mut whole = self.nothing();
        let start = axis * self.rows_per_axis();
        whole[start..start + column.len()].copy_from_slice(&column);
        whole
    }

    /// How many columns it makes of one parameter.
    pub(crate) fn columns_of(&self, parameter: &Parameter) -> usize {
        match parameter.role {
            Role::Linear { .. } => 1,
            Role::SizePerRecord { .. } => parameter.phases() * self.own_size(parameter).len(),
            Role::Shape(_) => 0,
        }
    }

    /// The records in which a size is found: all; of a zero beside a base with a constant, all but
    /// the first.
    pub(super) fn own_size(&self, parameter: &Parameter) -> Range<usize> {
        let constant = parameter.phases() == 1 && parameter.dimension == Dimension::FORCE;
        let relative = self.beside_constant && constant;
        usize::from(relative)..self.rows.len()
    }

    /// The sizes that factors of a parameter's columns mean: the factors; of zeros that are known
    /// only relative to one another, what they are above their mean, the first record's as
    /// well.
    pub(crate) fn sizes(&self, parameter: &Parameter, factors: &[f64]) -> Vec<f64> {
        if self.own_size(parameter).start == 0 {
            return factors.to_vec();
        }
        let mean = factors.iter().sum::<f64>() / self.rows.len() as f64;
        let all = std::iter::once(&0.0).chain(factors);
        all.map(|f| f - mean).collect()
    }

    /// Puts what least squares found for the columns of a term into its parameters.
    pub(crate) fn put(&self, bound: &AxisEffect, factors: &[f64], values: &mut [f64]) {
        let mut rest = factors;
        for (parameter, value) in bound.entry.parameters().iter().zip(values) {
            let (mine, others) = rest.split_at(self.columns_of(parameter).min(rest.len()));
            rest = others;
            match parameter.role {
                Role::Linear { .. } => *value = mine.first().copied().unwrap_or(0.0),
                Role::SizePerRecord { .. } => {
                    let sizes = self.sizes(parameter, mine);
                    let square: f64 = sizes.iter().map(|f| f * f).sum();
                    *value = (square / self.rows.len().max(1) as f64).sqrt();
                }
                Role::Shape(_) => {}
            }
        }
    }

    /// The frequency, Hz, near a start of a term's shape at which a residual holds the strongest
    /// line.
    pub(crate) fn line_in(&self, residual: &[f64], axis: usize, shape: &Shape) -> f64 {
        let mut start = axis * self.rows_per_axis();
        let records = self.rows.iter().map(|&count| {
            start += count;
            &residual[start - count..start]
        });
        let records: Vec<&[f64]> = records.collect();
        per_record::strongest(&records, self.thinned_rate_hz, shape)
    }
}
