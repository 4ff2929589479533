//! Roles of records: nothing is validated on rows that it was learnt from.

use crate::study::Role;
use crate::study::description::{Description, RecordEntry, Source};
use crate::text::error::{Error, Result};
use std::path::{Path, PathBuf};

/// Refuses rows that train and validate, before any log is opened; notes of what is lacking or
/// there twice.
pub(crate) fn check(source: &Source<'_>, said: &Description, folder: &Path) -> Result<Vec<String>> {
    if said.record.is_empty() {
        return Err(Error::data(format!(
            "{}: it names no log; add a [[record]] with file and role for each",
            source.path.display()
        )));
    }
    let mut notes = Vec::new();
    if !said.record.iter().any(|r| r.role == Role::Train) {
        notes.push(
            "no record has role = \"train\", so nothing can be learnt from this study; compare, replay and changed can use it"
                .to_owned(),
        );
    }
    if !said.record.iter().any(|r| r.role == Role::Validate) {
        notes.push(
            "no record has role = \"validate\", so nothing will show how good a model is on data it has not seen"
                .to_owned(),
        );
    }
    let real = |entry: &RecordEntry| -> PathBuf {
        let path = folder.join(entry.file.get_ref());
        path.canonicalize().unwrap_or(path)
    };
    let span = |entry: &RecordEntry| {
        entry
            .rows
            .as_ref()
            .map_or([0, usize::MAX], |r| *r.get_ref())
    };
    for (i, second) in said.record.iter().enumerate() {
        for first in &said.record[..i] {
            let ([a, b], [c, d]) = (span(first), span(second));
            let other_rows = a.max(c) >= b.min(d);
            if real(first) != real(second) || other_rows || first.columns != second.columns {
                continue;
            }
            if first.role != second.role {
                return Err(source.wrong(
                    &second.file,
                    format!(
                        "{:?} is used to train and to validate with the same rows, so validation would show nothing; \
                         separate them with rows = […]",
                        second.file.get_ref()
                    ),
                ));
            }
            notes.push(format!(
                "{} is listed twice with the same rows, which then count twice",
                second.file.get_ref()
            ));
        }
    }
    Ok(notes)
}
