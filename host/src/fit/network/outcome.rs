//! What a training tells: while it runs, when it ends, and why.

use crate::fit::inertia::Inertia;
use crate::model::Network;
use crate::signal::motion::Motion;
use crate::text::error::Result;
use std::fmt;
use std::sync::atomic::AtomicBool;

/// Why a training ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// There was nothing more to gain.
    Converged(Converged),
    /// It was ended before that.
    GaveUp(GaveUp),
}

/// Which condition for the end of a training was met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Converged {
    /// Steps gained less than the tolerance.
    SmallSteps,
    /// No step at all made the error smaller.
    Level,
}

/// What was wrong with the numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BadInput {
    /// A value that is not finite came up.
    NotFinite,
}

/// Which limit ended a training before it converged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GaveUp {
    /// The steps of the last stage.
    StepLimit,
    /// The user stopped it.
    Interrupted,
}

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Converged(Converged::SmallSteps) => "converged, steps gained too little",
            Self::Converged(Converged::Level) => "converged, no step went further down",
            Self::GaveUp(GaveUp::StepLimit) => "gave up at the limit of steps",
            Self::GaveUp(GaveUp::Interrupted) => "gave up when interrupted",
        })
    }
}

/// Where a training is.
#[derive(Clone, Copy, Debug)]
pub struct NetworkProgress {
    /// Which training of those that run side by side or one after the other, from 0.
    pub training: usize,
    /// How many there are.
    pub trainings: usize,
    /// True while sizes are tried out, false in the restarts of the size that was chosen.
    pub choosing_size: bool,
    /// Neurons of this training.
    pub neurons: usize,
    /// Stage of the training, from 0.
    pub stage: usize,
    /// How many there are.
    pub stages: usize,
    /// Step within the stage, from 0.
    pub step: usize,
    /// Rows of the stage.
    pub rows: usize,
    /// NMSE on those rows, percent, of the worse axis.
    pub training_nmse_percent: f64,
    /// How much of this training's work is done, 0 to 1, if it took all the steps it may: it never
    /// takes longer.
    pub share_done: f64,
}

/// What a training tells while it runs, and how it is ended.
#[derive(Clone, Copy)]
pub struct TrainingObserver<'a> {
    /// Told after every step, from several threads.
    pub progress: &'a (dyn Fn(&NetworkProgress) + Sync),
    /// Ends all trainings when set; the best weights so far are kept.
    pub stop: &'a AtomicBool,
}

impl TrainingObserver<'_> {
    /// Tells nobody, and never ends a training.
    pub fn silent() -> Self {
        static GO_ON: AtomicBool = AtomicBool::new(false);
        Self {
            progress: &|_| (),
            stop: &GO_ON,
        }
    }
}

/// A training after one step.
#[derive(Clone, Debug, PartialEq)]
pub struct TracePoint {
    /// CPU seconds since the training began.
    pub cpu_s: f64,
    /// Rows it was trained on at that time.
    pub rows: usize,
    /// NMSE on those rows, percent, per axis.
    pub training_nmse_percent: Vec<f64>,
    /// The network as it was.
    pub network: Network,
}

/// One training from random weights.
#[derive(Clone, Debug)]
pub struct Restart {
    /// Seed of its first weights.
    pub seed: u64,
    /// The network with the best weights.
    pub network: Network,
    /// Why the training ended.
    pub stop: Stop,
    /// CPU seconds it took, on one core.
    pub cpu_s: f64,
    /// Weights that the data determine (γ), of [`Network::parameters`].
    pub effective_parameters: f64,
    /// Precision α of the weights, no unit.
    pub alpha: f64,
    /// Precision β of the normalised residuals, no unit.
    pub beta: f64,
    /// Logarithm of the evidence, up to a constant that all restarts share; the best is kept by
    /// it.
    pub log_evidence: f64,
    /// NMSE on all training rows, percent, per axis.
    pub training_nmse_percent: Vec<f64>,
    /// After every step; the last point is the result, on all rows.
    pub trace: Vec<TracePoint>,
}

/// How well a network of some size did on records that were left out.
#[derive(Clone, Debug, PartialEq)]
pub struct SizeError {
    /// Neurons of the hidden layer.
    pub neurons: usize,
    /// Per axis the geometric mean over left-out records of the NMSE, percent, wide-band.
    pub held_out_nmse_percent: Vec<f64>,
    /// The geometric mean over the axes as well: the size is chosen by it.
    pub mean_nmse_percent: f64,
}

/// What was left out, one after the other, to choose the size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeftOut {
    /// A whole record at a time.
    Records,
    /// A stretch at a time of the only record, with a guard on either side.
    Stretches,
}

/// How the number of neurons was chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct SizeCurve {
    /// Sizes in rising order.
    pub sizes: Vec<SizeError>,
    /// What was left out.
    pub left_out: LeftOut,
}

/// A trained network and what is to be known about it.
#[derive(Clone, Debug)]
pub struct NetworkFit {
    /// The best restart's network.
    pub network: Network,
    /// Which restart that is.
    pub best: usize,
    /// All that gave a network, in the order of their seeds.
    pub restarts: Vec<Restart>,
    /// Trainings that came upon values that are not finite and were begun anew with another seed.
    pub begun_anew: usize,
    /// The user ended it early.
    pub interrupted: bool,
    /// How the size was chosen; none when it was given.
    pub size_curve: Option<SizeCurve>,
    /// Per axis, stated or identified.
    pub inertia: Vec<Inertia>,
    /// Rows that were trained on.
    pub rows: usize,
    /// Why the model may not generalise, one sentence each.
    pub warnings: Vec<String>,
}

impl NetworkFit {
    /// How far the restarts' predictions lie apart on `motions`: per axis the standard deviation
    /// over restarts, as RMS over all rows, over the RMS of their mean. Weights say nothing
    /// about it: neurons can be exchanged, and their signs turned.
    ///
    /// # Errors
    /// When the motions have other axes than the network.
    pub fn disagreement(&self, motions: &[&Motion], input: Option<&str>) -> Result<Vec<f64>> {
        let axes = self.network.outputs.len();
        let (mut apart, mut size) = (vec![0.0; axes], vec![0.0; axes]);
        let count = self.restarts.len() as f64;
        for motion in motions {
            let states = motion.base_states(input);
            let predictions = self.restarts.iter().map(|r| r.network.predict(&states));
            let predictions: Vec<Vec<Vec<f64>>> = predictions.collect::<Result<_>>()?;
            for axis in 0..axes {
                for row in 0..motion.rows() {
                    let values = || predictions.iter().map(|p| p[axis][row]);
                    let mean = values().sum::<f64>() / count;
                    let square: f64 = values().map(|v| (v - mean).powi(2)).sum();
                    apart[axis] += square / (count - 1.0).max(1.0);
                    size[axis] += mean * mean;
                }
            }
        }
        let both = apart.iter().zip(&size);
        Ok(both
            .map(|(apart, size)| (apart / size.max(f64::MIN_POSITIVE)).sqrt())
            .collect())
    }
}
