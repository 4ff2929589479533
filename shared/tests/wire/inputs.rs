//! What a force follows beside the motion: read in time with it, behind its lag, held at the edge
//! of its range, and asked for by the model.

use super::sample_rigs::{block, model as plain};
use super::wide;
use jointwatch_shared::base::axis::{Input, InputRange, Name};
use jointwatch_shared::base::network_quantise::Weights;
use jointwatch_shared::base::terms::EffectValues;
use jointwatch_shared::base::{Header, Model};
use jointwatch_shared::chain::{Chain, ChainState, Output, RawAxis, RawSample};
use jointwatch_shared::effect::Entry;
use jointwatch_shared::fault::Error;
use jointwatch_shared::scalar::fixed::q31_to_f64;
use jointwatch_shared::selftest::Points;
use jointwatch_shared::wire::blob;
use jointwatch_shared::wire::rig::{ChannelDelays, Rig};

const LAG_S: f64 = 0.02;

fn effect(name: &str, input: &'static str, value: f64) -> EffectValues {
    EffectValues {
        entry: Entry::named(name).unwrap(),
        axis: 0,
        input: Some(input),
        values: vec![value],
    }
}

/// One axis that has a voltage of −1 to 9 V.
fn header() -> Header {
    let mut header: Header = plain(1).header().clone();
    header.axes[0].input = Some(Input {
        name: Name::new(0, "voltage").unwrap(),
        range: InputRange {
            center: 4.0,
            half_range: 5.0,
        },
    });
    header
}

/// A force of 3 N/V behind a lag, and a spring of 5000 N/m/V without one.
fn model() -> Model {
    let effects = [
        effect("preload", "voltage~20ms", 3.0),
        effect("stiffness", "voltage", 5000.0),
    ];
    Model::from_effects(header(), &effects, &[]).unwrap()
}

/// Numbers up to 1 in size.
fn numbers(seed: u64, count: usize) -> Vec<f64> {
    let mut points = Points::new(seed);
    (0..count).map(|_| q31_to_f64(points.next_word())).collect()
}

/// 2 V at count 0, 1 µV a count.
fn rig(delay_samples: f64) -> Rig {
    let mut rig = block(1, false);
    rig.axes[0].delays = ChannelDelays {
        input: delay_samples,
        ..ChannelDelays::default()
    };
    rig
}

/// Samples of a motion and a voltage, both in SI.
fn samples(rig: &Rig, rows: usize) -> (Vec<RawSample>, Vec<[f64; 2]>) {
    let axis = &rig.axes[0];
    let row = |n: usize| {
        let t = n as f64 / rig.sample_rate_hz;
        let counts = (3000.0 * (80.0 * t).sin()).round() as i32;
        let code = (4e6 * (31.0 * t).sin() + 1.5e6).round() as i32;
        let raw = RawAxis {
            displacement: [counts, 0],
            input: code,
            ..RawAxis::default()
        };
        let x = axis.displacement_step * f64::from(counts);
        let voltage = axis.input_zero + axis.input_step * f64::from(code);
        ([raw, RawAxis::default()], [x, voltage])
    };
    (0..rows).map(row).unzip()
}

fn outputs(chain: &Chain, model: &Model, samples: &[RawSample]) -> Vec<Output> {
    let mut state = ChainState::default();
    let steps = samples.iter();
    steps
        .filter_map(|raw| chain.step(&mut state, model, raw))
        .collect()
}

#[test]
fn a_force_follows_the_input_of_its_own_instant_behind_its_lag() {
    let (model, rig) = (model(), rig(0.0));
    let chain = Chain::new(&model, &rig).unwrap();
    let (raw, si) = samples(&rig, 4000);
    let outputs = outputs(&chain, &model, &raw);
    let share = 1.0 - (-1.0 / (rig.sample_rate_hz * LAG_S)).exp();
    let mut lagged = si[chain.first_row()][1];
    let (mut largest, mut most) = (0.0_f64, 0.0_f64);
    for (output, [x, voltage]) in outputs.iter().zip(&si[chain.first_row()..]) {
        lagged += share * (voltage - lagged);
        let wanted = 3.0 * lagged + 5000.0 * voltage * x;
        let seen = f64::from(output.predicted[0]) * model.outputs()[0].force_per_lsb;
        largest = largest.max((seen - wanted).abs());
        most = most.max(wanted.abs());
        assert_eq!(output.outside, 0);
    }
    let bound = model.outputs()[0].error_bound;
    println!("off by {largest:e} N of {most} N, bound {bound:e}");
    assert!(
        most > 100.0 && largest <= bound,
        "{largest:e} above {bound:e}"
    );
}

