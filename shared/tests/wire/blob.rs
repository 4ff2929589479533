//! The blob: it comes back as it went, damage never passes, and nothing that passes can overflow.

use super::sample_models::{network, physical, polynomial, sealed, with_effects};
use super::wide;
use jointwatch_shared::base::terms::MAX_TERMS;
use jointwatch_shared::base::{Base, Model};
use jointwatch_shared::effect::{Acts, EFFECTS};
use jointwatch_shared::fault::Error;
use jointwatch_shared::selftest::network::reference_network;
use jointwatch_shared::selftest::{self, CORNER_POINTS, Digest, Points, corner};
use jointwatch_shared::wire::blob::{BLOB_LEN, BLOB_VERSION, CHECKSUM_OFFSET, decode, encode};

/// One of every base and number of axes, a network that does not use all its places, and effects on
/// every base.
fn models(seed: u64) -> [Model; 8] {
    [
        polynomial(1, seed),
        polynomial(2, seed + 1),
        network(1, 40, seed + 2),
        network(2, 40, seed + 3),
        network(2, 7, seed + 4),
        physical(2, seed + 5),
        with_effects(polynomial(1, seed + 6), seed + 6),
        with_effects(network(2, 40, seed + 7), seed + 7),
    ]
}

/// What a failing test calls a model.
fn named(model: &Model) -> String {
    let base = match model.base() {
        Base::Network(network) => format!("network of {} neurons", network.neurons().len()),
        Base::Polynomial(_) => "polynomial".into(),
        Base::None { .. } => "no base".into(),
        other => panic!("a base this test does not know: {other:?}"),
    };
    let effects = model.terms().list().len();
    format!("{base}, {} axes, {effects} effects", model.axes())
}

#[test]
fn comes_back_as_it_went() {
    let reference = [selftest::reference_model(), reference_network()].map(Model::clone);
    for model in models(1).into_iter().chain(reference) {
        let blob = encode(&model);
        assert_eq!(blob, sealed(blob));
        assert_eq!(decode(&blob).unwrap(), model);
    }
}

#[test]
fn every_truncation_is_refused() {
    for model in models(3) {
        let blob = encode(&model);
        for length in 0..BLOB_LEN {
            let wanted = BLOB_LEN;
            let refusal = decode(&blob[..length]).unwrap_err();
            assert_eq!(
                refusal,
                Error::BlobLength {
                    seen: length,
                    wanted
                }
            );
        }
        assert!(decode(&[&blob[..], &[0]].concat()).is_err());
    }
}

#[test]
fn every_flipped_bit_is_refused() {
    for model in models(4) {
        let blob = encode(&model);
        for bit in 0..8 * BLOB_LEN {
            let mut flipped = blob;
            flipped[bit / 8] ^= 1 << (bit % 8);
            let what = named(&model);
            assert!(decode(&flipped).is_err(), "{what}: bit {bit} unnoticed");
        }
    }
}

/// Evaluates in the device's integers and in 128 bits; any overflow makes them differ (or panics in
/// a debug build).
fn assert_no_overflow(model: &Model, what: &str, points: u32) {
    let seed = 11;
    let mut random = Points::new(seed);
    // Byte 39 of the documented layout.
    let shifts = encode(model)[39];
    // The full corners, where sums are largest, then random points.
    let corners = (0..CORNER_POINTS).map(corner).filter(|u| !u.contains(&0));
    for u in corners.chain((0..points).map(|_| random.next_point())) {
        let forces = model.step(&mut wide::told(model, &u), &u).map(i128::from);
        assert_eq!(
            forces,
            wide::evaluate(model, [shifts & 15, shifts >> 4], &u),
            "{what}, seed {seed}, u = {u:?}"
        );
    }
}

