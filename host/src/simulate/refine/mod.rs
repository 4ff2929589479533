//! A model refined until it simulates well: its numbers are moved so that the motion that `respond`
//! computes fits the measured one (output error), starting from the fit to the equation of motion.
//!
//! The equation-error fit takes measured states as they are, so noise in the displacement biases
//! it, and it does not know how an error in force adds up over time. Here the model's own motion is
//! held against the measured one, on stretches that get longer (`shooting`). How long they may be,
//! and whether the refinement is kept at all, is decided on the last fifth of every
//! training record, which a first refinement does not see; validation records decide nothing.

mod outcome;
mod shooting;
mod starts;
mod tangent;
mod unknowns;

pub use outcome::{Refined, Refinement, SimulatedChange, SimulatedError, in_words};

use super::respond::ModelLaw;
use super::respond::measured::DrivenBody;
use super::respond::run::{self, SETTLED};
use crate::fit::effects::columns::Records;
use crate::fit::identify::Prepared;
use crate::fit::least_squares::levenberg_marquardt::{SMALL_GAIN, descend};
use crate::model::file::ModelFile;
use crate::signal::motion::Motion;
use crate::study::Study;
use crate::text::error::{Error, Result};
use shooting::Shooting;
use std::cell::Cell;
use unknowns::Unknowns;
pub use unknowns::refuse_network;

/// Stretches of the training records from short to whole: parts of the longest record. A short
/// stretch has few minima and hardly shows drift; each length starts from what the shorter one
/// found.
const PARTS: [usize; 3] = [64, 8, 1];
/// The part of every training record that decides.
const HELD_OUT: f64 = 0.2;
/// Steps of one search: from a fit that is near, few are needed.
const MAX_STEPS: usize = 15;
/// The fewest integration steps per row.
const MIN_STEPS: usize = 1;
/// A refinement is better when it leaves less by more than this part, on what is held out: below
/// lies the integration's own error.
const BETTER: f64 = 1e-3;

/// What a refinement is made on.
struct Ground<'a> {
    study: &'a Study,
    model: &'a ModelFile,
    /// Which records of the study they are.
    records: Vec<usize>,
    bodies: Vec<DrivenBody>,
    unknowns: Unknowns,
    /// One over each axis's RMS displacement.
    weights: Vec<f64>,
    /// How exactly a start is measured.
    deviations: [f64; 4],
    /// Integration steps per row, the most that any model on the way needed.
    steps: Cell<usize>,
}

/// What a first refinement, that did not see the last fifth, came to.
struct Trial {
    /// Values of the unknowns.
    values: Vec<f64>,
    /// Rows of its stretches; none for the model as it was.
    rows: Option<usize>,
    /// RMS error on what it did not see, as a part of the RMS displacement.
    held_out: f64,
}

/// Refines a model that was learnt from a study; `told` hears what is being done.
///
/// # Errors
/// [`crate::text::error::Kind::Data`], one sentence: a model that cannot be refined so, nothing to
/// integrate, a simulation that diverges within the shortest stretches already. A network is wrong
/// use.
pub fn refine(study: &Study, model: &ModelFile, told: &dyn Fn(&str)) -> Result<Refined> {
    study.check_has_time(
        "a simulation runs in time",
        "leave --criterion simulation out",
    )?;
    model.check_fits(study)?;
    let logged = study;
    let study = model.corrected(logged)?.into_owned();
    let prepared = Prepared::with_filters(&study, model.filters.clone())?;
    let training = prepared.training(&study);
    let ground = Ground::new(&study, model, &training)?;
    let trials = ground.trials(told)?;
    let best = trials
        .iter()
        .min_by(|a, b| a.held_out.total_cmp(&b.held_out));
    let (Some(before), Some(best)) = (trials.first(), best) else {
        return Err(Error::failed("a refinement has nothing to choose from"));
    };
    let held_out = [before.held_out, best.held_out];
    let chosen = best
        .rows
        .filter(|_| held_out[1] < (1.0 - BETTER) * held_out[0]);
    let refined = match chosen {
        None => None,
        Some(rows) => {
            told("refining on all training rows");
            let again = ground.descended([0.0, 1.0], rows, &best.values)?;
            let values = ground.best(again, [&best.values, &before.values])?;
            values.map(|values| ground.unknowns.with(model, &values))
        }
    };
    let chosen = chosen.filter(|_| refined.is_some());
    told("simulating every record");
    let stretch_s = chosen.map(|rows| rows as f64 / study.sample_rate_hz);
    outcome::outcome((logged, &study), model, refined, stretch_s, held_out)
}

impl<'a> Ground<'a> {
    fn new(study: &'a Study, model: &'a ModelFile, training: &[&Motion]) -> Result<Self> {
        let references = Records::new(&study.axes, training, &model.filters.band).references;
        let unknowns = Unknowns::of(model, &references)?;
        let bodies = training.iter().map(|m| DrivenBody::new(study, model, m));
        let bodies: Vec<DrivenBody> = bodies.collect::<Result<_>>()?;
        let weight = |axis: usize| {
            let series = || training.iter().flat_map(|m| &m.states[2 * axis]);
            let rows = series().count().max(1) as f64;
            let mean = series().sum::<f64>() / rows;
            let square = series().map(|x| (x - mean) * (x - mean)).sum::<f64>();
            // An axis that rests has nothing to say.
            if square > 0.0 {
                (rows / square).sqrt()
            } else {
                0.0
            }
        };
        let ground = Self {
            study,
            model,
            weights: (0..study.axes.len()).map(weight).collect(),
            bodies,
            unknowns,
            deviations: starts::deviations(study, model, training),
            records: training.iter().map(|m| m.record).collect(),
            steps: Cell::new(MIN_STEPS),
        };
        ground.steps.set(ground.settled_steps(model)?);
        Ok(ground)
    }

