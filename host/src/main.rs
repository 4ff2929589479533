//! The command line of Jointwatch.
fn main() {}
