//! What is stored and sent: the model blob, the rig block, telemetry and captures.

mod blob;
mod blob_layout;
mod capture;
mod inputs;
mod rig_block;
mod rig_block_layout;
mod sample_models;
mod sample_rigs;
mod selftest_digest;
mod telemetry;
mod telemetry_frames;
mod telemetry_noise;
mod telemetry_page;
mod wide;
