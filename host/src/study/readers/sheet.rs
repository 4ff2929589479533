//! Reader of Excel workbooks (`.xlsx`): the sheet with the most rows, read as the text of its
//! cells.
//!
//! Preface, heading, row of units and dates are then found as in a text log, and a message names
//! the row that Excel shows.

use super::text::csv;
use super::{archive, packed};
use crate::study::log::{Request, Table};
use crate::text::error::{Error, Result};
use crate::text::guard::unless_it_panics;
use calamine::{Cell, Data, DataRef, Range, Reader, Xlsx};
use std::fmt::Write as _;
use std::io::Cursor;

/// Bytes that a cell takes at least, empty ones as well.
const CELL: u64 = size_of::<Data>() as u64;

/// Reads the columns that the request needs.
pub(super) fn read(request: &Request<'_>, bytes: &[u8]) -> Result<Table> {
    // Sizes in an archive's directory can lie: it is unpacked once up to the limit before the
    // workbook's reader does so without one.
    let mut total = 0;
    for entry in archive::entries(request, bytes)? {
        total += entry.content(request)?.len() as u64;
        if total > packed::limit() {
            return Err(request.error(packed::too_large()));
        }
    }
    let damaged = || Err(broken(request, "a part of it is damaged"));
    let largest = unless_it_panics(|| largest(request, bytes)).unwrap_or_else(damaged)?;
    let Some((name, range)) = largest.filter(|(_, range)| !range.is_empty()) else {
        return Err(request
            .error("is a workbook without a filled sheet; check that the right file was saved"));
    };
    let mut table = csv::read_text(request, &text_of(&range))?;
    table.format = format!("Excel workbook, sheet {name:?}");
    Ok(table)
}

/// The sheet with the most rows, and its name.
fn largest(request: &Request<'_>, bytes: &[u8]) -> Result<Option<(String, Range<Data>)>> {
    let mut book: Xlsx<_> = Xlsx::new(Cursor::new(bytes)).map_err(|e| broken(request, e))?;
    let mut largest: Option<(String, Range<Data>)> = None;
    for name in book.sheet_names() {
        let sheet = cells(request, &mut book, &name)?;
        if largest
            .as_ref()
            .is_none_or(|(_, range)| range.height() < sheet.height())
        {
            largest = Some((name, sheet));
        }
    }
    Ok(largest)
}

fn broken(request: &Request<'_>, error: impl std::fmt::Display) -> Error {
    request.error(format!(
        "is a workbook that cannot be read ({error}); open it in Excel and save it again as .xlsx or CSV"
    ))
}

/// The filled cells of a sheet side by side; none of a page that is a chart.
///
/// Refused before it is made where it is larger than the limit: two cells far apart, or one long
/// text in many, take a few bytes of the file.
fn cells(request: &Request<'_>, book: &mut Xlsx<Cursor<&[u8]>>, name: &str) -> Result<Range<Data>> {
    let broken = |e| broken(request, e);
    let mut reader = match book.worksheet_cells_reader(name) {
        Err(calamine::XlsxError::NotAWorksheet(_)) => return Ok(Range::default()),
        reader => reader.map_err(broken)?,
    };
    let (mut cells, mut last, mut words) = (Vec::new(), [0_u64; 2], 0_u64);
    while let Some(cell) = reader.next_cell().map_err(broken)? {
        words += match cell.get_value() {
            DataRef::Empty => continue,
            DataRef::SharedString(text) => text.len() as u64,
            _ => 0,
        };
        let (row, column) = cell.get_position();
        last = [last[0].max(row.into()), last[1].max(column.into())];
        // From the first cell on: what stands above becomes empty lines.
        let [rows, columns] = last.map(|index| index + 1);
        let bytes = CELL
            .saturating_mul(rows.saturating_mul(columns))
            .saturating_add(words);
        if bytes > packed::limit() {
            return Err(request.error(packed::too_large()));
        }
        cells.push(Cell::new((row, column), cell.get_value().clone().into()));
    }
    Ok(Range::from_sparse(cells))
}

/// The sheet's cells between tabs; lines are counted as Excel counts rows.
fn text_of(range: &Range<Data>) -> String {
    let above = range.start().map_or(0, |(row, _)| row);
    let mut text = "\n".repeat(above as usize);
    for row in range.rows() {
        for (place, cell) in row.iter().enumerate() {
            if place > 0 {
                text.push('\t');
            }
            let _ = match cell {
                Data::Empty => Ok(()),
                Data::Int(value) => write!(text, "{value}"),
                Data::Float(value) => write!(text, "{value:?}"),
                Data::Bool(value) => write!(text, "{}", u8::from(*value)),
                Data::DateTime(at) => write!(text, "{}", stamp(at.as_f64(), at.is_duration())),
                Data::String(words) | Data::DateTimeIso(words) | Data::DurationIso(words) => {
                    write!(text, "{}", words.replace(['\t', '\n', '\r', '"'], " "))
                }
                other => write!(text, "{other}"),
            };
        }
        text.push('\n');
    }
    text
}

