//! What comes of setting limits.

use super::board::BoardError;
use super::cusum::Healthy;
use jointwatch_shared::monitor::limits::Limits;

/// The limits and what they were made from.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// For the rig block.
    pub limits: Limits,
    /// Judged blocks of validation records, per axis.
    pub blocks: Vec<usize>,
    /// Per axis: error, stiffer, softer, more friction, less friction.
    pub healthy: Vec<[Healthy; 5]>,
    /// Per axis: how well the board measures the validation records.
    pub board: Vec<BoardError>,
}
