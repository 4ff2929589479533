//! What the page can ask for, as a command of this program.

use super::folder::{Folder, WRITTEN};
use super::models::Entry;
use crate::text::error::{Error, Result};
use serde::{Deserialize, Deserializer};

/// One thing that the page asks for.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum Action {
    /// Write study.toml for the logs in the folder.
    Init(Choices),
    /// Take other columns for the draft.
    Draft(Choices),
    /// Read the study's folder again.
    Reopen {},
    /// Choose segments of a study whose logs are too long.
    Select {
        /// How many segments are chosen.
        segments: u32,
        /// How long each is, s.
        #[serde(deserialize_with = "number")]
        seconds: Option<f64>,
    },
    /// Work on another study of the folder.
    Work {
        /// The study's file, by its name in the folder.
        study: String,
    },
    /// Learn a model of the study.
    Identify {
        /// `polynomial`, `network` or `physical`.
        kind: String,
    },
    /// Show a model on the study.
    Show {
        /// The model's file, as [`Entry::file`].
        model: String,
        /// Another one beside it.
        beside: Option<String>,
    },
    /// Say what the current model lacks.
    Diagnose {},
    /// Add effects to the current model.
    Add {
        /// Effects with their axes, such as `coulomb@x`.
        effects: Vec<String>,
        /// Keep what does not help.
        #[serde(default)]
        force: bool,
    },
    /// Go back to the model that the current one was made from.
    Undo {},
    /// Make the blob of the current model.
    Export {},
    /// Run the device's integer code on a record.
    Replay {
        /// The record's file, as the study names it.
        record: String,
    },
    /// Run the firmware under QEMU on a record.
    Emulate {
        /// The record's file, as the study names it.
        record: String,
    },
    /// End the command that runs.
    Cancel {},
}

/// What the user says of logs that no study describes yet.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Choices {
    /// Role and column, as `init --column` takes them.
    #[serde(default)]
    pub(super) columns: Vec<(String, String)>,
    /// Sample rate of the logs, Hz; none where a column counts the time.
    #[serde(default, deserialize_with = "number")]
    pub(super) rate: Option<f64>,
    /// Inertia, kg or kg·m²; none where it is to be identified from the data.
    #[serde(default, deserialize_with = "number")]
    pub(super) inertia: Option<f64>,
}

/// A number or none. Where another package lets serde_json keep all digits, a tagged enum holds
/// numbers that only its own type reads.
fn number<'de, D: Deserializer<'de>>(from: D) -> std::result::Result<Option<f64>, D::Error> {
    let number = Option::<serde_json::Number>::deserialize(from)?;
    Ok(number.and_then(|n| n.as_f64()))
}

/// What becomes of a command's result.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Then {
    /// A model was written; it is the current one from now on, made from another one or from none.
    Model {
        /// The file that was written.
        file: String,
        /// The model that it was made from.
        from: Option<String>,
    },
    /// A model is shown, beside another one or alone.
    Shown {
        /// The model's file, as [`Entry::file`].
        model: String,
        /// The file of the other one.
        beside: Option<String>,
    },
    /// The model was diagnosed.
    Diagnosed {
        /// The model's file, as [`Entry::file`].
        model: String,
    },
    /// A study was written.
    Study,
    /// Segments were chosen; they are worked on from now on.
    Segments {
        /// The study of the chosen segments.
        study: String,
    },
    /// A blob was written.
    Blob {
        /// The blob's file in the study's folder.
        file: String,
        /// The model in it.
        model: String,
    },
    /// What was printed is all there is.
    Printed,
}

/// A command and what becomes of its result.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    /// What is done, in a few words.
    pub(super) what: String,
    /// The command and its arguments, without the program.
    pub(super) words: Vec<String>,
    /// What becomes of the result.
    pub(super) then: Then,
}

impl Plan {
    /// Whether the command makes something to draw.
    pub(super) fn draws(&self) -> bool {
        matches!(
            self.then,
            Then::Model { .. } | Then::Shown { .. } | Then::Diagnosed { .. }
        )
    }
}

/// What a plan is made from.
pub(super) struct Known<'a> {
    /// The study's folder, in which all files are named.
    pub(super) folder: &'a Folder,
    /// The models that are there.
    pub(super) models: &'a [Entry],
    /// The one that is looked at.
    pub(super) current: Option<usize>,
    /// The records' files, as the study names them.
    pub(super) records: &'a [String],
    /// The blob that was made last, and the model in it.
    pub(super) blob: Option<&'a (String, String)>,
}

