//! A fixed rig and a fixed motion for the self-test: the whole on-board chain, from counts to
//! residuals, as one digest; and chain and monitor together, sample by sample, so that their
//! instructions can be counted.

use crate::base::Model;
use crate::base::hum::Hum;
use crate::base::kernels::{Kernels, Portable};
use crate::chain::{Chain, ChainState, RawSample};
use crate::fault::Error;
use crate::monitor::limits::{AxisLimits, Cusum, Limits, TwoSided};
use crate::monitor::{Faults, Monitor, MonitorState, Verdict};
use crate::selftest::{Digest, Points, reference_model};
use crate::wire::rig::{ChannelDelays, Rig, RigAxis, Taps};
use crate::wire::wiring::{AxisWiring, Signed, SignedDirection, Wiring};
use heapless::Vec;

/// Taps of the derivatives of the reference rig: five-point formulas at 32 Hz, times 2²⁵ and 2¹⁹.
/// The reference model's ranges are ±1 in displacement and velocity alike, so the rig is a slow
/// one.
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

/// Lengths of derivatives and low-pass of the digest's rig.
pub const SHORT_TAPS: [usize; 2] = [VELOCITY.len(), BAND.len()];

/// Binary logarithm of the samples from one residual in the band to the next: what the host chooses
/// for that rig.
const BAND_EVERY_LOG2: u8 = 2;

/// Lengths of derivatives and low-pass of a rig that is sampled at 1 kHz and judged up to 70 Hz.
pub const USUAL_TAPS: [usize; 2] = [41, 129];

/// The taps with as many zeros on both sides as make `length`, at most 129 or 257, as many as the
/// filter in question holds.
fn taps<const MOST: usize>(taps: &[i32], shift: i8, length: usize) -> Taps<MOST> {
    let mut all = Vec::new();
    let zeros = length.saturating_sub(taps.len()) / 2;
    let zeros = || core::iter::repeat_n(0, zeros);
    for tap in zeros().chain(taps.iter().copied()).chain(zeros()) {
        // Lengths are constants of this file and fit.
        let _ = all.push(tap);
    }
    Taps { taps: all, shift }
}

/// A rig that the reference models fit, with every path of the chain in use: x with an
/// accelerometer, phi with a derived acceleration, both held to ground, with mains hum in either
/// force. The lengths of its derivatives and of its low-pass are odd and at most 129 and 257.
///
/// # Errors
/// None; the type is that of the calls it makes.
pub fn reference_rig([derivative, band]: [usize; 2]) -> Result<Rig, Error> {
    let axis = RigAxis {
        displacement_step: 1.0 / 3200.0,
        body_step: 1.0 / 3200.0,
        acceleration_step: 1e-4,
        force_step: 3e3,
        input_step: 0.0,
        input_zero: 0.0,
        inertia: 1e8,
        inertia_minus_force: true,
        ground_stiffness: 8e7,
        ground_damping: 5e7,
        force_cross: 0.25,
        force_delay_samples: 0.75,
        delays: ChannelDelays::default(),
        hum: Hum {
            frequency_hz: 3.7,
            amplitude: 5e7,
        },
    };
    let mut axes = Vec::new();
    let derived = RigAxis {
        acceleration_step: 0.0,
        hum: Hum {
            frequency_hz: 9.1,
            amplitude: 2e7,
        },
        ..axis.clone()
    };
    // The list holds two.
    let _ = axes.push(axis);
    let _ = axes.push(derived);
    let rig = Rig {
        model_checksum: 0,
        sample_rate_hz: 32.0,
        wiring: reference_wiring(),
        axes,
        velocity: taps(&VELOCITY, 25, derivative),
        acceleration: taps(&ACCELERATION, 19, derivative),
        band: taps(&BAND, 30, band),
        band_every_log2: BAND_EVERY_LOG2,
        limits: None,
    };
    rig.check().map(|()| rig)
}

