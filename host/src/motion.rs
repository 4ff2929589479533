//! A record as the models see it: states, acceleration and applied force, row by row.

/// A record after differentiation: what a model's inputs and its output are made of.
///
/// All series have the same length; the rows at both ends where a filter has no full support are gone.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Which record of the study.
    pub record: usize,
    /// The record's row that became row 0 here.
    pub first_row: usize,
    /// Samples per second.
    pub sample_rate_hz: f64,
    /// [x, ẋ] or [x, ẋ, φ, φ̇]: relative displacement and velocity of each axis, SI, wide-band.
    pub states: Vec<Vec<f64>>,
    /// Absolute acceleration of the body, per axis.
    pub acceleration: Vec<Vec<f64>>,
    /// Applied force per axis, known ground spring and damper already subtracted (Eqs. 8, 9).
    pub force: Vec<Vec<f64>>,
}

impl Motion {
    /// Rows.
    pub fn rows(&self) -> usize {
        self.force[0].len()
    }
}
