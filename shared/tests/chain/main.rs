//! From counts to a residual, and what the monitor makes of it.

mod monitor_changes;
mod monitor_garbage;
mod pipeline;
mod watched;
