//! Long runs: the device's error beside its bound, laws with memory beside their differential
//! equations.

use super::{header, of_the_joint, parameters, run, taken, term};
use jointwatch_shared::base::Model;
use jointwatch_shared::base::terms::{EffectValues, Memory};
use jointwatch_shared::effect::{Instrument, Kinematics, MAX_PARAMETERS, MAX_STATES};
use jointwatch_shared::scalar::fixed;
use jointwatch_shared::units::References;

/// The lag of terms that follow an input behind one, s.
pub(super) const LAG_S: f64 = 0.02;

/// The largest |device − f64| of a model of one effect along a motion in units of the training
/// range, and the bound that it states; per axis, in N or N·m.
pub(super) fn worst_errors(
    model: &Model,
    term: &EffectValues,
    rows: &[[f64; 4]],
) -> [(f64, f64); 2] {
    let errors = errors(model, term, rows);
    [0, 1].map(|force| {
        let largest = errors.iter().fold(0.0_f64, |most, e| most.max(e[force]));
        (largest, model.outputs()[force].error_bound)
    })
}

/// |device − f64| of every row, per axis, in N or N·m.
fn errors(model: &Model, term: &EffectValues, rows: &[[f64; 4]]) -> Vec<[f64; 2]> {
    let header = model.header();
    let mut values = [0.0; MAX_PARAMETERS];
    let listed = term.entry.parameters().iter().zip(&term.values);
    for (place, (parameter, value)) in values.iter_mut().zip(listed) {
        *place = parameter.as_law_takes_it(*value);
    }
    let own = 2 * usize::from(term.axis);
    let other = 2 - own;
    let mut memory = Memory::default();
    let mut states = [0.0; MAX_STATES];
    let mut before = None;
    let mut lagged = None;
    let period = 1.0 / header.sample_rate_hz;
    let lsb = [0, 1].map(|force| model.outputs()[force].force_per_lsb);
    let of_row = |row: &[f64; 4]| {
        let u = row.map(fixed::q31_from_f64);
        let followed = [u[2], u[1]];
        memory.follow(followed);
        let seen = model.step(&mut memory, &u);
        let si = |input: usize| {
            let axis = &header.axes[input / 2];
            let range = if input.is_multiple_of(2) {
                axis.displacement
            } else {
                axis.velocity
            };
            range.center + range.half_range * fixed::q31_to_f64(u[input])
        };
        let at = Kinematics {
            displacement: si(own),
            velocity: si(own + 1),
            step: si(own) - before.unwrap_or(si(own)),
            other_displacement: si(other),
            other_velocity: si(other + 1),
            period,
            instrument: Instrument::silent(),
        };
        before = Some(si(own));
        let [mine, others] = (term.entry.real)(&values, &at, &mut states);
        let factor = match (term.input, header.axes[own / 2].input) {
            (Some(name), Some(input)) => {
                let u = fixed::q31_to_f64(followed[own / 2]);
                let now = input.range.center + input.range.half_range * u;
                // One lag is used by all tests.
                let share = if name.contains('~') {
                    1.0 - (-period / LAG_S).exp()
                } else {
                    1.0
                };
                let before = lagged.unwrap_or(now);
                let lagged = *lagged.insert(before + share * (now - before));
                if name.contains("^2") {
                    lagged * lagged
                } else {
                    lagged
                }
            }
            _ => 1.0,
        };
        let (mine, others) = (mine * factor, others * factor);
        let wanted = if term.axis == 0 {
            [mine, others]
        } else {
            [others, mine]
        };
        [0, 1].map(|force| (f64::from(seen[force]) * lsb[force] - wanted[force]).abs())
    };
    rows.iter().map(of_row).collect()
}

/// A slow motion with many reversals, at times at rest: what a state of a hysteresis forgets most
/// slowly.
fn slow_motion(seed: f64, rows: usize) -> Vec<[f64; 4]> {
    let at = |row: usize| {
        let t = row as f64 * 2e-4;
        let size = 0.5 + 0.45 * (0.31 * t + seed).sin();
        let x = size * (1.7 * t + seed).sin() + 0.04 * (23.0 * t).sin();
        // Counts of an encoder, 2⁻¹⁶ of half the range; and a rest of a second in ten.
        (x * 65536.0).round() / 65536.0
    };
    let rests = |row: usize| row - row % 5000 + (row % 5000).min(4500);
    let rows = (0..rows).map(|row| {
        let x = at(rests(row));
        [x, 0.3 * (0.011 * row as f64).sin(), -x, 0.2]
    });
    rows.collect()
}

