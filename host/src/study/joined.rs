//! A run of which every channel was logged into a file of its own: the files of a record, joined by
//! plus signs, are read side by side as one table.

use super::log::{Column, NO_HEADING, Numbering, Request, Table};
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
    let columns = named(tables);
    let rows = |column: &Column| column.values.as_ref().map_or(0, Vec::len);
    for pair in columns.windows(2) {
        if rows(&pair[0]) != rows(&pair[1]) && !request.sparse {
            return Err(request.error(format!(
                "hold {} rows of {:?} and {} of {:?}; a record's files need a row for each of one another's",
                rows(&pair[0]),
                pair[0].name,
                rows(&pair[1]),
                pair[1].name
            )));
        }
    }
    Ok(Table {
        numbering,
        notes,
        ..Table::whole(format!("{} files side by side", files.len()), columns)
    })
}

/// The table of a file, with columns c1, c2 … where they have no names, and whether that is so.
///
/// # Errors
/// As [`Request::table`].
pub(super) fn with_a_heading(request: &Request<'_>) -> Result<(Table, bool)> {
    match request.table() {
        Err(error) if error.sentence.contains(NO_HEADING) => {
            let count = request.columns_without_heading()?;
            let names: Vec<String> = (1..=count).map(|i| format!("c{i}")).collect();
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
    struct Own {
        stem: String,
        nameless: bool,
        column: Column,
    }
    let mut kept: Vec<Own> = Vec::new();
    for (stem, (table, nameless)) in tables {
        for column in table.columns {
            let same = |known: &&mut Own| {
                known.column.name == column.name && known.column.values == column.values
            };
            match kept.iter_mut().find(same) {
                // What files share is no channel of either.
                Some(shared) => shared.nameless = false,
                None => kept.push(Own {
                    stem: stem.clone(),
                    nameless,
                    column,
                }),
            }
        }
    }
    let is_twice = |name: &str| kept.iter().filter(|own| own.column.name == name).count() > 1;
    let is_renamed: Vec<bool> = kept
        .iter()
        .map(|own| own.nameless || is_twice(&own.column.name))
        .collect();
    let stems: Vec<String> = kept.iter().map(|own| own.stem.clone()).collect();
    let each = kept.into_iter().zip(&is_renamed);
    let renamed = each.map(|(mut own, renamed)| {
        let mut beside = stems.iter().zip(&is_renamed);
        let alone = beside
            .by_ref()
            .filter(|(s, r)| **s == own.stem && **r)
            .count()
            == 1;
        own.column.name = match (renamed, alone) {
            (false, _) => own.column.name,
            (true, true) => own.stem,
            (true, false) => format!("{} {}", own.stem, own.column.name),
        };
        own.column
    });
    renamed.collect()
}

/// What a file's columns are called after.
fn stem(file: &str) -> String {
    let stem = Path::new(file).file_stem();
    stem.map_or(file.to_owned(), |s| s.to_string_lossy().into_owned())
}
