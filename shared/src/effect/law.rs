//! What a physical effect is: what it sees of the joint, what it tells of itself, and how the table
//! lists it.

use super::about::About;
#[cfg(feature = "fit")]
use super::about::Parameter;
use crate::scalar::Scalar;
use crate::scalar::q::Q;
#[cfg(feature = "fit")]
use crate::scalar::{dual::Dual, interval::Interval};

/// The most parameters that an effect may have.
pub const MAX_PARAMETERS: usize = 6;
/// Quantities by which [`Entry::gradient`] differentiates: few laws have more shapes to find.
#[cfg(feature = "fit")]
pub const SLOPES: usize = 3;
/// The most internal states that an effect may have.
pub const MAX_STATES: usize = 5;

/// What an effect sees of the joint at one sample.
///
/// On the host everything is in SI; on the device each quantity is relative to its reference
/// ([`crate::units::References`]), and time to the sample period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kinematics<S> {
    /// Relative displacement of the axis that the effect is bound to.
    pub displacement: S,
    /// Relative velocity of that axis.
    pub velocity: S,
    /// What the displacement has changed by since the sample before; 0 at the first one.
    pub step: S,
    /// Relative displacement of the other axis; 0 where there is none.
    pub other_displacement: S,
    /// Relative velocity of the other axis; 0 where there is none.
    pub other_velocity: S,
    /// Time from one sample to the next.
    pub period: S,
    /// What the instruments say besides: for effects of the instrument, which only the host
    /// evaluates.
    pub instrument: Instrument<S>,
}

/// What the instruments of a rig say about one sample besides the joint's motion, signed as it
/// enters the restoring force of the axis that the effect is bound to (s·(F − m·a), with s = 1 or
/// −1 as the study's convention says). All 0 on the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instrument<S> {
    /// Time since the record began.
    pub time: S,
    /// s·a, the acceleration of the body that carries the inertia.
    pub acceleration: S,
    /// s·F, the applied force.
    pub force: S,
    /// s·dF/dt, the rate of change of the applied force.
    pub force_rate: S,
    /// s·F of the other axis.
    pub other_force: S,
    /// Where in its turn, from 0 to 1, what repeats with time alone was when the record began:
    /// nobody knows it beforehand, so it is found in every record anew.
    pub phase: S,
}

impl<S: Scalar> Kinematics<S> {
    /// What the displacement has changed by since the sample before, in units of the length whose
    /// reciprocal is `per_length`.
    ///
    /// Its roundings do not add up along a path ([`Scalar::change`]).
    pub fn travel(&self, per_length: S) -> S {
        self.displacement.change(self.step, per_length)
    }

    /// The same as a short number, held between −`limit` and `limit`.
    pub fn short_travel(&self, per_length: S, limit: S::Short) -> S::Short {
        self.displacement.short_change(self.step, per_length, limit)
    }
}

impl<S: Scalar> Instrument<S> {
    /// Instruments that say nothing.
    pub fn silent() -> Self {
        Self::of(S::zero())
    }

    /// Instruments that say nothing, from a zero that is known beforehand.
    pub(crate) const fn of(zero: S) -> Self {
        Self {
            time: zero,
            acceleration: zero,
            force: zero,
            force_rate: zero,
            other_force: zero,
            phase: zero,
        }
    }
}

/// Where an effect belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subsystem {
    /// To the joint: it is part of its model, on the host and on the device.
    Plant,
    /// To the joint, as it changes while a record runs: it explains data on the host and is refused
    /// at export, because a device that never stops does not know when a record began.
    TimeVaryingPlant,
    /// To the instruments: it corrects a channel of the study, and reaches the device in the rig
    /// block.
    Sensor,
}

/// Which forces an effect contributes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Acts {
    /// That of the axis it is bound to: `coulomb@x`.
    OwnAxis,
    /// Those of both axes of the joint: `clearance_coupling`.
    BothAxes,
}

/// The largest magnitude of an internal state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StateBound {
    /// This number, whatever the input; the state has no unit.
    Number(i32),
    /// This many times half the range of the displacement; the state is a displacement.
    Displacement(i32),
    /// The largest magnitude of the displacement in the training range; the state is a
    /// displacement.
    FromZero,
}

/// How the device's error of an internal state fades, so that a bound holds for any length of run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorPropagation {
    /// It never exceeds this many times what a sample at rest may add: proven for 1, measured for
    /// more (docs/explanation/numerics.md).
    Within(i32),
    /// Every sample keeps a share of it below 1, whatever the motion; the interval law says which.
    WithTime,
}

/// Numbers of an effect's parameters, in the order in which it lists them; those it has not are 0.
pub type Parameters<S> = [S; MAX_PARAMETERS];
/// An effect's internal states; those it has not are 0.
pub type States<S> = [S; MAX_STATES];
/// A law for one kind of number: force on the own axis and on the other one.
pub type Law<S> = fn(&Parameters<S>, &Kinematics<S>, &mut States<S>) -> [S; 2];

