//! Columns of the logs that a study does not name: a model may follow one as if it were an input,
//! under the word in its name: `I` for `I [A]`.

use super::naming::split_unit;
use crate::study::description::{Description, InputEntry, RecordEntry, Source};
use crate::study::log::Column;
use crate::study::long::records::thin;
use crate::study::plan::{Plan, plan};
use crate::study::read::{Logged, description_text};
use crate::study::readers::long::LongLog;
use crate::study::{Input, Study};
use crate::text::error::{Result, in_order};
use rayon::prelude::*;
use std::path::Path;
use std::sync::Arc;
use toml::Spanned;

impl Study {
    /// Reads a study as [`Study::read`] does, with further columns of its logs as inputs, each
    /// under the word in its name; those that the study names already are left alone.
    ///
    /// # Errors
    /// As [`Study::read`], also for a column that a log lacks.
    pub fn read_with(path: &Path, columns: &[&str]) -> Result<Self> {
        let (path, text) = description_text(path)?;
        Self::described(&Source::file(&path, &text), Logged::Files, columns)
    }

    /// Reads a study for effects that follow these inputs: columns of that word serve where the
    /// study names no such input.
    ///
    /// # Errors
    /// As [`Study::read`]; an input that is nowhere is refused by what needs it.
    pub(crate) fn read_following(path: &Path, inputs: &[&str]) -> Result<Self> {
        let study = Self::read(path)?;
        let columns = study.columns_of(inputs);
        match columns.is_empty() {
            true => Ok(study),
            false => Self::read_with(path, &columns),
        }
    }

    /// As [`Study::read_following`], and every row as [`Study::read_whole`].
    ///
    /// # Errors
    /// As [`Study::read_whole`]; an input that is nowhere is refused by what needs it.
    pub(crate) fn read_whole_following(path: &Path, inputs: &[&str]) -> Result<Self> {
        let study = Self::read_whole(path)?;
        let columns = study.columns_of(inputs);
        if columns.is_empty() {
            return Ok(study);
        }
        let (path, text) = description_text(path)?;
        Self::described(&Source::file(&path, &text), Logged::Whole, &columns)
    }

    /// The columns that stand for inputs that the study does not name.
    pub(crate) fn columns_of(&self, inputs: &[&str]) -> Vec<&str> {
        let named = |input: &str| self.inputs.iter().any(|i| i.name == input);
        let spare = self.unused.iter().map(String::as_str);
        let wanted = |column: &&str| {
            let word = word_of(column);
            word.is_some_and(|word| inputs.contains(&word.as_str()) && !named(&word))
        };
        spare.filter(wanted).collect()
    }

    /// The study with every column as an input that no channel uses, that holds a number in every
    /// row of all records, and that changes, be it from one record to another; nothing where
    /// there is none, or where the logs are not files.
    ///
    /// # Errors
    /// As [`Study::read`].
    pub(crate) fn with_spare_columns(&self) -> Result<Option<Self>> {
        let spare = self.unused.iter();
        let words: Vec<(&str, Option<String>)> = spare.map(|n| (n.as_str(), word_of(n))).collect();
        let alone = |word: &Option<String>| {
            word.is_some() && words.iter().filter(|(_, other)| other == word).count() == 1
        };
        let names = words.iter().filter(|(_, word)| alone(word));
        let names: Vec<&str> = names.map(|(name, _)| *name).collect();
        if names.is_empty() || !self.path.is_file() {
            return Ok(None);
        }
        let (path, text) = description_text(&self.path)?;
        let source = Source::file(&path, &text);
        let mut said: Description = source.parse("reference/study.md")?;
        let time = said.time.as_ref();
        if time.is_some_and(|time| time.get_ref().resample_hz.is_some()) {
            return Ok(None);
        }
        let folder = path.parent().unwrap_or(Path::new("."));
        let (plan, _) = plan(&source, &said)?;
        let long = thin(&mut said, &plan, folder)?.logs;
        let mut spare: Option<Vec<Numbers>> = None;
        let records = said.record.par_iter();
        let records: Vec<Vec<Numbers>> =
            in_order(records.map(|entry| numbers(folder, entry, &plan, &long)))?;
        for mut own in records {
            own.retain(|column| names.contains(&column.name.as_str()));
            if let Some(before) = spare {
                own.retain_mut(|column| {
                    let same = before.iter().find(|known| known.name == column.name);
                    column.changes |=
                        same.is_some_and(|known| known.changes || known.first != column.first);
                    same.is_some()
                });
            }
            spare = Some(own);
        }
        let spare: Vec<Numbers> = spare.unwrap_or_default();
        let changing = spare.iter().filter(|column| column.changes);
        let names: Vec<&str> = changing.map(|column| column.name.as_str()).collect();
        if names.is_empty() {
            return Ok(None);
        }
        Self::described(&source, Logged::Files, &names).map(Some)
    }
}

