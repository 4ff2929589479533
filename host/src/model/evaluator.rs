//! A model evaluated state by state, as a simulation needs it: one point at a time, without
//! allocating.

use super::scalar::HostScalar;
use super::time_history::law_parameters;
use super::{InputRange, Network, Polynomial, exponents};
use crate::model::corrections::of_the_joint;
use crate::model::file::{Base, ModelFile, NoBase};
use crate::text::error::Result;
use jointwatch_shared::base::followed::Follows;
use jointwatch_shared::base::terms::EffectValues;
use jointwatch_shared::effect::{
    Instrument, Kinematics, Law as EffectLaw, MAX_PARAMETERS, MAX_STATES, Parameters, States,
};

/// One number of a model, which a simulation may be differentiated by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Number {
    /// A parameter of an effect of the joint: the effect's place among all effects of the joint,
    /// and its own among the effect's.
    Parameter(usize, usize),
    /// A coefficient of a polynomial: its axis and its place.
    Coefficient(usize, usize),
}

/// A model at work inside a simulation: what was learnt, and what the model remembers of the motion
/// so far.
///
/// An integrator asks for [`Evaluator::force_at`] as often as its sub-steps need, with the model's
/// memory frozen, and calls [`Evaluator::advance`] once when a step is accepted. Polynomials and
/// networks remember nothing, some effects do.
#[derive(Clone, Debug)]
pub struct Evaluator<S = f64> {
    inputs: Vec<InputRange>,
    /// How many of the inputs are states of the joint.
    motion_states: usize,
    law: Law<S>,
    effects: Vec<EffectPoint<S>>,
    /// Displacements at the last accepted step.
    before: Option<[S; 2]>,
    /// The length of the last accepted step, s; what a step under way is taken to last.
    step_s: f64,
    /// Time since the motion began, s.
    time_s: f64,
    /// What the force follows beside the motion, in the order of [`ModelFile::input_names`].
    followed: Vec<f64>,
    /// Which of them is the base's third state.
    state_input: Option<usize>,
}

/// An effect with its internal states.
#[derive(Clone, Debug)]
struct EffectPoint<S> {
    law: EffectLaw<S>,
    parameters: Parameters<S>,
    axis: usize,
    states: States<S>,
    input: Option<InputPoint>,
}

/// What an effect follows: which of the inputs, and where it is behind its lag.
#[derive(Clone, Copy, Debug)]
struct InputPoint {
    place: usize,
    squared: bool,
    lag_s: f64,
    /// None before the first input: a lag begins where its input does.
    lagged: Option<f64>,
}

impl InputPoint {
    /// What the effect's force is multiplied by.
    fn factor(&self) -> f64 {
        let value = self.lagged.unwrap_or_default();
        if self.squared { value * value } else { value }
    }

    /// Goes towards the input for so long.
    fn advance(&mut self, input: f64, time_step_s: f64) {
        let keep = match self.lagged {
            Some(_) if self.lag_s > 0.0 => (-time_step_s / self.lag_s).exp(),
            _ => 0.0,
        };
        self.lagged = Some(input + keep * (self.lagged.unwrap_or(input) - input));
    }
}

#[derive(Clone, Debug)]
enum Law<S> {
    Polynomial(PolynomialPoint<S>),
    Network(NetworkPoint),
    None,
}

impl<S: HostScalar> EffectPoint<S> {
    /// `names` are those of the inputs; `lift` is told the place of each parameter and its number
    /// as the law takes it.
    fn new(term: &EffectValues, names: &[String], lift: impl Fn(usize, f64) -> S) -> Self {
        let mut parameters = [S::zero(); MAX_PARAMETERS];
        let taken = law_parameters(term.entry, &term.values);
        for (place, (parameter, value)) in parameters.iter_mut().zip(taken).enumerate() {
            *parameter = lift(place, value);
        }
        Self {
            law: S::law_of(term.entry),
            parameters,
            axis: usize::from(term.axis),
            states: [S::zero(); MAX_STATES],
            input: term.input.and_then(|input| {
                let follows = Follows::parse(input);
                Some(InputPoint {
                    place: names.iter().position(|name| name == follows.name)?,
                    squared: follows.squared,
                    lag_s: follows.lag_s,
                    lagged: None,
                })
            }),
        }
    }

