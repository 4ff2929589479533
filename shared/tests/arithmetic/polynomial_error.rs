//! How far the integer polynomial is from its `f64` original: measured over families of models,
//! against bound and budget.
//!
//! `cargo test --release -p jointwatch-shared --test polynomial_error -- --nocapture` prints the
//! table of docs/explanation/numerics.md.

use jointwatch_shared::base::Output;
use jointwatch_shared::base::polynomial::PolynomialModel;
use jointwatch_shared::scalar::fixed::{q31_from_f64, q31_to_f64};
use jointwatch_shared::selftest::{CORNER_POINTS, Points};

/// Random points per model.
const POINTS: u32 = 1_000_000;
/// What the largest error may be, as a share of Σ|c|.
const BUDGET: f64 = 1e-8;

/// A kind of model: its name, and the coefficient of a term from its exponents and two random
/// numbers in [−1, 1).
struct Family {
    name: &'static str,
    coefficient: fn(exponents: [usize; 4], size: f64, choice: f64) -> f64,
}

const FAMILIES: [Family; 10] = [
    Family {
        name: "dense random",
        coefficient: |_, size, _| size,
    },
    Family {
        name: "sparse, one term in 25",
        coefficient: |e, size, choice| {
            if choice > 0.92 || e == [0; 4] {
                size
            } else {
                0.0
            }
        },
    },
    Family {
        name: "low orders dominate, 10^-degree",
        coefficient: |e, size, _| size * 0.1_f64.powi(e.iter().sum::<usize>() as i32),
    },
    Family {
        name: "low orders dominate, 3^-degree",
        coefficient: |e, size, _| size * 3.0_f64.powi(-(e.iter().sum::<usize>() as i32)),
    },
    Family {
        name: "alternating, growing with degree",
        coefficient: |e, size, _| {
            let degree = e.iter().sum::<usize>() as i32;
            (1.0 + 0.3 * size) * (-1.0_f64).powi(degree) * 1.5_f64.powi(degree)
        },
    },
    Family {
        name: "all equal",
        coefficient: |_, _, _| 1.0,
    },
    Family {
        name: "highest term dominates",
        coefficient: |e, size, _| if e == [3; 4] { 1.0 } else { 1e-5 * size },
    },
    Family {
        name: "constant dominates",
        coefficient: |e, size, _| if e == [0; 4] { 1.0 } else { 1e-5 * size },
    },
    Family {
        name: "one block dominates",
        coefficient: |e, size, _| if e[..2] == [3, 3] { 1.0 } else { 1e-5 * size },
    },
    Family {
        name: "single highest term",
        coefficient: |e, _, _| if e == [3; 4] { 1.0 } else { 0.0 },
    },
];

/// Σ c·x^i·ẋ^j·φ^k·φ̇^l in `f64`, by Horner's rule for one input after the other, the first first.
fn exact(coefficients: &[f64], u: &[f64]) -> f64 {
    let mut values = [0.0; 256];
    let mut left = coefficients.len();
    values[..left].copy_from_slice(coefficients);
    for x in u {
        left /= 4;
        let (first, rest) = values.split_at_mut(left);
        let (second, rest) = rest.split_at_mut(left);
        let (third, fourth) = rest.split_at_mut(left);
        for (((a, b), c), d) in first.iter_mut().zip(second).zip(third).zip(fourth) {
            *a += (*b + (*c + *d * x) * x) * x;
        }
    }
    values[0]
}

/// A number in [−1, 1) of 32 random bits.
fn unit(points: &mut Points) -> f64 {
    q31_to_f64(points.next_word())
}

/// The largest and the root-mean-square error over random real inputs, and the largest over the
/// corners and centres.
fn measure(
    model: &PolynomialModel,
    outputs: &[Output],
    coefficients: &[Vec<f64>],
    seed: u64,
) -> Vec<[f64; 3]> {
    let inputs = 2 * outputs.len();
    let error = |u: &[f64; 4], axis: usize| {
        let force = model.evaluate(&u.map(q31_from_f64))[axis];
        f64::from(force) * outputs[axis].force_per_lsb - exact(&coefficients[axis], &u[..inputs])
    };
    let mut found = vec![[0.0_f64; 3]; outputs.len()];
    let mut points = Points::new(seed);
    for _ in 0..POINTS {
        // More bits than Q31 holds, so that the rounding of the inputs takes part.
        let u = [0; 4].map(|_| unit(&mut points) + unit(&mut points) / 2_147_483_648.0);
        for (axis, [largest, squares, _]) in found.iter_mut().enumerate() {
            let error = error(&u, axis).abs();
            *largest = largest.max(error);
            *squares += error * error;
        }
    }
    for n in 0..CORNER_POINTS {
        let u = [27, 9, 3, 1].map(|place| f64::from(n / place % 3) - 1.0);
        for (axis, [_, _, corner]) in found.iter_mut().enumerate() {
            *corner = corner.max(error(&u, axis).abs());
        }
    }
    for [_, squares, _] in &mut found {
        *squares = (*squares / f64::from(POINTS)).sqrt();
    }
    found
}

/// Measures every family with `axes` axes and returns what breaks the bound or the budget.
fn table(axes: usize) -> Vec<String> {
    let terms = 16_usize.pow(axes as u32);
    let mut broken = Vec::new();
    println!(
        "errors in 1e-9 of sum|c|, {axes} axes, {POINTS} random points and the corners and centres"
    );
    println!("family | seed | axis | largest | RMS | corners | bound | LSB");
    for (number, family) in FAMILIES.iter().enumerate() {
        for seed in [1, 2].map(|s| s + 10 * number as u64) {
            let mut points = Points::new(seed);
            let coefficients: Vec<Vec<f64>> = (0..axes)
                .map(|_| {
                    (0..terms)
                        .map(|n| {
                            let e = [64, 16, 4, 1].map(|place| n / place % 4);
                            let e = if axes == 1 { [e[2], e[3], 3, 3] } else { e };
                            let e = if axes == 1 {
                                [e[0], e[1], e[0], e[1]]
                            } else {
                                e
                            };
                            // The force's unit is no power of two on either axis.
                            37.7 * (family.coefficient)(e, unit(&mut points), unit(&mut points))
                        })
                        .collect()
                })
                .collect();
            let slices: Vec<&[f64]> = coefficients.iter().map(Vec::as_slice).collect();
            let (model, outputs) =
                PolynomialModel::quantise(&[3_u8; 4][..2 * axes], &slices).unwrap();
            for (axis, [largest, rms, corner]) in measure(&model, &outputs, &coefficients, seed)
                .into_iter()
                .enumerate()
            {
                let sum: f64 = coefficients[axis].iter().map(|c| c.abs()).sum();
                let bound = outputs[axis].error_bound;
                let line = format!(
                    "{} | {seed} | {axis} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2}",
                    family.name,
                    largest / sum * 1e9,
                    rms / sum * 1e9,
                    corner / sum * 1e9,
                    bound / sum * 1e9,
                    outputs[axis].force_per_lsb / sum * 1e9,
                );
                println!("{line}");
                let worst = largest.max(corner);
                if worst > bound || worst > BUDGET * sum {
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
