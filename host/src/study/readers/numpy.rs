//! Reader of NumPy files: `.npz` (each array a column), and `.npy` with named fields or with a
//! matrix, whose columns are 0, 1, ….

use super::{archive, packed};
use crate::study::log::{Column, Request, Table};
use crate::text::error::{Error, Result};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;

/// Whether the bytes begin like an array.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\x93NUMPY")
}

/// Reads an array of its own.
pub(super) fn read(request: &Request<'_>, bytes: &[u8]) -> Result<Table> {
    Ok(Table::whole("NumPy array", array(request, "", bytes)?))
}

/// Reads an archive of arrays.
pub(super) fn read_archive(request: &Request<'_>, entries: &[archive::Entry<'_>]) -> Result<Table> {
    let mut columns = Vec::new();
    let mut total = 0;
    for entry in entries {
        let Some(name) = entry.name.strip_suffix(".npy") else {
            continue;
        };
        let content = entry.content(request)?;
        total += content.len() as u64;
        if total > packed::limit() {
            return Err(request.error(packed::too_large()));
        }
        columns.extend(array(request, name, &content)?);
    }
    Ok(Table::whole("NumPy archive", columns))
}

/// One field of an array: name, how its numbers are read, and where in each element it begins.
struct Field {
    name: String,
    number: Number,
    size: usize,
    offset: usize,
}

/// Reads a number from its first bytes; whoever calls has made sure of their count.
type Number = fn(&[u8]) -> f64;

/// An array as its header describes it: rows of elements, each with one field or with named ones.
pub(super) struct Array {
    fields: Vec<Field>,
    /// Bytes of an element.
    size: usize,
    pub(super) rows: usize,
    across: usize,
    /// Whether columns follow one another, and not rows.
    by_columns: bool,
    /// Where in the file the first element is.
    start: usize,
    /// Bytes of all elements.
    bytes: usize,
    /// Names of the columns: those of fields, of the array or of the study, else numbers.
    pub(super) columns: Vec<String>,
}

/// The columns of one array; arrays that hold no numbers, and scalars, give none.
fn array(request: &Request<'_>, name: &str, bytes: &[u8]) -> Result<Vec<Column>> {
    let array = Array::described(request, name, bytes)?;
    let data = bytes[array.start..].get(..array.bytes);
    let Some(data) = data else {
        return Err(broken(request, name, "that is cut off"));
    };
    let columns = array.columns.iter().enumerate();
    let columns = columns.map(|(place, name)| Column {
        values: request.needs(name).then(|| array.column(place, data)),
        name: name.clone(),
        unit: None,
    });
    Ok(columns.collect())
}

fn broken(request: &Request<'_>, name: &str, what: &str) -> Error {
    request.error(format!(
        "holds a NumPy array {name:?} {what}; write it again with numpy.save"
    ))
}

impl Array {
    /// What the header says, which is at the beginning of `bytes`.
    pub(super) fn described(request: &Request<'_>, name: &str, bytes: &[u8]) -> Result<Self> {
        let broken = |what: &str| broken(request, name, what);
        let long = bytes.get(6) != Some(&1);
        let start = if long { 12 } else { 10 };
        let length = match bytes.get(8..start) {
            Some([a, b]) => usize::from(u16::from_le_bytes([*a, *b])),
            Some([a, b, c, d]) => u32::from_le_bytes([*a, *b, *c, *d]) as usize,
            _ => return Err(broken("that is cut off")),
        };
        let header = bytes
            .get(start..start.saturating_add(length))
            .ok_or_else(|| broken("that is cut off"))?;
        let header = String::from_utf8_lossy(header);
        let shape = after(&header, "'shape':").ok_or_else(|| broken("without a shape"))?;
        let shape: Vec<usize> = shape
            .trim_start_matches(['(', ' '])
            .split(')')
            .next()
            .unwrap_or("")
            .split(',')
            .filter_map(|n| n.trim().parse().ok())
            .collect();
        let described = after(&header, "'descr':").ok_or_else(|| broken("without a type"))?;
        let by_columns = after(&header, "'fortran_order':").is_some_and(|f| f.starts_with("True"));
        let (fields, size) =
            fields(described).ok_or_else(|| broken("of a type that is no number"))?;
        let count = shape
            .iter()
            .try_fold(1_usize, |product, n| product.checked_mul(*n));
        let bytes = count.and_then(|n| n.checked_mul(size));
        let bytes = bytes.ok_or_else(|| broken("that is cut off"))?;
        let named = !fields[0].name.is_empty();
        let (rows, across) = match shape.as_slice() {
            [rows] if *rows > 1 => (*rows, 1),
            [rows, across] if !named && *rows > 1 => (*rows, *across),
            _ => (0, 0),
        };
        let place = |part: usize, field: &Field| match (named, across, name.is_empty()) {
            (true, _, true) => field.name.clone(),
            (true, _, false) => format!("{name}.{}", field.name),
            (false, 1, false) => name.to_owned(),
            (false, _, true) => match request.columns.and_then(|names| names.get(part)) {
                Some(name) => name.clone(),
                None => part.to_string(),
            },
            (false, _, false) => format!("{name}[{}]", part + 1),
        };
        let parts = 0..across;
        let columns = parts.flat_map(|part| fields.iter().map(move |f| (part, f)));
        Ok(Self {
            columns: columns.map(|(part, field)| place(part, field)).collect(),
            start: start + length,
            fields,
            size,
            rows,
            across,
            by_columns,
            bytes,
        })
    }

