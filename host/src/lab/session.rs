//! The one session of a lab: reads the study's folder, starts commands, follows them, and tells the
//! pages.

use super::action::{Action, Plan, Then};
use super::folder::{Folder, WRITTEN};
use super::job::{self, Running};
use super::live::Live;
use super::long::Long;
use super::models::{self, Entry};
use super::state::{Done, Job, Opened, State};
use super::{draft, locked, snapshot};
use crate::study::draft::UserChoices;
use crate::study::long::study::LongStudy;
use crate::study::{Study, mistakes};
use crate::text::error::{Error, Result};
use serde_json::Value;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};
use tokio::sync::watch;

/// The state, who waits for it to change, and the program that does the work.
pub(super) struct Session {
    state: Mutex<State>,
    revision: watch::Sender<u64>,
    program: PathBuf,
    /// The study that the lab was opened with.
    first: String,
    /// The device that is looked at.
    pub(super) live: Arc<Live>,
}

impl Session {
    /// A session on a folder, with the model to show first.
    pub(super) fn new(folder: Folder, model: Option<String>, program: PathBuf) -> Arc<Self> {
        Arc::new(Self {
            first: folder.study.clone(),
            state: Mutex::new(State::new(folder, model)),
            revision: watch::Sender::new(1),
            program,
            live: Arc::new(Live::new()),
        })
    }

    /// The state, locked for as long as it is held.
    pub(super) fn state(&self) -> MutexGuard<'_, State> {
        locked(&self.state)
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
        {
            let mut state = self.state();
            state.opened = Opened::Reading;
            if let Some(long) = state.long.take() {
                long.leave();
            }
        }
        self.changed();
        let session = Arc::clone(self);
        std::thread::spawn(move || {
            session.read_folder();
            session.changed();
            let long = session.state().long.clone();
            if let Some(long) = long {
                long.read(&|| session.changed());
            }
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
            if folder.study_file().exists() {
                // It was made meanwhile, and is read in a thread of its own.
                return;
            }
            match made {
                Ok(draft) => {
                    state.draft = draft.map(Arc::new);
                    state.opened = Opened::Missing;
                }
                Err(e) => state.opened = Opened::Wrong(e.sentence),
            }
            return;
        }
        match LongStudy::of(&folder.study_file()) {
            Ok(None) => {}
            Ok(Some(study)) => {
                let mut state = self.state();
                state.studies = folder.studies(&self.first);
                state.draft = None;
                state.long = Some(Arc::new(Long::new(study)));
                state.opened = Opened::Long;
                return;
            }
            Err(e) => {
                self.state().opened = Opened::Wrong(e.sentence);
                return;
            }
        }
        let study = Study::read(&folder.study_file());
        let models = models::found(&folder);
        let mut state = self.state();
        state.draft = None;
        state.studies = folder.studies(&self.first);
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
        if let (Some(job), Action::Cancel {}) = (&mut state.job, &action) {
            job.cancelled = true;
            job.running.end();
        }
        if let Action::Cancel {} = action {
            return Ok(());
        }
        if let Some(job) = &state.job {
            return Err(Error::usage(format!(
                "{} still runs; wait for it or cancel it",
                job.what
            )));
        }
        match action {
            // Logs may have changed, and with them all that was drawn.
            Action::Reopen {} => state.forget(),
            Action::Draft(choices) => {
                state.said = UserChoices {
                    columns: choices.columns,
                    sample_rate_hz: choices.rate,
                    inertia: choices.inertia,
                };
            }
            Action::Work { study } => {
                if !state.folder.studies(&self.first).contains(&study) {
                    return Err(Error::usage(format!(
                        "{study:?} is none of the studies in this folder"
                    )));
                }
                let words = ["lab".into(), study.clone()];
                state.remember(Done::at_once("Work on another study".into(), &words, ""));
                state.work_on(study);
            }
            Action::Undo {} => {
                let current = state.current;
                let parent = current.and_then(|at| models::parent(&state.models, at));
                let Some(parent) = parent else {
                    return Err(Error::usage(
                        "nothing was added to this model that could be undone",
                    ));
                };
                let model = state.models[parent].file.clone();
                let beside = None;
                return self.command(&mut state, &Action::Show { model, beside });
            }
            command => return self.command(&mut state, &command),
        }
        drop(state);
        self.open();
        Ok(())
    }

    /// Starts the command of an action, unless what it would show was drawn before.
    fn command(self: &Arc<Self>, state: &mut State, action: &Action) -> Result<()> {
        let plan = state.known().plan(action)?;
        if let Action::Show { model, beside } = action
            && state.show_again(model, beside.as_deref())
        {
            let said = "Shown as it was computed before.";
            state.remember(Done::at_once(plan.what, &plan.words, said));
            self.changed();
            return Ok(());
        }
        let useless = match action {
            Action::Add {
                effects,
                force: false,
            } => Some(effects.clone()),
            _ => None,
        };
        self.start(state, plan, useless)
    }

    fn start(
        self: &Arc<Self>,
        state: &mut State,
        plan: Plan,
        useless: Option<Vec<String>>,
    ) -> Result<()> {
        state.folder.make_written()?;
        let folder = state.folder.path.clone();
        // Of this lab alone: two may be open on one folder.
        let file = |name: &str| {
            PathBuf::from(WRITTEN).join(format!(".{}-{name}.json", std::process::id()))
        };
        let contents = plan.draws().then(|| file("contents"));
        let json = matches!(plan.then, Then::Diagnosed { .. }).then(|| file("result"));
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
            running: running.clone(),
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
        let made = done && matches!(plan.then, Then::Study | Then::Segments { .. });
        if done && let Then::Segments { study } = &plan.then {
            state.work_on(study.clone());
        }
        if made {
            // Nobody is to see the end of the command beside a folder that has no study.
            state.opened = Opened::Reading;
        }
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
        if made {
            self.open();
        }
    }
}
