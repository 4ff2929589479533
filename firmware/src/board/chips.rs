//! The sensor chips that a board has.

use jointwatch_shared::wire::wiring::{ACCELEROMETERS, COUNTERS};

/// Every chip, as a device of the board.
pub struct Chips<T> {
    /// All counters at once.
    pub latch: T,
    /// The quadrature counters.
    pub counters: [T; COUNTERS],
    /// The converter.
    pub converter: T,
    /// The accelerometers.
    pub accelerometers: [T; ACCELEROMETERS],
}
