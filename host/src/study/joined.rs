//! A run of which every channel was logged into a file of its own: the files of a record, joined by
//! plus signs, are read side by side as one table.

use super::log::{Column, Numbering, Request, Table};
use crate::text::error::Result;
use std::path::{Path, PathBuf};

/// What stands between the files of a record.
pub(crate) const PLUS: &str = " + ";

/// The files of a record as it names them, with their paths; nothing where it is one file.
pub(crate) fn files<'a>(request: &Request<'a>) -> Option<Vec<(&'a str, PathBuf)>> {
    if !request.file.contains(PLUS) || request.path.exists() {
        return None;
    }
    let path = request.path.to_string_lossy();
    let folder = path.strip_suffix(request.file).unwrap_or("");
    let each = request.file.split(PLUS).map(str::trim);
    Some(
        each.map(|file| (file, Path::new(folder).join(file)))
            .collect(),
    )
}

/// The table that all files make together.
///
/// # Errors
/// As [`Request::table`] of each file; files of different length.
pub(crate) fn table(request: &Request<'_>, files: &[(&str, PathBuf)]) -> Result<Table> {
    let mut tables = Vec::new();
    for (file, path) in files {
        let own = Request {
            file,
            path,
            wanted: None,
            rows: None,
            columns: None,
            ..*request
        };
        tables.push((stem(file), with_a_heading(&own)?));
    }
    let numbering = match tables.first() {
        Some((_, (first, _))) => first.numbering.clone(),
        None => Numbering::From(1),
    };
    let notes = tables
        .iter()
        .flat_map(|(_, (table, _))| table.notes.clone());
    let notes = notes.collect();
    let mut columns: Vec<Column> = Vec::new();
    let all = named(tables);
    let rows = |column: &Column| column.values.as_ref().map_or(0, Vec::len);
    for column in all {
        if let Some(first) = columns.first()
            && rows(first) != rows(&column)
            && !request.sparse
        {
            return Err(request.error(format!(
                "hold {} rows of {:?} and {} of {:?}; a record's files need a row for each of one another's",
                rows(first),
                first.name,
                rows(&column),
                column.name
            )));
        }
        columns.push(column);
    }
    Ok(Table {
        numbering,
        notes,
        ..Table::whole(format!("{} files side by side", files.len()), columns)
    })
}

/// The table of a file, and whether its columns have no names.
fn with_a_heading(request: &Request<'_>) -> Result<(Table, bool)> {
    match request.table() {
        Err(error) if error.sentence.contains("a heading with the columns' names") => {
            let count = request.columns_without_heading()?;
            let names: Vec<String> = (1..=count).map(|i| i.to_string()).collect();
            let numbered = Request {
                columns: Some(&names),
                ..*request
            };
            Ok((numbered.table()?, true))
        }
        other => Ok((other?, false)),
    }
}

/// The columns of all files. One without a name, or whose name stands for other values in another
/// file, is called after its file; one that several files hold alike, such as their time, stands
/// once.
fn named(tables: Vec<(String, (Table, bool))>) -> Vec<Column> {
    let mut all: Vec<(String, bool, Column)> = Vec::new();
    for (stem, (table, nameless)) in tables {
        let alone = table.columns.len() == 1;
        for mut column in table.columns {
            if nameless {
                column.name = match alone {
                    true => stem.clone(),
                    false => format!("{stem} {}", column.name),
                };
            }
            all.push((stem.clone(), nameless, column));
        }
    }
    let same = |a: &Column, b: &Column| a.name == b.name && a.values == b.values;
    let mut kept: Vec<(String, bool, Column)> = Vec::new();
    for (stem, nameless, column) in all {
        if !kept.iter().any(|(.., known)| same(known, &column)) {
            kept.push((stem, nameless, column));
        }
    }
    let names: Vec<String> = kept.iter().map(|(.., c)| c.name.clone()).collect();
    let is_twice = |name: &String| names.iter().filter(|n| *n == name).count() > 1;
    let renamed = kept.into_iter().map(|(stem, nameless, mut column)| {
        if !nameless && is_twice(&column.name) {
            column.name = stem;
        }
        column
    });
    renamed.collect()
}

/// What a file's columns are called after.
fn stem(file: &str) -> String {
    let stem = Path::new(file).file_stem();
    stem.map_or(file.to_owned(), |s| s.to_string_lossy().into_owned())
}
