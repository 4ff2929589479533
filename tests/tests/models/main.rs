//! Models that are learnt: their figures, what they simulate, and the files that they are kept in.

mod foreign;
mod league;
mod measured;
mod network_export;
mod paper;
mod respond;
mod respond_refusals;
mod simulation_criterion;
mod sums;
