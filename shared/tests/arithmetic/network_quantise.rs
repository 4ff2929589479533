//! Bringing a network to integers: what cannot be held is named, and what can comes out at the best
//! scale.

use jointwatch_shared::base::Model;
use jointwatch_shared::base::network::{NEURONS, NetworkModel};
use jointwatch_shared::base::network_quantise::Weights;
use jointwatch_shared::fault::Error;
use jointwatch_shared::scalar::fixed::q31_from_f64;
use jointwatch_shared::selftest::reference_model;

/// A network of two axes and three neurons that a test may spoil.
#[derive(Clone)]
struct Sample {
    hidden: Vec<f64>,
    hidden_bias: Vec<f64>,
    output: [Vec<f64>; 2],
    output_bias: Vec<f64>,
}

fn sample() -> Sample {
    Sample {
        hidden: (0..12).map(|n| 0.3 * f64::from(n) - 1.7).collect(),
        hidden_bias: vec![0.5, -0.25, 0.0],
        output: [vec![12.0, -7.0, 3.0], vec![0.1, 0.2, -0.4]],
        output_bias: vec![5.0, -0.3],
    }
}

impl Sample {
    fn with<T>(&self, use_it: impl FnOnce(&Weights) -> T) -> T {
        let output = [&self.output[0][..], &self.output[1]];
        use_it(&Weights {
            hidden: &self.hidden,
            hidden_bias: &self.hidden_bias,
            output: &output,
            output_bias: &self.output_bias,
        })
    }

    fn refusal(&self) -> Error {
        self.with(|weights| NetworkModel::quantise(weights).unwrap_err())
    }
}

#[test]
fn every_weight_acts_in_its_own_place() {
    let u = [0.9, -0.8, 0.7, -0.6];
    for neuron in 0..NEURONS {
        for input in 0..4 {
            // tanh of one input through one neuron, with a weight of its own for each axis.
            let mut hidden = vec![0.0; 4 * NEURONS];
            hidden[4 * neuron + input] = 1.25;
            let (mut first, mut second) = (vec![0.0; NEURONS], vec![0.0; NEURONS]);
            (first[neuron], second[neuron]) = (12.5, -3.0);
            let weights = Weights {
                hidden: &hidden,
                hidden_bias: &[0.0; NEURONS],
                output: &[&first, &second],
                output_bias: &[1.0, 2.0],
            };
            let (model, outputs) = NetworkModel::quantise(&weights).unwrap();
            let forces = model.evaluate(&u.map(q31_from_f64));
            let wanted =
                [(12.5, 1.0), (-3.0, 2.0)].map(|(v, b)| v * f64::tanh(1.25 * u[input]) + b);
            for ((force, output), wanted) in forces.into_iter().zip(&outputs).zip(wanted) {
                let error = f64::from(force) * output.force_per_lsb - wanted;
                assert!(
                    error.abs() <= output.error_bound,
                    "{neuron}, {input}: {error:e}"
                );
                assert!(output.error_bound < 3e-8 * 13.5);
            }
        }
    }
}

#[test]
fn one_axis_reads_two_inputs_and_leaves_the_second_force_at_0() {
    let weights = Weights {
        hidden: &[1.0, -0.5, 0.25, 2.0],
        hidden_bias: &[0.1, -0.2],
        output: &[&[3.0, 4.0]],
        output_bias: &[-1.0],
    };
    let (model, outputs) = NetworkModel::quantise(&weights).unwrap();
    let [force, none] = model.evaluate(&[0.5, -0.25, 0.9, -0.9].map(q31_from_f64));
    let wanted = 3.0 * 0.725_f64.tanh() + 4.0 * (-0.575_f64).tanh() - 1.0;
    let error = f64::from(force) * outputs[0].force_per_lsb - wanted;
    assert!(error.abs() <= outputs[0].error_bound, "{error:e}");
    assert_eq!((none, outputs.len()), (0, 1));
}

#[test]
fn scales_use_the_whole_of_their_integers() {
    let mut steep = sample();
    // A neuron a thousand times steeper than the others leaves their scales alone.
    steep.hidden[8..].iter_mut().for_each(|w| *w *= 1000.0);
    let [gentle, steep] =
        [sample(), steep].map(|s| s.with(|w| NetworkModel::quantise(w).unwrap().0));
    assert_eq!(gentle.neurons()[..2], steep.neurons()[..2]);
    for neuron in steep.neurons() {
        let sizes = neuron.weights.map(|w| u128::from(w.unsigned_abs()));
        let largest = (sizes.iter().sum::<u128>() << 31) + u128::from(neuron.bias.unsigned_abs());
        let word = sizes.iter().max().copied().unwrap_or(0);
        let used = (largest as f64 / 2_f64.powi(63)).max(word as f64 / 2_f64.powi(31));
        // Either the sum or a word is at its rail, but for the steps, which are a whole number.
        let least = 1.0 - 1.01 / f64::from(neuron.steps);
        assert!((least..1.0).contains(&used), "{neuron:?}: {used}");
    }
}

