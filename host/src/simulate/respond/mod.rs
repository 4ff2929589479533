//! How the rig would move with a model in place of its joint: the equation of motion integrated,
//! and held against the record.
//!
//! A model that predicts the force well at measured states need not move like the joint: here its
//! own errors come back to it through the motion. Two kinds of study are simulated, both by the
//! integrator of the simulated rig:
//!
//! - a study that `jointwatch simulate` wrote: all bodies of that rig, shaken by the same drive,
//!   against the true motion;
//! - any other: the body whose force was logged, driven by that force and by the measured motion of
//!   its far side, against the measured motion.

mod compare;
pub(super) mod measured;
mod report;
mod response;
mod rig;
pub(super) mod run;

pub use compare::{AxisResponse, Band, Drift};
pub use report::{as_csv, in_words};
pub use response::{Against, Options, RecordResponse, Response};
pub use run::Divergence;

use crate::model::Evaluator;
use crate::model::file::ModelFile;
use crate::model::scalar::HostScalar;
use crate::signal::motion::{self, Motion};
use crate::simulate::{Contact, JointLaw, SUBSTEPS};
use crate::study::series::spread;
use crate::study::{Convention, Study};
use crate::text::error::{Error, Result, in_order};
use crate::text::nearest::suggestion;
use rayon::prelude::*;

/// A model in the place of the joint.
#[derive(Clone, Debug)]
pub struct ModelLaw<S = f64> {
    evaluator: Evaluator<S>,
    /// −1 where the model's restoring force opposes the body, per axis.
    sign: [f64; 2],
}

impl ModelLaw {
    /// The model's restoring force, with the sign that its convention gives it in the equation of
    /// motion.
    ///
    /// # Errors
    /// As [`Evaluator::new`].
    pub fn new(model: &ModelFile) -> Result<Self> {
        Ok(Self::of(model, Evaluator::new(model)?))
    }
}

impl<S> ModelLaw<S> {
    /// The same of a model that was prepared already, in any kind of number.
    pub(super) fn of(model: &ModelFile, evaluator: Evaluator<S>) -> Self {
        let mut sign = [1.0; 2];
        for (sign, axis) in sign.iter_mut().zip(&model.axes) {
            if axis.restoring_force == Convention::ForceMinusInertia {
                *sign = -1.0;
            }
        }
        Self { evaluator, sign }
    }
}

impl<S: HostScalar> JointLaw<S> for ModelLaw<S> {
    fn force(&self, state: [S; 4], _contacts: [Contact; 2]) -> [S; 2] {
        let [first, second] = self.evaluator.force_at(&state);
        let [s, t] = self.sign.map(S::constant);
        [s * first, t * second]
    }

    fn follow(&mut self, inputs: &[f64]) {
        self.evaluator.follow(inputs);
    }

    fn advance(&mut self, state: [S; 4], step_s: f64) {
        self.evaluator.advance(&state, step_s);
    }
}

/// Simulates the records of a study with the model in place of the joint.
///
/// # Errors
/// [`crate::text::error::Kind::Data`], one sentence: the study is not one the model fits, has no
/// such record, or cannot be simulated.
pub fn respond(study: &Study, model: &ModelFile, options: &Options) -> Result<Response> {
    respond_with(study, model, &ModelLaw::new(model)?, options)
}

