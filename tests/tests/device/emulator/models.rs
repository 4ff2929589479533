//! Models of every kind, and effects beside them.

use jointwatch_shared::base::axis::{Input, InputRange, Name};
use jointwatch_shared::base::network_quantise::Weights;
use jointwatch_shared::base::terms::EffectValues;
use jointwatch_shared::base::{Header, Model};
use jointwatch_shared::effect::about::{Parameter, Role};
use jointwatch_shared::effect::{EFFECTS, Entry, Subsystem};
use jointwatch_shared::selftest::{Points, reference_model};
use jointwatch_shared::units::References;

/// A dense model of one or two axes with coefficients of very different size, another one for every
/// seed.
pub(crate) fn model(axes: usize, seed: u64) -> Model {
    let mut points = Points::new(seed);
    let terms = 16_usize.pow(axes as u32);
    let coefficients: Vec<Vec<f64>> = (0..axes)
        .map(|_| {
            let mut next = || f64::from(points.next_word()) / f64::from(1 << 28);
            (0..terms).map(|_| next() * next().powi(3)).collect()
        })
        .collect();
    let coefficients: Vec<&[f64]> = coefficients.iter().map(Vec::as_slice).collect();
    let any = vec![f64::INFINITY; axes];
    let model = Model::from_polynomial(header(axes), &vec![3; 2 * axes], &coefficients, &any);
    model.expect("a sound model")
}

/// A network of one or two axes with weights of very different size, another one for every seed.
pub(crate) fn network(axes: usize, neurons: usize, seed: u64) -> Model {
    let mut points = Points::new(seed);
    let mut draw = |count: usize| -> Vec<f64> {
        let mut next = || f64::from(points.next_word()) / f64::from(1 << 29);
        (0..count).map(|_| next() * next().powi(2)).collect()
    };
    let output: Vec<Vec<f64>> = (0..axes).map(|_| draw(neurons)).collect();
    let weights = Weights {
        hidden: &draw(2 * axes * neurons),
        hidden_bias: &draw(neurons),
        output: &output.iter().map(Vec::as_slice).collect::<Vec<_>>(),
        output_bias: &draw(axes),
    };
    let any = vec![f64::INFINITY; axes];
    Model::from_network(header(axes), &weights, &any).expect("a sound model")
}

/// The effects with which the device begins, on every axis: values of a joint that fills the
/// reference models' range.
fn effects(axes: usize) -> Vec<EffectValues> {
    let header = header(axes);
    let mut terms = Vec::new();
    for (at, axis) in (0..).zip(&header.axes) {
        let (x, v) = (axis.displacement.half_range, axis.velocity.half_range);
        let values = [
            ("stiffness", vec![30.0 / x]),
            ("viscous", vec![7.0 / v]),
            ("clearance", vec![500.0 / x, 0.6 * x]),
            ("coulomb", vec![11.0, 0.01 * v]),
            ("cubic_hardening", vec![17.0 / x.powi(3)]),
            ("preload", vec![-3.0]),
        ];
        // Eight effects are the most that a model holds: on two axes each gets every other one.
        let mine = values
            .into_iter()
            .enumerate()
            .filter(|(number, _)| axes == 1 || (number + usize::from(at)) % 2 == 0);
        for (_, (name, values)) in mine {
            let entry = Entry::named(name).expect("an effect of the table");
            assert_eq!(entry.parameters().len(), values.len(), "{name}");
            let axis = at;
            terms.push(EffectValues {
                input: None,
                entry,
                axis,
                values,
            });
        }
    }
    if let [first, second] = &header.axes[..] {
        let entry = Entry::named("clearance_coupling").expect("an effect of the table");
        let [v, omega] = [first, second].map(|axis| axis.velocity.half_range);
        let [x, phi] = [first, second].map(|axis| axis.displacement.half_range);
        let values = vec![
            5.0 / (v * phi),
            0.4 / (omega * x),
            9.0 / omega,
            0.8 / v,
            0.3 * x,
            0.5 * phi,
        ];
        terms.push(EffectValues {
            input: None,
            entry,
            axis: 0,
            values,
        });
    }
    terms
}

