//! Every effect of the joint, hidden in a noisy force and found again: its values, and the force
//! that it gives.
//!
//! The table is walked, nothing is named but the parameters that trade with one another by nature.

use jointwatch::fit::effects::{EffectsFit, fit_effects};
use jointwatch::model::effects::AxisEffect;
use jointwatch::model::time_history::{TimeHistory, add_forces};
use jointwatch::signal::motion::{Filters, Motion};
use jointwatch::study::{Axis, AxisKind, Controller, Convention};
use jointwatch_shared::base::terms::EffectValues;
use jointwatch_shared::effect::about::{Role, Tie};
use jointwatch_shared::effect::{Acts, EFFECTS, Entry, Subsystem};
use jointwatch_shared::units::References;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

const RATE: f64 = 1000.0;
const SEED: u64 = 20_260_401;
/// Noise over the RMS of the effect's force.
const NOISE: f64 = 0.02;
const STIFFNESS: [f64; 2] = [9e3, 14.0];
const DAMPING: [f64; 2] = [25.0, 0.03];
/// What the joint moves by: the largest displacement, metres and radians.
const SIZES: [f64; 2] = [2e-3, 0.04];
/// The same for a law with a length of its own, a turn, that no motion has to follow.
const TURNING: [f64; 2] = [2.0, 2.0];

fn axes() -> Vec<Axis> {
    let axis = |name: &str, kind| Axis {
        name: name.into(),
        kind,
        inertia: Some(0.0),
        restoring_force: Convention::ForceMinusInertia,
        ground_stiffness: 0.0,
        ground_damping: 0.0,
        controller: Controller::default(),
        encoder_step: None,
        velocity_alone: false,
        integrated_above_hz: None,
    };
    vec![
        axis("x", AxisKind::Translation),
        axis("phi", AxisKind::Rotation),
    ]
}

/// A minute of both axes: sines of many frequencies under a slowly changing amplitude, with their
/// exact velocities.
fn states(rows: usize, sizes: [f64; 2], random: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
    let mut states = Vec::new();
    for size in sizes {
        let sines: Vec<[f64; 3]> = (0..14)
            .map(|_| {
                let hz = 0.3 * (25.0_f64 / 0.3).powf(random.random::<f64>());
                let amplitude = (0.4 + random.random::<f64>()) / hz.max(1.0);
                let phase = random.random::<f64>() * std::f64::consts::TAU;
                [amplitude, std::f64::consts::TAU * hz, phase]
            })
            .collect();
        let at = |row: usize| {
            let t = row as f64 / RATE;
            let (mut x, mut v) = (0.0, 0.0);
            for [amplitude, w, phase] in &sines {
                let (sine, cosine) = (w * t + phase).sin_cos();
                x += amplitude * sine;
                v += amplitude * w * cosine;
            }
            let (sine, cosine) = (0.21 * t).sin_cos();
            let swell = 0.6 + 0.4 * sine;
            [swell * x, swell * v + 0.4 * 0.21 * cosine * x]
        };
        let series: Vec<[f64; 2]> = (0..rows).map(at).collect();
        let largest = series
            .iter()
            .fold(0.0, |most: f64, [x, _]| most.max(x.abs()));
        for quantity in 0..2 {
            states.push(
                series
                    .iter()
                    .map(|s| s[quantity] * size / largest)
                    .collect(),
            );
        }
    }
    states
}

/// Every linear parameter such that the effect counts, and every shape somewhere inside its search,
/// off its starts.
fn truth(entry: &'static Entry, references: &References, random: &mut ChaCha8Rng) -> EffectValues {
    let values = entry.parameters().iter().map(|parameter| {
        let relative = match parameter.role {
            Role::Linear { .. } | Role::SizePerRecord { .. } => 0.5 + random.random::<f64>(),
            Role::Shape(shape) => {
                let (first, last) = (shape.starts[0], shape.starts[shape.starts.len() - 1]);
                let place = 0.3 + 0.4 * random.random::<f64>();
                first * (last / first).powf(place)
            }
        };
        let in_si = entry.is_in_si(parameter);
        let unit = if in_si {
            1.0
        } else {
            parameter.dimension.scale(references)
        };
        relative * unit
    });
    EffectValues {
        input: None,
        entry,
        axis: 0,
        values: values.collect(),
    }
}

