//! Whether training does what its formulas say: derivatives, the eliminated output layer, a known
//! network, refusals, interruption.

use super::hidden_layer::Pass;
use super::projection::{Curvature, OutputLayer};
use super::rows::{Piece, Rows};
use super::*;
use crate::model::Network;
use crate::study::{AxisKind, Controller, Convention};
use faer::Mat;
use faer::prelude::Solve;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// A number and its derivative by one weight.
#[derive(Clone, Copy)]
struct Dual {
    value: f64,
    slope: f64,
}

impl Dual {
    fn plus(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            slope: self.slope + other.slope,
        }
    }

    fn times(self, factor: f64) -> Self {
        Self {
            value: factor * self.value,
            slope: factor * self.slope,
        }
    }

    fn tanh(self) -> Self {
        let value = self.value.tanh();
        Self {
            value,
            slope: self.slope / self.value.cosh().powi(2),
        }
    }
}

/// Outputs of a row and their derivatives by hidden weight `by`.
fn outputs(x: &[f64], weights: &[f64], output: &Mat<f64>, by: usize) -> Vec<Dual> {
    let neurons = output.nrows() - 1;
    let weight = |index: usize| Dual {
        value: weights[index],
        slope: f64::from(u8::from(index == by)),
    };
    let constant = |value: f64| Dual { value, slope: 0.0 };
    let hidden: Vec<Dual> = (0..neurons)
        .map(|h| {
            let bias = weight(x.len() * neurons + h);
            let inputs = x.iter().enumerate();
            let sum = inputs.fold(bias, |sum, (j, x)| {
                sum.plus(weight(j * neurons + h).times(*x))
            });
            sum.tanh()
        })
        .collect();
    (0..output.ncols())
        .map(|k| {
            let neurons = hidden.iter().enumerate();
            neurons.fold(constant(output[(hidden.len(), k)]), |sum, (h, value)| {
                sum.plus(value.times(output[(h, k)]))
            })
        })
        .collect()
}

fn random_rows(inputs: usize, outputs: usize, count: usize, seed: u64) -> Rows {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut series = || -> Vec<f64> { (0..count).map(|_| rng.random_range(-1.0..1.0)).collect() };
    let states: Vec<Vec<f64>> = (0..inputs).map(|_| series()).collect();
    let forces: Vec<Vec<f64>> = (0..outputs).map(|_| series()).collect();
    let unit = InputRange {
        center: 0.0,
        half_range: 1.0,
    };
    let piece = Piece {
        states: states.iter().map(Vec::as_slice).collect(),
        forces: forces.iter().map(Vec::as_slice).collect(),
    };
    Rows::new(&[piece], &vec![unit; inputs], &vec![unit; outputs], count)
}

fn largest(matrix: &Mat<f64>) -> f64 {
    matrix.norm_max()
}

