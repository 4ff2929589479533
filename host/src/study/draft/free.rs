//! The axis of a log in which nothing is applied, as in a free decay.

use super::axis::{channel, check_said, kinds, name_of, nothing_to_draft, velocity_of};
use super::parts::{DraftAxis, Log, Said};
use super::trial::{DERIVATIVE, FAR, Parts, accelerometer, relative};
use crate::study::channels::units::Quantity;
use crate::study::survey::extent;
use crate::study::{AxisKind, Convention};
use crate::text::error::Result;

/// The axis that the first displacement makes alone.
///
/// # Errors
/// A column that the user named wrongly, or no displacement that all logs have.
pub(super) fn free_axis(
    logs: &[Log<'_>],
    time: Option<&str>,
    said: &Said,
    findings: &mut Vec<String>,
) -> Result<DraftAxis> {
    check_said(logs[0].survey, said)?;
    let of_kind = |kind| (kind, Parts::of(logs[0].survey, time, kind, said, &[]));
    let mut all = kinds(logs[0].survey, time, said).map(of_kind).into_iter();
    let Some((kind, mut parts)) = all.find(|(_, p)| !p.displacement.is_empty()) else {
        return Err(nothing_to_draft(logs[0].survey, time, said));
    };
    parts.keep_common(logs, said)?;
    let axis = of_displacement(logs, &parts, kind, said, findings);
    axis.ok_or_else(|| nothing_to_draft(logs[0].survey, time, said))
}

fn of_displacement(
    logs: &[Log<'_>],
    parts: &Parts<'_>,
    kind: AxisKind,
    said: &Said,
    findings: &mut Vec<String>,
) -> Option<DraftAxis> {
    let first = *parts.displacement.first()?;
    let log = &logs[0];
    let x = relative(log, first, None, (kind, parts))?;
    let acceleration = accelerometer(log, &x, parts);
    let acceleration = acceleration.filter(|(_, l)| l.correlation.abs() > DERIVATIVE);
    let mut channel = |column, quantity| channel(logs, column, quantity, said, findings);
    let acceleration = acceleration.map(|(a, likeness)| {
        let mut found = channel(a, Quantity::Acceleration(kind));
        found.scale = likeness.gain.signum();
        found.guessed |= likeness.gain < 0.0;
        found
    });
    let velocity = velocity_of(log, parts, (first, None), kind, said);
    let velocity = velocity.map(|v| channel(v, Quantity::Velocity(kind)));
    let position = parts.logged(kind);
    let displacement = (!parts.are_velocities()).then(|| channel(first, position));
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
        integrate_above_hz: parts.above_hz(),
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
