//! The joint of an emulated device that runs on and on: one record closed into a loop, and a force
//! that changes when told to.
//!
//! The motion is that of the record, again and again. A changed joint resists the same motion with
//! another force, as on a rig that imposes the motion; what a rig that imposes the force would do
//! otherwise is not in it.

use super::device::EmulatedDevice;
use crate::model::effects::ModelEffect;
use crate::model::time_history::{TimeHistory, law_parameters};
use crate::study::{Record, Study};
use crate::text::error::{Error, Result};
use jointwatch_shared::base::Model;
use jointwatch_shared::base::terms::EffectValues;
use jointwatch_shared::chain::Output;
use jointwatch_shared::wire::wiring::Readings;

/// Seconds over which the record's end passes into its beginning.
const SEAM_S: f64 = 0.5;
/// The word for the whole restoring force of an axis, in place of an effect.
const WHOLE: &str = "force";

/// A change of the joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// As it was written.
    pub text: String,
    what: What,
    /// What the force is multiplied by.
    factor: f64,
}

#[derive(Clone, Debug, PartialEq)]
enum What {
    /// The whole restoring force of an axis.
    Force(usize),
    /// One of the model's effects.
    Effect(EffectValues),
}

/// The joint of an emulated device.
pub struct LoopedJoint<'a> {
    device: &'a EmulatedDevice<'a>,
    study: &'a Study,
    model: &'a Model,
    /// The record, its end joined to its beginning: one turn of the loop.
    record: Record,
    /// Restoring force per axis along the loop as the device measures it, N or N·m.
    force: Vec<Vec<f64>>,
}

impl<'a> LoopedJoint<'a> {
    /// A record as a loop, with the joint that it was taken of.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when the record is too short for a loop.
    pub fn new(
        device: &'a EmulatedDevice<'a>,
        study: &'a Study,
        model: &'a Model,
        record: &Record,
    ) -> Result<Self> {
        let seam = (SEAM_S * study.sample_rate_hz).round() as usize;
        let filters = device.set_up.chain.first_row() + device.set_up.chain.delay();
        if record.rows < 4 * (seam + filters) {
            return Err(Error::data(format!(
                "{}: {} rows are too few to be run in a loop; name one of at least {} rows with --record",
                record.file,
                record.rows,
                4 * (seam + filters)
            )));
        }
        let mut joint = Self {
            device,
            study,
            model,
            record: closed(record, seam, study.sample_rate_hz),
            force: Vec::new(),
        };
        joint.mend(record, seam);
        joint.force = joint.along(&joint.record, |output, axis| output.measured[axis]);
        Ok(joint)
    }

    /// Reads `viscous@x*0.5`, one of the model's effects with its force multiplied; or
    /// `force@x*0.5`, the whole force of an axis.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Usage`] in a sentence with what can be changed.
    pub fn change(&self, text: &str) -> Result<Change> {
        let known = self.known();
        let wrong = |why: &str| {
            Error::usage(format!(
                "{text:?} {why}; write what changes and by what it is multiplied, as in {}*0.5; there are {}",
                known[0].0,
                known
                    .iter()
                    .map(|(name, _)| name.as_str())
                    .collect::<Vec<_>>()
                    .join(", ")
            ))
        };
        let (name, factor) = text.rsplit_once('*').ok_or_else(|| wrong("is no change"))?;
        let factor: f64 = factor.trim().parse().map_err(|_| wrong("has no factor"))?;
        if !(-10.0..=10.0).contains(&factor) {
            return Err(wrong("multiplies by a factor outside −10 to 10"));
        }
        let found = known.iter().find(|(known, _)| known == name.trim());
        let (_, what) = found.ok_or_else(|| wrong("names nothing that can be changed"))?;
        Ok(Change {
            text: text.trim().into(),
            what: what.clone(),
            factor,
        })
    }

    /// What can be changed, by name.
    fn known(&self) -> Vec<(String, What)> {
        let names: Vec<&str> = self.study.axes.iter().map(|a| a.name.as_str()).collect();
        let whole = names.iter().enumerate();
        let mut known: Vec<(String, What)> = whole
            .map(|(axis, name)| (format!("{WHOLE}@{name}"), What::Force(axis)))
            .collect();
        for term in ModelEffect::of_device(self.model) {
            if let Ok(in_si) = term.bound_in_si(&names) {
                known.push((term.name(), What::Effect(in_si)));
            }
        }
        known
    }

    /// What the chips read, row by row, with these changes of the joint.
    ///
    /// # Errors
    /// When the motion of the loop cannot be found.
    pub fn readings(&self, changes: &[Change]) -> Result<Vec<Readings>> {
        let mut record = self.record.clone();
        for change in changes {
            let by = change.factor - 1.0;
            let forces = match &change.what {
                What::Force(axis) => vec![(*axis, self.force[*axis].clone())],
                What::Effect(term) => self.effect(term)?,
            };
            for (axis, force) in forces {
                let sign = self.study.axes[axis].restoring_force.sign();
                let channel = record.axes[axis].force.iter_mut();
                channel.zip(force).for_each(|(f, r)| *f += sign * by * r);
            }
        }
        Ok(self.device.wired().readings(&record).collect())
    }

