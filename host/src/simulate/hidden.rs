//! An effect hidden in the simulated rig: in its joint, or in its force channels and the inertia
//! its study states.
//!
//! The law is the library's own ([`jointwatch_shared::effect`]). An effect of the joint acts on the
//! bodies while they move, its memory moved on with every step of the integration; an effect of the
//! instruments leaves the motion alone and is put into the log, as the inverse of what
//! [`crate::model::corrections`] would do about it.

use super::joint::{Contact, Joint, JointLaw};
use super::rig::RigParameters;
use super::truth::{Taken, Truth};
use crate::fit::effects::unknowns::reference;
use crate::model::corrections::Corrections;
use crate::model::effects::AxisEffect;
use crate::model::time_history::{TimeHistory, law_parameters};
use crate::model::{Evaluator, ModelEffect, per_record};
use crate::study::{Convention, Record};
use crate::text::error::{Error, Result};
use jointwatch_shared::base::axis::AxisKind;
use jointwatch_shared::base::terms::EffectValues;
use jointwatch_shared::effect::Subsystem;
use jointwatch_shared::effect::about::{About, Parameter, Role};
use jointwatch_shared::units::References;
use std::f64::consts::{SQRT_2, TAU};

/// Which effect to hide in a simulated joint, and how strongly.
#[derive(Clone, Debug, PartialEq)]
pub struct Hide {
    /// `effect@axis`; the axes are x and phi.
    pub effect: String,
    /// RMS of what it adds to the restoring force over RMS of the restoring force, on its axis
    /// over all training records.
    pub share: f64,
}

/// The effect that was hidden, with its values and its share of the force.
#[derive(Clone, Debug, PartialEq)]
pub struct Hidden {
    /// The effect with its values.
    pub term: ModelEffect,
    /// The share of the RMS restoring force that it has.
    pub share: f64,
    /// The same in numbers.
    pub(super) in_si: EffectValues,
}

/// The joint with what is hidden in it.
#[derive(Clone)]
pub struct HiddenJoint {
    joint: Joint,
    hidden: Option<Evaluator>,
}

/// The share has to be met to this part of it.
const SHARE_MET: f64 = 0.02;
/// How often the strength is put right; the rig moves otherwise every time.
const TRIALS: usize = 10;
/// Largest share that may be asked for: beyond it a joint is another joint.
const MOST: f64 = 0.6;

impl HiddenJoint {
    /// The rig's joint with an effect besides; `period_s` is the length of an integration step.
    pub(crate) fn new(
        rig: &RigParameters,
        axes: usize,
        effect: Option<&EffectValues>,
        period_s: f64,
    ) -> Self {
        let acts = effect.filter(|term| term.entry.subsystem != Subsystem::Sensor);
        Self {
            joint: rig.joint,
            hidden: acts
                .map(|term| Evaluator::of_effects(2 * axes, std::slice::from_ref(term), period_s)),
        }
    }

    /// What the hidden effect exerts at a state, N or N·m per axis.
    pub(super) fn hidden_force(&self, state: [f64; 4]) -> [f64; 2] {
        let force = |evaluator: &Evaluator| evaluator.force_at(&state);
        self.hidden.as_ref().map_or([0.0; 2], force)
    }
}

impl JointLaw for HiddenJoint {
    fn contacts(&self, state: [f64; 4]) -> [Contact; 2] {
        self.joint.contacts(state)
    }

    fn force(&self, state: [f64; 4], contacts: [Contact; 2]) -> [f64; 2] {
        let mut force = self.joint.force_with(state, contacts);
        if self.hidden.is_some() {
            let more = self.hidden_force(state);
            force.iter_mut().zip(more).for_each(|(f, m)| *f += m);
        }
        force
    }

    fn advance(&mut self, state: [f64; 4], step_s: f64) {
        if let Some(hidden) = &mut self.hidden {
            hidden.advance(&state, step_s);
        }
    }
}

/// What the logs of the simulated rig look like to the search for a strength.
pub(super) struct Rig<'a> {
    /// Names of its axes.
    pub(super) axes: &'a [&'a str],
    /// The effects that it has anyway.
    pub(super) base: &'a [String],
    /// Inertias that the study states, per axis.
    pub(super) inertia: &'a [f64],
    pub(super) sample_rate_hz: f64,
    /// Takes the training records with an effect in the joint.
    pub(super) take: &'a dyn Fn(Option<&EffectValues>) -> Result<Vec<Taken>>,
}

