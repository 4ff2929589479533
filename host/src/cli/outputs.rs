//! Files that a command is about to write, looked at before it begins: none may be one that it reads, or writes besides.

use super::console::Console;
use crate::study::Study;
use crate::text::error::{Error, Result};
use crate::text::output;
use std::path::{Path, PathBuf};

impl Console {
    /// Refuses outputs (those given and the one of `--json`) that could not be written, that the command reads (the study, its
    /// records and `model`), or that are one file.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Failed`] where a folder is missing or a folder is in the way, [`crate::text::error::Kind::Usage`] where
    /// something would be written over; one sentence.
    pub(super) fn check_outputs(
        &self,
        outputs: &[&Path],
        study: &Study,
        model: Option<&Path>,
    ) -> Result<()> {
        let json = self
            .json_file()
            .map(PathBuf::as_path)
            .filter(|_| !self.json_to_stdout());
        let outputs: Vec<&Path> = outputs.iter().copied().chain(json).collect();
        let folder = study.path.parent().unwrap_or(Path::new(""));
        let mut read: Vec<(PathBuf, &str)> = vec![(study.path.clone(), "the study")];
        let records = study.records.iter();
        read.extend(records.map(|record| (folder.join(&record.file), "a record of the study")));
        read.extend(model.map(|model| (model.to_path_buf(), "the model that was brought")));
        for (at, path) in outputs.iter().enumerate() {
            output::check(path)?;
            if let Some((_, what)) = read.iter().find(|(other, _)| same(path, other)) {
                return Err(Error::usage(format!(
                    "{}: this is {what}, which would be written over; name another file",
                    path.display()
                )));
            }
            if outputs[..at].iter().any(|other| same(path, other)) {
                return Err(Error::usage(format!(
                    "{}: the model and --json are to be written to the same file; name another one",
                    path.display()
                )));
            }
        }
        Ok(())
    }
}

/// Refuses an output that the command reads.
///
/// # Errors
/// [`crate::text::error::Kind::Failed`] where it could not be written, [`crate::text::error::Kind::Usage`] where it would be written
/// over what is read; one sentence.
pub(super) fn keep(output: &Path, read: &[PathBuf]) -> Result<()> {
    output::check(output)?;
    match read.iter().any(|path| same(output, path)) {
        false => Ok(()),
        true => Err(Error::usage(format!(
            "{}: this is read, and would be written over; name another file",
            output.display()
        ))),
    }
}

/// Whether two paths lead to one file, by whatever way, there already or yet to be written.
fn same(a: &Path, b: &Path) -> bool {
    let whole = |path: &Path| {
        path.canonicalize().ok().or_else(|| {
            let folder = output::folder_of(path).canonicalize().ok()?;
            Some(folder.join(path.file_name()?))
        })
    };
    whole(a).is_some_and(|a| whole(b) == Some(a))
}
