//! What the device does, whatever its board: from the sensors of one instant to the verdict that
//! goes out over the serial line.
//!
//! ```text
//! timer ─▶ sample ──frames──▶ evaluate ──forces──▶ monitor ──samples──▶ serve ──▶ serial line
//!          chips              chain, model         Watch                Server ◀── requests
//! priority: highest                                                     lowest
//! ```
//! Each arrow is a queue of fixed length; what does not fit is counted and told, never waited for.
//! Everything up to the monitor runs per sample: integers only, no heap, no path to a panic. A
//! board hangs these four steps to its interrupts (`bin/jointwatch.rs`); the tests call them one
//! after the other.

mod channels;
mod evaluation;
mod progress;
mod sampling;
mod server;
mod start;
mod watch;

pub use channels::{Places, raw_wiring};
pub use evaluation::{Evaluated, Evaluator, Lost, evaluate};
pub use progress::Progress;
pub use sampling::{Frame, Sampler};
pub use server::{SerialPort, Server, Shared, Supplied};
pub use start::{Begun, Room, Setup, begin};
pub use watch::{Streamed, Watch};
