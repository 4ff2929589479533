//! Studies of joints with a hidden effect, simulated apart from the program, and a judge of what
//! the program says of them.

pub mod bodies;
pub mod cases;
pub mod catalogue;
pub mod drive;
pub mod form;
pub mod judge;
pub mod laws;
pub mod machine;
pub mod rig;
pub mod sensors;
pub mod sizes;
pub mod strength;
pub mod study;
pub mod table;
pub mod verdict;
pub mod wild;
