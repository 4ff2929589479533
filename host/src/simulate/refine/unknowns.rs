//! What a refinement may change in a model: parameters of effects, coefficients of a polynomial,
//! identified inertias.

use crate::fit::effects::unknowns as shapes;
use crate::model::effects::AxisEffect;
use crate::model::evaluator::{Evaluator, Number};
use crate::model::file::{Base, ModelFile};
use crate::text::error::{Error, Result};
use jointwatch_shared::base::terms::EffectValues;
use jointwatch_shared::effect::Subsystem;
use jointwatch_shared::effect::about::{Parameter, Role};
use jointwatch_shared::scalar::dual::Dual;
use jointwatch_shared::units::References;

/// The most unknowns of a refinement: each is one more simulation of all training records per step.
pub(super) const MOST: usize = 64;
/// Steps that change no unknown by more than this part of its size are no change.
const SMALL_STEP: f64 = 1e-7;

/// How an unknown is stepped.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// By its logarithm, within bounds: what is positive by nature.
    Logarithm { least: f64, most: f64 },
    /// By parts of its size, down to the smallest value allowed.
    Linear { size: f64, least: f64 },
}

/// One quantity to search for.
#[derive(Clone, Debug, PartialEq)]
struct Unknown {
    /// Every number of the model that it stands for; none of an inertia.
    numbers: Vec<Number>,
    /// The axis whose inertia it is.
    inertia: Option<usize>,
    kind: Kind,
}

/// Everything that is searched for in one model.
#[derive(Clone, Debug)]
pub(super) struct Unknowns {
    list: Vec<Unknown>,
    /// The places of the effects of the joint among all effects of the model.
    joint: Vec<usize>,
}

/// What a simulation is differentiated by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum By {
    /// Nothing: the motion alone.
    Nothing,
    /// An unknown, by its place.
    Unknown(usize),
    /// One of the body's positions or velocities at the start.
    Start(usize),
}

impl Unknowns {
    /// What may change in a model that was learnt from motions of this size.
    ///
    /// # Errors
    /// A model that cannot be refined, one sentence that says what to use.
    pub(super) fn of(model: &ModelFile, references: &References) -> Result<Self> {
        let effects = model.effects_in_si()?;
        refuse(model, &effects)?;
        let mut joint = Vec::new();
        let mut terms = Vec::new();
        for (place, effect) in effects.iter().enumerate() {
            if effect.entry.subsystem != Subsystem::Sensor {
                joint.push(place);
                terms.push(AxisEffect::from(effect));
            }
        }
        let mut list = linear(&terms, references);
        for shape in shapes::shapes(&terms, references) {
            if shape.shape.is_given() {
                continue;
            }
            let places = shape.places.iter();
            list.push(Unknown {
                numbers: places.map(|&(t, i)| Number::Parameter(t, i)).collect(),
                inertia: None,
                kind: Kind::Logarithm {
                    least: shape.shape.least * shape.reference,
                    most: shape.shape.most * shape.reference,
                },
            });
        }
        list.extend(coefficients(&model.base, references));
        for (axis, _) in identified(model) {
            list.push(Unknown {
                numbers: Vec::new(),
                inertia: Some(axis),
                kind: Kind::Logarithm {
                    least: f64::MIN_POSITIVE,
                    most: f64::MAX,
                },
            });
        }
        if list.len() > MOST {
            return Err(Error::data(format!(
                "this model has {} numbers to refine, more than the {MOST} for which a refinement by simulation is practical: learn \
                 fewer terms, with --fit select, a lower --order, or --model physical",
                list.len()
            )));
        }
        Ok(Self { list, joint })
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.list.len()
    }

    /// Their values in a model, SI.
    pub(super) fn values(&self, model: &ModelFile) -> Vec<f64> {
        let value = |unknown: &Unknown| match (unknown.inertia, unknown.numbers.first()) {
            (Some(axis), _) => model.axes[axis].inertia,
            (None, Some(&Number::Parameter(term, index))) => {
                model.effects[self.joint[term]].parameters[index].value
            }
            (None, Some(&Number::Coefficient(axis, index))) => match &model.base {
                Base::Polynomial(polynomial) => polynomial.coefficients[axis][index],
                _ => 0.0,
            },
            (None, None) => 0.0,
        };
        self.list.iter().map(value).collect()
    }

    /// The model with other values.
    pub(super) fn with(&self, model: &ModelFile, values: &[f64]) -> ModelFile {
        let mut model = model.clone();
        for (unknown, &value) in self.list.iter().zip(values) {
            if let Some(axis) = unknown.inertia {
                model.axes[axis].inertia = value;
            }
            for number in &unknown.numbers {
                match (*number, &mut model.base) {
                    (Number::Parameter(term, index), _) => {
                        let parameter = &mut model.effects[self.joint[term]].parameters[index];
                        parameter.value = value;
                        // It was that of another value.
                        parameter.interval = None;
                    }
                    (Number::Coefficient(axis, index), Base::Polynomial(polynomial)) => {
                        polynomial.coefficients[axis][index] = value;
                    }
                    _ => {}
                }
            }
        }
        model
    }

    /// Whether an unknown stands at a bound beyond which it would go in this direction.
    pub(super) fn is_held(&self, values: &[f64], unknown: usize, direction: f64) -> bool {
        let value = values[unknown];
        match self.list[unknown].kind {
            Kind::Logarithm { least, .. } | Kind::Linear { least, .. } if direction < 0.0 => {
                value <= least
            }
            Kind::Logarithm { most, .. } => value >= most,
            Kind::Linear { .. } => false,
        }
    }

