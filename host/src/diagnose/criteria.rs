//! The numbers that a diagnosis decides by, each with its reason.

/// What decides. The same few numbers serve every rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Criteria {
    /// Blocks of equal force energy per axis: enough for a standard error, and each still long
    /// enough for a law with memory.
    pub(crate) blocks: usize,
    /// Hypotheses that each step of the search goes on from.
    pub(crate) width: usize,
    /// The most effects that are added on one axis: more predict well and mean little.
    pub(crate) depth: usize,
    /// The price of every number that a hypothesis chooses, as mean log error power.
    pub(crate) price: f64,
    /// Mean log error power below which nothing is decided: 1.5 % of the error.
    pub(crate) least_difference: f64,
    /// Of what the effects explain together, the part that each has to explain by itself, unless
    /// it is clearly better to have it.
    pub(crate) least_importance: f64,
    /// Mean log error power by which a set of effects is better however little it explains: it
    /// leaves a third of the error.
    pub(crate) clearly: f64,
    /// What an effect explains at least, RMS beside the RMS force of its axis: every model of a
    /// real joint is wrong by half a per cent.
    pub(crate) least_share: f64,
    /// A zero of force within this part of the RMS applied force is a data sheet's tolerance.
    pub(crate) zero: f64,
    /// So is an inertia or a gain that is wrong by this part: three standard deviations of what
    /// calibrations within 0.15 % of a force channel, an accelerometer and an inertia make
    /// together.
    pub(crate) gain: f64,
    /// A force channel that is late by no more is as good as on time, s.
    pub(crate) lateness_s: f64,
    /// The verdict is *unknown* where what has no name is more than this part of the power of what
    /// has one: a quarter in RMS. An effect beside others that explains less than what is left
    /// without a name over this part is a piece of a shape, and has no name either.
    /// Laws of measured joints leave up to 0.05, laws of the library up to 0.01 in simulated
    /// testing machines.
    pub(crate) unknown: f64,
    /// What is left is more than the sensors' noise where it stands above it by this factor.
    pub(crate) above_noise: f64,
}

/// Those in force. Blocks, width, depth, price and difference are those at which a prototype named
/// the effects of 38 of 38 rigs and described eight measured joints; the rest are tolerances of
/// common instruments.
pub(crate) const CRITERIA: Criteria = Criteria {
    blocks: 24,
    width: 3,
    depth: 3,
    price: 0.02,
    least_difference: 0.03,
    least_importance: 0.02,
    clearly: 2.2,
    least_share: 0.005,
    zero: 0.01,
    gain: 0.0078,
    lateness_s: 50e-6,
    unknown: 0.0625,
    above_noise: 1.4,
};