    /// Where each row of a column begins in the data, and how far apart two rows are; and how its
    /// numbers are read.
    fn layout(&self, column: usize) -> (usize, usize, &Field) {
        let (part, field) = (column / self.fields.len(), column % self.fields.len());
        let field = &self.fields[field];
        let (first, step) = match self.by_columns {
            true => (part * self.rows, 1),
            false => (part, self.across),
        };
        (first * self.size + field.offset, step * self.size, field)
    }

    fn column(&self, column: usize, data: &[u8]) -> Vec<f64> {
        let (first, step, field) = self.layout(column);
        let rows = 0..self.rows;
        rows.map(|row| (field.number)(&data[first + row * step..]))
            .collect()
    }

    /// Some rows of some columns, read where they stand in the file; it may have become shorter
    /// since.
    pub(super) fn stretch(
        &self,
        file: &mut File,
        columns: &[usize],
        rows: Range<usize>,
    ) -> std::io::Result<Vec<Vec<f64>>> {
        let mut all = Vec::new();
        let mut read = (usize::MAX, Vec::new());
        for column in columns {
            let (first, step, field) = self.layout(*column);
            // Rows whose columns stand side by side are read once for all of them.
            let before = if self.by_columns {
                first - field.offset
            } else {
                0
            };
            let begin = self.start + before + rows.start * step;
            if read.0 != begin {
                let mut bytes = vec![0; rows.len() * step];
                file.seek(SeekFrom::Start(begin as u64))?;
                file.read_exact(&mut bytes)?;
                read = (begin, bytes);
            }
            let rows = read.1.chunks_exact(step);
            all.push(
                rows.map(|row| (field.number)(&row[first - before..]))
                    .collect(),
            );
        }
        Ok(all)
    }

    /// Whether a file of so many bytes holds all of it.
    pub(super) fn fits(&self, length: u64) -> bool {
        self.bytes as u64 <= length.saturating_sub(self.start as u64)
    }
}

/// What stands behind a key of the header.
fn after<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    Some(header.split_once(key)?.1.trim_start())
}

/// The fields of a type and the size of an element: `'<f8'`, or `[('t', '<f8'), …]`.
fn fields(described: &str) -> Option<(Vec<Field>, usize)> {
    let field = |name: &str, kind: &str, offset| {
        let (size, number) = number(kind)?;
        Some(Field {
            name: name.to_owned(),
            number,
            size,
            offset,
        })
    };
    if let Some(simple) = described.strip_prefix('\'') {
        let only = field("", simple.split('\'').next()?, 0)?;
        let size = only.size;
        return Some((vec![only], size));
    }
    let list = described.strip_prefix('[')?.split(']').next()?;
    let mut offset = 0;
    let mut found = Vec::new();
    for entry in list.split('(').skip(1) {
        let words: Vec<&str> = entry.split('\'').collect();
        let [_, name, _, kind, ..] = words.as_slice() else {
            return None;
        };
        let field = field(name, kind, offset)?;
        offset += field.size;
        found.push(field);
    }
    (!found.is_empty()).then_some((found, offset))
}

/// How many bytes a number of a kind takes, and how it is read.
fn number(kind: &str) -> Option<(usize, Number)> {
    macro_rules! reader {
        ($type:ty) => {{
            const SIZE: usize = std::mem::size_of::<$type>();
            fn raw(bytes: &[u8]) -> [u8; SIZE] {
                let mut raw = [0; SIZE];
                raw.copy_from_slice(&bytes[..SIZE]);
                raw
            }
            let read: Number = match kind.starts_with('>') {
                true => |bytes| <$type>::from_be_bytes(raw(bytes)) as f64,
                false => |bytes| <$type>::from_le_bytes(raw(bytes)) as f64,
            };
            Some((SIZE, read))
        }};
    }
    match kind.trim_start_matches(['<', '>', '|', '=']) {
        "f8" => reader!(f64),
        "f4" => reader!(f32),
        "i8" => reader!(i64),
        "u8" => reader!(u64),
        "i4" => reader!(i32),
        "u4" => reader!(u32),
        "i2" => reader!(i16),
        "u2" => reader!(u16),
        "i1" => reader!(i8),
        "u1" | "b1" => reader!(u8),
        _ => None,
    }
}