    /// What it exerts on both axes at a state, and its internal states there.
    fn at(&self, evaluator: &Evaluator<S>, state: &[S; 4], period_s: f64) -> ([S; 2], States<S>) {
        let [x, v, phi, omega] = *state;
        let (own, other) = if self.axis == 0 {
            ([x, v], [phi, omega])
        } else {
            ([phi, omega], [x, v])
        };
        let before = evaluator.before.map_or(own[0], |before| before[self.axis]);
        let at = Kinematics {
            displacement: own[0],
            velocity: own[1],
            step: own[0] - before,
            other_displacement: other[0],
            other_velocity: other[1],
            period: S::constant(period_s),
            instrument: Instrument {
                time: S::constant(evaluator.time_s),
                ..Instrument::silent()
            },
        };
        let mut states = self.states;
        let [mine, others] = (self.law)(&self.parameters, &at, &mut states);
        let factor = S::constant(self.input.map_or(1.0, |input| input.factor()));
        let mine = factor * mine;
        let forces = if self.axis == 0 {
            [mine, others]
        } else {
            [others, mine]
        };
        (forces, states)
    }
}

impl Evaluator {
    /// Prepares a model.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] naming the effect that this version does not know.
    pub fn new(model: &ModelFile) -> Result<Self> {
        Self::lifted(model, |_, value| value)
    }

    /// Prepares effects of the joint alone, for a joint of `inputs` states and steps of `step_s`
    /// seconds.
    pub(crate) fn of_effects(inputs: usize, effects: &[EffectValues], step_s: f64) -> Self {
        let unit = InputRange {
            center: 0.0,
            half_range: 1.0,
        };
        let base = Base::None(NoBase {
            inputs: vec![unit; inputs],
        });
        let mut evaluator = Self::of_base(&base, |_, value| value);
        let effects = effects.iter();
        let effects = effects.map(|term| EffectPoint::new(term, &[], |_, value| value));
        evaluator.effects = effects.collect();
        evaluator.step_s = step_s;
        evaluator
    }
}

impl<S: HostScalar> Evaluator<S> {
    /// Prepares a model; `lift` is told every number of its effects and of a polynomial, as the
    /// laws take it.
    ///
    /// # Errors
    /// As [`Evaluator::new`].
    pub(crate) fn lifted(model: &ModelFile, lift: impl Fn(Number, f64) -> S) -> Result<Self> {
        let effects = of_the_joint(&model.effects_in_si()?);
        let names = model.input_names()?;
        let mut evaluator = Self::of_base(&model.base, &lift);
        let point = |(place, term): (usize, &EffectValues)| {
            EffectPoint::new(term, &names, |index, value| {
                lift(Number::Parameter(place, index), value)
            })
        };
        evaluator.effects = effects.iter().enumerate().map(point).collect();
        evaluator.step_s = 1.0 / model.filters.sample_rate_hz;
        let own = model.state_input.as_ref();
        evaluator.state_input = own.and_then(|own| names.iter().position(|name| name == own));
        evaluator.followed = vec![0.0; names.len()];
        Ok(evaluator)
    }

    fn of_base(base: &Base, lift: impl Fn(Number, f64) -> S) -> Self {
        Self {
            effects: Vec::new(),
            before: None,
            step_s: 0.0,
            time_s: 0.0,
            followed: Vec::new(),
            state_input: None,
            motion_states: base.motion_ranges().len(),
            inputs: base.inputs().to_vec(),
            law: match base {
                Base::Polynomial(polynomial) => {
                    Law::Polynomial(PolynomialPoint::new(polynomial, lift))
                }
                Base::Network(network) => Law::Network(NetworkPoint::new(network)),
                Base::None(_) => Law::None,
            },
        }
    }

    /// Restoring force [N, N·m] at the state [x, ẋ, φ, φ̇] (SI), 0 on an axis that the model does
    /// not have; a model of one axis looks at the first two states only. The same as the
    /// whole-record `predict` to rounding.
    pub fn force_at(&self, state: &[S; 4]) -> [S; 2] {
        let mut known = [S::zero(); 4];
        let states = known.iter_mut().zip(state).take(self.motion_states);
        states.for_each(|(known, value)| *known = *value);
        let mut of_base = known;
        let input = self.state_input.and_then(|own| self.followed.get(own));
        if let (Some(value), Some(place)) = (input, of_base.get_mut(self.motion_states)) {
            *place = S::constant(*value);
        }
        let mut u = [S::zero(); 4];
        for ((u, range), value) in u.iter_mut().zip(&self.inputs).zip(&of_base) {
            let from_center = *value - S::constant(range.center);
            *u = from_center.over(S::constant(range.half_range));
        }
        let mut force = match &self.law {
            Law::Polynomial(polynomial) => polynomial.force(u),
            Law::Network(network) => network.force(u),
            Law::None => [S::zero(); 2],
        };
        for effect in &self.effects {
            let ([f, g], _) = effect.at(self, &known, self.step_s);
            force = [force[0] + f, force[1] + g];
        }
        force
    }

