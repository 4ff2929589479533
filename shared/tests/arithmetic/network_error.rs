//! How far the integer network is from its `f64` original: measured over families of networks,
//! against bound and budget.
//!
//! `cargo test --release -p jointwatch-shared --test network_error -- --nocapture` prints the table
//! of docs/explanation/numerics.md.

use jointwatch_shared::base::Output;
use jointwatch_shared::base::network::{NEURONS, NetworkModel};
use jointwatch_shared::base::network_quantise::Weights;
use jointwatch_shared::scalar::fixed::{q31_from_f64, q31_to_f64};
use jointwatch_shared::selftest::{CORNER_POINTS, Points};

/// Random points per network.
const POINTS: u32 = 200_000;
/// What error and bound may be for weights of at most 2, as a share of the full scale.
const BUDGET: f64 = 5e-8;

/// A network in `f64`.
struct Network {
    hidden: Vec<f64>,
    hidden_bias: Vec<f64>,
    output: Vec<Vec<f64>>,
    output_bias: Vec<f64>,
}

/// A kind of network: its name, neurons, the sizes of its weights and of its output weights from
/// the neuron's number and a random number in [−1, 1), and whether no weight is above 2.
struct Family {
    name: &'static str,
    neurons: usize,
    hidden: fn(neuron: usize, random: f64) -> f64,
    output: fn(neuron: usize, random: f64) -> f64,
    at_most_2: bool,
}

const FAMILIES: [Family; 8] = [
    Family {
        name: "all up to 2",
        neurons: NEURONS,
        hidden: |_, random| 2.0 * random,
        output: |_, random| 2.0 * random,
        at_most_2: true,
    },
    Family {
        name: "all 2 in size",
        neurons: NEURONS,
        hidden: |_, random| 2.0_f64.copysign(random),
        output: |_, random| 2.0_f64.copysign(random),
        at_most_2: true,
    },
    Family {
        name: "gentle, up to 0.3",
        neurons: NEURONS,
        hidden: |_, random| 0.3 * random,
        output: |_, random| 2.0 * random,
        at_most_2: true,
    },
    Family {
        name: "7 neurons, up to 2",
        neurons: 7,
        hidden: |_, random| 2.0 * random,
        output: |_, random| 2.0 * random,
        at_most_2: true,
    },
    Family {
        name: "single neuron of 2",
        neurons: 1,
        hidden: |_, _| 2.0,
        output: |_, _| 2.0,
        at_most_2: true,
    },
    Family {
        name: "steep, up to 30",
        neurons: NEURONS,
        hidden: |_, random| 30.0 * random,
        output: |_, random| 2.0 * random,
        at_most_2: false,
    },
    Family {
        name: "one steep neuron of 300",
        neurons: NEURONS,
        hidden: |neuron, random| if neuron == 3 { 300.0 * random } else { random },
        output: |_, random| 2.0 * random,
        at_most_2: false,
    },
    Family {
        name: "pairs that cancel, of 50",
        neurons: NEURONS,
        hidden: |_, random| 0.8 + 0.1 * random,
        output: |neuron, random| {
            if neuron % 2 == 0 {
                50.0 + random
            } else {
                -50.0 + random
            }
        },
        at_most_2: false,
    },
];

/// A number in [−1, 1) of 32 random bits.
fn unit(points: &mut Points) -> f64 {
    q31_to_f64(points.next_word())
}

impl Network {
    fn of(family: &Family, axes: usize, seed: u64) -> Self {
        let mut points = Points::new(seed);
        let mut draw = |count: usize, per_neuron: usize, size: fn(usize, f64) -> f64| {
            let numbers = (0..count).map(|n| size(n / per_neuron, unit(&mut points)));
            numbers.collect::<Vec<f64>>()
        };
        Self {
            hidden: draw(2 * axes * family.neurons, 2 * axes, family.hidden),
            hidden_bias: draw(family.neurons, 1, family.hidden),
            // The force's unit is no power of two.
            output: (0..axes)
                .map(|_| draw(family.neurons, 1, family.output))
                .map(|values| values.into_iter().map(|v| 37.7 * v).collect())
                .collect(),
            output_bias: draw(axes, 1, |_, random| 37.7 * random),
        }
    }

