//! Which logs a draft learns from, and which it keeps aside for validation.

use super::parts::{DraftAxis, DraftRecord};
use crate::study::Role;
use crate::study::survey::Survey;

/// The part of a single record that validates: the last that moves within what the others do.
const SPLIT: f64 = 0.3;
/// The steps in which such a part is looked for.
const STEPS: usize = 10;
/// A part moves within what the others do where it goes beyond by no more than this part of their range.
const WITHIN: f64 = 0.02;
/// A record with fewer rows is not split: its parts would be too short for the study's filters.
const MIN_SPLIT: usize = 1000;
/// Nor is a shorter part made.
const MIN_PART: usize = 300;

/// How words begin that say that a log is kept aside, the clearest first.
const VALIDATION: [&[&str]; 2] = [&["valid"], &["check", "test", "pruef", "prüf", "kontroll"]];

/// Whether a word in the name of a log begins like one of these: `valid2` and `Prüflauf-3`, but not `latest`.
fn is_named(file: &str, starts: &[&str]) -> bool {
    let stem = std::path::Path::new(file).file_stem();
    let stem = stem.map_or(String::new(), |s| s.to_string_lossy().to_lowercase());
    let mut words = stem.split(|c: char| !c.is_alphabetic());
    words.any(|word| word == "val" || starts.iter().any(|start| word.starts_with(start)))
}

/// The shortest record validates, the last of several that are alike; a single one is split.
pub(super) fn records(surveys: &[Survey], axes: &[DraftAxis]) -> Vec<DraftRecord> {
    let record = |survey: &Survey, role, rows| DraftRecord {
        file: survey.file.clone(),
        role,
        rows,
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
    // A name that says so decides, where not all do; then the shortest, when it is clearly shorter; then the last.
    let named = VALIDATION.iter().find_map(|starts| {
        let all = 0..surveys.len();
        let named: Vec<usize> = all
            .filter(|&i| is_named(&surveys[i].file, starts))
            .collect();
        (!named.is_empty() && named.len() < surveys.len()).then_some(named)
    });
    let shortest = surveys.iter().enumerate().min_by_key(|(_, s)| s.rows);
    let shortest = shortest
        .filter(|(_, s)| 10 * s.rows < 9 * longest)
        .map(|(i, _)| i);
    let chosen = named.unwrap_or_else(|| vec![shortest.unwrap_or(surveys.len() - 1)]);
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

/// The rows of a single record that validate. A test in which the amplitude grows would be judged where nothing was learnt, were it its end.
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
            let range = |kept: bool| {
                let rows = values.iter().enumerate();
                rows.filter(|(row, _)| is_part(*row) == kept)
                    .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], (_, v)| {
                        [low.min(*v), high.max(*v)]
                    })
            };
            let ([least, most], [low, high]) = (range(true), range(false));
            (low - least).max(most - high) <= WITHIN * (high - low)
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
