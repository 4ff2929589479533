//! The physical effects of a model on the device: their parameters as machine numbers, and their sum along a motion.
//!
//! Quantities are relative to the training range: displacement and velocity to half its width, the force of an axis to
//! the full scale of its output (2³¹ of its force unit), time to the sample period.

#[cfg(feature = "fit")]
use super::{Header, Output};
use crate::effect::{Acts, Entry, Instrument, Kinematics, MAX_STATES, Parameters, Seat, States};
#[cfg(feature = "fit")]
use crate::effect::{Bound, Fading};
use crate::fault::{Checks, Error};
use crate::scalar::q::Q;
use core::mem::swap;
use heapless::Vec;

/// The largest origin of an input, in 2⁻³²: 2²⁸ times half the input's range. Sums and differences of inputs then stay far from 2⁶³.
const MAX_ORIGIN: u64 = 1 << 60;

/// The most effects that a model holds on the device.
pub const MAX_TERMS: usize = 8;

/// One effect with its parameters; what is calibrated, apart from what moves ([`Memory`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Term {
    entry: &'static Entry,
    axis: u8,
    parameters: Parameters<Q>,
}

/// The effects of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct Terms {
    list: Vec<Term, MAX_TERMS>,
    /// See [`Terms::origins`].
    origins: [Q; 4],
}

/// What moves: the internal states of every effect, and the joint at the sample before.
#[derive(Clone, Debug)]
pub struct Memory {
    states: [States<Q>; MAX_TERMS],
    /// As the first axis sees it. Kept, so that what no sample changes need not be written anew.
    at: Kinematics<Q>,
    /// Whether there was a sample.
    moved: bool,
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
        }
    };
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
    /// [`Error::OutOfRange`] for an axis that the model or the effect has not; [`Error::Effect`] for a tag that is not
    /// known or a number where the effect has no parameter.
    pub fn new(tag: u8, axis: u8, parameters: Parameters<Q>, axes: usize) -> Result<Self, Error> {
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
        Ok(Self {
            entry,
            axis,
            parameters,
        })
    }

    /// The effect.
    pub fn entry(&self) -> &'static Entry {
        self.entry
    }

    /// The axis that it is bound to; the first for an effect on both.
    pub fn axis(&self) -> usize {
        usize::from(self.axis)
    }

    /// Its parameters as the law takes them.
    pub fn parameters(&self) -> &Parameters<Q> {
        &self.parameters
    }
}

impl Terms {
    /// No effects.
    pub const NONE: Self = Self {
        list: Vec::new(),
        origins: [Q::from_raw(0); 4],
    };