/// Gradient, reduced curvature, trace and determinant against the Jacobian of all weights from dual
/// numbers.
#[test]
fn derivatives_and_elimination_agree_with_dual_numbers() {
    // More rows than a block; a number of neurons that fills no register.
    for (inputs, axes, neurons, count) in [(4, 2, 7, 300), (2, 1, 3, 40)] {
        let rows = random_rows(inputs, axes, count, 61);
        let weights = start::weights(inputs, neurons, 62);
        let mut pass = Pass::new(&rows, neurons);
        let ridge = 0.3;
        let layer = OutputLayer::solve(&pass.outer(&weights, count), ridge).unwrap();
        let (inner, values) = (weights.len(), neurons + 1);
        // Rows of the Jacobian: residual by residual; columns: hidden weights, then the output
        // layers one after the other.
        let all = inner + values * axes;
        let mut jacobian = Mat::<f64>::zeros(count * axes, all);
        let mut residual = Mat::<f64>::zeros(count * axes, 1);
        for row in 0..count {
            let x = &rows.x[row * inputs..(row + 1) * inputs];
            for by in 0..inner {
                for (k, y) in outputs(x, &weights, &layer.weights, by).iter().enumerate() {
                    jacobian[(row * axes + k, by)] = y.slope;
                    residual[(row * axes + k, 0)] = rows.y[row * axes + k] - y.value;
                }
            }
            for k in 0..axes {
                for h in 0..values {
                    // By the output weight itself: what the output gains when that weight grows by
                    // one.
                    let mut grown = layer.weights.clone();
                    grown[(h, k)] += 1.0;
                    let gain = outputs(x, &weights, &grown, 0)[k].value
                        - outputs(x, &weights, &layer.weights, 0)[k].value;
                    jacobian[(row * axes + k, inner + k * values + h)] = gain;
                }
            }
        }
        let squares: f64 = layer.squared_errors.iter().sum();
        assert!((residual.squared_norm_l2() / squares - 1.0).abs() < 1e-11);
        let descent = jacobian.transpose() * &residual;
        let gradient = pass.gradient(&weights, layer.weights.as_ref(), count);
        for (i, found) in gradient.iter().enumerate() {
            assert!((found - descent[(i, 0)]).abs() < 1e-11 * largest(&descent).max(1.0));
        }
        // The output layer is where its own gradient ends: Jᵀr = ρ·c.
        for k in 0..axes {
            for h in 0..values {
                let left = descent[(inner + k * values + h, 0)] - ridge * layer.weights[(h, k)];
                assert!(left.abs() < 1e-10, "{left}");
            }
        }
        let mut full = jacobian.transpose() * &jacobian;
        for i in inner..all {
            full[(i, i)] += ridge;
        }
        let outer = full
            .submatrix(inner, inner, all - inner, all - inner)
            .to_owned();
        let mixed = full.submatrix(0, inner, inner, all - inner).to_owned();
        let eliminated = outer.partial_piv_lu().solve(mixed.transpose().to_owned());
        let expected = full.submatrix(0, 0, inner, inner) - &mixed * &eliminated;
        let sums = pass.curvature(&weights, count);
        let curvature = Curvature::new(&sums, 1.0, &layer.weights, ridge).unwrap();
        assert!(largest(&(&curvature.reduced - &expected)) < 1e-10 * largest(&expected));
        for i in 0..inner {
            full[(i, i)] += ridge;
        }
        let spread = curvature.spread(ridge).unwrap();
        let inverse = full.partial_piv_lu().solve(Mat::<f64>::identity(all, all));
        let trace: f64 = (0..all).map(|i| inverse[(i, i)]).sum();
        assert!(
            (spread.trace / trace - 1.0).abs() < 1e-9,
            "{spread:?} {trace}"
        );
        let eigenvalues = full.self_adjoint_eigenvalues(faer::Side::Lower).unwrap();
        let log_det: f64 = eigenvalues.iter().map(|e| e.ln()).sum();
        assert!((spread.log_det - log_det).abs() < 1e-9 * log_det.abs());
    }
}

fn axis(name: &str) -> Axis {
    Axis {
        name: name.into(),
        kind: AxisKind::Translation,
        inertia: Some(0.0),
        restoring_force: Convention::default(),
        ground_stiffness: 0.0,
        ground_damping: 0.0,
        controller: Controller::default(),
        encoder_step: None,
        velocity_alone: false,
        integrated_above_hz: None,
    }
}

/// A record of one axis that wanders over its states; `force` of displacement and velocity.
fn record(rows: usize, force: impl Fn(f64, f64) -> f64) -> Motion {
    let series = |rate: f64, phase: f64| -> Vec<f64> {
        (0..rows).map(|i| (rate * i as f64 + phase).sin()).collect()
    };
    let (x, v) = (series(0.0731, 0.3), series(0.1173, 1.1));
    let r = x.iter().zip(&v).map(|(x, v)| force(*x, *v)).collect();
    Motion {
        still: Vec::new(),
        before: Vec::new(),
        inputs: Vec::new(),
        record: 0,
        first_row: 0,
        sample_rate_hz: 1000.0,
        states: vec![x, v],
        ground: vec![None],
        acceleration: vec![vec![0.0; rows]],
        force: vec![r],
    }
}

fn fit(
    motion: &Motion,
    options: &NetworkOptions,
    watch: &TrainingObserver<'_>,
) -> Result<NetworkFit> {
    fit_network(&[axis("x")], &[motion], &[], options, watch)
}

fn silent(stop: &AtomicBool) -> TrainingObserver<'_> {
    TrainingObserver {
        progress: &|_| (),
        stop,
    }
}

