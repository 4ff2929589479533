//! Which logs a draft learns from, and which it keeps aside for validation.

use super::parts::{DraftAxis, DraftRecord};
use crate::study::Role;
use crate::study::survey::{Survey, extent};

/// The part of a single record that validates: the last that moves within what the others do.
const SPLIT: f64 = 0.3;
/// The steps in which such a part is looked for.
const STEPS: usize = 10;
/// A part moves within what the others do where it goes beyond by no more than this part of their
/// range.
const WITHIN: f64 = 0.02;
/// A record with fewer rows is not split: its parts would be too short for the study's filters.
const MIN_SPLIT: usize = 1000;
/// Nor is a shorter part made.
const MIN_PART: usize = 300;

/// How words begin that say that a log is kept aside, the clearest first.
const VALIDATION: [&[&str]; 2] = [&["valid"], &["check", "test", "pruef", "prüf", "kontroll"]];

/// Whether a word in the name of a log begins like one of these: `valid2` and `Prüflauf-3`, but not
/// `latest`.
fn is_named(file: &str, starts: &[&str]) -> bool {
    let stem = std::path::Path::new(file).file_stem();
    let stem = stem.map_or(String::new(), |s| s.to_string_lossy().to_lowercase());
    let mut words = stem.split(|c: char| !c.is_alphabetic());
    words.any(|word| word == "val" || starts.iter().any(|start| word.starts_with(start)))
}

/// A clearly shorter record validates, else any, the last that moves and is loaded within what the
/// others are; a single one is split.
pub(super) fn records(surveys: &[Survey], axes: &[DraftAxis]) -> Vec<DraftRecord> {
    let record = |survey: &Survey, role, rows: Option<[usize; 2]>| DraftRecord {
        file: survey.file.clone(),
        role,
        rows: rows.or_else(|| survey.ends_early.then_some([0, survey.rows])),
        columns: survey.states_heading.then(|| survey.heading.clone()),
    };
    if let [only] = surveys
        && only.rows < MIN_SPLIT
    {
        return vec![record(only, Role::Train, None)];
    }
    if let [only] = surveys {
        let [from, to] = kept_aside(only, axes);
        let parts = [
            (Role::Train, [0, from]),
            (Role::Validate, [from, to]),
            (Role::Train, [to, only.rows]),
        ];
        let parts = parts.into_iter().filter(|(_, [from, to])| from < to);
        return parts
            .map(|(role, rows)| record(only, role, Some(rows)))
            .collect();
    }
    let longest = surveys.iter().map(|s| s.rows).max().unwrap_or(0);
    // A name that says so decides, where not all do.
    let named = VALIDATION.iter().find_map(|starts| {
        let all = 0..surveys.len();
        let named: Vec<usize> = all
            .filter(|&i| is_named(&surveys[i].file, starts))
            .collect();
        (!named.is_empty() && named.len() < surveys.len()).then_some(named)
    });
    let is_short = |i: &usize| 10 * surveys[*i].rows < 9 * longest;
    let mut offered: Vec<usize> = (0..surveys.len()).filter(is_short).collect();
    if offered.is_empty() {
        offered = (0..surveys.len()).collect();
    }
    let mut last = offered.iter().rev();
    let within = last.find(|i| is_within(surveys, **i, axes));
    let one = within.or(offered.last());
    let chosen = named.unwrap_or_else(|| one.copied().into_iter().collect());
    surveys
        .iter()
        .enumerate()
        .map(|(i, survey)| {
            let role = if chosen.contains(&i) {
                Role::Validate
            } else {
                Role::Train
            };
            record(survey, role, None)
        })
        .collect()
}

/// Whether one of several records moves and is loaded within what the others are.
fn is_within(surveys: &[Survey], one: usize, axes: &[DraftAxis]) -> bool {
    let channels = axes
        .iter()
        .flat_map(|a| a.displacement.iter().chain(&a.force));
    let mut columns = channels.map(|channel| {
        let ranges = surveys.iter().enumerate();
        let ranges = ranges.filter_map(|(i, s)| Some((i, s.column(&channel.column)?.range)));
        let (own, others): (Vec<_>, Vec<_>) = ranges.partition(|(i, _)| *i == one);
        let hull = |ranges: Vec<(usize, [f64; 2])>| {
            extent(ranges.into_iter().flat_map(|(_, range)| range))
        };
        goes_within(hull(own), hull(others))
    });
    columns.all(|within| within)
}

/// Whether one extent goes beyond another by next to nothing.
fn goes_within([least, most]: [f64; 2], [low, high]: [f64; 2]) -> bool {
    (low - least).max(most - high) <= WITHIN * (high - low)
}

/// The rows of a single record that validate. A test in which the amplitude grows would be judged
/// where nothing was learnt, were it its end.
fn kept_aside(only: &Survey, axes: &[DraftAxis]) -> [usize; 2] {
    let at = |step: usize| only.rows * step / STEPS;
    let long = (SPLIT * STEPS as f64) as usize;
    let displacements: Vec<&[f64]> = axes
        .iter()
        .flat_map(|axis| &axis.displacement)
        .filter_map(|channel| only.column(&channel.column))
        .map(|column| column.values.as_slice())
        .collect();
    let is_within = |&[from, to]: &[usize; 2]| {
        let is_part = |row: usize| (from..to).contains(&row);
        displacements.iter().all(|values| {
            let kept = |kept: bool| {
                let rows = values.iter().enumerate();
                extent(
                    rows.filter(move |(row, _)| is_part(*row) == kept)
                        .map(|(_, v)| *v),
                )
            };
            goes_within(kept(true), kept(false))
        })
    };
    let is_long = |[from, to]: &[usize; 2]| {
        let after = only.rows - to;
        *from >= MIN_PART && (after == 0 || after >= MIN_PART)
    };
    let last = [at(STEPS - long), only.rows];
    let from = (1..=STEPS - long).rev();
    let mut parts = from.map(|step| [at(step), at(step + long)]);
    parts
        .find(|part| is_long(part) && is_within(part))
        .unwrap_or(last)
}
