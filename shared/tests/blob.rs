//! The blob: it comes back as it went, damage never passes, and nothing that passes can overflow.

mod wide;

use jointwatch_shared::blob::{BLOB_LEN, BLOB_VERSION, CHECKSUM_OFFSET, decode, encode};
use jointwatch_shared::error::Error;
use jointwatch_shared::model::axis::{Axis, AxisKind, Convention, InputRange, Name, Validation};
use jointwatch_shared::model::corrections::ForceCorrection;
use jointwatch_shared::model::network_quantise::Weights;
use jointwatch_shared::model::{Base, Header, Model};
use jointwatch_shared::selftest::{self, CORNER_POINTS, Digest, Points, corner};
use jointwatch_shared::selftest_network::reference_network;

/// A header with a different value in every field.
fn header(axes: usize) -> Header {
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
    Header {
        sample_rate_hz: 2000.0,
        band_hz: 120.0,
        state_band_hz: 400.0,
        axes: (0..axes as u8).map(axis).collect(),
    }
}

/// The model for a rig whose force channels are wrong in every way that its number of axes allows.
fn corrected(model: Model) -> Model {
    let wrong = |axis: usize| ForceCorrection {
        excess: 0.03 - 0.1 * axis as f64,
        cross: if model.axes() == 2 {
            0.25 + axis as f64
        } else {
            0.0
        },
        delay_s: 8e-4 - 1e-3 * axis as f64,
    };
    let second = if model.axes() == 2 {
        wrong(1)
    } else {
        ForceCorrection::NONE
    };
    let corrections = [wrong(0), second];
    model.correcting(corrections).unwrap()
}

/// A polynomial with a different value in every field.
fn polynomial(axes: usize, seed: u64) -> Model {
    let mut points = Points::new(seed);
    let coefficients: Vec<Vec<f64>> = (0..axes)
        .map(|_| {
            (0..16_u32.pow(axes as u32))
                .map(|_| f64::from(points.next_word()) * 1e-8)
                .collect()
        })
        .collect();
    let slices: Vec<&[f64]> = coefficients.iter().map(Vec::as_slice).collect();
    let model = Model::from_polynomial(header(axes), &[3; 4][..2 * axes], &slices, &[1e-4; 2]);
    corrected(model.unwrap())
}

/// A network with a different value in every field, of weights of up to 2 and forces of up to some hundred newtons.
fn network(axes: usize, neurons: usize, seed: u64) -> Model {
    let mut points = Points::new(seed);
    let mut draw = |count: usize, size: f64| -> Vec<f64> {
        let unit = |word| size * f64::from(word) / 2_f64.powi(31);
        (0..count).map(|_| unit(points.next_word())).collect()
    };
    let hidden = draw(2 * axes * neurons, 2.0);
    let hidden_bias = draw(neurons, 2.0);
    let output: Vec<Vec<f64>> = (0..axes).map(|_| draw(neurons, 37.0)).collect();
    let output: Vec<&[f64]> = output.iter().map(Vec::as_slice).collect();
    let weights = Weights {
        hidden: &hidden,
        hidden_bias: &hidden_bias,
        output: &output,
        output_bias: &draw(axes, 11.0),
    };
    Model::from_network(header(axes), &weights, &[1e-4; 2]).unwrap()
}

/// One of every base and number of axes, and a network that does not use all its places.
fn models(seed: u64) -> [Model; 5] {
    [
        polynomial(1, seed),
        polynomial(2, seed + 1),
        network(1, 40, seed + 2),
        network(2, 40, seed + 3),
        network(2, 7, seed + 4),
    ]
}

