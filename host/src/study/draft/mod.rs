//! A first study.toml for somebody's logs: what each column is, how the axes are put together, and
//! which record validates.
//!
//! Names and units say most of it; what they leave open is settled by what the numbers do: an
//! acceleration is the second derivative of a position, a passive joint takes energy out, the
//! inertia is positive.

mod arrival;
mod axis;
mod decay;
mod free;
mod guess;
mod nameless;
mod pairs;
mod parts;
mod records;
mod refused;
mod runs;
mod sparse;
mod stand_in;
mod stated;
mod trial;
mod velocity;
mod write;

pub use guess::draft;
pub use parts::{Draft, DraftAxis, DraftChannel, DraftRecord, UserChoices};
pub use write::text;
