//! Several runs in one log: test stands and spreadsheets write them side by side, each with the
//! same names above its columns.

use crate::study::survey::Survey;

/// A log for each of the runs in a log; itself where it holds one.
///
/// Every name stands there as often as there are runs, or once: then all runs have the column.
pub(super) fn side_by_side(survey: &Survey) -> Vec<Survey> {
    let times = |name: &str| survey.heading.iter().filter(|n| *n == name).count();
    let named = survey.heading.iter().filter(|name| !name.is_empty());
    let counts: Vec<usize> = named.map(|name| times(name)).collect();
    let runs = counts.iter().copied().max().unwrap_or(1);
    let repeated = counts.iter().filter(|count| **count == runs).count();
    let even = counts.iter().all(|count| [1, runs].contains(count));
    // One name alone that stands there again is the same channel twice, or a slip.
    if runs < 2 || !even || repeated < 2 * runs {
        return vec![survey.clone()];
    }
    (0..runs)
        .map(|run| {
            let mut seen = Vec::new();
            let own = survey.heading.iter().map(|name| {
                let before = seen.iter().filter(|n| *n == name).count();
                seen.push(name.clone());
                times(name) == 1 || before == run
            });
            survey.of_columns(&own.collect::<Vec<bool>>())
        })
        .collect()
}