#[test]
fn an_input_that_is_late_is_read_between_its_samples() {
    let model = model();
    let (early, late) = (rig(0.0), rig(0.5));
    let chains = [&early, &late].map(|rig| Chain::new(&model, rig).unwrap());
    let (raw, _) = samples(&early, 4000);
    // The same voltage, half a sample earlier: every code is the mean of two.
    let mut shifted = raw.clone();
    for (n, sample) in shifted.iter_mut().enumerate().skip(1) {
        sample[0].input = (raw[n - 1][0].input + raw[n][0].input) / 2;
    }
    let seen = outputs(&chains[1], &model, &shifted);
    let wanted = outputs(&chains[0], &model, &raw);
    let force = |o: &Output| f64::from(o.predicted[0]) * model.outputs()[0].force_per_lsb;
    for (a, b) in seen.iter().zip(&wanted).skip(10) {
        assert!(
            (force(a) - force(b)).abs() < 0.05,
            "{} {}",
            force(a),
            force(b)
        );
    }
    // Without making up for it the force would be another one.
    let uncorrected = outputs(&chains[0], &model, &shifted);
    let pairs = uncorrected.iter().zip(&wanted).skip(10);
    let largest = pairs.fold(0.0_f64, |most, (a, b)| {
        most.max((force(a) - force(b)).abs())
    });
    assert!(largest > 0.3, "{largest}");
}

#[test]
fn an_input_outside_its_range_is_said_and_held_at_the_edge() {
    let (model, rig) = (model(), rig(0.0));
    let chain = Chain::new(&model, &rig).unwrap();
    let of = |voltage: f64| {
        let raw = RawAxis {
            input: ((voltage - 2.0) / 1e-6).round() as i32,
            ..RawAxis::default()
        };
        *outputs(&chain, &model, &[[raw, RawAxis::default()]; 2000])
            .last()
            .unwrap()
    };
    let force = |o: &Output| f64::from(o.predicted[0]) * model.outputs()[0].force_per_lsb;
    assert_eq!(of(8.9).outside, 0);
    for (voltage, edge) in [(12.0, 9.0), (-3.0, -1.0)] {
        let output = of(voltage);
        assert_eq!(output.outside, 1 << 4, "{voltage} V");
        assert!(
            (force(&output) - 3.0 * edge).abs() < 1e-3,
            "{}",
            force(&output)
        );
    }
}

#[test]
fn a_model_that_follows_an_input_asks_the_rig_for_it() {
    let (model, mut rig) = (model(), rig(0.0));
    rig.wiring.axes[0].input = None;
    rig.axes[0].input_step = 0.0;
    rig.axes[0].input_zero = 0.0;
    let refusal = Chain::new(&model, &rig).unwrap_err().to_string();
    assert!(
        refusal.contains("input channels that the model follows is 0"),
        "{refusal}"
    );
    // And a rig may have an input that no effect follows.
    assert!(Chain::new(&plain(1), &block(1, false)).is_ok());
}

