//! One training: from random weights on few rows to the last digits on all of them.
//!
//! A stage ends when steps gain less than its tolerance; the next has twice the rows and half the
//! tolerance, and begins where the last one ended. Most steps are taken where they cost little.

use super::levenberg_marquardt::{Search, Step};
use super::outcome::{BadInput, Converged, GaveUp, NetworkProgress, Stop, TrainingObserver};
use super::rows::Rows;
use super::start;
use cpu_time::ThreadTime;
use std::sync::atomic::Ordering;

/// So many steps in a row must gain less than the tolerance.
const SLOW_STEPS: usize = 2;

/// Steps before the precisions are first estimated: at the start the errors say nothing about
/// noise.
const STEPS_UNWEIGHED: usize = 3;

/// When a training ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Of the last stage: share of the merit that a step must gain.
    pub(super) tolerance: f64,
    /// Steps of each stage.
    pub(super) steps_per_stage: usize,
}

impl Default for Limits {
    /// A longer training still halves the training error now and then, for several times the time.
    fn default() -> Self {
        Self {
            tolerance: 5e-3,
            steps_per_stage: 24,
        }
    }
}

/// A training after a step.
#[derive(Clone, Debug)]
pub(super) struct Snapshot {
    pub(super) cpu_s: f64,
    pub(super) rows: usize,
    /// `[input][neuron]`, the bias as the last input.
    pub(super) hidden: Vec<f64>,
    /// One column per output, the bias in the last row.
    pub(super) output: faer::Mat<f64>,
    /// Σ r² per output over Σ (y − ȳ)², on the rows of the stage.
    pub(super) errors: Vec<f64>,
}

/// How one training went, and why it stopped.
#[derive(Clone, Debug)]
pub(super) struct Training {
    pub(super) stop: Stop,
    /// After every step; the last is the result, on all rows.
    pub(super) trace: Vec<Snapshot>,
    pub(super) effective_parameters: f64,
    pub(super) alpha: f64,
    pub(super) beta: f64,
    pub(super) log_evidence: f64,
}

/// Trains once, from random weights drawn by `seed`.
///
/// # Errors
/// When a value that is not finite comes up.
pub(super) fn train(
    rows: &Rows,
    neurons: usize,
    seed: u64,
    limits: Limits,
    watch: &TrainingObserver<'_>,
) -> Result<Training, BadInput> {
    let clock = ThreadTime::now();
    let first = start::weights(rows.inputs, neurons, seed);
    let mut search = Search::new(rows, neurons, first, rows.stage(0)).ok_or(BadInput::NotFinite)?;
    let spreads: Vec<Vec<f64>> = (0..rows.stages())
        .map(|stage| rows.spread(rows.stage(stage)))
        .collect();
    let mut trace = Vec::new();
    let mut stop = Stop::GaveUp(GaveUp::StepLimit);
    'stages: for (stage, spread) in spreads.iter().enumerate() {
        if stage > 0 && !search.extend(rows.stage(stage)) {
            return Err(BadInput::NotFinite);
        }
        let tolerance = limits.tolerance * f64::from(1 << (rows.stages() - 1 - stage));
        let mut slow = 0;
        stop = Stop::GaveUp(GaveUp::StepLimit);
        for step in 0..limits.steps_per_stage {
            if watch.stop.load(Ordering::Relaxed) {
                stop = Stop::GaveUp(GaveUp::Interrupted);
                break 'stages;
            }
            match search.step(stage > 0 || step >= STEPS_UNWEIGHED) {
                Step::NotFinite => return Err(BadInput::NotFinite),
                Step::Level => {
                    stop = Stop::Converged(Converged::Level);
                    break;
                }
                Step::Down(gain) => slow = if gain < tolerance { slow + 1 } else { 0 },
            }
            let now = snapshot(&search, spread, &clock);
            (watch.progress)(&NetworkProgress {
                training: 0,
                trainings: 1,
                choosing_size: false,
                neurons,
                stage,
                stages: rows.stages(),
                step,
                rows: search.rows(),
                training_nmse_percent: 100.0 * now.errors.iter().copied().fold(0.0, f64::max),
                share_done: share_done(
                    rows,
                    stage,
                    (step + 1) as f64 / limits.steps_per_stage as f64,
                ),
            });
            trace.push(now);
            if slow == SLOW_STEPS {
                stop = Stop::Converged(Converged::SmallSteps);
                break;
            }
        }
    }
    if !search.conclude(rows.count()) {
        return Err(BadInput::NotFinite);
    }
    trace.push(snapshot(&search, &rows.spread(rows.count()), &clock));
    Ok(Training {
        stop,
        trace,
        effective_parameters: search.effective_parameters,
        alpha: search.precisions.alpha,
        beta: search.precisions.beta,
        log_evidence: search.log_evidence,
    })
}

/// Rows times steps that are done, over all there can be.
fn share_done(rows: &Rows, stage: usize, of_stage: f64) -> f64 {
    let work = |stages: usize| (0..stages).map(|s| rows.stage(s)).sum::<usize>() as f64;
    (work(stage) + of_stage * rows.stage(stage) as f64) / work(rows.stages())
}

fn snapshot(search: &Search<'_>, spread: &[f64], clock: &ThreadTime) -> Snapshot {
    let errors = search.output.squared_errors.iter().zip(spread);
    Snapshot {
        cpu_s: clock.elapsed().as_secs_f64(),
        rows: search.rows(),
        hidden: search.weights.clone(),
        output: search.output.weights.clone(),
        errors: errors.map(|(e, s)| e / s.max(f64::MIN_POSITIVE)).collect(),
    }
}
