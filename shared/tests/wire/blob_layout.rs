//! The bytes that docs/reference/blob.md lists are the bytes that are written.

use super::sample_models::{network, physical, polynomial, sealed, with_effects};
use jointwatch_shared::base::axis::Validation;
use jointwatch_shared::base::{Base, Model};
use jointwatch_shared::effect::EFFECTS;
use jointwatch_shared::wire::blob::{BLOB_LEN, CHECKSUM_OFFSET, encode};

/// The offset, the length and the name of every row of the tables of docs/reference/blob.md: the
/// blob, a network's base, and an effect.
fn documented_fields() -> [Vec<(usize, usize, String)>; 3] {
    let page = include_str!("../../../docs/reference/blob.md");
    let (blob, rest) = page.split_once("## A network").unwrap();
    let (network, effect) = rest.split_once("## The effects").unwrap();
    [blob, network, effect].map(|text| {
        let rows = text.lines().filter_map(|line| {
            let mut cells = line.trim_matches('|').split('|').map(str::trim);
            let offset = cells.next()?.parse().ok()?;
            let length = cells.next()?.parse().ok()?;
            Some((offset, length, cells.next()?.to_owned()))
        });
        rows.collect()
    })
}

/// The bytes that the row `name` of the table of the whole blob states for a two-axis model of
/// seed 10.
fn documented_bytes(model: &Model, axis: usize, name: &str, length: usize) -> Vec<u8> {
    let header = model.header();
    let (of, output) = (&header.axes[axis], &model.outputs()[axis]);
    let validation = |value: fn(Validation) -> f32| of.validation.map_or(0.0, value);
    let (tag, orders, shifts) = match model.base() {
        Base::Polynomial(polynomial) => (1, [3; 4], polynomial.shifts()),
        Base::Network(_) => (2, [0; 4], [0; 2]),
        Base::None { .. } => (3, [0; 4], [0; 2]),
        other => panic!("a base this test does not know: {other:?}"),
    };
    match name {
        "magic" => b"JWMB".to_vec(),
        "version" => vec![3, 0],
        "base" => vec![tag],
        "axes" => vec![2],
        "sample_rate_hz" => header.sample_rate_hz.to_le_bytes().to_vec(),
        "band_hz" => header.band_hz.to_le_bytes().to_vec(),
        "state_band_hz" => header.state_band_hz.to_le_bytes().to_vec(),
        "orders" => orders.to_vec(),
        "shifts" => shifts.to_vec(),
        "effects" => vec![model.terms().list().len() as u8],
        "base_shifts" => base_shifts(model),
        "effect 0" => places(model, 0..1),
        "effects 1 to 7" => places(model, 1..8),
        "reserved" | "padding" => vec![0; length],
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
        "excess" => model.corrections()[axis].excess.to_le_bytes().to_vec(),
        "cross" => model.corrections()[axis].cross.to_le_bytes().to_vec(),
        "origins" if model.terms().list().is_empty() => vec![0; 32],
        "origins" => header
            .axes
            .iter()
            .flat_map(|axis| [axis.displacement, axis.velocity])
            .map(|range| (range.center / range.half_range * 32_f64.exp2() + 0.5).floor() as i64)
            .flat_map(i64::to_le_bytes)
            .collect(),
        "input name" => format!("{:\0<16}", of.input.unwrap().name.as_str()).into_bytes(),
        "input center" => of.input.unwrap().range.center.to_le_bytes().to_vec(),
        "input half_range" => of.input.unwrap().range.half_range.to_le_bytes().to_vec(),
        "input origin" => model.terms().followed_origins()[axis]
            .raw()
            .to_le_bytes()
            .to_vec(),
        "delay" => model.corrections()[axis].delay_s.to_le_bytes().to_vec(),
        "hum_hz" => model.corrections()[axis]
            .hum
            .frequency_hz
            .to_le_bytes()
            .to_vec(),
        "hum_amplitude" => model.corrections()[axis]
            .hum
            .amplitude
            .to_le_bytes()
            .to_vec(),
        "error_bound" => output.error_bound.to_le_bytes().to_vec(),
        "nmse_percent" => validation(|v| v.nmse_percent).to_le_bytes().to_vec(),
        "relative_error" => validation(|v| v.relative_error).to_le_bytes().to_vec(),
        "blocks" => blocks(model, axis),
        "checksum" => sealed(encode(model))[CHECKSUM_OFFSET..].to_vec(),
        unknown => {
            panic!("docs/reference/blob.md has the field {unknown}, which this test does not know")
        }
    }
}