    /// The values that a step leads to, held within their bounds; none when that is no change.
    pub(super) fn stepped(&self, values: &[f64], step: &[f64]) -> Option<Vec<f64>> {
        let mut most: f64 = 0.0;
        let stepped = self.list.iter().zip(values).zip(step);
        let stepped = stepped.map(|((unknown, &value), step)| match unknown.kind {
            Kind::Logarithm { least, most: bound } => {
                let new = (value * step.clamp(-1.0, 1.0).exp()).clamp(least, bound);
                most = most.max((new / value).ln().abs());
                new
            }
            Kind::Linear { size, least } => {
                let new = (value + size * step).max(least);
                most = most.max((new - value).abs() / size);
                new
            }
        });
        let stepped: Vec<f64> = stepped.collect();
        (most >= SMALL_STEP).then_some(stepped)
    }

    /// The model's law as a simulation differentiates it, and the inertia of every axis.
    pub(super) fn lifted(&self, model: &ModelFile, by: By) -> Result<(Evaluator<Dual>, [Dual; 2])> {
        let unknown = match by {
            By::Unknown(place) => Some(&self.list[place]),
            By::Nothing | By::Start(_) => None,
        };
        let effects = model.effects_in_si()?;
        let lift = |number: Number, taken: f64| {
            let slope = match unknown {
                Some(unknown) if unknown.numbers.contains(&number) => match unknown.kind {
                    Kind::Linear { size, .. } => size,
                    // d v/d ln v = v, and d (1/v)/d ln v = −1/v.
                    Kind::Logarithm { .. } if self.is_reciprocal(&effects, number) => -taken,
                    Kind::Logarithm { .. } => taken,
                },
                _ => 0.0,
            };
            Dual {
                value: taken,
                slopes: [slope],
            }
        };
        let evaluator = Evaluator::lifted(model, lift)?;
        let mut inertia = [Dual::constant(1.0); 2];
        for (place, axis) in model.axes.iter().enumerate() {
            let mine = unknown.is_some_and(|unknown| unknown.inertia == Some(place));
            inertia[place] = Dual {
                value: axis.inertia,
                slopes: [if mine { axis.inertia } else { 0.0 }],
            };
        }
        Ok((evaluator, inertia))
    }

    /// Whether a law takes one over the parameter.
    fn is_reciprocal(&self, effects: &[EffectValues], number: Number) -> bool {
        let Number::Parameter(term, index) = number else {
            return false;
        };
        let parameter = &effects[self.joint[term]].entry.parameters()[index];
        matches!(parameter.role, Role::Shape(shape) if shape.reciprocal)
    }
}

/// Axes whose inertia was identified.
fn identified(model: &ModelFile) -> impl Iterator<Item = (usize, f64)> {
    let axes = model.axes.iter().enumerate();
    axes.filter(|(_, axis)| axis.inertia_identified)
        .map(|(place, axis)| (place, axis.inertia))
}

/// Parameters that the force is proportional to.
fn linear(terms: &[AxisEffect], references: &References) -> Vec<Unknown> {
    let mut list = Vec::new();
    for (term, bound) in terms.iter().enumerate() {
        for (index, parameter) in bound.entry.parameters().iter().enumerate() {
            if !matches!(parameter.role, Role::Linear { .. }) {
                continue;
            }
            list.push(Unknown {
                numbers: vec![Number::Parameter(term, index)],
                inertia: None,
                kind: Kind::Linear {
                    size: size(bound, parameter, references),
                    least: match bound.is_positive(parameter) {
                        true => 0.0,
                        false => f64::NEG_INFINITY,
                    },
                },
            });
        }
    }
    list
}

fn size(bound: &AxisEffect, parameter: &Parameter, references: &References) -> f64 {
    shapes::reference(bound, parameter, references)
}

/// Coefficients of a polynomial that its fit did not leave at 0.
fn coefficients(base: &Base, references: &References) -> Vec<Unknown> {
    let Base::Polynomial(polynomial) = base else {
        return Vec::new();
    };
    let mut list = Vec::new();
    for (axis, coefficients) in polynomial.coefficients.iter().enumerate() {
        for (index, _) in coefficients.iter().enumerate().filter(|(_, c)| **c != 0.0) {
            list.push(Unknown {
                numbers: vec![Number::Coefficient(axis, index)],
                inertia: None,
                kind: Kind::Linear {
                    size: references.force[axis],
                    least: f64::NEG_INFINITY,
                },
            });
        }
    }
    list
}

/// What a network is told.
pub fn refuse_network() -> Error {
    Error::usage(
        "a network is not refined by --criterion simulation: use --model physical or --model polynomial --fit select, or judge the network \
         with `jointwatch respond`",
    )
}

/// Refuses models that cannot be refined by simulation.
fn refuse(model: &ModelFile, effects: &[EffectValues]) -> Result<()> {
    if matches!(model.base, Base::Network(_)) {
        return Err(refuse_network());
    }
    for effect in effects {
        let name = effect.entry.about.name;
        if effect.entry.subsystem == Subsystem::TimeVaryingPlant {
            return Err(Error::data(format!(
                "{name} depends on the time since the record began, and --criterion simulation starts within a record: leave it out of \
                 [base] terms, or use --criterion equation"
            )));
        }
    }
    Ok(())
}
