//! What to read from every log and what it means, checked before any log is opened.

mod axis;

use super::Axis;
use super::channels::calibrated::{Calibrated, Columns, calibrate};
use super::channels::units::Quantity;
use super::description::{ChannelTable, Description, Source};
use super::log::{Log, Request, Wanted};
use super::time::second_logger::{SecondLogger, second_loggers};
use crate::text::error::{Error, Result};
use crate::text::nearest::suggestion;
use axis::{axis, axis_plan, check_axis, check_without_time, positive};
use std::collections::HashSet;

pub(crate) use axis::AxisPlan;

/// The channels of the study.
pub(crate) struct Plan {
    pub(crate) wanted: Vec<Wanted>,
    pub(crate) time: Option<Calibrated>,
    /// Whether the logs have no time.
    pub(crate) quasi_static: bool,
    /// The even rate to which all channels are brought, Hz.
    pub(crate) resample_hz: Option<f64>,
    /// Columns of time of channels that have their own.
    pub(crate) clocks: Vec<Calibrated>,
    pub(crate) axes: Vec<AxisPlan>,
    /// Second loggers of single records.
    pub(crate) loggers: Vec<SecondLogger>,
    /// Columns of the inputs, with the inputs' names.
    pub(crate) inputs: Vec<(String, Calibrated)>,
}

impl Plan {
    /// Every channel of every axis, and the inputs.
    pub(crate) fn channels(&self) -> impl Iterator<Item = &Calibrated> {
        let axes = self.axes.iter().flat_map(|axis| {
            let lists = [&axis.displacement, &axis.velocity, &axis.force];
            let single = [&axis.body_position, &axis.acceleration];
            let single = single.into_iter().flatten();
            lists.into_iter().flatten().chain(single)
        });
        axes.chain(self.inputs.iter().map(|(_, channel)| channel))
    }

    /// Holds the units that a file states against those of the study; one note for each that
    /// differs.
    pub(crate) fn check_units(&self, request: &Request<'_>, log: &Log) -> Result<Vec<String>> {
        let clocks = self.time.iter().chain(&self.clocks);
        let mut notes = Vec::new();
        for channel in clocks.chain(self.channels()) {
            let note = channel.check_unit(request, log)?;
            let notes_of_it = [note, channel.check_turns(request, log)];
            for note in notes_of_it.into_iter().flatten() {
                if !notes.contains(&note) {
                    notes.push(note);
                }
            }
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
    let mut columns = Columns::default();
    let time = match &said.time {
        Some(time) if !time.get_ref().none => {
            let tables = std::slice::from_ref(&time.get_ref().channel);
            let start = time.span().start;
            calibrate(source, start, "time", tables, Quantity::Time, &mut columns)?.pop()
        }
        _ => None,
    };
    let resample_hz = said.time.as_ref().and_then(|t| t.get_ref().resample_hz);
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
        if said.is_quasi_static() {
            check_without_time(source, entry)?;
        }
        plans.push(axis_plan(source, entry, &mut columns)?);
        axes.push(axis(entry, said.is_quasi_static()));
    }
    check_terms(source, said, &axes)?;
    check_clocks(source, said, &columns.clocks)?;
    let inputs = inputs(source, said, &mut columns)?;
    Ok((
        Plan {
            wanted: columns.wanted,
            time,
            quasi_static: said.is_quasi_static(),
            resample_hz,
            clocks: columns.clocks,
            loggers: second_loggers(source, said)?,
            axes: plans,
            inputs,
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
    let per_second = [
        ("sample_rate_hz", &said.sample_rate_hz),
        ("band_hz", &said.band_hz),
    ];
    for (key, value) in per_second {
        if let Some(value) = value.as_ref().filter(|_| said.is_quasi_static()) {
            return Err(source.wrong(
                value,
                format!("{key} says nothing where time = \"none\"; leave one of them out"),
            ));
        }
    }
    if said.time.is_none() && said.sample_rate_hz.is_none() {
        return Err(Error::data(format!(
            "{}: neither time nor sample_rate_hz is given; name the column of time, state the rate, or write time = \"none\" where \
             only the path counts",
            source.path.display()
        )));
    }
    Ok(())
}

/// Checks that channels with a time of their own can be put together.
fn check_clocks(source: &Source<'_>, said: &Description, clocks: &[Calibrated]) -> Result<()> {
    if let Some(time) = &said.time
        && let Some(rate) = time.get_ref().resample_hz
    {
        if !(rate.is_finite() && rate > 0.0) {
            return Err(source.wrong(
                time,
                format!(
                    "resample_hz = {rate} must be a number above 0; correct it or leave it out"
                ),
            ));
        }
        if let Some(stated) = &said.sample_rate_hz {
            return Err(source.wrong(
                stated,
                "sample_rate_hz says nothing where resample_hz sets the rate; leave one of them out",
            ));
        }
        if let Some(rows) = said.record.iter().find_map(|r| r.rows.as_ref())
            && !clocks.is_empty()
        {
            return Err(source.wrong(
                rows,
                "rows counts the rows of one clock, and these channels have several; leave rows out, or cut the log",
            ));
        }
        return Ok(());
    }
    match clocks.first() {
        None => Ok(()),
        Some(clock) => Err(Error::data(format!(
            "{}: a channel has its own time {:?}, so that all must be brought to one rate; write time = {{ column = …, \
             resample_hz = … }}",
            source.path.display(),
            clock.column
        ))),
    }
}

/// Checks that the terms of the base are on axes of the study.
fn check_terms(source: &Source<'_>, said: &Description, axes: &[Axis]) -> Result<()> {
    for term in &said.base.terms {
        if let Some((_, axis)) = term.get_ref().split_once('@')
            && let axis = axis.split('*').next().unwrap_or(axis).trim()
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

/// The columns of the inputs, their names checked.
fn inputs(
    source: &Source<'_>,
    said: &Description,
    columns: &mut Columns,
) -> Result<Vec<(String, Calibrated)>> {
    let mut all = Vec::new();
    for (index, entry) in said.input.iter().enumerate() {
        let name = entry.name.get_ref();
        let odd = |c: char| !(c.is_alphanumeric() || c == '_');
        if name.is_empty() || name.contains(odd) {
            return Err(source.wrong(
                &entry.name,
                format!(
                    "an input cannot be called {name:?}, because effects that follow it are written effect*input@axis; use one word of \
                     letters, digits and _"
                ),
            ));
        }
        if said.input[..index].iter().any(|e| e.name.get_ref() == name) {
            return Err(source.wrong(
                &entry.name,
                format!("the input {name:?} is there twice; give each its own name"),
            ));
        }
        let table = ChannelTable {
            column: entry.column.clone(),
            unit: None,
            scale: entry.scale,
            offset: entry.offset,
            sign_bit: None,
            optional: false,
            time: entry.time.clone(),
        };
        let start = entry.name.span().start;
        let channels = calibrate(source, start, "input", &[table], Quantity::Input, columns)?;
        all.extend(channels.into_iter().map(|channel| (name.clone(), channel)));
    }
    Ok(all)
}
