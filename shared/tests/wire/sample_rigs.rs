//! Rig blocks that use every field, or as few as there can be.
#![allow(dead_code, reason = "every test uses its own part")]

use crc::{CRC_32_ISO_HDLC, Crc};
use jointwatch_shared::base::axis::{Axis, AxisKind, Convention, InputRange, Name};
use jointwatch_shared::base::hum::Hum;
use jointwatch_shared::base::{Base, Header, Model, Output};
use jointwatch_shared::monitor::limits::{AxisLimits, Cusum, Limits, TwoSided};
use jointwatch_shared::wire::blob;
use jointwatch_shared::wire::rig::{ChannelDelays, MAX_BAND_TAPS, MAX_TAPS, Rig, RigAxis, Taps};
use jointwatch_shared::wire::rig_block::{CHECKSUM_OFFSET, RIG_BLOCK_LEN};
use jointwatch_shared::wire::wiring::{
    Accelerometer, AxisWiring, Converter, Counter, Signed, SignedDirection, Wiring,
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

pub(crate) fn limits(axes: usize) -> Limits {
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
        gross: [30 + n as u8, 40],
        moving_counts: [100, 100, 0, 5000, 4000, 6000],
    };
    Limits {
        model_checksum: 0x1234_5678,
        block: 64,
        outside_permille: 200,
        false_alarm_hours: 720,
        axes: (0..axes as i32).map(axis).collect(),
    }
}

pub(crate) fn counter(place: u8, negative: bool) -> Signed {
    Signed { place, negative }
}

/// A rig that uses every field, or a one-axis one with as little as there can be.
pub(crate) fn block(axes: usize, full: bool) -> Rig {
    let rig_axis = |n: usize| RigAxis {
        displacement_step: 2e-6 + n as f64 * 1e-6,
        body_step: if full { 3e-6 } else { 0.0 },
        acceleration_step: if full { 4e-5 } else { 0.0 },
        force_step: 1e-2,
        input_step: 1e-6,
        input_zero: 2.0 + n as f64,
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
            input: if full { 2.6 } else { 0.6 },
        },
        hum: if full {
            Hum {
                frequency_hz: 50.0 + 10.0 * n as f64,
                amplitude: 3.0,
            }
        } else {
            Hum::NONE
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
        input: Some(counter(3 * n as u8, n == 1)),
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
    Rig {
        model_checksum: blob::checksum_of(&model(axes)),
        sample_rate_hz: 2000.0,
        wiring: Wiring {
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
        axes: (0..axes).map(rig_axis).collect(),
        velocity: taps::<MAX_TAPS>(derivative, -1, false, 18),
        acceleration: taps::<MAX_TAPS>(derivative, 1, true, -3),
        band: taps::<MAX_BAND_TAPS>(band, 1, false, 28),
        band_every_log2: if full { 2 } else { 0 },
        limits: full.then(|| limits(axes)),
    }
}

/// A model of so many axes; what it says does not matter here.
pub(crate) fn model(axes: usize) -> Model {
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
        input: None,
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

pub(crate) fn blocks() -> [Rig; 3] {
    [block(2, true), block(1, true), block(1, false)]
}

pub(crate) fn sealed(mut bytes: [u8; RIG_BLOCK_LEN]) -> [u8; RIG_BLOCK_LEN] {
    let crc = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&bytes[..CHECKSUM_OFFSET]);
    bytes[CHECKSUM_OFFSET..].copy_from_slice(&crc.to_le_bytes());
    bytes
}
