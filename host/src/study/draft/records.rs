//! Which logs a draft learns from, and which it keeps aside for validation.

use super::parts::{DraftAxis, DraftRecord};
use crate::study::Role;
use crate::study::series::extent;
use crate::study::survey::Survey;

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

/// A stretch of a log that is a record, or two where it alone learns and validates.
pub(super) struct Part<'a> {
    survey: &'a Survey,
    rows: [usize; 2],
}

/// The stretches of all logs.
pub(super) fn parts_of<'a>(surveys: &'a [Survey], stretches: &[Vec<[usize; 2]>]) -> Vec<Part<'a>> {
    let of_log = |(survey, rows): (&'a Survey, &Vec<[usize; 2]>)| {
        let each = rows.clone().into_iter();
        each.map(move |rows| Part { survey, rows })
    };
    surveys.iter().zip(stretches).flat_map(of_log).collect()
}

impl Part<'_> {
    fn len(&self) -> usize {
        self.rows[1] - self.rows[0]
    }

    /// The numbers of a column in rows of it.
    fn values(&self, column: &str, [from, to]: [usize; 2]) -> Option<&[f64]> {
        self.survey.column(column)?.values.get(from..to)
    }

    /// A record of some of its rows.
    fn record(&self, role: Role, rows: [usize; 2]) -> DraftRecord {
        let survey = self.survey;
        let is_file = rows == [0, survey.rows] && !survey.is_part;
        DraftRecord {
            file: survey.file.clone(),
            role,
            rows: (!is_file).then_some(rows.map(|row| survey.first_row + row)),
            columns: survey.states_heading.then(|| survey.heading.clone()),
        }
    }
}

/// A clearly shorter record validates, else any, the last that moves and is loaded within what the
/// others are; a single one is split.
pub(super) fn records(parts: &[Part<'_>], axes: &[DraftAxis]) -> Vec<DraftRecord> {
    if let [only] = parts {
        let rows = only.rows;
        if only.len() < MIN_SPLIT {
            return vec![only.record(Role::Train, rows)];
        }
        let [from, to] = kept_aside(only, axes);
        let split = [
            (Role::Train, [rows[0], from]),
            (Role::Validate, [from, to]),
            (Role::Train, [to, rows[1]]),
        ];
        let split = split.into_iter().filter(|(_, [from, to])| from < to);
        return split.map(|(role, rows)| only.record(role, rows)).collect();
    }
    let longest = parts.iter().map(Part::len).max().unwrap_or(0);
    // A name that says so decides, where not all do.
    let named = VALIDATION.iter().find_map(|starts| {
        let all = 0..parts.len();
        let named: Vec<usize> = all
            .filter(|&i| is_named(&parts[i].survey.file, starts))
            .collect();
        (!named.is_empty() && named.len() < parts.len()).then_some(named)
    });
    let is_short = |i: &usize| 10 * parts[*i].len() < 9 * longest;
    let mut offered: Vec<usize> = (0..parts.len()).filter(is_short).collect();
    if offered.is_empty() {
        offered = (0..parts.len()).collect();
    }
    let mut last = offered.iter().rev();
    let within = last.find(|i| is_within(parts, **i, axes));
    let one = within.or(offered.last());
    let chosen = named.unwrap_or_else(|| one.copied().into_iter().collect());
    let role = |i: usize| match chosen.contains(&i) {
        true => Role::Validate,
        false => Role::Train,
    };
    let each = parts.iter().enumerate();
    each.map(|(i, part)| part.record(role(i), part.rows))
        .collect()
}

/// Whether one of several records moves and is loaded within what the others are.
fn is_within(parts: &[Part<'_>], one: usize, axes: &[DraftAxis]) -> bool {
    let channels = axes
        .iter()
        .flat_map(|a| a.displacement.iter().chain(&a.force));
    let mut columns = channels.map(|channel| {
        let ranges = parts.iter().enumerate().filter_map(|(i, part)| {
            let values = part.values(&channel.column, part.rows)?;
            Some((i, extent(values.iter().copied())))
        });
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
fn kept_aside(only: &Part<'_>, axes: &[DraftAxis]) -> [usize; 2] {
    let [first, end] = only.rows;
    let at = |step: usize| first + only.len() * step / STEPS;
    let long = (SPLIT * STEPS as f64) as usize;
    let displacements: Vec<&[f64]> = axes
        .iter()
        .flat_map(|axis| &axis.displacement)
        .filter_map(|channel| only.values(&channel.column, only.rows))
        .collect();
    let is_within = |&[from, to]: &[usize; 2]| {
        let is_part = |row: usize| (from - first..to - first).contains(&row);
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
        let after = end - to;
        from - first >= MIN_PART && (after == 0 || after >= MIN_PART)
    };
    let last = [at(STEPS - long), end];
    let from = (1..=STEPS - long).rev();
    let mut parts = from.map(|step| [at(step), at(step + long)]);
    parts
        .find(|part| is_long(part) && is_within(part))
        .unwrap_or(last)
}
