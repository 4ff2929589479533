//! The rig block: it comes back as it went, damage never passes, what passes can be used, and the page lists its bytes.

use crc::{CRC_32_ISO_HDLC, Crc};
use heapless::Vec as Bounded;
use jointwatch_shared::model::axis::{Axis, AxisKind, Convention, InputRange, Name};
use jointwatch_shared::model::{Base, Header, Model, Output};
use jointwatch_shared::monitor::limits::{AxisLimits, Cusum, Limits, TwoSided};
use jointwatch_shared::pipeline::{ChainState, RawAxis};
use jointwatch_shared::rig::{ChannelDelays, MAX_BAND_TAPS, MAX_TAPS, Rig, RigAxis, Taps};
use jointwatch_shared::rig_block::{
    CHECKSUM_OFFSET, RIG_BLOCK_LEN, RIG_BLOCK_OFFSET, Refusal, RigBlock, decode, encode, on_board,
};
use jointwatch_shared::wiring::{
    Accelerometer, AxisWiring, Converter, Counter, Readings, Signed, SignedDirection, Wiring,
};

/// Antisymmetric or symmetric taps, no two of a half alike.
fn taps<const MOST: usize>(length: usize, sign: i32, sum_zero: bool, shift: i8) -> Taps<MOST> {
    let half: Vec<i32> = (0..length as i32 / 2).map(|i| 1000 - 37 * i * i).collect();
    let middle = match (sign, sum_zero) {
        (-1, _) => 0,
        (_, true) => -2 * half.iter().sum::<i32>(),
        _ => 70_000,
    };
    let mirrored = half.iter().rev().map(|tap| sign * tap);
    let all = half.iter().copied().chain([middle]).chain(mirrored);
    Taps {
        taps: all.collect(),
        shift,
    }
}

fn limits(axes: usize) -> Limits {
    let side = |n| Cusum {
        drift: -1600 - n,
        threshold: 6000 + n,
    };
    let axis = |n| AxisLimits {
        reversed: n == 1,
        force_shift: 12,
        force_power: 1 << 31,
        state_power: [1 << 27, 77],
        per_octave: [n, -n, 7],
        error: side(n),
        stiffness: TwoSided {
            more: side(n + 2),
            less: side(n + 3),
        },
        friction: TwoSided {
            more: side(n + 4),
            less: side(n + 5),
        },
        moving_counts: [100, 100, 0, 5000, 4000],
    };
    Limits {
        model_checksum: 0x1234_5678,
        block: 64,
        outside_permille: 200,
        false_alarm_hours: 720,
        axes: (0..axes as i32).map(axis).collect(),
    }
}

fn counter(place: u8, negative: bool) -> Signed {
    Signed { place, negative }
}

/// A block that uses every field, or a one-axis one with as little as there can be.
fn block(axes: usize, full: bool) -> RigBlock {
    let rig_axis = |n: usize| RigAxis {
        displacement_step: 2e-6 + n as f64 * 1e-6,
        displacement_difference: full,
        body_step: if full { 3e-6 } else { 0.0 },
        acceleration_step: if full { 4e-5 } else { 0.0 },
        force_step: 1e-2,
        inertia: 1.7,
        inertia_minus_force: n == 0,
        ground_stiffness: 350.0,
        ground_damping: 1.2,
        force_cross: if axes == 2 { 0.01 } else { 0.0 },
        force_delay_samples: if full { 3.6 } else { 0.6 },
        delays: ChannelDelays {
            displacement: 0.1,
            body: if full { -0.2 } else { 0.0 },
            acceleration: if full { 3.3 } else { 1.3 },
        },
    };
    let direction = |chip, negative| SignedDirection {
        chip,
        direction: 2,
        negative,
    };
    let wired = |n: usize| AxisWiring {
        far: counter(2 * n as u8, false),
        near: full.then_some(counter(2 * n as u8 + 1, true)),
        body: full.then_some(counter(2 * n as u8 + 1, false)),
        force: counter(n as u8 + 1, n == 0),
        acceleration: match (full, n) {
            (false, _) => [None; 2],
            (true, 0) => [Some(direction(0, true)), None],
            (true, _) => [Some(direction(1, false)), Some(direction(0, true))],
        },
        pair_distance_m: if full && n == 1 { 0.12 } else { 0.0 },
    };
    let fitted = Some(Counter {
        quadrature: 4,
        start: -7,
        index: true,
    });
    let chip = full.then_some(Accelerometer {
        range: 2,
        filter: 3,
        external_sync: true,
    });
    let (derivative, band) = if full { (129, 257) } else { (5, 1) };
    RigBlock::new(
        Rig {
            sample_rate_hz: 2000.0,
            axes: (0..axes).map(rig_axis).collect(),
            velocity: taps::<MAX_TAPS>(derivative, -1, false, 18),
            acceleration: taps::<MAX_TAPS>(derivative, 1, true, -3),
            band: taps::<MAX_BAND_TAPS>(band, 1, false, 28),
        },
        Wiring {
            counters: if full {
                [fitted; 4]
            } else {
                [fitted, None, None, None]
            },
            converter: Converter {
                gain_log2: [0, 5, 6, 7],
                oversampling: 3,
            },
            accelerometers: [chip; 2],
            axes: (0..axes).map(wired).collect(),
        },
        full.then(|| limits(axes)),
        &model(axes),
    )
    .unwrap()
}

