//! Bringing effects from SI to machine numbers, which only the host does.

use super::axis::{Axis, InputRange};
use super::followed::{Follows, kept, lag_s, share};
use super::header::{Header, Output};
use super::terms::{StoredTerm, Terms, check_place};
use crate::effect::{
    Entry, ErrorPropagation, Instrument, Kinematics, MAX_STATES, Parameters, StateBound, States,
};
use crate::fault::Error;
use crate::scalar::interval::Interval;
use crate::scalar::q::{Q, UNIT};
use crate::units::References;
use std::vec::Vec;

/// Force units in the full scale of an output.
pub(super) const FULL_SCALE: f64 = (1_u64 << 31) as f64;

/// An effect as the host knows it.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectValues {
    /// The effect as the table lists it.
    pub entry: &'static Entry,
    /// The axis that it is bound to, from 0.
    pub axis: u8,
    /// The input that its force is proportional to, with its power and lag ([`Follows`]); none for
    /// an effect of the motion alone.
    pub input: Option<&'static str>,
    /// Its parameters in SI, in the order in which the effect lists them.
    pub values: Vec<f64>,
}

impl EffectValues {
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

    /// The range of the input that it follows; none for an effect of the motion alone.
    ///
    /// # Errors
    /// [`Error::Effect`] when its axis has no such input.
    fn followed<'a>(&self, header: &'a Header) -> Result<Option<&'a InputRange>, Error> {
        let Some(Follows { name, .. }) = self.input.map(Follows::parse) else {
            return Ok(None);
        };
        let own = header.axes.get(usize::from(self.axis));
        let input = own.and_then(|axis| axis.input.as_ref());
        match input.filter(|input| input.name.as_str() == name) {
            Some(input) => Ok(Some(&input.range)),
            None => Err(Error::Effect {
                tag: self.entry.tag,
                fault: "follows another input than that of its axis",
            }),
        }
    }

    /// The range of what it follows, and whether its square is meant.
    fn with_power<'a>(&self, range: Option<&'a InputRange>) -> Option<(&'a InputRange, bool)> {
        let follows = Follows::parse(self.input?);
        Some((range?, follows.squared))
    }

    /// Bounds of the forces on the own and the other axis over all motions and inputs inside the
    /// training range.
    fn bounds(&self, header: &Header, references: &References) -> [Interval; 2] {
        let [own, other] = self.law_bounds(header, references);
        let follows = self.input.map(Follows::parse);
        let (Ok(Some(range)), Some(follows)) = (self.followed(header), follows) else {
            return [own, other];
        };
        let share = share(follows.lag_s, 1.0 / header.sample_rate_hz);
        let input = input(range, range.half_range);
        let mut lagged = input;
        if share < 1.0 {
            // A rounding of half a unit at every sample, and a share that is off by as much, gather
            // to so many times themselves.
            lagged.error += (0.5 + input.magnitude()) * UNIT / share;
        }
        let linear = own * lagged;
        [
            if follows.squared {
                linear * lagged
            } else {
                linear
            },
            other,
        ]
    }

    /// The same of the law alone.
    fn law_bounds(&self, header: &Header, references: &References) -> [Interval; 2] {
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
        // The errors are those of a joint at rest, whose states hold what has gathered so far: what
        // a moving sample adds besides it also takes back.
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
        let gathered = match self.entry.error_propagation {
            ErrorPropagation::Within(times) => f64::from(times) * added,
            ErrorPropagation::WithTime => {
                let kept = after(added).1 / added - 1.0;
                // A share that is not below 1 leaves the error without a bound, and the effect is
                // refused.
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
                StateBound::Number(most) => f64::from(most),
                StateBound::Displacement(times) => {
                    f64::from(times) * half / references.displacement[0]
                }
                StateBound::FromZero => (center.abs() + half) / references.displacement[0],
            };
            *state = Interval::range(-most, most, error);
        }
        states
    }
}

/// All values that a normalised input takes inside its training range, relative to `scale`.
fn input(range: &InputRange, scale: f64) -> Interval {
    // A Q31 input is off by half a unit, at its upper edge by a whole one; the origin by half a Q
    // unit.
    let scale = range.half_range / scale;
    Interval::range(
        scale * (range.center / range.half_range - 1.0),
        scale * (range.center / range.half_range + 1.0),
        scale * 3.0 * UNIT,
    )
}

