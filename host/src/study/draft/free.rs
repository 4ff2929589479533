//! The axis of a log in which nothing is applied, as in a free decay.

use super::axis::{agrees, channel, check_said, kinds, name_of, nothing_to_draft};
use super::parts::{DraftAxis, Log, Said, factor};
use super::trial::{DERIVATIVE, FAR, Parts, relative};
use crate::study::channels::units::Quantity;
use crate::study::check::kinematics::derivative_likeness;
use crate::study::survey::{SurveyedColumn, extent};
use crate::study::{AxisKind, Convention};
use crate::text::error::Result;

/// The axis that the first displacement makes alone.
///
/// # Errors
/// A column that the user named wrongly, or no displacement.
pub(super) fn free_axis(
    logs: &[Log<'_>],
    time: Option<&str>,
    said: &Said,
    findings: &mut Vec<String>,
) -> Result<DraftAxis> {
    check_said(logs[0].survey, said)?;
    let axis = of_displacement(logs, time, said, findings);
    axis.ok_or_else(|| nothing_to_draft(logs[0].survey, time, said))
}

fn of_displacement(
    logs: &[Log<'_>],
    time: Option<&str>,
    said: &Said,
    findings: &mut Vec<String>,
) -> Option<DraftAxis> {
    let of_kind = |kind| (kind, Parts::of(logs[0].survey, time, kind, said, &[]));
    let all = kinds(logs[0].survey, time, said).map(of_kind);
    let (kind, mut parts) = all.into_iter().find(|(_, p)| !p.displacement.is_empty())?;
    let everywhere = |c: &&SurveyedColumn| logs.iter().all(|log| log.values(&c.name).is_some());
    for list in [
        &mut parts.displacement,
        &mut parts.velocity,
        &mut parts.acceleration,
    ] {
        list.retain(everywhere);
    }
    let first = *parts.displacement.first()?;
    let log = &logs[0];
    let x = relative(log, first, None, (kind, parts.integrated))?;
    let follows = |a: &&SurveyedColumn| {
        let values = log.values(&a.name)?;
        let found = derivative_likeness(values, &x, 2, log.rate_hz);
        let gain = found.gain * factor(a, Quantity::Acceleration(kind));
        (found.correlation.abs() > DERIVATIVE).then_some(gain)
    };
    let mut accelerations = parts.acceleration.iter();
    let acceleration = accelerations.find_map(|a| Some((*a, follows(a)?)));
    let mut channel = |column, quantity| channel(logs, column, quantity, said, findings);
    let acceleration = acceleration.map(|(a, gain)| {
        let mut found = channel(a, Quantity::Acceleration(kind));
        found.scale = gain.signum();
        found.guessed |= gain < 0.0;
        found
    });
    let velocity = match parts.integrated {
        true => Some(first),
        false => parts
            .velocity
            .first()
            .copied()
            .filter(|v| agrees(log, v, (first, None), kind)),
    };
    let velocity = velocity.map(|v| channel(v, Quantity::Velocity(kind)));
    let position = Quantity::Displacement(kind);
    let displacement = (!parts.integrated).then(|| channel(first, position));
    let [low, high] = extent(x.iter().copied());
    let weighs = kind == AxisKind::Rotation && high - low > FAR;
    if said.inertia.is_none() {
        findings.push(
            "nothing is applied, so every force is one per unit of inertia until you write the inertia in the place of 1".into(),
        );
    }
    Some(DraftAxis {
        name: name_of(kind).into(),
        kind,
        displacement: displacement.into_iter().collect(),
        velocity,
        body_position: None,
        acceleration,
        force: None,
        inertia: Some(said.inertia.unwrap_or(1.0)),
        inertia_seen: None,
        restoring_force: Convention::ForceMinusInertia,
        base: vec![if weighs { "gravity" } else { "stiffness" }, "viscous"],
    })
}