/// A model of so many axes; what it says does not matter here.
fn model(axes: usize) -> Model {
    let range = |half_range| InputRange {
        center: 0.25 * half_range,
        half_range,
    };
    let axis = |name| Axis {
        name: Name::new(0, name).unwrap(),
        kind: AxisKind::Translation,
        convention: Convention::ForceMinusInertia,
        inertia: 1.7,
        displacement: range(0.01),
        velocity: range(0.5),
        validation: None,
    };
    let header = Header {
        sample_rate_hz: 2000.0,
        band_hz: 120.0,
        state_band_hz: 200.0,
        axes: ["x", "y"].map(axis).into_iter().take(axes).collect(),
    };
    let output = Output {
        force_per_lsb: 1e-4,
        error_bound: 0.0,
    };
    let outputs = [output; 2].into_iter().take(axes).collect();
    let base = Base::None { axes: axes as u8 };
    Model::new(header, outputs, base).unwrap()
}

fn blocks() -> [RigBlock; 3] {
    [block(2, true), block(1, true), block(1, false)]
}

fn sealed(mut bytes: [u8; RIG_BLOCK_LEN]) -> [u8; RIG_BLOCK_LEN] {
    let crc = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&bytes[..CHECKSUM_OFFSET]);
    bytes[CHECKSUM_OFFSET..].copy_from_slice(&crc.to_le_bytes());
    bytes
}

#[test]
fn comes_back_as_it_went() {
    for block in blocks() {
        let bytes = encode(&block).unwrap();
        assert_eq!(bytes, sealed(bytes));
        assert_eq!(decode(&bytes).unwrap(), block);
    }
    assert_eq!(RIG_BLOCK_OFFSET, jointwatch_shared::blob::BLOB_LEN);
}

#[test]
fn every_truncation_and_every_flipped_bit_is_refused() {
    for block in blocks() {
        let bytes = encode(&block).unwrap();
        for length in 0..RIG_BLOCK_LEN {
            assert_eq!(
                decode(&bytes[..length]),
                Err(Refusal::Length { seen: length })
            );
        }
        assert!(decode(&[&bytes[..], &[0]].concat()).is_err());
        for bit in 0..8 * RIG_BLOCK_LEN {
            let mut flipped = bytes;
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert!(decode(&flipped).is_err(), "bit {bit} unnoticed");
        }
    }
}

#[test]
fn flips_with_a_right_checksum_are_refused_or_one_form_of_a_usable_block() {
    for block in blocks() {
        let bytes = encode(&block).unwrap();
        let mut accepted = 0;
        for bit in 0..8 * CHECKSUM_OFFSET {
            let mut flipped = bytes;
            flipped[bit / 8] ^= 1 << (bit % 8);
            let flipped = sealed(flipped);
            if let Ok(other) = decode(&flipped) {
                accepted += 1;
                assert!(other != block, "bit {bit} means nothing");
                assert_eq!(other.check(), Ok(()));
                assert_eq!(encode(&other).unwrap(), flipped, "bit {bit}");
            }
        }
        // Low bits of quantities are fair game; were none accepted, this test would show nothing.
        assert!(accepted > 300, "{accepted}");
    }
}

