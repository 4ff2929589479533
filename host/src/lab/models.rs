//! The models of a study that lie in its folder: what they are made of, how wrong they are, and
//! which came out of which.

use super::folder::{Folder, WRITTEN};
use crate::model::file::{AxisError, HistoryEntry, ModelFile};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Files larger than this are not looked into.
const LARGEST: u64 = 50_000_000;

/// A model of the folder, as far as the page shows it.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    /// Its file, relative to the study's folder; its name everywhere.
    pub(super) file: String,
    /// `polynomial`, `network` or `none`.
    pub(super) base: &'static str,
    /// Its effects with their axes, such as `coulomb@x`.
    pub(super) effects: Vec<String>,
    /// Errors on the records that judge it.
    pub(super) errors: Vec<AxisError>,
    /// Whether those are validation records.
    pub(super) validated: bool,
    /// How it came about.
    pub(super) history: Vec<HistoryEntry>,
    /// What is said to be wary of.
    pub(super) warnings: Vec<String>,
    /// When it was written.
    pub(super) written: SystemTime,
    /// What `diagnose` said of it.
    pub(super) diagnosis: Option<Value>,
}

impl Entry {
    /// Reads what is told of a model; nothing is known of its diagnosis yet.
    pub(super) fn read(folder: &Folder, file: &str) -> crate::Result<Self> {
        let path = folder.path.join(file);
        let model = ModelFile::read(&path)?;
        let validated = !model.validation.is_empty();
        let name = |e: &crate::model::ModelEffect| match &e.axis {
            Some(axis) => format!("{}@{axis}", e.effect),
            None => e.effect.clone(),
        };
        Ok(Self {
            file: file.into(),
            base: model.base.name(),
            effects: model.effects.iter().map(name).collect(),
            errors: if validated {
                model.validation
            } else {
                model.verification
            },
            validated,
            history: model.history,
            warnings: model.warnings,
            written: std::fs::metadata(&path)
                .and_then(|m| m.modified())
                .unwrap_or(SystemTime::UNIX_EPOCH),
            diagnosis: None,
        })
    }

    /// Its name without folder and ending.
    pub(super) fn stem(&self) -> String {
        let stem = Path::new(&self.file).file_stem().unwrap_or_default();
        stem.to_string_lossy().into_owned()
    }
}

/// All models in the folder and in the lab's own below it, the oldest first.
pub(super) fn found(folder: &Folder) -> Vec<Entry> {
    let listed = |below: &str| -> Vec<String> {
        let files = std::fs::read_dir(folder.path.join(below));
        let files = files.into_iter().flatten().flatten();
        let json = files.filter(|f| f.path().extension().is_some_and(|e| e == "json"));
        let small = json.filter(|f| {
            f.metadata()
                .is_ok_and(|m| m.is_file() && m.len() <= LARGEST)
        });
        let names = small.filter_map(|f| f.file_name().into_string().ok());
        let shown = names.filter(|n| !n.starts_with('.'));
        let name = |n: String| {
            PathBuf::from(below)
                .join(n)
                .to_string_lossy()
                .replace('\\', "/")
        };
        shown.map(name).collect()
    };
    let files = listed("").into_iter().chain(listed(WRITTEN));
    let mut models: Vec<Entry> = files.filter_map(|f| Entry::read(folder, &f).ok()).collect();
    models.sort_by_key(|m| m.written);
    models
}

/// The model that another one was made from: the one whose history its own goes on with.
pub(super) fn parent(models: &[Entry], of: usize) -> Option<usize> {
    let history = &models[of].history;
    let before = history.len().checked_sub(1).filter(|n| *n > 0)?;
    let mut older = models.iter().enumerate();
    let found = older.rfind(|(at, m)| {
        *at != of && m.base == models[of].base && m.history[..] == history[..before]
    });
    found.map(|(at, _)| at)
}