/// Two counters and a bridge channel an axis, the nearer counter on the body, and an accelerometer
/// on x.
fn reference_wiring() -> Wiring {
    let mut wiring = Wiring::unconfigured();
    for number in 0..2 {
        let channel = |place| Signed {
            place,
            negative: false,
        };
        let accelerometer = SignedDirection {
            chip: 0,
            direction: 0,
            negative: false,
        };
        // The list holds two.
        let _ = wiring.axes.push(AxisWiring {
            far: channel(2 * number),
            near: Some(channel(2 * number + 1)),
            body: Some(channel(2 * number + 1)),
            force: channel(number),
            input: None,
            // That of phi is derived.
            acceleration: [(number == 0).then_some(accelerometer), None],
            pair_distance_m: 0.0,
        });
    }
    wiring
}

/// A motion in counts without a table or a float: every channel is an integer oscillator, kicked at
/// random.
struct Motion {
    points: Points,
    position: [i32; 4],
    velocity: [i32; 4],
}

impl Motion {
    fn new(seed: u64) -> Self {
        Self {
            points: Points::new(seed),
            position: [0; 4],
            velocity: [0; 4],
        }
    }

    fn next(&mut self) -> RawSample {
        // Symplectic Euler of a spring, in counts of 2⁻⁸; bounded because kicks are small and every
        // step is damped.
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

/// The digest of every output of the chain over `samples` samples of the fixed motion; 0 when
/// `model` does not fit the rig.
pub fn chain_digest(model: &Model, seed: u64, samples: u32) -> u64 {
    chain_digest_by::<Portable>(model, seed, samples)
}

/// [`chain_digest`] with a board's kernels.
pub fn chain_digest_by<K: Kernels>(model: &Model, seed: u64, samples: u32) -> u64 {
    match &reference_chain(model, SHORT_TAPS) {
        Ok(chain) => run::<K>(chain, model, seed, samples),
        Err(_) => 0,
    }
}

/// The chain of the reference rig. Kept apart from [`run`], so that the rig has left the stack
/// before the chain's state comes: the smallest microcontroller has 16 KiB.
#[inline(never)]
fn reference_chain(model: &Model, taps: [usize; 2]) -> Result<Chain, Error> {
    reference_rig(taps).and_then(|rig| Chain::new(model, &rig))
}

/// A rig with filters of the usual length and forces of the model's size, with mains hum in them or
/// without, and limits under which every statistic is judged.
///
/// # Errors
/// As [`reference_rig`].
#[inline(never)]
pub fn usual_rig(model: &Model, humming: bool) -> Result<Rig, Error> {
    let mut rig = reference_rig(USUAL_TAPS)?;
    let forces = model.outputs().iter().zip(reference_model().outputs());
    for (axis, (output, reference)) in rig.axes.iter_mut().zip(forces) {
        let larger = output.force_per_lsb / reference.force_per_lsb;
        for force in [
            &mut axis.force_step,
            &mut axis.inertia,
            &mut axis.ground_stiffness,
            &mut axis.ground_damping,
            &mut axis.hum.amplitude,
        ] {
            *force *= larger;
        }
        if !humming {
            axis.hum = Hum::NONE;
        }
    }
    rig.limits = Some(limits(model.axes()));
    Ok(rig)
}

/// The chain of [`usual_rig`].
#[inline(never)]
fn usual_chain(model: &Model, humming: bool) -> Result<Chain, Error> {
    usual_rig(model, humming).and_then(|rig| Chain::new(model, &rig))
}

#[inline(never)]
fn run<K: Kernels>(chain: &Chain, model: &Model, seed: u64, samples: u32) -> u64 {
    let mut motion = Motion::new(seed);
    let mut state = ChainState::default();
    let mut digest = Digest::new();
    for _ in 0..samples {
        if let Some(output) = chain.step_by::<K>(&mut state, model, &motion.next()) {
            output.words().for_each(|word| digest.add(word));
        }
    }
    digest.value()
}

/// Chain and monitor as a board runs them: every sample of the fixed motion through filters of the
/// usual length.
pub struct Watched<'a> {
    chain: Chain,
    model: &'a Model,
    monitor: Monitor,
    state: ChainState,
    watch: MonitorState,
    motion: Motion,
}

impl<'a> Watched<'a> {
    /// Sets both up for a model, whose forces the rig's are made to resemble, with mains hum in
    /// either force channel where it is `humming`; none when it does not fit the rig all the
    /// same.
    pub fn new(model: &'a Model, seed: u64, humming: bool) -> Option<Self> {
        let chain = usual_chain(model, humming).ok()?;
        let monitor = Monitor::new(limits(model.axes()), &chain).ok()?;
        Some(Self {
            chain,
            model,
            monitor,
            state: ChainState::default(),
            watch: MonitorState::default(),
            motion: Motion::new(seed),
        })
    }

