//! A hypothesis: a set of effects on an axis, beside the base, with their values; and what keeps a
//! value from being physics.

use crate::fit::effects::columns::Records;
use crate::fit::effects::unknowns::{is_physical, reference};
use crate::model::effects::AxisEffect;
use crate::study::series::dot;
use jointwatch_shared::effect::about::Role;
use jointwatch_shared::units::Dimension;
use std::sync::Arc;

/// A length, a time or a power within this part of its bound stands there.
const AT_BOUND: f64 = 0.01;
/// A pitch up to the travel, in units of the largest displacement.
const TRAVEL: f64 = 2.0;

/// Effects as tags with their axes and inputs, in order.
pub(crate) type Key = Vec<(u8, usize, Option<&'static str>)>;

/// A set of effects with values.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Hypothesis {
    /// Effects, those of the base first.
    pub(crate) members: Vec<AxisEffect>,
    /// Every parameter of each, SI.
    pub(crate) values: Vec<Vec<f64>>,
    /// How many of them belong to the base.
    pub(crate) base: usize,
}

/// A column with the least and the most of its factor.
#[derive(Clone)]
pub(crate) struct Column {
    pub(crate) data: Arc<Vec<f64>>,
    pub(crate) bounds: [f64; 2],
}

/// A member's columns on an axis.
#[derive(Clone)]
pub(crate) struct Part {
    pub(crate) bound: AxisEffect,
    pub(crate) values: Vec<f64>,
    pub(crate) columns: Vec<Column>,
}

impl Part {
    /// Whether these are the columns of an effect at these values, whatever the strengths.
    pub(crate) fn is(&self, bound: &AxisEffect, values: &[f64]) -> bool {
        let parameters = bound.entry.parameters().iter();
        let mut pairs = parameters.zip(values.iter().zip(&self.values));
        self.bound == *bound && pairs.all(|(p, (new, old))| p.is_linear() || new == old)
    }
}

/// Whether a term of the base, the first `base` parts, has an added one as its general case, which
/// takes its place.
pub(crate) fn is_replaced(parts: &[Part], base: usize, at: usize) -> bool {
    let mut added = parts[base..].iter();
    at < base && added.any(|part| part.bound.replaces(&parts[at].bound))
}

impl Hypothesis {
    /// The effects beside the base.
    pub(crate) fn added(&self) -> &[AxisEffect] {
        &self.members[self.base..]
    }

    /// With one more effect. One that differs from a member by what it follows has the shapes of
    /// that.
    pub(crate) fn with(&self, bound: AxisEffect, mut values: Vec<f64>) -> Self {
        let mut wider = self.clone();
        if let Some(twin) = self
            .members
            .iter()
            .position(|member| member.is_twin(&bound))
        {
            let listed = bound.entry.parameters().iter().zip(&mut values);
            for ((parameter, value), other) in listed.zip(&self.values[twin]) {
                if !parameter.is_linear() {
                    *value = *other;
                }
            }
        }
        wider.members.push(bound);
        wider.values.push(values);
        wider
    }

    /// Without one of the effects beside the base.
    pub(crate) fn without(&self, bound: &AxisEffect) -> Self {
        let mut narrower = self.clone();
        let at = (self.base..self.members.len()).find(|&at| self.members[at] == *bound);
        if let Some(at) = at {
            narrower.members.remove(at);
            narrower.values.remove(at);
        }
        narrower
    }

    /// With the effects beside the base in this order.
    pub(crate) fn ordered(&self, order: &[AxisEffect]) -> Self {
        let mut ordered = self.clone();
        for (place, bound) in order.iter().enumerate() {
            let at = self.base + place;
            let from = (at..ordered.members.len()).find(|&i| ordered.members[i] == *bound);
            if let Some(from) = from {
                ordered.members.swap(at, from);
                ordered.values.swap(at, from);
            }
        }
        ordered
    }

