//! Fitting a sum of physical effects: values, units and intervals for every parameter.

pub(crate) mod columns;
pub(crate) mod intervals;
mod laws;
pub(crate) mod projection;
pub(crate) mod slopes;
mod solution;
pub(crate) mod starts;
pub(crate) mod unknowns;
mod waves;

pub use projection::Stopped;
pub(crate) use solution::{AnotherStart, Solution, are_enough, solve, solve_also_from, solved_at};

use super::inertia::Inertia;
use super::polynomial::check_records;
use crate::model::effects::AxisEffect;
use crate::signal::motion::Motion;
use crate::study::Axis;
use crate::text::error::{Error, Result};
use columns::Records;
use intervals::{Errors, QUANTILE};
use jointwatch_shared::base::terms::EffectValues;
use jointwatch_shared::effect::about::{Role, Shape};
use projection::{Problem, Solved};

/// One effect as found.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedEffect {
    /// The effect and its axis.
    pub bound: AxisEffect,
    /// Its parameters, SI, in the order in which the effect lists them.
    pub values: Vec<f64>,
    /// Per parameter the interval that covers the true value in 95 of 100 experiments.
    pub intervals: Vec<Option<[f64; 2]>>,
}

impl FittedEffect {
    /// The effect in numbers.
    pub fn in_si(&self) -> EffectValues {
        EffectValues {
            input: self.bound.input,
            entry: self.bound.entry,
            axis: self.bound.axis as u8,
            values: self.values.clone(),
        }
    }
}

/// A sum of effects as found.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectsFit {
    /// In the order in which they were asked for.
    pub terms: Vec<FittedEffect>,
    /// Per axis, stated or identified.
    pub inertia: Vec<Inertia>,
    /// Why the search for shapes stopped.
    pub stopped: Stopped,
    /// Why the model may not hold, one sentence each.
    pub warnings: Vec<String>,
}

/// Fits a sum of effects to the training records `motions`; inertias that the axes do not state are
/// found as well.
///
/// `low_pass` are the taps of the study's symmetric low-pass: laws are evaluated on the wide-band
/// states, then both sides go through it alike.
///
/// # Errors
/// One sentence: no term, no record, too few rows for the parameters, a force that never changes.
pub fn fit_effects(
    axes: &[Axis],
    motions: &[&Motion],
    low_pass: &[f64],
    terms: &[AxisEffect],
) -> Result<EffectsFit> {
    fit_effects_also_from(axes, motions, low_pass, terms, &|_| Ok(None))
}

/// The same, from one more start.
pub(crate) fn fit_effects_also_from(
    axes: &[Axis],
    motions: &[&Motion],
    low_pass: &[f64],
    terms: &[AxisEffect],
    another: AnotherStart<'_>,
) -> Result<EffectsFit> {
    check_records(axes, motions)?;
    if terms.is_empty() {
        return Err(Error::data(
            "a physical model needs at least one effect: give [base] terms in study.toml, e.g. terms = [\"stiffness@x\", \"viscous@x\"]",
        ));
    }
    check_inertias(axes, terms)?;
    let records = Records::new(axes, motions, low_pass);
    let fit = solve_also_from(&records, axes, terms, another)?;
    assemble(
        axes,
        &fit.problem(&records, terms),
        fit.solved.clone(),
        fit.stopped,
    )
}

/// An inertia that is found anyway cannot be wrong beside.
pub(crate) fn check_inertias(axes: &[Axis], terms: &[AxisEffect]) -> Result<()> {
    for term in terms {
        let Some(axis) = axes.get(term.axis) else {
            continue;
        };
        match (term.entry.about.name, axis.inertia) {
            ("inertia_error", None) => {
                return Err(Error::data(format!(
                    "the inertia of axis {} is identified, so inertia_error would be found twice: state the inertia in study.toml, \
                     or leave the effect out",
                    axis.name
                )));
            }
            ("force_gain", Some(0.0))
                if axis.ground_stiffness == 0.0 && axis.ground_damping == 0.0 =>
            {
                return Err(Error::data(format!(
                    "axis {} has no inertia and no spring to ground, so nothing tells a wrong gain of its force channel from another \
                     joint: load the channel with a known weight, or leave force_gain out",
                    axis.name
                )));
            }
            _ => {}
        }
    }
    Ok(())
}