/// What the parameters of a term on axis `own` are relative to. The force of one that follows an
/// input is per unit of that, or of its square, and the law is multiplied by the input relative to
/// half its range.
fn references(
    header: &Header,
    full_scale: [f64; 2],
    own: usize,
    followed: Option<(&InputRange, bool)>,
) -> References {
    let full_scale = match followed {
        Some((range, squared)) => {
            let power = if squared { 2 } else { 1 };
            full_scale.map(|force| force / range.half_range.powi(power))
        }
        None => full_scale,
    };
    let of = |pick: fn(&Axis) -> f64| {
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
        let relative = |range: &InputRange| Q::from_f64(range.center / range.half_range);
        *pair = [relative(&axis.displacement), relative(&axis.velocity)];
    }
    origins
}

impl Terms {
    /// The largest force of the effects on each axis over all motions inside the training range, N
    /// or N·m.
    pub fn largest_forces(header: &Header, terms: &[EffectValues]) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for term in terms {
            let own = usize::from(term.axis);
            let followed = term.followed(header).unwrap_or_default();
            let references = references(header, [1.0; 2], own, term.with_power(followed));
            let [mine, others] = term.bounds(header, &references);
            sums[own] += mine.magnitude();
            sums[1 - own] += others.magnitude();
        }
        sums
    }

    /// Brings effects to machine numbers; also gives the bound of |device − f64| per axis in N or
    /// N·m, for effects with memory with what their states gather over any number of samples
    /// ([`ErrorPropagation`]).
    ///
    /// # Errors
    /// As [`Terms::stored`]; [`Error::Effect`] when a number on the way could leave the device's
    /// range.
    pub fn quantise(
        header: &Header,
        force_per_lsb: [f64; 2],
        terms: &[EffectValues],
    ) -> Result<(Self, [f64; 2]), Error> {
        let full_scale = force_per_lsb.map(|lsb| lsb * FULL_SCALE);
        let mut errors = [0.0; 2];
        let mut stored = Vec::new();
        let mut followed_origins = [Q::default(); 2];
        for term in terms {
            check_place(term.entry, term.axis, header.axes.len())?;
            if term.entry.needs_two_axes() && header.axes.len() != 2 {
                return Err(Error::Effect {
                    tag: term.entry.tag,
                    fault: "needs two axes while the model has one",
                });
            }
            let own = usize::from(term.axis);
            let followed = term.followed(header)?;
            let references = references(header, full_scale, own, term.with_power(followed));
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
            let follows = term.input.map(Follows::parse);
            let share = follows.map(|f| share(f.lag_s, 1.0 / header.sample_rate_hz));
            stored.push(StoredTerm {
                tag: term.entry.tag,
                axis: term.axis,
                squared: follows.is_some_and(|f| f.squared),
                // At least the first unit that is told from none.
                follows: share.map_or(0, |share| (Q::from_f64(share).raw() - 1).max(1) as u32),
                parameters,
            });
            if let (Some(range), Some(place)) = (followed, followed_origins.get_mut(own)) {
                *place = Q::from_f64(range.center / range.half_range);
            }
        }
        // The sum is rounded to the force unit once.
        let errors = [0, 1].map(|axis| errors[axis] + 0.5 * force_per_lsb[axis]);
        let origins = if stored.is_empty() {
            [Q::default(); 4]
        } else {
            origins(header)
        };
        let terms = Self::stored(header.axes.len(), stored, origins, followed_origins)?;
        Ok((terms, errors))
    }

    /// The effects in SI, from what the device holds.
    pub fn in_si(&self, header: &Header, outputs: &[Output]) -> Vec<EffectValues> {
        let mut full_scale = [1.0; 2];
        for (place, output) in full_scale.iter_mut().zip(outputs) {
            *place = output.force_per_lsb * FULL_SCALE;
        }
        let terms = self.list.iter().map(|term| {
            let own = header.axes.get(term.axis());
            let followed = own.and_then(|axis| axis.input.as_ref());
            let followed = followed.zip(term.follows());
            let range = followed.map(|(input, _)| (&input.range, term.squared()));
            let references = references(header, full_scale, term.axis(), range);
            let input = followed.map(|(input, share)| {
                let follows = Follows {
                    name: input.name.as_str(),
                    squared: term.squared(),
                    lag_s: lag_s(share.to_f64(), 1.0 / header.sample_rate_hz),
                };
                kept(&follows.written())
            });
            let listed = term.entry.parameters().iter().zip(&term.parameters);
            let values = listed.map(|(parameter, value)| {
                let scale = parameter.dimension_in_law().scale(&references);
                parameter.as_law_takes_it(value.to_f64() * scale)
            });
            EffectValues {
                input,
                entry: term.entry,
                axis: term.axis,
                values: values.collect(),
            }
        });
        terms.collect()
    }
}