#[test]
fn flips_with_a_right_checksum_are_refused_or_harmless() {
    let mut all = 0;
    for model in models(6) {
        let (what, mut accepted) = (named(&model), 0);
        let blob = encode(&model);
        for bit in 0..8 * CHECKSUM_OFFSET {
            let mut flipped = blob;
            flipped[bit / 8] ^= 1 << (bit % 8);
            if let Ok(model) = decode(&sealed(flipped)) {
                accepted += 1;
                assert_no_overflow(&model, &format!("{what}, bit {bit}"), 4);
            }
        }
        // Low bits of coefficients and weights are fair game; were none accepted, this test would
        // show nothing.
        assert!(accepted > 900, "{what}: {accepted}");
        all += accepted;
    }
    assert!(all > 30_000, "{all}");
}

#[test]
fn random_damage_with_a_right_checksum_is_refused_or_harmless() {
    let seed = 7;
    let mut random = Points::new(seed);
    for model in models(8) {
        let what = named(&model);
        let blob = encode(&model);
        for round in 0..2000 {
            let mut damaged = blob;
            for _ in 0..4 {
                let [place, value, ..] = random.next_point();
                damaged[place as u32 as usize % CHECKSUM_OFFSET] = value as u8;
            }
            if let Ok(model) = decode(&sealed(damaged)) {
                assert_no_overflow(&model, &format!("{what}, round {round} of seed {seed}"), 4);
            }
        }
    }
}

#[test]
fn the_integers_are_those_of_the_wide_kernel() {
    for model in models(20).into_iter().chain(models(30)) {
        assert_no_overflow(&model, &named(&model), 20_000);
    }
    assert_no_overflow(selftest::reference_model(), "reference model", 20_000);
    assert_no_overflow(reference_network(), "reference network", 20_000);
}

/// Why a blob with these bytes at `offset` is refused.
fn refusal_with(mut blob: [u8; BLOB_LEN], offset: usize, bytes: &[u8]) -> String {
    blob[offset..offset + bytes.len()].copy_from_slice(bytes);
    decode(&sealed(blob)).unwrap_err().to_string()
}

#[test]
fn refusals_of_a_network_say_what_was_seen() {
    let blob = encode(&network(2, 7, 9));
    let with = |offset: usize, bytes: &[u8]| refusal_with(blob, offset, bytes);
    assert_eq!(
        with(6, &[9]),
        "the blob's kind of base is 9, which this program does not know"
    );
    for (offset, value) in [
        (32, 3),
        (37, 1),
        (236 + 7 * 36, 1),
        (1676, 1),
        (2392, 9),
        (3032, 1),
    ] {
        assert_eq!(
            with(offset, &[value]),
            format!("byte {offset} of the blob is {value}, but has to be 0")
        );
    }
    for count in [0_u32, 41] {
        assert_eq!(
            with(216, &count.to_le_bytes()),
            format!("number of neurons is {count}, but has to lie between 1 and 40")
        );
    }
    // One neuron fewer: what was the last one's place then has to be empty.
    assert!(with(216, &[6]).starts_with(&format!("byte {} of the blob is", 236 + 6 * 36)));
    assert_eq!(
        with(236 + 3 * 36 + 32, &[0; 4]),
        "table steps of a neuron is 0, but has to lie between 1 and 4294967295"
    );
    assert_eq!(
        with(236 + 5 * 36 + 24, &i64::MIN.to_le_bytes()),
        "the stored weights can overflow the argument of neuron 5: export the model again"
    );
    assert_eq!(
        with(228, &i64::MAX.to_le_bytes()),
        "the stored weights can overflow the force of axis 1: export the model again"
    );
    // What belongs to a second axis in a network that has one only.
    let blob = encode(&network(1, 40, 9));
    for (offset, what) in [
        (236 + 2 * 36 + 12, "weight of an input"),
        (236 + 2 * 36 + 20, "output weight"),
    ] {
        assert_eq!(
            refusal_with(blob, offset, &[5]),
            format!("the {what} of neuron 2 is 5, which the model cannot hold")
        );
    }
    assert_eq!(
        refusal_with(blob, 228, &[5]),
        "output bias of an axis that is not there is 5, but has to lie between 0 and 0"
    );
}

