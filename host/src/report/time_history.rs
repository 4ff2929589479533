//! Time histories: the restoring force over time, measured and predicted.

use super::course::Course;
use super::figure::{Curve, Panel, Thinned};
use super::quantity::Quantity;
use super::style::Pen;
use crate::signal::statistics::peak;
use std::ops::Range;

/// As many swings of the displacement as can be told apart in one panel.
const CYCLES: f64 = 20.0;

/// A panel with measured and predicted restoring force over some rows of the record.
pub fn compared(course: &Course, rows: Range<usize>) -> Panel {
    let force = Quantity::new(
        &format!("force of {}", course.axis),
        course.kind.force_unit(),
        peak(&course.measured[rows.clone()]),
    );
    let curve = |pen, series: &[f64]| Curve {
        pen,
        points: course.time_s[rows.clone()]
            .iter()
            .zip(&series[rows.clone()])
            .map(|(t, r)| (*t, force.scaled(*r)))
            .collect(),
    };
    Panel {
        title: format!("{}: restoring force over time", course.axis),
        horizontal: "time (s)".into(),
        vertical: force.label(),
        curves: vec![
            curve(Pen::Measured, &course.measured),
            curve(Pen::Model, &course.predicted),
        ],
        thinned: Thinned::Outline,
        shaded: Vec::new(),
    }
}

/// A panel with measured and predicted restoring force over the whole record.
pub fn whole(course: &Course) -> Panel {
    Panel {
        title: format!("{}: restoring force, whole record", course.axis),
        thinned: Thinned::Columns,
        ..compared(course, 0..course.time_s.len())
    }
}

/// A panel with the residual, measured less predicted, over the whole record; `failing` are stretches to shade, s.
pub fn residual(course: &Course, failing: Vec<(f64, f64)>) -> Panel {
    let residual = course.residual();
    let force = Quantity::new(
        &format!("residual of {}", course.axis),
        course.kind.force_unit(),
        peak(&residual),
    );
    let times = course.time_s.iter().zip(residual);
    Panel {
        title: format!("{}: residual, measured less predicted", course.axis),
        horizontal: "time (s)".into(),
        vertical: force.label(),
        curves: vec![Curve {
            pen: Pen::Alone,
            points: times.map(|(t, e)| (*t, force.scaled(e))).collect(),
        }],
        thinned: Thinned::Columns,
        shaded: failing,
    }
}

/// The middle rows of a record in which its liveliest axis swings about twenty times; all of a slower record.
///
/// All axes of a record are drawn over the same rows, so that what one does can be seen beside what the other does.
pub fn window(courses: &[Course]) -> Range<usize> {
    let rows = courses
        .first()
        .map_or(0, |course| course.displacement.len());
    let cycles = courses.iter().map(|course| swings(&course.displacement));
    let cycles = cycles.fold(0.0, f64::max);
    if cycles <= CYCLES {
        return 0..rows;
    }
    let shown = (rows as f64 * CYCLES / cycles).round() as usize;
    let first = (rows - shown) / 2;
    first..first + shown
}

/// About twenty swings of a record around the largest displacement from the mean; all of a slower record.
pub fn about_largest(course: &Course) -> Range<usize> {
    let shown = window(std::slice::from_ref(course)).len();
    let displacement = &course.displacement;
    let mean = displacement.iter().sum::<f64>() / displacement.len().max(1) as f64;
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
    let mean = displacement.iter().sum::<f64>() / displacement.len().max(1) as f64;
    let crossings = displacement
        .windows(2)
        .filter(|pair| (pair[0] > mean) != (pair[1] > mean));
    crossings.count() as f64 / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::AxisKind;

    fn course(hz: f64) -> Course {
        let time_s: Vec<f64> = (0..10_000).map(|i| 1e-3 * f64::from(i)).collect();
        let swing = |t: &f64| 3.0 + (t * hz * std::f64::consts::TAU).sin();
        let series: Vec<f64> = time_s.iter().map(swing).collect();
        Course {
            axis: "x".into(),
            kind: AxisKind::Translation,
            time_s,
            displacement: series.clone(),
            velocity: series.clone(),
            measured: series.clone(),
            predicted: series,
        }
    }

    #[test]
    fn twenty_swings_of_a_fast_record_and_all_of_a_slow_one() {
        assert_eq!(window(&[course(1.0)]), 0..10_000);
        let shown = window(&[course(1.0), course(25.0)]);
        assert!((shown.len() as f64 - 800.0).abs() < 10.0, "{shown:?}");
        assert_eq!(shown.start + shown.end, 10_000);
        let mut late = course(25.0);
        late.displacement[9_990] = -7.0;
        assert_eq!(about_largest(&late).end, 10_000);
        assert_eq!(about_largest(&late).len(), window(&[late.clone()]).len());
        assert_eq!(about_largest(&course(1.0)), 0..10_000);
        let panel = compared(&course(25.0), shown);
        assert!((panel.curves[0].points[0].0 - 4.6).abs() < 1e-9);
    }
}
