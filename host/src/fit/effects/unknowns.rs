//! The unknowns of a sum of effects: what is proportional to the force, and what shapes a law.

use super::columns::Records;
use crate::model::effects::AxisEffect;
use jointwatch_shared::base::corrections::MAX_GAIN;
use jointwatch_shared::effect::Subsystem;
use jointwatch_shared::effect::about::{Parameter, Role, Shape};
use jointwatch_shared::units::{Dimension, References};

/// The part of its largest value from which on a shape stands there.
const AT_MOST: f64 = 0.9;

/// A parameter that shapes one or several laws: one number to search for.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ShapeUnknown {
    /// The law's parameter: how to search for it.
    pub(crate) shape: Shape,
    /// What `shape` is relative to, SI.
    pub(crate) reference: f64,
    /// Every (term, parameter) that it stands for; the first owns it.
    pub(crate) places: Vec<(usize, usize)>,
}

impl ShapeUnknown {
    /// The value held within what the effect allows, SI.
    pub(crate) fn clamp(&self, value: f64) -> f64 {
        value.clamp(
            self.shape.least * self.reference,
            self.shape.most * self.reference,
        )
    }

    /// Whether a value stands at a bound beyond which it would go in this direction.
    pub(crate) fn is_held(&self, value: f64, direction: f64) -> bool {
        let beyond = value * (1.0 + f64::EPSILON.sqrt().copysign(direction));
        direction != 0.0 && self.clamp(beyond) == self.clamp(value)
    }
}

/// The shape unknowns of a list of terms; parameters that are tied to one another are one unknown.
pub(crate) fn shapes(terms: &[AxisEffect], references: &References) -> Vec<ShapeUnknown> {
    let mut unknowns: Vec<ShapeUnknown> = Vec::new();
    // Owners first, so that a tie always finds what it is tied to.
    for tied in [false, true] {
        for (term, bound) in terms.iter().enumerate() {
            for (index, parameter) in bound.entry.parameters().iter().enumerate() {
                let Role::Shape(shape) = parameter.role else {
                    continue;
                };
                let owner = shape.tie.and_then(|tie| owner(terms, bound, tie));
                let twin = || terms[..term].iter().position(|t| t.is_twin(bound));
                let owner = owner.or_else(|| twin().map(|twin| (twin, index)));
                if owner.is_some() != tied {
                    continue;
                }
                let known = owner.and_then(|place| {
                    unknowns
                        .iter_mut()
                        .find(|unknown| unknown.places.contains(&place))
                });
                match known {
                    Some(unknown) => unknown.places.push((term, index)),
                    None => unknowns.push(ShapeUnknown {
                        shape,
                        reference: reference(bound, parameter, references),
                        places: vec![(term, index)],
                    }),
                }
            }
        }
    }
    unknowns
}

/// The (term, parameter) that a tie points at, when the model has it.
fn owner(
    terms: &[AxisEffect],
    bound: &AxisEffect,
    tie: jointwatch_shared::effect::about::Tie,
) -> Option<(usize, usize)> {
    let axis = if tie.other_axis {
        1 - bound.axis
    } else {
        bound.axis
    };
    let term = terms
        .iter()
        .position(|t| t.entry.about.name == tie.effect && t.axis == axis)?;
    let parameters = terms[term].entry.parameters();
    let index = parameters.iter().position(|p| p.name == tie.parameter)?;
    Some((term, index))
}

/// The size of a parameter's unit beside the motion that was measured, SI.
pub(crate) fn reference(bound: &AxisEffect, parameter: &Parameter, references: &References) -> f64 {
    if bound.entry.is_in_si(parameter) {
        return 1.0;
    }
    let seen = if bound.axis == 0 {
        *references
    } else {
        references.swapped()
    };
    parameter.dimension.scale(&seen)
}

/// Periods of a line in the longest record, at least.
const PERIODS: f64 = 3.0;
/// Frequency of a line beside the rate of the rows behind the low-pass, at most: near one half any
/// amplitude with a phase to match gives the same samples, and beyond it what is left of the line
/// behind the low-pass looks like a slow force.
const SAMPLED: f64 = 0.45;
/// Friction at rest is at most so many times that in motion, for any lubricated or dry pair of
/// materials.
const AT_REST: f64 = 3.0;

/// Places along the travel at which a strength is looked at.
const PLACES: u32 = 32;

/// Force that an effect may have, beside the measured one or the largest of those it stands with:
/// two that cancel are one too many.
pub(crate) const MAX_FORCE: f64 = 3.0;
/// A strength of the joint is at most so many times what the largest force, displacement and
/// velocity make: a stop of that stiffness is pressed by a thousandth of the motion.
const MOST: f64 = 1e3;

