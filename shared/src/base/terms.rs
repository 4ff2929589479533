//! The physical effects of a model on the device: their parameters as machine numbers, and their
//! sum along a motion.
//!
//! Quantities are relative to the training range: displacement and velocity to half its width, the
//! force of an axis to the full scale of its output (2³¹ of its force unit), time to the sample
//! period.

#[cfg(feature = "fit")]
pub use super::terms_quantise::EffectValues;

use crate::effect::{
    Acts, Entry, Instrument, Kinematics, MAX_STATES, Parameters, States, Subsystem,
};
use crate::fault::{Checks, Error};
use crate::scalar::q::Q;
use core::mem::swap;
use heapless::Vec;

/// The largest origin of an input, in 2⁻³²: 2²⁸ times half the input's range. Sums and differences
/// of inputs then stay far from 2⁶³.
const MAX_ORIGIN: u64 = 1 << 60;

/// The most effects that a model holds on the device.
pub const MAX_TERMS: usize = 8;

/// One effect with its parameters; what is calibrated, apart from what moves ([`Memory`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Term {
    pub(super) entry: &'static Entry,
    pub(super) axis: u8,
    pub(super) squared: bool,
    /// As [`StoredTerm::follows`], in units of 2⁻³².
    pub(super) follows: u32,
    pub(super) parameters: Parameters<Q>,
}

/// One effect as it is stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StoredTerm {
    /// The effect's number in blobs, [`Effect::TAG`](crate::effect::Effect::TAG).
    pub tag: u8,
    /// The axis that it is bound to, from 0; see [`Term::axis`].
    pub axis: u8,
    /// Whether its force goes with the square of the input.
    pub squared: bool,
    /// What [`Term::follows`] says, one unit of 2⁻³² less; 0 for an effect of the motion alone.
    pub follows: u32,
    /// Its parameters as the law takes them; those that it has not are 0.
    pub parameters: Parameters<Q>,
}

/// The effects of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct Terms {
    pub(super) list: Vec<Term, MAX_TERMS>,
    /// Per input, its center over half its range; see [`Terms::origins`].
    origins: [Q; 4],
    /// The same of followed inputs; see [`Terms::followed_origins`].
    followed_origins: [Q; 2],
    /// Whether an effect follows an input.
    follows: bool,
}

/// What moves: the internal states of every effect, and the joint at the sample before.
#[derive(Clone, Debug)]
pub struct Memory {
    states: [States<Q>; MAX_TERMS],
    /// As the first axis sees it. Kept, so that what no sample changes need not be written anew.
    at: Kinematics<Q>,
    /// Whether there was a sample.
    moved: bool,
    /// The input that an effect follows, behind its lag; `None` before the first sample.
    lagged: [Option<Q>; MAX_TERMS],
    /// The normalised input of each axis, in Q31.
    followed: [i32; 2],
}

impl Memory {
    /// At rest; all of it 0, so that it takes no flash to hold what RAM begins with.
    pub const NEW: Self = {
        let zero = Q::from_raw(0);
        Self {
            states: [[zero; MAX_STATES]; MAX_TERMS],
            at: Kinematics {
                displacement: zero,
                velocity: zero,
                step: zero,
                other_displacement: zero,
                other_velocity: zero,
                period: zero,
                instrument: Instrument::of(zero),
            },
            moved: false,
            lagged: [None; MAX_TERMS],
            followed: [0; 2],
        }
    };
}

/// The force of an effect beside its input, of which it goes a share of the way at every sample.
fn following(place: &mut Option<Q>, force: Q, input: Q, share: Q, squared: bool) -> Q {
    // A lag begins where its input does.
    let before = place.unwrap_or(input);
    let lagged = before.plus(input.minus(before) * share);
    *place = Some(lagged);
    let linear = force * lagged;
    if squared { linear * lagged } else { linear }
}

impl Memory {
    /// What effects of each axis follow from the next sample on: its normalised input, in Q31.
    pub fn follow(&mut self, inputs: [i32; 2]) {
        self.followed = inputs;
    }
}

impl Default for Memory {
    fn default() -> Self {
        Self::NEW
    }
}

