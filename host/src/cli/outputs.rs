//! Files that a command is about to write, looked at before it begins: none may be one that it
//! reads, or writes besides.

use super::console::Console;
use crate::study::Study;
use crate::text::error::{Error, Result};
use crate::text::output;
use clap::{ArgMatches, Command};
use std::any::TypeId;
use std::path::{Path, PathBuf};

impl Console {
    /// Refuses outputs (those given and the one of `--json`) that could not be written, or that are
    /// a record of the study. [`refuse_overwriting`] has looked at everything that was typed.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Failed`] where a folder is missing or a folder is in the way,
    /// [`crate::text::error::Kind::Usage`] where a record would be written over; one sentence.
    pub(super) fn check_outputs(&self, outputs: &[&Path], study: &Study) -> Result<()> {
        let json = self
            .json_file()
            .map(PathBuf::as_path)
            .filter(|_| !self.json_to_stdout());
        let folder = study.path.parent().unwrap_or(Path::new(""));
        for path in outputs.iter().copied().chain(json) {
            output::check(path)?;
            let mut records = study.records.iter();
            if records.any(|record| same(path, &folder.join(&record.file))) {
                return Err(Error::usage(format!(
                    "{}: this is a record of the study, which would be written over; name another file",
                    path.display()
                )));
            }
        }
        Ok(())
    }
}

/// Options and arguments that name what a command writes, by their names in clap; every other path
/// is one that it reads.
const WRITTEN: [&str; 8] = [
    "output", "json", "report", "contents", "plots", "record", "frames", "out",
];

/// The arguments that are logs.
const LOGS: &str = "logs";

/// Refuses a command line on which an output is also an input, or two outputs are one file. It sees
/// the paths as typed; the records that a study names are for [`Console::check_outputs`].
///
/// # Errors
/// [`crate::text::error::Kind::Usage`], one sentence.
pub(super) fn refuse_overwriting(command: &Command, typed: &ArgMatches) -> Result<()> {
    let (mut written, mut read) = (Vec::new(), Vec::new());
    for arg in command.get_arguments() {
        if arg.get_value_parser().type_id() != TypeId::of::<PathBuf>() {
            continue;
        }
        let name = arg.get_id().as_str();
        let typed = typed.get_many::<PathBuf>(name).into_iter().flatten();
        // Standard input and standard output are no file.
        let files = typed.filter(|path| !output::is_standard(path)).cloned();
        if WRITTEN.contains(&name) {
            written.extend(files);
        } else {
            // A folder stands for the study in it, but among logs for nothing.
            read.extend(files.map(|path| match path.is_dir() && name != LOGS {
                true => path.join("study.toml"),
                false => path,
            }));
        }
    }
    for (at, path) in written.iter().enumerate() {
        let sentence = if read.iter().any(|other| same(path, other)) {
            "this is read, and would be written over; name another file"
        } else if written[..at].iter().any(|other| same(path, other)) {
            "two outputs of this command are the same file; name another one"
        } else {
            continue;
        };
        return Err(Error::usage(format!("{}: {sentence}", path.display())));
    }
    Ok(())
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

#[cfg(test)]
mod tests {
    use super::WRITTEN;
    use std::any::TypeId;
    use std::path::PathBuf;

    /// Options that name what a command reads; an argument without an option is read too, but for
    /// those of [`WRITTEN`].
    const READ: [&str; 9] = [
        "from", "rig", "model", "beside", "new", "key", "study", "named", "data",
    ];

    #[test]
    fn every_option_with_a_path_is_known_to_be_read_or_written() {
        let mut command = super::super::command_line();
        command.build();
        let mut seen = Vec::new();
        for subcommand in command.get_subcommands() {
            for arg in subcommand.get_arguments() {
                let name = arg.get_id().as_str();
                if arg.get_value_parser().type_id() != TypeId::of::<PathBuf>() {
                    continue;
                }
                let known = WRITTEN.contains(&name) || READ.contains(&name) || arg.is_positional();
                assert!(
                    known,
                    "{} --{name}: read or written?",
                    subcommand.get_name()
                );
                seen.push(name.to_owned());
            }
        }
        for name in WRITTEN.iter().chain(&READ) {
            assert!(seen.iter().any(|seen| seen == name), "{name} is no option");
        }
    }
}
