//! Log formats: a file or a folder each, all giving a `Table`.
//!
//! The format is recognised by the file's first bytes, never by its name. A file that no reader
//! takes is refused with what it seems to be.

mod archive;
mod arrow;
mod cursor;
mod hdf5;
mod json;
pub(crate) mod long;
mod matlab;
mod matlab4;
mod mdf;
mod numpy;
mod packed;
mod parquet;
mod sheet;
mod tdms;
mod text;
mod universal;

use super::log::{Request, Table};
use crate::text::error::Result;
use std::borrow::Cow;

/// Whether bytes are of a format, and its reader.
type Format = (fn(&[u8]) -> bool, fn(&Request<'_>, &[u8]) -> Result<Table>);

/// The formats that say themselves by their first bytes.
const BINARY: [Format; 9] = [
    (parquet::recognises, parquet::read),
    (arrow::recognises, arrow::read),
    (matlab::recognises, matlab::read),
    (matlab4::recognises, matlab4::read),
    (hdf5::recognises, hdf5::read),
    (mdf::recognises, mdf::read),
    (numpy::recognises, numpy::read),
    (tdms::recognises, tdms::read),
    (universal::recognises, universal::read),
];

/// Reads a log, whichever format it is in.
pub(crate) fn read(request: &Request<'_>, bytes: &[u8]) -> Result<Table> {
    let (bytes, packed) = match bytes {
        [0x1f, 0x8b, ..] => (Cow::Owned(packed::gunzip(request, bytes)?), true),
        _ => (Cow::Borrowed(bytes), false),
    };
    let mut table = read_plain(request, &bytes)?;
    if packed {
        table.format.push_str(", gzip");
    }
    Ok(table)
}

fn read_plain(request: &Request<'_>, bytes: &[u8]) -> Result<Table> {
    if bytes.iter().all(u8::is_ascii_whitespace) {
        return Err(request.error("is empty; check that the logger finished writing it"));
    }
    for (recognises, read) in BINARY {
        if recognises(bytes) {
            return read(request, bytes);
        }
    }
    if bytes.starts_with(b"PK\x03\x04") {
        let entries = archive::entries(request, bytes)?;
        if entries.iter().any(|e| e.name == "xl/workbook.xml") {
            return sheet::read(request, bytes);
        }
        if entries.iter().any(|e| e.name.ends_with(".npy")) {
            return numpy::read_archive(request, &entries);
        }
    }
    if begins_like_json(bytes) {
        return json::read(request, bytes);
    }
    if let Some(seems) = foreign(bytes) {
        return Err(request.error(format!(
            "seems to be {seems}; export the log as CSV, or as one of {FORMATS}"
        )));
    }
    text::csv::read(request, bytes)
}

/// Whether bytes begin like an object or a list of JSON, and not like a table whose first name
/// stands in brackets, as `[s];[mm]` does.
fn begins_like_json(bytes: &[u8]) -> bool {
    let mut visible = bytes.iter().filter(|b| !b.is_ascii_whitespace());
    match (visible.next(), visible.next()) {
        (Some(b'{'), Some(b'"' | b'}')) => true,
        (Some(b'['), Some(next)) => matches!(next, b'[' | b'{' | b']' | b'-' | b'0'..=b'9' | b'"'),
        _ => false,
    }
}

/// Whether bytes that a file begins with are those of a table of text of which every line ends in
/// one known byte.
fn is_text_table(head: &[u8]) -> bool {
    let is_blank = head.iter().all(u8::is_ascii_whitespace);
    !head.starts_with(&[0x1f, 0x8b])
        && !is_blank
        && !begins_like_json(head)
        && BINARY.iter().all(|(recognises, _)| !recognises(head))
        && foreign(head).is_none()
        && text::is_bytewise(head)
}

/// Whether bytes are those of a log rather than of a model file, a blob or anything else.
pub(crate) fn is_a_log(bytes: &[u8]) -> bool {
    match bytes.iter().find(|b| !b.is_ascii_whitespace()) {
        None => false,
        // A model file is an object as well.
        Some(b'{') => json::holds_a_log(bytes),
        Some(_) => {
            bytes.starts_with(&[0x1f, 0x8b])
                || foreign(bytes).is_some()
                || BINARY.iter().any(|(recognises, _)| recognises(bytes))
                || text::is_text(bytes)
        }
    }
}

/// What can be read beside CSV.
const FORMATS: &str =
    "Excel (.xlsx), Parquet, Arrow, MATLAB, HDF5, MDF 4, NumPy, TDMS, Universal File 58 and JSON";

/// What a file is that is no log, by its first bytes.
fn foreign(bytes: &[u8]) -> Option<&'static str> {
    const KNOWN: &[(&[u8], &str)] = &[
        (b"%PDF", "a PDF document"),
        (b"\x89PNG", "a picture (PNG)"),
        (b"\xff\xd8\xff", "a picture (JPEG)"),
        (b"GIF8", "a picture (GIF)"),
        (
            b"\xd0\xcf\x11\xe0",
            "an Excel workbook of before 2007 (.xls) or another old Office file",
        ),
        (b"\x7fELF", "a program"),
        (b"MZ", "a Windows program"),
        (b"PK\x03\x04", "a ZIP archive"),
        (b"Rar!", "a RAR archive"),
        (b"7z\xbc\xaf", "a 7-Zip archive"),
        (b"BZh", "a file packed with bzip2"),
        (b"\xfd7zXZ", "a file packed with xz"),
        (b"\x28\xb5\x2f\xfd", "a file packed with zstd"),
        (b"SQLite format 3", "an SQLite database"),
        (b"<?xml", "XML"),
        (b"<!DOCTYPE", "a web page"),
        (b"<html", "a web page"),
        (b"FEA1", "a Feather file of version 1"),
    ];
    let known = KNOWN.iter().find(|(start, _)| bytes.starts_with(start));
    known.map(|(_, what)| *what)
}