impl Known<'_> {
    fn current(&self) -> Result<&Entry> {
        let at = self
            .current
            .ok_or_else(|| Error::usage("there is no model yet; identify one first"))?;
        Ok(&self.models[at])
    }

    fn model(&self, file: &str) -> Result<&Entry> {
        let found = self.models.iter().find(|m| m.file == file);
        found.ok_or_else(|| Error::usage(format!("{file:?} is none of the models in this folder")))
    }

    fn record(&self, file: &str) -> Result<&str> {
        let found = self.records.iter().find(|r| *r == file);
        found
            .map(String::as_str)
            .ok_or_else(|| Error::usage(format!("{file:?} is none of the study's records")))
    }

    /// The command of an action.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Usage`]: what it is about is not there.
    pub(super) fn plan(&self, action: &Action) -> Result<Plan> {
        let study = argument(&self.folder.study);
        let plan = |what: String, words: &[&str], then| Plan {
            what,
            words: words.iter().map(|w| (*w).to_string()).collect(),
            then,
        };
        Ok(match action {
            Action::Identify { kind } => {
                if !["polynomial", "network", "physical"].contains(&kind.as_str()) {
                    return Err(Error::usage(format!("{kind:?} is no kind of model")));
                }
                let file = self.folder.free(kind, "json");
                let words = ["identify", &study, "--model", kind, "-o", &file];
                let then = Then::Model {
                    file: file.clone(),
                    from: None,
                };
                plan(format!("Identify a {kind} model"), &words, then)
            }
            Action::Show { model, beside } => {
                let model = argument(&self.model(model)?.file);
                let other = beside.as_deref().map(|b| self.model(b)).transpose()?;
                let other = other.map(|b| argument(&b.file));
                let mut words = vec!["compare", &study, &model];
                if let Some(other) = &other {
                    words.extend(["--beside", other]);
                }
                let then = Then::Shown {
                    model: model.clone(),
                    beside: other.clone(),
                };
                plan("Compare with the records".into(), &words, then)
            }
            Action::Diagnose {} => {
                let model = argument(&self.current()?.file);
                let then = Then::Diagnosed {
                    model: model.clone(),
                };
                plan(
                    "Look for what is missing".into(),
                    &["diagnose", &study, &model],
                    then,
                )
            }
            Action::Add { effects, force } => self.add(&study, effects, *force)?,
            Action::Export {} => {
                let entry = self.current()?;
                let model = argument(&entry.file);
                let file = format!("{WRITTEN}/{}.bin", entry.stem());
                let then = Then::Blob {
                    file: file.clone(),
                    model: model.clone(),
                };
                plan(
                    "Export for the device".into(),
                    &["export", &model, "-o", &file],
                    then,
                )
            }
            Action::Replay { record } => self.device(&study, "replay", record)?,
            Action::Emulate { record } => self.device(&study, "emulate", record)?,
            Action::Init(choices) => self.init(choices),
            Action::Select { segments, seconds } => self.select(&study, *segments, *seconds),
            Action::Draft(_)
            | Action::Reopen {}
            | Action::Work { .. }
            | Action::Undo {}
            | Action::Cancel {} => {
                return Err(Error::usage("this is no command"));
            }
        })
    }

    fn add(&self, study: &str, effects: &[String], force: bool) -> Result<Plan> {
        let entry = self.current()?;
        let plain = |e: &String| {
            e.chars().all(|c| c.is_alphanumeric() || "_@-.".contains(c)) && !e.starts_with('-')
        };
        if effects.is_empty() || effects.len() > 8 || !effects.iter().all(plain) {
            return Err(Error::usage(
                "choose one to eight effects, as `jointwatch effects` lists them",
            ));
        }
        let file = self
            .folder
            .free(&format!("{}-{}", entry.stem(), effects.join("-")), "json");
        let mut words: Vec<String> = ["add", study, &argument(&entry.file)]
            .map(String::from)
            .into();
        words.extend(effects.iter().cloned());
        words.extend(["-o".into(), file.clone()]);
        if force {
            words.push("--force".into());
        }
        Ok(Plan {
            what: format!("Add {}", effects.join(", ")),
            words,
            then: Then::Model {
                file,
                from: Some(entry.file.clone()),
            },
        })
    }

    /// A command that runs the blob of the current model.
    fn device(&self, study: &str, command: &str, record: &str) -> Result<Plan> {
        let current = argument(&self.current()?.file);
        let Some((blob, _)) = self.blob.filter(|(_, model)| *model == current) else {
            return Err(Error::usage("export this model first"));
        };
        let record = self.record(record)?;
        let what = match command {
            "replay" => format!("Run the device's code on {record}"),
            _ => format!("Run the firmware on {record}"),
        };
        let words = [command, blob, study, "--record", record];
        Ok(Plan {
            what,
            words: words.map(String::from).into(),
            then: Then::Printed,
        })
    }

    fn select(&self, study: &str, segments: u32, seconds: Option<f64>) -> Plan {
        let folder = self.folder.free("segments", "");
        let (count, length) = (segments.to_string(), seconds.unwrap_or(2.0).to_string());
        let words = [
            "select",
            study,
            "--segments",
            &count,
            "--seconds",
            &length,
            "-o",
            &folder,
        ];
        Plan {
            what: "Choose segments".into(),
            words: words.map(str::to_owned).into(),
            then: Then::Segments {
                study: format!("{folder}/study.toml"),
            },
        }
    }

    fn init(&self, choices: &Choices) -> Plan {
        let mut words = vec!["init".to_string(), "--yes".into()];
        for (role, column) in &choices.columns {
            words.push(format!("--column={role}={column}"));
        }
        words.extend(choices.rate.map(|r| format!("--rate={r}")));
        words.extend(choices.inertia.map(|m| format!("--inertia={m}")));
        words.extend(["-o".into(), self.folder.study.clone()]);
        words.extend(self.folder.logs.iter().map(|l| argument(l)));
        Plan {
            what: "Write the study".into(),
            words,
            then: Then::Study,
        }
    }
}

/// A file as an argument that is no option.
fn argument(file: &str) -> String {
    match file.starts_with('-') {
        true => format!("./{file}"),
        false => file.into(),
    }
}
