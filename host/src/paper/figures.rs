//! The page's figures: which records they show, and the files they go into.

use crate::model::file::ModelFile;
use crate::report::{Against, AxisHistory, Drawing, Figure, Panel, comparison, histories, phase};
use crate::signal::motion::{self, Motion};
use crate::study::{Role, Study};
use crate::text::error::{Error, Result};

/// Verification and validation of a model (Figs. 7 to 10 and 15 to 18): one figure each, for the
/// last training record, which in a study of two axes is the one with both driven, and for the last
/// validation record.
///
/// `names` are the files' names without their ending, `words` those of the legend, what was
/// measured and the model.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the study lacks one of the roles or the model gives
/// numbers that are not finite.
pub(super) fn verification_and_validation(
    study: &Study,
    model: &ModelFile,
    names: [&str; 2],
    words: [&str; 2],
) -> Result<[Drawing; 2]> {
    let motions = motion::motions(study, &model.filters)?;
    let draw = |role, name| {
        let last = motions
            .iter()
            .rfind(|motion| study.records[motion.record].role == role)
            .ok_or_else(|| {
                Error::data(format!(
                    "{}: a figure needs a record to verify on and one to validate on; give one of each role",
                    study.path.display()
                ))
            })?;
        let [measured, predicted] = words;
        Drawing::new(
            name,
            &comparison(&histories(model, last)?, measured, predicted),
        )
    };
    let [verification, validation] = names;
    Ok([
        draw(Role::Train, verification)?,
        draw(Role::Validate, validation)?,
    ])
}

/// The training records (Figs. 6 and 14): restoring force over displacement and velocity.
///
/// With two axes the records are the paper's three: x driven alone, φ alone, both. An axis that is
/// not driven rests, because the coupling needs both, so that its panels would be empty: the two
/// records with one driven axis share a row.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the model does not fit the study.
pub(super) fn training(study: &Study, model: &ModelFile, name: &str) -> Result<Drawing> {
    let motions = motion::motions(study, &model.filters)?;
    let trained = |motion: &&Motion| study.records[motion.record].role == Role::Train;
    let records: Vec<Vec<AxisHistory>> = motions
        .iter()
        .filter(trained)
        .map(|motion| histories(model, motion))
        .collect::<Result<_>>()?;
    let rows = match &records[..] {
        [x_alone, phi_alone, both] if both.len() == 2 => vec![
            [
                panels(&x_alone[..1], "(a) x alone driven"),
                panels(&phi_alone[1..], "(b) phi alone driven"),
            ]
            .concat(),
            panels(both, "(c) both driven"),
        ],
        _ => records
            .iter()
            .zip('a'..)
            .map(|(histories, letter)| panels(histories, &format!("({letter}) training record")))
            .collect(),
    };
    let figure = Figure {
        rows,
        legend: Vec::new(),
    };
    Drawing::new(name, &figure)
}

fn panels(histories: &[AxisHistory], title: &str) -> Vec<Panel> {
    let over = [Against::Displacement, Against::Velocity];
    histories
        .iter()
        .flat_map(|history| over.map(|against| phase::measured(history, against, title.into())))
        .collect()
}
