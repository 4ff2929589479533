//! What parts have to share to be merged: the study's channels, its filters, and what every number
//! is divided by before it is summed.

use crate::fit::effects::columns::Records;
use crate::fit::identify::{Prepared, base_terms};
use crate::fit::polynomial::input_ranges;
use crate::model::InputRange;
use crate::model::effects::AxisEffect;
use crate::signal::motion::{Filters, Motion};
use crate::study::further::Template;
use crate::study::series::rms;
use crate::study::{Axis, Study};
use crate::text::error::{Error, Result};
use jointwatch_shared::effect::about::Role;
use serde::{Deserialize, Serialize};

/// What the plan of every part says first.
const FORMAT: &str = "jointwatch-sums/1";

/// How records are summed, chosen by the records that the study lists itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Names the format and its version.
    pub(super) format: String,
    /// Name of the study.
    pub study: String,
    /// SHA-256 of what study.toml says of the logs.
    description: String,
    /// One or two axes.
    pub axes: Vec<Axis>,
    /// Sample rate, bands and filters.
    pub filters: Filters,
    /// What brings the states to ±1 in the study's own training records.
    pub(super) inputs: Vec<InputRange>,
    /// Per axis powers of two, as exponents, above the RMS of restoring force, applied force and
    /// acceleration.
    pub(super) scales: Vec<[i32; 3]>,
    /// The effects whose strengths can be found from sums.
    pub(super) terms: Vec<String>,
    /// That the study lists no effects, and which ones were taken.
    pub(super) proposed: Option<String>,
    /// Per axis and column of the effects a power of two, as exponent, above its RMS; then those
    /// of inertias and force.
    pub(super) columns: Vec<Vec<i32>>,
    /// Why the effects cannot be found from sums.
    pub(super) not_linear: Option<String>,
}

impl Plan {
    /// The plan that a study's own training records set.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when the study has no training record, or one is too
    /// short, or the study leaves out standstill.
    pub fn of(study: &Study, template: &Template) -> Result<Self> {
        if study.leave_out_standstill {
            return Err(Error::data(format!(
                "{}: sums of parts hold every row, those in which nothing moves as well; take leave_out_standstill out of it, or identify \
                 from the records themselves",
                study.path.display()
            )));
        }
        let prepared = Prepared::new(study)?;
        let training = prepared.training(study);
        let (bound, proposed) = base_terms(study)?;
        let names: Vec<&str> = study.axes.iter().map(|a| a.name.as_str()).collect();
        let not_linear = bound.iter().find_map(|term| shaped(term, &names));
        let bound = if not_linear.is_some() {
            Vec::new()
        } else {
            bound
        };
        let series = |of: &dyn Fn(&Motion) -> Vec<f64>| {
            let all: Vec<f64> = training.iter().flat_map(|motion| of(motion)).collect();
            exponent(&all)
        };
        let scales = study.axes.iter().enumerate().map(|(index, axis)| {
            let inertia = axis.inertia.unwrap_or(0.0);
            [
                series(&|m| m.restoring_force(index, inertia, axis.restoring_force)),
                series(&|m| m.force[index].clone()),
                series(&|m| m.acceleration[index].clone()),
            ]
        });
        let records = Records::new(&study.axes, &training, &prepared.filters.band);
        let columns = columns(&records, &bound);
        let rows = records.rows_per_axis();
        let of_axis = |axis: usize| {
            let columns = columns.iter();
            columns
                .map(|c| exponent(&c[axis * rows..(axis + 1) * rows]))
                .collect()
        };
        Ok(Self {
            format: FORMAT.into(),
            study: study.name.clone(),
            description: template.sha256()?,
            axes: study.axes.clone(),
            inputs: input_ranges(&training, None),
            scales: scales.collect(),
            terms: bound.iter().map(|term| term.name(&names)).collect(),
            proposed,
            columns: (0..study.axes.len()).map(of_axis).collect(),
            not_linear,
            filters: prepared.filters,
        })
    }

    /// The plan that a text holds, as `serde_json` writes it; `called` names it in messages.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`]: no plan, or one of another version.
    pub fn parse(called: &str, text: &str) -> Result<Self> {
        let plan: Self = serde_json::from_str(text)
            .map_err(|e| Error::data(format!("{called}: this is no plan of sums ({e})")))?;
        plan.check()
            .map_err(|what| Error::data(format!("{called}: {what}")))?;
        Ok(plan)
    }

