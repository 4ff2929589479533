//! A small table in plain text: columns as wide as their widest cell, numbers to the right.

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
        let columns = self.heading.len();
        let width = |column: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(column));
            cells
                .chain([&self.heading[column]])
                .map(|cell| cell.chars().count())
                .max()
                .unwrap_or(0)
        };
        let widths: Vec<usize> = (0..columns).map(width).collect();
        let mut lines = Vec::new();
        for row in std::iter::once(&self.heading).chain(&self.rows) {
            let mut line = String::from(" ");
            for (column, &width) in widths.iter().enumerate() {
                let cell = row.get(column).map_or("", String::as_str);
                let space = " ".repeat(width - cell.chars().count());
                let left = column == 0
                    || !cell.starts_with(|c: char| c.is_ascii_digit() || "-–<".contains(c));
                let heading_of_numbers = std::ptr::eq(row, &self.heading) && column > 0;
                if left && !heading_of_numbers {
                    line.push_str(&format!(" {cell}{space} "));
                } else {
                    line.push_str(&format!(" {space}{cell} "));
                }
            }
            lines.push(line.trim_end().to_string());
        }
        f.write_str(&lines.join("\n"))
    }
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
}
