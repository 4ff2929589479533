//! Reader of Excel workbooks (`.xlsx`): the sheet with the most rows, read as the text of its cells.
//!
//! Preface, heading, row of units and dates are then found as in a text log, and a message names the row that Excel shows.

use super::{archive, csv, packed};
use crate::study::log::{Request, Table};
use crate::text::error::Result;
use calamine::{Data, Range, Reader, Xlsx};
use std::fmt::Write as _;
use std::io::Cursor;

/// Reads the columns that the request needs.
pub(super) fn read(request: &Request<'_>, bytes: &[u8]) -> Result<Table> {
    // Sizes in an archive's directory can lie: it is unpacked once up to the limit before the workbook's reader does so without one.
    let mut total = 0;
    for entry in archive::entries(request, bytes)? {
        total += entry.content(request)?.len() as u64;
        if total > packed::limit() {
            return Err(request.error(packed::too_large()));
        }
    }
    let broken = |e: calamine::XlsxError| {
        request.error(format!(
            "is a workbook that cannot be read ({e}); open it in Excel and save it again as .xlsx or CSV"
        ))
    };
    let mut book: Xlsx<_> = Xlsx::new(Cursor::new(bytes)).map_err(broken)?;
    let mut largest: Option<(String, Range<Data>)> = None;
    for name in book.sheet_names() {
        let sheet = book.worksheet_range(&name).map_err(broken)?;
        if largest
            .as_ref()
            .is_none_or(|(_, range)| range.height() < sheet.height())
        {
            largest = Some((name, sheet));
        }
    }
    let Some((name, range)) = largest.filter(|(_, range)| !range.is_empty()) else {
        return Err(request
            .error("is a workbook without a filled sheet; check that the right file was saved"));
    };
    let mut table = csv::read_text(request, &text_of(&range))?;
    table.format = format!("Excel workbook, sheet {name:?}");
    Ok(table)
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

/// Days since 30 December 1899 as a date and time, to the microsecond: Excel's numbers hold no more.
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

    #[test]
    fn days_of_a_workbook_are_dates() {
        assert_eq!(stamp(46095.5, false), "2026-03-14T12:00:00.000000");
        assert_eq!(stamp(0.25, false), "06:00:00.000000");
        assert_eq!(stamp(1.5 / 86_400.0, true), "00:00:01.500000");
    }
}