/// Why a block that was changed so is not written, and not read either.
fn refusal(change: fn(&mut RigBlock)) -> String {
    let mut block = block(2, true);
    change(&mut block);
    encode(&block).unwrap_err().to_string()
}

#[test]
fn every_quantity_is_checked_by_name() {
    type Change = fn(&mut RigBlock);
    let changes: [(&str, Change); 26] = [
        ("sample rate", |b| b.rig.sample_rate_hz = f64::NAN),
        ("displacement step", |b| {
            b.rig.axes[1].displacement_step = 0.0
        }),
        ("force per count", |b| b.rig.axes[0].force_step = -1.0),
        ("inertia", |b| b.rig.axes[0].inertia = f64::INFINITY),
        ("displacement delay", |b| {
            b.rig.axes[0].delays.displacement = 2.5
        }),
        ("acceleration delay", |b| {
            b.rig.axes[0].delays.acceleration = 500.0
        }),
        ("velocity filter", |b| b.rig.velocity.taps[0] += 1),
        ("acceleration filter", |b| b.rig.acceleration.taps[64] += 1),
        ("band filter", |b| b.rig.band.taps[0] += 1),
        ("shift of the band", |b| b.rig.band.shift = 0),
        ("counts per encoder cycle", |b| {
            b.wiring.counters[2].as_mut().unwrap().quadrature = 3
        }),
        ("bridge channel's gain", |b| {
            b.wiring.converter.gain_log2[0] = 8
        }),
        ("oversampling", |b| b.wiring.converter.oversampling = 8),
        ("range of an accelerometer", |b| {
            b.wiring.accelerometers[0].as_mut().unwrap().range = 0
        }),
        ("filter of an accelerometer", |b| {
            b.wiring.accelerometers[1].as_mut().unwrap().filter = 11
        }),
        ("axes of the wiring", |b| b.wiring.axes.truncate(1)),
        ("number of a counter", |b| b.wiring.axes[0].far.place = 4),
        ("counters fitted", |b| b.wiring.counters[1] = None),
        ("far and near sides", |b| {
            b.wiring.axes[1].near = Some(counter(2, true))
        }),
        ("number of a bridge channel", |b| {
            b.wiring.axes[1].force.place = 4
        }),
        ("accelerometers fitted", |b| {
            b.wiring.accelerometers[1] = None
        }),
        ("distance of a pair", |b| {
            b.wiring.axes[1].pair_distance_m = 0.0
        }),
        ("near counters wired", |b| b.wiring.axes[0].near = None),
        ("body counters wired", |b| {
            b.rig.axes[0].body_step = 0.0;
            b.rig.axes[0].delays.body = 0.0;
        }),
        ("accelerometers wired", |b| {
            b.rig.axes[1].acceleration_step = 0.0
        }),
        ("axes of the monitor", |b| {
            b.limits.as_mut().unwrap().axes.truncate(1)
        }),
    ];
    for (words, change) in changes {
        let said = refusal(change);
        assert!(said.contains(words), "{words}: {said}");
    }
}

#[test]
fn a_refusal_says_what_was_seen() {
    let bytes = encode(&block(2, true)).unwrap();
    let with = |offset: usize, value: u8| {
        let mut bytes = bytes;
        bytes[offset] = value;
        decode(&sealed(bytes)).unwrap_err().to_string()
    };
    assert!(
        decode(&[0xFF; RIG_BLOCK_LEN])
            .unwrap_err()
            .to_string()
            .contains("ff, ff, ff, ff")
    );
    assert_eq!(
        with(4, 1),
        "the rig block has format version 1, but this program reads version 2: export it again"
    );
    let mut damaged = bytes;
    damaged[100] ^= 1;
    assert!(
        decode(&damaged)
            .unwrap_err()
            .to_string()
            .contains("damaged")
    );
    assert_eq!(
        with(6, 3),
        "number of axes is 3, but has to lie between 1 and 2"
    );
    assert_eq!(
        with(36, 2),
        "the rig block's mark of a fitted counter is 2, which this program does not know"
    );
    assert!(with(2782, 2).contains("sign convention"));
    assert!(with(88, 0xFF).contains("far counter"));
    for offset in [
        39,
        70,
        102,
        130,
        2483,
        2584,
        2783,
        2896,
        2902,
        CHECKSUM_OFFSET - 1,
    ] {
        assert_eq!(
            with(offset, 9),
            format!("byte {offset} of the rig block is 9, but has to be 0")
        );
    }
    // The limits with their mark taken away, and those of three axes.
    assert!(with(7, 0).contains("byte 2470"), "{}", with(7, 0));
    assert!(with(2482, 3).contains("axes of the monitor's limits"));
    assert!(with(7, 2).contains("mark of the monitor's limits"));
}

