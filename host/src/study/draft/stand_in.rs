//! Columns that stand for a displacement or a force which no name tells.

use super::nameless;
use super::parts::{Log, UserChoices};
use crate::study::AxisKind;
use crate::study::channels::units::{Quantity, is_of_current};
use crate::study::survey::{Survey, SurveyedColumn};

/// What is taken for what, and why.
pub(super) struct StandIn {
    /// Roles and columns, as [`UserChoices`] has them.
    pub(super) roles: Vec<(String, String)>,
    /// A sentence for the user, without its full stop.
    pub(super) why: String,
}

/// The columns that stand for what an axis lacks; `None` where nothing tells.
pub(super) fn stand_in(
    logs: &[Log<'_>],
    time: Option<&str>,
    said: &UserChoices,
) -> Option<StandIn> {
    let survey = logs[0].survey;
    let by_numbers = nameless::roles(logs, time, said).map(|roles| StandIn {
        why: by_numbers(&roles),
        roles,
    });
    by_numbers
        .or_else(|| only_angle(survey, time, said))
        .or_else(|| only_drive(survey, said))
}

/// How the numbers tell the roles of columns that no names do.
fn by_numbers(roles: &[(String, String)]) -> String {
    let of = |role: &str| {
        let own = roles.iter().find(|(own, _)| own == role);
        own.map(|(_, column)| column.as_str()).unwrap_or_default()
    };
    let [x, v, force] = ["displacement", "velocity", "force"].map(of);
    let how = match v {
        "" => {
            format!("a joint takes in work where {x:?} is the displacement and {force:?} the force")
        }
        _ => format!(
            "{v:?} follows the slope of {x:?}, as a velocity does its displacement, and {force:?} is left for the force"
        ),
    };
    format!("no names tell the columns apart: {how}, so they are taken for these")
}

/// The angle of a log with a force and no length, as that of a door with its handle.
fn only_angle(survey: &Survey, time: Option<&str>, said: &UserChoices) -> Option<StandIn> {
    let named = |quantity: Quantity| {
        let columns = survey.columns.iter();
        let others = columns.filter(|c| Some(c.name.as_str()) != time && c.rms > 0.0);
        let named = others.filter(move |c| c.named.score(quantity) > 0);
        named.map(|c| c.name.clone()).collect::<Vec<_>>()
    };
    let is_said = said.column("displacement").is_some() || said.column("force").is_some();
    let lengths = named(Quantity::Displacement(AxisKind::Translation));
    let forces = named(Quantity::Force(AxisKind::Translation));
    let [angle] = &named(Quantity::Displacement(AxisKind::Rotation))[..] else {
        return None;
    };
    let stands = !is_said && !forces.is_empty() && lengths.iter().all(|c| c == angle);
    stands.then(|| StandIn {
        roles: vec![("displacement".into(), angle.clone())],
        why: format!(
            "no column beside the force is a length, so the angle {angle:?} is taken for the displacement"
        ),
    })
}

/// What drives the joint in a log that names no force: its current, or else the force that was
/// commanded, where it has one alone.
fn only_drive(survey: &Survey, said: &UserChoices) -> Option<StandIn> {
    let of_force = |c: &SurveyedColumn| {
        let mut kinds = [AxisKind::Translation, AxisKind::Rotation].into_iter();
        kinds.any(|kind| c.named.score(Quantity::Force(kind)) > 0)
    };
    if said.column("force").is_some() || survey.columns.iter().any(of_force) {
        return None;
    }
    let lone = |is: fn(&SurveyedColumn) -> bool| {
        // An `i` may count the rows.
        let mut all = survey.columns.iter().filter(|c| is(c) && !c.rises());
        let first = all.next()?;
        let stands = all.next().is_none() && first.missing == 0 && first.rms > 0.0;
        stands.then_some(first.name.as_str())
    };
    let commanded = |c: &SurveyedColumn| c.named.commanded_force;
    let (drive, why) = match (lone(is_current), lone(commanded)) {
        (Some(current), _) => (
            current,
            format!(
                "no column is a force, so the current {current:?} stands for it, as the force of a motor follows its current"
            ),
        ),
        (None, Some(command)) => (
            command,
            format!(
                "no column is a measured force, so what was commanded, {command:?}, stands for it: what the drive makes of it counts as the joint"
            ),
        ),
        (None, None) => return None,
    };
    Some(StandIn {
        roles: vec![("force".into(), drive.to_owned())],
        why,
    })
}

/// Whether a column is a current, by its unit or else by its name.
pub(super) fn is_current(column: &SurveyedColumn) -> bool {
    let by_name = column.named.current;
    column.unit.as_deref().map_or(by_name, is_of_current)
}
