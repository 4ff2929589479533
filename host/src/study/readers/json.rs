//! Reader of JSON logs: a matrix row by row, rows as objects, an object a line, or an object of
//! columns; alone, under the key `data`, or under another one. Several tables with the same columns
//! are runs, one below the other.
//!
//! The columns of a matrix are called 0, 1, … unless the `[[record]]` names them with `columns =
//! […]`. Where a field is a vector its elements are `q[1]`, `q[2]`, …, and where it is an object
//! its own fields are `motor.q`.

use crate::study::log::{Column, Request, Table};
use crate::text::error::Result;
use serde_json::{Deserializer, Map, Value};

/// Elements of a vector that are columns; a longer one is a signal of its own.
const MAX_ELEMENTS: usize = 64;

/// Reads the wanted columns.
pub(super) fn read(request: &Request<'_>, bytes: &[u8]) -> Result<Table> {
    let json = document(bytes).map_err(|e| {
        request.error_in(
            &format!("row {} (line of the file)", e.line()),
            format!(
                "this is not JSON ({e}); not-a-number and infinity have no place in JSON, leave such rows out"
            ),
        )
    })?;
    let Some(runs) = runs_in(&json) else {
        return Err(request.error(
            "is JSON without a table of numbers; write the log as {\"data\": [[…], …]}, as a list of objects, or as an object of columns",
        ));
    };
    let total = runs.tables.iter().map(|run| run.count).sum();
    if total == 0 {
        return Err(request
            .error("is empty: its data have no row; check that the logger finished writing it"));
    }
    let names = match request.columns {
        Some(columns) => columns.to_vec(),
        None => runs.names(),
    };
    request.locate(&names)?;
    let range = request.range(total)?;
    let mut columns: Vec<Column> = names
        .iter()
        .map(|name| Column {
            name: name.clone(),
            unit: None,
            values: request.needs(name).then(|| vec![f64::NAN; total]),
        })
        .collect();
    let mut starts = Vec::new();
    let mut before = 0;
    for run in &runs.tables {
        starts.push(before);
        let [from, to] = [range.start, range.end].map(|row| row.clamp(before, before + run.count));
        for row in from..to {
            read_row(request, (run, row - before), row, &mut columns)?;
        }
        before += run.count;
    }
    Ok(Table {
        blocks: starts.split_off(1),
        ..Table::whole(runs.format(), columns)
    })
}

/// Reads a row of a run to a row of the columns.
fn read_row(
    request: &Request<'_>,
    (run, own): (&Rows<'_>, usize),
    row: usize,
    columns: &mut [Column],
) -> Result<()> {
    let row_name = format!("row {} (counted from 1)", row + 1);
    let across = run.across(own);
    if across != columns.len() {
        return Err(request.error_in(
            &row_name,
            format!(
                "{across} numbers where there are {} columns; repair it or leave it out with rows = […]",
                columns.len()
            ),
        ));
    }
    for (column, field) in columns.iter_mut().zip(&run.fields) {
        let Some(values) = &mut column.values else {
            continue;
        };
        let cell = run.cell(field, own);
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
    Ok(())
}

/// One document; of several, as where every line is one, the list of them.
fn document(bytes: &[u8]) -> serde_json::Result<Value> {
    let mut each = Deserializer::from_slice(bytes)
        .into_iter()
        .collect::<serde_json::Result<Vec<Value>>>()?;
    Ok(match each.len() {
        1 => each.remove(0),
        _ => Value::Array(each),
    })
}

/// Whether the bytes of a file hold a log: not so a model file, which says what it is.
pub(super) fn holds_a_log(bytes: &[u8]) -> bool {
    document(bytes).is_ok_and(|json| json.get("format").is_none() && runs_in(&json).is_some())
}

/// A switch is 0 or 1.
fn number(cell: &Value) -> Option<f64> {
    cell.as_f64()
        .or_else(|| cell.as_bool().map(|on| f64::from(u8::from(on))))
}

/// A table of numbers in a document.
struct Rows<'a> {
    /// The key that it stands under; nothing for a document that is the table.
    key: &'a str,
    holder: Holder<'a>,
    count: usize,
    fields: Vec<Field<'a>>,
}

/// What holds the rows.
enum Holder<'a> {
    /// A list of rows, which are lists themselves or objects.
    List(&'a [Value]),
    /// Columns by name.
    Columns(&'a Map<String, Value>),
}

/// A column: where in a row its number stands, or for columns by name in which of them, and where
/// in an element of it.
#[derive(Clone, Default)]
struct Field<'a> {
    name: String,
    path: Vec<Step<'a>>,
}

/// A step down in a document.
#[derive(Clone, Copy)]
enum Step<'a> {
    Key(&'a str),
    Element(usize),
}

impl Step<'_> {
    fn of<'b>(&self, value: &'b Value) -> Option<&'b Value> {
        match *self {
            Self::Key(key) => value.get(key),
            Self::Element(place) => value.get(place),
        }
    }
}