/// A physical effect: a force law with named parameters.
pub trait Effect {
    /// Its number in blobs: never changed, never used again.
    const TAG: u8;
    /// Which forces it contributes to.
    const ACTS: Acts = Acts::OwnAxis;
    /// Whether it belongs to the joint or to an instrument.
    const SUBSYSTEM: Subsystem = Subsystem::Plant;
    /// Effects that a model cannot have on the same axis beside this one, because only their sum
    /// shows.
    const NEVER_WITH: &'static [&'static str] = &[];
    /// Effects that are this one with special values of its strengths: beside it on one axis they
    /// are one too many, and adding it to a model takes them out.
    const REPLACES: &'static [&'static str] = &[];
    /// Effects that measurements cannot tell from this one in general: naming one of them for it is
    /// not wrong.
    const LOOKS_LIKE: &'static [&'static str] = &[];
    /// Pairs of parameters, by their places, of which the first is never less than the second in
    /// nature, and no more than three times it.
    const NEVER_LESS: &'static [(usize, usize)] = &[];
    /// Strengths, by their places, that may be nothing as long as one of them is not: a contact on
    /// one side is a contact.
    const ONE_IS_ENOUGH: &'static [usize] = &[];
    /// Coefficients of a polynomial in the displacement, the constant first, that makes a strength
    /// which is below 0 nowhere.
    const STRENGTH_BY_DISPLACEMENT: &'static [usize] = &[];
    /// A length, by its place, and the part of the largest displacement by which a motion meets it:
    /// where it is met later, an effect of the ends of the motion says the same.
    const MET_BY: Option<(usize, f64)> = None;
    /// Stops that are met anywhere in the travel: the places of the upper and the lower one's
    /// distance, each counted from the far end, and of that end. Their strengths are those of
    /// [`Effect::ONE_IS_ENOUGH`], in this order.
    const STOPS: Option<[usize; 3]> = None;
    /// Parameters, by their places, at whose largest value the law has become another one.
    const NOT_AT_MOST: &'static [usize] = &[];
    /// Parameters, by their places, whose searched values are in SI and not relative to the motion.
    const IN_SI: &'static [usize] = &[];
    /// Largest magnitude of each internal state; empty for a law without memory.
    const STATE_BOUNDS: &'static [StateBound] = &[];
    /// How the device's error of the internal states stays bounded.
    const ERROR_PROPAGATION: ErrorPropagation = ErrorPropagation::Within(1);
    /// What it is called, what it means, what it needs.
    const ABOUT: About;

    /// The force at one sample, after the internal states have been brought to it.
    ///
    /// Linear in every parameter that is declared linear, so that setting one of them to 1 and the
    /// others to 0 gives its share.
    fn law<S: Scalar>(
        parameters: &Parameters<S>,
        at: &Kinematics<S>,
        states: &mut States<S>,
    ) -> [S; 2];
}

/// An effect as the table lists it.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Its number in blobs: [`Effect::TAG`].
    pub tag: u8,
    /// Which forces it contributes to: [`Effect::ACTS`].
    pub acts: Acts,
    /// Whether it belongs to the joint or to an instrument: [`Effect::SUBSYSTEM`].
    pub subsystem: Subsystem,
    /// How many parameters it has.
    pub parameter_count: u8,
    /// Largest magnitude of each internal state: [`Effect::STATE_BOUNDS`].
    pub state_bounds: &'static [StateBound],
    /// How errors of its states stay bounded: [`Effect::ERROR_PROPAGATION`].
    pub error_propagation: ErrorPropagation,
    /// The law on the device; no force for an effect that does not belong to the joint, which no
    /// model on a device can have.
    pub device: Law<Q>,
    /// The law that predicts.
    #[cfg(feature = "fit")]
    pub real: Law<f64>,
    /// The law that differentiates by one quantity.
    #[cfg(feature = "fit")]
    pub dual: Law<Dual>,
    /// The law that differentiates by several at once.
    #[cfg(feature = "fit")]
    pub gradient: Law<Dual<SLOPES>>,
    /// The law that bounds.
    #[cfg(feature = "fit")]
    pub interval: Law<Interval>,
    /// Effects that cannot be beside it on an axis: [`Effect::NEVER_WITH`].
    #[cfg(feature = "fit")]
    pub never_with: &'static [&'static str],
    /// Effects that are special cases of it: [`Effect::REPLACES`].
    #[cfg(feature = "fit")]
    pub replaces: &'static [&'static str],
    /// Effects that measurements cannot tell from it: [`Effect::LOOKS_LIKE`].
    #[cfg(feature = "fit")]
    pub looks_like: &'static [&'static str],
    /// Pairs of parameters, the first never less than the second: [`Effect::NEVER_LESS`].
    pub never_less: &'static [(usize, usize)],
    /// Strengths of which one is enough: [`Effect::ONE_IS_ENOUGH`].
    pub one_is_enough: &'static [usize],
    /// Coefficients of a strength in the displacement: [`Effect::STRENGTH_BY_DISPLACEMENT`].
    #[cfg(feature = "fit")]
    pub strength_by_displacement: &'static [usize],
    /// A length, and where a motion meets it: [`Effect::MET_BY`].
    #[cfg(feature = "fit")]
    pub met_by: Option<(usize, f64)>,
    /// Stops, and what they are counted from: [`Effect::STOPS`].
    #[cfg(feature = "fit")]
    pub stops: Option<[usize; 3]>,
    /// Parameters at whose largest value it is another law: [`Effect::NOT_AT_MOST`].
    pub not_at_most: &'static [usize],
    /// Parameters that are searched for in SI: [`Effect::IN_SI`].
    #[cfg(feature = "fit")]
    pub in_si: &'static [usize],
    /// Its name, its meaning and its parameters: [`Effect::ABOUT`].
    #[cfg(feature = "fit")]
    pub about: About,
}

