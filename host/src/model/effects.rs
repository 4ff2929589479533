//! The physical effects of a model on the host: how they stand in `model.json`, and which axis each
//! is bound to.

use super::ModelAxis;
use crate::study::Study;
use crate::text::error::{Error, Result};
use crate::text::nearest::suggestion;
use jointwatch_shared::base::followed::{Follows, kept};
use jointwatch_shared::base::{Model, axis, terms::EffectValues};
use jointwatch_shared::effect::about::{Parameter, Role};
use jointwatch_shared::effect::{Acts, EFFECTS, Entry, Subsystem};
use serde::{Deserialize, Serialize};

/// One effect of a model, with the values that were found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelEffect {
    /// The effect's name, e.g. `coulomb`.
    pub effect: String,
    /// The axis that it is bound to; none for an effect on both.
    pub axis: Option<String>,
    /// Its parameters, in the order in which the effect lists them.
    pub parameters: Vec<ParameterValue>,
}

/// One parameter of an effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterValue {
    /// The parameter's name, as the effect lists it.
    pub name: String,
    /// Its value, in `unit`.
    pub value: f64,
    /// The SI unit; – for a number without one.
    pub unit: String,
    /// The interval that covers the true value in 95 of 100 such experiments; none when the
    /// records do not say.
    pub interval: Option<[f64; 2]>,
}

impl ModelEffect {
    /// Whether nothing is left of it: every strength that has to be positive is held at nothing.
    pub fn has_vanished(&self) -> bool {
        let positive = |p: &Parameter| matches!(p.role, Role::Linear { positive: true });
        self.has_all(positive, |found| found.value == 0.0)
    }

    /// Whether no strength of it is told by the records: the interval of each holds 0, or there is
    /// none.
    pub fn is_undetermined(&self) -> bool {
        self.has_all(Parameter::is_linear, |found| {
            found
                .interval
                .is_none_or(|[low, high]| low <= 0.0 && 0.0 <= high)
        })
    }

    /// Whether it has parameters of a kind, and something holds of each.
    fn has_all(
        &self,
        of_kind: impl Fn(&Parameter) -> bool,
        holds: impl Fn(&ParameterValue) -> bool,
    ) -> bool {
        let Some(entry) = Entry::named(&self.effect) else {
            return false;
        };
        let listed = entry.parameters().iter().zip(&self.parameters);
        let mut listed = listed.filter(|(p, _)| of_kind(p)).peekable();
        listed.peek().is_some() && listed.all(|(_, found)| holds(found))
    }

    /// An effect with its values in SI; `names` and `kinds` are those of the model's axes,
    /// `intervals` may be empty.
    pub fn new(
        bound: &AxisEffect,
        names: &[&str],
        kinds: &[axis::AxisKind],
        values: &[f64],
        intervals: &[Option<[f64; 2]>],
    ) -> Self {
        let kind = |index: usize| {
            kinds
                .get(index)
                .copied()
                .unwrap_or(axis::AxisKind::Translation)
        };
        let (own, other) = (kind(bound.axis), kind(1 - bound.axis));
        let listed = bound.entry.parameters().iter().zip(values).enumerate();
        let parameter =
            |(index, (parameter, &value)): (usize, (&Parameter, &f64))| ParameterValue {
                name: parameter.name.into(),
                value,
                unit: bound.unit(parameter, own, other),
                interval: intervals.get(index).copied().flatten(),
            };
        Self {
            effect: bound.effect(),
            axis: (bound.entry.acts == Acts::OwnAxis).then(|| names[bound.axis].into()),
            parameters: listed.map(parameter).collect(),
        }
    }

    /// The effects of a model on the device, in SI; a blob keeps no intervals.
    pub fn of_device(model: &Model) -> Vec<Self> {
        let header = model.header();
        let names: Vec<&str> = header.axes.iter().map(|a| a.name.as_str()).collect();
        let kinds: Vec<axis::AxisKind> = header.axes.iter().map(|a| a.kind).collect();
        let terms = model.terms().in_si(header, model.outputs());
        let term = |term: EffectValues| {
            let bound = AxisEffect::from(&term);
            Self::new(&bound, &names, &kinds, &term.values, &[])
        };
        terms.into_iter().map(term).collect()
    }

    /// `effect@axis`, or the effect's name alone when it acts on both axes.
    pub fn name(&self) -> String {
        match &self.axis {
            Some(axis) => format!("{}@{axis}", self.effect),
            None => self.effect.clone(),
        }
    }

    /// The effect in numbers.
    ///
    /// # Errors
    /// One sentence when the effect, its axis or its parameters are not known.
    pub fn in_si(&self, axes: &[ModelAxis]) -> Result<EffectValues> {
        let names: Vec<&str> = axes.iter().map(|a| a.name.as_str()).collect();
        self.bound_in_si(&names)
    }