/// Values with their intervals, and what to be wary of.
pub(crate) fn assemble(
    axes: &[Axis],
    problem: &Problem<'_>,
    solved: Solved,
    stopped: Stopped,
) -> Result<EffectsFit> {
    let names: Vec<&str> = axes.iter().map(|a| a.name.as_str()).collect();
    let errors = intervals::errors(problem, &solved);
    let mut warnings = warnings_of_search(&solved, errors.as_ref(), stopped);
    let mut linear = errors.iter().flat_map(|e| e.linear.iter().copied());
    let mut found = Vec::new();
    for (term, (bound, values)) in problem.terms.iter().zip(&solved.values).enumerate() {
        let mut intervals = Vec::new();
        for (index, (parameter, &value)) in bound.entry.parameters().iter().zip(values).enumerate()
        {
            let (interval, doubt) = match parameter.role {
                Role::Linear { .. } => {
                    of_linear(value, bound.is_positive(parameter), linear.next())
                }
                Role::SizePerRecord { .. } => {
                    let count = problem.records.columns_of(parameter);
                    let before = bound.entry.parameters()[..index].iter();
                    let start = columns_before(problem, term)
                        + before.map(|p| problem.records.columns_of(p)).sum::<usize>();
                    let factors = &solved.factors[start..start + count];
                    let errors: Vec<f64> = linear.by_ref().take(count).collect();
                    let records = problem.records.rows.len();
                    let sizes = problem.records.sizes(parameter, factors);
                    (of_size_per_record(value, &sizes, &errors, records), None)
                }
                Role::Shape(shape) => {
                    of_shape(problem, errors.as_ref(), (term, index), value, &shape)
                }
            };
            intervals.push(interval);
            warnings.extend(
                doubt.map(|doubt| format!("{} of {} {doubt}", parameter.name, bound.name(&names))),
            );
        }
        warnings.extend(out_of_order(bound, values, &names));
        warnings.extend(pushes_away(bound, &intervals, &names));
        found.push(FittedEffect {
            bound: *bound,
            values: values.clone(),
            intervals,
        });
    }
    let mut inertia = Vec::new();
    for (axis, identified) in axes.iter().zip(&solved.inertia) {
        let found = found_inertia(axis, *identified, &mut linear)?;
        if found.identified && found.value == 0.0 {
            warnings.push(no_inertia(axis));
        }
        warnings.extend(doubtful_inertia(axis, &found));
        inertia.push(found);
    }
    Ok(EffectsFit {
        terms: found,
        inertia,
        stopped,
        warnings,
    })
}

/// What the search itself says against its result.
fn warnings_of_search(solved: &Solved, errors: Option<&Errors>, stopped: Stopped) -> Vec<String> {
    let mut warnings = Vec::new();
    let (rank, count) = (solved.rank, solved.columns.len());
    if rank < count || errors.is_none() {
        let what = match rank < count {
            true => format!(
                "determine only {rank} of {count} parameters that the force is proportional to"
            ),
            false => {
                "hardly tell the effects' parameters apart, so that they have no intervals".into()
            }
        };
        warnings.push(format!(
            "the training records {what}: shake every axis, alone and together, or name fewer effects"
        ));
    }
    if stopped == Stopped::GaveUp {
        warnings.push(
            "the search for the shapes of the effects gave up before it settled: their values are the best so far".into(),
        );
    }
    warnings
}

/// Linear unknowns of the terms before this one.
fn columns_before(problem: &Problem<'_>, term: usize) -> usize {
    let terms = problem.terms[..term].iter();
    terms.map(|bound| problem.records.count(bound)).sum()
}

/// The interval of a parameter that the force is proportional to, and what speaks against its
/// value.
pub(in crate::fit) fn of_linear(
    value: f64,
    positive: bool,
    error: Option<f64>,
) -> (Option<[f64; 2]>, Option<String>) {
    let error = error.filter(|e| e.is_finite());
    let interval = error.map(|e| [value - QUANTILE * e, value + QUANTILE * e]);
    let doubt = (positive && value <= 0.0).then(|| {
        "would be below 0, which is not physical, and is held there: another effect is missing or takes its place".to_owned()
    });
    (interval, doubt)
}

/// The interval of √(Σf²/records), for the records' sizes f and the standard errors of all of them,
/// or of all but the first.
fn of_size_per_record(
    value: f64,
    sizes: &[f64],
    errors: &[f64],
    records: usize,
) -> Option<[f64; 2]> {
    let known = sizes.iter().rev().zip(errors.iter().rev());
    let square: f64 = known.map(|(f, e)| f * f * e * e).sum();
    let error = square.sqrt() / (value * records as f64);
    let known = !errors.is_empty() && error.is_finite();
    let low = (value - QUANTILE * error).max(0.0);
    known.then_some([low, value + QUANTILE * error])
}