    fn quantise(&self) -> (NetworkModel, Vec<Output>) {
        let output: Vec<&[f64]> = self.output.iter().map(Vec::as_slice).collect();
        let weights = Weights {
            hidden: &self.hidden,
            hidden_bias: &self.hidden_bias,
            output: &output,
            output_bias: &self.output_bias,
        };
        let (model, outputs) = NetworkModel::quantise(&weights).unwrap();
        (model, outputs.into_iter().collect())
    }

    /// The forces in `f64`.
    fn exact(&self, u: &[f64]) -> Vec<f64> {
        let rows = self.hidden.chunks_exact(u.len()).zip(&self.hidden_bias);
        let values: Vec<f64> = rows
            .map(|(row, bias)| row.iter().zip(u).map(|(w, u)| w * u).sum::<f64>() + bias)
            .map(f64::tanh)
            .collect();
        let outputs = self.output.iter().zip(&self.output_bias);
        outputs
            .map(|(row, bias)| row.iter().zip(&values).map(|(v, t)| v * t).sum::<f64>() + bias)
            .collect()
    }
}

/// What one axis of a network showed, in N.
#[derive(Clone, Default)]
struct Measured {
    largest: f64,
    squares: f64,
    corners: f64,
    force: f64,
}

/// Errors over random real inputs and over the corners and centres, and the largest force over all
/// of them.
fn measure(
    network: &Network,
    model: &NetworkModel,
    outputs: &[Output],
    seed: u64,
) -> Vec<Measured> {
    let mut found = vec![Measured::default(); outputs.len()];
    let mut points = Points::new(seed);
    // More bits than Q31 holds, so that the rounding of the inputs takes part.
    let mut random = || [0; 4].map(|_| unit(&mut points) + unit(&mut points) / 2_147_483_648.0);
    for n in 0..CORNER_POINTS + POINTS {
        let is_corner = n < CORNER_POINTS;
        let u = if is_corner {
            [27, 9, 3, 1].map(|place| f64::from(n / place % 3) - 1.0)
        } else {
            random()
        };
        let forces = model.evaluate(&u.map(q31_from_f64));
        let wanted = network.exact(&u[..2 * outputs.len()]);
        for (axis, found) in found.iter_mut().enumerate() {
            let seen = f64::from(forces[axis]) * outputs[axis].force_per_lsb;
            let error = (seen - wanted[axis]).abs();
            found.force = found.force.max(wanted[axis].abs());
            if is_corner {
                found.corners = found.corners.max(error);
            } else {
                found.largest = found.largest.max(error);
                found.squares += error * error;
            }
        }
    }
    found
}

/// Measures every family with `axes` axes and returns what breaks the bound or the budget.
fn table(axes: usize) -> Vec<String> {
    let mut broken = Vec::new();
    println!(
        "errors in 1e-9 of sum|v| + |b|, {axes} axes, {POINTS} random points and the corners and centres"
    );
    println!(
        "family | seed | axis | largest | RMS | corners | bound | largest of the largest force"
    );
    for (number, family) in FAMILIES.iter().enumerate() {
        for seed in [1, 2].map(|s| s + 10 * number as u64) {
            let network = Network::of(family, axes, seed);
            let (model, outputs) = network.quantise();
            let all = measure(&network, &model, &outputs, seed);
            for (axis, found) in all.iter().enumerate() {
                let sizes = network.output[axis].iter().map(|v| v.abs());
                let scale = sizes.sum::<f64>() + network.output_bias[axis].abs();
                let bound = outputs[axis].error_bound;
                let rms = (found.squares / f64::from(POINTS)).sqrt();
                let worst = found.largest.max(found.corners);
                let of = |x: f64| x / scale * 1e9;
                let line = format!(
                    "{} | {seed} | {axis} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2}",
                    family.name,
                    of(found.largest),
                    of(rms),
                    of(found.corners),
                    of(bound),
                    worst / found.force * 1e9,
                );
                println!("{line}");
                // Of the largest force that there could be, and of the largest that there was.
                let within = bound <= BUDGET * scale && worst <= BUDGET * found.force;
                if worst > bound || family.at_most_2 && !within {
                    broken.push(line);
                }
            }
        }
    }
    broken
}

#[test]
fn errors_stay_within_bound_and_budget() {
    let broken = [table(2), table(1)].concat();
    assert!(broken.is_empty(), "outside: {broken:#?}");
}
