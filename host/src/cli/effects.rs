//! `jointwatch effects`: the library of force laws, as a list and one by one.

use super::console::Console;
use crate::report::effects_page::{self, in_words};
use crate::text::error::{Error, Result};
use crate::text::nearest::suggestion;
use clap::Args;
use jointwatch_shared::effect::{EFFECTS, Entry};

/// Options of `jointwatch effects`.
#[derive(Args)]
pub(crate) struct Effects {
    /// The effect to explain; a list of all of them when left out.
    name: Option<String>,
    /// Print all of them as a page in Markdown: docs/reference/effects.md is made with it.
    #[arg(long, conflicts_with = "name")]
    markdown: bool,
}

impl Effects {
    pub(super) fn run(self, console: &Console) -> Result<()> {
        let all = || EFFECTS.iter().map(effects_page::as_json);
        let Some(name) = &self.name else {
            console.say(if self.markdown {
                effects_page::markdown()
            } else {
                effects_page::list()
            })?;
            return console.json(&serde_json::json!({ "effects": all().collect::<Vec<_>>() }));
        };
        let known: Vec<&str> = EFFECTS.iter().map(|e| e.about.name).collect();
        let entry = Entry::named(name).ok_or_else(|| {
            Error::data(format!(
                "there is no effect {name:?}: {}",
                suggestion(name, &known)
            ))
        })?;
        console.say(in_words(entry))?;
        console.json(&effects_page::as_json(entry))
    }
}
