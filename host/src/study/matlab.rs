//! Reader of MATLAB files of version 5 (`save -v6`, `save -v7`): each numeric vector is a column.

use super::log::{Log, Numbering, Request};
use crate::text::error::Result;
use matfile::{Array, MatFile, NumericData};

/// Reads the wanted columns.
pub(crate) fn read(request: &Request<'_>, bytes: &[u8]) -> Result<Log> {
    let file = MatFile::parse(bytes).map_err(|e| {
        request.error(format!(
            "is no MATLAB file of version 5 ({e}); save it with -v7, not -v7.3"
        ))
    })?;
    let columns: Vec<&Array> = file.arrays().iter().filter(|a| is_vector(a)).collect();
    let names: Vec<&str> = columns.iter().map(|a| a.name()).collect();
    let places = request.locate(&names)?;
    let mut values = Vec::new();
    let mut length: Option<(usize, &str)> = None;
    for place in &places {
        let Some(place) = *place else {
            values.push(None);
            continue;
        };
        let Some(series) = real(columns[place].data()) else {
            return Err(request.error(format!(
                "holds complex numbers in {:?}; store their real part",
                names[place]
            )));
        };
        let (rows, other) = *length.get_or_insert((series.len(), names[place]));
        if rows != series.len() {
            return Err(request.error(format!(
                "has {rows} values in {other:?} but {} in {:?}; store vectors of equal length",
                series.len(),
                names[place]
            )));
        }
        values.push(Some(series));
    }
    let total = length.map_or(0, |(rows, _)| rows);
    let range = request.range(total)?;
    for series in values.iter_mut().flatten() {
        *series = series[range.clone()].to_vec();
    }
    Ok(Log {
        values,
        unused: request.unused(&names),
        numbering: Numbering::From(range.start + 1),
    })
}

/// A row or a column of more than one number; a scalar is a remark, not a log.
fn is_vector(array: &Array) -> bool {
    let count: usize = array.size().iter().product();
    count > 1 && array.size().contains(&count)
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