impl<'a> Field<'a> {
    /// The field one step further down.
    fn down(&self, step: Step<'a>) -> Self {
        let name = match (self.name.as_str(), step) {
            ("", Step::Key(key)) => key.to_owned(),
            ("", Step::Element(place)) => place.to_string(),
            (name, Step::Key(key)) => format!("{name}.{key}"),
            (name, Step::Element(place)) => format!("{name}[{}]", place + 1),
        };
        let path = [&self.path[..], &[step]].concat();
        Self { name, path }
    }

    /// This field and those below it that hold a number in a first row, or none yet.
    fn all(self, first: &'a Value) -> Vec<Self> {
        match first {
            Value::Object(map) => map
                .iter()
                .flat_map(|(key, value)| self.down(Step::Key(key)).all(value))
                .collect(),
            Value::Array(elements) if elements.len() <= MAX_ELEMENTS => (elements.iter())
                .enumerate()
                .flat_map(|(place, value)| self.down(Step::Element(place)).all(value))
                .collect(),
            Value::Number(_) | Value::Bool(_) | Value::Null => vec![self],
            _ => Vec::new(),
        }
    }
}

/// The tables of a document that are read, and the keys of those that are not.
struct Runs<'a> {
    tables: Vec<Rows<'a>>,
    left: Vec<&'a str>,
}

impl Runs<'_> {
    fn names(&self) -> Vec<String> {
        let first = self.tables.first();
        first.map_or_else(Vec::new, Rows::names)
    }

    /// The format in words, with the tables that the file holds where it holds several.
    fn format(&self) -> String {
        let quoted = |keys: &[&str]| {
            let keys: Vec<String> = keys.iter().map(|key| format!("{key:?}")).collect();
            keys.join(", ")
        };
        let read: Vec<&str> = self.tables.iter().map(|table| table.key).collect();
        let tables = match read.as_slice() {
            [_] if self.left.is_empty() => String::new(),
            [key] => format!(", its table {key:?}"),
            [first, others @ ..] if others.contains(first) => {
                format!(", {} tables one below the other", read.len())
            }
            keys => format!(", the tables {} one below the other", quoted(keys)),
        };
        let left = match self.left.is_empty() {
            true => String::new(),
            false => format!(", without {} of other columns", quoted(&self.left)),
        };
        format!("JSON{tables}{left}")
    }
}

/// The largest table of a document, or that under `data` where there is one, and those that have
/// the same columns.
fn runs_in(json: &Value) -> Option<Runs<'_>> {
    let tables = tables_in(json, "");
    let largest = tables.iter().max_by_key(|table| table.count)?.names();
    let (tables, others): (Vec<_>, Vec<_>) =
        (tables.into_iter()).partition(|table| table.names() == largest);
    let left = others.iter().filter(|table| table.count > 0);
    Some(Runs {
        tables,
        left: left.map(|table| table.key).collect(),
    })
}

/// The tables of what stands under a key.
fn tables_in<'a>(json: &'a Value, key: &'a str) -> Vec<Rows<'a>> {
    match json {
        Value::Array(rows) if rows.iter().all(|r| r.is_array() || r.is_object()) => {
            // A list of runs, whose signals stand in each; of one run, whatever their length.
            let runs: Vec<Rows<'_>> = match rows.iter().all(Value::is_object) {
                true => rows.iter().flat_map(|run| tables_in(run, key)).collect(),
                false => Vec::new(),
            };
            let long = MAX_ELEMENTS.max(rows.len());
            if runs.iter().any(|run| rows.len() == 1 || run.count > long) {
                return runs;
            }
            let first = rows.first();
            let fields = first.map_or_else(Vec::new, |first| Field::default().all(first));
            let is_table = first.is_none_or(Value::is_array) || !fields.is_empty();
            let table = is_table.then_some(Rows {
                key,
                holder: Holder::List(rows),
                count: rows.len(),
                fields,
            });
            table.into_iter().collect()
        }
        Value::Object(map) => {
            if let Some(data) = map.get("data") {
                return tables_in(data, key);
            }
            let own = columns_of(map, key);
            let is_own = |key: &str| own.as_ref().is_some_and(|own| own.holds(key));
            let others = map.iter().filter(|(key, _)| !is_own(key));
            let inner = others.flat_map(|(key, value)| tables_in(value, key));
            let inner: Vec<Rows<'_>> = inner.collect();
            inner.into_iter().chain(own).collect()
        }
        _ => Vec::new(),
    }
}

