//! `model.json`: a learnt model with everything needed to evaluate it on another record and to
//! export it.

use crate::model::check_states;
use crate::model::corrections::{Corrections, of_the_joint};
use crate::model::effects::{check_inputs, input_of};
use crate::model::time_history::{TimeHistory, add_forces};
use crate::model::{FollowedInput, InputRange, ModelAxis, ModelEffect, Network, Polynomial};
use crate::signal::motion::{Filters, Motion, series_named};
use crate::study::{Source, Study};
use crate::text::error::{Error, Result};
use crate::text::input;
use crate::text::output;
use crate::text::printable;
use jointwatch_shared::base::followed::Follows;
use jointwatch_shared::base::terms::EffectValues;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::collections::BTreeSet;
use std::path::Path;

/// What the first key of every model file says.
pub const FORMAT: &str = "jointwatch-model/2";

/// What a model's force is made of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Base {
    /// Powers and products of the states.
    Polynomial(Polynomial),
    /// A network of tanh neurons.
    Network(Network),
    /// Nothing: the force is that of the effects alone.
    None(NoBase),
}

/// What is left of a base when there is none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoBase {
    /// The training range of every state: displacement and velocity of each axis, SI.
    pub inputs: Vec<InputRange>,
}

impl Base {
    /// The base's name on the command line.
    pub fn name(&self) -> &'static str {
        match self {
            Base::Polynomial(_) => "polynomial",
            Base::Network(_) => "network",
            Base::None(_) => "physical",
        }
    }

    /// The training range of every state: displacement and velocity of each axis, SI; of one axis a
    /// third may be that of an input of the study.
    pub fn inputs(&self) -> &[InputRange] {
        match self {
            Base::Polynomial(polynomial) => &polynomial.inputs,
            Base::Network(network) => &network.inputs,
            Base::None(none) => &none.inputs,
        }
    }

    /// The ranges of the joint's motion alone: displacement and velocity of each axis, SI.
    pub fn motion_ranges(&self) -> &[InputRange] {
        let all = self.inputs();
        all.get(..2 * self.outputs()).unwrap_or(all)
    }

    /// The axes whose force it gives.
    fn outputs(&self) -> usize {
        match self {
            Base::Polynomial(polynomial) => polynomial.coefficients.len(),
            Base::Network(network) => network.outputs.len(),
            Base::None(none) => none.inputs.len() / 2,
        }
    }

    /// Whether its parts fit together and every number is finite.
    fn check(&self) -> Result<()> {
        match self {
            Base::Polynomial(polynomial) => polynomial.check(),
            Base::Network(network) => network.check(),
            Base::None(none) if none.inputs.iter().all(InputRange::is_sound) => Ok(()),
            Base::None(_) => Err(Error::data(
                "a training range is not finite or not positive",
            )),
        }
    }

    /// Restoring force per axis, in N or N·m, for states [x, ẋ] or [x, ẋ, φ, φ̇] in SI.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when the states are not those of the model's inputs.
    pub(crate) fn predict(&self, states: &[&[f64]]) -> Result<Vec<Vec<f64>>> {
        match self {
            Base::Polynomial(polynomial) => polynomial.predict(states),
            Base::Network(network) => network.predict(states),
            Base::None(none) => {
                let rows = check_states(states, none.inputs.len())?;
                Ok(vec![vec![0.0; rows]; self.outputs()])
            }
        }
    }
}

/// How one axis did on all records of one role together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisError {
    /// Name of the axis.
    pub axis: String,
    /// 100·Σ(r−r̂)²/(N·var r) in the common band, percent.
    pub nmse_percent: f64,
    /// RMS(r−r̂)/RMS(r) in the common band.
    pub relative_error: f64,
}

/// A figure per axis, by its name.
pub type PerAxis = BTreeMap<String, f64>;

/// The relative error of each axis.
pub(crate) fn per_axis(errors: &[AxisError]) -> PerAxis {
    let pairs = errors.iter();
    pairs.map(|e| (e.axis.clone(), e.relative_error)).collect()
}

/// How the coefficients of one axis were found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisFit {
    /// Name of the axis.
    pub axis: String,
    /// Terms that are not zero; of a network, its weights and biases.
    pub terms: usize,
    /// Weight of the ridge that cross-validation chose; 0 without one; of a network, α/β of its
    /// Bayesian regularisation.
    pub ridge: f64,
    /// Effective number of parameters at that ridge.
    pub effective_parameters: f64,
    /// RMS of the restoring force over all training rows, N or N·m.
    pub training_force_rms: f64,
    /// NMSE of the held-out blocks, percent, wide-band; none when the fit did not cross-validate.
    pub cross_validation_nmse_percent: Option<f64>,
}

/// Errors before and after a step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorChange {
    /// What they were measured on.
    pub judged_on: JudgedOn,
    /// Before it, per axis.
    pub before: Vec<AxisError>,
    /// After it, per axis.
    pub after: Vec<AxisError>,
}