/// An effect on the first axis, of which each linear parameter makes a force of some newtons and
/// each shape has a middle one of its starting values.
fn in_the_middle(entry: &'static Entry, header: &Header) -> EffectValues {
    let mut references = References::SI;
    for (at, axis) in header.axes.iter().enumerate() {
        references.displacement[at] = axis.displacement.half_range;
        references.velocity[at] = axis.velocity.half_range;
    }
    let value = |parameter: &Parameter| {
        let size = match parameter.role {
            Role::Linear { .. } | Role::SizePerRecord { .. } => 5.0,
            Role::Shape(shape) => shape.starts[shape.starts.len() / 2],
        };
        size * parameter.dimension.scale(&references)
    };
    EffectValues {
        input: None,
        entry,
        axis: 0,
        values: entry.parameters().iter().map(value).collect(),
    }
}

/// A model with one effect more beside its base, on the first axis.
pub(crate) fn with_effect(base: Model, entry: &'static Entry) -> Model {
    let term = in_the_middle(entry, base.header());
    base.adding_effects(&[term], &[]).expect("a sound model")
}

/// Every effect of the joint in models of eight, on one axis where it can be. Hystereses among them
/// carry their states from point to point.
pub(crate) fn of_the_table() -> Vec<Model> {
    let joint = EFFECTS.iter().filter(|e| e.subsystem == Subsystem::Plant);
    let (two, one): (Vec<&Entry>, Vec<&Entry>) = joint.partition(|e| e.needs_two_axes());
    let model = |axes: usize, entries: &[&'static Entry]| {
        let header = header(axes);
        let terms: Vec<EffectValues> = entries.iter().map(|e| in_the_middle(e, &header)).collect();
        Model::from_effects(header, &terms, &[]).expect("a sound model")
    };
    let mut models: Vec<Model> = one.chunks(8).map(|entries| model(1, entries)).collect();
    models.push(model(2, &two));
    models.push(following(&one[..8]));
    models
}

/// Effects of one axis that follow its input, some behind a lag, some its square.
fn following(entries: &[&'static Entry]) -> Model {
    let mut header = header(1);
    header.axes[0].input = Some(Input {
        name: Name::new(0, "voltage").expect("a sound name"),
        range: InputRange {
            center: 1.5,
            half_range: 4.0,
        },
    });
    let names = ["voltage", "voltage~8ms", "voltage^2~3ms"]
        .into_iter()
        .cycle();
    let terms = entries
        .iter()
        .zip(names)
        .map(|(entry, input)| EffectValues {
            input: Some(input),
            ..in_the_middle(entry, &header)
        });
    let terms: Vec<EffectValues> = terms.collect();
    Model::from_effects(header, &terms, &[]).expect("a sound model")
}

/// A model of effects alone.
pub(crate) fn physical(axes: usize) -> Model {
    Model::from_effects(header(axes), &effects(axes), &[]).expect("a sound model")
}

/// A model with one effect with memory beside its base, Dahl's friction.
pub(crate) fn with_memory(base: Model) -> Model {
    let [x, _] = &base.header().axes[..] else {
        panic!("two axes");
    };
    let dahl = EffectValues {
        input: None,
        entry: Entry::named("dahl").expect("an effect of the table"),
        axis: 0,
        values: vec![11.0, 0.05 * x.displacement.half_range],
    };
    base.adding_effects(&[dahl], &[]).expect("a sound model")
}

/// A model with effects beside its base.
pub(crate) fn with_effects(base: Model) -> Model {
    let terms = effects(base.axes());
    base.adding_effects(&terms, &[]).expect("a sound model")
}

/// The header of the reference models, or that of their first axis alone.
fn header(axes: usize) -> Header {
    let known = reference_model().header();
    Header {
        axes: known.axes.iter().take(axes).cloned().collect(),
        ..known.clone()
    }
}