    /// The effects of a model of so many axes, with the origins of its inputs, as they are stored.
    ///
    /// # Errors
    /// As [`Term::new`]; [`Error::OutOfRange`] when there are more than [`MAX_TERMS`], and for an origin without effects.
    pub fn stored(
        axes: usize,
        terms: impl IntoIterator<Item = (u8, u8, Parameters<Q>)>,
        origins: [Q; 4],
    ) -> Result<Self, Error> {
        let mut list = Vec::new();
        let mut checks = Checks::new();
        for (tag, axis, parameters) in terms {
            let term = Term::new(tag, axis, parameters, axes)?;
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
        for origin in origins {
            let size = origin.raw().unsigned_abs();
            checks.long("size of the origin of an input", size, 0, MAX_ORIGIN);
        }
        checks.done()?;
        Ok(Self { list, origins })
    }

    /// Center of each input's range over half its width: what is added to a normalised input to make it relative; 0 without effects.
    pub fn origins(&self) -> [Q; 4] {
        self.origins
    }

    /// One entry per effect.
    pub fn list(&self) -> &[Term] {
        &self.list
    }

    /// The sum of all effects on each axis, relative to the full scale of its output, for the normalised inputs of one
    /// sample in Q31; brings `memory` to that sample.
    #[inline]
    pub fn forces(&self, memory: &mut Memory, u: &[i32; 4]) -> [Q; 2] {
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
        let Memory { states, at, moved } = memory;
        let (x_before, phi_before) = (at.displacement, at.other_displacement);
        let (mut step, mut other_step) = (Q::default(), Q::default());
        if *moved {
            (step, other_step) = (x.minus(x_before), phi.minus(phi_before));
        }
        *moved = true;
        (at.displacement, at.velocity, at.step) = (x, v, step);
        (at.other_displacement, at.other_velocity) = (phi, omega);
        at.period = Q::ONE;
        // Turned round for an effect on the second axis and back again: most models have effects on one.
        let mut turned = false;
        for (term, states) in self.list.iter().zip(states) {
            if (term.axis != 0) != turned {
                turned = !turned;
                turn(at, &mut other_step, &mut forces);
            }
            let ([f, g], [own, other]) =
                (forces, (term.entry.device)(&term.parameters, at, states));
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

/// The same as the other axis sees it.
fn turn(at: &mut Kinematics<Q>, other_step: &mut Q, forces: &mut [Q; 2]) {
    swap(&mut at.displacement, &mut at.other_displacement);
    swap(&mut at.velocity, &mut at.other_velocity);
    swap(&mut at.step, other_step);
    forces.reverse();
}

/// Refuses an effect that the device does not evaluate, and an axis that the model or the effect has not.
fn check_place(entry: &Entry, axis: u8, axes: usize) -> Result<(), Error> {
    let fault = match entry.seat {
        Seat::Joint => None,
        Seat::JointOverTime => Some(
            "depends on the time since a record began, which a device that never stops does not know",
        ),
        Seat::Instrument => Some(
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

/// Bringing effects from SI to machine numbers, which only the host does.
#[cfg(feature = "fit")]
mod quantise {
    use super::*;
    use crate::scalar::interval::Interval;
    use crate::scalar::q::UNIT;
    use crate::units::References;
    use std::vec::Vec;

    /// An effect as the host knows it.
    #[derive(Clone, Debug, PartialEq)]
    pub struct InSi {
        /// The effect.
        pub entry: &'static Entry,
        /// The axis that it is bound to, from 0.
        pub axis: u8,
        /// Its parameters in SI, in the order in which the effect lists them.
        pub values: Vec<f64>,
    }

    impl InSi {
        /// The parameters relative to `references`, as the law takes them.
        fn relative(&self, references: &References) -> Parameters<f64> {
            let mut relative = Parameters::default();
            let listed = self.entry.parameters().iter().zip(&self.values);
            for (place, (parameter, value)) in relative.iter_mut().zip(listed) {
                let scale = parameter.dimension_in_law().scale(references);
                *place = parameter.as_law_takes_it(*value) / scale;
            }
            relative
        }

        /// Bounds of the forces on the own and the other axis over all motions inside the training range.
        fn bounds(&self, header: &Header, references: &References) -> [Interval; 2] {
            let input = |range: &crate::base::axis::InputRange, scale: f64| {
                // A Q31 input is off by half a unit, at its upper edge by a whole one; the origin by half a Q unit.
                let scale = range.half_range / scale;
                Interval::range(
                    scale * (range.center / range.half_range - 1.0),
                    scale * (range.center / range.half_range + 1.0),
                    scale * 3.0 * UNIT,
                )
            };
            let zero = Interval::range(0.0, 0.0, 0.0);
            let axis = |axis: usize, at: usize| {
                header.axes.get(axis).map_or([zero; 2], |axis| {
                    [
                        input(&axis.displacement, references.displacement[at]),
                        input(&axis.velocity, references.velocity[at]),
                    ]
                })
            };
            let own = usize::from(self.axis);
            let [displacement, velocity] = axis(own, 0);
            let [other_displacement, other_velocity] = axis(1 - own, 1);
            let at = Kinematics {
                displacement,
                velocity,
                step: displacement + (-displacement),
                other_displacement,
                other_velocity,
                period: Interval::stored(1.0 / (header.sample_rate_hz * references.time)),
                instrument: Instrument::silent(),
            };
            let parameters = self.relative(references).map(Interval::stored);
            let law = self.entry.interval;
            let mut states = self.states(0.0, header, references);
            let mut forces = law(&parameters, &at, &mut states);
            if self.entry.state_bounds.is_empty() {
                return forces;
            }
            // The errors are those of a joint at rest, whose states hold what has gathered so far: what a moving sample adds
            // besides it also takes back.
            let rest = Kinematics {
                step: Interval::range(0.0, 0.0, at.step.error),
                ..at
            };
            let after = |error: f64| {
                let mut states = self.states(error, header, references);
                let forces = law(&parameters, &rest, &mut states);
                let errors = states.map(|state| state.error);
                (forces, errors.into_iter().fold(0.0, f64::max))
            };
            let added = after(0.0).1;
            let gathered = match self.entry.fading {
                Fading::Within(times) => f64::from(times) * added,
                Fading::WithTime => {
                    let kept = after(added).1 / added - 1.0;
                    // A share that is not below 1 leaves the error without a bound, and the effect is refused.
                    if kept < 1.0 {
                        added / (1.0 - kept)
                    } else {
                        f64::INFINITY
                    }
                }
            };
            for (force, at_rest) in forces.iter_mut().zip(after(gathered).0) {
                force.error = at_rest.error;
            }
            forces
        }

        /// The internal states anywhere within their bounds, each known to the device within `error`.
        fn states(&self, error: f64, header: &Header, references: &References) -> States<Interval> {
            let mut states = [Interval::range(0.0, 0.0, 0.0); MAX_STATES];
            let axis = header.axes.get(usize::from(self.axis));
            let [half, center] = axis.map_or([1.0, 0.0], |axis| {
                [axis.displacement.half_range, axis.displacement.center]
            });
            for (state, bound) in states.iter_mut().zip(self.entry.state_bounds) {
                let most = match *bound {
                    Bound::Number(most) => f64::from(most),
                    Bound::Displacement(times) => {
                        f64::from(times) * half / references.displacement[0]
                    }
                    Bound::FromZero => (center.abs() + half) / references.displacement[0],
                };
                *state = Interval::range(-most, most, error);
            }
            states
        }
    }

    fn references(header: &Header, full_scale: [f64; 2], own: usize) -> References {
        let of = |pick: fn(&crate::base::axis::Axis) -> f64| {
            let mut both = [1.0; 2];
            for (place, axis) in both.iter_mut().zip(&header.axes) {
                *place = pick(axis);
            }
            both
        };
        let references = References {
            force: full_scale,
            displacement: of(|axis| axis.displacement.half_range),
            velocity: of(|axis| axis.velocity.half_range),
            time: 1.0 / header.sample_rate_hz,
        };
        if own == 0 {
            references
        } else {
            references.swapped()
        }
    }

    /// Center of each input's range over half its width.
    fn origins(header: &Header) -> [Q; 4] {
        let mut origins = [Q::default(); 4];
        for (pair, axis) in origins.as_chunks_mut::<2>().0.iter_mut().zip(&header.axes) {
            let relative = |range: &crate::base::axis::InputRange| {
                Q::from_f64(range.center / range.half_range)
            };
            *pair = [relative(&axis.displacement), relative(&axis.velocity)];
        }
        origins
    }

    impl Terms {
        /// The largest force of the effects on each axis over all motions inside the training range, N or N·m.
        pub fn largest_forces(header: &Header, terms: &[InSi]) -> [f64; 2] {
            let mut sums = [0.0; 2];
            for term in terms {
                let own = usize::from(term.axis);
                let [mine, others] = term.bounds(header, &references(header, [1.0; 2], own));
                sums[own] += mine.magnitude();
                sums[1 - own] += others.magnitude();
            }
            sums
        }

        /// Brings effects to machine numbers; also gives the bound of |device − f64| per axis in N or N·m, for effects
        /// with memory with what their states gather over any number of samples ([`Fading`]).
        ///
        /// # Errors
        /// As [`Terms::stored`]; [`Error::Effect`] when a number on the way could leave the device's range.
        pub fn quantise(
            header: &Header,
            force_per_lsb: [f64; 2],
            terms: &[InSi],
        ) -> Result<(Self, [f64; 2]), Error> {
            let full_scale = force_per_lsb.map(|lsb| lsb * FULL_SCALE);
            let mut errors = [0.0; 2];
            let mut stored = Vec::new();
            for term in terms {
                check_place(term.entry, term.axis, header.axes.len())?;
                if term.entry.needs_two_axes() && header.axes.len() != 2 {
                    return Err(Error::Effect {
                        tag: term.entry.tag,
                        fault: "needs two axes while the model has one",
                    });
                }
                let own = usize::from(term.axis);
                let references = references(header, full_scale, own);
                let forces = term.bounds(header, &references);
                let fullest = forces[0].fullest.max(forces[1].fullest);
                if fullest.is_nan() || fullest >= 1.0 {
                    return Err(Error::Effect {
                        tag: term.entry.tag,
                        fault: "has a parameter that is too large or too small for the device beside the training range",
                    });
                }
                errors[own] += forces[0].error * full_scale[own];
                errors[1 - own] += forces[1].error * full_scale[1 - own];
                let parameters = term.relative(&references).map(Q::from_f64);
                stored.push((term.entry.tag, term.axis, parameters));
            }
            // The sum is rounded to the force unit once.
            let errors = [0, 1].map(|axis| errors[axis] + 0.5 * force_per_lsb[axis]);
            let origins = if stored.is_empty() {
                [Q::default(); 4]
            } else {
                origins(header)
            };
            Ok((Self::stored(header.axes.len(), stored, origins)?, errors))
        }

        /// The effects in SI, from what the device holds.
        pub fn in_si(&self, header: &Header, outputs: &[Output]) -> Vec<InSi> {
            let mut full_scale = [1.0; 2];
            for (place, output) in full_scale.iter_mut().zip(outputs) {
                *place = output.force_per_lsb * FULL_SCALE;
            }
            let terms = self.list.iter().map(|term| {
                let references = references(header, full_scale, term.axis());
                let listed = term.entry.parameters().iter().zip(&term.parameters);
                let values = listed.map(|(parameter, value)| {
                    let scale = parameter.dimension_in_law().scale(&references);
                    parameter.as_law_takes_it(value.to_f64() * scale)
                });
                InSi {
                    entry: term.entry,
                    axis: term.axis,
                    values: values.collect(),
                }
            });
            terms.collect()
        }
    }

    /// Force units in the full scale of an output.
    pub(super) const FULL_SCALE: f64 = (1_u64 << 31) as f64;
}

#[cfg(feature = "fit")]
pub use quantise::InSi;