impl Rig<'_> {
    /// Finds the strength at which an effect has the share that is asked for.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Usage`]: an effect that is not known, has no such axis, is part
    /// of the rig anyway or cannot be put into a log; a share that is out of range or cannot be
    /// reached.
    pub(super) fn hide(&self, what: &Hide) -> Result<Hidden> {
        if !(what.share > 0.0 && what.share <= MOST) {
            return Err(Error::usage(format!(
                "a hidden share of {} of the RMS force is not above 0 and at or below {MOST}: try 0.1",
                what.share
            )));
        }
        let bound =
            AxisEffect::parse(&what.effect, self.axes).map_err(|e| Error::usage(e.sentence))?;
        let name = bound.name(self.axes);
        if self.base.contains(&name) {
            return Err(Error::usage(format!(
                "{name} is part of the simulated joint anyway: simulate without --hidden and strike it from [base] terms in \
                 study.toml to hide it"
            )));
        }
        let plain = (self.take)(None)?;
        let references = references(&plain, bound.axis);
        let mut term = EffectValues {
            input: None,
            entry: bound.entry,
            axis: bound.axis as u8,
            values: starting_values(&bound, &references),
        };
        let along: f64 = power(plain.iter().map(|t| self.along(&term, &t.truth)));
        scale(
            &bound,
            &mut term,
            what.share / (along / force_power(&plain, bound.axis)).sqrt(),
        );
        for _ in 0..TRIALS {
            let share = self.share(&bound, &term, &plain)?;
            if !(share.is_finite() && share > 0.0) {
                break;
            }
            if (share / what.share - 1.0).abs() < SHARE_MET {
                return Ok(self.found(&bound, term, share));
            }
            // A cautious step: a stronger effect makes the joint move less.
            scale(
                &bound,
                &mut term,
                (what.share / share).powf(0.8).clamp(0.2, 5.0),
            );
        }
        Err(Error::usage(format!(
            "no strength of {name} makes up {} of the RMS force of this rig: try another --share or another effect",
            what.share
        )))
    }

    fn found(&self, bound: &AxisEffect, term: EffectValues, share: f64) -> Hidden {
        let kinds = [AxisKind::Translation, AxisKind::Rotation];
        Hidden {
            term: ModelEffect::new(bound, self.axes, &kinds, &term.values, &[]),
            share,
            in_si: term,
        }
    }

    /// The share that an effect has; `plain` are the records without it.
    fn share(&self, bound: &AxisEffect, term: &EffectValues, plain: &[Taken]) -> Result<f64> {
        let axis = bound.axis;
        if bound.entry.subsystem != Subsystem::Sensor {
            let records = (self.take)(Some(term))?;
            let hidden = power(records.iter().map(|r| r.hidden[axis].clone()));
            return Ok((hidden / force_power(&records, axis)).sqrt());
        }
        let mut added = Vec::new();
        for (index, taken) in plain.iter().enumerate() {
            let record = taken.record(self.axes.len());
            let logged = in_the_log(term, index, &record, self.sample_rate_hz, self.axes.len())?;
            let inertia = stated_inertia(term, axis, self.inertia[axis])? - self.inertia[axis];
            let channels = record.axes[axis].force.iter().zip(&logged.axes[axis].force);
            let motion = channels.zip(&taken.truth.acceleration[axis]);
            // r = m·a − F as this rig has it.
            added.push(motion.map(|((f, g), a)| inertia * a - (g - f)).collect());
        }
        Ok((power(added.into_iter()) / force_power(plain, axis)).sqrt())
    }

    /// What a law says along the true motion, N or N·m.
    fn along(&self, term: &EffectValues, truth: &Truth) -> Vec<f64> {
        let motion = truth.motion(0, self.sample_rate_hz);
        let conventions = vec![Convention::InertiaMinusForce; self.axes.len()];
        let history = TimeHistory::of_motion(&motion, &conventions);
        let parameters = law_parameters(term.entry, &term.values);
        let mut force = vec![0.0; history.rows()];
        let axis = usize::from(term.axis);
        history.along(term.entry, &parameters, axis, 0.0, |row, [own, _]| {
            force[row] = own
        });
        force
    }
}

/// Turns by which the phase of mains hum differs from one record to the next: the golden ratio's
/// fraction, so that no two agree.
const PHASE_PER_RECORD: f64 = 0.618_034;

/// The record at `index` as instruments with this fault would have logged it: exactly what the
/// model's correction undoes.
///
/// # Errors
/// [`crate::text::error::Kind::Usage`] for a fault that is too large, or one that the simulator
/// cannot put into a log.
pub(super) fn in_the_log(
    term: &EffectValues,
    index: usize,
    record: &Record,
    sample_rate_hz: f64,
    axes: usize,
) -> Result<Record> {
    if term.entry.subsystem != Subsystem::Sensor || term.entry.about.name == "inertia_error" {
        return Ok(record.clone());
    }
    if term.entry.is_per_record() {
        let mut logged = record.clone();
        let force = &mut logged.axes[usize::from(term.axis)].force;
        let phase = PHASE_PER_RECORD * index as f64;
        let part = per_record::along(term, phase, force.len(), 1.0 / sample_rate_hz);
        let size = if term.entry.is_line() {
            1.0
        } else {
            SQRT_2 * (TAU * phase).cos()
        };
        force.iter_mut().zip(part).for_each(|(f, p)| *f += size * p);
        return Ok(logged);
    }
    let usage = |e: Error| Error::usage(e.sentence);
    let mut inverse = Corrections::of(std::slice::from_ref(term), axes).map_err(usage)?;
    if inverse.is_none() {
        return Err(cannot_simulate(&term.entry.about));
    }
    let force = &mut inverse.force[usize::from(term.axis)];
    // (1 − e)·(1 − e′) = 1.
    force.excess = -force.excess / (1.0 - force.excess);
    force.delay_s = -force.delay_s;
    force.cross = -force.cross;
    Ok(inverse.record(record, sample_rate_hz))
}

