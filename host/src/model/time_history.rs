//! Laws of effects, evaluated along a record.

use super::scalar::HostScalar;
use crate::signal::motion::{Motion, series_named};
use crate::study::Convention;
use jointwatch_shared::base::followed::Follows;
use jointwatch_shared::base::terms::EffectValues;
use jointwatch_shared::effect::{Entry, Instrument, Kinematics, Parameters, States, Subsystem};
use jointwatch_shared::scalar::Scalar;
use std::borrow::Cow;

/// What laws are evaluated along: a record, row by row, in SI.
#[derive(Clone, Debug)]
pub struct TimeHistory<'a> {
    /// Displacement and velocity of each axis.
    states: Vec<&'a [f64]>,
    /// The same before the first row; none where nothing is known of it.
    before: Vec<&'a [f64]>,
    /// Time between rows, s.
    period_s: f64,
    /// Inputs of the study, by name.
    inputs: &'a [(String, Vec<f64>)],
    /// What effects of the instrument need besides; none where there are no such effects.
    instruments: Option<Instruments<'a>>,
}

/// What a force is multiplied by, row by row: 1, or an input.
pub(crate) struct Factor<'a>(Option<Cow<'a, [f64]>>);

impl Factor<'_> {
    pub(crate) fn at(&self, row: usize) -> f64 {
        let series = self.0.as_ref();
        series.map_or(1.0, |series| series.get(row).copied().unwrap_or(0.0))
    }

    /// A series along the record times this.
    pub(crate) fn times<'s>(&self, series: &'s [f64]) -> Cow<'s, [f64]> {
        match self.0 {
            None => series.into(),
            Some(_) => series
                .iter()
                .enumerate()
                .map(|(row, v)| v * self.at(row))
                .collect(),
        }
    }
}

/// A series behind a first-order lag, which begins at rest.
fn lagged(series: &[f64], lag_s: f64, period_s: f64) -> Vec<f64> {
    let keep = (-period_s / lag_s).exp();
    let mut state = series.first().copied().unwrap_or(0.0);
    let step = |value: &f64| {
        state = value + keep * (state - value);
        state
    };
    series.iter().map(step).collect()
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

impl<'a> TimeHistory<'a> {
    /// A motion of the joint, of whose instruments nothing is known.
    pub fn of_states(states: &[&'a [f64]], period_s: f64) -> Self {
        Self {
            states: states.to_vec(),
            before: Vec::new(),
            period_s,
            inputs: &[],
            instruments: None,
        }
    }

    /// The same with inputs.
    pub(crate) fn with_inputs(mut self, inputs: &'a [(String, Vec<f64>)]) -> Self {
        self.inputs = inputs;
        self
    }

    /// The same after what was before the first row.
    pub(crate) fn after(mut self, before: &'a [Vec<f64>]) -> Self {
        self.before = before.iter().map(Vec::as_slice).collect();
        self
    }

    /// A record with everything that was measured; `conventions` has one entry per axis.
    pub fn of_motion(motion: &'a Motion, conventions: &[Convention]) -> Self {
        let slices = |series: &'a [Vec<f64>]| series.iter().map(Vec::as_slice).collect();
        let period_s = 1.0 / motion.sample_rate_hz;
        let applied = (0..motion.force.len()).map(|axis| motion.applied_force(axis));
        let force: Vec<Cow<'a, [f64]>> = applied.collect();
        Self {
            states: slices(&motion.states),
            before: slices(&motion.before),
            period_s,
            inputs: &motion.inputs,
            instruments: Some(Instruments {
                acceleration: slices(&motion.acceleration),
                force_rate: force.iter().map(|f| rate(f, period_s)).collect(),
                force,
                logged: None,
                signs: conventions.iter().map(|c| c.sign()).collect(),
            }),
        }
    }

    /// Puts the force that a model predicts at every row, N or N·m, in the place of what the force
    /// channels read: the applied force that `joint`, the force of the joint per axis, and an
    /// inertia per axis ask for, `F = s·r + m·a`.
    ///
    /// What an instrument does wrong grows with the true force. The measured one also holds
    /// whatever the model lacks, and would explain that by itself.
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

    /// The same before the first row; nothing where nothing is known of it.
    pub(crate) fn displacement_before(&self, axis: usize) -> &'a [f64] {
        self.before.get(2 * axis).copied().unwrap_or(&[])
    }

    /// Velocity of an axis, m/s or rad/s.
    pub fn velocity(&self, axis: usize) -> &'a [f64] {
        self.states[2 * axis + 1]
    }

    /// Every input with its name.
    pub(crate) fn inputs(&self) -> &'a [(String, Vec<f64>)] {
        self.inputs
    }

    /// An input, behind its lag, as a factor of forces; 1 where none is named, 0 where the record
    /// has none of this name.
    pub(crate) fn input(&self, name: Option<&str>) -> Factor<'a> {
        let Some(name) = name else {
            return Factor(None);
        };
        let follows = Follows::parse(name);
        let series = series_named(self.inputs, follows.name).unwrap_or_default();
        let mut series: Cow<'a, [f64]> = if follows.lag_s > 0.0 {
            lagged(series, follows.lag_s, self.period_s).into()
        } else {
            series.into()
        };
        if follows.squared {
            series.to_mut().iter_mut().for_each(|u| *u *= *u);
        }
        Factor(Some(series))
    }

    /// Time between rows, s.
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// Rows of the record.
    pub fn rows(&self) -> usize {
        self.states.first().map_or(0, |series| series.len())
    }

    /// Evaluates the law of an effect on `axis` along the record, in the record's order, from
    /// internal states of 0 before what is known of the motion before it; `phase` is the
    /// record's own, in turns, for an effect that has one; `each` is given the row and the force on
    /// the own and the other axis.
    pub fn along<S: HostScalar>(
        &self,
        entry: &Entry,
        parameters: &Parameters<S>,
        axis: usize,
        phase: f64,
        each: impl FnMut(usize, [S; 2]),
    ) {
        self.along_changing(entry, *parameters, |_, _| (), axis, phase, each);
    }

    /// The same with strengths that `change` from row to row. No state of a law depends on a
    /// strength.
    pub(crate) fn along_changing<S: HostScalar>(
        &self,
        entry: &Entry,
        mut parameters: Parameters<S>,
        mut change: impl FnMut(usize, &mut Parameters<S>),
        axis: usize,
        phase: f64,
        mut each: impl FnMut(usize, [S; 2]),
    ) {
        // Cut to one length beforehand, so that no row is checked against it.
        let rows = self.rows();
        let known = self.before.first().map_or(0, |series| series.len());
        let Some(during) = AxisStates::of(&self.states, axis, rows) else {
            return;
        };
        // No law of the joint looks at them.
        let instruments = self.instruments.as_ref();
        let instruments = instruments.filter(|_| entry.subsystem == Subsystem::Sensor);
        let instruments = instruments.map(|said| said.of_axis(axis, rows));
        let (law, lift) = (S::law_of(entry), S::constant);
        let mut memory: States<S> = [S::zero(); _];
        let mut last = during.displacement.first().copied().unwrap_or(0.0);
        let before = AxisStates::of(&self.before, axis, known);
        if let Some(before) = before.filter(|_| !entry.state_bounds.is_empty()) {
            last = before.displacement.first().copied().unwrap_or(last);
            for row in 0..known {
                let at = before.at(row, last, self.period_s, Instrument::silent());
                law(&parameters, &at, &mut memory);
                last = before.displacement[row];
            }
        }
        for row in 0..rows {
            let silent = Instrument {
                time: lift(row as f64 * self.period_s),
                phase: lift(phase),
                ..Instrument::silent()
            };
            let instrument = instruments
                .as_ref()
                .map_or(silent, |said| said.at(row, silent, &lift));
            let at = during.at(row, last, self.period_s, instrument);
            last = during.displacement[row];
            change(row, &mut parameters);
            each(row, law(&parameters, &at, &mut memory));
        }
    }
}

