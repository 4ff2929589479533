//! What the report's page is given: the record as samples, the statistics of all rows, and words.
//! The page's scripts draw it.

use crate::assess::where_it_fails::Condition;
use serde::Serialize;
use std::collections::BTreeMap;

/// Everything on the page. Numbers are in SI; the scripts choose prefixes.
#[derive(Clone, Debug, Serialize)]
pub struct Contents {
    /// The study's name, which is the page's title.
    pub title: String,
    /// The command that made the page.
    pub asked: String,
    /// The day on which it was made; none when that was not wanted.
    pub made: Option<String>,
    /// The version of the program that made the page.
    pub version: &'static str,
    /// The answer in one sentence.
    pub answer: String,
    /// What the errors are measured on.
    pub judged_on: String,
    /// Whether the logs have time; else all that runs over time runs over rows, and what needs a
    /// velocity is not drawn.
    pub timed: bool,
    /// Names of the models that the page compares: before and after, or one.
    pub versions: Vec<String>,
    /// One entry per axis.
    pub axes: Vec<AxisContents>,
    /// One entry per record.
    pub records: Vec<RecordContents>,
    /// Where the models fail.
    pub regions: Vec<Region>,
    /// Candidates for what is missing; empty when nobody asked.
    pub candidates: Vec<Candidate>,
    /// How the rig moves with the model in place of its joint; empty when nobody asked.
    pub responses: Vec<ResponseContents>,
    /// What was done to the data.
    pub handling: Handling,
}

/// One record's motion, simulated with the model in place of the joint.
#[derive(Clone, Debug, Serialize)]
pub struct ResponseContents {
    /// The record's file, as study.toml names it.
    pub file: String,
    /// `the measured motion` or `the rig's true motion`.
    pub against: &'static str,
    /// Seconds since the beginning of the file.
    pub time: Packed,
    /// Per axis the displacement that it is held against, and the simulated one.
    pub axes: Vec<ResponseAxis>,
}

/// One axis of a simulated motion.
#[derive(Clone, Debug, Serialize)]
pub struct ResponseAxis {
    /// What it is held against.
    pub measured: Packed,
    /// Simulated; not a number where the simulation had diverged.
    pub simulated: Packed,
    /// NMSE of the displacement x, 100·Σ(x−x̂)²/(N·var x), percent.
    pub nmse_percent: f64,
    /// The axis rests in this record.
    #[serde(rename = "rests")]
    pub at_rest: bool,
}

/// One axis: its errors, its model, its residual over all judged rows.
#[derive(Clone, Debug, Serialize)]
pub struct AxisContents {
    /// The axis's name, as in the study.
    pub name: String,
    /// Units of displacement, velocity, force: SI symbols.
    pub units: Units,
    /// Error after every step.
    pub steps: Vec<Stair>,
    /// Relative error that the noise alone makes.
    pub floor: Option<f64>,
    /// Equation and values of every version.
    pub models: Vec<ModelWords>,
    /// The residual of every version.
    pub residual: Vec<ResidualContents>,
}

/// SI symbols of an axis.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Units {
    /// m or rad.
    pub displacement: &'static str,
    /// m/s or rad/s.
    pub velocity: &'static str,
    /// N or N·m.
    pub force: &'static str,
}

/// One step of the staircase.
#[derive(Clone, Debug, Serialize)]
pub struct Stair {
    /// What was done in this step.
    pub label: String,
    /// RMS error over RMS force.
    pub error: f64,
}

/// The model of one axis in words.
#[derive(Clone, Debug, Serialize)]
pub struct ModelWords {
    /// The restoring force as a sum.
    pub equation: String,
    /// Lines below the equation: what its symbols mean.
    pub notes: Vec<String>,
    /// The model's terms with their values.
    pub terms: Vec<Term>,
}

