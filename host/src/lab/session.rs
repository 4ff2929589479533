//! What all open pages share: the study, its models, what is looked at, what runs, and what was done.

use super::action::{Action, Known, Plan, Then};
use super::folder::{Folder, WRITTEN};
use super::job::{self, Running};
use super::models::{self, Entry};
use super::{draft, snapshot};
use crate::study::draft::Said;
use crate::study::{Study, mistakes};
use crate::text::error::{Error, Result};
use serde_json::{Value, json};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::watch;

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
    /// It was read.
    Study(Value),
    /// It cannot be read, in a sentence.
    Wrong(String),
}

/// What a page draws.
#[derive(Clone)]
pub(super) struct View {
    /// Its number.
    pub(super) key: u64,
    /// The model's file.
    pub(super) model: String,
    /// The model before or beside it.
    pub(super) beside: Option<String>,
    /// `report::page::Contents` as JSON.
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

/// A command that runs.
pub(super) struct Job {
    pub(super) what: String,
    pub(super) command: String,
    pub(super) said: String,
    pub(super) begun: Instant,
    running: Option<Running>,
    cancelled: bool,
}

/// The state.
pub(super) struct State {
    pub(super) folder: Folder,
    pub(super) opened: Opened,
    pub(super) records: Vec<String>,
    pub(super) models: Vec<Entry>,
    pub(super) current: Option<usize>,
    pub(super) views: Vec<View>,
    pub(super) shown: Option<u64>,
    pub(super) said: Said,
    pub(super) draft: Option<Arc<Value>>,
    pub(super) blob: Option<(String, String)>,
    pub(super) job: Option<Job>,
    pub(super) done: Vec<Done>,
    wanted: Option<String>,
}

/// The state, who waits for it to change, and the program that does the work.
pub(super) struct Session {
    state: Mutex<State>,
    revision: watch::Sender<u64>,
    program: PathBuf,
}

impl Session {
    /// A session on a folder, with the model to show first.
    pub(super) fn new(folder: Folder, model: Option<String>, program: PathBuf) -> Arc<Self> {
        Arc::new(Self {
            state: Mutex::new(State {
                folder,
                opened: Opened::Reading,
                records: Vec::new(),
                models: Vec::new(),
                current: None,
                views: Vec::new(),
                shown: None,
                said: Said::default(),
                draft: None,
                blob: None,
                job: None,
                done: Vec::new(),
                wanted: model,
            }),
            revision: watch::Sender::new(1),
            program,
        })
    }

    /// The state, alone.
    pub(super) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What the pages are told, as JSON.
    pub(super) fn told(&self) -> Value {
        let revision = *self.revision.borrow();
        snapshot::snapshot(&self.state(), revision)
    }

    /// Waits until something is newer than what a page has.
    pub(super) async fn newer_than(&self, seen: u64, at_most: Duration) {
        let mut changes = self.revision.subscribe();
        // In either case the page is told how it stands.
        let _ = tokio::time::timeout(at_most, changes.wait_for(|now| *now != seen)).await;
    }

    fn changed(&self) {
        self.revision.send_modify(|revision| *revision += 1);
    }

    /// Reads the study and the models in its folder, in a thread of its own.
    pub(super) fn open(self: &Arc<Self>) {
        self.state().opened = Opened::Reading;
        self.changed();
        let session = Arc::clone(self);
        std::thread::spawn(move || {
            session.read_folder();
            session.changed();
            session.show_first();
        });
    }

    fn read_folder(&self) {
        let (folder, said) = {
            let state = self.state();
            (state.folder.clone(), state.said.clone())
        };
        if !folder.study_file().exists() {
            let made = match folder.logs.is_empty() {
                true => Ok(None),
                false => draft::draft(&folder, &said).map(Some),
            };
            let mut state = self.state();
            match made {
                Ok(draft) => {
                    state.draft = draft.map(Arc::new);
                    state.opened = Opened::Missing;
                }
                Err(e) => state.opened = Opened::Wrong(e.sentence),
            }
            return;
        }
        let study = Study::read(&folder.study_file());
        let models = models::found(&folder);
        let mut state = self.state();
        state.draft = None;
        match study {
            Ok(study) => {
                state.records = study.records.iter().map(|r| r.file.clone()).collect();
                state.opened = Opened::Study(snapshot::of_study(&study, &mistakes::check(&study)));
            }
            Err(e) => state.opened = Opened::Wrong(e.sentence),
        }
        let current = state.current.map(|at| state.models[at].file.clone());
        state.models = models;
        if let Some(file) = state.wanted.clone()
            && !state.models.iter().any(|m| m.file == file)
        {
            match Entry::read(&folder, &file) {
                Ok(entry) => state.models.push(entry),
                Err(e) => state.opened = Opened::Wrong(e.sentence),
            }
        }
        let at = |file: &String| state.models.iter().position(|m| m.file == *file);
        state.current = current.as_ref().and_then(at);
    }

    /// Shows the model that was named at the start, or the newest.
    fn show_first(self: &Arc<Self>) {
        let model = {
            let mut state = self.state();
            let newest = state.models.last().map(|m| m.file.clone());
            let current = state.current.map(|at| state.models[at].file.clone());
            let model = state.wanted.take().or(current).or(newest);
            model.filter(|_| matches!(state.opened, Opened::Study(_)))
        };
        if let Some(model) = model {
            // A study that a command works on shows its model when that has ended.
            let _ = self.act(Action::Show {
                model,
                beside: None,
            });
        }
    }

    /// Adds a log to the draft.
    pub(super) fn add_log(self: &Arc<Self>, name: String) {
        self.state().folder.logs.push(name);
        self.open();
    }

