//! `jointwatch changed`: what is different in a joint since its model was made.

use crate::cli::console::Console;
use crate::cli::report::Report;
use crate::diagnose::changed::{self, Changed, ErrorThenNow};
use crate::model::file::{AxisError, ModelFile};
use crate::report::page::Asked;
use crate::text::error::Result;
use crate::text::table::{Table, percent, value_with_unit};
use clap::Args;
use std::path::PathBuf;

/// Options of `jointwatch changed`.
#[derive(Args)]
pub(crate) struct Change {
    /// The model of the joint as it was.
    old: PathBuf,
    /// The study with records of the joint as it is now; those that the old model was made with
    /// are recognised and left out.
    study: PathBuf,
    /// A model of the joint as it is now; without it the old model's effects are fitted anew to
    /// the new records.
    new: Option<PathBuf>,
    #[command(flatten)]
    report: Report,
}

impl Change {
    pub(crate) fn run(self, console: &Console) -> Result<()> {
        let working = console.working("reading the records");
        let old = ModelFile::read(&self.old)?;
        let new = self.new.as_deref().map(ModelFile::read).transpose()?;
        let study = new.as_ref().unwrap_or(&old).read_study(&self.study, &[])?;
        self.report.check(console, None, &study)?;
        working.set_message("comparing then and now");
        let (changed, now) = changed::changed(&study, &old, new.as_ref())?;
        let page = self.report.page(Asked {
            answer: Some(changed.in_a_sentence()),
            before: now.model.as_ref().map(|_| &old),
            judged_on: "new records".into(),
            ..Asked::of_model(&now.study, now.model.as_ref().unwrap_or(&old))
        })?;
        working.finish_and_clear();
        for source in &study.sources {
            for done in &source.time {
                console.say(format!("Note: {}: {done}.", source.file))?;
            }
        }
        for record in changed.records.iter().filter(|r| r.seen_as.is_some()) {
            console.say(format!(
                "Note: {} is a record that the old model was made with, and is left out.",
                record.file
            ))?;
        }
        console.say(in_words(&changed))?;
        console.say_notes(&changed.notes)?;
        console.say(changed.in_a_sentence())?;
        self.report.write(console, page)?;
        console.json(&changed)
    }
}

fn in_words(changed: &Changed) -> String {
    let mut text = format!(
        "Error of the old model on its validation records then, and on the new records:\n{}\n",
        errors(&changed.errors)
    );
    if let Some(from) = &changed.new_values_from
        && !changed.parameters.is_empty()
    {
        text += &format!(
            "\nParameters, new values from {from}; a difference counts when the two 95 % intervals do not overlap:\n{}\n",
            parameters(changed)
        );
    }
    text
}

fn errors(errors: &[ErrorThenNow]) -> Table {
    let mut table = Table::new(&[
        "axis",
        "NMSE then",
        "now",
        "relative error then",
        "now",
        "grew",
    ]);
    let nmse = |e: &AxisError| percent(e.nmse_percent);
    let relative = |e: &AxisError| format!("{:.4}", e.relative_error);
    for error in errors {
        let then = error.then.as_ref();
        table.row(vec![
            error.axis.clone(),
            then.map_or("unknown".into(), nmse),
            nmse(&error.now),
            then.map_or("unknown".into(), relative),
            relative(&error.now),
            if error.grew { "yes" } else { "no" }.into(),
        ]);
    }
    table
}

fn parameters(changed: &Changed) -> Table {
    let mut table = Table::new(&[
        "effect",
        "parameter",
        "old",
        "new",
        "difference",
        "at least",
        "at most",
        "counts",
    ]);
    let mut last = "";
    for p in &changed.parameters {
        let end = |at: usize| {
            p.interval
                .map_or("unknown".into(), |ends| value_with_unit(ends[at], &p.unit))
        };
        table.row(vec![
            if p.effect == last {
                String::new()
            } else {
                p.effect.clone()
            },
            p.name.clone(),
            value_with_unit(p.old, &p.unit),
            value_with_unit(p.new, &p.unit),
            value_with_unit(p.difference, &p.unit),
            end(0),
            end(1),
            match p.counts {
                Some(true) => "yes",
                Some(false) => "no",
                None => "unknown",
            }
            .into(),
        ]);
        last = &p.effect;
    }
    table
}
