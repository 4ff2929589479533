//! The numbers that a diagnosis decides by, each with its reason; the same few serve every rig.
//!
//! Blocks, width, depth, price and difference are those at which a prototype named the effects of
//! 38 of 38 rigs and described eight measured joints; the rest are tolerances of common
//! instruments.

/// Blocks of equal force energy per axis: enough for a standard error, and each still long enough
/// for a law with memory.
pub(crate) const BLOCKS: usize = 24;
/// Hypotheses that each step of the search goes on from.
pub(crate) const WIDTH: usize = 3;
/// The most effects that are added on one axis: more predict well and mean little.
pub(crate) const DEPTH: usize = 3;
/// The price of every number that a hypothesis chooses, as mean log error power.
pub(crate) const PRICE: f64 = 0.02;
/// Mean log error power below which nothing is decided: 1.5 % of the error.
pub(crate) const LEAST_DIFFERENCE: f64 = 0.03;
/// Of what the effects explain together, the part that each has to explain by itself, unless it is
/// clearly better to have it.
pub(crate) const LEAST_IMPORTANCE: f64 = 0.02;
/// Mean log error power by which a set of effects is better however little it explains: it leaves a
/// third of the error.
pub(crate) const CLEARLY: f64 = 2.2;
/// What an effect explains at least, RMS beside the RMS force of its axis: every model of a real
/// joint is wrong by half a per cent.
pub(crate) const LEAST_SHARE: f64 = 0.005;
/// A zero of force within this part of the RMS applied force is a data sheet's tolerance.
pub(crate) const ZERO: f64 = 0.01;
/// So is an inertia or a gain that is wrong by this part: three standard deviations of what
/// calibrations within 0.15 % of a force channel, an accelerometer and an inertia make together.
pub(crate) const GAIN: f64 = 0.0078;
/// A force channel that is late by no more is as good as on time, s.
pub(crate) const LATENESS_S: f64 = 50e-6;
/// The verdict is *unknown* where what has no name is more than this part of the power of what has
/// one: a quarter in RMS. An effect beside others that explains less than what is left without a
/// name over this part is a piece of a shape, and has no name either. Laws of measured joints leave
/// up to 0.05, laws of the library up to 0.01 in simulated testing machines.
pub(crate) const UNKNOWN: f64 = 0.0625;
/// What is left is more than the sensors' noise where it stands above it by this factor.
pub(crate) const ABOVE_NOISE: f64 = 1.4;

/// What data sheets' tolerances make of a relative error: a zero, and a gain or an inertia.
pub(crate) fn tolerance() -> f64 {
    ZERO.hypot(GAIN)
}

/// Whether a relative error stands above the sensors' noise, and by more than a share of the force.
pub(crate) fn stands_out(left: f64, noise: f64, share: f64) -> bool {
    left > ABOVE_NOISE * noise && left * left - noise * noise > share * share
}