impl ErrorChange {
    /// Whether the error over all axes falls to half or less: the root of the sum of the squares of
    /// the relative errors.
    pub fn halves(&self) -> bool {
        let power =
            |errors: &[AxisError]| -> f64 { errors.iter().map(|e| e.relative_error.powi(2)).sum() };
        4.0 * power(&self.after) <= power(&self.before)
    }
}

/// The rows that errors are measured on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JudgedOn {
    /// Records that the model was not learnt from.
    Validation,
    /// Stretches of the training records, each predicted from the rest: the study has no validation
    /// records.
    HeldOutBlocks,
}

impl JudgedOn {
    /// As it stands in a sentence.
    pub fn words(self) -> &'static str {
        match self {
            Self::Validation => "validation records",
            Self::HeldOutBlocks => "held-out blocks of the training records",
        }
    }
}

/// One step in the model's life.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HistoryEntry {
    /// What was done to the model: identified, an effect added, …
    pub what: String,
    /// The day on which it was done, `2026-03-14` (UTC); none when that was not wanted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub date: Option<String>,
    /// What an addition did to the errors; none for anything else.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub change: Option<ErrorChange>,
    /// Errors on the records the model was not learnt from, after it; empty when the study has
    /// none.
    pub validation: Vec<AxisError>,
}

/// A fitted model with everything that is needed to evaluate it: the content of model.json.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelFile {
    /// Names the format and its version: [`FORMAT`].
    pub format: String,
    /// Name of the study it was learnt from.
    pub study: String,
    /// One or two axes.
    pub axes: Vec<ModelAxis>,
    /// What the force is made of.
    pub base: Base,
    /// Physical effects: those of the joint add to the base, those of the instruments correct the
    /// study's data.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<ModelEffect>,
    /// What effects and base follow beside the motion.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub followed: Vec<FollowedInput>,
    /// The input of the study that is the last state of a polynomial or network of one axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state_input: Option<String>,
    /// How it was fitted: `ridge`, `least-squares` or `select`; `Levenberg-Marquardt` for a
    /// network, `variable projection` for effects alone, `output error` for a model refined by
    /// simulation.
    pub fit: String,
    /// Per axis, how the coefficients came about.
    pub fits: Vec<AxisFit>,
    /// What the training records cannot support, one sentence each.
    pub warnings: Vec<String>,
    /// Errors on the records it was learnt from.
    pub verification: Vec<AxisError>,
    /// Errors on other records; empty when the study has none.
    pub validation: Vec<AxisError>,
    /// What was done to it, oldest first.
    pub history: Vec<HistoryEntry>,
    /// The records it was learnt from and judged on, known by the hash of their files.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub records: Vec<Source>,
    /// Sample rate, bands and filters, with the numbers that the device holds.
    pub filters: Filters,
}

impl ModelFile {
    /// Reads and checks a model file.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] naming the file, the line where it stops being a model,
    /// and what to try.
    pub fn read(path: &Path) -> Result<Self> {
        let text = input::read_to_string(path).map_err(|e| {
            Error::data(format!(
                "{}: the model could not be read ({e}); give the file that `jointwatch identify … -o` wrote",
                path.display()
            ))
        })?;
        Self::parse(&path.display().to_string(), &text)
    }

    /// The model that a text in the form of model.json holds; `called` is what messages call it.
    ///
    /// # Errors
    /// As [`ModelFile::read`].
    pub fn parse(called: &str, text: &str) -> Result<Self> {
        let model: Self = serde_json::from_str(text).map_err(|e| {
            if called.ends_with(".toml") {
                return Error::data(format!(
                    "{called}: this is a study, and a model belongs here; give the study first and then the file that \
                     `jointwatch identify` wrote"
                ));
            }
            Error::data(format!(
                "{called}, line {}, column {}: this is not a Jointwatch model ({}); give the file that `jointwatch identify` wrote, \
                 or write it anew",
                e.line(),
                e.column(),
                without_position(&e)
            ))
        })?;
        model.check().map_err(|what| {
            Error::data(format!(
                "{called}: this model cannot be used, write it anew with `jointwatch identify`: {what}"
            ))
        })?;
        Ok(model)
    }