    /// The effects, bound to their axes.
    pub(super) fn bound(&self) -> Result<Vec<AxisEffect>> {
        let names: Vec<&str> = self.axes.iter().map(|a| a.name.as_str()).collect();
        AxisEffect::parse_all(&self.terms, &names)
    }

    /// Whether a polynomial can be made of the sums: it needs every inertia beforehand.
    pub(super) fn has_polynomial(&self) -> bool {
        self.axes.iter().all(|axis| axis.inertia.is_some())
    }

    /// What another plan has that this has not, as a clause; nothing when they are the same.
    pub(super) fn difference(&self, other: &Self) -> Option<&'static str> {
        let same = [
            (self.format == other.format, "of another version"),
            (self.study == other.study, "of another study"),
            (
                self.description == other.description && self.axes == other.axes,
                "of another study.toml, which says other things of the logs",
            ),
            (self.filters == other.filters, "filtered in another band"),
            (
                self == other,
                "normalised by other training records, or for other [base] terms",
            ),
        ];
        same.into_iter().find(|(same, _)| !same).map(|(_, how)| how)
    }

    /// The sentence that says what is wrong with a plan from a file, if anything.
    pub(super) fn check(&self) -> std::result::Result<(), String> {
        if self.format != FORMAT {
            return Err(format!(
                "its format is '{}' where this version reads '{FORMAT}'",
                self.format
            ));
        }
        let axes = self.axes.len();
        let shapes = (1..=2).contains(&axes)
            && self.inputs.len() == 2 * axes
            && self.inputs.iter().all(InputRange::is_sound)
            && self.scales.len() == axes
            && self.columns.len() == axes;
        if !shapes {
            return Err("its axes do not fit together".into());
        }
        self.filters.check()?;
        let bound = self.bound().map_err(|e| e.sentence)?;
        let width = self.width();
        let columns = bound
            .iter()
            .map(|b| b.entry.parameters().len())
            .sum::<usize>();
        let inertias = self.axes.iter().filter(|a| a.inertia.is_none()).count();
        if self.columns.iter().any(|c| c.len() != width) || width != columns + inertias + 1 {
            return Err("its effects and its sums do not fit together".into());
        }
        Ok(())
    }

    /// Columns of the effects, of inertias and of the force together.
    pub(super) fn width(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }
}

/// Why a term's parameters are not all found by one least squares; nothing when they are.
fn shaped(term: &AxisEffect, names: &[&str]) -> Option<String> {
    let name = term.name(names);
    let parameters = term.entry.parameters().iter();
    let shape = parameters
        .clone()
        .find(|p| !matches!(p.role, Role::Linear { .. }));
    match shape {
        Some(shape) => Some(format!("{} of {name} shapes its force", shape.name)),
        None if term.entry.about.name == "time_delay" => {
            Some(format!("{name} moves the force channel in time"))
        }
        None => None,
    }
}

/// The exponent of the power of two above the RMS of a series; 0 where it is zero throughout.
fn exponent(series: &[f64]) -> i32 {
    let rms = rms(series);
    if rms > 0.0 {
        rms.log2().floor() as i32 + 1
    } else {
        0
    }
}

/// The columns of effects along records, each at strength 1, then those of inertias, then the
/// force; both axes one after the other.
pub(super) fn columns(records: &Records<'_>, terms: &[AxisEffect]) -> Vec<Vec<f64>> {
    let of_terms = terms.iter().flat_map(|term| {
        let values = vec![0.0; term.entry.parameters().len()];
        records.columns(term, &values)
    });
    let inertias = records.accelerations.iter().flatten().cloned();
    let mut columns: Vec<Vec<f64>> = of_terms.collect();
    columns.extend(inertias);
    columns.push(records.measured.clone());
    columns
}

/// The sentence for a study whose plan does not serve what is asked.
pub(super) fn refused(study: &str, why: &str) -> Error {
    Error::data(format!(
        "the sums of {study:?} cannot give that model: {why}"
    ))
}