/// The law that the device evaluates: of effects that no model on it can have there is none.
const fn device_law<E: Effect>() -> Law<Q> {
    match E::SUBSYSTEM {
        Subsystem::Plant => E::law::<Q>,
        Subsystem::TimeVaryingPlant | Subsystem::Sensor => |_, _, _| [Q::from_raw(0); 2],
    }
}

impl PartialEq for Entry {
    fn eq(&self, other: &Self) -> bool {
        self.tag == other.tag
    }
}

impl Entry {
    /// The effect as the table lists it.
    pub(super) const fn of<E: Effect>() -> Self {
        Self {
            tag: E::TAG,
            acts: E::ACTS,
            subsystem: E::SUBSYSTEM,
            parameter_count: E::ABOUT.parameters.len() as u8,
            state_bounds: E::STATE_BOUNDS,
            error_propagation: E::ERROR_PROPAGATION,
            device: device_law::<E>(),
            #[cfg(feature = "fit")]
            real: E::law::<f64>,
            #[cfg(feature = "fit")]
            dual: E::law::<Dual>,
            #[cfg(feature = "fit")]
            gradient: E::law::<Dual<SLOPES>>,
            #[cfg(feature = "fit")]
            interval: E::law::<Interval>,
            #[cfg(feature = "fit")]
            never_with: E::NEVER_WITH,
            #[cfg(feature = "fit")]
            replaces: E::REPLACES,
            #[cfg(feature = "fit")]
            looks_like: E::LOOKS_LIKE,
            never_less: E::NEVER_LESS,
            one_is_enough: E::ONE_IS_ENOUGH,
            #[cfg(feature = "fit")]
            strength_by_displacement: E::STRENGTH_BY_DISPLACEMENT,
            #[cfg(feature = "fit")]
            met_by: E::MET_BY,
            #[cfg(feature = "fit")]
            stops: E::STOPS,
            not_at_most: E::NOT_AT_MOST,
            #[cfg(feature = "fit")]
            in_si: E::IN_SI,
            #[cfg(feature = "fit")]
            about: E::ABOUT,
        }
    }

    /// Whether it needs a joint of two axes: it acts on both, or its parameters are measured
    /// against the other axis's.
    #[cfg(feature = "fit")]
    pub fn needs_two_axes(&self) -> bool {
        let crosses = |parameter: &Parameter| parameter.dimension.has_other_axis();
        self.acts == Acts::BothAxes || self.about.parameters.iter().any(crosses)
    }

    /// Whether its size is another one in every record.
    #[cfg(feature = "fit")]
    pub fn is_per_record(&self) -> bool {
        self.phases_per_record() > 0
    }

    /// Phases at which it is evaluated in each record to find its size there,
    /// [`Parameter::phases`]; 0 when no size is a record's own.
    #[cfg(feature = "fit")]
    pub fn phases_per_record(&self) -> usize {
        let phases = self.about.parameters.iter().map(Parameter::phases);
        phases.max().unwrap_or(0)
    }

    /// Whether it is a zero, another one in every record, that stands or drifts.
    #[cfg(feature = "fit")]
    pub fn is_zero_per_record(&self) -> bool {
        self.phases_per_record() == 1
    }

    /// Whether it is a line of the spectrum, with another size and phase in every record.
    #[cfg(feature = "fit")]
    pub fn is_line(&self) -> bool {
        self.phases_per_record() == 2
    }

    /// The place of the length after which its force repeats, where it is a wave over the
    /// displacement.
    #[cfg(feature = "fit")]
    pub fn pitch(&self) -> Option<usize> {
        self.parameters().iter().position(|p| p.name == "pitch")
    }

    /// Whether the searched values of this parameter of its are in SI.
    #[cfg(feature = "fit")]
    pub fn is_in_si(&self, parameter: &Parameter) -> bool {
        let mut places = self.in_si.iter();
        places.any(|&place| self.about.parameters[place].name == parameter.name)
    }

    /// Its parameters, in the order in which the law takes them.
    #[cfg(feature = "fit")]
    pub fn parameters(&self) -> &'static [Parameter] {
        self.about.parameters
    }
}
