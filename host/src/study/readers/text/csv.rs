//! Reader of text logs: perhaps a preface, a heading, perhaps a row of units, then rows of numbers,
//! dates and times.
//!
//! The lines are split here rather than by a CSV library, so that a message names the line of the
//! file that an editor shows, comments and blank lines counted.

use super::cells::{Clock, Decimal, instant, number};
use super::layout::{FURTHER, Layout, TOP, guess, is_comment};
use super::ways::{Separator, split};
use super::{across, blocks, decode, labelled, lines};
use crate::study::log::{Column, NO_HEADING, Numbering, Request, Table, line_name};
use crate::text::error::{Error, Result};
use std::ops::Range;

/// Bytes of a line at the top of a log, and of any line of a long one. A line's cells are compared
/// with each other, and each of them is a name.
pub(super) const LONGEST_LINE: usize = 1 << 20;

/// Bytes looked at further down than the top of a log: in its middle, and at its end.
pub(super) const PART: usize = 1 << 14;

/// Reads the columns that the request needs.
pub(crate) fn read(request: &Request<'_>, bytes: &[u8]) -> Result<Table> {
    let decoded = decode(request, bytes)?;
    let mut table = if let Some(upright) = across::upright(&decoded.text) {
        Table {
            numbering: Numbering::From(1 + request.rows.map_or(0, |[from, _]| from)),
            ..read_text(request, &upright)?
        }
    } else if let Some((names, bare)) = labelled::bared(&decoded.text) {
        Table {
            format: "text, the name before every number".into(),
            ..read_named(request, &bare, Some(names))?
        }
    } else {
        read_text(request, &decoded.text)?
    };
    table.format = format!("{} {}", decoded.encoding, table.format);
    Ok(table)
}

/// The same for a text that is decoded already.
pub(crate) fn read_text(request: &Request<'_>, text: &str) -> Result<Table> {
    read_named(request, text, None)
}

/// The same, of columns whose names stand elsewhere.
fn read_named(request: &Request<'_>, text: &str, heading: Option<Vec<String>>) -> Result<Table> {
    let mut layout = layout_of(request, &Sample::of(text))?;
    layout.heading = heading.or(layout.heading);
    if layout.first_line.is_none() {
        return Err(no_row(request, &layout, text));
    }
    let names = names(request, &layout)?;
    request.locate(&names)?;
    let mut columns = readings(&names, |place| request.needs(&names[place]));
    let body = Body {
        text,
        lines_before: 0,
        rows_before: 0,
        between: blocks::between(text, &layout),
    };
    let (numbering, blocks) = rows(request, body, &layout, &names, &mut columns)?;
    let columns = names
        .into_iter()
        .zip(columns)
        .enumerate()
        .map(|(place, (name, column))| Column {
            name,
            unit: unit(&layout, column.clock.as_ref(), place).map(str::to_owned),
            values: column.wanted.then_some(column.values),
        })
        .collect();
    Ok(Table {
        numbering: Numbering::Lines(numbering),
        cut: true,
        blocks,
        ..Table::whole(format(&layout), columns)
    })
}

/// The unit of a column by its place. Dates and times are counted in seconds, whatever else stands
/// above them.
pub(super) fn unit<'a>(layout: &'a Layout, clock: Option<&Clock>, place: usize) -> Option<&'a str> {
    match clock {
        Some(_) => Some("s"),
        None => layout.units.get(place)?.as_deref(),
    }
}

/// A layout in words.
pub(super) fn format(layout: &Layout) -> String {
    let separator = match layout.separator {
        Separator::Char('\t') => "tabs".to_owned(),
        Separator::Char(c) => format!("\"{c}\""),
        Separator::Blanks => "blanks".to_owned(),
    };
    let decimal = match layout.decimal {
        Decimal::Point => "point",
        Decimal::Comma => "comma",
    };
    format!("text, {separator} between cells, decimal {decimal}")
}

/// The lines of a text by which its layout is guessed.
pub(super) struct Sample<'a> {
    /// The first ones with their numbers.
    top: Vec<(usize, &'a str)>,
    /// Whole ones of the middle and of the end.
    further: Vec<&'a str>,
}

