//! Random hidden weights to start from (Nguyen and Widrow, IJCNN 1990, III-21).
//!
//! Neuron h starts with a random direction of length 0.7·H^(1/d) for H neurons and d inputs within
//! ±1, and a random bias as large at most, so that the neurons' steep parts lie spread over the box
//! of inputs.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Hidden weights `[input][neuron]`, the biases last.
pub(super) fn weights(inputs: usize, neurons: usize, seed: u64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let length = 0.7 * (neurons as f64).powf(1.0 / inputs as f64);
    let mut weights = vec![0.0; (inputs + 1) * neurons];
    for neuron in 0..neurons {
        let direction: Vec<f64> = (0..inputs)
            .map(|_| StandardNormal.sample(&mut rng))
            .collect();
        let norm = direction.iter().map(|v: &f64| v * v).sum::<f64>().sqrt();
        for (input, v) in direction.iter().enumerate() {
            weights[input * neurons + neuron] = length * v / norm;
        }
        weights[inputs * neurons + neuron] = length * rng.random_range(-1.0..1.0);
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_have_the_length_and_seeds_differ() {
        let found = weights(4, 40, 3);
        assert_eq!(found.len(), 200);
        for neuron in 0..40 {
            let square: f64 = (0..4).map(|i| found[40 * i + neuron].powi(2)).sum();
            assert!((square.sqrt() - 0.7 * 40_f64.powf(0.25)).abs() < 1e-12);
        }
        assert_eq!(found, weights(4, 40, 3));
        assert_ne!(found, weights(4, 40, 4));
    }
}