/// The offset, the length and the name of every row of the first table of docs/rig-block.md.
fn documented() -> Vec<(usize, usize, String)> {
    let page = include_str!("../../docs/rig-block.md");
    let rows = page.lines().filter_map(|line| {
        let mut cells = line.trim_matches('|').split('|').map(str::trim);
        let offset = cells.next()?.parse().ok()?;
        let length = cells.next()?.parse().ok()?;
        Some((offset, length, cells.next()?.to_owned()))
    });
    rows.collect()
}

#[test]
fn the_documented_bytes_are_the_written_bytes() {
    let block = block(2, true);
    let bytes = encode(&block).unwrap();
    let (rig, wiring) = (&block.rig, &block.wiring);
    let f64s = |values: &[f64]| {
        values
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect::<Vec<u8>>()
    };
    let words = |values: &[i32]| {
        values
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect::<Vec<u8>>()
    };
    let mut next = 0;
    let mut seen = 0;
    for (offset, length, field) in documented() {
        assert_eq!(offset, next, "{field} does not follow the row above");
        next = offset + length;
        seen += 1;
        let (axis, name) = match field.strip_prefix("axis 1 ") {
            Some(rest) => (1, rest),
            None => (0, field.strip_prefix("axis 0 ").unwrap_or(&field)),
        };
        let (a, w) = (&rig.axes[axis], &wiring.axes[axis]);
        let l = block.limits.as_ref().unwrap();
        let la = &l.axes[axis];
        let source =
            |s: Option<Signed>| s.map_or(vec![0xFF, 0], |s| vec![s.place, s.negative as u8]);
        let wanted: Vec<u8> = match name {
            "magic" => b"JWRB".to_vec(),
            "version" => vec![2, 0],
            "axes" | "limits' axes" => vec![2],
            "limits" if axis == 1 => continue,
            "limits" => vec![1],
            "sample_rate_hz" => f64s(&[rig.sample_rate_hz]),
            "sample_rate_uhz" => 2_000_000_000_u64.to_le_bytes().to_vec(),
            "model checksum" => block.model_checksum.to_le_bytes().to_vec(),
            "counter 0 start" => (-7_i32).to_le_bytes().to_vec(),
            "counter 0 fitted" | "counter 0 index" => vec![1],
            "counter 0 quadrature" => vec![4],
            "counters 1 to 3" => [249, 255, 255, 255, 1, 4, 1, 0].repeat(3),
            "gains" => vec![0, 5, 6, 7],
            "oversampling" => vec![3],
            "accelerometer 0 fitted" => vec![1],
            "accelerometer 0 range" => vec![2],
            "accelerometer 0 filter" => vec![3],
            "accelerometer 0 sync" => vec![1],
            "accelerometer 1" => vec![1, 2, 3, 1],
            "displacement_step" => f64s(&[a.displacement_step]),
            "body_step" => f64s(&[a.body_step]),
            "acceleration_step" => f64s(&[a.acceleration_step]),
            "force_step" => f64s(&[a.force_step]),
            "inertia" => f64s(&[a.inertia]),
            "ground_stiffness" => f64s(&[a.ground_stiffness]),
            "ground_damping" => f64s(&[a.ground_damping]),
            "force_cross" => f64s(&[a.force_cross]),
            "displacement_delay" => f64s(&[a.delays.displacement]),
            "body_delay" => f64s(&[a.delays.body]),
            "acceleration_delay" => f64s(&[a.delays.acceleration]),
            "force_delay" => f64s(&[a.force_delay_samples]),
            "pair_distance" => f64s(&[w.pair_distance_m]),
            "convention" => vec![a.inertia_minus_force as u8],
            "far" => source(Some(w.far)),
            "near" => source(w.near),
            "body" => source(w.body),
            "bridge" => source(Some(w.force)),
            "acceleration" => w
                .acceleration
                .iter()
                .flat_map(|d| {
                    d.map_or(vec![0xFF, 0, 0], |d| {
                        vec![d.chip, d.direction, d.negative as u8]
                    })
                })
                .collect(),
            // As those of axis 0, which stand above them.
            "wiring" | "numbers" | "values" if axis == 1 => continue,
            "wait" | "before" => vec![2],
            "difference" | "has body" => vec![1],
            "acceleration kind" => vec![1],
            "late" => vec![7],
            "derivative shifts" | "position" | "velocity" | "terms" | "force" | "late places" => {
                continue;
            }
            "limits' model" => l.model_checksum.to_le_bytes().to_vec(),
            "false_alarm_hours" => l.false_alarm_hours.to_le_bytes().to_vec(),
            "block" => l.block.to_le_bytes().to_vec(),
            "outside_permille" => l.outside_permille.to_le_bytes().to_vec(),
            "force_power" => la.force_power.to_le_bytes().to_vec(),
            "state_power" => la.state_power.map(u64::to_le_bytes).concat(),
            "per_octave" => words(&la.per_octave),
            "sums" => words(
                &[
                    la.error,
                    la.stiffness.more,
                    la.stiffness.less,
                    la.friction.more,
                    la.friction.less,
                ]
                .map(|side| [side.drift, side.threshold])
                .concat(),
            ),
            "moving_counts" => la.moving_counts.map(u32::to_le_bytes).concat(),
            "reversed" => vec![la.reversed as u8],
            "force_shift" => vec![la.force_shift],
            "shifts" => vec![18, -3_i8 as u8],
            "band shift" => vec![28],
            "derivative taps" => vec![129, 0],
            "band taps" => vec![1, 1],
            "velocity taps" => words(&rig.velocity.taps),
            "acceleration taps" => words(&rig.acceleration.taps),
            "low-pass taps" => words(&rig.band.taps),
            "reserved" | "padding" => vec![0; length],
            "checksum" => sealed(bytes)[CHECKSUM_OFFSET..].to_vec(),
            unknown => {
                panic!("docs/rig-block.md has the field {unknown}, which this test does not know")
            }
        };
        assert_eq!(bytes[offset..next], wanted, "{field}");
    }
    assert_eq!(
        (next, seen),
        (RIG_BLOCK_LEN, 84),
        "the table ends before the block does"
    );
}

