//! The on-board chain against the same chain written down in `f64`, and against inputs no sensor
//! should give.

mod formula;
mod late;

use heapless::Vec as Bounded;
use jointwatch_shared::base::axis::{Axis, AxisKind, Convention, InputRange, Name};
use jointwatch_shared::base::hum::Hum;
use jointwatch_shared::base::{Header, Model};
use jointwatch_shared::chain::{Chain, ChainState, Output, RawSample};
use jointwatch_shared::selftest::Points;
use jointwatch_shared::wire::rig::{ChannelDelays, Rig, RigAxis, Taps};
use jointwatch_shared::wire::wiring::{AxisWiring, Signed, SignedDirection, Wiring};

const RATE: f64 = 2000.0;
const SEED: u64 = 20_071;

/// Antisymmetric or symmetric taps from their first half and middle, scaled to whole numbers.
fn taps<const MOST: usize>(half: &[f64], middle: f64, mirrored: f64, shift: i8) -> Taps<MOST> {
    let scale = 2_f64.powi(shift.into());
    let first: Vec<i32> = half.iter().map(|t| (t * scale).round() as i32).collect();
    let last = first.iter().rev().map(|t| (*t as f64 * mirrored) as i32);
    let all: Vec<i32> = first
        .iter()
        .copied()
        .chain([(middle * scale).round() as i32])
        .chain(last)
        .collect();
    Taps {
        taps: Bounded::from_slice(&all).unwrap(),
        shift,
    }
}

fn rig(acceleration_step: f64, body_step: f64, ground: [f64; 2], convention: bool) -> Rig {
    // Five-point derivatives; the newest sample comes first.
    let velocity = taps(&[-RATE / 12.0, 8.0 * RATE / 12.0], 0.0, -1.0, 18);
    let second = [-RATE * RATE / 12.0, 16.0 * RATE * RATE / 12.0];
    let acceleration = taps(&second, -2.0 * (second[0] + second[1]), 1.0, 6);
    let band = taps(&[0.1, 0.2], 0.4, 1.0, 28);
    let axis = |step: f64, force_step: f64, inertia: f64| RigAxis {
        displacement_step: step,
        body_step,
        acceleration_step,
        force_step,
        input_step: 0.0,
        input_zero: 0.0,
        inertia,
        inertia_minus_force: convention,
        ground_stiffness: ground[0],
        ground_damping: ground[1],
        force_cross: 0.0,
        force_delay_samples: 0.0,
        delays: ChannelDelays::default(),
        hum: Hum::NONE,
    };
    let mut axes = Bounded::new();
    axes.push(axis(2e-6, 1e-5, 0.6)).unwrap();
    axes.push(axis(2.4e-5, 1e-7, 0.003)).unwrap();
    let counter = |place| Signed {
        place,
        negative: false,
    };
    let direction = SignedDirection {
        chip: 0,
        direction: 0,
        negative: false,
    };
    let wired = |n: u8| AxisWiring {
        far: counter(2 * n),
        near: Some(counter(2 * n + 1)),
        body: (body_step > 0.0).then(|| counter(2 * n + 1)),
        force: counter(n),
        input: None,
        acceleration: [(acceleration_step > 0.0).then_some(direction), None],
        pair_distance_m: 0.0,
    };
    Rig {
        model_checksum: 0,
        sample_rate_hz: RATE,
        wiring: Wiring {
            axes: (0..2).map(wired).collect(),
            ..Wiring::unconfigured()
        },
        axes,
        velocity,
        acceleration,
        band,
        band_every_log2: 0,
        limits: None,
    }
}

fn model() -> Model {
    let axis = |at: u8, name: &str, x: f64, v: f64| Axis {
        name: Name::new(at, name).unwrap(),
        kind: AxisKind::Translation,
        convention: Convention::InertiaMinusForce,
        inertia: 1.7,
        displacement: InputRange {
            center: 0.07 * x,
            half_range: x,
        },
        velocity: InputRange {
            center: -0.02 * v,
            half_range: v,
        },
        input: None,
        validation: None,
    };
    let mut axes = Bounded::new();
    axes.push(axis(0, "x", 1e-3, 0.2)).unwrap();
    axes.push(axis(1, "phi", 2e-2, 3.0)).unwrap();
    let header = Header {
        sample_rate_hz: RATE,
        band_hz: 120.0,
        state_band_hz: 400.0,
        axes,
    };
    let mut points = Points::new(SEED);
    let mut coefficients = || -> Vec<f64> {
        (0..256)
            .map(|_| f64::from(points.next_word()) / 2e9)
            .collect()
    };
    let (first, second) = (coefficients(), coefficients());
    Model::from_polynomial(header, &[3; 4], &[&first, &second], &[f64::INFINITY; 2]).unwrap()
}