impl<'a> Sample<'a> {
    /// Of a whole text.
    fn of(text: &'a str) -> Self {
        // Found without counting the lines before; a preface is in neither.
        let middle = text.len() / 2;
        let parts = [middle, middle.max(text.len().saturating_sub(PART))].map(|start| {
            let start = (start..text.len()).find(|i| text.is_char_boundary(*i));
            let rest = &text[start.unwrap_or(text.len())..];
            &rest[..rest.floor_char_boundary(PART)]
        });
        Self::of_parts(text, parts.into_iter())
    }

    /// Of the top of a text, and of parts further down that begin and end anywhere in a line.
    pub(super) fn of_parts(top: &'a str, parts: impl Iterator<Item = &'a str>) -> Self {
        let top: Vec<(usize, &str)> = lines(top).take(TOP).collect();
        let mut further: Vec<&str> = parts
            .filter(|_| top.len() == TOP)
            .flat_map(|part| lines(part).skip(1).take(FURTHER / 2).map(|(_, line)| line))
            .collect();
        // The last line of a part may be cut.
        further.pop();
        Self { top, further }
    }
}

/// The layout that a sample shows.
pub(super) fn layout_of(request: &Request<'_>, sample: &Sample<'_>) -> Result<Layout> {
    let mut top = sample.top.iter();
    if let Some((line, _)) = top.find(|(_, line)| line.len() > LONGEST_LINE) {
        return Err(too_long(request, *line));
    }
    if sample.top.iter().all(|(_, line)| is_comment(line)) {
        return Err(request.error("holds only comments; check that the logger finished writing it"));
    }
    Ok(guess(&sample.top, &sample.further))
}

/// What is said of a line that has no end.
pub(super) fn too_long(request: &Request<'_>, line: usize) -> Error {
    request.error_in(
        &line_name(line),
        format!("it is longer than {LONGEST_LINE} bytes, as no row of a log is; check that the lines of the file end"),
    )
}

/// Names of the columns: those that the study states, else those of the heading.
pub(super) fn names(request: &Request<'_>, layout: &Layout) -> Result<Vec<String>> {
    if let Some(columns) = request.columns {
        return Ok(columns.to_vec());
    }
    match &layout.heading {
        Some(heading) => Ok(heading.clone()),
        None => Err(request.error_in(
            &line_name(layout.first_line.unwrap_or(1)),
            format!("{NO_HEADING}; add one, or columns = […] to the [[record]]"),
        )),
    }
}

/// A column while it is read.
pub(super) struct Reading {
    wanted: bool,
    /// Present when the cells are dates or times.
    pub(super) clock: Option<Clock>,
    pub(super) values: Vec<f64>,
}

/// Columns of these names of which nothing was read yet.
pub(super) fn readings(names: &[String], wanted: impl Fn(usize) -> bool) -> Vec<Reading> {
    let reading = |place| Reading {
        wanted: wanted(place),
        clock: None,
        values: Vec::new(),
    };
    (0..names.len()).map(reading).collect()
}

/// Lines of a log, and how much of it stands above them.
pub(super) struct Body<'a> {
    pub(super) text: &'a str,
    pub(super) lines_before: usize,
    pub(super) rows_before: usize,
    /// Lines between its blocks.
    pub(super) between: Vec<Range<usize>>,
}

impl Reading {
    fn take(&mut self, cell: &str, decimal: Decimal, lenient: bool) -> bool {
        if let Some(value) = number(cell, decimal) {
            self.values.push(value);
            return true;
        }
        let at = match &self.clock {
            Some(clock) => clock.instant(cell),
            None => instant(cell),
        };
        if let Some(at) = at
            && (self.clock.is_some() || self.values.iter().all(|v| v.is_nan()))
        {
            let seconds = self.clock.get_or_insert_default().seconds(at);
            self.values.push(seconds);
            return true;
        }
        if lenient {
            self.values.push(f64::NAN);
        }
        lenient
    }
}

