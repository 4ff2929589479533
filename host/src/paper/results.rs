//! What the reproduction of the paper computes, and the numbers that its page says.

use super::measured::MeasuredJoint;
use super::ratios::SeedRun;
use super::simulated::{BothOnlyRun, Drawn};
use serde::Serialize;
use std::path::PathBuf;

/// Which of the paper's results to compute, and with how much effort.
#[derive(Clone, Debug, PartialEq)]
pub struct PaperOptions {
    /// Simulated studies, with the seeds 1, 2, …; at least 1.
    pub seeds: u64,
    /// Trainings of each network, of which the best is kept; at least 1.
    pub restarts: usize,
    /// The folder that holds the measured joints' folders; where to look otherwise:
    /// `JOINTWATCH_DATA`, `../shared`.
    pub data: Option<PathBuf>,
}

impl Default for PaperOptions {
    /// Five seeds and the paper's five restarts.
    fn default() -> Self {
        Self {
            seeds: 5,
            restarts: 5,
            data: None,
        }
    }
}

/// Everything that the page says in numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Results {
    /// Trainings of each network.
    pub restarts: usize,
    /// Errors of the models in Figs. 7 to 10, learnt from the first seed's study.
    pub drawn: [Drawn; 2],
    /// Seed by seed, seen through perfect sensors.
    pub perfect: Vec<SeedRun>,
    /// Seed by seed, seen through a rig's sensors.
    pub rig: Vec<SeedRun>,
    /// Seed by seed, learnt from the record with both axes driven alone; perfect sensors.
    pub both_only: Vec<BothOnlyRun>,
    /// Results on measured joints.
    pub measured: Vec<MeasuredJoint>,
}