impl Term {
    /// Puts an effect together from its stored numbers, and checks that it belongs where it is.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for an axis that the model or the effect has not; [`Error::Effect`]
    /// for a tag that is not known, a number where the effect has no parameter, an input that
    /// an effect on both axes follows, and a square of none.
    pub fn new(stored: &StoredTerm, axes: usize) -> Result<Self, Error> {
        let StoredTerm {
            tag,
            axis,
            follows,
            squared,
            parameters,
        } = *stored;
        let entry = Entry::with_tag(tag).ok_or(Error::Effect {
            tag,
            fault: "is not known to this version",
        })?;
        check_place(entry, axis, axes)?;
        let unused = parameters.iter().skip(usize::from(entry.parameter_count));
        if unused.into_iter().any(|value| *value != Q::default()) {
            return Err(Error::Effect {
                tag,
                fault: "has a number where it has no parameter",
            });
        }
        if squared && follows == 0 {
            return Err(Error::Effect {
                tag,
                fault: "goes with the square of an input and follows none",
            });
        }
        if follows != 0 && entry.acts == Acts::BothAxes {
            return Err(Error::Effect {
                tag,
                fault: "acts on both axes and follows an input",
            });
        }
        Ok(Self {
            entry,
            axis,
            follows,
            squared,
            parameters,
        })
    }

    /// The effect as the table lists it.
    pub fn entry(&self) -> &'static Entry {
        self.entry
    }

    /// The axis that it is bound to; the first for an effect on both.
    pub fn axis(&self) -> usize {
        usize::from(self.axis)
    }

    /// By what share of the way a factor of its force goes to the input of its axis at every
    /// sample, 1 without a lag; `None` for an effect of the motion alone.
    pub fn follows(&self) -> Option<Q> {
        (self.follows != 0).then(|| Q::from_raw(i64::from(self.follows) + 1))
    }

    /// Whether its force goes with the square of the input.
    pub fn squared(&self) -> bool {
        self.squared
    }

    /// Its parameters as the law takes them.
    pub fn parameters(&self) -> &Parameters<Q> {
        &self.parameters
    }
}

impl Terms {
    /// A model without effects.
    pub const NONE: Self = Self {
        list: Vec::new(),
        origins: [Q::from_raw(0); 4],
        followed_origins: [Q::from_raw(0); 2],
        follows: false,
    };

    /// The effects of a model of so many axes, with the origins of its states and of what effects
    /// follow, as they are stored.
    ///
    /// # Errors
    /// As [`Term::new`]; [`Error::OutOfRange`] when there are more than [`MAX_TERMS`], and for an
    /// origin without effects.
    pub fn stored(
        axes: usize,
        terms: impl IntoIterator<Item = StoredTerm>,
        origins: [Q; 4],
        followed_origins: [Q; 2],
    ) -> Result<Self, Error> {
        let mut list = Vec::new();
        let mut checks = Checks::new();
        for stored in terms {
            let term = Term::new(&stored, axes)?;
            let most = MAX_TERMS as i32;
            if list.push(term).is_err() {
                checks.whole("number of effects", most.saturating_add(1), 0, most);
            }
        }
        let used = if list.is_empty() { 0 } else { 2 * axes };
        let mut unused = origins.iter().skip(used);
        let wrong = unused.any(|origin| *origin != Q::default());
        let quantity = "origin of an input that no effect has";
        checks.whole(quantity, i32::from(wrong), 0, 0);
        for origin in origins.iter().chain(&followed_origins) {
            let size = origin.raw().unsigned_abs();
            checks.long("size of the origin of an input", size, 0, MAX_ORIGIN);
        }
        checks.done()?;
        Ok(Self {
            follows: list.iter().any(|term: &Term| term.follows != 0),
            list,
            origins,
            followed_origins,
        })
    }

    /// Center of each input's range over half its width: what is added to a normalised input to
    /// make it relative; 0 without effects.
    pub fn origins(&self) -> [Q; 4] {
        self.origins
    }

    /// The same of what effects of each axis follow; 0 where there is no such effect.
    pub fn followed_origins(&self) -> [Q; 2] {
        self.followed_origins
    }

    /// One entry per effect.
    pub fn list(&self) -> &[Term] {
        &self.list
    }

    /// The sum of all effects on each axis, relative to the full scale of its output, for the
    /// normalised states of one sample in Q31; brings `memory` to that sample.
    #[inline]
    pub fn forces(&self, memory: &mut Memory, u: &[i32; 4]) -> [Q; 2] {
        // Where no effect follows an input, none is asked at every sample.
        if self.follows {
            self.sum_with_inputs(memory, u)
        } else {
            self.sum::<false>(memory, u)
        }
    }

