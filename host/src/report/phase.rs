//! Phase plots: the restoring force over relative displacement or velocity.

use super::course::Course;
use super::figure::{Curve, Panel, Thinned};
use super::quantity::Quantity;
use super::style::Pen;
use crate::signal::statistics::peak;
use std::ops::Range;

/// What the restoring force is drawn over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Against {
    /// Relative displacement, m or rad.
    Displacement,
    /// Relative velocity, m/s or rad/s.
    Velocity,
}

/// A panel with the measured restoring force alone.
pub fn measured(course: &Course, against: Against, title: String) -> Panel {
    let rows = 0..course.time_s.len();
    panel(
        course,
        against,
        rows,
        title,
        &[(Pen::Alone, &course.measured)],
    )
}

/// A panel with measured and predicted restoring force over some rows of the record: loops can be told apart while they are few.
pub fn compared(course: &Course, against: Against, rows: Range<usize>) -> Panel {
    let over = match against {
        Against::Displacement => "displacement",
        Against::Velocity => "velocity",
    };
    let title = if rows.len() < course.time_s.len() {
        format!(
            "{}: force over {over}, around the largest swing",
            course.axis
        )
    } else {
        format!("{}: restoring force over {over}", course.axis)
    };
    panel(
        course,
        against,
        rows,
        title,
        &[
            (Pen::Measured, &course.measured),
            (Pen::Model, &course.predicted),
        ],
    )
}

fn panel(
    course: &Course,
    against: Against,
    rows: Range<usize>,
    title: String,
    forces: &[(Pen, &[f64])],
) -> Panel {
    let (name, series, unit) = match against {
        Against::Displacement => (
            "displacement",
            &course.displacement,
            course.kind.displacement_unit(),
        ),
        Against::Velocity => ("velocity", &course.velocity, course.kind.velocity_unit()),
    };
    let series = &series[rows.clone()];
    let state = Quantity::new(&format!("{name} of {}", course.axis), unit, peak(series));
    let force = Quantity::new(
        &format!("force of {}", course.axis),
        course.kind.force_unit(),
        peak(&course.measured[rows.clone()]),
    );
    Panel {
        title,
        horizontal: state.label(),
        vertical: force.label(),
        curves: forces
            .iter()
            .map(|(pen, forces)| Curve {
                pen: *pen,
                points: series
                    .iter()
                    .zip(&forces[rows.clone()])
                    .map(|(s, r)| (state.scaled(*s), force.scaled(*r)))
                    .collect(),
            })
            .collect(),
        thinned: Thinned::Outline,
        shaded: Vec::new(),
    }
}