#[test]
fn the_numbers_are_the_si_values_of_rig_and_model() {
    let block = block(2, true);
    let bytes = encode(&block).unwrap();
    let at = |offset: usize| i32::from_le_bytes(bytes[offset..offset + 4].try_into().unwrap());
    let long = |offset: usize| i64::from_le_bytes(bytes[offset..offset + 8].try_into().unwrap());
    let near = |seen: f64, wanted: f64, what: &str| {
        assert!(
            (seen / wanted - 1.0).abs() < 1e-7,
            "{what}: {seen}, {wanted}"
        );
    };
    let header = model(2);
    let (header, outputs) = (header.header().clone(), header.outputs().to_vec());
    for (number, offset) in [(0, 132), (1, 271)] {
        let (rig, learnt) = (&block.rig.axes[number], &header.axes[number]);
        let shift = |place: usize| f64::from(bytes[offset + place] as i8);
        // What a scale makes of a count, and the count that it makes nothing of.
        let scale = |place: usize| {
            let (origin, multiplier) = (at(offset + place), at(offset + place + 4));
            let rest = long(offset + place + 8) as f64 / f64::from(multiplier);
            let gain = f64::from(multiplier) / shift(place + 16).exp2();
            (gain, f64::from(origin) - rest)
        };
        let (x, v) = (learnt.displacement, learnt.velocity);
        let (gain, zero) = scale(8);
        let full_scale = 31_f64.exp2();
        near(
            gain,
            full_scale * rig.displacement_step / x.half_range,
            "position",
        );
        near(zero, x.center / rig.displacement_step, "its zero");
        let (gain, zero) = scale(25);
        // 2^18 of the taps are 1/s.
        let of_sum = rig.displacement_step / 18_f64.exp2() * shift(4).exp2();
        near(gain, full_scale * of_sum / v.half_range, "velocity");
        near(zero, v.center / of_sum, "its zero");
        let term = |place: usize| {
            f64::from(at(offset + 42 + 5 * place)) / shift(46 + 5 * place).exp2() / 256.0
        };
        let (sign, lsb) = (
            if number == 0 { -1.0 } else { 1.0 },
            outputs[number].force_per_lsb,
        );
        near(
            term(0),
            -sign * rig.inertia * rig.acceleration_step / lsb,
            "inertia",
        );
        near(term(1), sign * rig.force_step / lsb, "force");
        near(
            term(2),
            -sign * rig.ground_stiffness * rig.body_step / lsb,
            "spring",
        );
        let damping = term(3) / shift(6).exp2() * 18_f64.exp2();
        near(
            damping,
            -sign * rig.ground_damping * rig.body_step / lsb,
            "damper",
        );
        let other = block.rig.axes[1 - number].force_step;
        near(term(4), -sign * rig.force_cross * other / lsb, "cross-talk");
        // Where a channel is read: its four weights' mean age is that of the filters' middle, less what it is late.
        let late = [
            (67, rig.force_delay_samples, 64.0 + 2.0),
            (85, rig.delays.acceleration, 64.0 + 2.0),
            (103, rig.delays.displacement, 2.0),
            (121, rig.delays.body, 2.0),
        ];
        for (place, late, wait) in late {
            let oldest = u16::from_le_bytes(bytes[offset + place..][..2].try_into().unwrap());
            let weights =
                [0, 1, 2, 3].map(|n| f64::from(at(offset + place + 2 + 4 * n)) / 29_f64.exp2());
            let ages = weights
                .iter()
                .zip(0..)
                .map(|(w, n)| w * f64::from(i32::from(oldest) - n));
            let age: f64 = ages.sum();
            assert!((age - (wait - late)).abs() < 1e-6, "{place}: {age}");
        }
    }
}

