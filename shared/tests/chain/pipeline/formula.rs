//! The chain is its formula, written down in `f64`.

use super::{SEED, model, motion, rig, run};
use jointwatch_shared::base::Model;
use jointwatch_shared::chain::{Chain, RawSample};
use jointwatch_shared::wire::rig::{Rig, Taps};

/// Force channels that are late, early, and hear each other.
fn wrong_channels() -> Rig {
    let mut rig = rig(4e-5, 0.0, [0.0; 2], true);
    rig.axes[0].force_cross = -12.0;
    rig.axes[0].force_delay_samples = 0.6;
    rig.axes[1].force_cross = 0.004;
    rig.axes[1].force_delay_samples = -0.3;
    rig
}

/// A force channel read as much later as it is late: the parabola's neighbour of third degree, by
/// Neville's scheme.
fn force_between(samples: &[RawSample], n: usize, axis: usize, rig: &Rig) -> f64 {
    let a = &rig.axes[axis];
    let place = n as f64 + a.force_delay_samples;
    let first = place.floor() as usize - 1;
    let mut p: Vec<f64> = (first..first + 4)
        .map(|row| f64::from(samples[row.min(samples.len() - 1)][axis].force) * a.force_step)
        .collect();
    for order in 1..4 {
        for i in 0..4 - order {
            let t = (place - (first + i) as f64) / order as f64;
            p[i] += t * (p[i + 1] - p[i]);
        }
    }
    p[0]
}

/// The same in f64: states and measured force at row `n`.
fn reference(
    samples: &[RawSample],
    n: usize,
    axis: usize,
    rig: &Rig,
    model: &Model,
) -> ([f64; 2], f64) {
    let real = |taps: &Taps| -> Vec<f64> {
        taps.taps
            .iter()
            .map(|&t| f64::from(t) / 2_f64.powi(taps.shift.into()))
            .collect()
    };
    // Convolution around row n: taps[i] belongs to sample n + half − i.
    let convolve = |taps: &[f64], value: &dyn Fn(usize) -> f64| -> f64 {
        let half = taps.len() / 2;
        taps.iter()
            .enumerate()
            .map(|(i, tap)| tap * value(n + half - i))
            .sum()
    };
    let a = &rig.axes[axis];
    let relative = |n: usize| {
        let [first, second] = samples[n][axis].displacement;
        f64::from(first.wrapping_sub(second)) * a.displacement_step
    };
    let body = |n: usize| {
        if a.body_step > 0.0 {
            f64::from(samples[n][axis].body) * a.body_step
        } else {
            relative(n)
        }
    };
    let velocity = convolve(&real(&rig.velocity), &relative);
    let acceleration = if a.acceleration_step > 0.0 {
        f64::from(samples[n][axis].acceleration) * a.acceleration_step
    } else {
        convolve(&real(&rig.acceleration), &body)
    };
    let ground =
        a.ground_stiffness * body(n) + a.ground_damping * convolve(&real(&rig.velocity), &body);
    let force = force_between(samples, n, axis, rig)
        - a.force_cross * force_between(samples, n, 1 - axis, rig)
        - a.inertia * acceleration
        - ground;
    let learnt = &model.header().axes[axis];
    let states = [
        learnt.displacement.normalise(relative(n)),
        learnt.velocity.normalise(velocity),
    ];
    (states, if a.inertia_minus_force { -force } else { force })
}

#[test]
fn the_chain_is_its_formula_to_a_few_units() {
    println!("seed {SEED}");
    let model = model();
    let rigs = [
        rig(4e-5, 0.0, [0.0; 2], true),
        rig(4e-5, 2e-6, [350.0, 1.2], false),
        rig(0.0, 2e-6, [0.0, 0.7], true),
        // Without a body encoder the relative displacement stands in for the body, as on a joint
        // held to ground.
        rig(0.0, 0.0, [350.0, 1.2], false),
        wrong_channels(),
    ];
    for (number, rig) in rigs.iter().enumerate() {
        let chain = Chain::new(&model, rig).unwrap();
        assert_eq!((chain.delay(), chain.band_delay()), (2, 4));
        // The offset makes the counters wrap in the middle of the record.
        for offset in [0, i32::MAX - 200] {
            let samples = motion(1500, offset);
            let outputs = run(&chain, &model, &samples);
            assert_eq!(outputs.len(), samples.len() - 4);
            let mut largest = [0.0_f64; 2];
            for (at, output) in outputs.iter().enumerate() {
                for axis in 0..2 {
                    let (states, force) = reference(&samples, at + 2, axis, rig, &model);
                    for (offset, state) in states.into_iter().enumerate() {
                        let seen = f64::from(output.state[2 * axis + offset]) / 2_f64.powi(31);
                        largest[0] = largest[0].max((seen - state.clamp(-1.0, 1.0)).abs());
                        let outside = output.outside & (1 << (2 * axis + offset)) != 0;
                        assert_eq!(outside, state.abs() >= 1.0, "state {state}");
                    }
                    let unit = model.outputs()[axis].force_per_lsb;
                    let error = (f64::from(output.measured[axis]) * unit - force).abs();
                    largest[1] = largest[1].max(error / unit);
                    assert_eq!(
                        output.residual[axis],
                        output.measured[axis].saturating_sub(output.predicted[axis])
                    );
                }
                assert_eq!(output.predicted, model.evaluate(&output.state));
                assert_eq!(output.saturated, 0);
            }
            println!(
                "rig {number}, offset {offset}: states to {:.1e} of the range, force to {:.1} units",
                largest[0], largest[1]
            );
            assert!(
                largest[0] < 2e-8,
                "states are off by {:e} of the training range",
                largest[0]
            );
            // Multipliers are right to 2⁻²⁹ of a force near full scale, and a derivative that
            // enters the force is rounded to 16..32 units.
            // A channel read between its samples is rounded to a count.
            let half_a_count = |axis: usize| {
                let [own, other] = [axis, 1 - axis].map(|axis| &rig.axes[axis]);
                let counts = own.force_step + own.force_cross.abs() * other.force_step;
                0.5 * counts / model.outputs()[axis].force_per_lsb
            };
            let allowed = match number {
                4 => 8.0 + half_a_count(0).max(half_a_count(1)),
                _ => [4.0, 20.0, 36.0, 36.0][number],
            };
            assert!(
                largest[1] < allowed,
                "forces are off by {} of 2³¹ units",
                largest[1]
            );
        }
    }
}

#[test]
fn the_band_limited_residual_is_the_low_pass_of_the_residuals() {
    let (model, rig) = (model(), rig(4e-5, 0.0, [0.0; 2], true));
    let chain = Chain::new(&model, &rig).unwrap();
    let outputs = run(&chain, &model, &motion(400, 0));
    let weights = [0.1, 0.2, 0.4, 0.2, 0.1];
    for (at, output) in outputs.iter().enumerate() {
        let Some(seen) = output.residual_band else {
            assert!(
                at < 4,
                "the low-pass of five taps is full at the fifth residual"
            );
            continue;
        };
        for (axis, &value) in seen.iter().enumerate() {
            let wanted: f64 = weights
                .iter()
                .zip(&outputs[at - 4..=at])
                .map(|(w, o)| w * f64::from(o.residual[axis]))
                .sum();
            assert!(
                (f64::from(value) - wanted).abs() < 8.0,
                "{value} for {wanted}"
            );
        }
    }
}
