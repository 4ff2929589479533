//! How the rig moves with the model in place of its joint, beside how it moved.

use super::contents::{ResponseAxis, ResponseContents};
use super::samples;
use crate::simulate::respond::{Against, RecordResponse, Response};
use crate::study::Study;

/// Rows per record on the page.
const MAX_ROWS: usize = 8_000;

/// Every simulated record beside the motion that it is held against.
pub(super) fn gather(response: &Response, study: &Study) -> Vec<ResponseContents> {
    let against = match response.against {
        Against::Truth => "the rig's true motion",
        Against::Measurement => "the measured motion",
    };
    let records = response.records.iter();
    records.map(|record| one(record, study, against)).collect()
}

fn one(record: &RecordResponse, study: &Study, against: &'static str) -> ResponseContents {
    // The states are displacement and velocity of each axis in turn.
    let displacements =
        |states: &[Vec<f64>]| -> Vec<Vec<f64>> { states.iter().step_by(2).cloned().collect() };
    let (measured, simulated) = (
        displacements(&record.measured),
        displacements(&record.states),
    );
    let extremes: Vec<&[f64]> = measured
        .iter()
        .chain(&simulated)
        .map(Vec::as_slice)
        .collect();
    let rows = extremes.iter().map(|s| s.len()).min().unwrap_or(0);
    let extremes: Vec<&[f64]> = extremes.iter().map(|s| &s[..rows]).collect();
    let kept = samples::kept_rows(rows, &extremes, MAX_ROWS);
    let time: Vec<f64> = (0..rows)
        .map(|row| record.start_s + row as f64 / study.sample_rate_hz)
        .collect();
    let figures = study.axes.iter().map(|a| record.axes.get(&a.name));
    let axes = measured.iter().zip(&simulated).zip(figures);
    ResponseContents {
        file: record.file.clone(),
        against,
        time: samples::packed(&time, &kept),
        axes: axes
            .map(|((measured, simulated), figures)| ResponseAxis {
                measured: samples::packed(measured, &kept),
                simulated: samples::packed(simulated, &kept),
                nmse_percent: figures.map_or(0.0, |f| f.displacement_nmse_percent),
                at_rest: figures.is_some_and(|f| f.at_rest),
            })
            .collect(),
    }
}
