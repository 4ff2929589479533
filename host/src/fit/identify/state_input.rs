//! Which input of a study its polynomial or network takes as a further state.

use super::FitResult;
use crate::signal::motion::Motion;
use crate::study::Study;
use crate::text::error::{Error, Result};

/// What a user says who wants none.
const NONE: &str = "none";

/// The input that was chosen, and what is to be known about the choice.
pub(super) struct StateInput {
    /// Its name; none where the force is that of the motion alone.
    pub(super) name: Option<String>,
    warning: Option<String>,
}

impl StateInput {
    /// The input of this name; without a name the only one of a study of one axis. One that does
    /// not change in the training records says nothing, and is left out.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Usage`] for a name that the study has not, and for a study of
    /// two axes.
    pub(super) fn of(study: &Study, wanted: Option<&str>, training: &[&Motion]) -> Result<Self> {
        let names = || study.inputs.iter().map(|input| input.name.as_str());
        let left_out = |warning: String| Self {
            name: None,
            warning: Some(warning),
        };
        let chosen = match wanted {
            Some(NONE) => None,
            Some(name) if study.axes.len() > 1 => {
                return Err(Error::usage(format!(
                    "--input {name}: the terms of two axes hold the states of both and no input; leave --input out, and let effects follow the \
                     input (--model physical)"
                )));
            }
            Some(name) => Some(names().find(|known| *known == name).ok_or_else(|| {
                let known: Vec<&str> = names().chain([NONE]).collect();
                Error::usage(format!(
                    "--input {name}: the study names no such input; give one of: {}",
                    known.join(", ")
                ))
            })?),
            None if study.axes.len() > 1 && names().next().is_some() => {
                return Ok(left_out(
                    "the inputs of a study of two axes are no states of the model, which hold the motion of both: only effects follow them"
                        .into(),
                ));
            }
            None => match names().collect::<Vec<_>>()[..] {
                [] => None,
                [only] => Some(only),
                [..] => {
                    return Ok(left_out(format!(
                        "the model follows the motion alone, since the study names several inputs: choose one of them with --input ({})",
                        names().collect::<Vec<_>>().join(", ")
                    )));
                }
            },
        };
        let Some(name) = chosen else {
            return Ok(Self {
                name: None,
                warning: None,
            });
        };
        let mut values = training.iter().filter_map(|m| m.input(name)).flatten();
        let first = values.next();
        if values.all(|value| Some(value) == first) {
            return Ok(left_out(format!(
                "the input {name} is the same at every training row, so the model follows the motion alone: record with other values of it"
            )));
        }
        Ok(Self {
            name: Some(name.to_owned()),
            warning: None,
        })
    }

    /// The result with what was chosen, and why.
    pub(super) fn told(self, mut found: FitResult) -> FitResult {
        found.state_input = self.name;
        found.warnings.extend(self.warning);
        found
    }
}
