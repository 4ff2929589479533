//! What is refused before an axis is drafted: columns that the user named wrongly, and logs in
//! which no force or nothing that moves can be told.

use super::parts::{UserChoices, names};
use super::trial::Parts;
use crate::study::AxisKind;
use crate::study::channels::units::Quantity;
use crate::study::survey::{Survey, SurveyedColumn};
use crate::text::error::{Error, Result};

/// Refuses columns that the user named twice, or that are not there.
pub(super) fn check_said(survey: &Survey, said: &UserChoices) -> Result<()> {
    for (place, (role, column)) in said.columns.iter().enumerate() {
        let before = &said.columns[..place];
        if before.iter().any(|(other, _)| other == role) {
            return Err(Error::usage(format!(
                "--column {role}= was given twice; give it once, and write a list of columns into study.toml where several make the {role}"
            )));
        }
        if let Some((other, _)) = before.iter().find(|(_, c)| c == column) {
            return Err(Error::usage(format!(
                "the column {column:?} cannot be the {other} and the {role}; give each a column of its own"
            )));
        }
        let none = match role.as_str() {
            "time" => said.is_timeless(survey),
            "force" => said.is_free(survey),
            _ => false,
        };
        if survey.column(column).is_none() && !none {
            return Err(Error::usage(format!(
                "{} has no column {column:?}; --column {role}= needs one of {}",
                survey.file,
                names(survey)
            )));
        }
    }
    Ok(())
}

/// Says which part of an axis is missing, and why where a column would be it.
pub(super) fn nothing_to_draft(survey: &Survey, time: Option<&str>, said: &UserChoices) -> Error {
    let kinds = [AxisKind::Translation, AxisKind::Rotation];
    let forces = |kind| Parts::of(survey, time, kind, said, &[]).force;
    let force = kinds.into_iter().flat_map(forces).next();
    let no_force = force.is_none() && !said.is_free(survey);
    let (missing, quantity): (_, fn(AxisKind) -> Quantity) = match no_force {
        true => ("force", Quantity::Force),
        false => ("displacement", Quantity::Displacement),
    };
    let either = kinds.map(quantity);
    let named = survey
        .columns
        .iter()
        .filter(|c| either.iter().any(|q| c.named.score(*q) > 0));
    if let Some(column) = named.clone().find(|c| c.missing > 0) {
        let row = column.values.iter().position(|v| !v.is_finite());
        return Error::data(format!(
            "{}: column {:?} would be the {missing}, but {} of its rows hold no number, the first of them row {}; repair the log, or leave \
             these rows out",
            survey.file,
            column.name,
            column.missing,
            row.unwrap_or(0)
        ));
    }
    if let Some(column) = named.clone().find(|c| c.rms == 0.0) {
        return Error::data(format!(
            "{}: column {:?} would be the {missing}, but all of its rows hold the same number; check the channel, or name another one with \
             --column {missing}=COLUMN",
            survey.file, column.name
        ));
    }
    let others: Vec<&str> = others(survey, time, said)
        .map(|c| c.name.as_str())
        .collect();
    if let Some(force) = force
        && others.iter().all(|other| *other == force.name)
    {
        return Error::data(format!(
            "{}: beside the force {:?} no column changes but for the time, so nothing that moves was logged; log the displacement, the velocity \
             or the acceleration with it, or give its file as well",
            survey.file, force.name
        ));
    }
    let instead = match missing {
        "force" => {
            "; the current of a motor may stand for it, or in study.toml a list of pressures, each with the piston's area as its scale; \
             --column force=0 where none is applied, as in a free decay or on a shaken base"
        }
        _ => "",
    };
    Error::data(format!(
        "{}: no column can be told to be the {missing}; name it with --column {missing}=COLUMN, of {}{instead}",
        survey.file,
        others.join(", ")
    ))
}

/// The columns that change and that are neither taken already nor a count of the rows.
fn others<'a>(
    survey: &'a Survey,
    time: Option<&'a str>,
    said: &'a UserChoices,
) -> impl Iterator<Item = &'a SurveyedColumn> {
    let is_taken = move |name: &str| {
        let mut named = said.columns.iter();
        Some(name) == time || named.any(|(_, column)| column == name)
    };
    let is_count = |c: &SurveyedColumn| c.values.windows(2).all(|w| w[1] - w[0] == 1.0);
    let columns = survey.columns.iter();
    columns.filter(move |c| c.rms > 0.0 && !is_taken(&c.name) && !is_count(c))
}
