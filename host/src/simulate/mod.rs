//! A simulated rig: the joint of the paper's Section 3, shaken, and logged as a real rig would log
//! it.
//!
//! Four bodies in a row move along x and turn about x. The drive shakes body 1; the strain-gauged
//! shaft (spring and damper) joins it to body 2; the joint sits between bodies 2 and 3; another
//! spring and damper join bodies 3 and 4; body 4 is held to ground. The log holds what the shaft
//! exerts on body 2, so the restoring force is inertia·acceleration − force and no spring
//! constant has to be known.

mod excitation;
mod files;
mod hidden;
mod integrate;
mod joint;
mod motion;
pub mod refine;
pub mod respond;
mod rig;
mod sensors;
mod simulation;
mod truth;

pub use excitation::Excitation;
pub use files::write_study;
pub use hidden::{Hidden, HiddenJoint, Hide};
pub use integrate::{Equations, advance};
pub use joint::{Contact, Joint, JointLaw};
pub use motion::{Bodies, BodyState, DRIVE_RAMP_S, joint_state};
pub use rig::{AxisParameters, RigParameters};
pub use sensors::{COLUMNS, ENCODER_STEP};
pub(crate) use simulation::SUBSTEPS;
pub use simulation::{Simulation, SimulationOptions, record_drives, simulate};
pub use truth::Truth;