/// One effect with its values.
#[derive(Clone, Debug, Serialize)]
pub struct Term {
    /// The effect and its axis: `coulomb@x`.
    pub name: String,
    /// What the effect is, in a few words; empty for one that the program does not know.
    pub title: String,
    /// The law as an equation.
    pub law: String,
    /// The parameters with their values.
    pub values: Vec<Value>,
}

/// A parameter with its value.
#[derive(Clone, Debug, Serialize)]
pub struct Value {
    /// The symbol in the law.
    pub symbol: String,
    /// What the parameter is.
    pub meaning: String,
    /// The parameter's value, in the unit beside it.
    pub value: f64,
    /// SI unit; – without one.
    pub unit: String,
    /// 95 % confidence interval, in the same unit.
    pub interval: Option<[f64; 2]>,
}

/// The residual of one version on one axis, over all judged rows.
#[derive(Clone, Debug, Serialize)]
pub struct ResidualContents {
    /// Over displacement, velocity and the time since the last reversal; without time over
    /// displacement alone.
    pub over: BTreeMap<&'static str, Curve>,
    /// What a study without time does not have.
    #[serde(flatten)]
    pub timed: Option<TimedResidual>,
}

/// What is only asked of a residual over time.
#[derive(Clone, Debug, Serialize)]
pub struct TimedResidual {
    /// Over the state plane.
    pub plane: Plane,
    /// Power spectra of force and residual.
    pub spectrum: SpectrumContents,
    /// Correlations with itself, force, displacement and velocity.
    pub correlation: Vec<Correlation>,
}

/// Means cell by cell, row by row from the lowest velocity; none in cells without rows.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Plane {
    /// Cells across and up.
    pub cells: [usize; 2],
    /// Range of the displacement.
    pub displacement: [f64; 2],
    /// Range of the velocity.
    pub velocity: [f64; 2],
    /// How many rows fall into each cell.
    pub rows: Vec<u32>,
    /// Mean residual per cell.
    pub mean: Vec<Option<f32>>,
    /// RMS residual per cell.
    pub rms: Vec<Option<f32>>,
    /// Mean predicted force per cell.
    pub predicted: Vec<Option<f32>>,
    /// Mean measured force per cell.
    pub measured: Vec<Option<f32>>,
}

/// The residual over one quantity, bin by bin.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Curve {
    /// Middle of every bin.
    pub at: Vec<f64>,
    /// Mean residual of every bin, N or N·m.
    pub mean: Vec<f64>,
    /// A tenth of the bin's rows lies below.
    pub low: Vec<f64>,
    /// A tenth lies above.
    pub high: Vec<f64>,
}

/// Power spectral densities over frequency.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SpectrumContents {
    /// Distance of two lines, Hz; the first stands at 0.
    pub resolution_hz: f64,
    /// Residual, force per √Hz.
    pub residual: Vec<f32>,
    /// Measured force, the same.
    pub force: Vec<f32>,
}

/// A correlation over lags.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Correlation {
    /// `residual`, `force`, `displacement` or `velocity`.
    pub with: &'static str,
    /// Distance of two lags, s; with itself from 0, else the middle one is 0. A positive lag: the
    /// residual comes later.
    pub step_s: f64,
    /// Coefficient of correlation at every lag, −1 to 1.
    pub coefficient: Vec<f32>,
    /// 99 of 100 coefficients of a residual of the same colour that has nothing to do with the
    /// other stay within ± this.
    pub bound: f64,
}

/// The samples of one record and its errors.
#[derive(Clone, Debug, Serialize)]
pub struct RecordContents {
    /// The record's file, as study.toml names it.
    pub file: String,
    /// What the study uses it for: `train` or `validate`.
    pub role: &'static str,
    /// Rows that were compared.
    pub rows: usize,
    /// Rows on the page: fewer where the extremes of every stretch stand for it.
    pub kept: usize,
    /// Seconds since the first row used.
    pub time: Packed,
    /// One entry per axis.
    pub axes: Vec<SampleAxis>,
}

