//! Means over the cells of the state plane, and the residual bin by bin over one quantity.

use super::contents::{Curve, Plane};
use crate::report::axis_history::AxisHistory;
use crate::report::state_plane::cells::{CELLS, cell, part};
use crate::study::series::{extent, mean, rms};

/// Bins of a curve.
const BINS: usize = 48;
/// A bin with fewer rows has no mean worth drawing.
const MIN_BIN_ROWS: usize = 8;
/// A velocity counts as a reversal when it has changed sign by this part of its RMS: noise about
/// zero is none.
const REVERSED: f64 = 0.1;

/// Smallest and largest value; a range without width gets one.
pub(super) fn range<'a>(values: impl Iterator<Item = &'a f64>) -> [f64; 2] {
    let [low, high] = extent(values.copied());
    match high > low {
        true => [low, high],
        false if low.is_finite() => [low - 0.5, low + 0.5],
        false => [-0.5, 0.5],
    }
}

/// Sums of one cell.
#[derive(Clone, Copy, Default)]
struct Sums {
    rows: u32,
    error: f64,
    squares: f64,
    predicted: f64,
    measured: f64,
}

/// The means of an axis over its state plane, all records together.
pub(super) fn plane(
    histories: &[AxisHistory],
    displacement: [f64; 2],
    velocity: [f64; 2],
) -> Plane {
    let mut cells = vec![Sums::default(); CELLS[0] * CELLS[1]];
    for history in histories {
        for row in 0..history.measured.len() {
            let state = [history.displacement[row], history.velocity[row]];
            let cell = &mut cells[cell(state, displacement, velocity)];
            let (measured, predicted) = (history.measured[row], history.predicted[row]);
            cell.rows += 1;
            cell.error += measured - predicted;
            cell.squares += (measured - predicted).powi(2);
            cell.measured += measured;
            cell.predicted += predicted;
        }
    }
    let mean = |of: fn(&Sums) -> f64| {
        let cells = cells.iter();
        cells
            .map(|c| (c.rows > 0).then(|| (of(c) / f64::from(c.rows)) as f32))
            .collect::<Vec<_>>()
    };
    let rms = mean(|c| c.squares);
    Plane {
        cells: CELLS,
        displacement,
        velocity,
        rows: cells.iter().map(|c| c.rows).collect(),
        mean: mean(|c| c.error),
        rms: rms.into_iter().map(|m| m.map(f32::sqrt)).collect(),
        predicted: mean(|c| c.predicted),
        measured: mean(|c| c.measured),
    }
}

/// The residual over a quantity: mean and the middle four fifths of every bin that has enough rows.
pub(super) fn curve(quantity: &[f64], residual: &[f64], range: [f64; 2]) -> Curve {
    let mut bins = vec![Vec::new(); BINS];
    let inside = quantity.iter().zip(residual);
    for (at, error) in inside.filter(|(at, _)| (range[0]..=range[1]).contains(*at)) {
        bins[part(*at, range, BINS)].push(*error);
    }
    let mut curve = Curve {
        at: Vec::new(),
        mean: Vec::new(),
        low: Vec::new(),
        high: Vec::new(),
    };
    for (index, bin) in bins.iter_mut().enumerate() {
        if bin.len() < MIN_BIN_ROWS {
            continue;
        }
        bin.sort_by(f64::total_cmp);
        let width = (range[1] - range[0]) / BINS as f64;
        curve.at.push(range[0] + (index as f64 + 0.5) * width);
        curve.mean.push(mean(bin));
        curve.low.push(bin[bin.len() / 10]);
        curve.high.push(bin[bin.len() - 1 - bin.len() / 10]);
    }
    curve
}

/// Seconds since the velocity last changed sign, row by row; not a number before the first
/// reversal.
pub(super) fn since_reversal(velocity: &[f64], rate: f64) -> Vec<f64> {
    let limit = REVERSED * rms(velocity);
    let mut since = vec![f64::NAN; velocity.len()];
    // The side that it was last clearly on, the last crossing of zero, and the reversal that is
    // counted from.
    let (mut side, mut crossing, mut reversal) = (0.0, None, None);
    for row in 0..velocity.len() {
        let v = velocity[row];
        if row > 0 && (v > 0.0) != (velocity[row - 1] > 0.0) {
            crossing = Some(row);
        }
        if v.abs() > limit && v.signum() != side {
            if side != 0.0 && crossing.is_some() {
                reversal = crossing;
                // The rows between the crossing and here belong to the new direction.
                let first = crossing.unwrap_or(row);
                for (late, slot) in since[first..row].iter_mut().enumerate() {
                    *slot = late as f64 / rate;
                }
            }
            side = v.signum();
        }
        if let Some(first) = reversal {
            since[row] = (row - first) as f64 / rate;
        }
    }
    since
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::axis_history::Along;
    use crate::study::AxisKind;

    fn history() -> AxisHistory {
        let time_s: Vec<f64> = (0..8_000).map(|i| 1e-3 * f64::from(i)).collect();
        let phase = |t: &f64| std::f64::consts::TAU * t;
        let displacement = time_s.iter().map(|t| phase(t).sin()).collect();
        let velocity: Vec<f64> = time_s.iter().map(|t| phase(t).cos()).collect();
        let measured: Vec<f64> = velocity.iter().map(|v| 3.0 * v.signum()).collect();
        AxisHistory {
            axis: "x".into(),
            kind: AxisKind::Translation,
            predicted: vec![1.0; time_s.len()],
            along: Along::Time,
            at: time_s,
            displacement,
            velocity,
            measured,
        }
    }

    #[test]
    fn dry_friction_is_seen_as_it_is() {
        let history = history();
        let range = [-1.0, 1.0];
        let plane = plane(std::slice::from_ref(&history), range, range);
        let rows: u32 = plane.rows.iter().sum();
        assert_eq!(rows, 8_000);
        let cell = part(0.0, range, CELLS[0]);
        let top = (CELLS[1] - 1) * CELLS[0] + cell;
        assert_eq!(plane.mean[top], Some(2.0));
        assert_eq!(plane.mean[cell], Some(-4.0));
        assert_eq!(plane.rms[cell], Some(4.0));
        assert_eq!(plane.mean[13 * CELLS[0] + cell], None);
        let curve = curve(&history.velocity, &history.residual(), range);
        assert_eq!(curve.mean.first(), Some(&-4.0));
        assert_eq!(curve.high.last(), Some(&2.0));
    }

    #[test]
    fn time_since_reversal_counts_up_and_starts_anew() {
        let history = history();
        let since = since_reversal(&history.velocity, 1_000.0);
        assert!(since[100].is_nan());
        assert!((since[300] - 0.05).abs() < 2e-3, "{}", since[300]);
        assert!((since[1_000] - 0.25).abs() < 2e-3, "{}", since[1_000]);
        let most = since.iter().copied().fold(0.0, f64::max);
        assert!((most - 0.5).abs() < 2e-3, "{most}");
        let mut noisy = history.velocity.clone();
        noisy[250] = 1e-3;
        noisy[251] = -1e-3;
        let since = since_reversal(&noisy, 1_000.0);
        let most = since.iter().copied().fold(0.0, f64::max);
        assert!((most - 0.5).abs() < 5e-3, "{most}");
    }
}
