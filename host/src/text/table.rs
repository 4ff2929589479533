//! A small table in plain text: columns as wide as their widest cell, columns of numbers to the right.

use std::fmt;

/// Rows of text under a heading.
pub struct Table {
    heading: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty table with these column names.
    pub fn new(heading: &[&str]) -> Self {
        Self {
            heading: heading.iter().map(|h| h.to_string()).collect(),
            rows: Vec::new(),
        }
    }

    /// Adds a row; a row that is too short ends in empty cells.
    pub fn row(&mut self, cells: Vec<String>) {
        self.rows.push(cells);
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let cells = |column: usize| self.rows.iter().filter_map(move |row| row.get(column));
        let columns: Vec<(usize, bool)> = (0..self.heading.len())
            .map(|column| {
                let all = cells(column).chain([&self.heading[column]]);
                let width = all.map(|cell| cell.chars().count()).max().unwrap_or(0);
                (width, cells(column).any(|cell| is_number(cell)))
            })
            .collect();
        let mut lines = Vec::new();
        for row in std::iter::once(&self.heading).chain(&self.rows) {
            let mut line = String::from(" ");
            for (column, &(width, right)) in columns.iter().enumerate() {
                let cell = row.get(column).map_or("", String::as_str);
                let space = " ".repeat(width - cell.chars().count());
                let (before, after) = if right {
                    (space.as_str(), "")
                } else {
                    ("", space.as_str())
                };
                line.push_str(&format!(" {before}{cell}{after} "));
            }
            lines.push(line.trim_end().to_string());
        }
        f.write_str(&lines.join("\n"))
    }
}

/// Six significant digits, whatever the size: `95.0791`, `1.80000`, `5.37400e-6`.
///
/// Inertias range from a rig's bodies to an electronic oscillator's; a fixed number of decimals would swallow the small ones.
pub fn significant(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || !(1e-3..1e6).contains(&size) {
        return format!("{value:.5e}");
    }
    let decimals = 5 - size.log10().floor() as i32;
    format!("{value:.*}", decimals.max(0) as usize)
}

/// A named value with its unit, as in a sentence: `slip_force 3.20000 N`; what has no unit goes without.
pub fn quantity(name: &str, value: f64, unit: &str) -> String {
    let bare = format!("{name} {}", significant(value));
    match unit {
        "" | "–" => bare,
        unit => format!("{bare} {unit}"),
    }
}

/// Whether a cell is a number, perhaps with a unit: `1.25 %`, `18.2 N`, `-3e-4`, but not `valid.csv from 3 s`.
fn is_number(cell: &str) -> bool {
    let mut words = cell.split(' ');
    let number = words.next().is_some_and(|word| word.parse::<f64>().is_ok());
    number && words.count() <= 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up() {
        let mut table = Table::new(&["axis", "NMSE"]);
        table.row(vec!["x".into(), "1.25 %".into()]);
        table.row(vec!["phi".into(), "12.5 %".into()]);
        assert_eq!(
            table.to_string(),
            "  axis    NMSE\n  x     1.25 %\n  phi   12.5 %"
        );
    }
    #[test]
    fn six_digits_are_kept_whatever_the_size() {
        for (value, wanted) in [
            (95.0791023, "95.0791"),
            (1.8, "1.80000"),
            (0.0226, "0.0226000"),
            (5.374e-6, "5.37400e-6"),
            (-123456.0, "-123456"),
            (4.93803e6, "4.93803e6"),
            (0.0, "0.00000e0"),
        ] {
            assert_eq!(significant(value), wanted);
        }
        assert_eq!(quantity("exponent", 1.5, "–"), "exponent 1.50000");
    }
}
