//! A fixed network for the self-test: 40 neurons for two axes, made from a fixed seed by integers
//! alone; it lies in flash.

use crate::base::network::{HALF, NEURONS, NetworkModel, Neuron};
use crate::base::{Base, Model};
use crate::selftest::{Points, reference};
use heapless::Vec;

/// A two-axis network of all 40 neurons, of which every one has another scale.
pub fn reference_network() -> &'static Model {
    &REFERENCE
}

static REFERENCE: Model = reference(
    Base::Network(NetworkModel {
        axes: 2,
        neurons: Vec::from_array(reference_neurons()),
        output_bias: [(-3 << 56) + HALF, (1 << 58) + HALF],
    }),
    REFERENCE_BOUNDS,
);

/// The bounds of the reference network's error, in its force units; a test compares them with the
/// computed ones.
const REFERENCE_BOUNDS: [f64; 2] = [9.6, 10.8];

/// Words of both signs, as large as the sums allow, and from 400 to 4300 table steps per 2³² units
/// of the argument: full scale of a neuron stands for tanh arguments between 6 and 67.
const fn reference_neurons() -> [Neuron; NEURONS] {
    let mut points = Points::new(2);
    let mut neurons = [Neuron {
        weights: [0; 4],
        outputs: [0; 2],
        bias: HALF,
        steps: 400,
    }; NEURONS];
    let mut number = 0;
    while number < NEURONS {
        let [a, b, c, d] = points.next_point();
        let [bias, v, w, _] = points.next_point();
        let neuron = &mut neurons[number];
        neuron.weights = [a >> 2, b >> 2, c >> 2, d >> 2];
        neuron.outputs = [v >> 5, w >> 5];
        neuron.bias += (bias as i64) << 29;
        neuron.steps += 100 * number as u32;
        number += 1;
    }
    neurons
}
