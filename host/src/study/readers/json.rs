//! Reader of JSON logs: a matrix row by row, rows as objects, or an object of columns; alone, under
//! the key `data`, or under another one.
//!
//! The columns of a matrix are called 0, 1, … unless the `[[record]]` names them with `columns =
//! […]`.

use crate::study::log::{Column, Request, Table};
use crate::text::error::Result;
use serde_json::Value;

/// Reads the wanted columns.
pub(super) fn read(request: &Request<'_>, bytes: &[u8]) -> Result<Table> {
    let json: Value = serde_json::from_slice(bytes).map_err(|e| {
        request.error_in(
            &format!("row {} (line of the file)", e.line()),
            format!(
                "this is not JSON ({e}); not-a-number and infinity have no place in JSON, leave such rows out"
            ),
        )
    })?;
    let Some(rows) = rows_in(&json) else {
        return Err(request.error(
            "is JSON without a table of numbers; write the log as {\"data\": [[…], …]}, as a list of objects, or as an object of columns",
        ));
    };
    if rows.count() == 0 {
        return Err(request
            .error("is empty: its data have no row; check that the logger finished writing it"));
    }
    let names = match request.columns {
        Some(columns) => columns.to_vec(),
        None => rows.names(),
    };
    request.locate(&names)?;
    let range = request.range(rows.count())?;
    let mut columns: Vec<Column> = names
        .iter()
        .map(|name| Column {
            name: name.clone(),
            unit: None,
            values: request.needs(name).then(|| vec![f64::NAN; rows.count()]),
        })
        .collect();
    for row in range {
        let row_name = format!("row {} (counted from 1)", row + 1);
        let cells = rows.cells(row);
        if cells.len() != names.len() {
            return Err(request.error_in(
                &row_name,
                format!(
                    "{} numbers where there are {} columns; repair it or leave it out with rows = […]",
                    cells.len(),
                    names.len()
                ),
            ));
        }
        for (column, cell) in columns.iter_mut().zip(cells) {
            let Some(values) = &mut column.values else {
                continue;
            };
            match cell.and_then(number) {
                Some(value) => values[row] = value,
                None if request.wanted.is_none()
                    || (request.sparse && cell.is_none_or(Value::is_null)) => {}
                None => {
                    return Err(request.error_at(
                        &row_name,
                        &column.name,
                        format!(
                            "{} is not a number; repair the log or leave the row out with rows = […]",
                            cell.unwrap_or(&Value::Null)
                        ),
                    ));
                }
            }
        }
    }
    Ok(Table::whole("JSON", columns))
}

/// Whether a document holds a log: not so a model file, which says what it is.
pub(super) fn holds_a_log(json: &Value) -> bool {
    json.get("format").is_none() && rows_in(json).is_some()
}

/// A switch is 0 or 1.
fn number(cell: &Value) -> Option<f64> {
    cell.as_f64()
        .or_else(|| cell.as_bool().map(|on| f64::from(u8::from(on))))
}

/// The rows of a table, as a document holds them.
enum Rows<'a> {
    Matrix(&'a [Value]),
    /// Objects, with the keys of the first.
    Objects(&'a [Value], Vec<&'a String>),
    /// Columns by name, all equally long.
    Columns(Vec<(&'a String, &'a [Value])>),
}

/// The largest table of a document; that under `data` where there is one.
fn rows_in(json: &Value) -> Option<Rows<'_>> {
    match json {
        Value::Array(rows) if rows.iter().all(Value::is_array) => Some(Rows::Matrix(rows)),
        Value::Array(rows) if rows.iter().all(Value::is_object) => {
            let keys = rows.first()?.as_object()?;
            let numbers = keys
                .iter()
                .filter(|(_, v)| number(v).is_some() || v.is_null());
            Some(Rows::Objects(rows, numbers.map(|(key, _)| key).collect()))
        }
        Value::Object(map) => {
            if let Some(data) = map.get("data") {
                return rows_in(data);
            }
            let numbers = |v: &Value| number(v).is_some() || v.is_null();
            let lists = map
                .iter()
                .filter_map(|(key, v)| Some((key, v.as_array()?.as_slice())));
            let mut columns: Vec<_> = lists
                .filter(|(_, v)| v.len() > 1 && v.iter().all(numbers))
                .collect();
            let longest = columns.iter().map(|(_, v)| v.len()).max().unwrap_or(0);
            columns.retain(|(_, v)| v.len() == longest);
            let own = (columns.len() > 1).then_some(Rows::Columns(columns));
            let inner = map.values().filter_map(rows_in);
            inner.chain(own).max_by_key(Rows::count)
        }
        _ => None,
    }
}

impl<'a> Rows<'a> {
    fn count(&self) -> usize {
        match self {
            Self::Matrix(rows) | Self::Objects(rows, _) => rows.len(),
            Self::Columns(columns) => columns.first().map_or(0, |(_, v)| v.len()),
        }
    }

    fn names(&self) -> Vec<String> {
        match self {
            Self::Matrix(rows) => {
                let first = rows.first().and_then(Value::as_array);
                let across = first.map_or(0, Vec::len);
                (0..across).map(|i| i.to_string()).collect()
            }
            Self::Objects(_, keys) => keys.iter().map(|key| (*key).clone()).collect(),
            Self::Columns(columns) => columns.iter().map(|(key, _)| (*key).clone()).collect(),
        }
    }

    fn cells(&self, row: usize) -> Vec<Option<&'a Value>> {
        match self {
            Self::Matrix(rows) => {
                let cells = rows.get(row).and_then(Value::as_array);
                cells.into_iter().flatten().map(Some).collect()
            }
            Self::Objects(rows, keys) => keys.iter().map(|key| rows.get(row)?.get(*key)).collect(),
            Self::Columns(columns) => columns.iter().map(|(_, v)| v.get(row)).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn seen(text: &str) -> String {
        let request = Request {
            file: "log.json",
            path: Path::new("log.json"),
            wanted: None,
            rows: None,
            columns: None,
            memory: None,
            sparse: false,
        };
        match read(&request, text.as_bytes()) {
            Ok(table) => table
                .columns
                .iter()
                .map(|c| format!("{} {:?}", c.name, c.values.as_deref().unwrap_or_default()))
                .collect::<Vec<_>>()
                .join("; "),
            Err(error) => error.sentence,
        }
    }

    #[test]
    fn a_table_is_found_however_it_is_written() {
        let wanted = "F [3.0, 4.0]; x [1.0, 2.0]";
        for text in [
            r#"[{"F": 3, "x": 1}, {"F": 4, "x": 2}]"#,
            r#"{"F": [3, 4], "x": [1, 2], "mass": 7, "name": "a run"}"#,
            r#"{"mass": 7, "entries": [{"F": 3, "x": 1, "on": "yes"}, {"x": 2, "F": 4}]}"#,
            r#"{"run": {"data": {"F": [3, 4], "x": [1, 2]}, "limits": [1, 2, 3]}}"#,
        ] {
            assert_eq!(seen(text), wanted, "{text}");
        }
        assert_eq!(seen("[[1, true], [2, null]]"), "0 [1.0, 2.0]; 1 [1.0, NaN]");
        assert!(seen("{\"mass\": 7}").contains("without a table"));
        assert!(seen("[[1, 2], [3]]").contains("row 2 (counted from 1)"));
        assert!(seen("{\"data\": []}").contains("no row"));
        assert!(seen("[[1, NaN]]").contains("row 1 (line of the file)"));
    }
}
