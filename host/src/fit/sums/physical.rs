//! The sums that strengths of effects are made of: products of the effects' columns with each other
//! and with the force, per stretch.

use super::exact::Exact;
use super::plan::{Plan, columns};
use super::products::{FLUSHED, LANES, Rows, add_products};
use crate::fit::effects::columns::Records;
use crate::fit::effects::intervals::QUANTILE;
use crate::fit::effects::{EffectsFit, FittedEffect, Stopped, found_inertia, of_linear};
use crate::fit::least_squares::{bounded, normal_equations};
use crate::model::effects::AxisEffect;
use crate::signal::motion::Motion;
use crate::study::series::jackknife;
use crate::text::error::{Error, Result};
use faer::Mat;

/// Stretches of every record that are left out in turn.
const STRETCHES: usize = 10;
/// 97.5 % of Student's distribution with one degree of freedom less than there are stretches.
const OF_STUDENT: f64 = 2.262;
/// How often the axes are weighed against each other anew.
const WEIGHINGS: usize = 2;
/// Rows behind the low-pass that are wanted for each parameter.
const ROWS_PER_PARAMETER: u64 = 5;

/// How many sums a plan asks for.
pub(super) fn count(plan: &Plan) -> usize {
    match plan.not_linear {
        None => STRETCHES * plan.axes.len() * plan.width() * plan.width(),
        Some(_) => 0,
    }
}

/// Adds a motion to the sums; gives its rows behind the low-pass.
pub(super) fn add(
    plan: &Plan,
    terms: &[AxisEffect],
    motion: &Motion,
    sums: &mut Exact,
) -> Result<u64> {
    let width = plan.width();
    let motions = [motion];
    let records = Records::new(&plan.axes, &motions, &plan.filters.band);
    let rows = records.rows_per_axis();
    if count(plan) == 0 {
        return Ok(rows as u64);
    }
    let columns = columns(&records, terms);
    let padded = width.next_multiple_of(LANES);
    let mut block = vec![0.0; rows * padded];
    let mut products = vec![0.0; width * padded];
    for (axis, exponents) in plan.columns.iter().enumerate() {
        for (place, (column, exponent)) in columns.iter().zip(exponents).enumerate() {
            let scale = 2f64.powi(-exponent);
            let series = &column[axis * rows..(axis + 1) * rows];
            for (row, value) in block.chunks_exact_mut(padded).zip(series) {
                row[place] = value * scale;
            }
        }
        for stretch in 0..STRETCHES {
            let (start, end) = (stretch * rows / STRETCHES, (stretch + 1) * rows / STRETCHES);
            let first = (stretch * plan.axes.len() + axis) * width * width;
            for from in (start..end).step_by(FLUSHED) {
                let to = (from + FLUSHED).min(end);
                let part = Rows {
                    values: &block[from * padded..to * padded],
                    width: padded,
                };
                products.fill(0.0);
                add_products(part, 0..width, part, padded, (&mut products, padded));
                for i in 0..width {
                    for j in 0..width {
                        sums.add(first + i * width + j, products[i * padded + j])?;
                    }
                }
            }
        }
    }
    Ok(rows as u64)
}

/// Per axis the products of all columns in SI, without one stretch or with all.
fn normal(plan: &Plan, sums: &Exact, without: Option<usize>) -> Vec<Mat<f64>> {
    let (width, axes) = (plan.width(), plan.axes.len());
    let of_axis = |(axis, exponents): (usize, &Vec<i32>)| {
        Mat::from_fn(width, width, |i, j| {
            let stretches = (0..STRETCHES).filter(|stretch| Some(*stretch) != without);
            let place = |stretch: usize| ((stretch * axes + axis) * width + i) * width + j;
            let sum: f64 = stretches.map(|stretch| sums.value(place(stretch))).sum();
            2f64.powi(exponents[i] + exponents[j]) * sum
        })
    };
    plan.columns.iter().enumerate().map(of_axis).collect()
}

/// The factors of all columns within their bounds, with the axes weighed by `weights`, and how many
/// of them the sums determine.
fn factors(normal: &[Mat<f64>], weights: &[f64], bounds: &[[f64; 2]]) -> Result<(Vec<f64>, usize)> {
    let unknowns = bounds.len();
    let sum = |i: usize, j: usize| -> f64 {
        let axes = normal.iter().zip(weights);
        axes.map(|(products, weight)| weight * weight * products[(i, j)])
            .sum()
    };
    let gram = Mat::from_fn(unknowns, unknowns, sum);
    let cross = Mat::from_fn(unknowns, 1, |i, _| sum(i, unknowns));
    let solution = normal_equations::solve(&gram, &cross)?;
    let mut found: Vec<f64> = (0..unknowns)
        .map(|c| solution.coefficients[(c, 0)])
        .collect();
    let mut pairs = found.iter().zip(bounds);
    if pairs.any(|(factor, [least, most])| factor < least || factor > most) {
        found = bounded::factors(&Mat::from_fn(unknowns + 1, unknowns + 1, sum), bounds);
    }
    Ok((found, solution.rank))
}

