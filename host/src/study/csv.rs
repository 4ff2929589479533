//! Reader of text logs: a heading, then rows of numbers between commas, semicolons or tabs.
//!
//! The lines are split here rather than by a CSV library, so that a message names the line of the file that an editor
//! shows, comments and blank lines counted.

use super::log::{Log, Numbering, Request, line_name};
use crate::text::error::Result;

/// Reads the wanted columns.
pub(crate) fn read(request: &Request<'_>, bytes: &[u8]) -> Result<Log> {
    let text = text_of(request, bytes)?;
    let mut lines = text
        .lines()
        .enumerate()
        .map(|(i, line)| (i + 1, line))
        .filter(|(_, line)| !line.trim().is_empty() && !line.trim_start().starts_with('#'));
    let mut heading = Vec::new();
    let delimiter;
    if let Some(columns) = request.columns {
        heading.extend(columns.iter().cloned());
        delimiter = lines
            .clone()
            .next()
            .map_or(',', |(_, line)| delimiter_of(line));
    } else {
        let Some((number, line)) = lines.next() else {
            return Err(
                request.error("holds only comments; check that the logger finished writing it")
            );
        };
        delimiter = delimiter_of(line);
        let mut cells = Vec::new();
        split(line, delimiter, &mut cells);
        if cells.iter().all(|c| c.parse::<f64>().is_ok()) {
            return Err(request.error_in(
                &line_name(number),
                "a heading with the columns' names is expected here, not numbers; add one, or columns = […] to the \
                 [[record]]",
            ));
        }
        heading.extend(cells.iter().map(|c| (*c).to_owned()));
    }
    let places = request.locate(&heading)?;
    let [from, to] = request.rows.unwrap_or([0, usize::MAX]);
    let mut values: Vec<Option<Vec<f64>>> = places.iter().map(|p| p.map(|_| Vec::new())).collect();
    let mut numbering = Vec::new();
    let mut cells = Vec::with_capacity(heading.len());
    let mut total = 0;
    for (number, line) in lines {
        let row = total;
        total += 1;
        if row < from || row >= to {
            continue;
        }
        split(line, delimiter, &mut cells);
        if cells.len() != heading.len() {
            return Err(wrong_length(
                request,
                number,
                cells.len(),
                heading.len(),
                delimiter,
            ));
        }
        for (place, series) in places.iter().zip(&mut values) {
            let (Some(place), Some(series)) = (place, series) else {
                continue;
            };
            match cells[*place].parse::<f64>() {
                Ok(value) => series.push(value),
                Err(_) => {
                    return Err(request.error_at(
                        &line_name(number),
                        &heading[*place],
                        no_number(cells[*place]),
                    ));
                }
            }
        }
        numbering.push(number as u32);
    }
    if total == 0 {
        return Err(
            request.error("has a heading but no row; check that the logger finished writing it")
        );
    }
    request.range(total)?;
    Ok(Log {
        values,
        unused: request.unused(&heading),
        numbering: Numbering::Lines(numbering),
    })
}

/// The text without its byte order mark.
fn text_of<'a>(request: &Request<'_>, bytes: &'a [u8]) -> Result<&'a str> {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err(request.error("is UTF-16 text; save it as UTF-8"));
    }
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok(text.strip_prefix('\u{feff}').unwrap_or(text)),
        Err(e) => {
            let before = &bytes[..e.valid_up_to()];
            let line = 1 + before.iter().filter(|b| **b == b'\n').count();
            Err(request.error_in(
                &line_name(line),
                "this is not UTF-8 text; save the log as UTF-8 CSV (.mat and .json files need these endings)",
            ))
        }
    }
}

/// The one of comma, semicolon and tab that stands most often in the first line.
fn delimiter_of(line: &str) -> char {
    let count = |c: char| line.matches(c).count();
    // Of equally many the last wins; commas are the usual case.
    [';', '\t', ',']
        .into_iter()
        .max_by_key(|c| count(*c))
        .unwrap_or(',')
}

/// Cells of a line, trimmed, without the quotation marks around them.
fn split<'a>(line: &'a str, delimiter: char, cells: &mut Vec<&'a str>) {
    cells.clear();
    if !line.contains('"') {
        cells.extend(line.split(delimiter).map(str::trim));
        return;
    }
    let mut start = 0;
    let mut quoted = false;
    let mut push = |cell: &'a str| {
        let cell = cell.trim();
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

fn no_number(cell: &str) -> String {
    if cell.is_empty() {
        return "the cell is empty; repair the log or leave the row out with rows = […]".to_owned();
    }
    let with_point = cell.replacen(',', ".", 1);
    if with_point != cell && with_point.parse::<f64>().is_ok() {
        return format!(
            "{cell:?} has a decimal comma; export the log with decimal points, as in {with_point}"
        );
    }
    format!("{cell:?} is not a number; repair the log or leave the row out with rows = […]")
}

fn wrong_length(
    request: &Request<'_>,
    number: usize,
    cells: usize,
    heading: usize,
    delimiter: char,
) -> crate::text::error::Error {
    let try_this = if cells < heading {
        "the row is short: repair it, or leave it out with rows = […] if the log was cut off here"
    } else if delimiter == ',' {
        "the row is long: repair it, and export with decimal points if the numbers have decimal commas"
    } else {
        "the row is long: repair it, or leave it out with rows = […]"
    };
    request.error_in(
        &line_name(number),
        format!("{cells} cells where {heading} columns are named; {try_this}"),
    )
}
