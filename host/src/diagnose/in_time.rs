//! A force channel that is late by more than the first order of a shift describes, such as one
//! behind a filter of its own.
//!
//! Effects are searched for in motion and force of the same moment. A late force makes a loop of
//! every curve, which several laws with memory together describe badly. So the force is read later
//! by what the model knows already; and where a smooth function of displacement and velocity does
//! much better with the force read later still, the search is made once more on such records. It
//! has to do clearly better there.

use super::answer::{Diagnosis, Found, Ranked, Verdict};
use super::criteria;
use super::later::{DELAY, delays_of, read_later, shift};
use super::search::bench::rows_of;
use super::verdict::{SearchOptions, answer};
use crate::fit::effects::columns::{Records, Sample};
use crate::fit::effects::projection::product;
use crate::fit::identify::Prepared;
use crate::fit::least_squares::bounded;
use crate::model::ParameterValue;
use crate::model::file::{ModelFile, PerAxis};
use crate::signal::motion::{Filters, Motion};
use crate::study::Study;
use crate::text::error::Result;
use faer::Mat;
use jointwatch_shared::effect::Entry;
use rayon::prelude::*;

/// Shifts either way that are tried, and how many of them make a period at the upper end of the
/// band.
const SHIFTS: i32 = 10;
const PER_PERIOD: f64 = 20.0;
/// The same once more round the best of them, in steps finer by this.
const FINE: f64 = 0.1;
/// Rows of all records together that are looked at, from the middle of each.
const MAX_ROWS: usize = 20_000;
/// A shift that leaves less than this part of the power may be a late channel.
const LEFT: f64 = 0.5;

/// Diagnoses a model on a study.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the study does not fit the model, or its records are too
/// short.
pub fn diagnose(study: &Study, model: &ModelFile) -> Result<Diagnosis> {
    diagnose_with(study, model, &SearchOptions::default())
}

/// The same with more asked.
///
/// # Errors
/// As [`diagnose`].
pub fn diagnose_with(study: &Study, model: &ModelFile, asked: &SearchOptions) -> Result<Diagnosis> {
    let prepared = Prepared::for_model(study, model)?;
    diagnose_prepared(study, &prepared, model, asked)
}

/// The same for the motions that the model's filters make of the study.
///
/// # Errors
/// As [`diagnose`].
pub(super) fn diagnose_prepared(
    study: &Study,
    prepared: &Prepared,
    model: &ModelFile,
    asked: &SearchOptions,
) -> Result<Diagnosis> {
    let known = delays_of(model)?;
    let in_time = read_later(prepared, known);
    let diagnosis = answer(study, prepared, &in_time, model, asked)?;
    // A late force makes loops that no effect describes well.
    if diagnosis.remainder.is_empty() && diagnosis.verdict != Verdict::Unknown {
        return Ok(diagnosis);
    }
    let never = |axis: usize| {
        let on_axis = format!("{DELAY}@{}", study.axes[axis].name);
        asked.without.iter().any(|w| w == DELAY || *w == on_axis)
    };
    let late = lateness(study, &in_time.training(study), &model.filters);
    for (axis, delay_s) in late.into_iter().enumerate() {
        // A delay that the model has is found anew with whatever is added.
        let Some(delay_s) = delay_s.filter(|_| known[axis] == 0.0 && !never(axis)) else {
            continue;
        };
        let mut delays = known;
        delays[axis] += delay_s;
        let shifted = read_later(prepared, delays);
        let other = answer(study, prepared, &shifted, model, asked)?;
        let name = &study.axes[axis].name;
        let error = |of: &PerAxis| of.get(name).copied().unwrap_or(f64::INFINITY);
        let fall = error(&diagnosis.relative_error_after) / error(&other.relative_error_after);
        if 2.0 * fall.ln() > criteria::CLEARLY {
            return Ok(with_delay(other, &diagnosis, name, delay_s));
        }
    }
    Ok(diagnosis)
}

/// Per axis, by how many seconds the force channel may be later than the motions say, where it is.
fn lateness(study: &Study, motions: &[&Motion], filters: &Filters) -> Vec<Option<f64>> {
    if filters.quasi_static {
        return Vec::new();
    }
    let each = MAX_ROWS / motions.len().max(1);
    let middle: Vec<Motion> = motions.iter().map(|motion| motion.middle(each)).collect();
    let middle: Vec<&Motion> = middle.iter().collect();
    let records = Records::new(&study.axes, &middle, &filters.band);
    let step_s = 1.0 / (PER_PERIOD * filters.band_hz);
    // Of a force that is read so much later, most of a record is its last value.
    let shortest = motions.iter().map(|motion| motion.rows()).min();
    let longest_s = 0.5 * shortest.unwrap_or(0) as f64 / filters.sample_rate_hz;
    let late = study.axes.iter().enumerate().map(|(index, axis)| {
        let curve = curve(&records, index);
        let force = |delay_s: f64| {
            let read = middle.iter().enumerate().flat_map(|(record, motion)| {
                let mut motion = (*motion).clone();
                shift(&mut motion, index, delay_s);
                let inertia = axis.inertia.unwrap_or(0.0);
                records.thinned(
                    record,
                    &motion.restoring_force(index, inertia, axis.restoring_force),
                )
            });
            read.collect::<Vec<f64>>()
        };
        let (coarse, share) = least(&curve, &force, 0.0, step_s)?;
        // Dry friction bends sharply there.
        let fine = || least(&curve, &force, coarse, FINE * step_s);
        (share < LEFT && coarse.abs() < longest_s).then(|| fine().map_or(coarse, |(fine, _)| fine))
    });
    late.collect()
}

