//! The on-board chain against the same chain written down in `f64`, and against inputs no sensor should give.

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

/// Force channels that are late, early, and hear each other.
fn wrong_channels() -> Rig {
    let mut rig = rig(4e-5, 0.0, [0.0; 2], true);
    rig.axes[0].force_cross = -12.0;
    rig.axes[0].force_delay_samples = 0.6;
    rig.axes[1].force_cross = 0.004;
    rig.axes[1].force_delay_samples = -0.3;
    rig
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

/// A force channel read as much later as it is late: the parabola's neighbour of third degree, by Neville's scheme.
fn force_between(samples: &[RawSample], n: usize, axis: usize, rig: &Rig) -> f64 {
    let a = &rig.axes[axis];
    let place = n as f64 + a.force_delay_samples;
    let first = place.floor() as usize - 1;
    let mut p: Vec<f64> = (first..first + 4)
        .map(|row| f64::from(samples[row.min(samples.len() - 1)][axis].force) * a.force_step)
        .collect();
    for order in 1..4 {
        for i in 0..4 - order {
            let t = (place - (first + i) as f64) / order as f64;
            p[i] += t * (p[i + 1] - p[i]);
        }
    }
    p[0]
}

/// The same in f64: states and measured force at row `n`.
fn reference(
    samples: &[RawSample],
    n: usize,
    axis: usize,
    rig: &Rig,
    model: &Model,
) -> ([f64; 2], f64) {
    let real = |taps: &Taps| -> Vec<f64> {
        taps.taps
            .iter()
            .map(|&t| f64::from(t) / 2_f64.powi(taps.shift.into()))
            .collect()
    };
    // Convolution around row n: taps[i] belongs to sample n + half − i.
    let convolve = |taps: &[f64], value: &dyn Fn(usize) -> f64| -> f64 {
        let half = taps.len() / 2;
        taps.iter()
            .enumerate()
            .map(|(i, tap)| tap * value(n + half - i))
            .sum()
    };
    let a = &rig.axes[axis];
    let relative = |n: usize| {
        let [first, second] = samples[n][axis].displacement;
        f64::from(first.wrapping_sub(second)) * a.displacement_step
    };
    let body = |n: usize| {
        if a.body_step > 0.0 {
            f64::from(samples[n][axis].body) * a.body_step
        } else {
            relative(n)
        }
    };
    let velocity = convolve(&real(&rig.velocity), &relative);
    let acceleration = if a.acceleration_step > 0.0 {
        f64::from(samples[n][axis].acceleration) * a.acceleration_step
    } else {
        convolve(&real(&rig.acceleration), &body)
    };
    let ground =
        a.ground_stiffness * body(n) + a.ground_damping * convolve(&real(&rig.velocity), &body);
    let force = force_between(samples, n, axis, rig)
        - a.force_cross * force_between(samples, n, 1 - axis, rig)
        - a.inertia * acceleration
        - ground;
    let learnt = &model.header().axes[axis];
    let states = [
        learnt.displacement.normalise(relative(n)),
        learnt.velocity.normalise(velocity),
    ];
    (states, if a.inertia_minus_force { -force } else { force })
}

#[test]
fn the_chain_is_its_formula_to_a_few_units() {
    println!("seed {SEED}");
    let model = model();
    let rigs = [
        rig(4e-5, 0.0, [0.0; 2], true),
        rig(4e-5, 2e-6, [350.0, 1.2], false),
        rig(0.0, 2e-6, [0.0, 0.7], true),
        // Without a body encoder the relative displacement stands in for the body, as on a joint held to ground.
        rig(0.0, 0.0, [350.0, 1.2], false),
        wrong_channels(),
    ];
    for (number, rig) in rigs.iter().enumerate() {
        let chain = Chain::new(&model, rig).unwrap();
        assert_eq!((chain.delay(), chain.band_delay()), (2, 4));
        // The offset makes the counters wrap in the middle of the record.
        for offset in [0, i32::MAX - 200] {
            let samples = motion(1500, offset);
            let outputs = run(&chain, &model, &samples);
            assert_eq!(outputs.len(), samples.len() - 4);
            let mut largest = [0.0_f64; 2];
            for (at, output) in outputs.iter().enumerate() {
                for axis in 0..2 {
                    let (states, force) = reference(&samples, at + 2, axis, rig, &model);
                    for (offset, state) in states.into_iter().enumerate() {
                        let seen = f64::from(output.state[2 * axis + offset]) / 2_f64.powi(31);
                        largest[0] = largest[0].max((seen - state.clamp(-1.0, 1.0)).abs());
                        let outside = output.outside & (1 << (2 * axis + offset)) != 0;
                        assert_eq!(outside, state.abs() >= 1.0, "state {state}");
                    }
                    let unit = model.outputs()[axis].force_per_lsb;
                    let error = (f64::from(output.measured[axis]) * unit - force).abs();
                    largest[1] = largest[1].max(error / unit);
                    assert_eq!(
                        output.residual[axis],
                        output.measured[axis].saturating_sub(output.predicted[axis])
                    );
                }
                assert_eq!(output.predicted, model.evaluate(&output.state));
                assert_eq!(output.saturated, 0);
            }
            println!(
                "rig {number}, offset {offset}: states to {:.1e} of the range, force to {:.1} units",
                largest[0], largest[1]
            );
            assert!(
                largest[0] < 2e-8,
                "states are off by {:e} of the training range",
                largest[0]
            );
            // Multipliers are right to 2⁻²⁹ of a force near full scale, and a derivative that enters the force is
            // rounded to 16..32 units.
            // A channel read between its samples is rounded to a count.
            let half_a_count = |axis: usize| {
                let [own, other] = [axis, 1 - axis].map(|axis| &rig.axes[axis]);
                let counts = own.force_step + own.force_cross.abs() * other.force_step;
                0.5 * counts / model.outputs()[axis].force_per_lsb
            };
            let allowed = match number {
                4 => 8.0 + half_a_count(0).max(half_a_count(1)),
                _ => [4.0, 20.0, 36.0, 36.0][number],
            };
            assert!(
                largest[1] < allowed,
                "forces are off by {} of 2³¹ units",
                largest[1]
            );
        }
    }
}

/// Outputs by the row that they describe, for rows that both chains know.
fn aligned<'a>(
    chains: [&Chain; 2],
    outputs: [&'a [Output]; 2],
) -> impl Iterator<Item = (&'a Output, &'a Output)> {
    let first = chains[0].first_row().max(chains[1].first_row());
    let [a, b] = [0, 1].map(|i| &outputs[i][first - chains[i].first_row()..]);
    a.iter().zip(b)
}

#[test]
fn a_channel_late_by_whole_samples_gives_the_bits_of_one_in_time() {
    let model = model();
    for rig in [
        rig(4e-5, 2e-6, [350.0, 1.2], false),
        rig(0.0, 2e-6, [350.0, 1.2], true),
    ] {
        let in_time = Chain::new(&model, &rig).unwrap();
        for offset in [0, i32::MAX - 200] {
            let wanted = run(&in_time, &model, &motion(600, offset));
            for (displacement, body, acceleration) in [
                (0, 1, 0),
                (1, 0, 0),
                (2, 2, 2),
                (-1, 0, 1),
                (-2, 2, -1),
                (1, -2, 3),
                (0, 0, 2),
                (0, 0, -1),
            ] {
                let delays = ChannelDelays {
                    displacement: f64::from(displacement),
                    body: f64::from(body),
                    acceleration: f64::from(acceleration),
                };
                let mut rig = rig.clone();
                rig.axes.iter_mut().for_each(|axis| axis.delays = delays);
                let Ok(chain) = Chain::new(&model, &rig) else {
                    // Three samples late, and the filters wait for two: only a late counter makes them wait longer.
                    panic!("{delays:?} was refused");
                };
                let seen = run(&chain, &model, &late_motion(600, offset, delays));
                assert!(seen.len() + 8 > wanted.len());
                assert_eq!(
                    chain.delay() - in_time.delay(),
                    displacement.max(body).max(0) as usize
                );
                let mut rows = 0;
                for (a, b) in aligned([&in_time, &chain], [&wanted, &seen]) {
                    rows += 1;
                    let a = Output {
                        residual_band: None,
                        ..*a
                    };
                    assert_eq!(
                        a,
                        Output {
                            residual_band: None,
                            ..*b
                        },
                        "{delays:?}, pair {rows}"
                    );
                }
                assert!(rows > 580);
            }
        }
    }
}

#[test]
fn a_channel_late_by_part_of_a_sample_is_put_in_time() {
    let (model, rig) = (model(), rig(4e-5, 2e-6, [350.0, 1.2], true));
    let in_time = Chain::new(&model, &rig).unwrap();
    let wanted = run(&in_time, &model, &motion(1500, i32::MAX - 200));
    for late in [0.3, -0.45, 1.6] {
        let delays = ChannelDelays {
            displacement: late,
            body: -late,
            acceleration: late,
        };
        let samples = late_motion(1500, i32::MAX - 200, delays);
        let uncorrected = run(&in_time, &model, &samples);
        let mut rig = rig.clone();
        rig.axes.iter_mut().for_each(|axis| axis.delays = delays);
        let chain = Chain::new(&model, &rig).unwrap();
        let corrected = run(&chain, &model, &samples);
        // Largest error of the first axis's position in counts, and of its force in N.
        let worst = |seen: &[Output], chain: &Chain| {
            let mut worst = [0.0_f64; 2];
            for (a, b) in aligned([&in_time, chain], [&wanted, seen]) {
                let counts = 1e-3 / 2e-6 / 2_f64.powi(31);
                let unit = model.outputs()[0].force_per_lsb;
                worst[0] = worst[0].max(f64::from(a.state[0] - b.state[0]).abs() * counts);
                worst[1] = worst[1].max(f64::from(a.measured[0].abs_diff(b.measured[0])) * unit);
            }
            worst
        };
        let (with, without) = (worst(&corrected, &chain), worst(&uncorrected, &in_time));
        println!(
            "late by {late}: counts and N off: {with:.3?} put in time, {without:.3?} as they come"
        );
        // Three roundings to a count on either side; then the cubic's own error.
        assert!(
            with[0] <= 3.0 && with[1] < 0.1 * without[1],
            "late by {late}"
        );
        assert!(without[0] > 8.0, "late by {late}: the test shows nothing");
    }
}

#[test]
fn the_band_limited_residual_is_the_low_pass_of_the_residuals() {
    let (model, rig) = (model(), rig(4e-5, 0.0, [0.0; 2], true));
    let chain = Chain::new(&model, &rig).unwrap();
    let outputs = run(&chain, &model, &motion(400, 0));
    let weights = [0.1, 0.2, 0.4, 0.2, 0.1];
    for (at, output) in outputs.iter().enumerate() {
        let Some(seen) = output.residual_band else {
            assert!(
                at < 4,
                "the low-pass of five taps is full at the fifth residual"
            );
            continue;
        };
        for (axis, &value) in seen.iter().enumerate() {
            let wanted: f64 = weights
                .iter()
                .zip(&outputs[at - 4..=at])
                .map(|(w, o)| w * f64::from(o.residual[axis]))
                .sum();
            assert!(
                (f64::from(value) - wanted).abs() < 8.0,
                "{value} for {wanted}"
            );
        }
    }
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