/// One axis of one record.
#[derive(Clone, Debug, Serialize)]
pub struct SampleAxis {
    /// The axis rests in this record.
    #[serde(rename = "rests")]
    pub at_rest: bool,
    /// Relative displacement, m or rad.
    pub displacement: Packed,
    /// Relative velocity, m/s or rad/s.
    pub velocity: Packed,
    /// One entry per version.
    pub versions: Vec<SampleVersion>,
    /// The force that each candidate would add; in one record, where there are candidates.
    pub candidates: Vec<Option<Packed>>,
}

/// What one version says of one axis of one record.
#[derive(Clone, Debug, Serialize)]
pub struct SampleVersion {
    /// Measured restoring force, as this version's inertia and corrections have it.
    pub measured: Packed,
    /// Measured minus predicted force, N or N·m.
    pub residual: Packed,
    /// NMSE: 100·Σe²/(N·var r), percent, e the residual and r the measured force.
    pub nmse_percent: f64,
    /// MATLAB's fit: 100·(1 − ‖e‖/‖r − mean r‖).
    pub fit_percent: f64,
    /// RMS error over RMS force.
    pub relative_error: f64,
    /// Largest error, N or N·m.
    pub peak_error: f64,
    /// Part of the rows outside the model's training range.
    pub outside_range: f64,
}

/// A series as integers of 16 bits: value = middle + step·integer; −32768 is not a number.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Packed {
    /// Middle of the range.
    pub middle: f64,
    /// What one integer is worth, in the unit of the series.
    pub step: f64,
    /// Little-endian integers in base64.
    pub data: String,
}

/// A place where a model fails.
#[derive(Clone, Debug, Serialize)]
pub struct Region {
    /// Which axis, from 0.
    pub axis: usize,
    /// Which version, from 0.
    pub version: usize,
    /// `state`, `time` or `frequency`.
    pub kind: &'static str,
    /// The region in words.
    pub words: String,
    /// Its part of the squared error.
    pub share_of_error: f64,
    /// Its part of the rows.
    pub share_of_rows: f64,
    /// Conditions that all hold there.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub conditions: Vec<Condition>,
    /// The record and the seconds from and to.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stretch: Option<(usize, f64, f64)>,
    /// Lower and upper end of the band, Hz; `None` where it is no band.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub band_hz: Option<[f64; 2]>,
}

/// A candidate for what is missing.
#[derive(Clone, Debug, Serialize)]
pub struct Candidate {
    /// The effect and its axis: `coulomb@x`.
    pub name: String,
    /// What the effect is, in a few words; empty for one that the program does not know.
    pub title: String,
    /// Its axis, from 0; none when it acts on both.
    pub axis: Option<usize>,
    /// Whether the diagnosis names it.
    pub found: bool,
    /// Relative error without it.
    pub error_before: f64,
    /// Relative error with it.
    pub error_after: f64,
    /// 95 % interval of that.
    pub interval: [f64; 2],
    /// Effects that these records cannot tell from it.
    pub as_good: Vec<String>,
    /// Effects that are much like it and predict worse.
    pub worse: Vec<String>,
    /// The experiment that would.
    pub experiment: String,
    /// The parameters with their values.
    pub values: Vec<Value>,
}

/// What was done to the data.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Handling {
    /// Heading and cells of the table of channels.
    pub channels: Vec<[String; 5]>,
    /// Rate, bands, filters: what and how much.
    pub filters: Vec<[String; 2]>,
    /// Why the study has these bands.
    pub reason: String,
    /// Corrections of channels, a sentence each.
    pub corrections: Vec<String>,
    /// What the reader of the logs had to say.
    pub notes: Vec<String>,
    /// What is wrong with the data.
    pub problems: Vec<String>,
    /// What to be wary of.
    pub warnings: Vec<String>,
    /// Mistakes that the study seems to hold.
    pub checks: Vec<String>,
    /// What the search for missing effects had to say beside its answer.
    pub remarks: Vec<String>,
}