#[test]
fn refusals_of_effects_say_what_was_seen() {
    let blob = encode(&physical(2, 9));
    let with = |offset: usize, bytes: &[u8]| refusal_with(blob, offset, bytes);
    let count = blob[38];
    assert_eq!(usize::from(count), EFFECTS.len().min(MAX_TERMS));
    assert_eq!(
        with(38, &[9]),
        "number of effects is 9, but has to lie between 0 and 8"
    );
    // One effect fewer: what was the last one's place then has to be empty.
    let last = 2392 + 56 * (usize::from(count) - 1);
    assert!(with(38, &[count - 1]).starts_with(&format!("byte {last} of the blob is")));
    assert!(
        with(2392, &[99]).contains("effect number 99"),
        "{}",
        with(2392, &[99])
    );
    assert!(
        with(2392, &[0]).contains("effect number 0"),
        "{}",
        with(2392, &[0])
    );
    assert_eq!(
        with(2393, &[2]),
        "axis of an effect is 2, but has to lie between 0 and 1"
    );
    for (offset, value) in [
        (2394, 2),
        (2395, 1),
        (216, 1),
        (2391, 1),
        (32, 3),
        (37, 1),
        (3032, 7),
        (4091, 1),
    ] {
        assert_eq!(
            with(offset, &[value]),
            format!("byte {offset} of the blob is {value}, but has to be 0")
        );
    }
    // Name, range and origin of what effects of the second axis follow.
    assert!(with(2992, &[0; 40]).contains("follows an input, and its axis has none"));
    // The first effect of the table backwards, a preload, has one parameter.
    assert!(with(2392 + 8 + 40, &[1]).contains("where it has no parameter"));
    // A shift that no effect asks for.
    assert_eq!(
        refusal_with(encode(&polynomial(2, 9)), 39, &[1]),
        "shift of the model's base is 1, but has to lie between 0 and 0"
    );
    // An effect on an axis that a one-axis model has not, and one that needs two.
    let blob = encode(&physical(1, 9));
    assert_eq!(
        refusal_with(blob, 2393, &[1]),
        "axis of an effect is 1, but has to lie between 0 and 0"
    );
    let both = EFFECTS.iter().find(|e| e.acts == Acts::BothAxes).unwrap();
    assert!(refusal_with(blob, 2392, &[both.tag]).contains("two axes"));
}

#[test]
fn refusals_say_what_was_seen() {
    let blob = encode(&polynomial(2, 9));
    let with = |offset: usize, bytes: &[u8]| refusal_with(blob, offset, bytes);
    assert_eq!(
        with(4, &[0xff, 0xff]),
        format!(
            "the blob has format version 65535, but this program reads version {BLOB_VERSION}: export the model again"
        )
    );
    assert_eq!(
        with(0, &[0xff; 4]),
        "the blob begins with the bytes [ff, ff, ff, ff], which is not a Jointwatch model"
    );
    assert_eq!(
        with(7, &[3]),
        "number of axes is 3, but has to lie between 1 and 2"
    );
    assert_eq!(
        with(3032, &[1]),
        "byte 3032 of the blob is 1, but has to be 0"
    );
    assert_eq!(with(40, &[0xff]), "the name of axis 0 is not UTF-8");
    assert_eq!(
        with(8, &f64::NAN.to_le_bytes()),
        "sample rate in Hz is NaN, but has to lie between 1 and 1000000"
    );
    assert_eq!(
        with(216, &i32::MIN.to_le_bytes()),
        "the stored coefficients of axis 0 can overflow the sum over the powers of the last input (block x^0 x'^0): \
         export the model again"
    );
    assert_eq!(
        with(216 + 64, &(-1_i32).to_le_bytes()),
        "the coefficient of x^0 x'^0 phi^0 phi'^0 of axis 0 is -1, which the model cannot hold"
    );
}

/// Changed bytes mean a new format version: blobs in the field have to stay readable or be refused
/// by their version.
#[test]
fn the_bytes_of_the_reference_models_are_pinned() {
    for (model, pinned) in [
        (selftest::reference_model(), "8f03db48bda8d51b"),
        (reference_network(), "8c3d9d90cd56d6f3"),
    ] {
        let mut digest = Digest::new();
        for byte in encode(model) {
            digest.add(i32::from(byte));
        }
        assert_eq!(format!("{:016x}", digest.value()), pinned);
    }
}
