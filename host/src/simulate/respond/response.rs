//! What is asked of a simulated response, and what it answers.

use super::compare::AxisResponse;
use super::run::Divergence;
use crate::study::Role;
use serde::Serialize;
use std::collections::BTreeMap;

/// Which records to simulate, with which model, from where.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Only this record, as study.toml names it.
    pub record: Option<String>,
    /// Start anew from the measured motion every so many seconds; `None` is once, at the record's
    /// beginning.
    pub restart_s: Option<f64>,
    /// Drive the body by the logged force also where the study's truth is at hand.
    pub measured: bool,
}

/// What a simulation was held against.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Against {
    /// The true motion of the simulated rig, all of whose bodies moved.
    Truth,
    /// The measured motion; the body was driven by the logged force.
    Measurement,
}

/// The simulated motion of one record beside the measured one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RecordResponse {
    /// The record's file, as study.toml names it.
    pub file: String,
    /// Learnt from (`train`) or not (`validate`).
    pub role: Role,
    /// Rows of the record that were to be simulated.
    pub rows: usize,
    /// Part of them that was, 0 to 1: less than 1 when the simulation diverged.
    pub simulated: f64,
    /// Every divergence: one at most without restarts.
    pub diverged: Vec<Divergence>,
    /// Integration steps per row.
    pub steps_per_row: usize,
    /// RMS change of the displacements when twice as many steps are taken, as a part of their RMS;
    /// the largest over the axes.
    pub step_error: f64,
    /// Figures by axis name.
    pub axes: BTreeMap<String, AxisResponse>,
    /// Seconds from the beginning of the file to the first simulated row.
    pub start_s: f64,
    /// Simulated states [x, ẋ] or [x, ẋ, φ, φ̇], SI; NaN where the simulation had diverged.
    #[serde(skip)]
    pub states: Vec<Vec<f64>>,
    /// What they are held against.
    #[serde(skip)]
    pub measured: Vec<Vec<f64>>,
}

/// Everything `respond` has to say; its `--json` in full.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Response {
    /// What the simulations were held against.
    pub against: Against,
    /// Time from one restart of the simulation to the next, s; `None` where it starts once.
    pub restart_s: Option<f64>,
    /// In the order of the study.
    pub records: Vec<RecordResponse>,
    /// How far the figures may be trusted, one sentence each.
    pub notes: Vec<String>,
}
