//! The rig block: it comes back as it went, damage never passes, and what passes can be used.

use super::sample_rigs::{block, blocks, counter, model, sealed};
use heapless::Vec as Bounded;
use jointwatch_shared::chain::{Chain, ChainState, RawAxis};
use jointwatch_shared::wire::rig::Rig;
use jointwatch_shared::wire::rig_block::{
    CHECKSUM_OFFSET, MESSAGE_OFFSET, RIG_BLOCK_LEN, RIG_BLOCK_OFFSET, Refusal, decode, encode,
};
use jointwatch_shared::wire::wiring::{AxisWiring, Readings, Wiring};

#[test]
fn comes_back_as_it_went() {
    for block in blocks() {
        let bytes = encode(&block).unwrap();
        assert_eq!(bytes, sealed(bytes));
        assert_eq!(decode(&bytes).unwrap(), block);
    }
    assert_eq!(RIG_BLOCK_OFFSET, jointwatch_shared::wire::blob::BLOB_LEN);
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
fn refusal(change: fn(&mut Rig)) -> String {
    let mut block = block(2, true);
    change(&mut block);
    encode(&block).unwrap_err().to_string()
}

#[test]
fn every_quantity_is_checked_by_name() {
    type Change = fn(&mut Rig);
    let changes: [(&str, Change); 35] = [
        ("sample rate", |b| b.sample_rate_hz = f64::NAN),
        ("displacement step", |b| b.axes[1].displacement_step = 0.0),
        ("force per count", |b| b.axes[0].force_step = -1.0),
        ("inertia", |b| b.axes[0].inertia = f64::INFINITY),
        ("displacement delay", |b| {
            b.axes[0].delays.displacement = 2.5
        }),
        ("acceleration delay", |b| {
            b.axes[0].delays.acceleration = 500.0
        }),
        ("velocity filter", |b| b.velocity.taps[0] += 1),
        ("acceleration filter", |b| b.acceleration.taps[64] += 1),
        ("band filter", |b| b.band.taps[0] += 1),
        ("shift of the band", |b| b.band.shift = 0),
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
        ("number of a converter channel", |b| {
            b.wiring.axes[1].force.place = 4
        }),
        ("number of a converter channel", |b| {
            b.wiring.axes[0].input.as_mut().unwrap().place = 4
        }),
        ("input step", |b| b.wiring.axes[0].input = None),
        ("input step", |b| b.axes[1].input_step = 0.0),
        ("input at count 0", |b| b.axes[1].input_zero = f64::NAN),
        ("input delay", |b| b.axes[0].delays.input = 200.0),
        ("accelerometers fitted", |b| {
            b.wiring.accelerometers[1] = None
        }),
        ("distance of a pair", |b| {
            b.wiring.axes[1].pair_distance_m = 0.0
        }),
        ("body step", |b| b.wiring.axes[0].body = None),
        ("body step", |b| {
            b.axes[0].body_step = 0.0;
            b.axes[0].delays.body = 0.0;
        }),
        ("body delay", |b| {
            b.wiring.axes[0].body = None;
            b.axes[0].body_step = 0.0;
        }),
        ("acceleration step", |b| b.axes[1].acceleration_step = 0.0),
        ("acceleration step", |b| {
            b.wiring.axes[0].acceleration = [None; 2]
        }),
        ("frequency of a line", |b| {
            b.axes[0].hum.frequency_hz = -50.0
        }),
        ("amplitude of a line", |b| b.axes[0].hum.amplitude = 0.0),
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
        with(4, 3),
        "the rig block has format version 3, but this program reads version 5: export it again"
    );
    let mut damaged = bytes;
    damaged[100] ^= 1;
    assert!(
        decode(&damaged)
            .unwrap_err()
            .to_string()
            .contains("damaged")
    );
    // Behind the checksum of the model and the sample rate: the mark of the first counter.
    let checksum_len = postcard_len(block(2, true).model_checksum);
    let mark = MESSAGE_OFFSET + checksum_len + 8;
    assert_eq!(bytes[mark], 1);
    assert!(with(mark, 2).contains("not that of a rig"));
    let used = bytes[..CHECKSUM_OFFSET]
        .iter()
        .rposition(|&byte| byte != 0)
        .unwrap();
    for offset in [used + 1, CHECKSUM_OFFSET - 1] {
        assert_eq!(
            with(offset, 9),
            format!("byte {offset} of the rig block is 9, but has to be 0")
        );
    }
    let rate = MESSAGE_OFFSET + checksum_len;
    assert!(with(rate + 7, 0xC0).contains("sample rate"));
}

/// Bytes of a whole number in postcard: seven bits each.
fn postcard_len(value: u32) -> usize {
    (32 - value.leading_zeros()).div_ceil(7).max(1) as usize
}

/// The checksum of the model as postcard writes it, and with a byte that says nothing; and a zero
/// with a sign.
#[test]
fn a_rig_in_other_bytes_is_refused() {
    let mut rig = block(1, false);
    rig.model_checksum = 5;
    let bytes = encode(&rig).unwrap();
    let mut longer = bytes;
    longer[MESSAGE_OFFSET] = 0x85;
    longer[MESSAGE_OFFSET + 1] = 0;
    longer[MESSAGE_OFFSET + 2..CHECKSUM_OFFSET]
        .copy_from_slice(&bytes[MESSAGE_OFFSET + 1..CHECKSUM_OFFSET - 1]);
    assert_eq!(decode(&sealed(longer)), Err(Refusal::Form));
    rig.axes[0].inertia = 0.0;
    let plain = encode(&rig).unwrap();
    rig.axes[0].inertia = -0.0;
    assert_eq!(encode(&rig).unwrap(), plain);
}

#[test]
fn rigs_that_are_accepted_overflow_nothing() {
    // In builds with overflow checks this would panic.
    for block in blocks() {
        let bytes = encode(&block).unwrap();
        let model = model(block.axes.len());
        let mut accepted = 0;
        let used = bytes[..CHECKSUM_OFFSET]
            .iter()
            .rposition(|&byte| byte != 0)
            .unwrap();
        for bit in 8 * MESSAGE_OFFSET..8 * (used + 1) {
            let mut flipped = bytes;
            flipped[bit / 8] ^= 1 << (bit % 8);
            let Ok(rig) = decode(&sealed(flipped)) else {
                continue;
            };
            let Ok(chain) = Chain::new(&model, &rig) else {
                continue;
            };
            accepted += 1;
            let mut state = ChainState::default();
            let samples = 10 + chain.band_delay() as i32;
            for n in 0..samples {
                let rail = if n % 3 == 0 { i32::MIN } else { i32::MAX };
                let axis = RawAxis {
                    displacement: [rail >> (n % 2), -rail.max(-i32::MAX)],
                    body: rail,
                    acceleration: rail,
                    force: rail,
                    input: rail,
                };
                chain.step(&mut state, &model, &[axis; 2]);
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
        input: 1,
    };
    // The lowest count is its own negative.
    let phi = RawAxis {
        displacement: [30, i32::MIN],
        body: i32::MIN,
        acceleration: 11 - 7,
        force: 3,
        input: -4,
    };
    assert_eq!(sample, [x, phi]);
    let sample = block(1, false).wiring.raw_sample(&readings);
    let x = RawAxis {
        displacement: [10, 0],
        body: 0,
        acceleration: 0,
        force: -2,
        input: 1,
    };
    assert_eq!(sample, [x, RawAxis::default()]);
    // Without axes, as on a board that has no rig block.
    let none = Wiring::unconfigured();
    assert_eq!(none.raw_sample(&readings), [RawAxis::default(); 2]);
    assert!(none.check().is_err());
    let _: Bounded<AxisWiring, 2> = none.axes;
}
