//! The sensor chips that a board has.

use jointwatch_shared::wire::wiring::{ACCELEROMETERS, COUNTERS};

/// Every chip, as a device of the board.
pub struct Chips<T> {
    /// All counters at once.
    pub latch: T,
    /// The quadrature counters one by one, in the order of the wiring.
    pub counters: [T; COUNTERS],
    /// The converter of the strain bridges.
    pub converter: T,
    /// The accelerometers one by one, in the order of the wiring.
    pub accelerometers: [T; ACCELEROMETERS],
}
