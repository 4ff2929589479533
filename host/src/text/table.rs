//! A small table in plain text: columns as wide as their widest cell, columns of numbers to the
//! right.

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

/// Six significant digits, whatever the size: `95.0791`, `1.80000`, `5.37400e-6`; 0 as `0`.
///
/// Inertias range from a rig's bodies to an electronic oscillator's; a fixed number of decimals
/// would swallow the small ones.
pub fn significant(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        return "0".into();
    }
    if !(1e-3..1e6).contains(&size) {
        return format!("{value:.5e}");
    }
    let decimals = 5 - size.log10().floor() as i32;
    format!("{value:.*}", decimals.max(0) as usize)
}

/// Three significant digits, rounded as a person writes them: without an exponent where a person
/// would not write one.
pub fn rounded(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let digits = 2 - value.abs().log10().floor() as i32;
    match digits {
        ..=0 => {
            let step = 10_f64.powi(-digits);
            let rounded = (value / step).round() * step;
            if rounded.abs() >= 1e7 {
                format!("{value:.2e}")
            } else {
                format!("{rounded:.0}")
            }
        }
        1..=7 => format!("{value:.*}", digits as usize),
        _ => format!("{value:.2e}"),
    }
}

/// Four significant digits: `1.470`, `3.000e-6`; a dash for what is no number.
pub fn short(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if !value.is_finite() {
        return "–".into();
    }
    if (1e-3..1e5).contains(&value.abs()) {
        let decimals = (3 - value.abs().log10().floor() as i32).max(0) as usize;
        return format!("{value:.decimals$}");
    }
    format!("{value:.3e}")
}

/// A percentage with three digits behind the point, or three that count where it is small: `12.346
/// %`, `0.0000254 %`.
pub fn percent(value: f64) -> String {
    match value.abs() {
        0.0 => "0 %".to_owned(),
        size if size >= 0.1 => format!("{value:.3} %"),
        size if size >= 1e-6 => {
            let decimals = 2 - size.log10().floor() as i32;
            format!("{value:.*} %", decimals as usize)
        }
        _ => format!("{value:.2e} %"),
    }
}

/// A frequency in whole hertz, or with the three digits that count below 10 Hz: `40 Hz`, `0.412
/// Hz`.
pub fn hertz(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || size >= 10.0 {
        return format!("{value:.0} Hz");
    }
    let decimals = 2 - size.log10().floor() as i32;
    let digits = format!("{value:.*}", decimals as usize);
    format!("{} Hz", digits.trim_end_matches('0').trim_end_matches('.'))
}

/// A sample rate without the digits that nobody set: `149.8799 Hz`, `500 Hz`.
pub fn sample_rate(hz: f64) -> String {
    let digits = format!("{hz:.4}");
    format!("{} Hz", digits.trim_end_matches('0').trim_end_matches('.'))
}

/// A value in its unit with five significant digits and the prefix that keeps it readable: `1394.2
/// N/m`, `1.5000 mm`.
pub fn value_with_unit(value: f64, unit: &str) -> String {
    let size = value.abs();
    // Thousands of newtons per metre are what the field writes; from a million on a prefix helps.
    let (prefix, factor) = match size {
        _ if unit.is_empty() || unit == "–" || unit == "1" => ("", 1.0),
        0.0 => ("", 1.0),
        _ if size >= 1e9 => ("G", 1e-9),
        _ if size >= 1e6 => ("M", 1e-6),
        _ if size >= 0.1 => ("", 1.0),
        _ if size >= 1e-4 => ("m", 1e3),
        _ if size >= 1e-7 => ("µ", 1e6),
        _ => ("n", 1e9),
    };
    let scaled = value * factor;
    let digits = match scaled.abs() {
        0.0 => "0".to_owned(),
        size if (1e-4..1e6).contains(&size) => {
            let decimals = 4 - size.log10().floor() as i32;
            format!("{scaled:.*}", decimals.max(0) as usize)
        }
        _ => format!("{scaled:.4e}"),
    };
    match unit {
        "" | "–" | "1" => digits,
        // A prefix belongs to the first symbol, and kilogram has one already.
        unit if unit.starts_with("kg") && !prefix.is_empty() => format!("{value:.4e} {unit}"),
        unit => format!("{digits} {prefix}{unit}"),
    }
}

/// A named value with its unit, as in a sentence: `slip_force 3.20000 N`; what has no unit goes
/// without.
pub fn quantity(name: &str, value: f64, unit: &str) -> String {
    let bare = format!("{name} {}", significant(value));
    match unit {
        "" | "–" => bare,
        unit => format!("{bare} {unit}"),
    }
}

/// Whether a cell is a number, perhaps with a unit: `1.25 %`, `18.2 N`, `-3e-4`, but not `valid.csv
/// from 3 s`.
fn is_number(cell: &str) -> bool {
    let mut words = cell.split(' ');
    let number = words.next().is_some_and(|word| word.parse::<f64>().is_ok());
    number && words.count() <= 1
}

/// The first names of a list that there is room for, and how many more there are; one more than
/// that stands in its place.
pub fn first_few(names: &[String], room: usize) -> String {
    if names.len() <= room + 1 {
        return names.join(", ");
    }
    let more = names.len() - room;
    format!("{} and {more} more", names[..room].join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits_as_a_person_writes_them() {
        let seen = [0.000_812_34, 0.8123, 41.26, 123.4, 5123.0, 1.5e-9].map(rounded);
        assert_eq!(
            seen,
            ["0.000812", "0.812", "41.3", "123", "5120", "1.50e-9"]
        );
    }

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
    fn low_frequencies_keep_their_digits() {
        for (value, wanted) in [
            (40.4, "40 Hz"),
            (5.0, "5 Hz"),
            (0.4118, "0.412 Hz"),
            (0.03, "0.03 Hz"),
            (0.0, "0 Hz"),
        ] {
            assert_eq!(hertz(value), wanted);
        }
    }

    #[test]
    fn small_percentages_keep_their_digits() {
        for (value, wanted) in [
            (12.3456, "12.346 %"),
            (0.848, "0.848 %"),
            (2.54e-5, "0.0000254 %"),
            (3.1e-9, "3.10e-9 %"),
            (0.0, "0 %"),
        ] {
            assert_eq!(percent(value), wanted);
        }
    }

    #[test]
    fn values_have_units_and_no_exponents() {
        for (value, unit, wanted) in [
            (1394.43, "N/m", "1394.4 N/m"),
            (14000.8, "N/m", "14001 N/m"),
            (1.49994e-3, "m", "1.4999 mm"),
            (62.5e-6, "s", "62.500 µs"),
            (-0.25, "N", "-0.25000 N"),
            (4.9e6, "N/m", "4.9000 MN/m"),
            (0.0, "N", "0 N"),
            (1.5, "–", "1.5000"),
            (2e-3, "kg", "2.0000e-3 kg"),
        ] {
            assert_eq!(value_with_unit(value, unit), wanted);
        }
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
            (0.0, "0"),
        ] {
            assert_eq!(significant(value), wanted);
        }
        assert_eq!(quantity("exponent", 1.5, "–"), "exponent 1.50000");
    }
}
