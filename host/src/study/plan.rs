//! What to read from every log and what it means, checked before any log is opened.

use super::description::{AxisEntry, ChannelTable, Description, Source};
use super::log::{Log, Request, Wanted};
use super::units::Quantity;
use super::{Axis, Channels};
use crate::text::error::{Error, Result};
use crate::text::nearest::suggestion;
use std::collections::HashSet;
use toml::Spanned;

/// One column turned into SI: (number · scale + offset) · factor.
pub(crate) struct Calibrated {
    /// Its place among [`Plan::wanted`].
    place: usize,
    pub(crate) column: String,
    scale: f64,
    offset: f64,
    quantity: Quantity,
    /// The unit that study.toml states, and how many SI units one of it is.
    stated: Option<(String, f64)>,
}

impl Calibrated {
    /// The column in SI; `None` where an optional column is absent.
    pub(crate) fn series(&self, log: &Log) -> Option<Vec<f64>> {
        let logged = log.values[self.place].as_ref()?;
        let factor = match (&self.stated, &log.units[self.place]) {
            (Some((_, factor)), _) => *factor,
            (None, Some(unit)) => self.quantity.factor(unit, true).unwrap_or(1.0),
            (None, None) => 1.0,
        };
        Some(
            logged
                .iter()
                .map(|value| (value * self.scale + self.offset) * factor)
                .collect(),
        )
    }

    /// Holds the unit that the file states against the study's: a note where they differ, an error where the study states none
    /// and the file's cannot be used.
    fn check_unit(&self, request: &Request<'_>, log: &Log) -> Result<Option<String>> {
        let Some(unit) = &log.units[self.place] else {
            return Ok(None);
        };
        let found = self.quantity.factor(unit, true);
        match (&self.stated, found) {
            (None, Ok(_)) => Ok(None),
            (None, Err(what)) => Err(request.error(format!(
                "states for column {:?}: {what}; or write the right unit into study.toml, {{ column = {:?}, unit = … }}",
                self.column, self.column
            ))),
            (Some((_, stated)), Ok(found)) if (found / stated - 1.0).abs() < 1e-9 => Ok(None),
            (Some((stated, _)), _) => Ok(Some(format!(
                "{}: column {:?} is in {unit} as the file says and in {stated} as study.toml says; the latter was used",
                request.file, self.column
            ))),
        }
    }
}

/// The channels of one axis.
pub(crate) struct AxisPlan {
    pub(crate) displacement: Vec<Calibrated>,
    pub(crate) velocity: Vec<Calibrated>,
    pub(crate) body_position: Option<Calibrated>,
    pub(crate) acceleration: Option<Calibrated>,
    pub(crate) force: Vec<Calibrated>,
}

/// The channels of the study.
pub(crate) struct Plan {
    pub(crate) wanted: Vec<Wanted>,
    pub(crate) time: Option<Calibrated>,
    pub(crate) axes: Vec<AxisPlan>,
}

impl Plan {
    /// Holds the units that a file states against those of the study; one note for each that differs.
    pub(crate) fn check_units(&self, request: &Request<'_>, log: &Log) -> Result<Vec<String>> {
        let axes = self.axes.iter().flat_map(|axis| {
            let lists = [&axis.displacement, &axis.velocity, &axis.force];
            let single = [&axis.body_position, &axis.acceleration];
            let single = single.into_iter().flatten();
            lists.into_iter().flatten().chain(single)
        });
        let mut notes = Vec::new();
        for channel in self.time.iter().chain(axes) {
            let note = channel.check_unit(request, log)?;
            notes.extend(note.filter(|note| !notes.contains(note)));
        }
        Ok(notes)
    }
}