    /// Tells the model what its inputs are from now on, in the order of [`ModelFile::input_names`]
    /// and in the units of the study.
    pub fn follow(&mut self, inputs: &[f64]) {
        self.followed.clear();
        self.followed.extend_from_slice(inputs);
        for input in self.effects.iter_mut().filter_map(|e| e.input.as_mut()) {
            // At once without a lag, and for the first time.
            let value = inputs.get(input.place).copied().unwrap_or_default();
            input.advance(value, 0.0);
        }
    }

    /// Tells the model that `time_step_s` has passed and that the joint is now at `state`, so that
    /// it can move its internal states on.
    pub fn advance(&mut self, state: &[S; 4], time_step_s: f64) {
        if self.effects.is_empty() {
            return;
        }
        self.time_s += time_step_s;
        // Every effect is brought to the new state from the same old one.
        let mut effects = std::mem::take(&mut self.effects);
        for effect in &mut effects {
            effect.states = effect.at(self, state, time_step_s).1;
            if let Some(input) = &mut effect.input {
                let value = self.followed.get(input.place).copied();
                input.advance(value.unwrap_or_default(), time_step_s);
            }
        }
        self.effects = effects;
        self.before = Some([state[0], state[2]]);
        self.step_s = time_step_s;
    }
}

/// Products u^i·v^j with exponents up to 3, the second exponent running fastest.
fn products<S: HostScalar>(u: S, v: S) -> [S; 16] {
    let powers = |x: S| [S::one(), x, x * x, x * x * x];
    let (u, v) = (powers(u), powers(v));
    std::array::from_fn(|at| u[at / 4] * v[at % 4])
}

/// A polynomial with its coefficients in one block of 16 per product of the first two inputs'
/// powers; of two inputs there is one block, and they take the place of the last two.
#[derive(Clone, Debug)]
struct PolynomialPoint<S> {
    /// Per axis, one block for two inputs and 16 for more.
    blocks: Vec<Vec<[S; 16]>>,
}

impl<S: HostScalar> PolynomialPoint<S> {
    fn new(polynomial: &Polynomial, lift: impl Fn(Number, f64) -> S) -> Self {
        let many = polynomial.inputs.len() > 2;
        let terms = exponents(&polynomial.orders);
        let axis = |(axis, coefficients): (usize, &Vec<f64>)| {
            let mut blocks = vec![[S::zero(); 16]; if many { 16 } else { 1 }];
            for (index, ([i, j, k, l], value)) in terms.iter().zip(coefficients).enumerate() {
                let at = |a: &u8, b: &u8| 4 * usize::from(*a) + usize::from(*b);
                let (block, place) = if many {
                    (at(i, j), at(k, l))
                } else {
                    (0, at(i, j))
                };
                blocks[block][place] = lift(Number::Coefficient(axis, index), *value);
            }
            blocks
        };
        Self {
            blocks: polynomial
                .coefficients
                .iter()
                .enumerate()
                .map(axis)
                .collect(),
        }
    }

    fn force(&self, [a, b, c, d]: [S; 4]) -> [S; 2] {
        let many = self.blocks.first().is_some_and(|blocks| blocks.len() > 1);
        let (first, second) = if many {
            (products(a, b), products(c, d))
        } else {
            (products(S::zero(), S::zero()), products(a, b))
        };
        let mut force = [S::zero(); 2];
        for (force, blocks) in force.iter_mut().zip(&self.blocks) {
            for (weight, block) in first.iter().zip(blocks) {
                // Four sums side by side, so that a vector register can hold them.
                let mut sums = [S::zero(); 4];
                for (coefficients, powers) in block.chunks_exact(4).zip(second.chunks_exact(4)) {
                    for ((sum, coefficient), power) in sums.iter_mut().zip(coefficients).zip(powers)
                    {
                        *sum = *sum + *coefficient * *power;
                    }
                }
                *force = *force + *weight * ((sums[0] + sums[1]) + (sums[2] + sums[3]));
            }
        }
        force
    }
}

/// A network with the weights of each neuron side by side.
#[derive(Clone, Debug)]
struct NetworkPoint {
    neurons: Vec<Neuron>,
    bias: [f64; 2],
    outputs: Vec<InputRange>,
}

#[derive(Clone, Debug)]
struct Neuron {
    inputs: [f64; 4],
    bias: f64,
    outputs: [f64; 2],
}