/// Part of a stated inertia by which it may be too large: nobody weighs twice of what is there, and
/// records that seem to say so have another cause. Much may be left out, as a motor's rotor is.
const MAX_TOO_LARGE: f64 = 0.5;

/// The least and the most of a parameter that the force is proportional to: a strength that has to
/// be positive is not below nothing, an inertia is at least half of what is stated, and the gain
/// of a channel is one that can be put right.
fn bounds(bound: &AxisEffect, parameter: &Parameter, records: &Records<'_>) -> [f64; 2] {
    match bound.entry.about.name {
        _ if bound.is_positive(parameter) => [0.0, f64::INFINITY],
        "force_gain" => [-MAX_GAIN, MAX_GAIN],
        "inertia_error" => {
            let stated = records.inertias[bound.axis].unwrap_or(f64::INFINITY);
            [-MAX_TOO_LARGE * stated, f64::INFINITY]
        }
        _ => [f64::NEG_INFINITY, f64::INFINITY],
    }
}

/// The same of every column that records make of an effect.
pub(crate) fn column_bounds(bound: &AxisEffect, records: &Records<'_>) -> Vec<[f64; 2]> {
    let parameters = bound.entry.parameters().iter();
    let columns = parameters.map(|parameter| {
        let bounds = bounds(bound, parameter, records);
        std::iter::repeat_n(bounds, records.columns_of(parameter))
    });
    columns.flatten().collect()
}

/// Whether a law is what it is called: every strength is inside its bounds, as one at nothing is
/// absent, unless another one is enough; no strength of the joint is far beyond what is measured;
/// none is less than what it exceeds in nature or more than a few times that, or below nothing at
/// some place where the motion goes; and it has not become another one. One whose memory outlasts
/// the records has: it is a spring about another zero, and follows the drift of an instrument. So
/// has one that forgets within a sample, which is a damper, one that repeats after more than the
/// travel, or a line of which the longest record holds no three periods or the sampling no more
/// than a glimpse.
pub(crate) fn is_physical(bound: &AxisEffect, values: &[f64], records: &Records<'_>) -> bool {
    let entry = bound.entry;
    let parameters = entry.parameters();
    let mut listed = parameters.iter().zip(values).enumerate();
    let alternatives = entry.one_is_enough;
    let one_acts = alternatives.iter().any(|&place| values[place] > 0.0);
    let may_vanish = |place: usize| one_acts && alternatives.contains(&place);
    // Of a strength a + b·u with an input, either may be far larger than both together.
    let of_motion = entry.subsystem == Subsystem::Plant && records.inputs().is_empty();
    let too_strong = |parameter: &Parameter, value: f64| {
        let unit = reference(bound, parameter, &records.references);
        of_motion && unit > 0.0 && value.abs() > MOST * unit
    };
    let inside = listed.all(|(place, (parameter, value))| {
        let [least, most] = bounds(bound, parameter, records);
        let linear = matches!(parameter.role, Role::Linear { .. });
        let above = least < *value || (*value == 0.0 && may_vanish(place));
        !linear || (above && *value < most && !too_strong(parameter, *value))
    });
    let [lowest, highest] = records.extent[bound.axis];
    let at_most = |place: usize| match parameters[place].role {
        Role::Shape(shape) => {
            let unit = reference(bound, &parameters[place], &records.references);
            let is_length = parameters[place].dimension == Dimension::DISPLACEMENT;
            values[place] > AT_MOST * shape.most * unit
                || (is_length && values[place] > highest - lowest)
        }
        _ => false,
    };
    let longest_s = records.longest_s();
    let mut listed = parameters.iter().zip(values);
    let unseen = listed.any(|(parameter, value)| match parameter.role {
        Role::Shape(_) if parameter.dimension == Dimension::TIME => {
            *value > longest_s || value * records.sample_rate_hz < 1.0
        }
        Role::Shape(_) if parameter.dimension == Dimension::TIME.inverse() => {
            value * longest_s < PERIODS || *value > SAMPLED * records.thinned_rate_hz
        }
        _ => false,
    });
    let mut pairs = entry.never_less.iter();
    let strength_at = |x: f64| {
        let coefficients = entry.strength_by_displacement.iter().rev();
        coefficients.fold(0.0, |sum, &place| sum * x + values[place])
    };
    let mut places = (0..=PLACES).map(|at| {
        let share = f64::from(at) / f64::from(PLACES);
        lowest + share * (highest - lowest)
    });
    // What follows an input may be a change of another strength.
    let grips = bound.input.is_some() || places.all(|x| strength_at(x) >= 0.0);
    inside
        && grips
        && pairs.all(|&(more, less)| (1.0..=AT_REST).contains(&(values[more] / values[less])))
        && !entry.not_at_most.iter().any(|&place| at_most(place))
        && !unseen
}
