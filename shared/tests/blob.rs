//! The blob: it comes back as it went, damage never passes, and nothing that passes can overflow.

mod wide;

use jointwatch_shared::blob::{BLOB_LEN, BLOB_VERSION, CHECKSUM_OFFSET, decode, encode};
use jointwatch_shared::error::Error;
use jointwatch_shared::model::axis::{Axis, AxisKind, Convention, InputRange, Name, Validation};
use jointwatch_shared::model::{Base, Header, Model};
use jointwatch_shared::selftest::{self, CORNER_POINTS, Digest, Points, corner};

/// A model with a different value in every field.
fn model(axes: usize, seed: u64) -> Model {
    let axis = |number: u8| Axis {
        name: Name::new(number, ["x", "phi"][usize::from(number)]).unwrap(),
        kind: [AxisKind::Translation, AxisKind::Rotation][usize::from(number)],
        convention: [Convention::InertiaMinusForce, Convention::ForceMinusInertia]
            [usize::from(number)],
        inertia: 1.6947 + f64::from(number),
        displacement: InputRange {
            center: -1e-5 + f64::from(number),
            half_range: 2.5e-3 + f64::from(number),
        },
        velocity: InputRange {
            center: 1e-4 + f64::from(number),
            half_range: 0.3 + f64::from(number),
        },
        validation: (number == 0).then_some(Validation {
            nmse_percent: 1.4,
            relative_error: 0.12,
        }),
    };
    let header = Header {
        sample_rate_hz: 2000.0,
        band_hz: 120.0,
        state_band_hz: 400.0,
        axes: (0..axes as u8).map(axis).collect(),
    };
    let mut points = Points::new(seed);
    let coefficients: Vec<Vec<f64>> = (0..axes)
        .map(|_| {
            (0..16_u32.pow(axes as u32))
                .map(|_| f64::from(points.next_word()) * 1e-8)
                .collect()
        })
        .collect();
    let slices: Vec<&[f64]> = coefficients.iter().map(Vec::as_slice).collect();
    Model::from_polynomial(header, &[3; 4][..2 * axes], &slices, &[1e-4; 2]).unwrap()
}

/// The blob with its checksum made right, by a CRC-32 of its own.
fn sealed(mut blob: [u8; BLOB_LEN]) -> [u8; BLOB_LEN] {
    let mut crc = u32::MAX;
    for &byte in &blob[..CHECKSUM_OFFSET] {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ (0xedb8_8320 * (crc & 1));
        }
    }
    blob[CHECKSUM_OFFSET..].copy_from_slice(&(!crc).to_le_bytes());
    blob
}

#[test]
fn comes_back_as_it_went() {
    for model in [
        model(2, 1),
        model(1, 2),
        selftest::reference_model().clone(),
    ] {
        let blob = encode(&model);
        assert_eq!(blob, sealed(blob));
        assert_eq!(decode(&blob).unwrap(), model);
    }
}