impl NetworkPoint {
    fn new(network: &Network) -> Self {
        let neuron = |n: usize| {
            let mut neuron = Neuron {
                inputs: [0.0; 4],
                bias: network.hidden_bias[n],
                outputs: [0.0; 2],
            };
            for (into, weight) in neuron.inputs.iter_mut().zip(&network.hidden_weights[n]) {
                *into = *weight;
            }
            for (into, weights) in neuron.outputs.iter_mut().zip(&network.output_weights) {
                *into = weights[n];
            }
            neuron
        };
        let mut bias = [0.0; 2];
        bias.iter_mut()
            .zip(&network.output_bias)
            .for_each(|(into, b)| *into = *b);
        Self {
            neurons: (0..network.neurons()).map(neuron).collect(),
            bias,
            outputs: network.outputs.clone(),
        }
    }

    fn force<S: HostScalar>(&self, u: [S; 4]) -> [S; 2] {
        let mut sums = self.bias.map(S::constant);
        for neuron in &self.neurons {
            let weighted = neuron.inputs.iter().zip(u);
            let argument = weighted.map(|(w, u)| S::constant(*w) * u);
            let argument = argument.fold(S::zero(), |sum, part| sum + part);
            let value = (argument + S::constant(neuron.bias)).tanh();
            for (sum, weight) in sums.iter_mut().zip(neuron.outputs) {
                *sum = *sum + S::constant(weight) * value;
            }
        }
        let mut force = [S::zero(); 2];
        for ((force, range), sum) in force.iter_mut().zip(&self.outputs).zip(sums) {
            *force = S::constant(range.center) + S::constant(range.half_range) * sum;
        }
        force
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn range(rng: &mut ChaCha8Rng) -> InputRange {
        InputRange {
            center: rng.random_range(-1.0..1.0),
            half_range: rng.random_range(0.5..2.0),
        }
    }

    fn weights(rng: &mut ChaCha8Rng, count: usize) -> Vec<f64> {
        (0..count).map(|_| rng.random_range(-1.0..1.0)).collect()
    }

    /// Random polynomials and networks of one and two axes.
    fn bases(rng: &mut ChaCha8Rng) -> Vec<Base> {
        let mut bases = Vec::new();
        for orders in [vec![3, 3, 3, 3], vec![1, 3, 0, 2], vec![3, 3], vec![2, 1]] {
            let terms = exponents(&orders).len();
            bases.push(Base::Polynomial(Polynomial {
                inputs: orders.iter().map(|_| range(rng)).collect(),
                coefficients: (0..orders.len() / 2).map(|_| weights(rng, terms)).collect(),
                orders,
            }));
        }
        for (axes, neurons) in [(1, 7), (2, 40)] {
            bases.push(Base::Network(Network {
                inputs: (0..2 * axes).map(|_| range(rng)).collect(),
                outputs: (0..axes).map(|_| range(rng)).collect(),
                hidden_weights: (0..neurons).map(|_| weights(rng, 2 * axes)).collect(),
                hidden_bias: weights(rng, neurons),
                output_weights: (0..axes).map(|_| weights(rng, neurons)).collect(),
                output_bias: weights(rng, axes),
            }));
        }
        bases
    }

    #[test]
    fn point_by_point_equals_whole_records() {
        let seed = 31;
        println!("seed {seed}");
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        for base in bases(&mut rng) {
            let inputs = base.inputs().len();
            let states: Vec<Vec<f64>> = (0..inputs)
                .map(|_| (0..500).map(|_| rng.random_range(-2.0..2.0)).collect())
                .collect();
            let slices: Vec<&[f64]> = states.iter().map(Vec::as_slice).collect();
            let expected = base.predict(&slices).unwrap();
            let name = base.name();
            let evaluator: Evaluator = Evaluator::of_base(&base, |_, value| value);
            let mut largest = 0.0_f64;
            for row in 0..500 {
                // What stands in the places of an axis that is not there must not matter.
                let mut state = [1e3; 4];
                for (value, series) in state.iter_mut().zip(&states) {
                    *value = series[row];
                }
                let force = evaluator.force_at(&state);
                for (axis, expected) in expected.iter().enumerate() {
                    let size = expected.iter().fold(1.0_f64, |m, r| m.max(r.abs()));
                    largest = largest.max((force[axis] - expected[row]).abs() / size);
                }
                if inputs == 2 {
                    assert_eq!(force[1], 0.0);
                }
            }
            println!("{name} of {inputs} inputs: largest difference {largest:.1e} of full scale");
            assert!(largest < 1e-12, "{name}: {largest:e}");
        }
    }
}