    /// The same for axes of which only the names are known.
    ///
    /// # Errors
    /// As [`ModelEffect::in_si`].
    pub fn bound_in_si(&self, names: &[&str]) -> Result<EffectValues> {
        let bound = AxisEffect::parse(&self.name(), names)?;
        let listed = bound.entry.parameters();
        let fits = listed.len() == self.parameters.len()
            && listed
                .iter()
                .zip(&self.parameters)
                .all(|(known, mine)| known.name == mine.name && mine.value.is_finite());
        if !fits {
            let wanted: Vec<&str> = listed.iter().map(|p| p.name).collect();
            return Err(Error::data(format!(
                "the effect {} has not the finite parameters {}: identify it anew",
                self.name(),
                wanted.join(", ")
            )));
        }
        Ok(EffectValues {
            input: bound.input,
            entry: bound.entry,
            axis: bound.axis as u8,
            values: self.parameters.iter().map(|p| p.value).collect(),
        })
    }
}

/// An effect bound to an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisEffect {
    /// The effect as the table lists it.
    pub entry: &'static Entry,
    /// The axis, from 0; 0 for an effect on both.
    pub axis: usize,
    /// The name of the input that its force is proportional to; none for one that follows the
    /// motion alone.
    pub input: Option<&'static str>,
}

/// Takes `effect*input` apart; `effect * input(name)` is the same.
fn apart(text: &str) -> (&str, Option<&str>) {
    match text.split_once('*') {
        None => (text.trim(), None),
        Some((effect, input)) => {
            let input = input.trim();
            let inner = input
                .strip_prefix("input(")
                .and_then(|i| i.strip_suffix(')'));
            (effect.trim(), Some(inner.unwrap_or(input).trim()))
        }
    }
}

/// The input that an effect follows, as it is written.
pub(crate) fn input_of(effect: &str) -> Option<&str> {
    let input = effect.split('@').find_map(|part| apart(part).1);
    input.filter(|input| !input.is_empty())
}

/// Refuses inputs that a model follows and that are not there.
pub(crate) fn check_inputs(
    followed: impl IntoIterator<Item = impl AsRef<str>>,
    is_there: impl Fn(&str) -> bool,
) -> Result<()> {
    let mut followed = followed.into_iter();
    match followed.find(|name| !is_there(name.as_ref())) {
        None => Ok(()),
        Some(name) => Err(Error::data(format!(
            "the model follows the input {name:?}, which is not there: name its column in study.toml with [[input]], name = {name:?}",
            name = name.as_ref()
        ))),
    }
}

impl From<&EffectValues> for AxisEffect {
    fn from(term: &EffectValues) -> Self {
        Self {
            entry: term.entry,
            axis: usize::from(term.axis),
            input: term.input,
        }
    }
}

impl AxisEffect {
    /// Reads `effect@axis`, or `effect` for one that acts on both axes; `effect*input@axis` or
    /// `effect@axis * input(name)` for one whose force is proportional to an input of the
    /// study; `effect*input~10ms@axis` where the input acts behind a first-order lag.
    ///
    /// # Errors
    /// One sentence: an effect that is not known (with the nearest that is), an axis that does not
    /// exist, is missing, or is too much, an effect on two axes where there is one.
    pub fn parse(text: &str, axes: &[&str]) -> Result<Self> {
        let (name, axis) = match text.split_once('@') {
            Some((name, axis)) => (name, Some(axis)),
            None => (text, None),
        };
        let ((name, input), (axis, behind)) = (
            apart(name),
            match axis.map(apart) {
                None => (None, None),
                Some((axis, input)) => (Some(axis), input),
            },
        );
        if let (Some(first), Some(second)) = (input, behind) {
            return Err(Error::data(format!(
                "{text:?} follows two inputs, {first} and {second}, and an effect follows one: write it twice, each with its own"
            )));
        }
        let input = input.or(behind);
        let known: Vec<&str> = EFFECTS.iter().map(|e| e.about.name).collect();
        let Some(entry) = Entry::named(name) else {
            return Err(Error::data(format!(
                "there is no effect {name:?} ({text:?}): {}",
                suggestion(name, &known)
            )));
        };
        let axis = match (entry.acts, axis) {
            (_, _) if entry.needs_two_axes() && axes.len() < 2 => {
                return Err(Error::data(format!(
                    "{name} needs two axes, and this study has one: leave it out"
                )));
            }
            (Acts::BothAxes, Some(axis)) => {
                return Err(Error::data(format!(
                    "{name} acts on both axes and takes no @{axis}: write {name:?}"
                )));
            }
            (Acts::BothAxes, None) => 0,
            (Acts::OwnAxis, None) => {
                return Err(Error::data(format!(
                    "{name} needs the axis it acts on: write \"{name}@{}\"",
                    axes.first().unwrap_or(&"x")
                )));
            }
            (Acts::OwnAxis, Some(axis)) => axes
                .iter()
                .position(|known| *known == axis)
                .ok_or_else(|| {
                    Error::data(format!(
                        "{text:?} names an axis that the study has not: {}",
                        suggestion(axis, axes)
                    ))
                })?,
        };
        if let Some(input) = input {
            let follows = entry.acts == Acts::OwnAxis && entry.subsystem == Subsystem::Plant;
            if input.is_empty() || !follows {
                return Err(Error::data(format!(
                    "{text:?}: only an effect of the joint on one axis can follow an input: write \"effect*input@axis\""
                )));
            }
            if Follows::parse(input).name.contains('~') {
                return Err(Error::data(format!(
                    "{text:?}: the lag behind which an input acts is written in milliseconds, as in {name}*voltage~10ms"
                )));
            }
        }
        Ok(Self {
            entry,
            axis,
            input: input.map(kept),
        })
    }

