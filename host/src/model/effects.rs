//! The physical effects of a model on the host: how they stand in `model.json`, and the force they give along a record.

use super::ModelAxis;
use crate::corrections::is_correction;
use crate::error::{Error, Result};
use crate::motion::Motion;
use crate::study::Convention;
use crate::study::nearest::suggestion;
use crate::table::Table;
use jointwatch_shared::effect::about::Parameter;
use jointwatch_shared::effect::{
    Acts, EFFECTS, Entry, Instrument, Kinematics, Law, Parameters, States,
};
use jointwatch_shared::model::{Model, axis, terms::InSi};
use jointwatch_shared::scalar::Scalar;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// One effect of a model, with the values that were found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EffectTerm {
    /// The effect's name.
    pub effect: String,
    /// The axis that it is bound to; none for an effect on both.
    pub axis: Option<String>,
    /// Its parameters, in the order in which the effect lists them.
    pub parameters: Vec<ParameterValue>,
}

/// One parameter of an effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterValue {
    /// Its name.
    pub name: String,
    /// Its value, in `unit`.
    pub value: f64,
    /// The SI unit; – for a number without one.
    pub unit: String,
    /// The interval that covers the true value in 95 of 100 such experiments; none when the records do not say.
    pub interval: Option<[f64; 2]>,
}

impl EffectTerm {
    /// An effect with its values in SI; `names` and `kinds` are those of the model's axes, `intervals` may be empty.
    pub fn new(
        bound: &Bound,
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
                unit: parameter.dimension.unit(own, other).to_string(),
                interval: intervals.get(index).copied().flatten(),
            };
        Self {
            effect: bound.entry.about.name.into(),
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
        let term = |term: InSi| {
            let bound = Bound {
                entry: term.entry,
                axis: usize::from(term.axis),
            };
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
    pub fn in_si(&self, axes: &[ModelAxis]) -> Result<InSi> {
        let names: Vec<&str> = axes.iter().map(|a| a.name.as_str()).collect();
        self.bound_in_si(&names)
    }

    /// The same for axes of which only the names are known.
    ///
    /// # Errors
    /// As [`EffectTerm::in_si`].
    pub fn bound_in_si(&self, names: &[&str]) -> Result<InSi> {
        let bound = Bound::parse(&self.name(), names)?;
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
        Ok(InSi {
            entry: bound.entry,
            axis: bound.axis as u8,
            values: self.parameters.iter().map(|p| p.value).collect(),
        })
    }
}

/// Every parameter of a model's effects, in a table.
pub fn table(effects: &[EffectTerm]) -> Table {
    // Where everything acts in the joint, a column that says so only takes room.
    let corrects = effects.iter().any(|e| is_correction(&e.effect));
    let mut heading = vec!["effect", "parameter", "value", "95 % interval", "unit"];
    if corrects {
        heading.push("is part of");
    }
    let mut table = Table::new(&heading);
    for effect in effects {
        let mut name = effect.name();
        for parameter in &effect.parameters {
            let interval = parameter.interval.map_or("unknown".into(), |[low, high]| {
                format!("{low:.4e} to {high:.4e}")
            });
            let mut row = vec![
                std::mem::take(&mut name),
                parameter.name.clone(),
                format!("{:.5e}", parameter.value),
                interval,
                parameter.unit.clone(),
            ];
            if corrects {
                row.push(if is_correction(&effect.effect) {
                    "the instruments: corrects the data".into()
                } else {
                    "the joint".into()
                });
            }
            table.row(row);
        }
    }
    table
}

/// The same without intervals, for a model that keeps none.
pub fn table_of_values(effects: &[EffectTerm]) -> Table {
    let mut table = Table::new(&["effect", "parameter", "value", "unit"]);
    for effect in effects {
        let mut name = effect.name();
        for parameter in &effect.parameters {
            table.row(vec![
                std::mem::take(&mut name),
                parameter.name.clone(),
                format!("{:.5e}", parameter.value),
                parameter.unit.clone(),
            ]);
        }
    }
    table
}

/// An effect bound to an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// The effect.
    pub entry: &'static Entry,
    /// The axis, from 0; 0 for an effect on both.
    pub axis: usize,
}

impl Bound {
    /// Reads `effect@axis`, or `effect` for one that acts on both axes.
    ///
    /// # Errors
    /// One sentence: an effect that is not known (with the nearest that is), an axis that does not exist, is missing, or is too
    /// much, an effect on two axes where there is one.
    pub fn parse(text: &str, axes: &[&str]) -> Result<Self> {
        let (name, axis) = match text.split_once('@') {
            Some((name, axis)) => (name.trim(), Some(axis.trim())),
            None => (text.trim(), None),
        };
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
        Ok(Self { entry, axis })
    }

