//! A monitor that watches two simulated axes sample by sample.

use jointwatch_shared::chain::{Chain, Output, RawAxis, RawSample};
use jointwatch_shared::monitor::limits::{AxisLimits, CHANNELS, Cusum, Limits, TwoSided};
use jointwatch_shared::monitor::{
    AxisHealth, Cause, Faults, Monitor, MonitorState, OCTAVE, RECENT, SHARE, State, Verdict,
};
use jointwatch_shared::selftest::chain::{SHORT_TAPS, reference_rig};
use jointwatch_shared::selftest::reference_model;
use std::collections::VecDeque;

/// Samples per second, as far as these tests are concerned.
pub(crate) const RATE_HZ: f64 = 1000.0;
/// Amplitude of the usual force, in the model's units, and of the usual motion, in Q31.
const FORCE: f64 = 1e8;
const MOTION: f64 = 1e9;
/// The model's error, as a part of the force.
const ERROR: f64 = 0.1;

/// The monitor, every how many samples a residual in the band comes, and how much older than the
/// rest of an output it is, s.
fn monitor() -> (Monitor, u32, f64) {
    let cusum = |drift, threshold| Cusum { drift, threshold };
    // What a tenth of the force shifts a share by is a twentieth; an alarm takes six blocks at
    // least.
    let side = cusum(SHARE / 60, SHARE / 4);
    let both = TwoSided {
        more: side,
        less: side,
    };
    let unit = 2_f64.powi(11);
    let half = 2_f64.powi(16);
    let axis = AxisLimits {
        reversed: false,
        force_shift: 11,
        force_power: (FORCE * FORCE / 2.0 / unit / unit) as u64,
        state_power: [(MOTION * MOTION / 2.0 / half / half) as u64; 2],
        per_octave: [0; 3],
        error: cusum(-5 * OCTAVE, 24 * OCTAVE),
        stiffness: both,
        friction: both,
        gross: [0; 2],
        moving_counts: [0; CHANNELS],
    };
    let limits = Limits {
        model_checksum: 0,
        block: 64,
        outside_permille: 200,
        false_alarm_hours: 720,
        axes: [axis.clone(), axis].into_iter().collect(),
    };
    let chain = chain();
    let wait = chain.band_delay() - chain.delay();
    let monitor = Monitor::new(limits, &chain).expect("usable limits");
    (monitor, chain.band_every() as u32, wait as f64 / RATE_HZ)
}

pub(crate) fn chain() -> Chain {
    let rig = reference_rig(SHORT_TAPS).expect("a sound rig");
    Chain::new(reference_model(), &rig).expect("a rig that fits")
}

/// How an axis is at one time.
#[derive(Clone, Copy)]
pub(crate) struct Joint {
    /// What the measured force is of the healthy one's.
    pub(crate) force: f64,
    /// What the motion is of the usual one.
    pub(crate) motion: f64,
    /// Force that is there whatever the motion, of the usual one.
    pub(crate) besides: f64,
}

pub(crate) const WELL: Joint = Joint {
    force: 1.0,
    motion: 1.0,
    besides: 0.0,
};
pub(crate) const GONE: Joint = Joint { force: 0.0, ..WELL };
pub(crate) const RESTING: Joint = Joint {
    motion: 0.0,
    ..WELL
};
pub(crate) const SEIZED: Joint = Joint {
    motion: 0.02,
    besides: 1.2,
    ..WELL
};

/// What an axis measures and what the model expects at a time, and its states.
fn forces(at_s: f64, axis: usize, joint: &Joint) -> ([f64; 2], [i32; 2]) {
    let turns = std::f64::consts::TAU * (7.0 + axis as f64) * at_s;
    let (sin, cos) = turns.sin_cos();
    let states = [sin, cos].map(|part| (joint.motion * MOTION * part) as i32);
    let expected = joint.motion * FORCE * (0.8 * sin + 0.6 * cos);
    // An error of another frequency goes with neither displacement nor velocity for long.
    let error = joint.motion * ERROR * FORCE * (2.3 * turns).sin();
    let measured = joint.force * (expected + error) + joint.besides * FORCE * sin;
    ([measured, expected], states)
}