/// Checks the description's numbers and names, and makes the plan and the axes of it.
pub(crate) fn plan(source: &Source<'_>, said: &Description) -> Result<(Plan, Vec<Axis>)> {
    check_rate(source, said)?;
    if said.axis.is_empty() || said.axis.len() > 2 {
        return Err(Error::data(format!(
            "{}: {} [[axis]] tables, but a joint here has one or two axes; write one [[axis]] for each",
            source.path.display(),
            said.axis.len()
        )));
    }
    let mut wanted = Vec::new();
    let time = match &said.time {
        Some(time) => {
            let tables = std::slice::from_ref(&time.get_ref().0);
            calibrate(
                source,
                time.span().start,
                "time",
                tables,
                Quantity::Time,
                &mut wanted,
            )?
            .pop()
        }
        None => None,
    };
    let mut axes = Vec::new();
    let mut plans = Vec::new();
    let mut names = HashSet::new();
    for entry in &said.axis {
        check_axis(source, entry)?;
        if !names.insert(entry.name.get_ref().as_str()) {
            return Err(source.wrong(
                &entry.name,
                format!(
                    "the axis {:?} is there twice; give each its own name",
                    entry.name.get_ref()
                ),
            ));
        }
        plans.push(axis_plan(source, entry, &mut wanted)?);
        axes.push(axis(entry));
    }
    check_terms(source, said, &axes)?;
    Ok((
        Plan {
            wanted,
            time,
            axes: plans,
        },
        axes,
    ))
}

/// Checks the sample rate, the band, and that one of rate and time is there.
fn check_rate(source: &Source<'_>, said: &Description) -> Result<()> {
    positive(source, "sample_rate_hz", said.sample_rate_hz.as_ref())?;
    positive(source, "band_hz", said.band_hz.as_ref())?;
    if let (Some(rate), Some(band)) = (&said.sample_rate_hz, &said.band_hz)
        && *band.get_ref() >= 0.5 * rate.get_ref()
    {
        return Err(source.wrong(
            band,
            format!(
                "band_hz = {} is not below half the sample rate of {} Hz; lower it or leave it out",
                band.get_ref(),
                rate.get_ref()
            ),
        ));
    }
    if said.time.is_none() && said.sample_rate_hz.is_none() {
        return Err(Error::data(format!(
            "{}: neither time nor sample_rate_hz is given; name the column of time or state the rate",
            source.path.display()
        )));
    }
    Ok(())
}

/// What the description says of an axis.
fn axis(entry: &AxisEntry) -> Axis {
    Axis {
        name: entry.name.get_ref().clone(),
        kind: entry.kind,
        inertia: entry.inertia.as_ref().map(|v| *v.get_ref()),
        restoring_force: entry.restoring_force,
        ground_stiffness: entry
            .ground_stiffness
            .as_ref()
            .map_or(0.0, |v| *v.get_ref()),
        ground_damping: entry.ground_damping.as_ref().map_or(0.0, |v| *v.get_ref()),
        encoder_step: entry.encoder_step.as_ref().map(|v| *v.get_ref()),
    }
}

/// Checks that the terms of the base are on axes of the study.
fn check_terms(source: &Source<'_>, said: &Description, axes: &[Axis]) -> Result<()> {
    for term in &said.base.terms {
        if let Some((_, axis)) = term.get_ref().split_once('@')
            && axis != "both"
            && axes.iter().all(|a| a.name != axis)
        {
            let known: Vec<&str> = axes.iter().map(|a| a.name.as_str()).collect();
            return Err(source.wrong(
                term,
                format!(
                    "the term {:?} is on an axis {axis:?} that the study does not have; {}",
                    term.get_ref(),
                    suggestion(axis, &known)
                ),
            ));
        }
    }
    Ok(())
}

