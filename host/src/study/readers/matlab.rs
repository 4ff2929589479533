//! Reader of MATLAB files of version 5 (`save -v6`, `save -v7`): each numeric vector is a column,
//! and so is each column of a matrix, called `name[1]`, `name[2]`, ….

use super::packed;
use crate::study::log::{Column, Request, Table};
use crate::text::error::Result;
use matfile::{MatFile, NumericData};
use std::io::Read;

/// Whether the bytes begin like such a file.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    bytes.starts_with(b"MATLAB 5.0")
}

/// Reads the wanted columns.
pub(super) fn read(request: &Request<'_>, bytes: &[u8]) -> Result<Table> {
    check_size(request, bytes)?;
    let file = MatFile::parse(bytes).map_err(|e| {
        request.error(format!(
            "is a MATLAB file of version 5 that cannot be read ({e}); it was cut off or damaged, save it again with -v7"
        ))
    })?;
    let wanted = request.wanted;
    let is_asked =
        |name: &str| wanted.is_none_or(|all| all.iter().any(|w| w.column.starts_with(name)));
    let matrices: Vec<Matrix> = file
        .arrays()
        .iter()
        .map(|array| Matrix {
            name: array.name().to_owned(),
            size: array.size().clone(),
            values: is_asked(array.name()).then(|| real(array.data())).flatten(),
        })
        .collect();
    table_of(request, "MATLAB version 5", &matrices)
}

/// A matrix, of any number of dimensions.
pub(super) struct Matrix {
    pub(super) name: String,
    pub(super) size: Vec<usize>,
    /// Column by column; `None` when they are complex.
    pub(super) values: Option<Vec<f64>>,
}

/// What scalars that state a sample rate are called.
const RATES: [&str; 8] = [
    "fs",
    "rate",
    "samplerate",
    "samplingrate",
    "samplefrequency",
    "samplingfrequency",
    "actualrate",
    "timesamplerate",
];

/// The wanted columns of matrices, and the rate that a scalar states.
pub(super) fn table_of(request: &Request<'_>, format: &str, matrices: &[Matrix]) -> Result<Table> {
    let mut columns = Vec::new();
    for matrix in matrices {
        add_columns(request, matrix, &mut columns)?;
    }
    let mut table = Table::whole(format, columns);
    let scalars = matrices
        .iter()
        .filter_map(|matrix| match matrix.values.as_deref() {
            Some([value]) => Some((&matrix.name, *value)),
            _ => None,
        });
    let is_rate = |(name, value): &(&String, f64)| {
        let letters = name.chars().filter(|c| c.is_alphanumeric());
        let plain = letters.collect::<String>().to_lowercase();
        *value > 0.0 && RATES.contains(&plain.as_str())
    };
    table.rate = scalars
        .clone()
        .find(is_rate)
        .map(|(name, hz)| (name.clone(), hz));
    if request.wanted.is_none() {
        // A rate or a gain that whoever describes the log needs.
        table
            .notes
            .extend(scalars.map(|(name, value)| format!("it holds {name} = {value}")));
    }
    Ok(table)
}

/// The type of an element that is packed, and where the elements of a file begin.
const PACKED: u32 = 15;
const HEADER: usize = 128;

/// Refuses a file whose packed elements unpack to more than the limit, without keeping what they
/// hold.
fn check_size(request: &Request<'_>, bytes: &[u8]) -> Result<()> {
    // The two letters that say the order of the bytes stand as they were written.
    let is_big = bytes.get(126..128) == Some(b"MI");
    let word = |at: usize| -> Option<u32> {
        let bytes = bytes.get(at..at.checked_add(4)?)?.try_into().ok()?;
        Some(if is_big {
            u32::from_be_bytes(bytes)
        } else {
            u32::from_le_bytes(bytes)
        })
    };
    let (mut at, mut left) = (HEADER, packed::limit());
    while let (Some(kind), Some(size)) = (word(at), word(at + 4)) {
        let end = (at + 8).saturating_add(size as usize);
        if kind == PACKED {
            let packed = bytes.get(at + 8..end.min(bytes.len())).unwrap_or_default();
            let mut unpacked = flate2::read::ZlibDecoder::new(packed).take(left.saturating_add(1));
            // What is damaged is told by the reader proper.
            let size = std::io::copy(&mut unpacked, &mut std::io::sink()).unwrap_or(0);
            left = left
                .checked_sub(size)
                .ok_or_else(|| request.error(packed::too_large()))?;
        }
        at = end;
    }
    Ok(())
}

/// A vector's one column, or the columns of a matrix with more rows than columns; a scalar is a
/// remark, not a log.
fn add_columns(request: &Request<'_>, matrix: &Matrix, columns: &mut Vec<Column>) -> Result<()> {
    let size = &matrix.size;
    let count: usize = size.iter().product();
    let (rows, parts) = if count <= 1 {
        return Ok(());
    } else if size.contains(&count) {
        (count, 1)
    } else if size.len() == 2 && size[0] > size[1] {
        (size[0], size[1])
    } else {
        return Ok(());
    };
    let names: Vec<String> = match parts {
        1 => vec![matrix.name.clone()],
        _ => (1..=parts)
            .map(|part| format!("{}[{part}]", matrix.name))
            .collect(),
    };
    if names.iter().any(|name| request.needs(name)) && matrix.values.is_none() {
        if request.wanted.is_none() {
            return Ok(());
        }
        return Err(request.error(format!(
            "holds complex numbers in {:?}; store their real part",
            matrix.name
        )));
    }
    for (part, name) in names.into_iter().enumerate() {
        let of_part = |all: &Vec<f64>| all.get(part * rows..(part + 1) * rows).map(<[f64]>::to_vec);
        let values = matrix.values.as_ref().filter(|_| request.needs(&name));
        columns.push(Column {
            values: values.and_then(of_part),
            name,
            unit: None,
        });
    }
    Ok(())
}

/// The numbers, or `None` when they are complex.
fn real(data: &NumericData) -> Option<Vec<f64>> {
    macro_rules! widened {
        ($real:expr, $imag:expr) => {
            $imag
                .is_none()
                .then(|| $real.iter().map(|x| *x as f64).collect())
        };
    }
    match data {
        NumericData::Int8 { real, imag } => widened!(real, imag),
        NumericData::UInt8 { real, imag } => widened!(real, imag),
        NumericData::Int16 { real, imag } => widened!(real, imag),
        NumericData::UInt16 { real, imag } => widened!(real, imag),
        NumericData::Int32 { real, imag } => widened!(real, imag),
        NumericData::UInt32 { real, imag } => widened!(real, imag),
        NumericData::Int64 { real, imag } => widened!(real, imag),
        NumericData::UInt64 { real, imag } => widened!(real, imag),
        NumericData::Single { real, imag } => widened!(real, imag),
        NumericData::Double { real, imag } => imag.is_none().then(|| real.clone()),
    }
}