    /// Reads a list of terms, each of which may stand only once.
    ///
    /// # Errors
    /// As [`Bound::parse`]; one sentence for a term that is there twice.
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

    /// Whether it contributes to the force of an axis.
    pub fn acts_on(&self, axis: usize) -> bool {
        self.axis == axis || self.entry.acts == Acts::BothAxes
    }

    /// Whether a model cannot have both on the same axis.
    pub fn rules_out(&self, other: &Self) -> bool {
        let never = |a: &Self, b: &Self| a.entry.never_with.contains(&b.entry.about.name);
        self.axis == other.axis && (never(self, other) || never(other, self))
    }

    /// `effect@axis`, or the effect's name alone when it acts on both axes.
    pub fn name(&self, axes: &[&str]) -> String {
        match self.entry.acts {
            Acts::BothAxes => self.entry.about.name.into(),
            Acts::OwnAxis => format!("{}@{}", self.entry.about.name, axes[self.axis]),
        }
    }
}

/// What laws are evaluated along: a record, row by row, in SI.
#[derive(Clone, Debug)]
pub struct Course<'a> {
    /// Displacement and velocity of each axis.
    states: Vec<&'a [f64]>,
    /// Time between rows, s.
    period_s: f64,
    /// What effects of the instrument need besides; none where there are no such effects.
    instruments: Option<Instruments<'a>>,
}

#[derive(Clone, Debug)]
struct Instruments<'a> {
    acceleration: Vec<&'a [f64]>,
    /// As the channels read it, before ground springs and dampers take their share.
    force: Vec<Cow<'a, [f64]>>,
    force_rate: Vec<Vec<f64>>,
    /// What the channels read, while something that is predicted stands in its place.
    logged: Option<Vec<Cow<'a, [f64]>>>,
    /// 1 or −1 per axis, as its convention says.
    signs: Vec<f64>,
}

impl<'a> Course<'a> {
    /// A motion of the joint, of whose instruments nothing is known.
    pub fn of_states(states: &[&'a [f64]], period_s: f64) -> Self {
        Self {
            states: states.to_vec(),
            period_s,
            instruments: None,
        }
    }

    /// A record with everything that was measured; `conventions` has one entry per axis.
    pub fn of_motion(motion: &'a Motion, conventions: &[Convention]) -> Self {
        let slices = |series: &'a [Vec<f64>]| series.iter().map(Vec::as_slice).collect();
        let period_s = 1.0 / motion.sample_rate_hz;
        let applied = (0..motion.force.len()).map(|axis| motion.applied_force(axis));
        let force: Vec<Cow<'a, [f64]>> = applied.collect();
        Self {
            states: slices(&motion.states),
            period_s,
            instruments: Some(Instruments {
                acceleration: slices(&motion.acceleration),
                force_rate: force.iter().map(|f| rate(f, period_s)).collect(),
                force,
                logged: None,
                signs: conventions.iter().map(|c| c.sign()).collect(),
            }),
        }
    }

    /// Puts the force that a model predicts at every row, N or N·m, in the place of what the force channels read: the applied force
    /// that `joint`, the force of the joint per axis, and an inertia per axis ask for, `F = s·r + m·a`.
    ///
    /// What an instrument does wrong grows with the true force. The measured one also holds whatever the model lacks, and
    /// would explain that by itself.
    pub fn predict(&mut self, joint: &[Vec<f64>], inertia: &[f64]) {
        let Some(said) = &mut self.instruments else {
            return;
        };
        if said.logged.is_none() {
            said.logged = Some(said.force.clone());
        }
        for (axis, force) in joint.iter().enumerate() {
            let (sign, inertia) = (said.signs[axis], inertia[axis]);
            let rows = force.iter().zip(said.acceleration[axis]);
            let applied: Vec<f64> = rows.map(|(r, a)| sign * r + inertia * a).collect();
            said.force_rate[axis] = rate(&applied, self.period_s);
            said.force[axis] = applied.into();
        }
    }

    /// Puts back what the force channels read.
    pub fn as_logged(&mut self) {
        let Some(said) = &mut self.instruments else {
            return;
        };
        if let Some(logged) = said.logged.take() {
            said.force_rate = logged.iter().map(|f| rate(f, self.period_s)).collect();
            said.force = logged;
        }
    }

    /// What the force channel of an axis reads; nothing where nothing is known of the instruments.
    pub fn applied(&self, axis: usize) -> &[f64] {
        let said = self.instruments.as_ref();
        said.map_or(&[], |said| &said.force[axis])
    }

    /// Displacement of an axis, m or rad.
    pub fn displacement(&self, axis: usize) -> &'a [f64] {
        self.states[2 * axis]
    }

    /// Time between rows, s.
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// Rows.
    pub fn rows(&self) -> usize {
        self.states.first().map_or(0, |series| series.len())
    }

