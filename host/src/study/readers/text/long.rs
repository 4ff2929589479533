//! Text logs too long to be held in memory: where in the file every few thousandth row begins is
//! found once, and any stretch of rows is read from there.

use super::cells::Clock;
use super::csv::{self, Body, LONGEST_LINE, PART, Reading, Sample};
use super::layout::{Layout, is_comment};
use super::{decode, is_blank};
use crate::study::log::Request;
use crate::text::error::Result;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::ops::Range;

/// Rows from one known place in the file to the next.
const APART: usize = 1 << 12;
/// Bytes looked at from the top of the file.
const TOP: u64 = LONGEST_LINE as u64 + 1;
/// Bytes that are read at a time.
const PIECE: usize = 1 << 20;

/// The rows of a text log.
pub(crate) struct Lines {
    pub(crate) rows: usize,
    /// Names of the columns, in the order of the file.
    pub(crate) names: Vec<String>,
    /// As the reader of short logs says it.
    pub(crate) format: String,
    layout: Layout,
    /// Of every [`APART`]th row the byte at which it begins, and the lines above it.
    marks: Vec<(u64, usize)>,
    /// Bytes of the file.
    length: u64,
    /// Of a column of dates and times the clock at its first row.
    clocks: Vec<Option<Clock>>,
}

impl Lines {
    /// The rows of a file that begins with these bytes.
    pub(crate) fn described(request: &Request<'_>, file: &mut File) -> Result<Self> {
        let failed = |e: std::io::Error| request.unreadable(&e);
        let length = file.metadata().map_err(failed)?.len();
        let mut piece = |from: u64, bytes: u64| {
            let mut read = Vec::new();
            file.seek(SeekFrom::Start(from)).map_err(failed)?;
            file.take(bytes).read_to_end(&mut read).map_err(failed)?;
            Ok(read)
        };
        let top = whole_lines(piece(0, TOP)?, length);
        let middle = piece(length / 2, PART as u64)?;
        let end = piece(length.saturating_sub(PART as u64), PART as u64)?;
        let top = decode(request, &top)?;
        let further = [decode(request, &middle)?, decode(request, &end)?];
        let sample = Sample::of_parts(&top.text, further.iter().map(|part| part.text.as_ref()));
        let layout = csv::layout_of(request, &sample)?;
        let Some(first_line) = layout.first_line else {
            return Err(csv::no_row(request, &layout, &top.text));
        };
        let names = csv::names(request, &layout)?;
        let end_of_line = if top.text.contains('\n') {
            b'\n'
        } else {
            b'\r'
        };
        let mut lines = Self {
            rows: 0,
            format: format!("{} {}", top.encoding, csv::format(&layout)),
            layout,
            marks: Vec::new(),
            length,
            clocks: vec![None; names.len()],
            names,
        };
        lines.find(request, file, first_line, end_of_line)?;
        let places: Vec<usize> = (0..lines.names.len()).collect();
        let all = Request {
            wanted: None,
            ..*request
        };
        let first = lines.read(&all, file, &places, 0..1)?;
        lines.clocks = first.into_iter().map(|reading| reading.clock).collect();
        Ok(lines)
    }

    /// Finds where the rows are.
    fn find(
        &mut self,
        request: &Request<'_>,
        file: &mut File,
        first: usize,
        end: u8,
    ) -> Result<()> {
        let failed = |e: std::io::Error| request.unreadable(&e);
        file.seek(SeekFrom::Start(0)).map_err(failed)?;
        let mut bytes = BufReader::with_capacity(PIECE, file);
        let (mut line, mut at) = (Vec::new(), 0);
        for above in 0.. {
            line.clear();
            let mut some = (&mut bytes).take(LONGEST_LINE as u64 + 1);
            let length = some.read_until(end, &mut line).map_err(failed)?;
            if length == 0 {
                break;
            }
            if length > LONGEST_LINE {
                return Err(csv::too_long(request, above + 1));
            }
            if above + 1 >= first && is_row(&line) {
                if self.rows.is_multiple_of(APART) {
                    self.marks.push((at, above));
                }
                self.rows += 1;
            }
            at += length as u64;
        }
        Ok(())
    }

    /// The units that the file states.
    pub(crate) fn unit(&self, place: usize) -> Option<&str> {
        csv::unit(&self.layout, self.clocks[place].as_ref(), place)
    }

    /// Some rows of some columns, by their places.
    pub(crate) fn stretch(
        &self,
        request: &Request<'_>,
        file: &mut File,
        columns: &[usize],
        rows: Range<usize>,
    ) -> Result<Vec<Vec<f64>>> {
        let mut readings = self.read(request, file, columns, rows)?;
        let values = columns
            .iter()
            .map(|place| std::mem::take(&mut readings[*place].values));
        Ok(values.collect())
    }

    /// All columns, with the values of these in some rows.
    fn read(
        &self,
        request: &Request<'_>,
        file: &mut File,
        columns: &[usize],
        rows: Range<usize>,
    ) -> Result<Vec<Reading>> {
        let failed = |e: std::io::Error| {
            request.error(format!("cannot be read ({e}); it was changed meanwhile"))
        };
        let mut readings = csv::readings(&self.names, |place| columns.contains(&place));
        for (reading, clock) in readings.iter_mut().zip(&self.clocks) {
            reading.clock.clone_from(clock);
        }
        let mark = rows.start / APART;
        let Some((from, lines_before)) = self.marks.get(mark) else {
            return Ok(readings);
        };
        let next = self.marks.get(rows.end.div_ceil(APART));
        let to = next.map_or(self.length, |(byte, _)| *byte);
        let mut bytes = Vec::new();
        file.seek(SeekFrom::Start(*from)).map_err(failed)?;
        file.take(to - from)
            .read_to_end(&mut bytes)
            .map_err(failed)?;
        let decoded = decode(request, &bytes)?;
        let body = Body {
            text: &decoded.text,
            lines_before: *lines_before,
            rows_before: mark * APART,
            between: Vec::new(),
        };
        let some = Request {
            rows: Some([rows.start, rows.end]),
            ..*request
        };
        csv::rows(&some, body, &self.layout, &self.names, &mut readings)?;
        Ok(readings)
    }
}

/// The top of a longer file without the line that is cut.
fn whole_lines(mut top: Vec<u8>, length: u64) -> Vec<u8> {
    if (top.len() as u64) < length
        && let Some(last) = top.iter().rposition(|b| matches!(b, b'\n' | b'\r'))
    {
        top.truncate(last);
    }
    top
}

/// Whether a line holds a row of the log.
fn is_row(line: &[u8]) -> bool {
    // A row begins with a digit or a sign nearly always.
    matches!(line.first(), Some(b'0'..=b'9' | b'-' | b'+' | b'.')) || {
        let text = String::from_utf8_lossy(line);
        !is_blank(&text) && !is_comment(&text)
    }
}