/// Of as many steps either way of a middle, s, the delay at which a curve leaves least of a force,
/// and that power beside what is left at the middle; nothing where the least is at the edge of what
/// was tried.
fn least(
    curve: &[Vec<f64>],
    force: &(dyn Fn(f64) -> Vec<f64> + Sync),
    middle: f64,
    step_s: f64,
) -> Option<(f64, f64)> {
    let shifts = (-SHIFTS..=SHIFTS).into_par_iter();
    let delays: Vec<f64> = shifts.map(|n| middle + f64::from(n) * step_s).collect();
    let forces: Vec<Vec<f64>> = delays.par_iter().map(|delay| force(*delay)).collect();
    let columns: Vec<&Vec<f64>> = curve.iter().chain(&forces).collect();
    let all = Mat::from_fn(columns[0].len(), columns.len(), |row, column| {
        columns[column][row]
    });
    let products = product(&all, &all);
    let free = vec![[f64::NEG_INFINITY, f64::INFINITY]; curve.len()];
    let left = |force: usize| {
        let at = |place: usize| {
            if place < curve.len() {
                place
            } else {
                curve.len() + force
            }
        };
        let own = Mat::from_fn(curve.len() + 1, curve.len() + 1, |r, c| {
            products[(at(r), at(c))]
        });
        bounded::left(&own, &bounded::factors(&own, &free))
    };
    let left: Vec<f64> = (0..forces.len()).map(left).collect();
    let found = (1..left.len() - 1).min_by(|a, b| left[*a].total_cmp(&left[*b]))?;
    let [before, at, after] = [left[found - 1], left[found], left[found + 1]];
    let bend = (before - 2.0 * at + after).max(f64::MIN_POSITIVE);
    let between = 0.5 * (before - after) / bend * step_s;
    let inside = at <= before && at <= after;
    inside.then(|| (delays[found] + between, at / left[SHIFTS as usize]))
}

/// Columns of a smooth function of an axis's displacement and velocity, with bends and a step; of
/// an acceleration whose inertia is not stated too.
fn curve(records: &Records<'_>, axis: usize) -> Vec<Vec<f64>> {
    let own = rows_of(records, axis);
    let (x, v) = (
        records.references.displacement[axis],
        records.references.velocity[axis],
    );
    let of = |function: &dyn Fn(f64, f64) -> f64| {
        let at = |sample: &Sample| function(sample.displacement / x, sample.velocity / v);
        records.of_motion(axis, None, at)[own.clone()].to_vec()
    };
    let mut columns: Vec<Vec<f64>> = Vec::new();
    for power in 0..=5 {
        for other in 0..=(5 - power).min(3) {
            columns.push(of(&|u: f64, w: f64| u.powi(power) * w.powi(other)));
        }
    }
    for width in [0.01, 0.03, 0.1, 0.3] {
        columns.push(of(&|_, w| (w / width).tanh()));
    }
    for place in [-0.8, -0.6, -0.4, -0.2, 0.2, 0.4, 0.6, 0.8] {
        columns.push(of(&|u, _| (u - place).max(0.0)));
    }
    let acceleration = records.accelerations[axis].as_ref();
    columns.extend(acceleration.map(|column| column[own].to_vec()));
    columns
}

/// What is said of the records put in time, with the delay as the first of what was found.
fn with_delay(mut said: Diagnosis, as_logged: &Diagnosis, axis: &str, delay_s: f64) -> Diagnosis {
    let own = |f: &Found| f.effect == DELAY && f.axis == axis;
    said.found.retain(|f| !own(f));
    said.found.insert(
        0,
        Found {
            effect: DELAY.into(),
            axis: axis.into(),
        },
    );
    let of = |errors: &PerAxis| errors.get(axis).copied().unwrap_or(f64::NAN);
    let [before, after] = [as_logged, &said].map(|d| of(&d.relative_error_after));
    said.ranked
        .retain(|r| !(r.effect == DELAY && r.axis == axis));
    said.ranked.insert(
        0,
        Ranked {
            effect: DELAY.into(),
            axis: axis.into(),
            equivalent: Vec::new(),
            probability: 1.0,
            group_probability: 1.0,
            score: 0.0,
            error_before: before,
            error_after: after,
            error_drop_interval: [before / after; 2],
            parameters: vec![ParameterValue {
                name: "delay".into(),
                value: delay_s,
                unit: "s".into(),
                interval: None,
            }],
            separating_experiment: Entry::named(DELAY)
                .map_or("", |entry| entry.about.separated_by)
                .into(),
        },
    );
    said.probabilities.insert(format!("{DELAY}@{axis}"), 1.0);
    said.probabilities.insert("none".into(), 0.0);
    said.relative_error_before
        .clone_from(&as_logged.relative_error_before);
    if said.verdict == Verdict::None {
        said.verdict = Verdict::Effect;
    }
    said
}
