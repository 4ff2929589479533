//! How fast a polynomial fit is: 30,000 rows × 256 terms × 2 outputs against a dense least-squares
//! solve, streaming, and prediction.
//!
//! `cargo bench -p jointwatch --bench fit`. Everything but the default fit's cross-validation runs
//! in one thread on both sides.

use criterion::{Criterion, Throughput};
use faer::linalg::solvers::SolveLstsq;
use faer::{Mat, Par};
use jointwatch::fit::least_squares::normal_equations;
use jointwatch::fit::moments::{Moments, Summation};
use jointwatch::fit::polynomial::{Method, PolynomialOptions, fit_polynomial};
use jointwatch::model::{InputRange, Polynomial, exponents};
use jointwatch::signal::motion::Motion;
use jointwatch::simulate::{SimulationOptions, simulate};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::hint::black_box;
use std::time::Instant;

const ROWS: usize = 30_000;
const RANGES: [InputRange; 4] = [InputRange {
    center: 0.0,
    half_range: 1.0,
}; 4];

/// A reproducible series between −1 and 1.
fn series(rows: usize, seed: u64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..rows).map(|_| rng.random_range(-1.0..1.0)).collect()
}

fn by_moments(inputs: &[&[f64]], outputs: &[&[f64]], terms: &[[u8; 4]]) -> Mat<f64> {
    let mut moments = Moments::new(4, outputs.len());
    Summation::new(&RANGES, outputs.len()).add(&mut moments, inputs, outputs);
    normal_equations::solve(&moments.gram(terms), &moments.cross(terms))
        .expect("random rows determine every term")
        .coefficients
}

/// The shortest of some runs, in seconds, and the last result.
fn shortest<T>(runs: usize, mut run: impl FnMut() -> T) -> (f64, Option<T>) {
    let mut best = f64::INFINITY;
    let mut last = None;
    for _ in 0..runs {
        let start = Instant::now();
        last = Some(black_box(run()));
        best = best.min(start.elapsed().as_secs_f64());
    }
    (best, last)
}

fn main() {
    // The dense solve would otherwise take every core.
    faer::set_global_parallelism(Par::Seq);
    let mut criterion = Criterion::default().configure_from_args().sample_size(10);
    let terms = exponents(&[3; 4]);
    let inputs: Vec<Vec<f64>> = (0..4).map(|i| series(ROWS, i)).collect();
    let outputs: Vec<Vec<f64>> = (4..6).map(|i| series(ROWS, i)).collect();
    let inputs: Vec<&[f64]> = inputs.iter().map(Vec::as_slice).collect();
    let outputs: Vec<&[f64]> = outputs.iter().map(Vec::as_slice).collect();
    let design = Mat::from_fn(ROWS, terms.len(), |row, t| {
        (0..4)
            .map(|i| inputs[i][row].powi(i32::from(terms[t][i])))
            .product::<f64>()
    });
    let right = Mat::from_fn(ROWS, 2, |row, y| outputs[y][row]);

    let (dense, reference) = shortest(3, || design.qr().solve_lstsq(&right));
    let (ours, found) = shortest(20, || by_moments(&inputs, &outputs, &terms));
    if let (Some(reference), Some(found)) = (reference, found) {
        println!(
            "fit of {ROWS} rows × 256 terms × 2 outputs, one thread, best run: dense solve {:.1} ms, moments {:.2} ms, \
             {:.0} times faster; coefficients differ by {:.1e} of the largest",
            1e3 * dense,
            1e3 * ours,
            dense / ours,
            (&reference - &found).norm_max() / reference.norm_max()
        );
    }

    let mut group = criterion.benchmark_group("fit 30000 x 256 x 2");
    group.bench_function("moments", |b| {
        b.iter(|| by_moments(&inputs, &outputs, &terms));
    });
    group.bench_function("dense least squares", |b| {
        b.iter(|| design.qr().solve_lstsq(&right));
    });
    group.finish();

    let mut group = criterion.benchmark_group("rows");
    group.throughput(Throughput::Elements(ROWS as u64));
    let mut summation = Summation::new(&RANGES, 2);
    let mut moments = Moments::new(4, 2);
    group.bench_function("streaming", |b| {
        b.iter(|| summation.add(&mut moments, &inputs, &outputs));
    });
    let polynomial = Polynomial {
        orders: vec![3; 4],
        inputs: RANGES.to_vec(),
        coefficients: (0..2).map(|axis| series(256, axis)).collect(),
    };
    group.bench_function("prediction of both axes", |b| {
        b.iter(|| polynomial.predict(&inputs));
    });
    group.finish();

    let simulation = simulate(&SimulationOptions::default()).expect("the default rig runs");
    let motions: Vec<Motion> = (0..3)
        .map(|i| simulation.truth[i].motion(i, simulation.study.sample_rate_hz))
        .collect();
    let motions: Vec<&Motion> = motions.iter().collect();
    let mut group = criterion.benchmark_group("whole fit of three records");
    for (name, method) in [
        ("least squares", Method::LeastSquares),
        ("default", Method::Ridge),
        ("select", Method::Select),
    ] {
        let options = PolynomialOptions {
            method,
            ..PolynomialOptions::default()
        };
        group.bench_function(name, |b| {
            b.iter(|| fit_polynomial(&simulation.study.axes, &motions, &[], &options, &|_| ()));
        });
    }
    group.finish();
    criterion.final_summary();
}