/// The states of an axis and of the other one, all equally long.
struct AxisStates<'a> {
    displacement: &'a [f64],
    velocity: &'a [f64],
    /// Displacement and velocity of the other axis.
    other: Option<(&'a [f64], &'a [f64])>,
}

impl<'a> AxisStates<'a> {
    /// Those of `axis`, of so many rows; nothing where there are none.
    fn of(states: &[&'a [f64]], axis: usize, rows: usize) -> Option<Self> {
        let state = |series: usize| states.get(series).map(|series| &series[..rows]);
        let (own, other) = (2 * axis, 2 * (1 - axis));
        let (displacement, velocity) = state(own).zip(state(own + 1))?;
        Some(Self {
            displacement,
            velocity,
            other: state(other).zip(state(other + 1)),
        })
    }

    /// What a law sees at a row, `last` the displacement at the one before.
    fn at<S: HostScalar>(
        &self,
        row: usize,
        last: f64,
        period_s: f64,
        instrument: Instrument<S>,
    ) -> Kinematics<S> {
        let lift = S::constant;
        let displacement = lift(self.displacement[row]);
        let [other_displacement, other_velocity] = self
            .other
            .map_or([S::zero(); 2], |(x, v)| [lift(x[row]), lift(v[row])]);
        Kinematics {
            displacement,
            velocity: lift(self.velocity[row]),
            step: displacement - lift(last),
            other_displacement,
            other_velocity,
            period: lift(period_s),
            instrument,
        }
    }
}

impl Instruments<'_> {
    /// The channels that matter to an axis.
    fn of_axis(&self, axis: usize, rows: usize) -> Channels<'_> {
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
/// `forces` has one series per axis, as long as the record. An effect whose size is the record's
/// own is left out: it is found in what the others leave (`crate::model::per_record`).
pub fn add_forces(terms: &[EffectValues], history: &TimeHistory<'_>, forces: &mut [Vec<f64>]) {
    for term in terms.iter().filter(|term| !term.entry.is_per_record()) {
        let parameters = law_parameters(term.entry, &term.values);
        let axis = usize::from(term.axis);
        let factor = history.input(term.input);
        history.along(term.entry, &parameters, axis, 0.0, |row, [own, other]| {
            forces[axis][row] += own * factor.at(row);
            if let Some(force) = forces.get_mut(1 - axis) {
                force[row] += other * factor.at(row);
            }
        });
    }
}
