//! The axes of a study, checked before any log is opened.

use crate::study::channels::calibrated::{Calibrated, Columns, calibrate};
use crate::study::channels::units::Quantity;
use crate::study::description::{AxisEntry, Channel, ChannelTable, Force, Source};
use crate::study::{Axis, Controller};
use crate::text::error::{Error, Result};
use toml::Spanned;

/// The channels of one axis.
pub(crate) struct AxisPlan {
    /// None where the displacement is the integral of the velocity.
    pub(crate) displacement: Vec<Calibrated>,
    /// Where the columns of the displacement are accelerations, integrated twice: Hz.
    pub(crate) integrate_above_hz: Option<f64>,
    pub(crate) velocity: Vec<Calibrated>,
    pub(crate) body_position: Option<Calibrated>,
    pub(crate) acceleration: Option<Calibrated>,
    pub(crate) force: Vec<Calibrated>,
}

/// What the description says of an axis; without time nothing accelerates.
pub(super) fn axis(entry: &AxisEntry, quasi_static: bool) -> Axis {
    let stated = entry.inertia.as_ref().map(|v| *v.get_ref());
    Axis {
        name: entry.name.get_ref().clone(),
        kind: entry.kind,
        inertia: stated.or(quasi_static.then_some(0.0)),
        restoring_force: entry.restoring_force,
        ground_stiffness: entry
            .ground_stiffness
            .as_ref()
            .map_or(0.0, |v| *v.get_ref()),
        ground_damping: entry.ground_damping.as_ref().map_or(0.0, |v| *v.get_ref()),
        controller: entry
            .controller
            .as_ref()
            .map_or(Controller::default(), |v| *v.get_ref()),
        encoder_step: entry.encoder_step.as_ref().map(|v| *v.get_ref()),
        velocity_alone: entry.displacement.is_none(),
        integrated_above_hz: entry.integrate_above_hz.as_ref().map(|hz| *hz.get_ref()),
    }
}

/// Refuses what an axis says of velocity or acceleration where the logs have no time.
pub(super) fn check_without_time(source: &Source<'_>, entry: &AxisEntry) -> Result<()> {
    let number = |value: &Option<Spanned<f64>>| {
        let value = value.as_ref().filter(|v| *v.get_ref() != 0.0);
        value.map(|v| v.span().start)
    };
    let said = [
        ("velocity", entry.velocity.as_ref().map(|v| v.span().start)),
        ("integrate_above_hz", number(&entry.integrate_above_hz)),
        (
            "acceleration",
            entry.acceleration.as_ref().map(|v| v.span().start),
        ),
        ("inertia", number(&entry.inertia)),
        ("ground_damping", number(&entry.ground_damping)),
    ];
    match said.into_iter().find_map(|(key, at)| Some((key, at?))) {
        None => Ok(()),
        Some((key, at)) => Err(Error::data(format!(
            "{}: {key} says nothing where time = \"none\", because only the path counts then; leave it out, or name the column of \
             time",
            source.at(at)
        ))),
    }
}

pub(super) fn positive(source: &Source<'_>, key: &str, value: Option<&Spanned<f64>>) -> Result<()> {
    match value {
        Some(v) if !(v.get_ref().is_finite() && *v.get_ref() > 0.0) => Err(source.wrong(
            v,
            format!(
                "{key} = {} must be a number above 0; correct it or leave it out",
                v.get_ref()
            ),
        )),
        _ => Ok(()),
    }
}

pub(super) fn check_axis(source: &Source<'_>, entry: &AxisEntry) -> Result<()> {
    let name = entry.name.get_ref();
    let odd = |c: char| c.is_whitespace() || ['@', '*', ','].contains(&c);
    if name.is_empty() || name == "both" || name.contains(odd) {
        return Err(source.wrong(
            &entry.name,
            format!(
                "an axis cannot be called {name:?}, because effects are written effect@axis and \"both\" means every axis; \
                 use a short word such as \"x\""
            ),
        ));
    }
    positive(source, "encoder_step", entry.encoder_step.as_ref())?;
    let above = entry.integrate_above_hz.as_ref();
    positive(source, "integrate_above_hz", above)?;
    if let Some(inertia) = &entry.inertia
        && !(inertia.get_ref().is_finite() && *inertia.get_ref() >= 0.0)
    {
        return Err(source.wrong(
            inertia,
            format!(
                "inertia = {} of axis {name:?} must not be negative; leave it out to have it identified",
                inertia.get_ref()
            ),
        ));
    }
    if let Some(controller) = &entry.controller {
        let Controller { kp, kd } = *controller.get_ref();
        if !(kp.is_finite() && kd.is_finite() && kp >= 0.0 && kd >= 0.0) {
            return Err(source.wrong(
                controller,
                "kp and kd of a controller must not be negative; a loop that holds its position has gains above 0",
            ));
        }
    }
    for (key, value) in [
        ("ground_stiffness", &entry.ground_stiffness),
        ("ground_damping", &entry.ground_damping),
    ] {
        let Some(value) = value else { continue };
        if !value.get_ref().is_finite() {
            return Err(source.wrong(
                value,
                format!("{key} must be a number; correct it or leave it out"),
            ));
        }
        let displacement = entry.displacement.as_ref();
        let pair = displacement.is_some_and(|d| d.get_ref().0.len() == 2);
        if *value.get_ref() != 0.0 && pair && entry.body_position.is_none() {
            return Err(source.wrong(
                value,
                format!(
                    "{key} acts on the body's absolute position, which axis {name:?} does not give; add body_position = …"
                ),
            ));
        }
    }
    Ok(())
}

