//! Reader of JSON logs: an object whose key `data` holds a matrix, row by row.
//!
//! The columns are called 0, 1, … unless the `[[record]]` names them with `columns = […]`.

use super::log::{Log, Numbering, Request};
use crate::text::error::Result;
use serde::Deserialize;
use serde_json::Value;

#[derive(Deserialize)]
struct Matrix {
    data: Vec<Vec<Value>>,
}

/// Reads the wanted columns.
pub(crate) fn read(request: &Request<'_>, bytes: &[u8]) -> Result<Log> {
    let matrix: Matrix = serde_json::from_slice(bytes).map_err(|e| {
        request.error_in(
            &format!("row {} (line of the file)", e.line()),
            format!(
                "this is not JSON of the form {{\"data\": [[…], …]}} ({e}); not-a-number and infinity have no place in \
                 JSON, leave such rows out"
            ),
        )
    })?;
    let Some(first) = matrix.data.first() else {
        return Err(request
            .error("is empty: its data have no row; check that the logger finished writing it"));
    };
    let names: Vec<String> = match request.columns {
        Some(columns) => columns.to_vec(),
        None => (0..first.len()).map(|i| i.to_string()).collect(),
    };
    let places = request.locate(&names)?;
    let range = request.range(matrix.data.len())?;
    let numbering = Numbering::From(range.start + 1);
    let mut values: Vec<Option<Vec<f64>>> = places.iter().map(|p| p.map(|_| Vec::new())).collect();
    for (i, row) in matrix.data[range.clone()].iter().enumerate() {
        let row_name = format!("row {} (counted from 1)", range.start + i + 1);
        if row.len() != names.len() {
            return Err(request.error_in(
                &row_name,
                format!(
                    "{} numbers where there are {} columns; repair it or leave it out with rows = […]",
                    row.len(),
                    names.len()
                ),
            ));
        }
        for (place, series) in places.iter().zip(&mut values) {
            let (Some(place), Some(series)) = (place, series) else {
                continue;
            };
            match row[*place].as_f64() {
                Some(value) => series.push(value),
                None => {
                    return Err(request.error_at(
                        &row_name,
                        &names[*place],
                        format!(
                            "{} is not a number; repair the log or leave the row out with rows = […]",
                            row[*place]
                        ),
                    ));
                }
            }
        }
    }
    Ok(Log {
        values,
        unused: request.unused(&names),
        numbering,
    })
}
