//! The page of the rig block lists its bytes, and its numbers are the SI values of rig and model.

mod sample_rigs;

use jointwatch_shared::rig_block::{CHECKSUM_OFFSET, RIG_BLOCK_LEN, encode};
use jointwatch_shared::wiring::Signed;
use sample_rigs::{block, model, sealed};

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
            "version" => vec![3, 0],
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
            "line turn" | "line gain" | "line places" | "line" => continue,
            "hum_hz" => f64s(&[a.hum.frequency_hz]),
            "hum_amplitude" => f64s(&[a.hum.amplitude]),
            "wait" | "before" => vec![2],
            "band every" => vec![rig.band_every_log2],
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
            "gross" => la.gross.to_vec(),
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
        (RIG_BLOCK_LEN, 92),
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
        let (gain, zero) = scale(7);
        let full_scale = 31_f64.exp2();
        near(
            gain,
            full_scale * rig.displacement_step / x.half_range,
            "position",
        );
        near(zero, x.center / rig.displacement_step, "its zero");
        let (gain, zero) = scale(24);
        // 2^18 of the taps are 1/s.
        let of_sum = rig.displacement_step / 18_f64.exp2() * shift(4).exp2();
        near(gain, full_scale * of_sum / v.half_range, "velocity");
        near(zero, v.center / of_sum, "its zero");
        // Multipliers, each the nearest whole number, as large as they may be.
        let unit = |place: usize| match place {
            0 | 1 => 25_f64.exp2(),
            2..=4 => (shift(65) + 8.0).exp2(),
            _ => (shift(66) + 8.0).exp2(),
        };
        let of_term = |place: usize| at(offset + 41 + 4 * place);
        let term = |place: usize, wanted: f64, what: &str| {
            let (seen, wanted) = (of_term(place), wanted * unit(place));
            assert!(
                (f64::from(seen) - wanted).abs() <= 0.5,
                "{what}: {seen}, {wanted}"
            );
        };
        let size = |place: usize| i64::from(of_term(place)).abs();
        for sizes in [size(2) + size(3) + size(4), size(5)] {
            assert!(((1 << 30) - 4..=1 << 31).contains(&sizes));
        }
        let (sign, lsb) = (
            if number == 0 { -1.0 } else { 1.0 },
            outputs[number].force_per_lsb,
        );
        // The line's turn, its gain for 2 s, and the pointer's places: 3/1e-4 force units are shifted up to 2²⁶ at most.
        let line = 2902 + 13 * number;
        let angle = f64::from(at(line + 4)).atan2(f64::from(at(line)));
        let turns = rig.hum.frequency_hz / block.rig.sample_rate_hz;
        near(angle, std::f64::consts::TAU * turns, "angle of the line");
        let gain = f64::from(at(line + 8)) / 32_f64.exp2();
        assert!((gain * block.rig.sample_rate_hz - 1.0).abs() < 1e-5);
        assert_eq!(bytes[line + 12], (26_f64 - 3e4_f64.log2()).floor() as u8);
        term(0, 0.0, "curvature");
        let damper = -sign * rig.ground_damping * rig.body_step / lsb;
        term(1, damper * shift(6).exp2() / 18_f64.exp2(), "damper");
        let inertia = -sign * rig.inertia * rig.acceleration_step / lsb;
        term(2, inertia, "inertia");
        term(3, sign * rig.force_step / lsb, "force");
        let other = block.rig.axes[1 - number].force_step;
        term(4, -sign * rig.force_cross * other / lsb, "cross-talk");
        let spring = -sign * rig.ground_stiffness * rig.body_step / lsb;
        term(5, spring, "spring");
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
