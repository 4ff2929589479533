//! The figure that holds a model against one record: time histories above, phase plots below.

use super::axis_history::AxisHistory;
use super::figure::{Figure, Panel};
use super::phase::{self, Against};
use super::style::Pen;
use super::time_history;

/// A figure in the paper's layout (Figs. 8, 10, 15 to 18): a time history per axis, each as wide as
/// the page, and below them the phase plots. With two axes those are over displacement, with one
/// axis over displacement and velocity.
///
/// The time histories show the middle of the record, about twenty swings, the phase plots all of
/// it. `measured` and `model` are the words of the legend.
pub fn comparison(histories: &[AxisHistory], measured: &str, model: &str) -> Figure {
    let rows = time_history::window(histories);
    let time_panels = histories
        .iter()
        .map(|history| vec![time_history::compared(history, rows.clone())]);
    let over: &[Against] = match histories.len() {
        1 => &[Against::Displacement, Against::Velocity],
        _ => &[Against::Displacement],
    };
    let phases = histories.iter().flat_map(|history| {
        over.iter()
            .map(|against| phase::compared(history, *against, 0..history.at.len()))
    });
    let mut rows: Vec<Vec<Panel>> = time_panels.chain([phases.collect()]).collect();
    for (panel, letter) in rows.iter_mut().flatten().zip('a'..) {
        panel.title = format!("({letter}) {}", panel.title);
    }
    Figure {
        rows,
        legend: vec![(Pen::Measured, measured.into()), (Pen::Model, model.into())],
    }
}