/// The longest signals of an object, of numbers or of vectors, where there is more than one; a
/// matrix alone is a table.
fn columns_of<'a>(map: &'a Map<String, Value>, key: &'a str) -> Option<Rows<'a>> {
    let lists = map
        .iter()
        .filter_map(|(key, v)| Some((key, v.as_array()?)))
        .filter(|(_, list)| list.len() > 1);
    let mut found: Vec<(usize, Vec<Field<'_>>)> = Vec::new();
    for (key, list) in lists {
        let begun = Field::default().down(Step::Key(key));
        let plain = |v: &Value| number(v).is_some() || v.is_null();
        let fields = match list.iter().all(plain) {
            true => vec![begun],
            false if list.iter().all(Value::is_array) => begun.all(&list[0]),
            false => continue,
        };
        found.push((list.len(), fields));
    }
    let count = found.iter().map(|(count, _)| *count).max()?;
    found.retain(|(length, _)| *length == count);
    let signals = found.len();
    let fields = found.into_iter().flat_map(|(_, fields)| fields);
    (signals > 1).then_some(Rows {
        key,
        holder: Holder::Columns(map),
        count,
        fields: fields.collect(),
    })
}

impl<'a> Rows<'a> {
    fn names(&self) -> Vec<String> {
        self.fields.iter().map(|field| field.name.clone()).collect()
    }

    /// Whether it is made of what stands under a key.
    fn holds(&self, key: &str) -> bool {
        let is_below = |field: &Field<'_>| matches!(field.path[0], Step::Key(own) if own == key);
        self.fields.iter().any(is_below)
    }

    /// How many cells a row has; where they have names every row has all, some of them empty.
    fn across(&self, row: usize) -> usize {
        match &self.holder {
            Holder::List(rows) => match &rows[row] {
                Value::Array(cells) => cells.len(),
                _ => self.fields.len(),
            },
            Holder::Columns(_) => self.fields.len(),
        }
    }

    fn cell(&self, field: &Field<'_>, row: usize) -> Option<&'a Value> {
        match (&self.holder, field.path.as_slice()) {
            (Holder::List(rows), path) => follow(rows.get(row)?, path),
            (Holder::Columns(map), [Step::Key(key), path @ ..]) => {
                follow(map.get(*key)?.get(row)?, path)
            }
            (Holder::Columns(_), _) => None,
        }
    }
}

/// What stands at the end of a path.
fn follow<'b>(from: &'b Value, path: &[Step<'_>]) -> Option<&'b Value> {
    path.iter().try_fold(from, |value, step| step.of(value))
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
            r#"{"set": 7, "data": [{"kind": "run", "F": [3, 4], "of": ["a"], "x": [1, 2]}]}"#,
            "{\"F\": 3, \"x\": 1}\n{\"F\": 4, \"x\": 2}\n",
        ] {
            assert_eq!(seen(text), wanted, "{text}");
        }
        assert_eq!(seen("[[1, true], [2, null]]"), "0 [1.0, 2.0]; 1 [1.0, NaN]");
        let vectors = "motor.on [1.0, 0.0]; q[1] [1.0, 3.0]; q[2] [2.0, NaN]";
        for text in [
            r#"[{"q": [1, 2], "motor": {"on": true}}, {"q": [3, null], "motor": {"on": false}}]"#,
            "{\"q\": [1, 2], \"motor\": {\"on\": 1}}\n{\"q\": [3], \"motor\": {\"on\": 0}}",
        ] {
            assert_eq!(seen(text), vectors, "{text}");
        }
        let by_name =
            r#"{"q": [[1, 2], [3, 4], [5, 6]], "F": [7, 8, 9], "names": ["a", "b", "c"]}"#;
        assert_eq!(
            seen(by_name),
            "F [7.0, 8.0, 9.0]; q[1] [1.0, 3.0, 5.0]; q[2] [2.0, 4.0, 6.0]"
        );
        let runs = r#"{"a": [[1, 2], [3, 4]], "b": [[5, 6]], "limits": [[7]], "c": []}"#;
        assert_eq!(seen(runs), "0 [1.0, 3.0, 5.0]; 1 [2.0, 4.0, 6.0]");
        let numbers: Vec<u32> = (0..70).collect();
        let run = format!("{{\"id\": 3, \"t\": {numbers:?}, \"x\": {numbers:?}}}");
        let list = seen(&format!("[{run}, {run}]"));
        assert_eq!(list.matches("69.0").count(), 4, "{list}");
        assert!(seen("{\"x\": 1}\n{\"x\": }").contains("row 2 (line of the file)"));
        assert!(seen("{\"mass\": 7}").contains("without a table"));
        assert!(seen("[[1, 2], [3]]").contains("row 2 (counted from 1)"));
        assert!(seen("{\"data\": []}").contains("no row"));
        assert!(seen("[[1, NaN]]").contains("row 1 (line of the file)"));
    }
}