/// The interval of a parameter that was searched for, the one at `place` (term, parameter), and
/// what speaks against its value.
fn of_shape(
    problem: &Problem<'_>,
    errors: Option<&Errors>,
    place: (usize, usize),
    value: f64,
    shape: &Shape,
) -> (Option<[f64; 2]>, Option<String>) {
    let unknown = problem
        .shapes
        .iter()
        .position(|u| u.places.contains(&place));
    let error = errors.zip(unknown).map(|(e, u)| e.shapes[u]);
    let error = error.filter(|e| e.is_finite());
    let interval = error.map(|e| {
        let factor = (QUANTILE * e).min(700.0).exp();
        [value / factor, value * factor]
    });
    // What is wider than all that was searched says nothing.
    let interval =
        interval.filter(|[low, high]| shape.is_given() || high / low < shape.most / shape.least);
    let reference = unknown.map_or(1.0, |u| problem.shapes[u].reference);
    let relative = value / reference;
    let at_edge = relative <= shape.least * 1.001 || relative >= shape.most * 0.999;
    let doubt = (at_edge && !shape.is_given()).then(|| {
        let why = match interval {
            Some(_) => "what fits best may lie beyond, where the law is another one",
            None => "these records do not determine it",
        };
        format!("stands at the edge of what was searched, {value:.3e}: {why}")
    });
    (interval, doubt)
}

/// A sentence for each pair of an effect's parameters of which the one that is never less is.
fn out_of_order(bound: &AxisEffect, values: &[f64], names: &[&str]) -> Vec<String> {
    let pairs = bound.entry.never_less.iter();
    pairs
        .filter(|&&(more, less)| values[more] < values[less])
        .map(|&(more, less)| {
            let named = |place: usize| bound.entry.parameters()[place].name;
            format!(
                "{} of {} came out below its {}, which is not physical: another effect is missing or takes its place",
                named(more),
                bound.name(names),
                named(less)
            )
        })
        .collect()
}

/// What is said of a spring that surely pushes away from its middle.
fn pushes_away(
    bound: &AxisEffect,
    intervals: &[Option<[f64; 2]>],
    names: &[&str],
) -> Option<String> {
    let surely = matches!(intervals, [Some([_, high])] if *high < 0.0);
    let is_spring = bound.entry.about.name == "stiffness" && bound.input.is_none();
    (is_spring && surely).then(|| {
        format!(
            "{} is below 0, a spring that pushes away from its middle, as a magnet's or an inverted pendulum's does: if the joint has none, an \
             effect is missing or another one takes its place",
            bound.name(names)
        )
    })
}

/// What is said of an inertia that is held at its smallest physical value.
fn no_inertia(axis: &Axis) -> String {
    format!(
        "the inertia of axis {} would be below 0, which is not physical, and is held there: an effect is missing that follows the \
         displacement, such as a spring or gravity; or the sign of the force or restoring_force in study.toml is wrong; or state the inertia",
        axis.name
    )
}

/// What is said of an inertia that is not larger than its own uncertainty.
fn doubtful_inertia(axis: &Axis, found: &Inertia) -> Option<String> {
    let half = QUANTILE * found.standard_error?;
    (found.value > 0.0 && half >= found.value).then(|| {
        format!(
            "the inertia of axis {} is not determined, its 95 % interval holds 0: shake faster, leave rows out in which no force acts \
             (rows = […]), or state the inertia",
            axis.name
        )
    })
}

/// The inertia of an axis, stated or identified; `errors` are the standard errors of those
/// identified that are left.
pub(in crate::fit) fn found_inertia(
    axis: &Axis,
    identified: Option<f64>,
    errors: &mut impl Iterator<Item = f64>,
) -> Result<Inertia> {
    match identified {
        None => Ok(Inertia {
            value: axis.inertia.unwrap_or(0.0),
            identified: false,
            standard_error: None,
        }),
        Some(value) if value >= 0.0 => Ok(Inertia {
            value,
            identified: true,
            standard_error: errors.next().filter(|e| e.is_finite()),
        }),
        Some(value) => Err(Error::data(format!(
            "the inertia of axis {} came out as {value:.3e}, which cannot be: check the sign of its force and \
             restoring_force in study.toml, or state the inertia",
            axis.name
        ))),
    }
}