#[test]
fn what_cannot_be_held_is_named() {
    for bad in [f64::NAN, f64::INFINITY, -2e7] {
        let mut invalidated = sample();
        invalidated.hidden[6] = bad;
        let refusal = invalidated.refusal().to_string();
        let wanted =
            format!("the weight of an input of neuron 1 is {bad}, which the model cannot hold");
        assert_eq!(refusal, wanted);
        let mut invalidated = sample();
        invalidated.hidden_bias[2] = bad;
        assert!(
            invalidated
                .refusal()
                .to_string()
                .starts_with("the bias of neuron 2 is")
        );
    }
    for bad in [f64::NAN, 1e61] {
        let mut invalidated = sample();
        invalidated.output[1][0] = bad;
        assert!(
            invalidated
                .refusal()
                .to_string()
                .starts_with("the output weight of neuron 0 is")
        );
        let mut invalidated = sample();
        invalidated.output_bias[1] = bad;
        assert!(
            invalidated
                .refusal()
                .to_string()
                .starts_with("output bias of the network is")
        );
    }
    let mut tiny = sample();
    tiny.output[0].iter_mut().for_each(|v| *v *= 1e-60);
    tiny.output_bias[0] = 0.0;
    assert!(
        matches!(tiny.refusal(), Error::OutOfRange { .. }),
        "{}",
        tiny.refusal()
    );
}

#[test]
fn parts_that_do_not_fit_together_are_refused() {
    type Spoil = fn(&mut Sample);
    let spoil: [(Spoil, &str); 4] = [
        (
            |s| s.hidden.truncate(11),
            "the network has 11 hidden weights, but its neurons and axes ask for 12",
        ),
        (
            |s| s.output[1].push(1.0),
            "the network has 4 output weights of an axis, but its neurons and axes ask for 3",
        ),
        (
            |s| s.output_bias.truncate(1),
            "the network has 1 output biases, but its neurons and axes ask for 2",
        ),
        (
            |s| s.hidden_bias.resize(41, 0.0),
            "number of neurons is 41, but has to lie between 1 and 40",
        ),
    ];
    for (spoil, wanted) in spoil {
        let mut sample = sample();
        spoil(&mut sample);
        assert_eq!(sample.refusal().to_string(), wanted);
    }
    // Two axes in the header, one in the base.
    let weights = Weights {
        hidden: &[1.0, 1.0],
        hidden_bias: &[0.0],
        output: &[&[1.0]],
        output_bias: &[0.0],
    };
    let any = [f64::INFINITY; 2];
    let refusal = Model::from_network(reference_model().header().clone(), &weights, &any);
    assert!(refusal.is_err(), "{refusal:?}");
}

#[test]
fn extreme_forces_and_an_axis_of_zeros_keep_their_relative_error() {
    for size in [1e-45, 1e-3, 1e9, 1e55] {
        let mut scaled = sample();
        scaled.output[0].iter_mut().for_each(|v| *v *= size);
        scaled.output_bias[0] *= size;
        scaled.output[1].fill(0.0);
        scaled.output_bias[1] = 0.0;
        let (model, outputs) = scaled.with(|w| NetworkModel::quantise(w).unwrap());
        assert!(outputs[0].error_bound < 4e-8 * 27.0 * size, "{size:e}");
        assert_eq!(outputs[1].force_per_lsb, 1.0);
        assert_eq!(model.evaluate(&[1 << 30; 4])[1], 0);
    }
}

#[test]
fn a_bound_over_its_budget_names_axis_and_neuron() {
    let mut invalidated = sample();
    invalidated.output[1][1] = 60.0;
    let header = reference_model().header().clone();
    let refusal =
        invalidated.with(|w| Model::from_network(header.clone(), w, &[1e-5, 1e-9]).unwrap_err());
    let Error::NetworkBudget {
        axis: 1,
        neuron: 1,
        weight,
        reach,
        ..
    } = refusal
    else {
        panic!("{refusal}");
    };
    assert_eq!((weight, (reach * 1e6).round()), (60.0, 1.45e6));
    assert!(
        refusal.to_string().contains("neuron 1 costs most, "),
        "{refusal}"
    );
    assert!(
        invalidated
            .with(|w| Model::from_network(header, w, &[1e-5; 2]))
            .is_ok()
    );
}