fn options(neurons: usize) -> NetworkOptions {
    NetworkOptions {
        neurons: Neurons::Fixed(neurons),
        restarts: 3,
        ..NetworkOptions::default()
    }
}

#[test]
fn a_force_that_is_a_network_is_found() {
    let motion = record(4000, |x, v| {
        40.0 * (2.0 * x - 0.5 * v + 0.2).tanh() - 25.0 * (1.5 * v + 0.4).tanh() + 3.0
    });
    let stop = AtomicBool::new(false);
    let longer = NetworkOptions {
        tolerance: 1e-4,
        steps_per_stage: 100,
        ..options(2)
    };
    let fit = fit(&motion, &longer, &silent(&stop)).unwrap();
    let best = &fit.restarts[fit.best];
    println!("{:?}, {:?}", best.training_nmse_percent, best.stop);
    assert!(best.training_nmse_percent[0] < 1e-9);
    assert!(best.effective_parameters > 8.5 && fit.network.parameters() == 9);
    assert!(!fit.interrupted && fit.begun_anew == 0);
    // CPU time and rows only grow, and the last point is the result.
    assert!(
        best.trace
            .is_sorted_by(|a, b| a.cpu_s <= b.cpu_s && a.rows <= b.rows)
    );
    assert_eq!(best.trace.last().unwrap().network, best.network);
    let states: Vec<&[f64]> = motion.states.iter().map(Vec::as_slice).collect();
    let predicted = &best.network.predict(&states).unwrap()[0];
    let worst = predicted.iter().zip(&motion.force[0]);
    let worst = worst.fold(0.0_f64, |worst, (p, r)| worst.max((p - r).abs()));
    assert!(worst < 1e-3, "{worst}");
}

#[test]
fn noise_is_not_learnt() {
    // Two neurons make the force; of forty offered, the evidence must hold back most.
    let mut rng = ChaCha8Rng::seed_from_u64(63);
    let noise: Vec<f64> = (0..3000).map(|_| rng.random_range(-6.0..6.0)).collect();
    let mut motion = record(3000, |x, v| 40.0 * (2.0 * x - 0.5 * v).tanh());
    let clean = motion.force[0].clone();
    for (force, noise) in motion.force[0].iter_mut().zip(&noise) {
        *force += noise;
    }
    let stop = AtomicBool::new(false);
    let fit = fit(&motion, &options(40), &silent(&stop)).unwrap();
    let best = &fit.restarts[fit.best];
    let states: Vec<&[f64]> = motion.states.iter().map(Vec::as_slice).collect();
    let predicted = &best.network.predict(&states).unwrap()[0];
    let square = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    let share = square(predicted, &clean) / square(&motion.force[0], &clean);
    println!(
        "γ = {:.1}, noise learnt {share:.4}",
        best.effective_parameters
    );
    assert!(best.effective_parameters < 60.0);
    assert!(share < 60.0 / 3000.0);
}

#[test]
fn an_interrupted_training_keeps_its_weights() {
    let motion = record(4000, |x, v| x.powi(3) + (5.0 * v).tanh());
    let stop = AtomicBool::new(false);
    let steps = AtomicUsize::new(0);
    let watch = TrainingObserver {
        progress: &|progress| {
            assert!(progress.share_done > 0.0 && progress.share_done <= 1.0);
            if steps.fetch_add(1, Ordering::Relaxed) == 4 {
                stop.store(true, Ordering::Relaxed);
            }
        },
        stop: &stop,
    };
    let one = NetworkOptions {
        restarts: 1,
        ..options(10)
    };
    let fit = fit(&motion, &one, &watch).unwrap();
    assert!(fit.interrupted);
    assert_eq!(fit.restarts[0].stop, Stop::GaveUp(GaveUp::Interrupted));
    assert!(fit.warnings.iter().any(|w| w.contains("interrupted")));
    assert!(fit.restarts[0].training_nmse_percent[0] < 50.0);
    fit.network.check().unwrap();
}