/// The same with any law in place of the joint; `model` gives inertia, filters and training range.
///
/// # Errors
/// As [`respond`].
pub fn respond_with<L: JointLaw + Clone + Sync>(
    study: &Study,
    model: &ModelFile,
    law: &L,
    options: &Options,
) -> Result<Response> {
    study.check_has_time("a response runs in time", "use compare")?;
    model.check_fits(study)?;
    let chosen = chosen(study, options.record.as_deref())?;
    let restart_rows = restart_rows(study, options.restart_s)?;
    let motions = motion::motions(study, &model.filters)?;
    let largest = largest_displacement(study, &motions);
    let truth = if options.measured {
        None
    } else {
        rig::read_truth(study)?
    };
    if let (Some(_), Some(input)) = (&truth, model.input_names()?.first()) {
        return Err(Error::data(format!(
            "the model follows the input {input:?}, and a simulated rig has none; drive it by the logged force with --measured"
        )));
    }
    let one = |&index: &usize| -> Result<(RecordResponse, Vec<Drift>)> {
        let (motion, simulated, drifts) = if let Some(truth) = &truth {
            let record = rig::ShakenRecord::new(study, index, truth)?;
            let simulated = run::settled(
                &record.motion,
                restart_rows,
                &model.base,
                SUBSTEPS,
                |steps| record.moving(law.clone(), steps),
            );
            (record.motion, simulated, Vec::new())
        } else {
            let body = measured::DrivenBody::new(study, model, &motions[index])?;
            let simulated =
                run::settled(&body.motion, restart_rows, &model.base, SUBSTEPS, |steps| {
                    body.moving(law.clone(), steps)
                });
            let drifts = body.drifts(model, &motions[index], law.clone(), &largest);
            (body.motion, simulated, drifts)
        };
        let record = &study.records[index];
        let figures = compare::figures(study, model, &motion, &simulated, &largest);
        let response = RecordResponse {
            file: record.file.clone(),
            role: record.role,
            rows: motion.rows(),
            simulated: simulated.share(),
            diverged: simulated.divergences(&motion, model),
            steps_per_row: simulated.steps_per_row,
            step_error: simulated.step_error,
            axes: figures,
            start_s: motion.start_s,
            states: simulated.states,
            measured: motion.states,
        };
        Ok((response, drifts))
    };
    let (records, drifts): (Vec<RecordResponse>, Vec<Vec<Drift>>) =
        in_order(chosen.par_iter().map(one))?.into_iter().unzip();
    let drifts: Vec<Drift> = drifts.into_iter().flatten().collect();
    Ok(Response {
        against: if truth.is_some() {
            Against::Truth
        } else {
            Against::Measurement
        },
        restart_s: options.restart_s,
        notes: report::notes(study, &records, &drifts, options),
        records,
    })
}

/// The records to simulate, by their place in the study.
fn chosen(study: &Study, wanted: Option<&str>) -> Result<Vec<usize>> {
    let Some(wanted) = wanted else {
        return Ok((0..study.records.len()).collect());
    };
    let indices = study.records.iter().enumerate();
    let chosen: Vec<usize> = indices
        .filter(|(_, record)| record.file == wanted)
        .map(|(index, _)| index)
        .collect();
    if chosen.is_empty() {
        let files: Vec<&str> = study.records.iter().map(|r| r.file.as_str()).collect();
        return Err(Error::data(format!(
            "{}: the study has no record {wanted:?}; {}",
            study.path.display(),
            suggestion(wanted, &files)
        )));
    }
    Ok(chosen)
}

fn restart_rows(study: &Study, restart_s: Option<f64>) -> Result<Option<usize>> {
    let Some(seconds) = restart_s else {
        return Ok(None);
    };
    let rows = seconds * study.sample_rate_hz;
    if !(2.0..1e15).contains(&rows) {
        return Err(Error::usage(format!(
            "--restart {seconds}: give at least two samples, {} s at {} Hz",
            2.0 / study.sample_rate_hz,
            study.sample_rate_hz
        )));
    }
    Ok(Some(rows.round() as usize))
}

/// Per axis the largest root mean square about the mean of its displacement over all records: what
/// counts as rest is known only from all of them.
fn largest_displacement(study: &Study, motions: &[Motion]) -> Vec<f64> {
    let largest = |axis: usize| {
        motions
            .iter()
            .map(|m| spread(&m.states[2 * axis]))
            .fold(0.0, f64::max)
    };
    (0..study.axes.len()).map(largest).collect()
}