/// A smooth motion in counts: sums of sines, the second axis slower.
fn motion(rows: usize, offset: i32) -> Vec<RawSample> {
    late_motion(rows, offset, ChannelDelays::default())
}

/// The same, seen by channels that are late by so many samples.
fn late_motion(rows: usize, offset: i32, late: ChannelDelays) -> Vec<RawSample> {
    (0..rows)
        .map(|n| {
            let wave_at = |late: f64, a: f64, f: f64, p: f64| {
                let t = (n as f64 - late) / RATE;
                (a * (f * t * std::f64::consts::TAU + p).sin()).round() as i32
            };
            let wave = |a: f64, f: f64, p: f64| wave_at(0.0, a, f, p);
            let mut sample = RawSample::default();
            for (axis, raw) in sample.iter_mut().enumerate() {
                let slow = 1.0 / (1.0 + axis as f64);
                let moved = |a, f, p| wave_at(late.displacement, a, f, p);
                let near = moved(900.0, 3.0 * slow, 0.3);
                let relative = moved(380.0, 27.0 * slow, 0.1) + moved(120.0, 61.0 * slow, 1.0);
                raw.displacement = [
                    near.wrapping_add(relative).wrapping_add(offset),
                    near.wrapping_add(offset),
                ];
                raw.body = wave_at(late.body, 900.0, 3.0 * slow, 0.3);
                raw.acceleration = wave_at(late.acceleration, 4e5, 27.0 * slow, 0.4);
                raw.force = wave(2e6, 41.0 * slow, 0.9);
            }
            sample
        })
        .collect()
}

fn run(chain: &Chain, model: &Model, samples: &[RawSample]) -> Vec<Output> {
    let mut state = ChainState::default();
    samples
        .iter()
        .filter_map(|raw| chain.step(&mut state, model, raw))
        .collect()
}

#[test]
fn counts_that_no_sensor_should_give_are_flagged_and_never_overflow() {
    println!("seed {SEED}");
    let model = model();
    let mut at_lower_rail = 0;
    for rig in [
        rig(4e-5, 2e-6, [350.0, 1.2], false),
        rig(0.0, 2e-6, [0.0, 0.7], true),
    ] {
        let chain = Chain::new(&model, &rig).unwrap();
        let mut points = Points::new(SEED);
        let rails = [i32::MIN, i32::MAX, 0, -1];
        let mut word = || {
            let word = points.next_word();
            if word & 1 == 0 {
                word
            } else {
                rails[(word >> 1 & 3) as usize]
            }
        };
        let samples: Vec<RawSample> = (0..20_000)
            .map(|_| {
                let mut sample = RawSample::default();
                for raw in &mut sample {
                    raw.displacement = [word(), word()];
                    raw.body = word();
                    raw.acceleration = word();
                    raw.force = word();
                }
                sample
            })
            .collect();
        let outputs = run(&chain, &model, &samples);
        assert!(
            outputs
                .iter()
                .all(|o| o.predicted == model.evaluate(&o.state))
        );
        assert!(outputs.iter().filter(|o| o.outside != 0).count() > 19_000);
        assert!(outputs.iter().any(|o| o.saturated != 0));
        for axis in [0, 1] {
            let outside = outputs.iter().filter(|o| o.outside >> (2 * axis) & 3 != 0);
            assert!(outside.count() > 19_000, "axis {axis}");
        }
        let at_rail = |value: i32| value == i32::MAX || value == i32::MIN;
        for o in &outputs {
            for axis in [0, 1] {
                let (measured, residual) = (o.measured[axis], o.residual[axis]);
                assert_eq!(residual, measured.saturating_sub(o.predicted[axis]));
                let flagged = o.saturated >> axis & 1 != 0;
                assert_eq!(flagged, at_rail(measured) || at_rail(residual), "{o:?}");
            }
        }
        let lower = |o: &&Output| o.measured.contains(&i32::MIN);
        at_lower_rail += outputs.iter().filter(lower).count();
    }
    assert!(at_lower_rail > 0);
}

