//! What is missing in a model: found, told and added, on simulated rigs and on measured joints.

mod adding;
mod cancelling;
mod changed;
mod hidden_effects;
mod hidden_in_simulation;
mod inputs;
mod joint_changes;
mod joints;
mod mains_hum;
mod measured_changes;
mod missing_effects;
mod one_sided;
mod physical;
mod state_inputs;
mod temperature;
mod told;
