//! The lab: a page on this machine on which an engineer does the whole loop with a mouse.
//!
//! It computes nothing of its own. Every action is a command of this program, run in the study's
//! folder as a process that can be ended, and shown on the page as it would be typed. What the page
//! draws is what `--report` draws, from the same numbers.
//!
//! The server listens on the loopback address alone. A request has to name this server as its host,
//! must not come from another site, and needs the token that was printed at the start; sizes, times
//! and connections are limited. Files are written only into the folder `jointwatch-lab` inside the
//! study's own, besides the study.toml and the logs that the user drops.

mod action;
mod assets;
mod draft;
mod folder;
mod guard;
mod job;
mod live;
mod long;
mod models;
mod routes;
mod server;
mod session;
mod snapshot;
mod state;
mod upload;

pub(crate) use job::{HIDDEN, PROGRESS_MARK};
pub use server::{Lab, Started};

use std::sync::{Mutex, MutexGuard, PoisonError};

/// What a lock guards, also after a thread that held it has panicked.
fn locked<T>(one: &Mutex<T>) -> MutexGuard<'_, T> {
    one.lock().unwrap_or_else(PoisonError::into_inner)
}
