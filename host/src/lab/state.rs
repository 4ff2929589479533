//! What all open pages share: the study, its models, what is looked at, what runs, and what was
//! done.

use super::action::{Known, Then};
use super::folder::Folder;
use super::job::{self, Running};
use super::long::Long;
use super::models::Entry;
use crate::study::draft::UserChoices;
use crate::text::error::{Error, Result};
use serde_json::{Value, json};
use std::sync::Arc;
use std::time::Instant;

/// As many drawn pages are kept.
const VIEWS: usize = 12;
/// As many commands are remembered.
const REMEMBERED: usize = 100;

/// The study as far as it is known.
#[derive(Clone, Debug)]
pub(super) enum Opened {
    /// It is being read.
    Reading,
    /// There is none yet: there may be logs, of which one is to be made.
    Missing,
    /// It was read: what the pages are told of it, as JSON.
    Study(Value),
    /// It has a log that is too long to be held in memory; its channels are shown, and segments can
    /// be chosen.
    Long,
    /// It cannot be read, in a sentence.
    Wrong(String),
}

/// What a page draws.
#[derive(Clone)]
pub(super) struct View {
    /// A number that no other view has, by which a page knows whether it has drawn this one.
    pub(super) key: u64,
    /// File of the model that is drawn.
    pub(super) model: String,
    /// The model before or beside it.
    pub(super) beside: Option<String>,
    /// `report::page::Contents` as JSON, for the page's scripts.
    pub(super) json: Arc<String>,
}

/// A command that was run.
#[derive(Clone)]
pub(super) struct Done {
    pub(super) what: String,
    pub(super) command: String,
    pub(super) done: bool,
    pub(super) said: String,
    pub(super) seconds: f64,
    /// The effects of an addition that did not help.
    pub(super) useless: Option<Vec<String>>,
}

impl Done {
    /// What took no time and was no process of its own.
    pub(super) fn at_once(what: String, words: &[String], said: &str) -> Self {
        Self {
            what,
            command: job::line(words),
            done: true,
            said: said.into(),
            seconds: 0.0,
            useless: None,
        }
    }
}

/// A command that runs.
pub(super) struct Job {
    pub(super) what: String,
    pub(super) command: String,
    pub(super) said: String,
    pub(super) begun: Instant,
    pub(super) running: Running,
    pub(super) cancelled: bool,
}

/// What all open pages share.
pub(super) struct State {
    pub(super) folder: Folder,
    pub(super) opened: Opened,
    pub(super) long: Option<Arc<Long>>,
    /// Studies in the folder: the one that was opened, and those of segments that were chosen of
    /// it.
    pub(super) studies: Vec<String>,
    pub(super) records: Vec<String>,
    pub(super) models: Vec<Entry>,
    pub(super) current: Option<usize>,
    pub(super) views: Vec<View>,
    pub(super) shown: Option<u64>,
    /// How many were drawn since the start.
    drawn: u64,
    pub(super) said: UserChoices,
    pub(super) draft: Option<Arc<Value>>,
    pub(super) blob: Option<(String, String)>,
    pub(super) job: Option<Job>,
    pub(super) done: Vec<Done>,
    /// The model that was named at the start.
    pub(super) wanted: Option<String>,
}

impl State {
    /// The state at the start.
    pub(super) fn new(folder: Folder, wanted: Option<String>) -> Self {
        Self {
            folder,
            opened: Opened::Reading,
            long: None,
            studies: Vec::new(),
            records: Vec::new(),
            models: Vec::new(),
            current: None,
            views: Vec::new(),
            shown: None,
            drawn: 0,
            said: UserChoices::default(),
            draft: None,
            blob: None,
            job: None,
            done: Vec::new(),
            wanted,
        }
    }

    /// What a command can be made from.
    pub(super) fn known(&self) -> Known<'_> {
        Known {
            folder: &self.folder,
            models: &self.models,
            current: self.current,
            records: &self.records,
            blob: self.blob.as_ref(),
        }
    }

    /// Forgets what was drawn of the study's logs.
    pub(super) fn forget(&mut self) {
        self.views.clear();
        self.shown = None;
    }

    /// Goes over to another study of the folder; models of one are not judged on the other.
    pub(super) fn work_on(&mut self, study: String) {
        self.folder.study = study;
        self.forget();
        self.current = None;
        self.blob = None;
    }

    /// Keeps a command that has ended; the oldest of too many are forgotten.
    pub(super) fn remember(&mut self, done: Done) {
        self.done.push(done);
        let surplus = self.done.len().saturating_sub(REMEMBERED);
        self.done.drain(..surplus);
    }

    /// Whether a page that was drawn before shows a model; it is then the current one.
    pub(super) fn show_again(&mut self, model: &str, beside: Option<&str>) -> bool {
        let mut views = self.views.iter();
        let found = views.rfind(|v| v.model == model && v.beside.as_deref() == beside);
        let Some(key) = found.map(|v| v.key) else {
            return false;
        };
        self.shown = Some(key);
        self.current = self.models.iter().position(|m| m.file == model);
        true
    }

    /// Takes over what a command has made.
    pub(super) fn take(
        &mut self,
        then: &Then,
        contents: Option<String>,
        json: Option<String>,
    ) -> Result<()> {
        let (model, beside) = match then {
            Then::Model { file, from } => {
                let entry = Entry::read(&self.folder, file)?;
                self.models.retain(|m| m.file != *file);
                self.models.push(entry);
                (file, from.clone())
            }
            Then::Shown { model, beside } => (model, beside.clone()),
            Then::Diagnosed { model } => {
                let diagnosis = json.and_then(|text| serde_json::from_str(&text).ok());
                if let Some(entry) = self.models.iter_mut().find(|m| m.file == *model) {
                    entry.diagnosis = diagnosis;
                }
                (model, None)
            }
            Then::Blob { file, model } => {
                self.blob = Some((file.clone(), model.clone()));
                return Ok(());
            }
            Then::Study | Then::Segments { .. } | Then::Printed => return Ok(()),
        };
        let Some(contents) = contents else {
            return Err(Error::failed(
                "the command drew nothing; look at what it printed",
            ));
        };
        // Never the same twice: a page knows by it whether what it has drawn is still right.
        self.drawn += 1;
        let key = self.drawn;
        self.views.push(View {
            key,
            model: model.clone(),
            beside,
            json: Arc::new(contents),
        });
        let surplus = self.views.len().saturating_sub(VIEWS);
        self.views.drain(..surplus);
        self.shown = Some(key);
        self.current = self.models.iter().position(|m| m.file == *model);
        Ok(())
    }

    /// What is drawn now.
    pub(super) fn view(&self) -> Option<&View> {
        let shown = self.shown?;
        self.views.iter().find(|v| v.key == shown)
    }

    /// Effects of the diagnosis of the current model, where there is one.
    pub(super) fn diagnosis(&self) -> Value {
        let current = self.current.and_then(|at| self.models.get(at));
        current
            .and_then(|m| m.diagnosis.clone())
            .unwrap_or(json!(null))
    }
}
