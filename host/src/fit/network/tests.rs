//! Whether training does what its formulas say: derivatives, the eliminated output layer, known networks, stopping.
