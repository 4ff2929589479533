//! Which logs a draft learns from, and which it keeps aside for validation.

use super::parts::{DraftAxis, DraftChannel, DraftRecord};
use crate::study::Role;
use crate::study::series::{extent, spread};
use crate::study::survey::Survey;

/// The part of a single record that validates: the last that moves within what the others do.
const SPLIT: f64 = 0.3;
/// The steps in which such a part is looked for.
const STEPS: usize = 10;
/// A part moves within what the others do where it goes beyond by no more than this part of their
/// range.
const WITHIN: f64 = 0.02;
/// RMS about the mean of a part that validates, in that of the others, at least; at most, the
/// others hold the larger part of all that moves.
const MOVES: f64 = 0.5;
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
/// others are; a single one is split where a part of it may validate, and else trains as a whole.
pub(super) fn records(
    parts: &[Part<'_>],
    axes: &[DraftAxis],
    findings: &mut Vec<String>,
) -> Vec<DraftRecord> {
    if let [only] = parts {
        let rows = only.rows;
        if only.len() < MIN_SPLIT {
            return vec![only.record(Role::Train, rows)];
        }
        let Some([from, to]) = kept_aside(only, axes) else {
            findings.push(
                "no part of the log moves within what the rest of it does and as much, so none of it is kept aside for validation; log another run for that"
                    .into(),
            );
            return vec![only.record(Role::Train, rows)];
        };
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

/// The rows of a single record that validate, where any can: those that move within what the others
/// do, as a test in which the amplitude grows would be judged where nothing was learnt, were it its
/// end; and about as much, as of one event in a log at rest either the model or its error would
/// know nothing.
fn kept_aside(only: &Part<'_>, axes: &[DraftAxis]) -> Option<[usize; 2]> {
    let [first, end] = only.rows;
    let at = |step: usize| first + only.len() * step / STEPS;
    let long = (SPLIT * STEPS as f64) as usize;
    let values = |channel: &DraftChannel| only.values(&channel.column, only.rows);
    let displacements = axes.iter().flat_map(|axis| &axis.displacement);
    let displacements: Vec<&[f64]> = displacements.filter_map(values).collect();
    let forces = axes.iter().filter_map(|axis| values(axis.force.as_ref()?));
    let forces: Vec<&[f64]> = forces.collect();
    let may_validate = |&[from, to]: &[usize; 2]| {
        let split = |values: &[f64]| -> [Vec<f64>; 2] {
            let [before, after] = [&values[..from - first], &values[to - first..]];
            [
                values[from - first..to - first].to_vec(),
                [before, after].concat(),
            ]
        };
        let is_within = |values: &&[f64]| {
            let [kept, others] = split(values).map(|values| extent(values.into_iter()));
            goes_within(kept, others)
        };
        let moves_alike = |values: &&[f64]| {
            let [kept, others] = split(values).map(|values| spread(&values).powi(2));
            let share = (to - from) as f64 / only.len() as f64;
            share * kept <= (1.0 - share) * others && kept >= MOVES * MOVES * others
        };
        displacements.iter().all(is_within) && displacements.iter().chain(&forces).all(moves_alike)
    };
    let is_long = |[from, to]: &[usize; 2]| {
        let after = end - to;
        from - first >= MIN_PART && (after == 0 || after >= MIN_PART)
    };
    let from = (1..=STEPS - long).rev();
    let mut parts = from.map(|step| [at(step), at(step + long)]);
    parts.find(|part| is_long(part) && may_validate(part))
}
