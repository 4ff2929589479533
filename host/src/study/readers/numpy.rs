//! Reader of NumPy files: `.npz` (each array a column), and `.npy` with named fields or with a matrix, whose columns are 0, 1, ….

use super::{archive, packed};
use crate::study::log::{Column, Request, Table};
use crate::text::error::Result;

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

/// One field of an array: name, type, and where in each element it begins.
struct Field {
    name: String,
    kind: String,
    offset: usize,
}

/// The columns of one array; arrays that hold no numbers, and scalars, give none.
fn array(request: &Request<'_>, name: &str, bytes: &[u8]) -> Result<Vec<Column>> {
    let broken = |what: &str| {
        request.error(format!(
            "holds a NumPy array {name:?} {what}; write it again with numpy.save"
        ))
    };
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
    let data = &bytes[start + length..];
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
    let fortran = after(&header, "'fortran_order':").is_some_and(|f| f.starts_with("True"));
    let (fields, size) = fields(described).ok_or_else(|| broken("of a type that is no number"))?;
    let count = shape
        .iter()
        .try_fold(1_usize, |product, n| product.checked_mul(*n));
    let bytes_needed = count.and_then(|n| n.checked_mul(size));
    let Some(data) = bytes_needed.and_then(|n| data.get(..n)) else {
        return Err(broken("that is cut off"));
    };
    let named = !fields[0].name.is_empty();
    let (rows, across) = match shape.as_slice() {
        [rows] if *rows > 1 => (*rows, 1),
        [rows, across] if !named && *rows > 1 => (*rows, *across),
        _ => return Ok(Vec::new()),
    };
    let mut columns = Vec::new();
    for part in 0..across {
        for field in &fields {
            let column_name = match (named, across, name.is_empty()) {
                (true, _, true) => field.name.clone(),
                (true, _, false) => format!("{name}.{}", field.name),
                (false, 1, false) => name.to_owned(),
                (false, _, true) => match request.columns.and_then(|names| names.get(part)) {
                    Some(name) => name.clone(),
                    None => part.to_string(),
                },
                (false, _, false) => format!("{name}[{}]", part + 1),
            };
            let value = |row: usize| {
                let element = if fortran {
                    part * rows + row
                } else {
                    row * across + part
                };
                number(&field.kind, &data[element * size + field.offset..])
            };
            columns.push(Column {
                values: request
                    .needs(&column_name)
                    .then(|| (0..rows).map(value).collect()),
                name: column_name,
                unit: None,
            });
        }
    }
    Ok(columns)
}

/// What stands behind a key of the header.
fn after<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    Some(header.split_once(key)?.1.trim_start())
}

/// The fields of a type and the size of an element: `'<f8'`, or `[('t', '<f8'), …]`.
fn fields(described: &str) -> Option<(Vec<Field>, usize)> {
    if let Some(simple) = described.strip_prefix('\'') {
        let kind = simple.split('\'').next()?.to_owned();
        let size = size_of(&kind)?;
        let only = Field {
            name: String::new(),
            kind,
            offset: 0,
        };
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
        found.push(Field {
            name: (*name).to_owned(),
            kind: (*kind).to_owned(),
            offset,
        });
        offset += size_of(kind)?;
    }
    (!found.is_empty()).then_some((found, offset))
}

fn size_of(kind: &str) -> Option<usize> {
    let plain = kind.trim_start_matches(['<', '>', '|', '=']);
    match plain {
        "f8" | "i8" | "u8" => Some(8),
        "f4" | "i4" | "u4" => Some(4),
        "i2" | "u2" => Some(2),
        "i1" | "u1" | "b1" => Some(1),
        _ => None,
    }
}

/// The number at the start of `bytes`; whoever calls has made sure of their length.
fn number(kind: &str, bytes: &[u8]) -> f64 {
    let big = kind.starts_with('>');
    macro_rules! read {
        ($type:ty) => {{
            const SIZE: usize = size_of::<$type>();
            let mut raw = [0; SIZE];
            raw.copy_from_slice(&bytes[..SIZE]);
            (if big {
                <$type>::from_be_bytes(raw)
            } else {
                <$type>::from_le_bytes(raw)
            }) as f64
        }};
    }
    use std::mem::size_of;
    match kind.trim_start_matches(['<', '>', '|', '=']) {
        "f8" => read!(f64),
        "f4" => read!(f32),
        "i8" => read!(i64),
        "u8" => read!(u64),
        "i4" => read!(i32),
        "u4" => read!(u32),
        "i2" => read!(i16),
        "u2" => read!(u16),
        "i1" => read!(i8),
        _ => read!(u8),
    }
}