fn positive(source: &Source<'_>, key: &str, value: Option<&Spanned<f64>>) -> Result<()> {
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

fn check_axis(source: &Source<'_>, entry: &AxisEntry) -> Result<()> {
    let name = entry.name.get_ref();
    let odd = |c: char| c.is_whitespace() || c == '@' || c == ',';
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
        let pair = entry.displacement.get_ref().0.len() == 2;
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

/// Checks how many columns displacement, velocity and force have.
fn check_columns(source: &Source<'_>, entry: &AxisEntry) -> Result<()> {
    let displacement = entry.displacement.get_ref();
    if displacement.0.is_empty() || displacement.0.len() > 2 {
        return Err(source.wrong(
            &entry.displacement,
            "displacement takes one column, or two of which the second is subtracted from the first; list one or two",
        ));
    }
    if displacement.0.len() == 2 && displacement.0[0].column == displacement.0[1].column {
        return Err(source.wrong(
            &entry.displacement,
            format!(
                "displacement is the difference of column {:?} and itself; name the columns of both sides of the joint",
                displacement.0[0].column
            ),
        ));
    }
    if entry.force.get_ref().0.is_empty() {
        return Err(source.wrong(&entry.force, "force needs a column; name at least one"));
    }
    match &entry.velocity {
        Some(v) if v.get_ref().0.len() > 2 => Err(source.wrong(
            v,
            "velocity takes one column, or two of which the second is subtracted from the first; list one or two",
        )),
        _ => Ok(()),
    }
}

fn axis_plan(source: &Source<'_>, entry: &AxisEntry, wanted: &mut Vec<Wanted>) -> Result<AxisPlan> {
    check_columns(source, entry)?;
    let kind = entry.kind;
    let mut list = |key: &str, start: usize, tables: &[ChannelTable], quantity: Quantity| {
        if let Some(table) = tables.iter().find(|t| t.optional && key != "force") {
            return Err(Error::data(format!(
                "{}: column {:?} of {key} cannot be optional; only the entries of force can",
                source.at(start),
                table.column
            )));
        }
        calibrate(source, start, key, tables, quantity, wanted)
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
    let mut single = |key: &str, value: &Option<Spanned<super::description::Channel>>, quantity| {
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
    Ok(AxisPlan {
        displacement: list(
            "displacement",
            entry.displacement.span().start,
            &entry.displacement.get_ref().0,
            Quantity::Displacement(kind),
        )?,
        velocity,
        body_position,
        acceleration,
        force: list(
            "force",
            entry.force.span().start,
            &entry.force.get_ref().0,
            Quantity::Force(kind),
        )?,
    })
}

/// Converts the channels of one key, and notes their columns among the wanted.
fn calibrate(
    source: &Source<'_>,
    start: usize,
    key: &str,
    tables: &[ChannelTable],
    quantity: Quantity,
    wanted: &mut Vec<Wanted>,
) -> Result<Vec<Calibrated>> {
    let mut list = Vec::new();
    for table in tables {
        let column = &table.column;
        let wrong = |what: String| {
            Error::data(format!(
                "{}: {key}, column {column:?}: {what}",
                source.at(start)
            ))
        };
        let stated = match &table.unit {
            Some(unit) => {
                let factor = quantity.factor(unit, table.scale.is_some());
                Some((unit.clone(), factor.map_err(&wrong)?))
            }
            None => None,
        };
        let scale = table.scale.unwrap_or(1.0);
        let offset = table.offset.unwrap_or(0.0);
        if !(scale.is_finite() && scale != 0.0 && offset.is_finite()) {
            return Err(wrong(format!(
                "scale = {scale} and offset = {offset} must be numbers, and the scale not 0; correct them or leave them out"
            )));
        }
        let place = match wanted.iter().position(|w| w.column == *column) {
            Some(place) => {
                wanted[place].optional &= table.optional;
                place
            }
            None => {
                wanted.push(Wanted {
                    column: column.clone(),
                    optional: table.optional,
                });
                wanted.len() - 1
            }
        };
        list.push(Calibrated {
            place,
            column: column.clone(),
            scale,
            offset,
            quantity,
            stated,
        });
    }
    Ok(list)
}

impl AxisPlan {
    /// The axis's channels of one log in SI, and the optional columns that the log lacks.
    pub(crate) fn channels(&self, log: &Log, rows: usize) -> (Channels, Vec<String>) {
        let required = |c: &Calibrated| {
            c.series(log)
                .expect("a column that is not optional was located before the log was read")
        };
        let mut absent = Vec::new();
        let mut force = vec![0.0; rows];
        for part in &self.force {
            match part.series(log) {
                Some(series) => force.iter_mut().zip(series).for_each(|(f, s)| *f += s),
                None => absent.push(part.column.clone()),
            }
        }
        let velocity = match self.velocity.as_slice() {
            [] => None,
            [one] => Some(required(one)),
            [first, second, ..] => {
                let mut difference = required(first);
                for (a, b) in difference.iter_mut().zip(required(second)) {
                    *a -= b;
                }
                Some(difference)
            }
        };
        let channels = Channels {
            displacement_first: required(&self.displacement[0]),
            displacement_second: self.displacement.get(1).map(required),
            velocity,
            body_position: self.body_position.as_ref().map(required),
            acceleration: self.acceleration.as_ref().map(required),
            force,
        };
        (channels, absent)
    }
}