#[test]
fn every_truncation_is_refused() {
    let blob = encode(&model(2, 3));
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

#[test]
fn every_flipped_bit_is_refused() {
    for model in [model(2, 4), model(1, 5)] {
        let blob = encode(&model);
        for bit in 0..8 * BLOB_LEN {
            let mut flipped = blob;
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert!(decode(&flipped).is_err(), "bit {bit} flipped unnoticed");
        }
    }
}

/// Evaluates in the device's integers and in 128 bits; any overflow makes them differ (or panics in a debug build).
fn assert_no_overflow(model: &Model, what: &str, points: u32) {
    let Base::Polynomial(polynomial) = model.base() else {
        unreachable!("these tests make polynomials only");
    };
    let seed = 11;
    let mut random = Points::new(seed);
    // The full corners, where sums are largest, then random points.
    let corners = (0..CORNER_POINTS).map(corner).filter(|u| !u.contains(&0));
    for u in corners.chain((0..points).map(|_| random.next_point())) {
        let forces = model.evaluate(&u).map(i128::from);
        assert_eq!(
            forces,
            wide::evaluate(polynomial, &u),
            "{what}, seed {seed}, u = {u:?}"
        );
    }
}

#[test]
fn flips_with_a_right_checksum_are_refused_or_harmless() {
    let mut accepted = 0;
    for axes in [1, 2] {
        let blob = encode(&model(axes, 6));
        for bit in 0..8 * CHECKSUM_OFFSET {
            let mut flipped = blob;
            flipped[bit / 8] ^= 1 << (bit % 8);
            if let Ok(model) = decode(&sealed(flipped)) {
                accepted += 1;
                assert_no_overflow(&model, &format!("bit {bit}, {axes} axes"), 4);
            }
        }
    }
    // Low bits of coefficients are fair game; were none accepted, this test would show nothing.
    assert!(accepted > 10_000, "{accepted}");
}

#[test]
fn random_damage_with_a_right_checksum_is_refused_or_harmless() {
    let seed = 7;
    let mut random = Points::new(seed);
    let blob = encode(&model(2, 8));
    for round in 0..2000 {
        let mut damaged = blob;
        for _ in 0..4 {
            let [place, value, ..] = random.next_point();
            damaged[place as u32 as usize % CHECKSUM_OFFSET] = value as u8;
        }
        if let Ok(model) = decode(&sealed(damaged)) {
            assert_no_overflow(&model, &format!("round {round} of seed {seed}"), 4);
        }
    }
}

#[test]
fn the_integers_are_those_of_the_wide_kernel() {
    for (axes, seed) in [(1, 20), (2, 21), (2, 22)] {
        assert_no_overflow(&model(axes, seed), &format!("model of seed {seed}"), 20_000);
    }
    assert_no_overflow(selftest::reference_model(), "reference model", 20_000);
}

#[test]
fn refusals_say_what_was_seen() {
    let blob = encode(&model(2, 9));
    let with = |offset: usize, bytes: &[u8]| {
        let mut changed = blob;
        changed[offset..offset + bytes.len()].copy_from_slice(bytes);
        decode(&sealed(changed)).unwrap_err().to_string()
    };
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
        with(3000, &[1]),
        "byte 3000 of the blob is 1, but has to be 0"
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

/// The offset, the length and the name of every row of the table in docs/blob.md.
fn documented_fields() -> Vec<(usize, usize, String)> {
    include_str!("../../docs/blob.md")
        .lines()
        .filter_map(|line| {
            let mut cells = line.trim_matches('|').split('|').map(str::trim);
            let offset = cells.next()?.parse().ok()?;
            let length = cells.next()?.parse().ok()?;
            Some((offset, length, cells.next()?.to_owned()))
        })
        .collect()
}

#[test]
fn the_documented_bytes_are_the_written_bytes() {
    let model = model(2, 10);
    let blob = encode(&model);
    let Base::Polynomial(polynomial) = model.base() else {
        unreachable!("made above");
    };
    let mut next = 0;
    for (offset, length, field) in documented_fields() {
        assert_eq!(
            offset, next,
            "{field} does not begin where the row above ends"
        );
        next = offset + length;
        let header = model.header();
        let (axis, name) = match field.strip_prefix("axis 1 ") {
            Some(rest) => (1, rest),
            None => (0, field.strip_prefix("axis 0 ").unwrap_or(&field)),
        };
        let (of, output) = (&header.axes[axis], &model.outputs()[axis]);
        let stored = || {
            let blocks = &polynomial.blocks()[axis];
            let words = |b: &jointwatch_shared::model::polynomial::Block| {
                b.words.into_iter().chain([b.gain]).collect::<Vec<i32>>()
            };
            blocks
                .iter()
                .flat_map(words)
                .flat_map(i32::to_le_bytes)
                .collect()
        };
        let wanted: Vec<u8> = match name {
            "magic" => b"JWMB".to_vec(),
            "version" => vec![1, 0],
            "base" => vec![1],
            "axes" => vec![2],
            "sample_rate_hz" => header.sample_rate_hz.to_le_bytes().to_vec(),
            "band_hz" => header.band_hz.to_le_bytes().to_vec(),
            "state_band_hz" => header.state_band_hz.to_le_bytes().to_vec(),
            "orders" => vec![3; 4],
            "shifts" => polynomial.shifts().to_vec(),
            "effects" | "reserved" => vec![0; length],
            "name" => format!("{:\0<16}", of.name.as_str()).into_bytes(),
            "kind" => vec![axis as u8],
            "convention" => vec![1 - axis as u8],
            "validated" => vec![1 - axis as u8],
            "inertia" => of.inertia.to_le_bytes().to_vec(),
            "displacement center" => of.displacement.center.to_le_bytes().to_vec(),
            "displacement half_range" => of.displacement.half_range.to_le_bytes().to_vec(),
            "velocity center" => of.velocity.center.to_le_bytes().to_vec(),
            "velocity half_range" => of.velocity.half_range.to_le_bytes().to_vec(),
            "force_per_lsb" => output.force_per_lsb.to_le_bytes().to_vec(),
            "error_bound" => output.error_bound.to_le_bytes().to_vec(),
            "nmse_percent" => of
                .validation
                .map_or(0.0, |v| v.nmse_percent)
                .to_le_bytes()
                .to_vec(),
            "relative_error" => of
                .validation
                .map_or(0.0, |v| v.relative_error)
                .to_le_bytes()
                .to_vec(),
            "blocks" => stored(),
            "padding" => vec![0; length],
            "checksum" => sealed(blob)[CHECKSUM_OFFSET..].to_vec(),
            unknown => {
                panic!("docs/blob.md has the field {unknown}, which this test does not know")
            }
        };
        assert_eq!(blob[offset..next], wanted, "{field}");
    }
    assert_eq!(next, BLOB_LEN, "the table ends before the blob does");
}

/// Changed bytes mean a new format version: blobs in the field have to stay readable or be refused by their version.
#[test]
fn the_bytes_of_the_reference_model_are_pinned() {
    let mut digest = Digest::new();
    for byte in encode(selftest::reference_model()) {
        digest.add(i32::from(byte));
    }
    assert_eq!(format!("{:016x}", digest.value()), "335fe79119de18e6");
}
