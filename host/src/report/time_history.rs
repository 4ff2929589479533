//! Time histories: the restoring force over time, measured and predicted; over rows where a log has
//! no time.

use super::axis_history::AxisHistory;
use super::figure::{Curve, Panel, Thinned};
use super::quantity::Quantity;
use super::style::Pen;
use crate::study::series::{mean, peak};
use std::ops::Range;

/// As many swings of the displacement as can be told apart in one panel.
const CYCLES: f64 = 20.0;

/// A panel with measured and predicted restoring force over some rows of the record.
pub fn compared(history: &AxisHistory, rows: Range<usize>) -> Panel {
    let force = Quantity::new(
        &format!("force of {}", history.axis),
        history.kind.force_unit(),
        peak(&history.measured[rows.clone()]),
    );
    let curve = |pen, series: &[f64]| Curve {
        pen,
        points: history.at[rows.clone()]
            .iter()
            .zip(&series[rows.clone()])
            .map(|(t, r)| (*t, force.scaled(*r)))
            .collect(),
    };
    Panel {
        title: format!(
            "{}: restoring force {}",
            history.axis,
            history.along.words()
        ),
        horizontal: history.along.label().into(),
        vertical: force.label(),
        curves: vec![
            curve(Pen::Measured, &history.measured),
            curve(Pen::Model, &history.predicted),
        ],
        thinned: Thinned::Outline,
        shaded: Vec::new(),
    }
}

/// A panel with measured and predicted restoring force over the whole record.
pub fn whole(history: &AxisHistory) -> Panel {
    Panel {
        title: format!("{}: restoring force, whole record", history.axis),
        thinned: Thinned::Columns,
        ..compared(history, 0..history.at.len())
    }
}

/// A panel with the residual, measured less predicted, over the whole record; `failing` are
/// stretches to shade, s.
pub fn residual(history: &AxisHistory, failing: Vec<(f64, f64)>) -> Panel {
    let residual = history.residual();
    let force = Quantity::new(
        &format!("residual of {}", history.axis),
        history.kind.force_unit(),
        peak(&residual),
    );
    let times = history.at.iter().zip(residual);
    Panel {
        title: format!("{}: residual, measured less predicted", history.axis),
        horizontal: history.along.label().into(),
        vertical: force.label(),
        curves: vec![Curve {
            pen: Pen::Alone,
            points: times.map(|(t, e)| (*t, force.scaled(e))).collect(),
        }],
        thinned: Thinned::Columns,
        shaded: failing,
    }
}

/// The middle rows of a record in which its liveliest axis swings about twenty times; all of a
/// slower record.
///
/// All axes of a record are drawn over the same rows, so that what one does can be seen beside what
/// the other does.
pub fn window(histories: &[AxisHistory]) -> Range<usize> {
    let rows = histories
        .first()
        .map_or(0, |history| history.displacement.len());
    let cycles = histories
        .iter()
        .map(|history| swings(&history.displacement));
    let cycles = cycles.fold(0.0, f64::max);
    if cycles <= CYCLES {
        return 0..rows;
    }
    let shown = (rows as f64 * CYCLES / cycles).round() as usize;
    let first = (rows - shown) / 2;
    first..first + shown
}

/// About twenty swings of a record around the largest displacement from the mean; all of a slower
/// record.
pub fn about_largest(history: &AxisHistory) -> Range<usize> {
    let shown = window(std::slice::from_ref(history)).len();
    let displacement = &history.displacement;
    let mean = mean(displacement);
    let away = displacement.iter().map(|x| (x - mean).abs()).enumerate();
    let largest = away
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map_or(0, |(row, _)| row);
    let first = largest.saturating_sub(shown / 2);
    let first = first.min(displacement.len() - shown);
    first..first + shown
}

/// How often a displacement goes up and down about its mean.
fn swings(displacement: &[f64]) -> f64 {
    let mean = mean(displacement);
    let crossings = displacement
        .windows(2)
        .filter(|pair| (pair[0] > mean) != (pair[1] > mean));
    crossings.count() as f64 / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::axis_history::Along;
    use crate::study::AxisKind;

    fn history(hz: f64) -> AxisHistory {
        let time_s: Vec<f64> = (0..10_000).map(|i| 1e-3 * f64::from(i)).collect();
        let swing = |t: &f64| 3.0 + (t * hz * std::f64::consts::TAU).sin();
        let series: Vec<f64> = time_s.iter().map(swing).collect();
        AxisHistory {
            axis: "x".into(),
            kind: AxisKind::Translation,
            along: Along::Time,
            at: time_s,
            displacement: series.clone(),
            velocity: series.clone(),
            measured: series.clone(),
            predicted: series,
        }
    }

    #[test]
    fn twenty_swings_of_a_fast_record_and_all_of_a_slow_one() {
        assert_eq!(window(&[history(1.0)]), 0..10_000);
        let shown = window(&[history(1.0), history(25.0)]);
        assert!((shown.len() as f64 - 800.0).abs() < 10.0, "{shown:?}");
        assert_eq!(shown.start + shown.end, 10_000);
        let mut late = history(25.0);
        late.displacement[9_990] = -7.0;
        assert_eq!(about_largest(&late).end, 10_000);
        assert_eq!(about_largest(&late).len(), window(&[late.clone()]).len());
        assert_eq!(about_largest(&history(1.0)), 0..10_000);
        let panel = compared(&history(25.0), shown);
        assert!((panel.curves[0].points[0].0 - 4.6).abs() < 1e-9);
    }
}