/// What a failing test calls a model.
fn named(model: &Model) -> String {
    match model.base() {
        Base::Network(network) => format!(
            "network of {} neurons, {} axes",
            network.neurons().len(),
            model.axes()
        ),
        _ => format!("polynomial, {} axes", model.axes()),
    }
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

/// Evaluates in the device's integers and in 128 bits; any overflow makes them differ (or panics in a debug build).
fn assert_no_overflow(model: &Model, what: &str, points: u32) {
    let seed = 11;
    let mut random = Points::new(seed);
    // The full corners, where sums are largest, then random points.
    let corners = (0..CORNER_POINTS).map(corner).filter(|u| !u.contains(&0));
    for u in corners.chain((0..points).map(|_| random.next_point())) {
        let forces = model.evaluate(&u).map(i128::from);
        assert_eq!(
            forces,
            wide::evaluate(model, &u),
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
        // Low bits of coefficients and weights are fair game; were none accepted, this test would show nothing.
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
    for (offset, value) in [(32, 3), (37, 1), (236 + 7 * 36, 1), (1676, 1), (2392, 9)] {
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

/// The offset, the length and the name of every row of the tables of docs/blob.md: the blob, and a network's base.
fn documented_fields() -> [Vec<(usize, usize, String)>; 2] {
    let page = include_str!("../../docs/blob.md");
    let (blob, network) = page.split_once("## A network").unwrap();
    [blob, network].map(|text| {
        let rows = text.lines().filter_map(|line| {
            let mut cells = line.trim_matches('|').split('|').map(str::trim);
            let offset = cells.next()?.parse().ok()?;
            let length = cells.next()?.parse().ok()?;
            Some((offset, length, cells.next()?.to_owned()))
        });
        rows.collect()
    })
}

/// The bytes that the row `name` of the table of the whole blob states for a two-axis model of seed 10.
fn documented_bytes(model: &Model, axis: usize, name: &str, length: usize) -> Vec<u8> {
    let header = model.header();
    let (of, output) = (&header.axes[axis], &model.outputs()[axis]);
    let validation = |value: fn(Validation) -> f32| of.validation.map_or(0.0, value);
    let (tag, orders, shifts) = match model.base() {
        Base::Polynomial(polynomial) => (1, [3; 4], polynomial.shifts()),
        _ => (2, [0; 4], [0; 2]),
    };
    match name {
        "magic" => b"JWMB".to_vec(),
        "version" => vec![1, 0],
        "base" => vec![tag],
        "axes" => vec![2],
        "sample_rate_hz" => header.sample_rate_hz.to_le_bytes().to_vec(),
        "band_hz" => header.band_hz.to_le_bytes().to_vec(),
        "state_band_hz" => header.state_band_hz.to_le_bytes().to_vec(),
        "orders" => orders.to_vec(),
        "shifts" => shifts.to_vec(),
        "effects" | "reserved" | "padding" => vec![0; length],
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
        "nmse_percent" => validation(|v| v.nmse_percent).to_le_bytes().to_vec(),
        "relative_error" => validation(|v| v.relative_error).to_le_bytes().to_vec(),
        "excess" => model.corrections()[axis].excess.to_le_bytes().to_vec(),
        "cross" => model.corrections()[axis].cross.to_le_bytes().to_vec(),
        "delay" => model.corrections()[axis].delay_s.to_le_bytes().to_vec(),
        "blocks" => blocks(model, axis),
        "checksum" => sealed(encode(model))[CHECKSUM_OFFSET..].to_vec(),
        unknown => panic!("docs/blob.md has the field {unknown}, which this test does not know"),
    }
}

/// The words and gains of one axis of a polynomial.
fn blocks(model: &Model, axis: usize) -> Vec<u8> {
    let Base::Polynomial(polynomial) = model.base() else {
        panic!("only a polynomial has blocks");
    };
    let blocks = polynomial.blocks()[axis].iter();
    let words = blocks.flat_map(|b| b.words.into_iter().chain([b.gain]));
    words.flat_map(i32::to_le_bytes).collect()
}

#[test]
fn the_documented_bytes_are_the_written_bytes() {
    let [whole, base] = documented_fields();
    for model in [polynomial(2, 10), network(2, 40, 10)] {
        let blob = encode(&model);
        let mut next = 0;
        for (offset, length, field) in &whole {
            assert_eq!(*offset, next, "{field} does not follow the row above");
            next = offset + length;
            if field.ends_with("blocks") && matches!(model.base(), Base::Network(_)) {
                continue;
            }
            let (axis, name) = match field.strip_prefix("axis 1 ") {
                Some(rest) => (1, rest),
                None => (0, field.strip_prefix("axis 0 ").unwrap_or(field)),
            };
            let wanted = documented_bytes(&model, axis, name, *length);
            assert_eq!(blob[*offset..next], wanted, "{field}");
        }
        assert_eq!(next, BLOB_LEN, "the table ends before the blob does");
    }
    assert_eq!(
        whole
            .iter()
            .find(|row| row.2 == "axis 0 blocks")
            .map(|row| row.0),
        base.first().map(|row| row.0)
    );
}

#[test]
fn the_documented_bytes_of_a_network_are_the_written_bytes() {
    let model = network(2, 40, 11);
    let blob = encode(&model);
    let Base::Network(network) = model.base() else {
        panic!("made above");
    };
    let [whole, base] = documented_fields();
    let (padding, ..) = whole.iter().find(|row| row.2 == "padding").unwrap();
    let mut next = 216;
    for (offset, length, field) in base {
        assert_eq!(offset, next, "{field} does not follow the row above");
        next = offset + length;
        let neuron = &network.neurons()[0];
        let words = |words: &[i32]| words.iter().flat_map(|w| w.to_le_bytes()).collect();
        let wanted: Vec<u8> = match field.as_str() {
            "neurons" => vec![40, 0, 0, 0],
            "axis 0 bias" => network.output_bias()[0].to_le_bytes().to_vec(),
            "axis 1 bias" => network.output_bias()[1].to_le_bytes().to_vec(),
            "neuron 0 weights" => words(&neuron.weights),
            "neuron 0 outputs" => words(&neuron.outputs),
            "neuron 0 bias" => neuron.bias.to_le_bytes().to_vec(),
            "neuron 0 steps" => neuron.steps.to_le_bytes().to_vec(),
            "neurons 1 to 39" => network.neurons()[1..]
                .iter()
                .flat_map(|n| {
                    let sums: Vec<u8> = words(&n.weights);
                    let outputs: Vec<u8> = words(&n.outputs);
                    [
                        sums,
                        outputs,
                        n.bias.to_le_bytes().to_vec(),
                        n.steps.to_le_bytes().to_vec(),
                    ]
                    .concat()
                })
                .collect(),
            "rest" => vec![0; length],
            unknown => {
                panic!("docs/blob.md has the field {unknown}, which this test does not know")
            }
        };
        assert_eq!(blob[offset..next], wanted, "{field}");
    }
    assert_eq!(next, *padding, "the table ends before the base does");
}

/// Changed bytes mean a new format version: blobs in the field have to stay readable or be refused by their version.
#[test]
fn the_bytes_of_the_reference_models_are_pinned() {
    for (model, pinned) in [
        (selftest::reference_model(), "335fe79119de18e6"),
        (reference_network(), "8814910979a6b35a"),
    ] {
        let mut digest = Digest::new();
        for byte in encode(model) {
            digest.add(i32::from(byte));
        }
        assert_eq!(format!("{:016x}", digest.value()), pinned);
    }
}