    /// Evaluates a law of an effect on `axis` along the record, in the record's order, from internal states of 0; `phase` is the
    /// record's own, in turns, for an effect that has one; `each` is given the row and the force on the own and the other axis.
    pub fn along<S: Scalar>(
        &self,
        law: Law<S>,
        parameters: &Parameters<S>,
        axis: usize,
        phase: f64,
        lift: impl Fn(f64) -> S,
        mut each: impl FnMut(usize, [S; 2]),
    ) {
        // Cut to one length beforehand, so that no row is checked against it.
        let rows = self.rows();
        let state = |series: usize| self.states.get(series).map(|series| &series[..rows]);
        let (own, other) = (2 * axis, 2 * (1 - axis));
        let (Some(displacements), Some(velocities)) = (state(own), state(own + 1)) else {
            return;
        };
        let others = state(other).zip(state(other + 1));
        let instruments = self
            .instruments
            .as_ref()
            .map(|said| said.beside(axis, rows));
        let mut memory: States<S> = [S::zero(); _];
        let mut before = None;
        for row in 0..rows {
            let displacement = lift(displacements[row]);
            let [other_displacement, other_velocity] =
                others.map_or([S::zero(); 2], |(x, v)| [lift(x[row]), lift(v[row])]);
            let silent = Instrument {
                time: lift(row as f64 * self.period_s),
                phase: lift(phase),
                ..Instrument::silent()
            };
            let at = Kinematics {
                displacement,
                velocity: lift(velocities[row]),
                step: displacement - before.unwrap_or(displacement),
                other_displacement,
                other_velocity,
                period: lift(self.period_s),
                instrument: instruments
                    .as_ref()
                    .map_or(silent, |said| said.at(row, silent, &lift)),
            };
            before = Some(displacement);
            each(row, law(parameters, &at, &mut memory));
        }
    }
}

impl Instruments<'_> {
    /// The channels that matter to an axis.
    fn beside(&self, axis: usize, rows: usize) -> Channels<'_> {
        Channels {
            sign: self.signs[axis],
            acceleration: &self.acceleration[axis][..rows],
            force: &self.force[axis][..rows],
            force_rate: &self.force_rate[axis][..rows],
            other_force: self.force.get(1 - axis).map(|force| &force[..rows]),
        }
    }
}

/// What instruments say beside one axis, all equally long.
struct Channels<'a> {
    sign: f64,
    acceleration: &'a [f64],
    force: &'a [f64],
    force_rate: &'a [f64],
    other_force: Option<&'a [f64]>,
}

impl Channels<'_> {
    /// One row, with the time and phase that are known without them.
    fn at<S: Scalar>(
        &self,
        row: usize,
        silent: Instrument<S>,
        lift: &impl Fn(f64) -> S,
    ) -> Instrument<S> {
        let signed = |series: &[f64]| lift(self.sign * series[row]);
        Instrument {
            acceleration: signed(self.acceleration),
            force: signed(self.force),
            force_rate: signed(self.force_rate),
            other_force: self.other_force.map_or(S::zero(), signed),
            ..silent
        }
    }
}

/// A law's parameters in SI, as the law takes them.
pub fn law_parameters(entry: &Entry, values: &[f64]) -> Parameters<f64> {
    let mut parameters = Parameters::default();
    let listed = entry.parameters().iter().zip(values);
    for (place, (parameter, value)) in parameters.iter_mut().zip(listed) {
        *place = parameter.as_law_takes_it(*value);
    }
    parameters
}

/// The derivative of a force channel, per second.
fn rate(force: &[f64], period_s: f64) -> Vec<f64> {
    let last = force.len().saturating_sub(1);
    let at = |row: usize| force[row.min(last)];
    // Fourth order inside; the ends fall outside the low-pass's support.
    let slope = |row: usize| {
        let near = at(row + 1) - at(row.saturating_sub(1));
        let far = at(row + 2) - at(row.saturating_sub(2));
        (8.0 * near - far) / (12.0 * period_s)
    };
    (0..force.len()).map(slope).collect()
}

/// Adds the forces of effects to those of every axis, N or N·m, row by row along a record.
///
/// `forces` has one series per axis, as long as the record. An effect whose size and phase are the record's own is left out:
/// it is found in what the others leave (`crate::lines`).
pub fn add_forces(terms: &[InSi], course: &Course<'_>, forces: &mut [Vec<f64>]) {
    for term in terms.iter().filter(|term| !term.entry.is_per_record()) {
        let parameters = law_parameters(term.entry, &term.values);
        let axis = usize::from(term.axis);
        course.along(
            term.entry.real,
            &parameters,
            axis,
            0.0,
            |v| v,
            |row, [own, other]| {
                forces[axis][row] += own;
                if let Some(force) = forces.get_mut(1 - axis) {
                    force[row] += other;
                }
            },
        );
    }
}
