//! The study's folder: where it is, which files in it may be read and written, and how they are
//! named.

use crate::text::error::{Error, Result};
use crate::text::output;
use std::path::{Component, Path, PathBuf};

/// The folder inside the study's own that takes everything that the lab makes.
pub(super) const WRITTEN: &str = "jointwatch-lab";

/// Where a study is, or is to be.
#[derive(Clone, Debug)]
pub(super) struct Folder {
    /// The folder as an absolute path without links.
    pub(super) path: PathBuf,
    /// The study's file in it.
    pub(super) study: String,
    /// Logs that no study describes yet, by their names in the folder.
    pub(super) logs: Vec<String>,
}

impl Folder {
    /// The folder of a study.toml, of a folder, or of some logs; the working folder where nothing
    /// is named.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Failed`] when something named is not there;
    /// [`crate::text::error::Kind::Usage`] when logs lie in several folders, or beside a study
    /// already.
    pub(super) fn of(named: &[PathBuf]) -> Result<Self> {
        let here = [PathBuf::from(".")];
        let named = if named.is_empty() { &here[..] } else { named };
        for path in named {
            if !path.exists() {
                return Err(Error::failed(format!(
                    "{} is not there; name a study.toml, its folder, or logs",
                    path.display()
                )));
            }
        }
        let is_study = |path: &Path| path.extension().is_some_and(|e| e == "toml");
        match named {
            [one] if one.is_dir() => Self::at(one, "study.toml", Vec::new()),
            [one] if is_study(one) => Self::at(output::folder_of(one), &file_name(one), Vec::new()),
            logs => Self::of_logs(logs),
        }
    }

    fn of_logs(logs: &[PathBuf]) -> Result<Self> {
        let folder = output::folder_of(&logs[0]);
        if let Some(other) = logs.iter().find(|l| output::folder_of(l) != folder) {
            return Err(Error::usage(format!(
                "{} lies in another folder than {}; put the logs of one rig into one folder",
                other.display(),
                logs[0].display()
            )));
        }
        if folder.join("study.toml").exists() {
            return Err(Error::usage(format!(
                "{} has a study.toml already; open it with `jointwatch lab {}`, or remove it first",
                folder.display(),
                folder.display()
            )));
        }
        let logs = logs.iter().map(|l| file_name(l)).collect();
        Self::at(folder, "study.toml", logs)
    }

    fn at(folder: &Path, study: &str, logs: Vec<String>) -> Result<Self> {
        let path = folder
            .canonicalize()
            .map_err(|e| Error::failed(format!("{}: cannot be opened ({e})", folder.display())))?;
        Ok(Self {
            path,
            study: study.into(),
            logs,
        })
    }

    /// The study's file, whole.
    pub(super) fn study_file(&self) -> PathBuf {
        self.path.join(&self.study)
    }

    /// Makes the folder for what the lab writes; a link that leads out of the study's folder is
    /// refused.
    pub(super) fn make_written(&self) -> Result<()> {
        let path = self.path.join(WRITTEN);
        let failed = |e| {
            Error::failed(format!(
                "{}: could not be made ({e}); check that the study's folder may be written to",
                path.display()
            ))
        };
        if !path.exists() {
            std::fs::create_dir(&path).map_err(failed)?;
        }
        let real = path.canonicalize().map_err(failed)?;
        if real != path || !real.is_dir() {
            return Err(Error::failed(format!(
                "{}: this is not a folder inside the study's; remove it",
                path.display()
            )));
        }
        Ok(())
    }

    /// The studies in the folder: the one that it was opened with, and those of segments below what
    /// the lab writes.
    pub(super) fn studies(&self, first: &str) -> Vec<String> {
        let folders = std::fs::read_dir(self.path.join(WRITTEN));
        let names = folders.into_iter().flatten().flatten();
        let names = names.filter_map(|f| f.file_name().into_string().ok());
        let mut below: Vec<String> = names
            .map(|name| format!("{WRITTEN}/{name}/study.toml"))
            .filter(|study| self.path.join(study).is_file())
            .collect();
        below.sort();
        below.insert(0, first.into());
        below
    }

    /// A free name among what the lab writes, relative to the study's folder: the stem with an
    /// ending, or with -2, -3, …
    pub(super) fn free(&self, stem: &str, ending: &str) -> String {
        let plain: String = stem
            .chars()
            .map(|c| if c.is_alphanumeric() { c } else { '-' })
            .collect();
        let stem = if plain.len() > 60 { "model" } else { &plain };
        let dot = if ending.is_empty() { "" } else { "." };
        let named = |count: u32| match count {
            1 => format!("{WRITTEN}/{stem}{dot}{ending}"),
            _ => format!("{WRITTEN}/{stem}-{count}{dot}{ending}"),
        };
        let free = (1..).map(named);
        let mut free = free.filter(|name| !self.path.join(name).exists());
        free.next().unwrap_or_else(|| named(1))
    }
}

/// The name of a log that was dropped, when it can be a file of the study's folder and nothing
/// else.
pub(super) fn safe_log_name(name: &str) -> Result<String> {
    let parts: Vec<Component<'_>> = Path::new(name).components().collect();
    let plain = matches!(parts[..], [Component::Normal(_)])
        && name.len() <= 128
        && !name.starts_with(['.', '-'])
        && !name.contains(['/', '\\', ':'])
        && !name.chars().any(char::is_control);
    let lower = name.to_lowercase();
    let taken = [".toml", ".json", ".html", ".bin"]
        .iter()
        .any(|end| lower.ends_with(end));
    if plain && !taken {
        return Ok(name.into());
    }
    Err(Error::usage(format!(
        "{name:?} cannot be the name of a log; give it a plain name such as run1.csv"
    )))
}

fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dropped_log_is_a_file_of_the_folder_or_refused() {
        for name in ["run 1.csv", "lüfter.mat", "a.b.csv.gz", "c"] {
            assert_eq!(safe_log_name(name).unwrap(), name);
        }
        let refused = [
            "",
            ".",
            "..",
            "../a.csv",
            "/etc/a.csv",
            "a/b.csv",
            "a\\b.csv",
            "C:a.csv",
            ".hidden",
            "-o",
            "study.toml",
            "Model.JSON",
            "a\nb.csv",
            "a\0.csv",
        ];
        for name in refused {
            assert!(safe_log_name(name).is_err(), "{name:?}");
        }
        assert!(safe_log_name(&"a".repeat(129)).is_err());
    }

    #[test]
    fn names_are_free_and_plain() {
        let temporary = tempfile::tempdir().unwrap();
        let folder = Folder::of(&[temporary.path().to_path_buf()]).unwrap();
        folder.make_written().unwrap();
        let first = folder.free("physical+coulomb@x", "json");
        assert_eq!(first, "jointwatch-lab/physical-coulomb-x.json");
        std::fs::write(folder.path.join(&first), "{}").unwrap();
        let second = folder.free("physical+coulomb@x", "json");
        assert_eq!(second, "jointwatch-lab/physical-coulomb-x-2.json");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_out_of_the_folder_is_refused() {
        let [inside, outside] = [0, 1].map(|_| tempfile::tempdir().unwrap());
        std::os::unix::fs::symlink(outside.path(), inside.path().join(WRITTEN)).unwrap();
        let folder = Folder::of(&[inside.path().to_path_buf()]).unwrap();
        assert!(folder.make_written().is_err());
    }
}