    /// Writes it in one step.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Failed`] when the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        output::write_whole(path, output::json_text(self)?.as_bytes())
    }

    /// The sentence that says what is wrong with the numbers in it, if anything.
    fn check(&self) -> std::result::Result<(), String> {
        if self.format != FORMAT {
            return Err(format!(
                "its format is '{}' where this version reads '{FORMAT}'",
                self.format
            ));
        }
        let axes = self.axes.len();
        if !(1..=2).contains(&axes) {
            return Err(format!("it has {axes} axes where one or two are possible"));
        }
        self.filters.check()?;
        if let Some(axis) = self
            .axes
            .iter()
            .find(|a| !(a.inertia.is_finite() && a.inertia >= 0.0))
        {
            return Err(format!(
                "axis {} has an inertia of {}",
                axis.name, axis.inertia
            ));
        }
        if self.fits.len() != axes {
            return Err(format!(
                "it says how {} axes were fitted but has {axes}",
                self.fits.len()
            ));
        }
        let outputs = self.base.outputs();
        if outputs != axes {
            return Err(format!(
                "it has {axes} axes but gives the force of {outputs}"
            ));
        }
        self.base.check().map_err(|e| e.sentence)?;
        let (ranges, states) = (self.base.inputs().len(), 2 * axes);
        let wanted = states + usize::from(self.state_input.is_some());
        if ranges != wanted || wanted > 2 + axes {
            return Err(format!(
                "it has {ranges} input ranges where its axes and its state_input make {wanted}"
            ));
        }
        self.effects_in_si().map_err(|e| e.sentence)?;
        match self.followed.iter().find(|input| !input.range.is_sound()) {
            Some(input) => Err(format!("the input {:?} has no range", input.name)),
            None => Ok(()),
        }
    }

    /// The effects in numbers.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] naming the effect that this version does not know.
    pub fn effects_in_si(&self) -> Result<Vec<EffectValues>> {
        self.effects.iter().map(|e| e.in_si(&self.axes)).collect()
    }

    /// Reads the study that it, perhaps with more effects, is to be held against; a column that an
    /// effect follows is an input there, whether the study names it or not.
    ///
    /// # Errors
    /// As [`Study::read`], and as [`Self::effects_in_si`].
    pub fn read_study(&self, path: &Path, more: &[String]) -> Result<Study> {
        let effects = self.effects_in_si()?;
        let own = effects.iter().filter_map(|e| e.input);
        let own = own.chain(self.state_input.as_deref());
        let more = more.iter().filter_map(|effect| input_of(effect));
        let inputs = own.chain(more).map(|input| Follows::parse(input).name);
        Study::read_following(path, &inputs.collect::<Vec<_>>())
    }

    /// What its force follows beside the motion, each once and in alphabetical order.
    ///
    /// # Errors
    /// As [`Self::effects_in_si`].
    pub fn input_names(&self) -> Result<Vec<String>> {
        let effects = of_the_joint(&self.effects_in_si()?);
        let names = followed(&effects).chain(self.state_input.as_deref());
        let names: BTreeSet<&str> = names.collect();
        Ok(names.into_iter().map(str::to_owned).collect())
    }

    /// What its effects say is wrong with the study's force channels.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when a correction is too large to be one.
    pub fn corrections(&self) -> Result<Corrections> {
        Corrections::of(&self.effects_in_si()?, self.axes.len())
    }

    /// Restoring force per axis, in N or N·m, along a record with the states [x, ẋ] or [x, ẋ, φ,
    /// φ̇] in SI.
    ///
    /// Rows have to follow each other at the model's sample rate, because effects may have memory.
    /// Effects of the instrument are no part of it: they correct what it is held against
    /// ([`ModelFile::corrected`]).
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when the states are not those of the model's inputs.
    pub fn predict(&self, states: &[&[f64]]) -> Result<Vec<Vec<f64>>> {
        self.predict_with(states, &[])
    }

    /// The same along a record, whose inputs its force may follow.
    ///
    /// # Errors
    /// As [`ModelFile::predict`]; an input that the record has not.
    pub fn predict_motion(&self, motion: &Motion) -> Result<Vec<Vec<f64>>> {
        let states: Vec<&[f64]> = motion.states.iter().map(Vec::as_slice).collect();
        self.predict_after(&motion.before, &states, &motion.inputs)
    }

    /// The same for states that some inputs with their names go with.
    ///
    /// # Errors
    /// As [`ModelFile::predict`]; an input that is not there.
    pub fn predict_with(
        &self,
        states: &[&[f64]],
        inputs: &[(String, Vec<f64>)],
    ) -> Result<Vec<Vec<f64>>> {
        self.predict_after(&[], states, inputs)
    }

    /// The same after states before the first row.
    fn predict_after(
        &self,
        before: &[Vec<f64>],
        states: &[&[f64]],
        inputs: &[(String, Vec<f64>)],
    ) -> Result<Vec<Vec<f64>>> {
        let effects = of_the_joint(&self.effects_in_si()?);
        check_inputs(&self.input_names()?, |name| {
            series_named(inputs, name).is_some()
        })?;
        let own = self.state_input.as_deref();
        let own = own.and_then(|name| series_named(inputs, name));
        let base_states: Vec<&[f64]> = states.iter().copied().chain(own).collect();
        let mut forces = self.base.predict(&base_states)?;
        let period_s = 1.0 / self.filters.sample_rate_hz;
        let history = TimeHistory::of_states(states, period_s);
        let history = history.with_inputs(inputs).after(before);
        add_forces(&effects, &history, &mut forces);
        Ok(forces)
    }
}

/// The inputs that effects follow, by name.
pub(crate) fn followed<'a>(
    effects: impl IntoIterator<Item = &'a EffectValues>,
) -> impl Iterator<Item = &'a str> {
    let followed = effects.into_iter().filter_map(|e| e.input);
    followed.map(|input| Follows::parse(input).name)
}

/// serde_json's message without its own "at line … column …", which the sentence already says.
fn without_position(error: &serde_json::Error) -> String {
    let text = error.to_string();
    // It quotes the file, which may have anything in its strings.
    printable::line(text.split(" at line ").next().unwrap_or(&text))
}