    /// Rows of the longest training record.
    fn longest(&self) -> usize {
        let rows = self.bodies.iter().map(|body| body.motion.rows());
        rows.max().unwrap_or(0)
    }

    /// Integration steps per row at which the motion of a model no longer depends on them.
    ///
    /// # Errors
    /// One sentence when that motion diverges within the shortest stretches.
    fn settled_steps(&self, model: &ModelFile) -> Result<usize> {
        let rows = (self.longest() / PARTS[0]).max(2);
        let law = ModelLaw::new(model)?;
        let mut steps = MIN_STEPS;
        for (body, record) in self.bodies.iter().zip(&self.records) {
            let base = &model.base;
            let moved = run::settled(&body.motion, Some(rows), base, MIN_STEPS, |steps| {
                body.moving(law.clone(), steps)
            });
            if let Some(gone) = moved.divergences(&body.motion, model).first() {
                return Err(Error::data(format!(
                    "{}: with the fit to the equation of motion the simulated {} of {} diverges at {:.3} s, {:.3} s after its start from \
                     the measured motion, so nothing can be refined: name the effects that keep it stable in [base] terms, try another \
                     --model, or use --criterion equation",
                    self.study.records[*record].file,
                    gone.state,
                    gone.axis,
                    gone.time_s,
                    gone.after_s
                )));
            }
            steps = steps.max(moved.steps_per_row);
            if moved.step_error > SETTLED {
                break;
            }
        }
        Ok(steps)
    }

    fn shooting(&self, share: [f64; 2], rows: usize) -> Shooting<'_> {
        Shooting {
            model: self.model,
            unknowns: &self.unknowns,
            bodies: &self.bodies,
            stretches: Shooting::cut(&self.bodies, share, rows),
            steps: self.steps.get(),
            weights: self.weights.clone(),
            deviations: self.deviations,
            ties: [0.0; 4],
        }
    }

    /// Values that leave least on stretches of so many rows, from these on; none when the motion
    /// does not stay with the record.
    fn descended(&self, share: [f64; 2], rows: usize, from: &[f64]) -> Result<Option<Vec<f64>>> {
        loop {
            let mut shooting = self.shooting(share, rows);
            let start = shooting.started_as_measured(from.to_vec())?;
            let start = shooting.settled(start)?;
            if start.cost.is_infinite() {
                return Ok(None);
            }
            let (point, _) = descend(&shooting, start, MAX_STEPS, SMALL_GAIN)?;
            let model = self.unknowns.with(self.model, &point.values);
            let Ok(needed) = self.settled_steps(&model) else {
                return Ok(None);
            };
            // A law that became sharper on the way was fitted together with the error of the
            // integration: once more.
            if needed <= self.steps.get() {
                return Ok(Some(point.values));
            }
            self.steps.set(needed);
        }
    }

    /// What is left on the last fifth of the training records, simulated from their measured starts
    /// as `respond` does.
    fn trial(&self, values: Vec<f64>, rows: Option<usize>) -> Result<Trial> {
        let mut judge = self.shooting([0.0, 1.0], usize::MAX);
        let point = judge.started_as_measured(values)?;
        Ok(Trial {
            held_out: judge.relative(&point, 1.0 - HELD_OUT),
            values: point.values,
            rows,
        })
    }

    /// Of the values found on all rows and those of a trial, those that leave less of the training
    /// records as a whole, simulated from their measured starts; none where that is no less
    /// than what the model as it was leaves.
    fn best(
        &self,
        again: Option<Vec<f64>>,
        [trial, before]: [&Vec<f64>; 2],
    ) -> Result<Option<Vec<f64>>> {
        let mut judge = self.shooting([0.0, 1.0], usize::MAX);
        let mut missed = |values: &Vec<f64>| -> Result<f64> {
            let point = judge.started_as_measured(values.clone())?;
            Ok(judge.relative(&point, 0.0))
        };
        let mut least = (missed(before)?, None);
        for values in again.into_iter().chain([trial.clone()]) {
            let own = missed(&values)?;
            if own < (1.0 - BETTER) * least.0 {
                least = (own, Some(values));
            }
        }
        Ok(least.1)
    }

    /// The model as it is, and what comes of it on ever longer stretches of the first four fifths.
    fn trials(&self, told: &dyn Fn(&str)) -> Result<Vec<Trial>> {
        let mut trials = vec![self.trial(self.unknowns.values(self.model), None)?];
        for part in PARTS {
            let rows = self.longest() / part;
            told(&format!(
                "refining on stretches of {:.3} s",
                rows as f64 / self.study.sample_rate_hz
            ));
            let last = trials.last().map_or_else(Vec::new, |t| t.values.clone());
            // What does not stay with the record on short stretches does not on longer ones.
            let Some(values) = self.descended([0.0, 1.0 - HELD_OUT], rows, &last)? else {
                break;
            };
            trials.push(self.trial(values, Some(rows))?);
        }
        Ok(trials)
    }
}