/// Reads the rows that the request takes; gives the line of each, and of all rows those with which
/// a further block begins.
pub(super) fn rows(
    request: &Request<'_>,
    body: Body<'_>,
    layout: &Layout,
    names: &[String],
    columns: &mut [Reading],
) -> Result<(Vec<u32>, Vec<usize>)> {
    let first_line = layout.first_line.unwrap_or(1);
    let [from, to] = request.rows.unwrap_or([0, usize::MAX]);
    // Names beyond the cells of most rows are those of columns without cells, as LabVIEW's Comment.
    let unnamed = usize::from(names.last().is_some_and(String::is_empty));
    let least = match request.columns {
        None => layout.numeric.len().min(names.len() - unnamed),
        Some(_) => names.len() - unnamed,
    };
    let mut numbering = Vec::new();
    let mut cells = Vec::with_capacity(names.len());
    let mut total = body.rows_before;
    let (mut between, mut blocks) = (body.between.iter().peekable(), Vec::new());
    let numbered = lines(body.text).map(|(number, line)| (body.lines_before + number, line));
    for (number, line) in numbered.filter(|(n, line)| *n >= first_line && !is_comment(line)) {
        if between.peek().is_some_and(|lines| lines.contains(&number)) {
            continue;
        }
        if between.next_if(|lines| lines.end == number).is_some() {
            blocks.push(total);
        }
        let row = total;
        total += 1;
        if row < from || row >= to {
            continue;
        }
        split(line, layout.separator, &mut cells);
        // A separator at the end of the rows or of the heading alone is no column.
        if cells.len() == names.len() + 1 && cells.last().is_some_and(|c| c.is_empty()) {
            cells.pop();
        } else if (least..names.len()).contains(&cells.len()) {
            cells.resize(names.len(), "");
        }
        if cells.len() != names.len() {
            return Err(wrong_length(
                request,
                number,
                cells.len(),
                names.len(),
                layout,
            ));
        }
        for ((column, cell), name) in columns.iter_mut().zip(&cells).zip(names) {
            let lenient = request.wanted.is_none() || request.sparse && cell.is_empty();
            if column.wanted && !column.take(cell, layout.decimal, lenient) {
                return Err(request.error_at(&line_name(number), name, no_number(cell)));
            }
        }
        numbering.push(number as u32);
    }
    request.range(total)?;
    Ok((numbering, blocks))
}

/// What is said of a text without a row of numbers.
pub(super) fn no_row(request: &Request<'_>, layout: &Layout, text: &str) -> Error {
    if request.path.extension().is_some_and(|e| e == "mat") {
        return request.error(
            "is no MATLAB file and no table of numbers either; save it from MATLAB with -v7 or -v7.3",
        );
    }
    // With nothing below it, the separator was not told.
    let several = |names: &[String]| {
        names.iter().filter(|n| !n.is_empty()).count() > 1
            || names.iter().any(|n| n.contains([',', ';', '\t']))
    };
    match &layout.heading {
        Some(names) if several(names) && lines(text).nth(2).is_none() => {
            request.error("has a heading but no row; check that the logger finished writing it")
        }
        _ => request.error(
            "is text without a table of numbers in it; check that it is a log and not a report or a settings file",
        ),
    }
}

fn no_number(cell: &str) -> String {
    if cell.is_empty() {
        return "the cell is empty; repair the log, leave the row out with rows = […], or, where not every channel has a value in \
                every row, state a rate with time = { column = …, resample_hz = … }"
            .to_owned();
    }
    let with_point = cell.replacen(',', ".", 1);
    if with_point != cell && with_point.parse::<f64>().is_ok() {
        return format!(
            "{cell:?} has a decimal comma where the rest of the log has decimal points, as in {with_point}; repair the log"
        );
    }
    format!("{cell:?} is not a number; repair the log or leave the row out with rows = […]")
}

fn wrong_length(
    request: &Request<'_>,
    number: usize,
    cells: usize,
    heading: usize,
    layout: &Layout,
) -> Error {
    let try_this = if cells < heading {
        "the row is short: repair it, or leave it out with rows = […] if the log was cut off here; where another table begins, keep that in \
         a file of its own"
    } else if layout.separator == Separator::Char(',') {
        "the row is long: repair it, and export with decimal points if the numbers have decimal commas"
    } else {
        "the row is long: repair it, or leave it out with rows = […]"
    };
    let s = if cells == 1 { "" } else { "s" };
    request.error_in(
        &line_name(number),
        format!("{cells} cell{s} where {heading} columns are named; {try_this}"),
    )
}
