//! A study: the rig and its records, as `study.toml` describes them, read into SI units.
//!
//! [`Study::read`] is the one way in. What a study may say, and every reason for which it is refused, stands in
//! `docs/study.md`.

mod check;
mod csv;
mod description;
mod json;
mod log;
mod matlab;
mod nearest;
mod plan;
mod read;
pub mod time;
mod units;

use std::path::PathBuf;

/// Translation (m, N, kg) or rotation (rad, N·m, kg·m²).
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AxisKind {
    /// Displacement in m, force in N, inertia in kg.
    Translation,
    /// Displacement in rad, torque in N·m, inertia in kg·m².
    Rotation,
}

/// What a record is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// Learnt from; comparing with it is verification.
    Train,
    /// Never learnt from; comparing with it is validation.
    Validate,
}

/// Which way round the equation of motion gives the restoring force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Convention {
    /// r = inertia·acceleration − force: the log holds the force by which the drive pulls the body.
    InertiaMinusForce,
    /// r = force − inertia·acceleration (the paper's Eq. 8).
    #[default]
    ForceMinusInertia,
}

/// One axis of the joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// The name that stands behind the @ of an effect.
    pub name: String,
    /// Translation or rotation.
    pub kind: AxisKind,
    /// kg or kg·m²; `None` when it is to be identified, 0 when the force already is the restoring force.
    pub inertia: Option<f64>,
    /// Which way round the equation of motion gives the restoring force.
    pub restoring_force: Convention,
    /// N/m or N·m/rad of a known spring from the body to ground.
    pub ground_stiffness: f64,
    /// N·s/m or N·m·s/rad of a known damper from the body to ground.
    pub ground_damping: f64,
    /// One count of the encoder, m or rad.
    pub encoder_step: Option<f64>,
}

/// What was logged of one axis, in SI units, one value per row.
#[derive(Clone, Debug, PartialEq)]
pub struct Channels {
    /// Position of the far side, or the relative displacement itself when `displacement_second` is `None`.
    pub displacement_first: Vec<f64>,
    /// Position of the near side; relative displacement = first − second.
    pub displacement_second: Option<Vec<f64>>,
    /// Relative velocity, when it was logged.
    pub velocity: Option<Vec<f64>>,
    /// Absolute position of the body that carries the inertia.
    pub body_position: Option<Vec<f64>>,
    /// Absolute acceleration of that body.
    pub acceleration: Option<Vec<f64>>,
    /// Sum of the applied force on that body.
    pub force: Vec<f64>,
}

/// One log of one run.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// The file as study.toml names it.
    pub file: String,
    /// What it is used for.
    pub role: Role,
    /// The row of the file (from 0, heading not counted) that became row 0 here; where samples were dropped and
    /// bridged, later rows here run ahead of the file's.
    pub first_row: usize,
    /// Rows.
    pub rows: usize,
    /// One entry per axis of the study.
    pub axes: Vec<Channels>,
}

/// A study, read and checked.
#[derive(Clone, Debug)]
pub struct Study {
    /// Its name.
    pub name: String,
    /// Where study.toml lies.
    pub path: PathBuf,
    /// Samples per second.
    pub sample_rate_hz: f64,
    /// The common band of fits and error figures, when the study states one, Hz.
    pub band_hz: Option<f64>,
    /// One or two axes.
    pub axes: Vec<Axis>,
    /// The records, in the order of study.toml.
    pub records: Vec<Record>,
    /// `[base] terms`, as written.
    pub base_terms: Vec<String>,
    /// What the reader wants the user to know: bridged gaps, columns left unused, …; one sentence each.
    pub notes: Vec<String>,
}