/// One over the standard deviation of what the factors leave of each axis's force.
fn weights(normal: &[Mat<f64>], factors: &[f64], rows: f64) -> Vec<f64> {
    let last = factors.len();
    let by = |c: usize| if c == last { -1.0 } else { factors[c] };
    let of_axis = |products: &Mat<f64>| {
        let mut square = 0.0;
        for i in 0..=last {
            for j in 0..=last {
                square += by(i) * by(j) * products[(i, j)];
            }
        }
        // An axis that is explained to the last digit must not outweigh the other one.
        let force = products[(last, last)];
        (square.max(1e-18 * force) / rows).sqrt().recip()
    };
    normal.iter().map(of_axis).collect()
}

/// The effects' strengths from sums over so many rows behind the low-pass.
///
/// # Errors
/// One sentence: too few rows, a force that is zero throughout, an inertia that is not positive.
pub(super) fn solve(plan: &Plan, sums: &Exact, rows: u64) -> Result<EffectsFit> {
    let terms = plan.bound()?;
    let unknowns = plan.width() - 1;
    if rows * (plan.axes.len() as u64) < ROWS_PER_PARAMETER * unknowns as u64 {
        return Err(Error::data(format!(
            "{rows} rows behind the low-pass are too few for {unknowns} parameters: sum more records, or name fewer effects in [base] terms"
        )));
    }
    let whole = normal(plan, sums, None);
    if let Some(axis) = (0..whole.len()).find(|&a| whole[a][(unknowns, unknowns)] <= 0.0) {
        return Err(Error::data(format!(
            "the force of axis {} is zero throughout: check its column in study.toml",
            plan.axes[axis].name
        )));
    }
    let bounds = bounds(&terms, unknowns);
    let mut weighed = vec![1.0; whole.len()];
    for _ in 0..WEIGHINGS {
        let (found, _) = factors(&whole, &weighed, &bounds)?;
        weighed = weights(&whole, &found, rows as f64);
    }
    let (found, rank) = factors(&whole, &weighed, &bounds)?;
    let left_out = (0..STRETCHES)
        .map(|stretch| Ok(factors(&normal(plan, sums, Some(stretch)), &weighed, &bounds)?.0));
    let left_out: Vec<Vec<f64>> = left_out.collect::<Result<_>>()?;
    // What is held at a bound has no interval.
    let determined = |c: usize| rank == unknowns && !bounds[c].contains(&found[c]);
    let errors =
        (0..unknowns).map(|c| determined(c).then(|| jackknife(left_out.iter().map(|f| f[c]))));
    assemble(plan, &terms, &found, errors, rank)
}

/// The least and the most of each factor: a strength that has to be positive is, and an inertia may
/// be anything.
fn bounds(terms: &[AxisEffect], unknowns: usize) -> Vec<[f64; 2]> {
    let strengths = terms.iter().flat_map(|bound| {
        let parameters = bound.entry.parameters().iter();
        parameters.map(|parameter| match bound.is_positive(parameter) {
            true => [0.0, f64::INFINITY],
            false => [f64::NEG_INFINITY, f64::INFINITY],
        })
    });
    let free = std::iter::repeat([f64::NEG_INFINITY, f64::INFINITY]);
    strengths.chain(free).take(unknowns).collect()
}

/// Factors as terms with values and intervals, and inertias.
fn assemble(
    plan: &Plan,
    terms: &[AxisEffect],
    found: &[f64],
    mut errors: impl Iterator<Item = Option<f64>>,
    rank: usize,
) -> Result<EffectsFit> {
    let names: Vec<&str> = plan.axes.iter().map(|a| a.name.as_str()).collect();
    let mut factors = found.iter().copied();
    let mut warnings: Vec<String> = plan.proposed.iter().cloned().collect();
    if rank < found.len() {
        warnings.push(format!(
            "the summed records determine only {rank} of {} parameters: shake every axis, alone and together, or name fewer effects",
            found.len()
        ));
    }
    let terms = terms.iter().map(|bound| {
        let parameters = bound.entry.parameters();
        let values: Vec<f64> = factors.by_ref().take(parameters.len()).collect();
        let listed = parameters.iter().zip(&values);
        let intervals = listed.map(|(parameter, value)| {
            let error = errors.next().flatten().map(|e| e * OF_STUDENT / QUANTILE);
            let (interval, doubt) = of_linear(*value, bound.is_positive(parameter), error);
            let named = |doubt| format!("{} of {} {doubt}", parameter.name, bound.name(&names));
            warnings.extend(doubt.map(named));
            interval
        });
        FittedEffect {
            bound: *bound,
            intervals: intervals.collect(),
            values,
        }
    });
    let terms = terms.collect();
    let mut errors = errors.flatten();
    let inertia = plan.axes.iter().map(|axis| {
        let identified = if axis.inertia.is_none() {
            factors.next()
        } else {
            None
        };
        found_inertia(axis, identified, &mut errors)
    });
    Ok(EffectsFit {
        terms,
        inertia: inertia.collect::<Result<_>>()?,
        stopped: Stopped::Direct,
        warnings,
    })
}