#[test]
fn errors_stay_within_their_bounds_and_those_of_states_do_not_gather() {
    let header = header(2);
    println!("| effect | over 10⁵ samples | over 4·10⁵ samples with memory | bound |");
    for entry in of_the_joint() {
        let name = entry.about.name;
        let mut largest = [0.0_f64; 3];
        for (number, place) in [0.05, 0.3, 0.55, 0.8, 0.95].into_iter().enumerate() {
            let p = [place, place, 1.0 - place, place, 1.0 - place, place];
            let term = term(entry, 0, &p);
            let model = Model::from_effects(header.clone(), std::slice::from_ref(&term), &[]);
            let model = model.unwrap();
            let remembers = !entry.state_bounds.is_empty();
            let rows = slow_motion(number as f64, if remembers { 400_000 } else { 100_000 });
            let errors: Vec<f64> = errors(&model, &term, &rows).iter().map(|e| e[0]).collect();
            let largest_of = |errors: &[f64]| errors.iter().copied().fold(0.0, f64::max);
            let rms = |errors: &[f64]| {
                (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
            };
            let [early, late] = [largest_of(&errors[..100_000]), largest_of(&errors)];
            let bound = model.outputs()[0].error_bound;
            assert!(late <= bound, "{name}: off by {late:e}, bound {bound:e}");
            // The last quarter of the run is no worse than the first one but for chance: what
            // gathers at random would be 2.6 times as large.
            let [first, last] = [
                rms(&errors[..100_000]),
                rms(&errors[errors.len() - 100_000..]),
            ];
            assert!(last < 2.0 * first, "{name}: RMS {first:e}, then {last:e}");
            let full_scale = model.outputs()[0].force_per_lsb * 2_f64.powi(31);
            for (most, seen) in largest.iter_mut().zip([early, late, bound]) {
                *most = most.max(1e9 * seen / full_scale);
            }
        }
        let [early, late, bound] = largest;
        println!("| {name} | {early:.1} | {late:.1} | {bound:.1} |");
    }
}

#[test]
fn a_state_follows_its_differential_equation_at_usual_sample_rates() {
    // A motion that begins at rest, as every state does, as it is sampled, and the same motion
    // sampled 32 times as often.
    const FINER: usize = 32;
    let at = |t: f64| {
        let x = 0.6 * t.sin() + 0.35 * (2.7 * t + 1.0).sin();
        let v = 0.6 * t.cos() + 0.945 * (2.7 * t + 1.0).cos();
        let still = (-4.0 * t * t).exp();
        [
            (1.0 - still) * x,
            (1.0 - still) * v + 8.0 * t * still * x,
            0.0,
            0.0,
        ]
    };
    let sampled = |finer: usize| -> Vec<[f64; 4]> {
        let rows = 0..4000 * finer;
        rows.map(|row| at(0.005 * row as f64 / finer as f64))
            .collect()
    };
    for entry in of_the_joint().filter(|e| !e.state_bounds.is_empty()) {
        for place in [0.3, 0.5, 0.8] {
            let values = taken(entry, &parameters(entry, &[place; 6]), &References::SI);
            let forces = |finer: usize| {
                let scales = References {
                    time: 1.0 / finer as f64,
                    ..References::SI
                };
                run(entry.real, values, &sampled(finer), &scales, |v| v)
            };
            let (coarse, fine) = (forces(1), forces(FINER));
            let (mut off, mut size) = (0.0, 0.0);
            for (c, f) in coarse.iter().zip(fine.iter().step_by(FINER)) {
                off += (c[0] - f[0]).powi(2);
                size += f[0].powi(2);
            }
            let relative = (off / size).sqrt();
            println!("{} at {place}: {relative:.1e}", entry.about.name);
            assert!(relative < 1e-3, "{}: {relative:.2e}", entry.about.name);
        }
    }
}
