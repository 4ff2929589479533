//! What separates the cells of a text log and the fraction of its numbers: the way in which its
//! lines read best as rows.

use super::cells::{Decimal, instant, number};

/// What stands between cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Separator {
    Char(char),
    /// Any number of blanks and tabs.
    Blanks,
}

/// Every way of writing rows that is tried, the usual first: of two that fit alike the first is
/// taken.
const WAYS: [(Separator, Decimal); 10] = [
    (Separator::Char(','), Decimal::Point),
    (Separator::Char(';'), Decimal::Point),
    (Separator::Char('\t'), Decimal::Point),
    (Separator::Char(';'), Decimal::Comma),
    (Separator::Char('\t'), Decimal::Comma),
    (Separator::Blanks, Decimal::Point),
    (Separator::Blanks, Decimal::Comma),
    (Separator::Char('|'), Decimal::Point),
    // Commas between cells and in quoted numbers.
    (Separator::Char(','), Decimal::Comma),
    (Separator::Char('|'), Decimal::Comma),
];

/// Cells of a line, trimmed, without the quotation marks around them.
pub(super) fn split<'a>(line: &'a str, separator: Separator, cells: &mut Vec<&'a str>) {
    cells.clear();
    // Programs that write matrices end their rows so.
    let line = match separator {
        Separator::Char(';') => line,
        _ => line.strip_suffix(';').unwrap_or(line),
    };
    let delimiter = match separator {
        Separator::Blanks if line.contains('"') => ' ',
        Separator::Blanks => return cells.extend(line.split_whitespace()),
        Separator::Char(c) => c,
    };
    if !line.contains('"') {
        cells.extend(line.split(delimiter).map(str::trim));
        return;
    }
    let mut start = 0;
    let mut quoted = false;
    let mut push = |cell: &'a str| {
        let cell = cell.trim();
        if separator == Separator::Blanks && cell.is_empty() {
            return;
        }
        let inner = cell.strip_prefix('"').and_then(|c| c.strip_suffix('"'));
        cells.push(inner.unwrap_or(cell).trim());
    };
    for (i, c) in line.char_indices() {
        if c == '"' {
            quoted = !quoted;
        } else if c == delimiter && !quoted {
            push(&line[start..i]);
            start = i + c.len_utf8();
        }
    }
    push(&line[start..]);
}

/// Whether a cell holds a number or an instant.
pub(super) fn is_value(cell: &str, decimal: Decimal) -> bool {
    number(cell, decimal).is_some() || instant(cell).is_some()
}

/// The way in which lines read best as rows, and how many columns they then have.
pub(super) fn best_way(lines: &[&str]) -> ((Separator, Decimal), usize) {
    let mut best = ((i64::MIN, 0), WAYS[0], 0);
    for way in WAYS {
        let (score, columns) = fitness(lines, way);
        if score > best.0 {
            best = (score, way, columns);
        }
    }
    (best.1, best.2)
}

/// How well lines read as rows: numbers less twice the words that stand among them, then as few
/// words as may be; with the usual count of cells. A column of words speaks against a separator
/// only beside another by which as many numbers leave none: “0,10;1,5” is 0, a word and 5, or two.
fn fitness(lines: &[&str], (separator, decimal): (Separator, Decimal)) -> ((i64, i64), usize) {
    let mut cells = Vec::new();
    let mut counts = std::collections::BTreeMap::new();
    for line in lines {
        split(line, separator, &mut cells);
        *counts.entry(cells.len()).or_insert(0_usize) += 1;
    }
    let columns = counts
        .iter()
        .max_by_key(|(_, n)| **n)
        .map_or(0, |(c, _)| *c);
    let numeric = numeric_columns(lines, (separator, decimal), columns);
    let (mut score, mut words) = (0_i64, 0_i64);
    for line in lines {
        split(line, separator, &mut cells);
        if cells.len() != columns {
            score -= 1;
            continue;
        }
        // Words alone are a heading or a preface, whatever separates them.
        if !cells.iter().any(|cell| is_value(cell, decimal)) {
            continue;
        }
        let filled = cells.iter().zip(&numeric).filter(|(c, _)| !c.is_empty());
        for (cell, numeric) in filled {
            // “1,234” reads as a thousand with a point and as one and a quarter with a comma: it
            // speaks for neither point.
            let grouped = decimal == Decimal::Point && cell.parse::<f64>().is_err();
            words += i64::from(!is_value(cell, decimal));
            score += match is_value(cell, decimal) {
                true if grouped && instant(cell).is_none() => 0,
                true => 1,
                false if *numeric => -2,
                false => 0,
            };
        }
    }
    ((score, -words), columns)
}

/// Which columns hold numbers in most rows.
pub(super) fn numeric_columns(
    body: &[&str],
    (separator, decimal): (Separator, Decimal),
    columns: usize,
) -> Vec<bool> {
    let mut counts = vec![0; columns];
    let mut cells = Vec::new();
    for line in body {
        split(line, separator, &mut cells);
        for (count, cell) in counts.iter_mut().zip(&cells) {
            *count += usize::from(is_value(cell, decimal));
        }
    }
    counts.iter().map(|count| 2 * count > body.len()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimal_commas_in_two_columns_separate_no_cells() {
        use Separator::{Blanks, Char};
        for (row, separator, decimal) in [
            ("0,10;1,5", Char(';'), Decimal::Comma),
            ("-0,1;1,5E-03", Char(';'), Decimal::Comma),
            ("09:26:53,5;2,5", Char(';'), Decimal::Comma),
            ("-0,1\t0,5", Char('\t'), Decimal::Comma),
            ("-0,1  0,5", Blanks, Decimal::Comma),
            ("0.1,a;b,0.5", Char(','), Decimal::Point),
        ] {
            assert_eq!(best_way(&[row; 9]).0, (separator, decimal), "{row}");
        }
    }
}
