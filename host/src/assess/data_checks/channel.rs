//! A logged channel of one axis, with the figures that tell a broken sensor from a moving joint.

use crate::study::series::range;
use crate::study::{Axis, Channels};

/// What a channel measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Displacement relative to another body, which may rightly stand still while everything else
    /// moves.
    Relative,
    /// Position of one body.
    Position,
    Velocity,
    Acceleration,
    Force,
}

/// One channel of one axis in one record.
pub(super) struct Channel<'a> {
    /// As it stands in a sentence.
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) series: &'a [f64],
    /// The SI unit of its values.
    pub(super) unit: String,
}

/// The channels of an axis, each once.
pub(super) fn channels<'a>(axis: &Axis, logged: &'a Channels) -> Vec<Channel<'a>> {
    let kind = axis.kind;
    let first = &logged.displacement_first;
    let second = logged.displacement_second.as_ref();
    let (name, of_first) = match second {
        Some(_) => ("first displacement", Kind::Position),
        None => ("displacement", Kind::Relative),
    };
    let body = logged.body_position.as_ref();
    let body = body.filter(|b| *b != first && Some(*b) != second);
    let length = kind.displacement_unit();
    let all = [
        (name, of_first, Some(first), length.to_string()),
        (
            "second displacement",
            Kind::Position,
            second,
            length.to_string(),
        ),
        ("body position", Kind::Position, body, length.to_string()),
        (
            "velocity",
            Kind::Velocity,
            logged.velocity.as_ref(),
            kind.velocity_unit().to_string(),
        ),
        (
            "acceleration",
            Kind::Acceleration,
            logged.acceleration.as_ref(),
            format!("{length}/s²"),
        ),
        (
            "force",
            Kind::Force,
            Some(&logged.force),
            kind.force_unit().to_string(),
        ),
    ];
    let present = all.into_iter().filter_map(|(name, kind, series, unit)| {
        Some(Channel {
            name: format!("the {name} channel of {}", axis.name),
            kind,
            series: series?,
            unit,
        })
    });
    present.collect()
}

/// Sizes of the steps from row to row that are not 0, smallest first; what is left of one unit by
/// rounding is no step.
pub(super) fn steps(series: &[f64]) -> Vec<f64> {
    let least = 1e-9 * range(series);
    let sizes = series.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let mut sizes: Vec<f64> = sizes.filter(|step| *step > least).collect();
    sizes.sort_by(f64::total_cmp);
    sizes
}

/// The value below which a share of a sorted list lies; 0 of an empty one.
pub(super) fn quantile(sorted: &[f64], share: f64) -> f64 {
    let at = (share * sorted.len() as f64) as usize;
    let last = sorted.len().saturating_sub(1);
    sorted.get(at.min(last)).copied().unwrap_or(0.0)
}

/// Stretches of equal neighbours, (first row, rows), of at least `least` rows.
pub(super) fn constant_runs(series: &[f64], least: usize) -> Vec<(usize, usize)> {
    let mut runs = Vec::new();
    let mut start = 0;
    for part in series.chunk_by(|a, b| a == b) {
        if part.len() >= least {
            runs.push((start, part.len()));
        }
        start += part.len();
    }
    runs
}
