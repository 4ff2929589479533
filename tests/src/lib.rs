//! What the tests of the whole need beside the parts themselves.

pub mod bus;
pub mod coverage;
pub mod elf;
pub mod faults;
pub mod foreign;
pub mod hidden;
pub mod imports;
pub mod lab;
pub mod learnt;
pub mod log;
pub mod monitor;
pub mod program;
pub mod public;
pub mod running;
pub mod story;
pub mod written;
