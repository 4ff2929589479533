//! Commands that learn a model, judge it, and say what it lacks.

pub(super) mod accumulate;
pub(super) mod add;
pub(super) mod changed;
pub(super) mod compare;
pub(super) mod diagnose;
pub(super) mod identify;
mod identify_network;
pub(super) mod merge;
pub(super) mod respond;
mod staircase;

use crate::cli::console::Console;
use crate::model::file::ModelFile;
use crate::model::values;
use crate::text::error::Result;
use crate::text::table::significant;

/// Prints the inertias that were identified, and every parameter of the effects.
fn say_values(console: &Console, model: &ModelFile) -> Result<()> {
    say_inertias(console, model, |_| None)?;
    console.say(values::table(&model.effects).to_string())
}

/// Prints the inertias that were identified, with their standard errors where these are known.
fn say_inertias(
    console: &Console,
    model: &ModelFile,
    error: impl Fn(&str) -> Option<f64>,
) -> Result<()> {
    for axis in model.axes.iter().filter(|a| a.inertia_identified) {
        let (value, unit) = (significant(axis.inertia), axis.kind.inertia_unit());
        console.say(match error(&axis.name) {
            Some(error) => format!(
                "Inertia of {}: {value} ± {error:.1e} {unit} (identified, one standard error).",
                axis.name
            ),
            None => format!("Inertia of {}: {value} {unit} (identified).", axis.name),
        })?;
    }
    Ok(())
}
