//! All pictures of a model on a study: which there are, and what they are called.

use super::axis_history::{Along, AxisHistory, histories};
use super::drawing::Drawing;
use super::figure::{Figure, Panel};
use super::phase::{self, Against};
use super::staircase::{Step, staircase};
use super::state_plane::StatePlane;
use super::style::Pen;
use super::time_history;
use crate::assess::compare::{self, Comparison};
use crate::assess::where_it_fails::{Extent, FailingRegion};
use crate::diagnose::PerAxis;
use crate::model::file::ModelFile;
use crate::signal::motion;
use crate::study::Study;
use crate::text::error::Result;
use std::collections::HashSet;

/// Per record and axis the force and the residual over time and the phase plots, and per axis the
/// residual over the state plane; an axis that rests in a record is left out there. Logs without
/// time have neither velocity nor state plane.
///
/// `comparison` is that of the model on this study.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the model does not fit the study or gives numbers that
/// are not finite.
pub fn of_model(study: &Study, model: &ModelFile, comparison: &Comparison) -> Result<Vec<Drawing>> {
    let corrected = model.corrected(study)?;
    let motions = motion::motions(&corrected, &model.filters)?;
    let judged = comparison.judged_role();
    let mut taken = HashSet::new();
    let mut drawings = Vec::new();
    let mut judged_courses: Vec<Vec<AxisHistory>> = vec![Vec::new(); model.axes.len()];
    for (motion, figures) in motions.iter().zip(&comparison.records) {
        let record = &study.records[motion.record];
        let name = free_name(&record.file, &mut taken);
        for (axis, history) in histories(model, motion)?.into_iter().enumerate() {
            if figures.axes.get(&history.axis).is_none_or(|f| f.at_rest) {
                continue;
            }
            let places = places_of(&comparison.places, &history.axis);
            let begins_s = record.first_row as f64 / study.sample_rate_hz;
            let failing = failing(&places, &record.file, begins_s);
            let (force, phases) = of_course(&history, failing, &record.file);
            let named = |what: &str| format!("{name}-{}-{what}", plain(&history.axis));
            drawings.push(Drawing::new(&named("force"), &force)?);
            drawings.push(Drawing::new(&named("phase"), &phases)?);
            if record.role == judged && history.along == Along::Time {
                judged_courses[axis].push(history);
            }
        }
    }
    for (axis, histories) in judged_courses.iter().enumerate() {
        let Some(history) = histories.first() else {
            continue;
        };
        let plane = StatePlane {
            histories,
            axis,
            places: &places_of(&comparison.places, &history.axis),
        };
        let name = format!("where-{}", plain(&history.axis));
        drawings.push(Drawing::of_svg(&name, plane.svg()?));
    }
    Ok(drawings)
}

/// The pictures of a model on a study, and a staircase of errors: what was done step by step, and
/// the floor of each axis.
///
/// # Errors
/// As [`of_model`] and [`of_staircase`].
pub fn with_staircase(
    study: &Study,
    model: &ModelFile,
    steps: &[Step],
    floors: &PerAxis,
) -> Result<Vec<Drawing>> {
    let mut drawings = of_model(study, model, &compare::compare(study, model)?)?;
    drawings.push(of_staircase(model, steps, floors)?);
    Ok(drawings)
}

/// The staircase of errors of a model's axes as a picture.
///
/// # Errors
/// As [`staircase`].
pub fn of_staircase(model: &ModelFile, steps: &[Step], floors: &PerAxis) -> Result<Drawing> {
    let axes: Vec<&str> = model.axes.iter().map(|a| a.name.as_str()).collect();
    let svg = staircase(&axes, steps, floors)?;
    Ok(Drawing::of_svg("staircase", svg))
}

fn places_of(places: &[FailingRegion], axis: &str) -> Vec<FailingRegion> {
    let mine = places.iter().filter(|p| p.axis == axis);
    mine.cloned().collect()
}

/// Stretches of a record in which the model fails, seconds since its first row used.
fn failing(places: &[FailingRegion], record: &str, begins_s: f64) -> Vec<(f64, f64)> {
    let stretch = |place: &FailingRegion| match &place.extent {
        Extent::Time { file, from_s, to_s } if file == record => {
            Some((from_s - begins_s, to_s - begins_s))
        }
        _ => None,
    };
    places.iter().filter_map(stretch).collect()
}

/// Force and residual over time in one figure, the phase plots in another.
fn of_course(history: &AxisHistory, failing: Vec<(f64, f64)>, file: &str) -> (Figure, Figure) {
    let legend = || {
        vec![
            (Pen::Measured, "measured".into()),
            (Pen::Model, "model".into()),
        ]
    };
    let titled = |mut panel: Panel| {
        panel.title = format!("{file}, {}", panel.title);
        panel
    };
    let shaded = !failing.is_empty();
    let mut residual = time_history::residual(history, failing);
    if shaded {
        residual
            .title
            .push_str("; shaded: the stretch that holds half of the error");
    }
    let few_swings = time_history::window(std::slice::from_ref(history));
    let mut near = time_history::compared(history, few_swings);
    near.title = format!(
        "{}: restoring force, the middle of the record",
        history.axis
    );
    let over_time = Figure {
        rows: vec![
            vec![titled(time_history::whole(history))],
            vec![residual],
            vec![near],
        ],
        legend: legend(),
    };
    let swings = time_history::about_largest(history);
    let over: &[Against] = match history.along {
        Along::Time => &[Against::Displacement, Against::Velocity],
        Along::Rows => &[Against::Displacement],
    };
    let phases = Figure {
        rows: vec![
            over.iter()
                .map(|against| phase::compared(history, *against, swings.clone()))
                .collect(),
        ],
        legend: legend(),
    };
    (over_time, phases)
}

/// A record's file as the beginning of file names: its stem in plain letters, with a number where
/// another record has taken it.
fn free_name(file: &str, taken: &mut HashSet<String>) -> String {
    let stem = std::path::Path::new(file).file_stem().unwrap_or_default();
    let stem = plain(&stem.to_string_lossy());
    let mut name = stem.clone();
    let mut number = 2;
    while !taken.insert(name.clone()) {
        name = format!("{stem}-{number}");
        number += 1;
    }
    name
}

/// Letters, digits, underscores and dots of a name; anything else that a file system or a shell
/// might take otherwise becomes an underscore.
fn plain(name: &str) -> String {
    let letter = |c: char| {
        if c.is_alphanumeric() || ".".contains(c) {
            c
        } else {
            '_'
        }
    };
    name.chars().map(letter).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_plain_and_taken_once() {
        let mut taken = HashSet::new();
        assert_eq!(free_name("logs/run 1.csv", &mut taken), "run_1");
        assert_eq!(free_name("other/run 1.csv", &mut taken), "run_1-2");
        assert_eq!(free_name("run/../../x.mat", &mut taken), "x");
        assert_eq!(plain("φ/1"), "φ_1");
    }

    #[test]
    fn a_stretch_is_counted_from_the_first_row_used_and_belongs_to_its_record() {
        let place = FailingRegion {
            axis: "x".into(),
            kind: "time",
            region: String::new(),
            share_of_error: 0.5,
            share_of_rows: 0.1,
            extent: Extent::Time {
                file: "a.csv".into(),
                from_s: 12.0,
                to_s: 13.0,
            },
        };
        let places = [place];
        assert_eq!(failing(&places, "a.csv", 10.0), [(2.0, 3.0)]);
        assert!(failing(&places, "b.csv", 10.0).is_empty());
    }
}
