//! Records of more rows than a study holds: stretches spread evenly over each stand for it.
//!
//! What a fit needs of millions of rows is in a quarter of a million of them, and memory and time
//! then do not grow with the logs.

use crate::study::description::{Description, RecordEntry};
use crate::study::log::Request;
use crate::study::plan::Plan;
use crate::study::readers::long::{LongLog, is_long};
use crate::text::error::Result;
use crate::text::input;
use std::collections::HashMap;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;
use toml::Spanned;

/// Rows that a study holds.
const HELD: usize = 1 << 18;
/// Rows of a stretch: enough for laws with memory to forget where they began.
const STRETCH: usize = 1 << 14;
/// Fewest stretches of a record, by which slow changes are seen.
const FEWEST: usize = 4;
/// Fewest bytes of a row in a file. A smaller file is not asked how many rows it has.
const ROW_BYTES: u64 = 4;

/// What became of a description's records.
#[derive(Default)]
pub(crate) struct Thinned {
    /// Logs that were opened, and are to be read where their rows stand.
    pub(crate) logs: Vec<Arc<LongLog>>,
    /// What was done, one sentence.
    pub(crate) note: Option<String>,
}

/// Puts stretches in the place of records where all together have more rows than a study holds.
///
/// A record with a second logger, and a log whose format tells nothing before it is read whole,
/// stay as they are.
///
/// # Errors
/// One sentence: a log cannot be read, is damaged, or has not the rows asked for.
pub(crate) fn thin(said: &mut Description, plan: &Plan, folder: &Path) -> Result<Thinned> {
    // No more either than may be read of a file.
    let numbers = 8 * plan.wanted.len().max(1);
    let most = HELD.min(input::limit() as usize / numbers);
    let mut opened: HashMap<String, Arc<LongLog>> = HashMap::new();
    let mut rows: Vec<Option<Range<usize>>> = Vec::new();
    for entry in &said.record {
        let path = folder.join(entry.file.get_ref());
        let request = Request {
            sparse: plan.resample_hz.is_some(),
            ..entry.request(&path, Some(&plan.wanted))
        };
        rows.push(match log_of(&request, plan, most, &mut opened)? {
            Some(log) => Some(request.range(log.rows())?),
            None => None,
        });
    }
    let many: Vec<usize> = rows.iter().flatten().map(Range::len).collect();
    let all: usize = many.iter().sum();
    if all <= most {
        opened.retain(|file, _| is_long(&folder.join(file)));
        return Ok(Thinned {
            logs: opened.into_values().collect(),
            note: None,
        });
    }
    let share = share(&many, most);
    let (mut held, mut shorter) = (0, Vec::new());
    for (entry, rows) in std::mem::take(&mut said.record).into_iter().zip(rows) {
        let Some(rows) = rows else {
            said.record.push(entry);
            continue;
        };
        let stretches = spread(&rows, share);
        held += stretches.iter().map(Range::len).sum::<usize>();
        if stretches.len() > 1 {
            shorter.push(entry.file.get_ref().clone());
        }
        let stretch = |rows: Range<usize>| RecordEntry {
            rows: Some(Spanned::new(0..0, [rows.start, rows.end])),
            file: entry.file.clone(),
            role: entry.role,
            columns: entry.columns.clone(),
        };
        said.record.extend(stretches.into_iter().map(stretch));
    }
    Ok(Thinned {
        logs: opened.into_values().collect(),
        note: Some(format!(
            "of {all} rows {held} are looked at, in stretches spread evenly over {}; rows = […] in a [[record]] chooses others",
            shorter.join(", ")
        )),
    })
}

/// The log of a request, opened once; nothing where it is short, or where its rows are not known
/// before it was read.
fn log_of(
    request: &Request<'_>,
    plan: &Plan,
    most: usize,
    opened: &mut HashMap<String, Arc<LongLog>>,
) -> Result<Option<Arc<LongLog>>> {
    if let Some(log) = opened.get(request.file) {
        return Ok(Some(Arc::clone(log)));
    }
    let about = std::fs::metadata(request.path);
    let large = about.is_ok_and(|a| a.is_file() && a.len() > ROW_BYTES * most as u64);
    let alone = plan
        .loggers
        .iter()
        .all(|logger| !logger.joins(request.file));
    if !(large && alone) {
        return Ok(None);
    }
    let log = LongLog::open(request)?.map(Arc::new);
    if let Some(log) = &log {
        opened.insert(request.file.to_owned(), Arc::clone(log));
    }
    Ok(log)
}

/// The most rows of a record with which all records together have no more than `most`; short ones
/// leave theirs to the others.
fn share(rows: &[usize], most: usize) -> usize {
    let mut rows = rows.to_vec();
    rows.sort_unstable();
    let mut left = most;
    for (count, of_one) in (1..=rows.len()).rev().zip(rows) {
        if of_one > left / count {
            return left / count;
        }
        left -= of_one;
    }
    left
}

/// Stretches spread evenly over some rows, `most` in all; all of the rows where they are no more.
fn spread(rows: &Range<usize>, most: usize) -> Vec<Range<usize>> {
    if rows.len() <= most {
        return vec![rows.clone()];
    }
    let count = (most / STRETCH).max(FEWEST);
    let length = (most / count).max(1);
    let start = |n: usize| rows.start + n * (rows.len() - length) / (count - 1);
    (0..count).map(|n| start(n)..start(n) + length).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_stand_for_a_record_from_its_first_row_to_its_last() {
        assert_eq!(spread(&(5..100), 1_000), vec![5..100; 1]);
        let many = spread(&(7..100_000_007), HELD);
        assert_eq!(many.len(), HELD / STRETCH);
        assert!(many.iter().all(|s| s.len() == STRETCH));
        assert_eq!((many[0].start, many[15].end), (7, 100_000_007));
        let few = spread(&(0..60_000), 20_000);
        assert_eq!(
            few,
            [0..5_000, 18_333..23_333, 36_666..41_666, 55_000..60_000]
        );
    }

    #[test]
    fn short_records_leave_their_share_to_long_ones() {
        assert_eq!(share(&[HELD, HELD], HELD), HELD / 2);
        assert_eq!(share(&[100, 10 * HELD], HELD), HELD - 100);
        assert_eq!(share(&[10 * HELD, 24, 2 * HELD], HELD), (HELD - 24) / 2);
    }
}
