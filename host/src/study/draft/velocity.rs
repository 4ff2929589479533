//! A velocity that was logged beside a position: whether it is the position's, and what one count
//! of an encoder is worth by it.

use super::parts::{Log, UserChoices, factor};
use super::stated::{VELOCITY, agrees};
use super::trial::{DERIVATIVE, Parts, Trial, relative};
use crate::study::AxisKind;
use crate::study::channels::units::Quantity;
use crate::study::check::kinematics::derivative_likeness;
use crate::study::survey::SurveyedColumn;
use crate::text::table::significant;

/// Metres or radians of a count of the chosen position, and the velocity that tells; none where the
/// position has a unit with a size, or nothing follows it.
pub(super) fn size_of_a_count<'a>(
    log: &Log<'_>,
    parts: &Parts<'a>,
    chosen: &Trial<'_>,
    kind: AxisKind,
) -> Option<(f64, &'a SurveyedColumn)> {
    let velocity = *parts.velocity.first()?;
    let counts = chosen.first.unit.is_some() && chosen.first.is_sizeless();
    if parts.derivative > 0 || !counts || velocity.is_sizeless() {
        return None;
    }
    let position = relative(log, chosen.first, chosen.second, (kind, parts))?;
    let found = derivative_likeness(log.values(&velocity.name)?, &position, 1, log.rate_hz);
    let size = found.gain * factor(velocity, Quantity::Velocity(kind));
    (found.correlation > DERIVATIVE && size > 0.0).then_some((size, velocity))
}

/// What is told of that.
pub(super) fn of_a_count(
    position: &SurveyedColumn,
    size: f64,
    velocity: &SurveyedColumn,
    kind: AxisKind,
) -> String {
    format!(
        "one count of {:?} is {} {} by {:?}",
        position.name,
        significant(size),
        kind.displacement_unit(),
        velocity.name
    )
}

/// The velocity of an axis: that which is integrated, the one that the user named, or a logged one
/// that goes with the displacement, where the log counts the time.
pub(super) fn velocity_of<'a>(
    log: &Log<'_>,
    parts: &Parts<'a>,
    (first, second): (&'a SurveyedColumn, Option<&SurveyedColumn>),
    kind: AxisKind,
    said: &UserChoices,
) -> Option<&'a SurveyedColumn> {
    if parts.are_velocities() {
        return Some(first);
    }
    let mut logged = parts.velocity.iter().copied();
    if said.column(VELOCITY.0).is_some() {
        return logged.next();
    }
    let x = relative(log, first, second, (kind, parts))?;
    logged.find(|v| !said.is_timeless(log.survey) && agrees(log, v, &x, (VELOCITY.1, kind)))
}