    #[inline(never)]
    fn sum_with_inputs(&self, memory: &mut Memory, u: &[i32; 4]) -> [Q; 2] {
        self.sum::<true>(memory, u)
    }

    #[inline(always)]
    fn sum<const FOLLOWS: bool>(&self, memory: &mut Memory, u: &[i32; 4]) -> [Q; 2] {
        let zero = Q::default();
        let mut forces = [zero, zero];
        if self.list.is_empty() {
            return forces;
        }
        let [a, b, c, d] = self.origins;
        let [x, v, phi, omega] = *u;
        // Nothing saturates: the origins are bounded.
        let (x, v) = (Q::from_q31(x).plus(a), Q::from_q31(v).plus(b));
        let (phi, omega) = (Q::from_q31(phi).plus(c), Q::from_q31(omega).plus(d));
        let Memory {
            states,
            at,
            moved,
            lagged,
            followed,
        } = memory;
        let (x_before, phi_before) = (at.displacement, at.other_displacement);
        let (mut step, mut other_step) = (Q::default(), Q::default());
        if *moved {
            (step, other_step) = (x.minus(x_before), phi.minus(phi_before));
        } else {
            at.period = Q::ONE;
            *moved = true;
        }
        (at.displacement, at.velocity, at.step) = (x, v, step);
        (at.other_displacement, at.other_velocity) = (phi, omega);
        // Turned round for an effect on the second axis and back again: most models have effects on
        // one.
        let mut turned = false;
        for (number, (term, states)) in self.list.iter().zip(states).enumerate() {
            if (term.axis != 0) != turned {
                turned = !turned;
                turn(at, &mut other_step, &mut forces);
            }
            let ([f, g], [mut own, other]) =
                (forces, (term.entry.device)(&term.parameters, at, states));
            if FOLLOWS && let (Some(share), Some(place)) = (term.follows(), lagged.get_mut(number))
            {
                let input = self.input(term.axis, followed);
                own = following(place, own, input, share, term.squared);
            }
            forces = match term.entry.acts {
                Acts::OwnAxis => [f + own, g],
                Acts::BothAxes => [f + own, g + other],
            };
        }
        if turned {
            turn(at, &mut other_step, &mut forces);
        }
        forces
    }
}

impl Terms {
    /// The input of an axis, relative to half its range.
    fn input(&self, axis: u8, followed: &[i32; 2]) -> Q {
        let ([a, b], [u, v]) = (self.followed_origins, *followed);
        let (origin, input) = if axis == 0 { (a, u) } else { (b, v) };
        // Nothing saturates: the origins are bounded.
        Q::from_q31(input).plus(origin)
    }
}

/// The same as the other axis sees it.
fn turn(at: &mut Kinematics<Q>, other_step: &mut Q, forces: &mut [Q; 2]) {
    swap(&mut at.displacement, &mut at.other_displacement);
    swap(&mut at.velocity, &mut at.other_velocity);
    swap(&mut at.step, other_step);
    forces.reverse();
}

/// Refuses an effect that the device does not evaluate, and an axis that the model or the effect
/// has not.
pub(super) fn check_place(entry: &Entry, axis: u8, axes: usize) -> Result<(), Error> {
    let fault = match entry.subsystem {
        Subsystem::Plant => None,
        Subsystem::TimeVaryingPlant => Some(
            "depends on the time since a record began, which a device that never stops does not know",
        ),
        Subsystem::Sensor => Some(
            "corrects an instrument: it belongs to the rig and is no part of the joint's model",
        ),
    };
    if let Some(fault) = fault {
        return Err(Error::Effect {
            tag: entry.tag,
            fault,
        });
    }
    let most = match entry.acts {
        Acts::OwnAxis => axes.saturating_sub(1),
        Acts::BothAxes => 0,
    };
    let mut checks = Checks::new();
    checks.whole("axis of an effect", i32::from(axis), 0, most as i32);
    checks.done()?;
    if entry.acts == Acts::BothAxes && axes != 2 {
        return Err(Error::Effect {
            tag: entry.tag,
            fault: "acts on two axes while the model has one",
        });
    }
    Ok(())
}
