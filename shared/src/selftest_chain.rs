//! A fixed rig and a fixed motion for the self-test: the whole on-board chain, from counts to residuals, as one digest.

use crate::error::Error;
use crate::model::Model;
use crate::pipeline::{Chain, ChainState, RawSample};
use crate::rig::{ChannelDelays, Rig, RigAxis, Taps};
use crate::selftest::{Digest, Points};
use heapless::Vec;

/// Taps of the derivatives of the reference rig: five-point formulas at 32 Hz, times 2²⁵ and 2¹⁹. The reference model's
/// ranges are ±1 in displacement and velocity alike, so the rig is a slow one.
const VELOCITY: [i32; 5] = [-89_478_485, 715_827_883, 0, -715_827_883, 89_478_485];
const ACCELERATION: [i32; 5] = [
    -44_739_243,
    715_827_883,
    -1_342_177_280,
    715_827_883,
    -44_739_243,
];
/// Taps of its low-pass, times 2³⁰: a triangle of nine.
const BAND: [i32; 9] = {
    let unit = (1 << 30) / 25;
    [
        unit,
        2 * unit,
        3 * unit,
        4 * unit,
        5 * unit,
        4 * unit,
        3 * unit,
        2 * unit,
        unit,
    ]
};

/// At most 129 or 257 of them, as many as the filter in question holds.
fn taps<const MOST: usize>(taps: &[i32], shift: i8) -> Taps<MOST> {
    Taps {
        taps: Vec::from_slice(taps).unwrap_or_default(),
        shift,
    }
}

/// A rig with every path of the chain in use: x with an accelerometer, phi with a derived acceleration, both held to ground.
///
/// # Errors
/// None; the type is that of the calls it makes.
fn reference_rig() -> Result<Rig, Error> {
    let axis = RigAxis {
        displacement_step: 1.0 / 3200.0,
        displacement_difference: true,
        body_step: 1.0 / 3200.0,
        acceleration_step: 1e-4,
        force_step: 3e3,
        inertia: 1e8,
        inertia_minus_force: true,
        ground_stiffness: 8e7,
        ground_damping: 5e7,
        force_cross: 0.25,
        force_delay_samples: 0.75,
        delays: ChannelDelays::default(),
    };
    let mut axes = Vec::new();
    let derived = RigAxis {
        acceleration_step: 0.0,
        ..axis.clone()
    };
    // The list holds two.
    let _ = axes.push(axis);
    let _ = axes.push(derived);
    let rig = Rig {
        sample_rate_hz: 32.0,
        axes,
        velocity: taps(&VELOCITY, 25),
        acceleration: taps(&ACCELERATION, 19),
        band: taps(&BAND, 30),
    };
    rig.check().map(|()| rig)
}

/// A motion in counts without a table or a float: every channel is an integer oscillator, kicked at random.
struct Motion {
    points: Points,
    position: [i32; 4],
    velocity: [i32; 4],
}

impl Motion {
    fn next(&mut self) -> RawSample {
        // Symplectic Euler of a spring, in counts of 2⁻⁸; bounded because kicks are small and every step is damped.
        for ((position, velocity), tone) in
            self.position.iter_mut().zip(&mut self.velocity).zip(0..)
        {
            let kick = self.points.next_word() >> 21;
            *velocity = *velocity - (*velocity >> 6) - (*position >> (7 + tone)) + kick;
            *position += *velocity;
        }
        let [a, b, c, d] = self.position.map(|position| position >> 6);
        let mut sample = RawSample::default();
        let [x, phi] = &mut sample;
        for (raw, [far, near]) in [(x, [a, b]), (phi, [c, d])] {
            // The counters stand close to their wrap.
            raw.displacement = [i32::MAX.wrapping_add(far), i32::MAX.wrapping_add(near)];
            raw.body = near;
            raw.acceleration = far.wrapping_mul(37);
            raw.force = near.wrapping_mul(101);
        }
        sample
    }
}

/// The digest of every output of the chain over `samples` samples of the fixed motion; 0 when `model` does not fit the rig.
pub fn chain_digest(model: &Model, seed: u64, samples: u32) -> u64 {
    reference_chain(model).map_or(0, |chain| run(&chain, model, seed, samples))
}

/// The chain of the reference rig. Kept apart from [`run`], so that the rig has left the stack before the chain's state
/// comes: the smallest microcontroller has 16 KiB.
#[inline(never)]
fn reference_chain(model: &Model) -> Result<Chain, Error> {
    reference_rig().and_then(|rig| Chain::new(model, &rig))
}

#[inline(never)]
fn run(chain: &Chain, model: &Model, seed: u64, samples: u32) -> u64 {
    let mut motion = Motion {
        points: Points::new(seed),
        position: [0; 4],
        velocity: [0; 4],
    };
    let mut state = ChainState::default();
    let mut digest = Digest::new();
    for _ in 0..samples {
        if let Some(output) = chain.step(&mut state, model, &motion.next()) {
            output.words().for_each(|word| digest.add(word));
        }
    }
    digest.value()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::selftest::reference_model;

    /// Made by this test; it changes only when a bit of the chain, the motion or the reference model changes.
    const GOLDEN: u64 = 0xb9cf_cde2_7294_ec29;

    #[test]
    fn the_fixed_motion_exercises_the_chain_and_keeps_its_digest() {
        let model = reference_model();
        let chain = Chain::new(model, &reference_rig().unwrap()).unwrap();
        let mut motion = Motion {
            points: Points::new(1),
            position: [0; 4],
            velocity: [0; 4],
        };
        let mut state = ChainState::default();
        let (mut outputs, mut outside, mut at_rest) = (0, 0, 0);
        for _ in 0..20_000 {
            if let Some(output) = chain.step(&mut state, model, &motion.next()) {
                outputs += 1;
                outside += i32::from(output.outside != 0);
                at_rest += i32::from(output.measured.contains(&0));
            }
        }
        // Mostly inside the range, sometimes out of it: a digest of saturated numbers would prove little.
        let percent = 100 * outside / outputs;
        assert!((1..60).contains(&percent), "{percent} % outside");
        assert!(at_rest < 10, "{at_rest} forces are zero");
        let digest = chain_digest(model, 1, 20_000);
        assert_eq!(digest, GOLDEN, "digest is {digest:#018x}");
    }
}