/// The effects that own what this one is tied to, with the same value: without them it is not meant
/// to be fitted.
fn owners(
    hidden: &EffectValues,
    references: &References,
    random: &mut ChaCha8Rng,
) -> Vec<EffectValues> {
    let listed = hidden.entry.parameters().iter().zip(&hidden.values);
    let ties = listed.filter_map(|(parameter, &value)| match parameter.role {
        Role::Shape(shape) => shape.tie.map(|tie| (tie, value)),
        Role::Linear { .. } | Role::SizePerRecord { .. } => None,
    });
    let owner = |(tie, value): (Tie, f64)| {
        let entry = Entry::named(tie.effect).unwrap();
        let axis = u8::from(tie.other_axis);
        let seen = if tie.other_axis {
            references.swapped()
        } else {
            *references
        };
        let mut owner = EffectValues {
            input: None,
            axis,
            ..truth(entry, &seen, random)
        };
        let at = entry
            .parameters()
            .iter()
            .position(|p| p.name == tie.parameter);
        owner.values[at.unwrap()] = value;
        owner
    };
    ties.map(owner).collect()
}

pub(crate) fn rms(series: &[f64]) -> f64 {
    (series.iter().map(|v| v * v).sum::<f64>() / series.len() as f64).sqrt()
}

fn forces(terms: &[EffectValues], motion: &Motion) -> Vec<Vec<f64>> {
    let conventions = [Convention::ForceMinusInertia; 2];
    let mut forces = vec![vec![0.0; motion.rows()]; 2];
    add_forces(
        terms,
        &TimeHistory::of_motion(motion, &conventions),
        &mut forces,
    );
    forces
}

fn found(fit: &EffectsFit) -> Vec<EffectValues> {
    let term = |found: &jointwatch::fit::effects::FittedEffect| EffectValues {
        input: None,
        entry: found.bound.entry,
        axis: found.bound.axis as u8,
        values: found.values.clone(),
    };
    fit.terms.iter().map(term).collect()
}

/// The spring and the damper of an axis.
fn base(axis: u8) -> [EffectValues; 2] {
    let at = usize::from(axis);
    [("stiffness", STIFFNESS[at]), ("viscous", DAMPING[at])].map(|(name, value)| EffectValues {
        input: None,
        entry: Entry::named(name).unwrap(),
        axis,
        values: vec![value],
    })
}

fn bounds(terms: &[EffectValues]) -> Vec<AxisEffect> {
    let bound = |term: &EffectValues| AxisEffect {
        input: None,
        entry: term.entry,
        axis: usize::from(term.axis),
    };
    terms.iter().map(bound).collect()
}

fn references(states: &[Vec<f64>]) -> References {
    let largest = |series: &Vec<f64>| series.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    References {
        force: [20.0, 0.5],
        displacement: [largest(&states[0]), largest(&states[2])],
        velocity: [largest(&states[1]), largest(&states[3])],
        time: 1.0,
    }
}

/// A motion without a force.
fn motion(states: Vec<Vec<f64>>) -> Motion {
    let rows = states[0].len();
    Motion {
        still: Vec::new(),
        inputs: Vec::new(),
        record: 0,
        first_row: 0,
        sample_rate_hz: RATE,
        states,
        before: Vec::new(),
        ground: vec![None; 2],
        acceleration: vec![vec![0.0; rows]; 2],
        force: vec![vec![0.0; rows]; 2],
    }
}