/// The output at a time, with a residual in the band of `wait_s` before where `in_band`.
fn output(at_s: f64, wait_s: f64, in_band: bool, joints: [Joint; 2], outside: u8) -> Output {
    let mut output = Output {
        outside,
        ..Output::default()
    };
    let mut residual = [0; 2];
    for (axis, joint) in joints.iter().enumerate() {
        let ([measured, expected], states) = forces(at_s, axis, joint);
        [output.state[2 * axis], output.state[2 * axis + 1]] = states;
        output.predicted[axis] = expected as i32;
        output.measured[axis] = measured as i32;
        output.residual[axis] = (measured - expected) as i32;
        let ([measured, expected], _) = forces(at_s - wait_s, axis, joint);
        residual[axis] = (measured - expected) as i32;
    }
    output.residual_band = in_band.then_some(residual);
    output
}

/// Something that watches a joint sample by sample.
pub(crate) struct Watched {
    pub(crate) monitor: Monitor,
    pub(crate) every: u32,
    pub(crate) wait_s: f64,
    pub(crate) state: MonitorState,
    /// Samples so far, and those among them that were not lost.
    pub(crate) rows: u32,
    pub(crate) taken: u32,
    /// When the samples of the recent time came.
    pub(crate) recent: VecDeque<u32>,
    /// Every change of each axis's verdict, with its time in s.
    pub(crate) seen: [Vec<(f64, Verdict)>; 2],
    /// The counts of a row.
    pub(crate) raw: fn(u32) -> RawSample,
}

impl Watched {
    pub(crate) fn new() -> Self {
        let (monitor, every, wait_s) = monitor();
        Self {
            monitor,
            every,
            wait_s,
            state: MonitorState::default(),
            rows: 0,
            taken: 0,
            recent: VecDeque::new(),
            seen: Default::default(),
            raw: |_| [RawAxis::default(); 2],
        }
    }

    /// With channels that move by so many counts or more when they move.
    pub(crate) fn with_channels(raw: fn(u32) -> RawSample) -> Self {
        let watched = Self::new();
        let mut limits = watched.monitor.limits().clone();
        for axis in &mut limits.axes {
            axis.moving_counts = [100, 100, 100, 100, 100, 0];
        }
        Self {
            monitor: Monitor::new(limits, &chain()).expect("usable limits"),
            raw,
            ..watched
        }
    }

    pub(crate) fn time_s(&self) -> f64 {
        f64::from(self.rows) / RATE_HZ
    }

    pub(crate) fn sample(&mut self, joints: [Joint; 2], outside: u8, lost: u32) {
        self.rows += 1 + lost;
        let faults = Faults {
            lost,
            missing: if lost > 0 { 0xFFF } else { 0 },
            ..Faults::default()
        };
        // The chain counts the samples that it gets.
        self.taken += 1;
        let in_band = self.taken.is_multiple_of(self.every);
        let output = output(self.time_s(), self.wait_s, in_band, joints, outside);
        let raw = (self.raw)(self.rows);
        let state = &mut self.state;
        self.monitor.update(state, &raw, Some(&output), &faults);
        let time = self.time_s();
        let received = self.received();
        for (axis, seen) in self.seen.iter_mut().enumerate() {
            let AxisHealth {
                verdict,
                judged_permille,
                ..
            } = self.state.axis(&self.monitor, axis);
            if verdict.state == State::Healthy {
                // Whatever is lost, and however: healthy says that a fifth of the recent time was
                // judged, of samples that came.
                assert!(judged_permille >= 195, "{judged_permille} at {time} s");
                assert!(received >= 0.19, "{received} received at {time} s");
            }
            if !seen.last().is_some_and(|(_, v)| v.same_reason(&verdict)) {
                seen.push((time, verdict));
            }
        }
    }

    /// The part of the recent time's samples that came.
    fn received(&mut self) -> f64 {
        let span = RECENT * u32::from(self.monitor.limits().block);
        self.recent.push_back(self.rows);
        while self
            .recent
            .front()
            .is_some_and(|&row| row + span <= self.rows)
        {
            self.recent.pop_front();
        }
        self.recent.len() as f64 / f64::from(span.min(self.rows))
    }

    pub(crate) fn run(&mut self, seconds: f64, joints: [Joint; 2], outside: u8) {
        for _ in 0..(seconds * RATE_HZ) as usize {
            self.sample(joints, outside, 0);
        }
    }

    pub(crate) fn axis(&self, axis: usize) -> AxisHealth {
        self.state.axis(&self.monitor, axis)
    }

    pub(crate) fn first(&self, axis: usize, state: State) -> Option<(f64, Cause)> {
        let found = self.seen[axis].iter().find(|(_, v)| v.state == state);
        found.map(|(time, v)| (*time, v.cause))
    }
}
