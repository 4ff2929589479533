//! The derivative by a parameter that a law's dual numbers give, against differences of its real
//! ones.

use super::{SCALES, largest, motion, parameters, run, taken};
use jointwatch_shared::effect::{EFFECTS, Entry, MAX_PARAMETERS, SLOPES};
use jointwatch_shared::scalar::dual::Dual;
use proptest::prelude::*;

/// Forces along `rows` whose derivative by parameter `at` is not the slope from `step` below its
/// value to as much above it, relative to the value.
fn rows_that_differ(
    entry: &Entry,
    values: [f64; MAX_PARAMETERS],
    at: usize,
    rows: &[[f64; 4]],
    step: f64,
) -> usize {
    let mut dual = values.map(Dual::constant);
    dual[at] = Dual::variable(values[at]);
    let slopes = run(entry.dual, dual, rows, &SCALES, Dual::constant);
    let step = step * values[at].abs();
    let moved = |by: f64| {
        let mut values = values;
        values[at] += by;
        run(entry.real, values, rows, &SCALES, |v| v)
    };
    let (above, below, real) = (moved(step), moved(-step), moved(0.0));
    let scale = largest(&real) / values[at].abs();
    let mut wrong = 0;
    for (slope, (a, b)) in slopes.iter().zip(above.iter().zip(&below)) {
        for axis in 0..2 {
            let difference = (a[axis] - b[axis]) / (2.0 * step);
            wrong += usize::from((slope[axis].slopes[0] - difference).abs() > 1e-5 * scale);
        }
    }
    wrong
}

/// Whether the derivative by parameter `at` is the slope between two sides that lie close enough
/// together.
///
/// A corner or a switch that lies between them belongs to neither, and a state that remembers it
/// shows it in every row that follows: then the sides move closer, until it lies between them no
/// more. A law that is wrong is so at every distance.
fn derivative_agrees(
    entry: &Entry,
    values: [f64; MAX_PARAMETERS],
    at: usize,
    rows: &[[f64; 4]],
) -> bool {
    let mut steps = [1e-6, 1e-7, 1e-8].into_iter();
    steps.any(|step| rows_that_differ(entry, values, at, rows, step) <= 4)
}

/// Whether the slopes that come of one run are those that come one by one, to the last bit.
fn gradient_agrees(entry: &Entry, values: [f64; MAX_PARAMETERS], rows: &[[f64; 4]]) -> bool {
    (0..entry.parameter_count as usize).all(|first| {
        let by: [usize; SLOPES] =
            core::array::from_fn(|k| (first + k) % entry.parameter_count as usize);
        let mut duals = values.map(Dual::constant);
        for (slot, &index) in by.iter().enumerate() {
            duals[index].slopes[slot] = 1.0;
        }
        let together = run(entry.gradient, duals, rows, &SCALES, Dual::constant);
        by.iter().enumerate().all(|(slot, &index)| {
            let mut dual = values.map(Dual::constant);
            dual[index] = Dual::variable(values[index]);
            let alone = run(entry.dual, dual, rows, &SCALES, Dual::constant);
            together.iter().zip(&alone).all(|(all, one)| {
                (0..2).all(|axis| {
                    let (all, one) = (all[axis].slopes[slot], one[axis].slopes[0]);
                    all == one || (all.is_nan() && one.is_nan())
                })
            })
        })
    })
}

#[test]
fn a_corner_between_both_sides_is_left_to_closer_ones() {
    // Bouc–Wen's state reaches what holds it within a millionth of this yield displacement.
    let seed = [2.987829075053023, 0.6019771850768263, 0.0, 0.0];
    let p = [
        0.3311766989993827,
        0.12205998401177781,
        0.41940967079995267,
        0.891927932748474,
        0.5,
        0.5,
    ];
    let entry = Entry::named("bouc_wen").unwrap();
    let values = taken(entry, &parameters(entry, &p), &SCALES);
    let rows = motion(seed, 200);
    assert!(rows_that_differ(entry, values, 1, &rows, 1e-6) > 4);
    assert!(derivative_agrees(entry, values, 1, &rows));
}

proptest! {
    #[test]
    fn a_linear_parameter_is_linear(
        seed in prop::array::uniform4(0.0_f64..6.0), p in prop::array::uniform6(0.05_f64..0.95),
    ) {
        let rows = motion(seed, 100);
        for entry in EFFECTS {
            let values = taken(entry, &parameters(entry, &p), &SCALES);
            let whole = run(entry.real, values, &rows, &SCALES, |v| v);
            let mut sum = vec![[0.0; 2]; rows.len()];
            let linear = |index: usize| entry.parameters().get(index).is_some_and(|p| p.is_linear());
            for unit in (0..MAX_PARAMETERS).filter(|&i| linear(i)) {
                let mut alone = values;
                for (index, value) in alone.iter_mut().enumerate() {
                    if linear(index) {
                        *value = f64::from(u8::from(index == unit));
                    }
                }
                let part = run(entry.real, alone, &rows, &SCALES, |v| v);
                let mut by = alone.map(Dual::constant);
                by[unit] = Dual::variable(0.0);
                let slopes = run(entry.dual, by, &rows, &SCALES, Dual::constant);
                for (f, slope) in part.iter().flatten().zip(slopes.iter().flatten()) {
                    prop_assert!((f - slope.slopes[0]).abs() <= 1e-12 * largest(&part), "{}", entry.about.name);
                }
                for (s, f) in sum.iter_mut().zip(part) {
                    *s = [s[0] + values[unit] * f[0], s[1] + values[unit] * f[1]];
                }
            }
            for (a, b) in whole.iter().flatten().zip(sum.iter().flatten()) {
                prop_assert!((a - b).abs() <= 1e-9 * largest(&whole), "{}", entry.about.name);
            }
        }
    }

    #[test]
    fn the_dual_law_is_the_derivative_of_the_real_one(
        seed in prop::array::uniform4(0.0_f64..6.0), p in prop::array::uniform6(0.05_f64..0.95),
    ) {
        let rows = motion(seed, 200);
        for entry in EFFECTS {
            let relative = parameters(entry, &p);
            let values = taken(entry, &relative, &SCALES);
            for at in 0..relative.len() {
                prop_assert!(derivative_agrees(entry, values, at, &rows), "{} parameter {at}", entry.about.name);
            }
            prop_assert!(gradient_agrees(entry, values, &rows), "{}", entry.about.name);
        }
    }
}
