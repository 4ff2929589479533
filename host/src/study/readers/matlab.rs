//! Reader of MATLAB files of version 5 (`save -v6`, `save -v7`): each numeric vector is a column, and so is each column of a
//! matrix, called `name[1]`, `name[2]`, ….

use crate::study::log::{Column, Request, Table};
use crate::text::error::Result;
use matfile::{Array, MatFile, NumericData};

/// Whether the bytes begin like such a file.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    bytes.starts_with(b"MATLAB 5.0")
}

/// Reads the wanted columns.
pub(super) fn read(request: &Request<'_>, bytes: &[u8]) -> Result<Table> {
    let file = MatFile::parse(bytes).map_err(|e| {
        request.error(format!(
            "is a MATLAB file of version 5 that cannot be read ({e}); it was cut off or damaged, save it again with -v7"
        ))
    })?;
    let mut columns = Vec::new();
    for array in file.arrays() {
        add_columns(request, array, &mut columns)?;
    }
    Ok(Table::whole("MATLAB version 5", columns))
}

/// A vector's one column, or the columns of a matrix with more rows than columns; a scalar is a remark, not a log.
fn add_columns(request: &Request<'_>, array: &Array, columns: &mut Vec<Column>) -> Result<()> {
    let size = array.size();
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
        1 => vec![array.name().to_owned()],
        _ => (1..=parts)
            .map(|part| format!("{}[{part}]", array.name()))
            .collect(),
    };
    let needed = names.iter().any(|name| request.needs(name));
    let values = if needed { real(array.data()) } else { None };
    if needed && values.is_none() {
        if request.wanted.is_none() {
            return Ok(());
        }
        return Err(request.error(format!(
            "holds complex numbers in {:?}; store their real part",
            array.name()
        )));
    }
    for (part, name) in names.into_iter().enumerate() {
        let of_part = |all: &Vec<f64>| all.get(part * rows..(part + 1) * rows).map(<[f64]>::to_vec);
        columns.push(Column {
            values: values
                .as_ref()
                .filter(|_| request.needs(&name))
                .and_then(of_part),
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
