//! Why a block of bytes or a set of numbers is refused: which quantity, what was seen, what was wanted.

/// Why the shared code refuses a model or a rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Error {
    /// A quantity lies outside the range in which the arithmetic is proven.
    OutOfRange {
        /// The quantity, in words.
        quantity: &'static str,
        /// The value seen.
        seen: f64,
        /// The smallest value allowed.
        least: f64,
        /// The largest value allowed.
        most: f64,
    },
}