    /// The name of an input as bounds hold it.
    pub(crate) fn kept_input(name: &str) -> &'static str {
        kept(name)
    }

    /// The effect's name, with the input that it follows: `coulomb`, `coulomb*voltage`.
    pub fn effect(&self) -> String {
        match self.input {
            None => self.entry.about.name.into(),
            Some(input) => format!("{}*{input}", self.entry.about.name),
        }
    }

    /// The unit of one of its parameters on axes of these kinds: `N`, or `N per voltage` where the
    /// force follows an input.
    pub fn unit(
        &self,
        parameter: &Parameter,
        own: axis::AxisKind,
        other: axis::AxisKind,
    ) -> String {
        let unit = parameter.dimension.unit(own, other);
        match self.input.filter(|_| parameter.is_linear()) {
            None => unit.to_string(),
            Some(input) => {
                let follows = Follows {
                    lag_s: 0.0,
                    ..Follows::parse(input)
                };
                format!("{unit} per {}", follows.written())
            }
        }
    }

    /// Whether a parameter that its force is proportional to has to be positive: one that follows
    /// an input may fall with it.
    pub fn is_positive(&self, parameter: &Parameter) -> bool {
        self.input.is_none() && matches!(parameter.role, Role::Linear { positive: true })
    }

    /// Whether the other one is the same effect on the same axis, whatever inputs they follow: then
    /// they share their shapes.
    pub fn is_twin(&self, other: &Self) -> bool {
        self.entry == other.entry && self.axis == other.axis && self.input != other.input
    }

    /// Reads a list of terms, each of which may stand only once.
    ///
    /// # Errors
    /// As [`AxisEffect::parse`]; one sentence for a term that is there twice.
    pub fn parse_all(terms: &[String], axes: &[&str]) -> Result<Vec<Self>> {
        let mut all: Vec<Self> = Vec::new();
        for text in terms {
            let bound = Self::parse(text, axes)?;
            if all.contains(&bound) {
                return Err(Error::data(format!(
                    "{} stands twice: the two could not be told apart, keep one",
                    bound.name(axes)
                )));
            }
            if let Some(rival) = all.iter().find(|other| bound.rules_out(other)) {
                return Err(Error::data(format!(
                    "{} and {} cannot be told apart on one axis: keep one",
                    rival.name(axes),
                    bound.name(axes)
                )));
            }
            all.push(bound);
        }
        Ok(all)
    }

    /// Refuses an effect that a study has no column or too few records for.
    ///
    /// # Errors
    /// One sentence: an input that the study has not, or a zero per record in a study of one
    /// record.
    pub(crate) fn check_in(&self, study: &Study, axes: &[&str]) -> Result<()> {
        study.check_input(&self.name(axes), self.input)?;
        let stands = self.entry.is_zero_per_record() && self.entry.parameters().len() == 1;
        if stands && study.records.len() < 2 {
            return Err(Error::data(format!(
                "{} is another one in every record, and the study has one record: name preload in its place, or add records",
                self.name(axes)
            )));
        }
        Ok(())
    }

    /// Whether it contributes to the force of an axis.
    pub fn acts_on(&self, axis: usize) -> bool {
        self.axis == axis || self.entry.acts == Acts::BothAxes
    }

    /// Whether a model cannot have both on the same axis.
    pub fn rules_out(&self, other: &Self) -> bool {
        let never = |a: &Self, b: &Self| a.entry.never_with.contains(&b.entry.about.name);
        let both = self.axis == other.axis
            && self.input == other.input
            && (never(self, other) || never(other, self));
        both || self.replaces(other) || other.replaces(self)
    }

    /// The same following the square of its input; none without an input, and of a square.
    pub fn squared(&self) -> Option<Self> {
        let follows = Follows::parse(self.input?);
        let square = Follows {
            squared: true,
            ..follows
        };
        (!follows.squared).then(|| Self {
            input: Some(Self::kept_input(&square.written())),
            ..*self
        })
    }

    /// Whether the other one is this one with special strengths, so that adding this one takes it
    /// out of a model.
    pub fn replaces(&self, other: &Self) -> bool {
        self.axis == other.axis
            && self.input == other.input
            && self.entry.replaces.contains(&other.entry.about.name)
    }

    /// `effect@axis`, or the effect's name alone when it acts on both axes.
    pub fn name(&self, axes: &[&str]) -> String {
        match self.entry.acts {
            Acts::BothAxes => self.entry.about.name.into(),
            Acts::OwnAxis => format!("{}@{}", self.effect(), axes[self.axis]),
        }
    }
}
/// Whether an effect of this name corrects an instrument.
pub fn is_correction(effect: &str) -> bool {
    Entry::named(effect).is_some_and(|entry| entry.subsystem == Subsystem::Sensor)
}
