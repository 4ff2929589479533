//! Commands that learn a model, judge it, and say what it lacks.

pub(super) mod accumulate;
pub(super) mod add;
pub(super) mod changed;
pub(super) mod compare;
pub(super) mod diagnose;
pub(super) mod identify;
mod identify_network;
pub(super) mod merge;
pub(super) mod respond;
mod staircase;