#[test]
fn a_wrong_count_changes_as_many_outputs_as_the_chain_says() {
    let model = model();
    let chain = Chain::new(&model, &rig(4e-5, 2e-6, [350.0, 1.2], false)).unwrap();
    let sound = motion(400, 0);
    let mut wrong = sound.clone();
    wrong[200][0].displacement[0] += 5000;
    let (sound, wrong) = (run(&chain, &model, &sound), run(&chain, &model, &wrong));
    let first = 200 - (400 - sound.len());
    let differs = |n: &usize| {
        let said = |o: &Output| (o.state, o.measured, o.predicted);
        said(&sound[*n]) != said(&wrong[*n])
    };
    let last = (0..sound.len()).rfind(differs).expect("it changes some");
    let changed = last + 1 - first;
    let said = usize::from(chain.invalidated_by_fault());
    assert!(changed <= said && 2 * changed > said, "{changed}, {said}");
}

#[test]
fn mains_hum_is_not_followed_outside_the_range_nor_while_a_fault_is_in_the_filters() {
    let model = model();
    let plain = rig(4e-5, 2e-6, [0.0; 2], false);
    let mut humming = plain.clone();
    humming.axes[0].hum = Hum {
        frequency_hz: 50.0,
        amplitude: 4.0,
    };
    let chains = [&plain, &humming].map(|rig| Chain::new(&model, rig).unwrap());
    let measured = |offset: i32| {
        let samples = motion(3000, 0).into_iter().map(|mut raw| {
            raw[0].displacement[0] += offset;
            raw
        });
        let samples: Vec<RawSample> = samples.collect();
        chains.each_ref().map(|chain| run(chain, &model, &samples))
    };
    let [without, with] = measured(1 << 24);
    assert!(without.iter().all(|o| o.outside & 1 != 0));
    let same = |(a, b): (&Output, &Output)| a.measured == b.measured;
    assert!(without.iter().zip(&with).all(same));
    let [without, with] = measured(0);
    assert!(
        !without.iter().zip(&with).all(same),
        "it is followed inside"
    );
    // A fault: as many outputs as it takes, and no more, say that it is held.
    let mut state = ChainState::default();
    let held: Vec<bool> = motion(300, 0)
        .iter()
        .enumerate()
        .filter_map(|(n, raw)| {
            if n == 200 {
                state.hold_notches(7);
            }
            let output = chains[1].step(&mut state, &model, raw)?;
            Some(output.saturated & Output::HELD != 0)
        })
        .collect();
    assert_eq!(held.iter().filter(|held| **held).count(), 7);
}

#[test]
fn a_rig_that_does_not_fit_is_refused_with_the_quantity() {
    let model = model();
    let good = rig(4e-5, 2e-6, [0.0; 2], true);
    let refused = |change: &dyn Fn(&mut Rig)| {
        let mut rig = good.clone();
        change(&mut rig);
        Chain::new(&model, &rig).unwrap_err().to_string()
    };
    assert!(refused(&|r| r.axes.truncate(1)).contains("axes of the wiring"));
    let one_axis = |r: &mut Rig| {
        r.axes.truncate(1);
        r.wiring.axes.truncate(1);
    };
    assert!(refused(&one_axis).contains("axes of the rig"));
    assert!(refused(&|r| r.wiring.axes[0].body = None).contains("body step"));
    assert!(refused(&|r| r.axes[1].acceleration_step = 0.0).contains("acceleration step"));
    assert!(refused(&|r| r.band.taps.truncate(4)).contains("band filter"));
    assert!(refused(&|r| r.velocity.taps[0] += 1).contains("velocity filter"));
    assert!(refused(&|r| r.acceleration.taps[2] += 1).contains("acceleration filter"));
    assert!(refused(&|r| r.axes[0].displacement_step = 1e-3).contains("displacement"));
    assert!(refused(&|r| r.axes[0].force_delay_samples = 1.5).contains("delay of its channel"));
    assert!(refused(&|r| r.axes[0].delays.acceleration = 3.0).contains("delay of its channel"));
    assert!(refused(&|r| r.axes[0].delays.displacement = 2.1).contains("displacement delay"));
    assert!(refused(&|r| r.axes[1].delays.body = f64::NAN).contains("body delay"));
    assert!(refused(&|r| r.axes[0].force_cross = f64::NAN).contains("cross-talk"));
    assert!(refused(&|r| r.axes[1].force_step = f64::NAN).contains("force per count"));
    assert!(refused(&|r| r.axes[1].displacement_step = -1.0).contains("displacement step"));
    assert!(refused(&|r| r.sample_rate_hz = 0.0).contains("sample rate"));
}