    /// Why no log can be taken now, if so.
    pub(super) fn takes_logs(&self) -> Result<Folder> {
        let state = self.state();
        if state.folder.study_file().exists() {
            return Err(Error::usage(format!(
                "{} describes this folder's logs already; start `jointwatch lab` in an empty folder for others",
                state.folder.study
            )));
        }
        Ok(state.folder.clone())
    }

    /// Does what a page asks for; a command is started and followed in a thread of its own.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Usage`]: something runs, or what is asked for is not there.
    pub(super) fn act(self: &Arc<Self>, action: Action) -> Result<()> {
        let mut state = self.state();
        if let Action::Cancel {} = action {
            if let Some(job) = &mut state.job {
                job.cancelled = true;
                if let Some(running) = &job.running {
                    running.end();
                }
            }
            return Ok(());
        }
        if let Some(job) = &state.job {
            return Err(Error::usage(format!(
                "{} still runs; wait for it or cancel it",
                job.what
            )));
        }
        let action = match action {
            Action::Reopen {} => {
                // Logs may have changed, and with them all that was drawn.
                state.views.clear();
                state.shown = None;
                drop(state);
                self.open();
                return Ok(());
            }
            Action::Draft {
                columns,
                rate,
                inertia,
            } => {
                state.said = Said {
                    columns,
                    sample_rate_hz: rate,
                    inertia,
                };
                drop(state);
                self.open();
                return Ok(());
            }
            Action::Undo {} => {
                let parent = state
                    .current
                    .and_then(|at| models::parent(&state.models, at));
                let Some(parent) = parent else {
                    return Err(Error::usage(
                        "nothing was added to this model that could be undone",
                    ));
                };
                Action::Show {
                    model: state.models[parent].file.clone(),
                    beside: None,
                }
            }
            other => other,
        };
        let plan = state.known().plan(&action)?;
        if let Action::Show { model, beside } = &action
            && state.show_again(model, beside.as_deref())
        {
            state.remember(Done {
                what: plan.what,
                command: job::line(&plan.words),
                done: true,
                said: "Shown as it was computed before.".into(),
                seconds: 0.0,
                useless: None,
            });
            drop(state);
            self.changed();
            return Ok(());
        }
        let useless = match &action {
            Action::Add {
                effects,
                force: false,
            } => Some(effects.clone()),
            _ => None,
        };
        self.start(&mut state, plan, useless)
    }

    fn start(
        self: &Arc<Self>,
        state: &mut State,
        plan: Plan,
        useless: Option<Vec<String>>,
    ) -> Result<()> {
        state.folder.make_written()?;
        let folder = state.folder.path.clone();
        let file = |name: &str| PathBuf::from(WRITTEN).join(name);
        let contents = plan.draws().then(|| file(".contents.json"));
        let json = matches!(plan.then, Then::Diagnosed { .. }).then(|| file(".result.json"));
        let running = Running::start(
            &self.program,
            &folder,
            &plan.words,
            contents.as_deref(),
            json.as_deref(),
        )
        .map_err(|e| Error::failed(format!("the command could not be started ({e})")))?;
        state.job = Some(Job {
            what: plan.what.clone(),
            command: job::line(&plan.words),
            said: String::new(),
            begun: Instant::now(),
            running: Some(running.clone()),
            cancelled: false,
        });
        self.changed();
        let session = Arc::clone(self);
        std::thread::spawn(move || {
            let ended = running.follow(&|line| {
                if let Some(job) = &mut session.state().job {
                    job.said = line;
                }
                session.changed();
            });
            let read = |path: Option<PathBuf>| {
                let path = folder.join(path?);
                let text = std::fs::read_to_string(&path).ok();
                // What was left by a command that was ended is not there either.
                let _ = std::fs::remove_file(&path);
                text
            };
            let (contents, json) = (read(contents), read(json));
            session.end(&plan, ended, (contents, json), useless);
        });
        Ok(())
    }

    fn end(
        self: &Arc<Self>,
        plan: &Plan,
        ended: job::Ended,
        (contents, json): (Option<String>, Option<String>),
        useless: Option<Vec<String>>,
    ) {
        let mut state = self.state();
        let Some(job) = state.job.take() else { return };
        let mut done = ended.done && !job.cancelled;
        let mut said = if job.cancelled {
            "Cancelled".into()
        } else {
            ended.said
        };
        if done && let Err(e) = state.take(&plan.then, contents, json) {
            (done, said) = (false, e.sentence);
        }
        let helpless = !done && !job.cancelled && said.contains("does not help");
        state.remember(Done {
            what: job.what,
            command: job.command,
            done,
            said,
            seconds: job.begun.elapsed().as_secs_f64(),
            useless: useless.filter(|_| helpless),
        });
        drop(state);
        self.changed();
        if done && plan.then == Then::Study {
            self.open();
        }
    }
}

impl State {
    fn known(&self) -> Known<'_> {
        Known {
            folder: &self.folder,
            models: &self.models,
            current: self.current,
            records: &self.records,
            blob: self.blob.as_ref(),
        }
    }

    fn remember(&mut self, done: Done) {
        self.done.push(done);
        let surplus = self.done.len().saturating_sub(REMEMBERED);
        self.done.drain(..surplus);
    }

    /// Whether a page that was drawn before shows a model; it is then the current one.
    fn show_again(&mut self, model: &str, beside: Option<&str>) -> bool {
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
    fn take(&mut self, then: &Then, contents: Option<String>, json: Option<String>) -> Result<()> {
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
            Then::Study | Then::Printed => return Ok(()),
        };
        let Some(contents) = contents else {
            return Err(Error::failed(
                "the command drew nothing; look at what it printed",
            ));
        };
        let key = self.views.last().map_or(1, |v| v.key + 1);
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