#[test]
fn what_cannot_be_trained_on_is_refused_in_one_sentence() {
    let stop = AtomicBool::new(false);
    let refused = |motion: &Motion, options: &NetworkOptions, exit: u8, part: &str| {
        let error = fit(motion, options, &silent(&stop)).expect_err("refused");
        println!("{error}");
        assert_eq!(error.exit_code(), exit);
        assert!(
            error.sentence.contains(part) && !error.sentence.contains('\n'),
            "{error}"
        );
    };
    let good = |rows| record(rows, |x, _| x);
    refused(&record(500, |_, _| 0.1), &options(5), 3, "nothing to learn");
    refused(
        &good(100),
        &options(40),
        3,
        "100 training rows cannot determine the 161 weights",
    );
    refused(
        &record(500, |x, _| 1.5e308 * x),
        &options(5),
        3,
        "too far to compute with",
    );
    refused(
        &record(500, |x, _| (x - 0.99).sqrt()),
        &options(5),
        3,
        "not finite at row",
    );
    refused(&good(500), &options(0), 2, "1 to 200 neurons");
    let none = NetworkOptions {
        restarts: 0,
        ..options(5)
    };
    refused(&good(500), &none, 2, "restarts");
    let auto = NetworkOptions {
        neurons: Neurons::Auto,
        ..options(5)
    };
    refused(
        &good(30),
        &auto,
        3,
        "too few for the 21 weights of 5 neurons",
    );
    assert!(fit_network(&[axis("x")], &[], &[], &options(5), &silent(&stop)).is_err());
}

#[test]
fn exchanged_neurons_are_no_disagreement() {
    let motion = record(600, |x, v| x + 0.3 * v);
    let stop = AtomicBool::new(false);
    let mut fit = fit(&motion, &options(2), &silent(&stop)).unwrap();
    let exchange = |network: &Network| Network {
        hidden_weights: network
            .hidden_weights
            .iter()
            .rev()
            .map(|row| row.iter().map(|w| -w).collect())
            .collect(),
        hidden_bias: network.hidden_bias.iter().rev().map(|b| -b).collect(),
        output_weights: network
            .output_weights
            .iter()
            .map(|row| row.iter().rev().map(|w| -w).collect())
            .collect(),
        ..network.clone()
    };
    let mut other = fit.restarts[0].clone();
    other.network = exchange(&other.network);
    fit.restarts = vec![fit.restarts[0].clone(), other];
    assert!(fit.disagreement(&[&motion], None).unwrap()[0] < 1e-12);
    // Two restarts that differ by 2 everywhere: standard deviation √2 about their mean.
    fit.restarts[1].network = fit.restarts[0].network.clone();
    fit.restarts[0].network.outputs[0].center += 1.0;
    fit.restarts[1].network.outputs[0].center -= 1.0;
    let apart = fit.disagreement(&[&motion], None).unwrap()[0];
    let states: Vec<&[f64]> = motion.states.iter().map(Vec::as_slice).collect();
    let (up, down) = (
        fit.restarts[0].network.predict(&states).unwrap(),
        fit.restarts[1].network.predict(&states).unwrap(),
    );
    let mean = up[0]
        .iter()
        .zip(&down[0])
        .map(|(a, b)| (0.5 * (a + b)).powi(2));
    let rms = (mean.sum::<f64>() / 600.0).sqrt();
    assert!((apart * rms / 2.0_f64.sqrt() - 1.0).abs() < 1e-9);
}

#[test]
fn auto_takes_more_neurons_for_a_force_with_more_corners() {
    let stop = AtomicBool::new(false);
    let auto = NetworkOptions {
        neurons: Neurons::Auto,
        restarts: 2,
        ..NetworkOptions::default()
    };
    let simple = record(3000, |x, v| (x + 0.5 * v).tanh());
    let fit_simple = fit(&simple, &auto, &silent(&stop)).unwrap();
    let curve = fit_simple.size_curve.unwrap();
    println!("{curve:?}");
    assert_eq!(curve.left_out, LeftOut::Stretches);
    assert_eq!(curve.sizes.len(), 4);
    let rough = record(3000, |x, v| (9.0 * x).sin() * (5.0 * v).cos());
    let fit_rough = fit(&rough, &auto, &silent(&stop)).unwrap();
    let curve = fit_rough.size_curve.unwrap();
    println!("{curve:?}");
    let held_out = |i: usize| curve.sizes[i].mean_nmse_percent;
    assert!(held_out(3) < 0.5 * held_out(0));
    assert_eq!(fit_rough.network.neurons(), 40);
}
