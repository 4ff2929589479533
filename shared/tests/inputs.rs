//! What effects follow beside the motion: read in time with it, behind its lag, held at the edge of its range, and asked for by the model.

mod sample_rigs;

use jointwatch_shared::base::axis::{Input, InputRange, Name};
use jointwatch_shared::base::terms::EffectValues;
use jointwatch_shared::base::{Header, Model};
use jointwatch_shared::chain::{Chain, ChainState, Output, RawAxis, RawSample};
use jointwatch_shared::effect::Entry;
use jointwatch_shared::wire::rig::{ChannelDelays, Rig};
use sample_rigs::{block, model as plain};

const LAG_S: f64 = 0.02;

fn effect(name: &str, input: &'static str, value: f64) -> EffectValues {
    EffectValues {
        entry: Entry::named(name).unwrap(),
        axis: 0,
        input: Some(input),
        values: vec![value],
    }
}

/// A force of 3 N/V behind a lag, and a spring of 5000 N/m/V without one.
fn model() -> Model {
    let mut header: Header = plain(1).header().clone();
    header.axes[0].input = Some(Input {
        name: Name::new(0, "voltage").unwrap(),
        range: InputRange {
            center: 4.0,
            half_range: 5.0,
        },
    });
    let effects = [
        effect("preload", "voltage~20ms", 3.0),
        effect("stiffness", "voltage", 5000.0),
    ];
    Model::from_effects(header, &effects, &[]).unwrap()
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
        refusal.contains("input channels that the model's effects follow is 0"),
        "{refusal}"
    );
    // And a rig may have an input that no effect follows.
    assert!(Chain::new(&plain(1), &block(1, false)).is_ok());
}