/// Holds a model without effects against the same in wide integers and in `f64`, from the motion
/// and the voltage of many samples, and against what a blob of it decodes to.
fn holds(model: &Model, exact: impl Fn([f64; 3]) -> f64) {
    let decoded = blob::decode(&blob::encode(model)).unwrap();
    assert_eq!(&decoded, model);
    let mut points = Points::new(77);
    let (unit, bound) = (
        model.outputs()[0].force_per_lsb,
        model.outputs()[0].error_bound,
    );
    let (mut largest, mut most) = (0.0_f64, 0.0_f64);
    for _ in 0..20_000 {
        let u = points.next_point();
        let [x, v, voltage, _] = u;
        let mut memory = wide::told(model, &u);
        // What stands in the place of another axis does not matter.
        let [force, none] = decoded.step(&mut memory, &[x, v, voltage, 17]);
        assert_eq!(none, 0);
        assert_eq!(i128::from(force), wide::evaluate(model, [0; 2], &u)[0]);
        let wanted = exact([x, v, voltage].map(q31_to_f64));
        largest = largest.max((f64::from(force) * unit - wanted).abs());
        most = most.max(wanted.abs());
    }
    println!("off by {largest:e} N of {most} N, bound {bound:e} N");
    assert!(
        largest <= bound && bound < 1e-6 * most,
        "{largest:e} above {bound:e}"
    );
}

#[test]
fn a_polynomial_of_one_axis_follows_its_input() {
    for orders in [[3, 3, 3], [2, 3, 1], [0, 0, 2]] {
        let sides = orders.map(|order| usize::from(order) + 1);
        let coefficients = numbers(5, sides.iter().product());
        let model = Model::from_polynomial(header(), &orders, &[&coefficients], &[1e-4]).unwrap();
        holds(&model, |[x, v, w]| {
            let term = |(n, c): (usize, &f64)| {
                let exponents = [
                    n / sides[2] / sides[1],
                    n / sides[2] % sides[1],
                    n % sides[2],
                ];
                let [i, j, k] = exponents.map(|e| e as i32);
                c * x.powi(i) * v.powi(j) * w.powi(k)
            };
            coefficients.iter().enumerate().map(term).sum()
        });
    }
}

#[test]
fn a_network_of_one_axis_follows_its_input() {
    let (hidden, hidden_bias) = (numbers(6, 3 * 12), numbers(7, 12));
    let output: Vec<f64> = numbers(8, 12).iter().map(|w| 20.0 * w).collect();
    let weights = Weights {
        hidden: &hidden,
        hidden_bias: &hidden_bias,
        output: &[&output],
        output_bias: &[3.0],
    };
    let model = Model::from_network(header(), &weights, &[1e-3]).unwrap();
    holds(&model, |u| {
        let neurons = hidden.chunks_exact(3).zip(&hidden_bias).zip(&output);
        let neuron = |((row, bias), weight): ((&[f64], &f64), &f64)| {
            let argument: f64 = row.iter().zip(u).map(|(w, u)| w * u).sum();
            weight * (argument + bias).tanh()
        };
        3.0 + neurons.map(neuron).sum::<f64>()
    });
}

#[test]
fn a_base_that_follows_an_input_is_refused_where_its_axis_has_none() {
    let coefficients = numbers(5, 64);
    let mut without = header();
    without.axes[0].input = None;
    let refusal = Model::from_polynomial(without, &[3; 3], &[&coefficients], &[1.0]).unwrap_err();
    assert!(matches!(refusal, Error::OutOfRange { .. }), "{refusal}");
    assert!(
        refusal.to_string().contains("inputs that a base follows"),
        "{refusal}"
    );
    // Two axes hold the states of both.
    let five = Model::from_polynomial(
        plain(2).header().clone(),
        &[1; 5],
        &[&[0.0; 32][..]; 2],
        &[],
    );
    assert!(five.is_err());
}

#[test]
fn the_chain_tells_a_base_its_input() {
    // r = 8000·w at any motion.
    let coefficients = [0.0, 8000.0];
    let model = Model::from_polynomial(header(), &[0, 0, 1], &[&coefficients], &[]).unwrap();
    let rig = rig(0.0);
    let chain = Chain::new(&model, &rig).unwrap();
    let (raw, si) = samples(&rig, 1000);
    let outputs = outputs(&chain, &model, &raw);
    for (output, [_, voltage]) in outputs.iter().zip(&si[chain.first_row()..]) {
        let seen = f64::from(output.predicted[0]) * model.outputs()[0].force_per_lsb;
        let wanted = 8000.0 * (voltage - 4.0) / 5.0;
        assert!((seen - wanted).abs() < 0.01, "{seen} {wanted}");
    }
}
