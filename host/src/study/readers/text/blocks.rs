//! Text logs in several blocks: test machines write the heading anew above every step of a test,
//! perhaps with a preface of the step's own.

use super::layout::{Layout, holds_numbers};
use super::lines;
use super::ways::split;
use std::ops::Range;

/// The lines of the file that stand between the blocks: from the one after a block's last row up to
/// the first row of the next.
pub(super) fn between(text: &str, layout: &Layout) -> Vec<Range<usize>> {
    let (Some(heading), Some(first)) = (&layout.heading_line, layout.first_line) else {
        return Vec::new();
    };
    let mut found = Vec::new();
    if text.matches(heading.as_str()).nth(1).is_none() {
        return found;
    }
    let mut cells = Vec::new();
    let (mut after_rows, mut is_headed) = (first, false);
    for (number, line) in lines(text).filter(|(number, _)| *number >= first) {
        is_headed |= line == heading;
        split(line, layout.separator, &mut cells);
        if holds_numbers(&cells, layout) {
            if is_headed {
                found.push(after_rows..number);
            }
            (after_rows, is_headed) = (number + 1, false);
        }
    }
    found
}