    /// What the sensors give next: an eighth of the fixed motion, which stays inside the range, so
    /// that every residual counts.
    pub fn counts(&mut self) -> RawSample {
        let mut sample = self.motion.next();
        for raw in &mut sample {
            raw.displacement = raw.displacement.map(|d| d.wrapping_sub(i32::MAX) >> 3);
        }
        sample
    }

    /// Whether the next sample does a step of the end of a block of the monitor, and how many
    /// blocks of residuals were filled.
    pub fn blocks(&self) -> (bool, [u32; 2]) {
        let ((fine, _), (gross, ..)) = (self.watch.last_block(), self.watch.last_gross_block());
        (self.watch.is_ending(), [fine, gross])
    }

    /// One sample through chain, model and monitor.
    pub fn step<K: Kernels>(&mut self, raw: &RawSample) -> Verdict {
        let output = self.chain.step_by::<K>(&mut self.state, self.model, raw);
        let well = Faults::default();
        self.monitor
            .update(&mut self.watch, raw, output.as_ref(), &well)
    }
}

/// Limits under which every statistic is judged.
fn limits(axes: usize) -> Limits {
    let side = Cusum {
        drift: 0,
        threshold: 1 << 20,
    };
    let both = TwoSided {
        more: side,
        less: side,
    };
    let axis = AxisLimits {
        reversed: false,
        force_shift: 12,
        force_power: 1,
        state_power: [1; 2],
        per_octave: [1; 3],
        error: side,
        stiffness: both,
        friction: both,
        gross: [0; 2],
        moving_counts: [1, 1, 1, 1, 1, 0],
    };
    Limits {
        model_checksum: 0,
        block: 64,
        outside_permille: 1000,
        false_alarm_hours: 1,
        axes: core::iter::repeat_n(axis, axes.min(2)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Made by this test; they change only when a bit of the chain, the motion or the reference
    /// model changes. The second is of a chain that gives a residual in the band at every
    /// sample.
    const GOLDEN: [u64; 2] = [0xdfc2_ceb5_bd44_a7b1, 0xbe61_5064_fea3_8ed0];

    #[test]
    fn the_fixed_motion_exercises_the_chain_and_keeps_its_digest() {
        let model = reference_model();
        let chain = Chain::new(model, &reference_rig(SHORT_TAPS).unwrap()).unwrap();
        let mut motion = Motion::new(1);
        let mut state = ChainState::default();
        let (mut outputs, mut outside, mut at_rest) = (0, 0, 0);
        for _ in 0..20_000 {
            if let Some(output) = chain.step(&mut state, model, &motion.next()) {
                outputs += 1;
                outside += i32::from(output.outside != 0);
                at_rest += i32::from(output.measured.contains(&0));
            }
        }
        // Mostly inside the range, sometimes out of it: a digest of saturated numbers would prove
        // little.
        let percent = 100 * outside / outputs;
        assert!((1..60).contains(&percent), "{percent} % outside");
        assert!(at_rest < 10, "{at_rest} forces are zero");
        // The monitor behind it fills blocks and comes to a verdict.
        let mut watched = Watched::new(model, 1, true).unwrap();
        for _ in 0..5000 {
            let raw = watched.counts();
            watched.step::<Portable>(&raw);
        }
        let (blocks, sums) = watched.watch.last_block();
        assert!(blocks > 5, "{blocks} blocks");
        assert!(sums.iter().all(|sums| sums.error > 0 && sums.force > 0));
        let mut rig = reference_rig(SHORT_TAPS).unwrap();
        rig.band_every_log2 = 0;
        let chain = Chain::new(model, &rig).unwrap();
        let digests = [
            chain_digest(model, 1, 20_000),
            run::<Portable>(&chain, model, 1, 20_000),
        ];
        assert_eq!(digests, GOLDEN, "digests are {digests:#018x?}");
    }
}