/// Checks how many columns the displacement has.
fn check_displacement(source: &Source<'_>, entry: &AxisEntry) -> Result<()> {
    let Some(displacement) = &entry.displacement else {
        if let Some(above) = &entry.integrate_above_hz {
            return Err(source.wrong(
                above,
                "integrate_above_hz says that the columns of displacement are accelerations, and there is no displacement; name the \
                 column of the accelerometer as displacement",
            ));
        }
        return match &entry.velocity {
            Some(velocity) if !velocity.get_ref().0.is_empty() => Ok(()),
            _ => Err(source.wrong(
                &entry.name,
                "an axis needs its displacement, or its velocity, of which the displacement is then the integral; name a column of either, or \
                 an accelerometer as displacement with integrate_above_hz",
            )),
        };
    };
    let columns = &displacement.get_ref().0;
    if columns.is_empty() || columns.len() > 2 {
        return Err(source.wrong(
            displacement,
            "displacement takes one column, or two of which the second is subtracted from the first; list one or two",
        ));
    }
    if columns.len() == 2 && columns[0].column == columns[1].column {
        return Err(source.wrong(
            displacement,
            format!(
                "displacement is the difference of column {:?} and itself; name the columns of both sides of the joint",
                columns[0].column
            ),
        ));
    }
    Ok(())
}

/// Checks how many columns force and velocity have.
fn check_force(source: &Source<'_>, entry: &AxisEntry) -> Result<()> {
    match entry.force.get_ref() {
        Force::Columns(columns) if columns.is_empty() => {
            return Err(source.wrong(&entry.force, "force needs a column; name at least one"));
        }
        Force::Nothing if entry.inertia.as_ref().is_none_or(|i| *i.get_ref() == 0.0) => {
            return Err(source.wrong(
                &entry.force,
                "with force = 0 the inertia force is all there is; add the inertia, or inertia = 1 to have every force per unit of it",
            ));
        }
        _ => {}
    }
    match &entry.velocity {
        Some(v) if v.get_ref().0.len() > 2 => Err(source.wrong(
            v,
            "velocity takes one column, or two of which the second is subtracted from the first; list one or two",
        )),
        _ => Ok(()),
    }
}

pub(super) fn axis_plan(
    source: &Source<'_>,
    entry: &AxisEntry,
    columns: &mut Columns,
) -> Result<AxisPlan> {
    check_displacement(source, entry)?;
    check_force(source, entry)?;
    let kind = entry.kind;
    let mut list = |key: &str, start: usize, tables: &[ChannelTable], quantity: Quantity| {
        if let Some(table) = tables.iter().find(|t| t.optional && key != "force") {
            return Err(Error::data(format!(
                "{}: column {:?} of {key} cannot be optional; only the entries of force can",
                source.at(start),
                table.column
            )));
        }
        calibrate(source, start, key, tables, quantity, columns)
    };
    let velocity = match &entry.velocity {
        Some(v) => list(
            "velocity",
            v.span().start,
            &v.get_ref().0,
            Quantity::Velocity(kind),
        )?,
        None => Vec::new(),
    };
    let mut single = |key: &str, value: &Option<Spanned<Channel>>, quantity| {
        Ok::<_, Error>(match value {
            Some(v) => {
                let tables = std::slice::from_ref(&v.get_ref().0);
                list(key, v.span().start, tables, quantity)?.pop()
            }
            None => None,
        })
    };
    let body_position = single(
        "body_position",
        &entry.body_position,
        Quantity::Displacement(kind),
    )?;
    let acceleration = single(
        "acceleration",
        &entry.acceleration,
        Quantity::Acceleration(kind),
    )?;
    let displacement = match &entry.displacement {
        Some(d) => {
            let quantity = match &entry.integrate_above_hz {
                None => Quantity::Displacement(kind),
                Some(_) => Quantity::Acceleration(kind),
            };
            list("displacement", d.span().start, &d.get_ref().0, quantity)?
        }
        None => Vec::new(),
    };
    Ok(AxisPlan {
        displacement,
        integrate_above_hz: entry.integrate_above_hz.as_ref().map(|hz| *hz.get_ref()),
        velocity,
        body_position,
        acceleration,
        force: list(
            "force",
            entry.force.span().start,
            entry.force.get_ref().columns(),
            Quantity::Force(kind),
        )?,
    })
}
