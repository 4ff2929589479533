//! A verdict as `diagnose` gives it, and the effects that it names.

use super::catalogue::Subject;
use super::study::axis_name;
use jointwatch_shared::effect::{EFFECTS, Entry};
use serde_json::Value;

/// An effect on an axis, as a verdict names it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Named {
    /// The effect's name in the library.
    pub effect: String,
    /// The axis, or "both".
    pub axis: String,
}

impl Named {
    pub(super) fn read(value: &Value) -> Option<Self> {
        let text = |key: &str| Some(value.get(key)?.as_str()?.to_owned());
        Some(Self {
            effect: text("effect")?,
            axis: text("axis")?,
        })
    }

    /// A hidden subject on its axis.
    pub(super) fn hidden(subject: &Subject, axis: usize) -> Self {
        let both = subject.acts_on_both;
        Self {
            effect: subject.name.into(),
            axis: if both { "both" } else { axis_name(axis) }.into(),
        }
    }

    /// Whether a verdict's entry names this truth: same effect, same axis. What acts on both axes
    /// may be bound to either.
    pub(super) fn is(&self, said: &Self) -> bool {
        self.effect == said.effect && self.on_axis_of(said)
    }

    pub(super) fn on_axis_of(&self, said: &Self) -> bool {
        self.axis == "both" || self.axis == said.axis
    }

    /// As [`Named::is`], or one of the effects that measurements cannot tell from it in general.
    pub(super) fn is_or_equals(&self, said: &Self) -> bool {
        let equals = equivalents(&self.effect).contains(&said.effect.as_str());
        self.is(said) || (equals && self.on_axis_of(said))
    }
}

/// What may be named for a hidden effect without being wrong: what its file says looks like it, and
/// every law that is it with special strengths.
fn equivalents(hidden: &str) -> Vec<&'static str> {
    let alike = Entry::named(hidden).map_or(&[][..], |entry| entry.looks_like);
    let wider = EFFECTS.iter().filter(|e| e.replaces.contains(&hidden));
    let wider = wider.map(|e| e.about.name);
    alike.iter().copied().chain(wider).collect()
}

impl std::fmt::Display for Named {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}@{}", self.effect, self.axis)
    }
}

/// A verdict as `diagnose --json` writes it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Verdict {
    /// "effect", "none", "unknown" or "data".
    pub word: String,
    /// Everything that is missing.
    pub found: Vec<Named>,
    /// Candidates for the first of them.
    pub ranked: Vec<Named>,
    /// What the first candidate cannot be told from by these records.
    pub alike: Vec<String>,
    /// Everything that is given a probability.
    pub probabilities: Vec<(String, f64)>,
    /// How likely it is, as stated, that the first candidate or one of those acts.
    pub of_group: Option<f64>,
    /// Axis, relative validation error before and after adding, and noise floor, where the verdict
    /// has them.
    pub errors: Vec<(String, [Option<f64>; 3])>,
}

impl Verdict {
    /// Reads it.
    ///
    /// # Errors
    /// When the text does not keep the contract.
    pub fn read(text: &str) -> Result<Self, String> {
        let value: Value = serde_json::from_str(text).map_err(|e| format!("no JSON: {e}"))?;
        let names = |key: &str| -> Result<Vec<Named>, String> {
            let list = value.get(key).and_then(Value::as_array);
            let list = list.ok_or(format!("the verdict has no list '{key}'"))?;
            let read = |entry| {
                Named::read(entry).ok_or(format!("an entry of '{key}' names no effect and axis"))
            };
            list.iter().map(read).collect()
        };
        let word = value.get("verdict").and_then(Value::as_str);
        let word = word.filter(|w| ["effect", "none", "unknown", "data"].contains(w));
        let keys = [
            "relative_error_before",
            "relative_error_after",
            "noise_floor",
        ];
        let before = value.get(keys[0]).and_then(Value::as_object);
        let axes = before
            .ok_or("the verdict has no 'relative_error_before' per axis")?
            .keys();
        Ok(Self {
            word: word.ok_or("the verdict is none of the four words")?.into(),
            found: names("found")?,
            ranked: names("ranked")?,
            alike: value["ranked"][0]["equivalent"]
                .as_array()
                .into_iter()
                .flatten()
                .filter_map(|name| Some(name.as_str()?.to_owned()))
                .collect(),
            probabilities: value["probabilities"]
                .as_object()
                .into_iter()
                .flatten()
                .filter_map(|(said, chance)| Some((said.clone(), chance.as_f64()?)))
                .collect(),
            of_group: value["ranked"][0]["group_probability"].as_f64(),
            errors: axes
                .map(|axis| {
                    let of = |key: &str| value.get(key)?.get(axis)?.as_f64();
                    (axis.clone(), keys.map(of))
                })
                .collect(),
        })
    }
}