    /// Which effects are added, in an order of its own: two hypotheses with the same key are the
    /// same set.
    pub(crate) fn key(&self) -> Key {
        let added = self.added().iter();
        let mut key: Vec<_> = added.map(|b| (b.entry.tag, b.axis, b.input)).collect();
        key.sort_unstable();
        key
    }
}

/// Whether an effect stands at the edge of what was searched, or has values that it cannot have.
pub(crate) fn is_at_bound(bound: &AxisEffect, values: &[f64], records: &Records<'_>) -> bool {
    let listed = bound.entry.parameters().iter().zip(values).enumerate();
    let mut edges = listed.filter_map(|(place, (parameter, &value))| {
        let Role::Shape(shape) = parameter.role else {
            return None;
        };
        if shape.is_given() {
            return None;
        }
        // The power of a law without memory is the law; in a hysteresis it rounds a knee.
        let power = parameter.dimension == Dimension::NONE && bound.entry.state_bounds.is_empty();
        let decides =
            power || [Dimension::DISPLACEMENT, Dimension::TIME].contains(&parameter.dimension);
        let relative = value / reference(bound, parameter, &records.references);
        let outside =
            relative < (1.0 + AT_BOUND) * shape.least || relative > (1.0 - AT_BOUND) * shape.most;
        let is_pitch = bound.entry.pitch() == Some(place);
        let untold = || relative > TRAVEL || records.is_aliased(bound.axis, value);
        let met_by = bound.entry.met_by;
        let is_late = met_by.is_some_and(|(length, part)| length == place && relative > part);
        Some((decides && outside) || is_late || (is_pitch && untold()))
    });
    edges.any(|at| at) || !is_physical(bound, values, records)
}

/// Whether a strength that has to be positive, of an effect that follows an input, is below nothing
/// wherever that goes: it pushes where friction holds back. Beside strengths of other effects in
/// the same unit it may be a change of those.
pub(crate) fn is_turned(hypothesis: &Hypothesis, at: usize, records: &Records<'_>) -> bool {
    let bound = &hypothesis.members[at];
    if bound.input.is_none() {
        return false;
    }
    let positive = |of: &AxisEffect| {
        let listed = of.entry.parameters().iter().enumerate();
        listed.filter(|(_, p)| matches!(p.role, Role::Linear { positive: true }))
    };
    let inputs = hypothesis.members.iter().map(|member| member.input);
    let inputs = inputs.map(|input| input.map(|input| records.of_input(0, input)));
    let inputs: Vec<Option<Vec<f64>>> = inputs.collect();
    positive(bound).any(|(own, parameter)| {
        let mut strength = vec![0.0; records.rows_per_axis()];
        let members = hypothesis.members.iter().zip(&hypothesis.values);
        for ((other, values), input) in members.zip(&inputs) {
            let same = other.entry == bound.entry;
            let alike = positive(other).filter(|(place, p)| {
                p.dimension == parameter.dimension && (!same || *place == own)
            });
            let Some(value) = alike.map(|(place, _)| values[place]).reduce(f64::max) else {
                continue;
            };
            for (row, strength) in strength.iter_mut().enumerate() {
                *strength += value * input.as_ref().map_or(1.0, |input| input[row]);
            }
        }
        strength.iter().all(|s| *s < 0.0)
    })
}

/// Mean power with which dampers of the base drive an axis that moves with this velocity: those
/// whose strength is below 0.
pub(crate) fn driven(hypothesis: &Hypothesis, velocity: &[f64]) -> f64 {
    let members = hypothesis.members.iter().zip(&hypothesis.values);
    let strengths = members.take(hypothesis.base).flat_map(|(bound, values)| {
        let listed = bound.entry.parameters().iter().zip(values);
        let dampers = listed.filter(|(p, _)| p.dimension == Dimension::DAMPING && p.is_linear());
        dampers.map(|(_, &strength)| (-strength).max(0.0))
    });
    strengths.sum::<f64>() * mean_product(velocity, velocity)
}

/// Mean of the products of two series: of a force and a velocity, the power.
pub(crate) fn mean_product(a: &[f64], b: &[f64]) -> f64 {
    dot(a, b) / a.len().max(1) as f64
}