/// The byte that says how far the effects' force unit is from the base's, as that of the base alone
/// shows it.
fn base_shifts(model: &Model) -> Vec<u8> {
    let alone = match model.base() {
        Base::Polynomial(_) => polynomial(2, 10),
        Base::Network(_) => network(2, 40, 10),
        Base::None { .. } => return vec![0],
        other => panic!("a base this test does not know: {other:?}"),
    };
    let units = model.outputs().iter().zip(alone.outputs());
    let shifts = units.map(|(with, without)| (with.force_per_lsb / without.force_per_lsb).log2());
    let [first, second] = shifts.map(|s| s as u8).collect::<Vec<_>>()[..] else {
        panic!("two axes");
    };
    vec![first | second << 4]
}

/// The places of these numbers, one after the other.
fn places(model: &Model, numbers: std::ops::Range<usize>) -> Vec<u8> {
    let place = |number: usize| match model.terms().list().get(number) {
        Some(term) => {
            let mut bytes = vec![
                term.entry().tag,
                term.axis() as u8,
                u8::from(term.squared()),
                0,
            ];
            let follows = term.follows().map_or(0, |share| share.raw() - 1);
            bytes.extend((follows as u32).to_le_bytes());
            bytes.extend(term.parameters().iter().flat_map(|p| p.raw().to_le_bytes()));
            bytes
        }
        None => vec![0; 56],
    };
    numbers.flat_map(place).collect()
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
    let [whole, base, effect] = documented_fields();
    for model in [
        polynomial(2, 10),
        network(2, 40, 10),
        physical(2, 10),
        with_effects(polynomial(2, 10), 10),
        with_effects(network(2, 40, 10), 10),
    ] {
        let blob = encode(&model);
        let mut next = 0;
        for (offset, length, field) in &whole {
            assert_eq!(*offset, next, "{field} does not follow the row above");
            next = offset + length;
            if field.ends_with("blocks") && !matches!(model.base(), Base::Polynomial(_)) {
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
    // The fields of an effect fill the place that the table of the whole blob gives it.
    let start = |name: &str| whole.iter().find(|row| row.2 == name).unwrap().0;
    let mut next = start("effect 0");
    for (offset, length, field) in &effect {
        assert_eq!(*offset, next, "{field} does not follow the row above");
        next = offset + length;
    }
    assert_eq!(next, start("effects 1 to 7"));
    let fields: Vec<&str> = effect.iter().map(|row| row.2.as_str()).collect();
    assert_eq!(
        fields,
        [
            "tag",
            "axis",
            "squared",
            "reserved",
            "follows",
            "parameters"
        ]
    );
    // Every effect of the table stands with its number on the page that is generated from it.
    let page = include_str!("../../../docs/reference/effects.md");
    for entry in EFFECTS {
        let mut rows = page.lines().filter(|line| line.starts_with("| ["));
        let (name, number) = (format!("[{}]", entry.about.name), entry.tag.to_string());
        let mut row = rows.find(|row| row.contains(&name)).unwrap().split('|');
        let last = row.rfind(|cell| !cell.trim().is_empty()).map(str::trim);
        assert_eq!(
            last,
            Some(number.as_str()),
            "{name} in docs/reference/effects.md"
        );
    }
}

#[test]
fn the_documented_bytes_of_a_network_are_the_written_bytes() {
    let model = network(2, 40, 11);
    let blob = encode(&model);
    let Base::Network(network) = model.base() else {
        panic!("made above");
    };
    let [whole, base, _] = documented_fields();
    let (effects, ..) = whole.iter().find(|row| row.2 == "effect 0").unwrap();
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
                panic!(
                    "docs/reference/blob.md has the field {unknown}, which this test does not know"
                )
            }
        };
        assert_eq!(blob[offset..next], wanted, "{field}");
    }
    assert_eq!(next, *effects, "the table ends before the base does");
}