    /// The force of an effect along the loop, per axis that it acts on.
    fn effect(&self, term: &EffectValues) -> Result<Vec<(usize, Vec<f64>)>> {
        let twice = self.twice(&self.record);
        let motion = self.device.set_up.motion(self.study, &twice)?;
        let conventions: Vec<_> = self.study.axes.iter().map(|a| a.restoring_force).collect();
        let history = TimeHistory::of_motion(&motion, &conventions);
        let parameters = law_parameters(term.entry, &term.values);
        let axis = usize::from(term.axis);
        let rows = self.record.rows;
        let (mut own, mut other) = (vec![0.0; rows], vec![0.0; rows]);
        let input = history.input(term.input);
        // The second time round the memory of an effect is that of the loop; a row is written twice
        // where both have it.
        let each = |row: usize, [mine, others]: [f64; 2]| {
            let at = (row + motion.first_row) % rows;
            let factor = input.at(row);
            (own[at], other[at]) = (factor * mine, factor * others);
        };
        history.along(term.entry, &parameters, axis, 0.0, each);
        let mut forces = vec![(axis, own)];
        if self.study.axes.len() > 1 {
            forces.push((1 - axis, other));
        }
        Ok(forces)
    }

    /// Puts the force of the seam right: the motion there was never made, so the force is what the
    /// model says of it, with the residual of the record's end passing into that of its
    /// beginning.
    fn mend(&mut self, record: &Record, seam: usize) {
        let loops = self.record.rows;
        let residual = |output: &Output, axis: usize| output.residual[axis];
        for axis in 0..self.study.axes.len() {
            let residuals = self.of_rows(record, residual, axis);
            let is = self.along(&self.record, residual);
            let sign = self.study.axes[axis].restoring_force.sign();
            for at in 0..seam {
                let [w, ..] = weight(at, seam);
                let (end, beginning) = (residuals[loops + at], residuals[at]);
                let wanted = (1.0 - w) * end + w * beginning;
                let row = loops - seam + at;
                self.record.axes[axis].force[row] += sign * (wanted - is[axis][row]);
            }
        }
    }

    /// What the device's chain says of every row of a loop, per axis, N or N·m.
    fn along(&self, record: &Record, of: impl Fn(&Output, usize) -> i32 + Copy) -> Vec<Vec<f64>> {
        let rows = record.rows;
        let twice = self.twice(record);
        let axes = 0..self.study.axes.len();
        let all = axes.map(|axis| self.of_rows(&twice, of, axis));
        // In the middle of two rounds no filter is still filling.
        all.map(|all| {
            let rows = (0..rows).map(|row| if row < rows / 2 { row + rows } else { row });
            rows.map(|row| all[row]).collect()
        })
        .collect()
    }

    /// What the chain says of every row of a record; of rows for which its filters have no support,
    /// what it says of the nearest.
    fn of_rows(
        &self,
        record: &Record,
        of: impl Fn(&Output, usize) -> i32,
        axis: usize,
    ) -> Vec<f64> {
        let set_up = &self.device.set_up;
        let outputs: Vec<Output> = set_up
            .samples(record, self.model)
            .filter_map(|sample| sample.output)
            .collect();
        let unit = self.model.outputs()[axis].force_per_lsb;
        let last = outputs.len().saturating_sub(1);
        let of_row = |row: usize| {
            let at = row.saturating_sub(set_up.chain.first_row()).min(last);
            let output = outputs.get(at);
            output.map_or(0.0, |output| f64::from(of(output, axis)) * unit)
        };
        (0..record.rows).map(of_row).collect()
    }

    /// A loop, two rounds of it.
    fn twice(&self, record: &Record) -> Record {
        record.map(2 * record.rows, |series| [series, series].concat())
    }
}

/// The weight of the beginning at a row of the seam, from 0 to 1, and its first and second
/// derivative per row: the polynomial of seventh order of which three derivatives are 0 at both
/// ends.
fn weight(at: usize, seam: usize) -> [f64; 3] {
    let (s, per_row) = ((at as f64 + 0.5) / seam as f64, 1.0 / seam as f64);
    [
        s.powi(4) * (35.0 - 84.0 * s + 70.0 * s * s - 20.0 * s.powi(3)),
        140.0 * s.powi(3) * (1.0 - s).powi(3) * per_row,
        420.0 * (s * (1.0 - s)).powi(2) * (1.0 - 2.0 * s) * per_row * per_row,
    ]
}

/// The record without its first `seam` rows, its last ones passing into those: where its end is
/// followed by its beginning nothing jumps. Accelerations are those of the motion that results; the
/// force is put right afterwards.
fn closed(record: &Record, seam: usize, rate_hz: f64) -> Record {
    let loops = record.rows - seam;
    let passed = |series: &[f64]| -> Vec<f64> {
        let seams = (0..seam).map(|at| {
            let [w, ..] = weight(at, seam);
            (1.0 - w) * series[loops + at] + w * series[at]
        });
        let kept = series[seam..loops].iter().copied();
        kept.chain(seams).collect()
    };
    let slope = |series: &[f64], row: usize| {
        let (before, after) = (row.saturating_sub(1), (row + 1).min(record.rows - 1));
        (series[after] - series[before]) / (after - before) as f64
    };
    let mut closed = record.map(loops, passed);
    for (closed, channels) in closed.axes.iter_mut().zip(&record.axes) {
        let relative = channels.relative_displacement();
        let body = channels.body_position.as_ref().unwrap_or(&relative);
        for at in 0..seam {
            let (row, [_, first, second]) = (loops - seam + at, weight(at, seam));
            let jump = |series: &[f64]| series[at] - series[loops + at];
            if let Some(velocity) = &mut closed.velocity {
                velocity[row] += first * jump(&relative) * rate_hz;
            }
            if let Some(acceleration) = &mut closed.acceleration {
                let faster = slope(body, at) - slope(body, loops + at);
                let more = 2.0 * first * faster + second * jump(body);
                acceleration[row] += more * rate_hz * rate_hz;
            }
        }
    }
    closed
}