/// What is said of a fault that the simulator cannot put into a log.
fn cannot_simulate(about: &About) -> Error {
    Error::usage(format!(
        "the simulated instruments know no {}: hide an effect of the joint, or inertia_error, force_gain, time_delay, crosstalk, mains_hum, force_zero or force_drift",
        about.name
    ))
}

/// The inertia that a study states of an axis, kg or kg·m².
///
/// # Errors
/// [`crate::text::error::Kind::Usage`] when it would not be positive.
pub(super) fn stated_inertia(term: &EffectValues, axis: usize, true_inertia: f64) -> Result<f64> {
    if term.entry.about.name != "inertia_error" || usize::from(term.axis) != axis {
        return Ok(true_inertia);
    }
    // Δm is the true inertia minus the stated one.
    let stated = true_inertia - term.values[0];
    if stated > 0.0 {
        Ok(stated)
    } else {
        Err(Error::usage(
            "an inertia_error of this share would leave the study a negative inertia: try a smaller --share",
        ))
    }
}

/// Values that fit the rig: of parameters that shape a law, the middle of where a fit begins its
/// search; of those that the force is proportional to, their references.
fn starting_values(bound: &AxisEffect, references: &References) -> Vec<f64> {
    let mut linear = 0;
    let value = |parameter: &Parameter| {
        let share = match parameter.role {
            // The second is twice the first, so that a law with two of a kind does not collapse
            // into a simpler one (static and sliding friction); a third only rounds it
            // off.
            Role::Linear { .. } | Role::SizePerRecord { .. } => {
                linear += 1;
                [1.0, 2.0, 0.05][(linear - 1).min(2)]
            }
            // Hum has the frequency of a mains, and none between two of them.
            Role::Shape(shape) if bound.entry.is_line() => shape.starts[0],
            Role::Shape(shape) => {
                let middle = (shape.starts.len() - 1) / 2;
                let next = (middle + 1).min(shape.starts.len() - 1);
                (shape.starts[middle] * shape.starts[next]).sqrt()
            }
        };
        share * reference(bound, parameter, references)
    };
    bound.entry.parameters().iter().map(value).collect()
}

/// Multiplies the force of an effect.
fn scale(bound: &AxisEffect, term: &mut EffectValues, factor: f64) {
    for (parameter, value) in bound.entry.parameters().iter().zip(&mut term.values) {
        if parameter.is_linear() || parameter.is_per_record() {
            *value *= factor;
        }
    }
}

/// RMS force and half the ranges of the motion, as fits see them, `[own, other]` for the axes as
/// they stand; an axis that is not there counts 1.
fn references(records: &[Taken], own: usize) -> References {
    let half_range = |input: usize| {
        let seen = || {
            records
                .iter()
                .filter_map(move |r| r.truth.states.get(input))
        };
        let ends = seen().flatten().fold((0.0_f64, 0.0_f64), |(low, high), v| {
            (low.min(*v), high.max(*v))
        });
        if ends.1 > ends.0 {
            0.5 * (ends.1 - ends.0)
        } else {
            1.0
        }
    };
    let force = |axis: usize| {
        let there = axis == own || records.iter().all(|r| r.truth.restoring_force.len() > axis);
        if there {
            force_power(records, axis).sqrt()
        } else {
            1.0
        }
    };
    References {
        force: [force(0), force(1)],
        displacement: [half_range(0), half_range(2)],
        velocity: [half_range(1), half_range(3)],
        time: 1.0,
    }
}

/// Mean square of the restoring force over all records.
fn force_power(records: &[Taken], axis: usize) -> f64 {
    power(
        records
            .iter()
            .map(|r| r.truth.restoring_force[axis].clone()),
    )
}

/// Mean square over all rows of several series.
fn power(series: impl Iterator<Item = Vec<f64>>) -> f64 {
    let (sum, rows) = series.fold((0.0, 0), |(sum, rows), series| {
        let squares = series.iter().map(|v| v * v);
        (sum + squares.sum::<f64>(), rows + series.len())
    });
    sum / rows.max(1) as f64
}