/// Days since 30 December 1899 as a date and time, to the microsecond: Excel's numbers hold no
/// more.
fn stamp(days: f64, duration: bool) -> String {
    let microseconds = (days * 86_400e6).round() as i64;
    let (whole, part) = (
        microseconds.div_euclid(86_400_000_000),
        microseconds.rem_euclid(86_400_000_000),
    );
    let (seconds, fraction) = (part / 1_000_000, part % 1_000_000);
    let (hours, minutes, seconds) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    if duration || whole == 0 {
        return format!(
            "{:02}:{minutes:02}:{seconds:02}.{fraction:06}",
            24 * whole + hours
        );
    }
    let first = jiff::civil::date(1899, 12, 30);
    let date = jiff::Span::new()
        .try_days(whole)
        .and_then(|days| first.checked_add(days));
    match date {
        Ok(date) => format!("{date}T{hours:02}:{minutes:02}:{seconds:02}.{fraction:06}"),
        Err(_) => format!("{days:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ZIP archive of unpacked files.
    fn archive(files: &[(String, Vec<u8>)]) -> Vec<u8> {
        let (mut bytes, mut directory) = (Vec::new(), Vec::new());
        for (name, content) in files {
            let mut crc = flate2::Crc::new();
            crc.update(content);
            let [sum, size] = [crc.sum(), content.len() as u32].map(u32::to_le_bytes);
            let length = (name.len() as u16).to_le_bytes();
            // Version, flags, method, time and date, checksum, sizes, length of the name and of
            // nothing else.
            let head = [
                &[20, 0, 0, 0, 0, 0, 0, 0, 0, 0],
                &sum[..],
                &size,
                &size,
                &length,
                &[0; 2],
            ]
            .concat();
            let at = (bytes.len() as u32).to_le_bytes();
            let entry = [
                b"PK\x01\x02\x14\0",
                &head[..],
                &[0; 10],
                &at,
                name.as_bytes(),
            ];
            directory.extend(entry.concat());
            bytes.extend([b"PK\x03\x04", &head[..], name.as_bytes(), content].concat());
        }
        let count = (files.len() as u16).to_le_bytes();
        let [size, at] = [directory.len() as u32, bytes.len() as u32].map(u32::to_le_bytes);
        let end = [
            b"PK\x05\x06",
            &[0; 4][..],
            &count,
            &count,
            &size,
            &at,
            &[0; 2],
        ];
        [bytes, directory, end.concat()].concat()
    }

    /// What is read of the log of the tests with these words replaced in its files and these files
    /// besides: the format, or why not.
    fn read_changed(replaced: &[(&str, &str)], more: &[(&str, &str)]) -> String {
        let path = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../tests/data/logs/record.xlsx"
        );
        let request = Request {
            file: "record.xlsx",
            path: std::path::Path::new(path),
            wanted: None,
            rows: None,
            columns: None,
            memory: None,
            sparse: false,
        };
        let sound = std::fs::read(path).unwrap();
        let file = |entry: &archive::Entry<'_>| {
            let content = entry.content(&request).unwrap();
            let content = match std::str::from_utf8(&content) {
                Ok(text) => {
                    let mut text = text.to_owned();
                    for (old, new) in replaced {
                        text = text.replace(old, new);
                    }
                    text.into_bytes()
                }
                Err(_) => content.into_owned(),
            };
            (entry.name.clone(), content)
        };
        let entries = archive::entries(&request, &sound).unwrap();
        let mut files: Vec<_> = entries.iter().map(file).collect();
        let more = more.iter();
        files.extend(more.map(|(name, text)| ((*name).into(), text.as_bytes().to_vec())));
        match read(&request, &archive(&files)) {
            Ok(table) => table.format,
            Err(error) => error.sentence,
        }
    }

    #[test]
    fn two_cells_far_apart_are_refused_before_what_is_between_them_takes_memory() {
        let with = |row: &str, cell: &str| {
            let more = format!("<row r=\"{row}\"><c r=\"{cell}\"><v>1</v></c></row></sheetData>");
            read_changed(&[("</sheetData>", &more)], &[])
        };
        let near = with("502", "A502");
        assert!(!near.contains("unpacks"), "{near}");
        for (row, cell) in [("1048576", "XFD1048576"), ("4000000000", "A4000000000")] {
            let far = with(row, cell);
            assert!(far.contains("unpacks to more than"), "{cell}: {far}");
        }
    }

    #[test]
    fn a_page_that_is_a_chart_is_passed_over() {
        let office = "http://schemas.openxmlformats.org/officeDocument/2006/relationships";
        let sheet = format!(
            "<sheet xmlns:r=\"{office}\" name=\"Chart\" sheetId=\"2\" r:id=\"rId9\"/></sheets>"
        );
        let relation = format!(
            "<Relationship Type=\"{office}/chartsheet\" Target=\"chartsheets/sheet1.xml\" Id=\"rId9\"/></Relationships>"
        );
        let replaced = [
            ("</sheets>", sheet.as_str()),
            ("</Relationships>", relation.as_str()),
        ];
        let main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main";
        let chart = format!("<chartsheet xmlns=\"{main}\"><sheetViews/></chartsheet>");
        let seen = read_changed(&replaced, &[("xl/chartsheets/sheet1.xml", &chart)]);
        assert_eq!(seen, "Excel workbook, sheet \"Sheet\"");
    }

    #[test]
    fn days_of_a_workbook_are_dates() {
        assert_eq!(stamp(46095.5, false), "2026-03-14T12:00:00.000000");
        assert_eq!(stamp(0.25, false), "06:00:00.000000");
        assert_eq!(stamp(1.5 / 86_400.0, true), "00:00:01.500000");
    }
}