#[test]
fn every_effect_of_the_joint_is_found_again_in_a_noisy_force() {
    println!("seed {SEED}");
    let axes = axes();
    let low_pass = Filters::for_bands(RATE, 100.0, 250.0).unwrap().band;
    let base: Vec<EffectValues> = (0..2).flat_map(base).collect();
    let mut fallen = Vec::new();
    for entry in EFFECTS.iter().filter(|e| e.subsystem == Subsystem::Plant) {
        let name = entry.about.name;
        let mut random = ChaCha8Rng::seed_from_u64(SEED + u64::from(entry.tag));
        let sizes = if entry.in_si.is_empty() {
            SIZES
        } else {
            TURNING
        };
        let states = states(40_000, sizes, &mut random);
        let references = references(&states);
        let mut motion = motion(states);
        let hidden = truth(entry, &references, &mut random);
        let alone = forces(std::slice::from_ref(&hidden), &motion);
        // The base has the effect already: then it is found with it.
        let beside =
            |t: &&EffectValues| t.entry != entry && !entry.replaces.contains(&t.entry.about.name);
        let mut terms: Vec<EffectValues> = base.iter().filter(beside).cloned().collect();
        terms.push(hidden.clone());
        terms.extend(owners(&hidden, &references, &mut random));
        let at = terms.iter().position(|t| *t == hidden).unwrap();
        let mut measured = forces(&terms, &motion);
        for axis in 0..2 {
            let noise = NOISE * rms(&alone[axis]).max(0.01 * references.force[axis]);
            for force in &mut measured[axis] {
                *force += noise * random.sample::<f64, _>(StandardNormal);
            }
        }
        motion.force = measured;
        let fit = fit_effects(&axes, &[&motion], &low_pass, &bounds(&terms)).unwrap();
        let again = found(&fit);
        let mine = &again[at];
        let force = forces(std::slice::from_ref(mine), &motion);
        for axis in 0..=usize::from(entry.acts == Acts::BothAxes) {
            let off: Vec<f64> = alone[axis]
                .iter()
                .zip(&force[axis])
                .map(|(a, b)| a - b)
                .collect();
            let relative = rms(&off) / rms(&alone[axis]);
            println!("{name} on {axis}: force off by {:.2} %", 100.0 * relative);
            if relative > 0.01 {
                fallen.push(format!("{name}: force off by {relative:.3}"));
            }
        }
        for (parameter, (seen, wanted)) in entry
            .parameters()
            .iter()
            .zip(mine.values.iter().zip(&hidden.values))
        {
            let relative = (seen - wanted).abs() / wanted.abs();
            println!(
                "  {} {seen:.4e} for {wanted:.4e}: {:.2} %",
                parameter.name,
                100.0 * relative
            );
            if relative > 0.03 {
                fallen.push(format!("{name}: {} off by {relative:.3}", parameter.name));
            }
        }
    }
    assert!(fallen.is_empty(), "{fallen:#?}");
}

#[test]
fn a_law_whose_shapes_end_at_their_bounds_fits_as_well_as_its_special_case() {
    println!("seed {SEED}");
    let axes = axes();
    let low_pass = Filters::for_bands(RATE, 100.0, 250.0).unwrap().band;
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let states = states(40_000, SIZES, &mut random);
    let references = references(&states);
    let mut motion = motion(states);
    let with = |name: &str, random: &mut ChaCha8Rng| -> Vec<EffectValues> {
        let hidden = truth(Entry::named(name).unwrap(), &references, random);
        let others = (0..2).flat_map(base);
        others.chain([hidden]).collect()
    };
    // With an exponent and a share of 1, the ends of both, Bouc–Wen's law is Dahl's. A softer
    // element beside makes a blunter knee than that.
    let dahl = with("dahl", &mut random);
    let mut both = dahl.clone();
    both.push(dahl[dahl.len() - 1].clone());
    both[dahl.len()].values[1] *= 5.0;
    motion.force = forces(&both, &motion);
    for force in &mut motion.force[0] {
        *force += 0.1 * random.sample::<f64, _>(StandardNormal);
    }
    let left = |terms: &[EffectValues]| {
        let fit = fit_effects(&axes, &[&motion], &low_pass, &bounds(terms)).unwrap();
        println!("{:?}", fit.terms.last().unwrap().values);
        let said = forces(&found(&fit), &motion);
        let left = said[0].iter().zip(&motion.force[0]).map(|(a, b)| a - b);
        rms(&left.collect::<Vec<_>>())
    };
    let exact = left(&dahl);
    for name in ["bouc_wen", "bouc_wen_by_rate", "bouc_wen_by_direction"] {
        let wider = left(&with(name, &mut random));
        println!("{name} leaves {wider:.5} N, dahl {exact:.5} N");
        assert!(wider < 1.0005 * exact, "{name}: {wider} for {exact}");
    }
}

#[test]
fn an_effect_that_contains_another_takes_its_place_on_its_axis() {
    let parse = |name: &str| AxisEffect::parse(name, &["x", "phi"]).unwrap();
    let (wide, narrow) = (parse("viscous_by_direction@x"), parse("viscous@x"));
    assert!(wide.replaces(&narrow) && !narrow.replaces(&wide));
    assert!(!wide.replaces(&parse("viscous@phi")) && !wide.replaces(&parse("coulomb@x")));
    assert!(narrow.rules_out(&wide) && wide.rules_out(&narrow));
    let both = ["viscous@x", "viscous_by_direction@x"].map(String::from);
    let refused = AxisEffect::parse_all(&both, &["x", "phi"]).unwrap_err();
    assert!(
        refused.to_string().contains("cannot be told apart"),
        "{refused}"
    );
}
