//! What a model says about itself and about its outputs, in SI units.

use super::axis::Axis;
use crate::fault::{Checks, Error};
use heapless::Vec;

/// What a model says about itself, in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// The sample rate of the records it was learnt from, in Hz.
    pub sample_rate_hz: f64,
    /// The band to which force and residual are low-passed before they are compared, in Hz; at
    /// most half the sample rate.
    pub band_hz: f64,
    /// The pass band of the derivatives that gave the states, in Hz; at most half the sample rate.
    pub state_band_hz: f64,
    /// One or two axes.
    pub axes: Vec<Axis, 2>,
}

/// What one unit of a predicted force is, and how far the integers may be from the `f64` model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Output {
    /// N or N·m per unit of the output; any positive number.
    pub force_per_lsb: f64,
    /// The largest difference to the `f64` model over all inputs in [−1, 1], in N or N·m:
    /// coefficients, inputs and arithmetic together, as export stated it.
    pub error_bound: f64,
}

impl Header {
    /// Checks what host and device rely on.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] or [`Error::Name`] for the first thing that is not usable.
    pub fn check(&self) -> Result<(), Error> {
        let mut checks = Checks::new();
        checks.whole("number of axes", self.axes.len() as i32, 1, 2);
        checks.within("sample rate in Hz", self.sample_rate_hz, 1.0, 1e6);
        let most = 0.5 * self.sample_rate_hz;
        checks.within("band in Hz", self.band_hz, 1e-3, most);
        checks.within("band of the states in Hz", self.state_band_hz, 1e-3, most);
        for axis in &self.axes {
            axis.check(&mut checks);
        }
        if let [first, second] = &self.axes[..]
            && first.name == second.name
        {
            checks.say(Error::Name {
                axis: 1,
                fault: "is the name of axis 0 as well",
            });
        }
        checks.done()
    }
}
