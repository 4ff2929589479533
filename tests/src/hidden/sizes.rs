//! Sizes that laws are drawn to suit, and what a law remembers.

/// Size of the motion that an axis makes without the hidden effect.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scale {
    /// RMS displacement over the rows that move.
    pub displacement: f64,
    /// Largest magnitude of the displacement.
    pub reach: f64,
    /// RMS velocity over the same rows.
    pub velocity: f64,
}

/// Memory of one law: what its differential equations integrate.
pub type Memory = [f64; MEMORIES];

/// Numbers in it; most laws use the first alone.
pub const MEMORIES: usize = 6;
