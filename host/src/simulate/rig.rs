//! The rig's parameters: a fixed, documented rig, and plausible variations of it.

use super::joint::Joint;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// One axis of the rig outside the joint: four bodies, the springs and dampers between them, the
/// drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisParameters {
    /// Bodies 1 to 4, kg or kg·m².
    pub inertia: [f64; 4],
    /// The strain-gauged shaft between bodies 1 and 2, N/m or N·m/rad.
    pub shaft_stiffness: f64,
    /// Its damping, N·s/m or N·m·s/rad.
    pub shaft_damping: f64,
    /// The elastic element between bodies 3 and 4, N/m or N·m/rad.
    pub far_stiffness: f64,
    /// Its damping, N·s/m or N·m·s/rad.
    pub far_damping: f64,
    /// What holds body 4 to ground, N/m or N·m/rad.
    pub ground_stiffness: f64,
    /// Its damping, N·s/m or N·m·s/rad.
    pub ground_damping: f64,
    /// Root mean square of the drive on body 1 at level 1, N or N·m.
    pub drive_rms: f64,
}

/// The whole rig, in SI units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RigParameters {
    /// The axis along x.
    pub translation: AxisParameters,
    /// The axis about x.
    pub rotation: AxisParameters,
    /// Between bodies 2 and 3.
    pub joint: Joint,
}

impl Default for RigParameters {
    /// A bench-top rig of some kilogrammes.
    ///
    /// The paper gives no values ("available in \[31\]"). These put the first modes of each axis
    /// near 7 and 35 Hz, let the joint move a few millimetres (some hundredths of a radian)
    /// either way, a few times its free play, and make the coupling about a tenth of the
    /// restoring force.
    fn default() -> Self {
        Self {
            translation: AxisParameters {
                inertia: [2.0, 1.8, 1.6, 3.0],
                shaft_stiffness: 45_000.0,
                shaft_damping: 12.0,
                far_stiffness: 120_000.0,
                far_damping: 40.0,
                ground_stiffness: 60_000.0,
                ground_damping: 120.0,
                drive_rms: 32.0,
            },
            rotation: AxisParameters {
                inertia: [0.0034, 0.0030, 0.0028, 0.0055],
                shaft_stiffness: 75.0,
                shaft_damping: 0.02,
                far_stiffness: 200.0,
                far_damping: 0.06,
                ground_stiffness: 100.0,
                ground_damping: 0.2,
                drive_rms: 1.4,
            },
            joint: Joint {
                stiffness: [1_500.0, 3.0],
                damping: [50.0, 0.06],
                clearance: [0.0015, 0.035],
                contact_stiffness: [14_000.0, 20.0],
                coupling: [600.0, 600.0],
                lever_arm_m: 0.03,
            },
        }
    }
}

impl RigParameters {
    /// A rig of the same kind with other values: every parameter of [`RigParameters::default`] is
    /// multiplied by a factor drawn log-uniformly, inertias from 0.8 to 1.25, drives from 0.85 to
    /// 1.18, stiffnesses and dampers from 0.7 to 1.43, clearances from 0.6 to 1.67, coupling
    /// and lever arm from 0.5 to 2.
    pub fn draw(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut rig = Self::default();
        let mut vary = |value: &mut f64, spread: f64| {
            *value *= spread.powf(rng.random_range(-1.0..1.0));
        };
        for axis in [&mut rig.translation, &mut rig.rotation] {
            for inertia in &mut axis.inertia {
                vary(inertia, 1.25);
            }
            for value in [
                &mut axis.shaft_stiffness,
                &mut axis.shaft_damping,
                &mut axis.far_stiffness,
                &mut axis.far_damping,
                &mut axis.ground_stiffness,
                &mut axis.ground_damping,
            ] {
                vary(value, 1.43);
            }
            vary(&mut axis.drive_rms, 1.18);
        }
        for i in 0..2 {
            vary(&mut rig.joint.stiffness[i], 1.43);
            vary(&mut rig.joint.damping[i], 1.43);
            vary(&mut rig.joint.contact_stiffness[i], 1.43);
            vary(&mut rig.joint.clearance[i], 1.67);
            vary(&mut rig.joint.coupling[i], 2.0);
        }
        vary(&mut rig.joint.lever_arm_m, 2.0);
        rig
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_differ_and_repeat() {
        assert_eq!(RigParameters::draw(5), RigParameters::draw(5));
        assert_ne!(RigParameters::draw(5), RigParameters::draw(6));
        let ratio =
            RigParameters::draw(5).joint.clearance[0] / RigParameters::default().joint.clearance[0];
        assert!((0.59..1.68).contains(&ratio));
    }
}
