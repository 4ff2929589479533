//! Columns that the user named as the velocity or the acceleration: they stay that whatever the
//! numbers say, and how far these disagree is told.

use super::parts::{Log, UserChoices, factor};
use super::trial::{DERIVATIVE, Parts, relative};
use crate::study::AxisKind;
use crate::study::channels::units::Quantity;
use crate::study::check::kinematics::{Likeness, derivative_likeness};
use crate::study::survey::SurveyedColumn;
use crate::text::table::short;

/// A derivative of the position, as `--column` names it, and which one it is.
pub(super) const VELOCITY: (&str, usize) = ("velocity", 1);
/// The same of the second derivative.
const ACCELERATION: (&str, usize) = ("acceleration", 2);

/// How a column follows the derivative of a position in SI, by the units of both.
fn likeness(
    log: &Log<'_>,
    column: &SurveyedColumn,
    position: &[f64],
    (order, kind): (usize, AxisKind),
) -> Option<Likeness> {
    let quantity = match order {
        1 => Quantity::Velocity(kind),
        _ => Quantity::Acceleration(kind),
    };
    let found = derivative_likeness(log.values(&column.name)?, position, order, log.rate_hz);
    Some(Likeness {
        gain: found.gain * factor(column, quantity),
        ..found
    })
}

/// Whether it is that derivative, within a tenth.
fn is_derivative(found: &Likeness) -> bool {
    found.correlation > DERIVATIVE && (0.9..1.1).contains(&found.gain)
}

/// Whether a column is the derivative of a position, within a tenth.
pub(super) fn agrees(
    log: &Log<'_>,
    column: &SurveyedColumn,
    position: &[f64],
    derivative: (usize, AxisKind),
) -> bool {
    likeness(log, column, position, derivative).is_some_and(|found| is_derivative(&found))
}

/// What is told of a column that the user named as a derivative of the first of these positions, or
/// of what it is off the second, where it is another.
pub(super) fn contradiction(
    log: &Log<'_>,
    (role, order): (&str, usize),
    (first, second): (&SurveyedColumn, Option<&SurveyedColumn>),
    (kind, parts): (AxisKind, &Parts<'_>),
    said: &UserChoices,
) -> Option<String> {
    let column = log.survey.column(said.column(role)?)?;
    let position = relative(log, first, second, (kind, parts))?;
    let found = likeness(log, column, &position, (order, kind))?;
    let is_other = column.name != first.name && !is_derivative(&found);
    is_other.then(|| {
        format!(
            "column {:?} stays the {role}, as you named it, though it is no derivative of {:?}: it is {} times as large, at a correlation of \
             {:.2}; leave --column {role}= out to have it derived",
            column.name,
            first.name,
            short(found.gain.abs()),
            found.correlation
        )
    })
}

/// The same of the velocity and of the acceleration, which is that of the body alone.
pub(super) fn contradictions(
    log: &Log<'_>,
    (first, second): (&SurveyedColumn, Option<&SurveyedColumn>),
    kinds: (AxisKind, &Parts<'_>),
    said: &UserChoices,
) -> Vec<String> {
    let body = (second.unwrap_or(first), None);
    let derivatives = [(VELOCITY, (first, second)), (ACCELERATION, body)];
    let all = derivatives.into_iter();
    all.filter_map(|(role, pair)| contradiction(log, role, pair, kinds, said))
        .collect()
}

/// Leaves out positions that nobody named and of which the velocity that the user named is no
/// derivative, alone or off another one; where none is left, it is integrated.
pub(super) fn keep_integrals(
    logs: &[Log<'_>],
    parts: &mut Parts<'_>,
    kind: AxisKind,
    said: &UserChoices,
) -> Option<String> {
    let is_guessed = said.column("displacement").is_none() && !said.is_timeless(logs[0].survey);
    let velocity = logs[0].survey.column(said.column(VELOCITY.0)?)?;
    if parts.derivative > 0 || !is_guessed {
        return None;
    }
    let is_integral = |first: &SurveyedColumn, second: Option<&SurveyedColumn>| {
        let position = relative(&logs[0], first, second, (kind, parts));
        let found = position.and_then(|x| likeness(&logs[0], velocity, &x, (VELOCITY.1, kind)));
        // A wrong unit is told by the checks of the study.
        found.is_some_and(|l| l.correlation.abs() > DERIVATIVE)
    };
    let all = parts.displacement.clone();
    let belongs = |c: &&SurveyedColumn| {
        is_integral(c, None) || all.iter().any(|other| is_integral(c, Some(other)))
    };
    let kept: Vec<&SurveyedColumn> = all.iter().copied().filter(belongs).collect();
    if !kept.is_empty() {
        parts.displacement = kept;
        return None;
    }
    parts.displacement.clone_from(&parts.velocity);
    parts.derivative = VELOCITY.1;
    let others: Vec<String> = all.iter().map(|c| format!("{:?}", c.name)).collect();
    Some(format!(
        "{:?}, which you named as the velocity, is no derivative of {}, so it is integrated; name the displacement with --column displacement=COLUMN \
         if there is one",
        velocity.name,
        others.join(" or ")
    ))
}
