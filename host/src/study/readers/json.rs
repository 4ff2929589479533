//! Reader of JSON logs: an object whose key `data` holds a matrix, row by row, or such a matrix alone.
//!
//! The columns are called 0, 1, … unless the `[[record]]` names them with `columns = […]`.

use crate::study::log::{Column, Request, Table};
use crate::text::error::Result;
use serde::Deserialize;
use serde_json::Value;

#[derive(Deserialize)]
#[serde(untagged)]
enum Matrix {
    Named { data: Vec<Vec<Value>> },
    Bare(Vec<Vec<Value>>),
}

/// Reads the wanted columns.
pub(super) fn read(request: &Request<'_>, bytes: &[u8]) -> Result<Table> {
    let wrong = |e: serde_json::Error| {
        request.error_in(
            &format!("row {} (line of the file)", e.line()),
            format!(
                "this is not JSON of the form {{\"data\": [[…], …]}} ({e}); not-a-number and infinity have no place in \
                 JSON, leave such rows out"
            ),
        )
    };
    // An untagged enumeration loses the place of a syntax error, so the syntax is checked first.
    serde_json::from_slice::<serde::de::IgnoredAny>(bytes).map_err(wrong)?;
    let data = match serde_json::from_slice(bytes).map_err(wrong)? {
        Matrix::Named { data } | Matrix::Bare(data) => data,
    };
    let Some(first) = data.first() else {
        return Err(request
            .error("is empty: its data have no row; check that the logger finished writing it"));
    };
    let names: Vec<String> = match request.columns {
        Some(columns) => columns.to_vec(),
        None => (0..first.len()).map(|i| i.to_string()).collect(),
    };
    request.locate(&names)?;
    let range = request.range(data.len())?;
    let mut columns: Vec<Column> = names
        .iter()
        .map(|name| Column {
            name: name.clone(),
            unit: None,
            values: request.needs(name).then(|| vec![f64::NAN; data.len()]),
        })
        .collect();
    for (i, row) in data.iter().enumerate().take(range.end).skip(range.start) {
        let row_name = format!("row {} (counted from 1)", i + 1);
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
        for (column, cell) in columns.iter_mut().zip(row) {
            let Some(values) = &mut column.values else {
                continue;
            };
            match cell.as_f64() {
                Some(value) => values[i] = value,
                None if request.wanted.is_none() => {}
                None => {
                    return Err(request.error_at(
                        &row_name,
                        &column.name,
                        format!(
                            "{cell} is not a number; repair the log or leave the row out with rows = […]"
                        ),
                    ));
                }
            }
        }
    }
    Ok(Table::whole("JSON", columns))
}