#[test]
fn numbers_that_are_accepted_overflow_nothing() {
    // In builds with overflow checks this would panic.
    for block in blocks() {
        let bytes = encode(&block).unwrap();
        let model = model(block.rig.axes.len());
        let mut accepted = 0;
        for bit in 8 * 128..8 * 410 {
            let mut flipped = bytes;
            flipped[bit / 8] ^= 1 << (bit % 8);
            let Ok(on_board) = on_board(&sealed(flipped)) else {
                continue;
            };
            accepted += 1;
            let mut state = ChainState::default();
            let samples = 10 + on_board.chain.band_delay() as i32;
            for n in 0..samples {
                let rail = if n % 3 == 0 { i32::MIN } else { i32::MAX };
                let axis = RawAxis {
                    displacement: [rail >> (n % 2), -rail.max(-i32::MAX)],
                    body: rail,
                    acceleration: rail,
                    force: rail,
                };
                on_board.chain.step(&mut state, &model, &[axis; 2]);
            }
        }
        assert!(accepted > 200, "{accepted}");
    }
}

#[test]
fn readings_go_to_their_places_with_their_signs() {
    let readings = Readings {
        counters: [10, 20, 30, i32::MIN],
        channels: [1, 2, 3, 4],
        accelerations: [[5, 6, 7], [8, 9, 11]],
    };
    let sample = block(2, true).wiring.raw_sample(&readings);
    let x = RawAxis {
        displacement: [10, -20],
        body: 20,
        acceleration: -7,
        force: -2,
    };
    // The lowest count is its own negative.
    let phi = RawAxis {
        displacement: [30, i32::MIN],
        body: i32::MIN,
        acceleration: 11 - 7,
        force: 3,
    };
    assert_eq!(sample, [x, phi]);
    let sample = block(1, false).wiring.raw_sample(&readings);
    let x = RawAxis {
        displacement: [10, 0],
        body: 0,
        acceleration: 0,
        force: -2,
    };
    assert_eq!(sample, [x, RawAxis::default()]);
    // Without axes, as on a board that has no rig block.
    let none = Wiring::unconfigured();
    assert_eq!(none.raw_sample(&readings), [RawAxis::default(); 2]);
    assert!(none.check().is_err());
    let _: Bounded<AxisWiring, 2> = none.axes;
}
