//! Text logs that lie across: every line is a channel, as programs write vectors.

use super::cells::number;
use super::layout::is_comment;
use super::lines;
use super::ways::{Separator, best_way, is_value, split};

/// Channels that a log lying across may have.
const MOST: usize = 32;
/// Rows for every channel that such a log has at least.
const LONG: usize = 16;

/// A log that lies across, with a line for every row; `None` where it stands upright. The name of a
/// channel may stand before its numbers.
pub(super) fn upright(text: &str) -> Option<String> {
    let rows = lines(text).map(|(_, line)| line);
    let rows: Vec<&str> = rows
        .filter(|line| !is_comment(line))
        .take(MOST + 1)
        .collect();
    if rows.is_empty() || rows.len() > MOST || rows.iter().any(|line| line.len() < 2 * LONG) {
        return None;
    }
    let ((separator, decimal), columns) = best_way(&rows);
    if columns < LONG * rows.len() {
        return None;
    }
    let mut channels: Vec<Vec<&str>> = Vec::new();
    for line in rows {
        let mut cells = Vec::new();
        split(line, separator, &mut cells);
        if separator != Separator::Blanks && cells.last().is_some_and(|c| c.is_empty()) {
            cells.pop();
        }
        let is_like = channels.first().is_none_or(|c| c.len() == cells.len());
        if !is_like || !cells[1..].iter().all(|c| is_value(c, decimal)) {
            return None;
        }
        channels.push(cells);
    }
    let cell = |cell: &str| match number(cell, decimal) {
        Some(number) => number.to_string(),
        None => cell.to_owned(),
    };
    let row = |at: usize| {
        let cells: Vec<String> = channels.iter().map(|c| cell(c[at])).collect();
        cells.join("\t")
    };
    let rows: Vec<String> = (0..channels[0].len()).map(row).collect();
    Some(rows.join("\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_many_numbers_are_channels() {
        let numbers = |factor: f64| (0..40).map(move |i| format!("\t{}", factor * f64::from(i)));
        let text = |name: &str, factor| name.to_owned() + &numbers(factor).collect::<String>();
        let one = text("", 0.5);
        let stood = upright(one.trim()).unwrap();
        assert_eq!(stood.lines().nth(39), Some("19.5"));
        let two = format!("{}\n{}\n", text("t", 1.0), text("x", 0.25));
        let stood = upright(&two).unwrap();
        assert_eq!(
            stood.lines().take(3).collect::<Vec<_>>(),
            ["t\tx", "0\t0", "1\t0.25"]
        );
        assert_eq!(upright(&stood), None);
    }
}
