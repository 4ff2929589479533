//! A model on the page: its errors, and what it says of every record row by row.

use crate::assess::compare::{self, Comparison};
use crate::diagnose::PerAxis;
use crate::model::file::ModelFile;
use crate::model::file::per_axis;
use crate::report::axis_history::{AxisHistory, histories};
use crate::signal::motion;
use crate::study::{Role, Study};
use crate::text::error::{Error, Result};

/// A model, its errors, and what it says row by row.
pub(super) struct Version<'a> {
    /// Its name on the page.
    pub(super) label: String,
    pub(super) model: &'a ModelFile,
    /// Its errors on the study, record by record and on all records of a role.
    pub(super) comparison: Comparison,
    /// Record by record, axis by axis.
    pub(super) histories: Vec<Vec<AxisHistory>>,
}

impl<'a> Version<'a> {
    pub(super) fn new(label: &str, study: &Study, model: &'a ModelFile) -> Result<Self> {
        let comparison = compare::compare(study, model)?;
        let motions = motion::motions(&*model.corrected(study)?, &model.filters)?;
        let histories: Vec<Vec<AxisHistory>> = motions
            .iter()
            .map(|motion| histories(model, motion))
            .collect::<Result<_>>()?;
        for (record, axes) in study.records.iter().zip(&histories) {
            for history in axes {
                check_finite(&record.file, history)?;
            }
        }
        Ok(Self {
            label: label.into(),
            model,
            comparison,
            histories,
        })
    }

    /// The role of the records that errors are judged on.
    pub(super) fn judged(&self) -> Role {
        self.comparison.judged_role()
    }

    /// Per axis the relative error on those records.
    pub(super) fn errors(&self) -> PerAxis {
        per_axis(match self.judged() {
            Role::Train => &self.comparison.verification,
            Role::Validate => &self.comparison.validation,
        })
    }

    /// The judged records of an axis in which it moves.
    pub(super) fn judged_courses(&self, study: &Study, axis: usize) -> Vec<AxisHistory> {
        let records = study
            .records
            .iter()
            .zip(&self.histories)
            .zip(&self.comparison.records);
        records
            .filter(|((record, histories), figures)| {
                let figures = figures.axes.get(&histories[axis].axis);
                record.role == self.judged() && figures.is_some_and(|f| !f.at_rest)
            })
            .map(|((_, histories), _)| histories[axis].clone())
            .collect()
    }
}

fn check_finite(file: &str, history: &AxisHistory) -> Result<()> {
    let series = [
        &history.displacement,
        &history.velocity,
        &history.measured,
        &history.predicted,
    ];
    match series.iter().all(|s| s.iter().all(|v| v.is_finite())) {
        true if !history.measured.is_empty() => Ok(()),
        _ => Err(Error::data(format!(
            "{file}: axis {} has no rows to draw, or a number that is not finite; compare the model on this record to see why",
            history.axis
        ))),
    }
}

/// Cuts every version's records to the rows that all versions have: a correction in time costs rows
/// at an end.
pub(super) fn align(versions: &mut [Version<'_>]) {
    let [before, after] = versions else {
        return;
    };
    for (old, new) in before.histories.iter_mut().zip(&mut after.histories) {
        let (Some(a), Some(b)) = (old.first(), new.first()) else {
            continue;
        };
        let (Some(from), Some(to)) = (
            a.at.first().zip(b.at.first()).map(|(a, b)| a.max(*b)),
            a.at.last().zip(b.at.last()).map(|(a, b)| a.min(*b)),
        ) else {
            continue;
        };
        for history in old.iter_mut().chain(new.iter_mut()) {
            let half_row = 0.5 * (history.at.get(1).unwrap_or(&0.0) - history.at[0]);
            let first = history.at.partition_point(|t| *t < from - half_row);
            let end = history.at.partition_point(|t| *t <= to + half_row);
            for series in [
                &mut history.at,
                &mut history.displacement,
                &mut history.velocity,
                &mut history.measured,
                &mut history.predicted,
            ] {
                series.truncate(end);
                series.drain(..first);
            }
        }
    }
}