/// The word under which effects can follow a column: its name, or that without its unit and with
/// `_` between its parts.
pub(crate) fn word_of(column: &str) -> Option<String> {
    let in_words = |c: char| c.is_alphanumeric() || c == '_';
    if column.chars().all(in_words) {
        return (!column.is_empty()).then(|| column.to_owned());
    }
    let stem = split_unit(column).0;
    let parts = stem.split(|c| !in_words(c)).filter(|part| !part.is_empty());
    let word = parts.collect::<Vec<_>>().join("_");
    (!word.is_empty()).then_some(word)
}

/// A column with a number in every row.
struct Numbers {
    name: String,
    first: f64,
    /// Whether it holds other numbers as well.
    changes: bool,
}

/// The columns of a record's log that hold a number in every row. One of another length than those
/// in use, as the spectrum beside a signal, has other rows.
fn numbers(
    folder: &Path,
    entry: &RecordEntry,
    plan: &Plan,
    long: &[Arc<LongLog>],
) -> Result<Vec<Numbers>> {
    let path = folder.join(entry.file.get_ref());
    let request = entry.request(&path, None);
    let long = long.iter().find(|log| log.is_at(&path));
    let table = request.table_of(long.map(Arc::as_ref))?;
    let rows_of = |column: &Column| column.values.as_ref().map_or(0, Vec::len);
    let is_used = |column: &&Column| plan.wanted.iter().any(|w| w.column == column.name);
    let rows = table.columns.iter().find(is_used).map(rows_of);
    let mut numbers = Vec::new();
    for column in &table.columns {
        if rows.is_some_and(|rows| rows != rows_of(column)) {
            continue;
        }
        let mut values = column.values.as_deref().unwrap_or_default();
        if !table.cut {
            values = values.get(request.range(values.len())?).unwrap_or_default();
        }
        let twice = table.columns.iter().filter(|c| c.name == column.name);
        if !values.is_empty() && values.iter().all(|v| v.is_finite()) && twice.count() == 1 {
            numbers.push(Numbers {
                name: column.name.clone(),
                first: values[0],
                changes: values.iter().any(|v| *v != values[0]),
            });
        }
    }
    Ok(numbers)
}

impl Description {
    /// Makes inputs of further columns.
    pub(crate) fn take_columns(&mut self, columns: &[&str]) {
        for &column in columns {
            let Some(word) = word_of(column) else {
                continue;
            };
            if self.input.iter().any(|e| *e.name.get_ref() == word) {
                continue;
            }
            self.input.push(InputEntry {
                name: Spanned::new(0..0, word),
                column: column.to_owned(),
                unit: String::new(),
                scale: None,
                offset: None,
                time: None,
                named: false,
            });
        }
    }

    /// The inputs: those that the study names, and spare columns that were added to them.
    pub(crate) fn inputs(&self) -> Vec<Input> {
        let inputs = self.input.iter().map(|entry| Input {
            name: entry.name.get_ref().clone(),
            unit: entry.unit.clone(),
            named: entry.named,
        });
        inputs.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::word_of;

    #[test]
    fn the_word_of_a_column_is_its_name_without_the_unit() {
        for (column, word) in [
            ("p1", Some("p1")),
            ("disc_temp_C", Some("disc_temp_C")),
            ("I [A]", Some("I")),
            ("Druck Kammer 2 (bar)", Some("Druck_Kammer_2")),
            ("[-]", None),
        ] {
            assert_eq!(word_of(column).as_deref(), word, "{column}");
        }
    }
}
