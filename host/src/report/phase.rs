//! Phase plots: the restoring force over relative displacement or velocity.

use super::axis_history::AxisHistory;
use super::figure::{Curve, Panel, Thinned};
use super::quantity::Quantity;
use super::style::Pen;
use crate::study::series::peak;
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
pub fn measured(history: &AxisHistory, against: Against, title: String) -> Panel {
    let rows = 0..history.at.len();
    panel(
        history,
        against,
        rows,
        title,
        &[(Pen::Alone, &history.measured)],
    )
}

/// A panel with measured and predicted restoring force over some rows of the record: loops can be
/// told apart while they are few.
pub fn compared(history: &AxisHistory, against: Against, rows: Range<usize>) -> Panel {
    let over = match against {
        Against::Displacement => "displacement",
        Against::Velocity => "velocity",
    };
    let title = if rows.len() < history.at.len() {
        format!(
            "{}: force over {over}, around the largest swing",
            history.axis
        )
    } else {
        format!("{}: restoring force over {over}", history.axis)
    };
    panel(
        history,
        against,
        rows,
        title,
        &[
            (Pen::Measured, &history.measured),
            (Pen::Model, &history.predicted),
        ],
    )
}

fn panel(
    history: &AxisHistory,
    against: Against,
    rows: Range<usize>,
    title: String,
    forces: &[(Pen, &[f64])],
) -> Panel {
    let (name, series, unit) = match against {
        Against::Displacement => (
            "displacement",
            &history.displacement,
            history.kind.displacement_unit(),
        ),
        Against::Velocity => ("velocity", &history.velocity, history.kind.velocity_unit()),
    };
    let series = &series[rows.clone()];
    let state = Quantity::new(&format!("{name} of {}", history.axis), unit, peak(series));
    let force = Quantity::new(
        &format!("force of {}", history.axis),
        history.kind.force_unit(),
        peak(&history.measured[rows.clone()]),
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
