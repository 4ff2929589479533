//! What a draft is made of.

use crate::study::channels::turns::unwrap;
use crate::study::channels::units::Quantity;
use crate::study::survey::{Survey, SurveyedColumn, SurveyedTime};
use crate::study::{AxisKind, Convention, Role};

/// One column in a draft, and how its numbers become SI.
#[derive(Clone, Debug, PartialEq)]
pub struct DraftChannel {
    /// Name of the column.
    pub column: String,
    /// Its unit; SI when absent.
    pub unit: Option<String>,
    /// −1 where the sign was turned.
    pub scale: f64,
    /// The bit that holds the sign of its numbers.
    pub sign_bit: Option<u32>,
    /// Whether its place was guessed from the numbers or from a single letter, rather than said by
    /// name and unit.
    pub guessed: bool,
}

/// One record of a draft.
#[derive(Clone, Debug)]
pub struct DraftRecord {
    /// The file as it will stand in study.toml.
    pub file: String,
    /// Learnt from, or kept for validation.
    pub role: Role,
    /// First row and the row after the last.
    pub rows: Option<[usize; 2]>,
    /// Names of the columns where the file has none, or those of several runs side by side.
    pub columns: Option<Vec<String>>,
}

/// What a user has said, so that it need not be guessed.
#[derive(Clone, Debug, Default)]
pub struct UserChoices {
    /// `role=column` pairs; roles are time (or `time=none` for a quasi-static log), displacement,
    /// velocity, acceleration and force (or `force=0` where nothing is applied).
    pub columns: Vec<(String, String)>,
    /// Sample rate, Hz; `None` where a column of time is named.
    pub sample_rate_hz: Option<f64>,
    /// Inertia, kg or kg·m²; `None` where it is to be identified.
    pub inertia: Option<f64>,
}

impl UserChoices {
    /// Whether the user said that the rows of a log count no time.
    pub(super) fn is_timeless(&self, survey: &Survey) -> bool {
        self.column("time") == Some("none") && survey.column("none").is_none()
    }

    /// Whether the user said that nothing is applied in a log.
    pub(super) fn is_free(&self, survey: &Survey) -> bool {
        self.column("force") == Some("0") && survey.column("0").is_none()
    }

    /// The column that the user named for a role.
    pub(super) fn column(&self, role: &str) -> Option<&str> {
        let found = self.columns.iter().find(|(r, _)| r == role);
        found.map(|(_, column)| column.as_str())
    }
}

/// A study that has not been written yet.
#[derive(Clone, Debug)]
pub struct Draft {
    /// The study's name, as study.toml states it.
    pub name: String,
    /// The time column, unless the rate is stated.
    pub time: Option<SurveyedTime>,
    /// The even rate to which the channels are brought, Hz, where the times are uneven.
    pub resample_hz: Option<f64>,
    /// Sample rate that the log has, Hz; nothing for a quasi-static log.
    pub sample_rate_hz: Option<f64>,
    /// Whether nobody stated that rate, and no column counts the time.
    pub guesses_rate: bool,
    /// One or two axes.
    pub axes: Vec<DraftAxis>,
    /// Columns that change and that nothing was found for, with their units: the joint may follow
    /// one.
    pub unused: Vec<(String, Option<String>)>,
    /// The records, in the order given.
    pub records: Vec<DraftRecord>,
    /// What was found out, for the user, one sentence each.
    pub findings: Vec<String>,
}

/// One axis of a draft.
#[derive(Clone, Debug)]
pub struct DraftAxis {
    /// The axis's name: `x` or `phi`.
    pub name: String,
    /// Whether it is a translation or a rotation.
    pub kind: AxisKind,
    /// Relative displacement, or the far side and the body, of which the second is subtracted.
    pub displacement: Vec<DraftChannel>,
    /// Where these are accelerations: above which frequency they are integrated twice, Hz.
    pub integrate_above_hz: Option<f64>,
    /// Relative velocity, where it was logged and agrees with the displacement.
    pub velocity: Option<DraftChannel>,
    /// The body's own position.
    pub body_position: Option<DraftChannel>,
    /// The acceleration of the body that carries the inertia.
    pub acceleration: Option<DraftChannel>,
    /// The force or torque that is applied; `None` where nothing is.
    pub force: Option<DraftChannel>,
    /// kg or kg·m² as the user said, or 0 where the force is the restoring force; `None` to be
    /// identified.
    pub inertia: Option<f64>,
    /// What the force looks like, kg or kg·m², for the comment.
    pub inertia_seen: Option<f64>,
    /// Which way round the equation of motion stands.
    pub restoring_force: Convention,
    /// Terms of the base, without the axis.
    pub base: Vec<&'static str>,
}

impl DraftAxis {
    /// Columns of all its channels, those of the displacement first.
    pub(super) fn columns(&self) -> impl Iterator<Item = &str> {
        let single = [&self.velocity, &self.body_position, &self.acceleration];
        let single = single.into_iter().flatten();
        let all = self.displacement.iter().chain(single).chain(&self.force);
        all.map(|c| c.column.as_str())
    }
}

/// A log with its rate.
pub(super) struct Log<'a> {
    pub(super) survey: &'a Survey,
    pub(super) rate_hz: f64,
}

impl Log<'_> {
    pub(super) fn values(&self, column: &str) -> Option<&[f64]> {
        self.survey.column(column).map(|c| c.values.as_slice())
    }

    /// The values of a column in SI, by the unit that this log states for it; as they are where it
    /// states none.
    pub(super) fn si(&self, column: &str, quantity: Quantity) -> Option<Vec<f64>> {
        let column = self.survey.column(column)?;
        let factor = factor(column, quantity);
        let mut series: Vec<f64> = column.values.iter().map(|v| v * factor).collect();
        if quantity == Quantity::Displacement(AxisKind::Rotation) {
            unwrap(&mut series);
        }
        Some(series)
    }
}

/// How many SI units one of a column's is; 1 where it states none.
pub(super) fn factor(column: &SurveyedColumn, quantity: Quantity) -> f64 {
    let unit = column.unit.as_deref();
    unit.and_then(|u| quantity.factor(u, true).ok())
        .or_else(|| at_a_lever(column, quantity))
        .unwrap_or(1.0)
}

/// How many N·m one of a column's units is at a lever of 1 m, where it is a force that stands for a
/// torque.
pub(super) fn at_a_lever(column: &SurveyedColumn, quantity: Quantity) -> Option<f64> {
    let force = Quantity::Force(AxisKind::Translation);
    let is_force = quantity == Quantity::Force(AxisKind::Rotation)
        && column.named.score(force) > column.named.score(quantity);
    let unit = column.unit.as_deref().unwrap_or("N");
    force.factor(unit, false).ok().filter(|_| is_force)
}

/// The names of all columns, for a sentence.
pub(super) fn names(survey: &Survey) -> String {
    let names: Vec<&str> = survey.columns.iter().map(|c| c.name.as_str()).collect();
    names.join(", ")
}
