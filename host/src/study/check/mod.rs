//! Channels that say nothing: a sensor that stood still while its axis moved.
//!
//! An axis may rest in a record: the best way to learn `x` alone is to leave `phi` alone. Its
//! encoders then show one count throughout, and that is right. So a constant channel is refused
//! when
//! - the study has one axis (a record in which it rests teaches nothing), or both axes rest;
//! - another encoder of its axis moves in the same record, or it is a force, an acceleration or a
//!   velocity and an encoder of its axis moves;
//! - it is constant in every record.

mod copies;
mod inputs;
pub(super) mod kinematics;
pub(super) mod linear;
pub(crate) mod lone;
pub(super) mod roles;

pub(super) use copies::copies;
pub(super) use inputs::inputs;

use super::plan::{AxisPlan, Plan};
use super::{Channels, Record, Study};
use crate::study::series::extent;
use crate::text::error::{Error, Result};

/// An axis moves in a record when an encoder spans at least this share of what it spans in its
/// liveliest record; less is what the other axis shakes into it.
const MOVES: f64 = 0.01;

struct Trace {
    column: String,
    encoder: bool,
    /// Largest less smallest value per record, in SI.
    spans: Vec<f64>,
}

impl Trace {
    fn moves(&self, record: usize) -> bool {
        let most = self.spans.iter().copied().fold(0.0, f64::max);
        self.spans[record] > 0.0 && self.spans[record] >= MOVES * most
    }
}

/// Of what a study's records are.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Extent {
    /// All there are: what stands still in every one of them never moves.
    Whole,
    /// One of more: what stands still in it may move in others.
    Part,
}

/// Refuses constant channels as the head of this file says.
pub(crate) fn constant_channels(study: &Study, plan: &Plan, extent: Extent) -> Result<()> {
    let axes: Vec<Vec<Trace>> = (0..study.axes.len())
        .map(|axis| traces(&plan.axes[axis], &study.records, axis))
        .collect();
    let moves = |axis: &[Trace], record: usize| axis.iter().any(|t| t.encoder && t.moves(record));
    for (record, log) in study.records.iter().enumerate() {
        let all_rest = !axes.iter().any(|axis| moves(axis, record));
        for axis in &axes {
            let axis_moves = moves(axis, record);
            for trace in axis.iter().filter(|t| t.spans[record] == 0.0) {
                let never = extent == Extent::Whole && trace.spans.iter().all(|s| *s == 0.0);
                let reason = if never {
                    "in every record"
                } else if axis_moves {
                    "while its axis moves"
                } else if axes.len() == 1 || all_rest {
                    "and nothing else moves in this record"
                } else {
                    continue;
                };
                let parts = study.records.iter().filter(|other| other.file == log.file);
                let rows = match parts.count() {
                    1 => String::new(),
                    _ => format!(", rows {} to {}", log.first_row, log.first_row + log.rows),
                };
                return Err(Error::data(format!(
                    "{}{rows}, column {:?}: the value is the same in all rows {reason}; check the sensor and its cable, name \
                     another column, or leave the channel or the record out",
                    log.file, trace.column
                )));
            }
        }
    }
    Ok(())
}

fn traces(plan: &AxisPlan, records: &[Record], axis: usize) -> Vec<Trace> {
    let trace = |column: String, encoder: bool, series: &dyn Fn(&Channels) -> Vec<f64>| Trace {
        column,
        encoder,
        spans: records
            .iter()
            .map(|r| span(&series(&r.axes[axis])))
            .collect(),
    };
    let joined = |list: &[super::channels::calibrated::Calibrated], sign: &str| {
        list.iter()
            .map(|c| c.column.as_str())
            .collect::<Vec<_>>()
            .join(sign)
    };
    let mut list = Vec::new();
    if let Some(first) = plan.displacement.first() {
        list.push(trace(first.column.clone(), true, &|c| {
            c.displacement_first.clone()
        }));
    }
    if let Some(second) = plan.displacement.get(1) {
        list.push(trace(second.column.clone(), true, &|c| {
            c.displacement_second.clone().unwrap_or_default()
        }));
        list.push(trace(joined(&plan.displacement, " − "), true, &|c| {
            c.relative_displacement()
        }));
    }
    if let Some(body) = &plan.body_position {
        list.push(trace(body.column.clone(), true, &|c| {
            c.body_position.clone().unwrap_or_default()
        }));
    }
    if !plan.velocity.is_empty() {
        list.push(trace(joined(&plan.velocity, " − "), false, &|c| {
            c.velocity.clone().unwrap_or_default()
        }));
    }
    if let Some(acceleration) = &plan.acceleration {
        list.push(trace(acceleration.column.clone(), false, &|c| {
            c.acceleration.clone().unwrap_or_default()
        }));
    }
    if !plan.force.is_empty() {
        list.push(trace(joined(&plan.force, " + "), false, &|c| {
            c.force.clone()
        }));
    }
    list
}

fn span(series: &[f64]) -> f64 {
    let [low, high] = extent(series.iter().copied());
    high - low
}
