//! What a network gains over the polynomial and what that costs: validation errors, training times
//! and prediction, in one run.
//!
//! `cargo bench -p jointwatch --bench network` prints the tables of docs/notebook/fits.md. Five
//! data seeds of the default rig, logs with encoder counts, without and with sensor noise, through
//! the same filters as a user's; NMSE in percent on the validation record in the common band. Every
//! training runs in one thread; times are CPU seconds of it.

use cpu_time::ThreadTime;
use faer::Par;
use jointwatch::fit::least_squares::normal_equations;
use jointwatch::fit::moments::{Moments, Summation};
use jointwatch::fit::network::{NetworkFit, NetworkOptions, TrainingObserver, fit_network};
use jointwatch::fit::polynomial::{Method, PolynomialOptions, fit_polynomial};
use jointwatch::model::{Polynomial, exponents};
use jointwatch::paper::Spread;
use jointwatch::signal::filters::Filters;
use jointwatch::signal::motion::{Motion, low_pass, motions};
use jointwatch::simulate::{SimulationOptions, simulate};
use jointwatch::study::{Axis, Role};
use jointwatch::text::error::Result;
use std::hint::black_box;
use std::sync::atomic::AtomicBool;

const SEEDS: u64 = 5;

/// CPU seconds of this thread in the shortest of some runs.
fn shortest<T>(runs: usize, mut run: impl FnMut() -> T) -> f64 {
    (0..runs)
        .map(|_| {
            let start = ThreadTime::now();
            black_box(run());
            start.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min)
}

fn spread(values: &[f64]) -> Spread {
    Spread::of(values.iter().copied()).expect("values")
}

fn slices(series: &[Vec<f64>]) -> Vec<&[f64]> {
    series.iter().map(Vec::as_slice).collect()
}

/// Restoring force per axis; the simulator states every inertia.
fn forces(axes: &[Axis], motion: &Motion) -> Vec<Vec<f64>> {
    let axes = axes.iter().enumerate();
    axes.map(|(i, axis)| {
        motion.restoring_force(i, axis.inertia.unwrap_or(0.0), axis.restoring_force)
    })
    .collect()
}

/// NMSE per axis in the common band, percent.
fn nmse(axes: &[Axis], motion: &Motion, predicted: &[Vec<f64>], band: &[f64]) -> [f64; 2] {
    let forces = forces(axes, motion);
    std::array::from_fn(|i| {
        let measured = low_pass(&forces[i], band);
        let predicted = low_pass(&predicted[i], band);
        let mean = measured.iter().sum::<f64>() / measured.len() as f64;
        let spread: f64 = measured.iter().map(|r| (r - mean).powi(2)).sum();
        let pairs = measured.iter().zip(&predicted);
        100.0 * pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>() / spread
    })
}

/// All that is known of one data seed.
struct Outcome {
    plain: [f64; 2],
    ridge: [f64; 2],
    network: [f64; 2],
    /// CPU seconds per restart.
    cpu_s: Vec<f64>,
    /// Per restart: CPU seconds to an error 16 times below the plain polynomial's on both axes;
    /// infinite if never.
    sixteenth_s: Vec<f64>,
    /// From rows to the 256 coefficients per axis, s.
    polynomial_s: f64,
    fit: NetworkFit,
    polynomial: Polynomial,
    states: Vec<Vec<f64>>,
}

fn outcome(seed: u64, snr_db: Option<f64>) -> Result<Outcome> {
    let study = simulate(&SimulationOptions {
        seed,
        snr_db,
        ..SimulationOptions::default()
    })?
    .study;
    let filters = Filters::design(&study)?;
    let motions = motions(&study, &filters)?;
    let axes = &study.axes;
    let (training, validation): (Vec<&Motion>, Vec<&Motion>) = motions
        .iter()
        .partition(|motion| study.records[motion.record].role == Role::Train);
    let held = validation[0];
    let states = slices(&held.states);
    let by = |method| -> Result<(Polynomial, [f64; 2])> {
        let options = PolynomialOptions {
            method,
            ..PolynomialOptions::default()
        };
        let fit = fit_polynomial(axes, &training, &filters.band, &options, &|_| ())?;
        let error = nmse(axes, held, &fit.polynomial.predict(&states)?, &filters.band);
        Ok((fit.polynomial, error))
    };
    let (polynomial, plain) = by(Method::LeastSquares)?;
    let (_, ridge) = by(Method::Ridge)?;

    let stop = AtomicBool::new(false);
    let watch = TrainingObserver {
        progress: &|_| (),
        stop: &stop,
    };
    let options = NetworkOptions::default();
    let fit = fit_network(axes, &training, &filters.band, &options, &watch)?;
    let error = |network: &jointwatch::model::Network| -> Result<[f64; 2]> {
        Ok(nmse(axes, held, &network.predict(&states)?, &filters.band))
    };
    let mut sixteenth_s = Vec::new();
    for restart in &fit.restarts {
        let mut reached = f64::INFINITY;
        for point in &restart.trace {
            let now = error(&point.network)?;
            if now
                .iter()
                .zip(plain)
                .all(|(now, plain)| 16.0 * now <= plain)
            {
                reached = point.cpu_s;
                break;
            }
        }
        sixteenth_s.push(reached);
    }

    let outputs: Vec<Vec<Vec<f64>>> = training.iter().map(|m| forces(axes, m)).collect();
    let terms = exponents(&[3; 4]);
    let polynomial_s = shortest(10, || {
        let mut moments = Moments::new(4, 2);
        let mut summation = Summation::new(&polynomial.inputs, 2);
        for (motion, forces) in training.iter().zip(&outputs) {
            summation.add(&mut moments, &slices(&motion.states), &slices(forces));
        }
        normal_equations::solve(&moments.gram(&terms), &moments.cross(&terms))
    });
    Ok(Outcome {
        plain,
        ridge,
        network: error(&fit.network)?,
        cpu_s: fit.restarts.iter().map(|r| r.cpu_s).collect(),
        sixteenth_s,
        polynomial_s,
        states: held.states.clone(),
        fit,
        polynomial,
    })
}

fn main() -> Result<()> {
    faer::set_global_parallelism(Par::Seq);
    let mut last = None;
    for (name, snr_db) in [("without noise", None), ("60 dB", Some(60.0))] {
        println!("\n### Seeds 1 to {SEEDS}, {name}\n");
        println!(
            "| seed | plain x / φ | ridge x / φ | network x / φ | plain ÷ network x / φ | ridge ÷ network x / φ | CPU s per restart | CPU s to a sixteenth | ÷ polynomial fit |"
        );
        println!("|---|---|---|---|---|---|---|---|---|");
        let mut gains: [Vec<f64>; 4] = Default::default();
        for seed in 1..=SEEDS {
            let o = outcome(seed, snr_db)?;
            let ratio = |of: [f64; 2]| [of[0] / o.network[0], of[1] / o.network[1]];
            let (plain, ridge) = (ratio(o.plain), ratio(o.ridge));
            let all = [plain[0], plain[1], ridge[0], ridge[1]];
            for (gains, gain) in gains.iter_mut().zip(all) {
                gains.push(gain);
            }
            let [cpu_s, sixteenth_s] = [&o.cpu_s, &o.sixteenth_s].map(|times| spread(times));
            println!(
                "| {seed} | {:.2} / {:.2} | {:.2} / {:.2} | {:.3} / {:.3} | {:.0} / {:.0} | {:.0} / {:.0} | {:.2} to {:.2} | {:.3} to {:.3} | {:.0} to {:.0} |",
                o.plain[0],
                o.plain[1],
                o.ridge[0],
                o.ridge[1],
                o.network[0],
                o.network[1],
                plain[0],
                plain[1],
                ridge[0],
                ridge[1],
                cpu_s.least,
                cpu_s.most,
                sixteenth_s.least,
                sixteenth_s.most,
                sixteenth_s.least / o.polynomial_s,
                sixteenth_s.most / o.polynomial_s,
            );
            last = Some(o);
        }
        let words = ["plain on x", "plain on φ", "ridge on x", "ridge on φ"];
        let clauses: Vec<String> = words
            .iter()
            .zip(&gains)
            .map(|(name, gains)| {
                let gains = spread(gains);
                format!("{name} {:.0}, least {:.0}", gains.median, gains.least)
            })
            .collect();
        println!(
            "\nError over network error, median: {}.",
            clauses.join("; ")
        );
    }
    if let Some(o) = last {
        let states = slices(&o.states);
        let rows = o.states[0].len() as f64;
        let network = shortest(50, || o.fit.network.predict(&states));
        let polynomial = shortest(50, || o.polynomial.predict(&states));
        println!(
            "\nPrediction of both axes, one thread, best run: network of {} neurons {:.1} M rows/s, polynomial {:.1} M rows/s.",
            o.fit.network.neurons(),
            1e-6 * rows / network,
            1e-6 * rows / polynomial
        );
    }
    Ok(())
}
