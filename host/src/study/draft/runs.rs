//! Several runs in one log: test stands and spreadsheets write them side by side or one below the
//! other, each with the same names above its columns.

use crate::study::survey::Survey;

/// A log for each of the runs in a log; `None` where it holds one.
///
/// Every column of numbers stands there as often as there are runs, but for a time that they share:
/// a second thermometer makes no second run.
pub(super) fn side_by_side(survey: &Survey) -> Option<Vec<Survey>> {
    let times = |name: &str| survey.heading.iter().filter(|n| *n == name).count();
    let measured = survey.columns.iter();
    let measured = measured.filter(|c| c.missing < c.values.len());
    let counts: Vec<(usize, bool)> = measured
        .map(|c| (times(&c.name), c.named.time > 0))
        .collect();
    let runs = counts.iter().map(|(count, _)| *count).max().unwrap_or(1);
    let repeated = counts.iter().filter(|(count, _)| *count == runs).count();
    let even = counts
        .iter()
        .all(|(count, is_time)| *count == runs || *count == 1 && *is_time);
    // One name alone that stands there again is the same channel twice, or a slip.
    if runs < 2 || !even || repeated < 2 * runs {
        return None;
    }
    let all = (0..runs).map(|run| {
        let own = survey.heading.iter().enumerate().map(|(at, name)| {
            let before = survey.heading[..at].iter().filter(|n| *n == name);
            times(name) == 1 || before.count() == run
        });
        survey.of_columns(&own.collect::<Vec<bool>>())
    });
    Some(all.collect())
}

/// A log for each of the blocks of a log that have a heading of their own.
pub(super) fn one_below_another(survey: &Survey) -> Vec<Survey> {
    let blocks = survey.blocks.iter();
    blocks.map(|rows| survey.of_rows(*rows)).collect()
}
