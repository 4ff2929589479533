//! Every effect of the table, without being named: its numbers, its derivative, its units, its
//! device arithmetic.

#[path = "effects/derivative.rs"]
mod derivative;
#[path = "effects/memory.rs"]
mod memory;

use jointwatch_shared::base::axis::AxisKind::{Rotation, Translation};
use jointwatch_shared::base::axis::{Axis, AxisKind, Convention, Input, InputRange, Name};
use jointwatch_shared::base::terms::EffectValues;
use jointwatch_shared::base::{Base, Header, Model};
use jointwatch_shared::effect::about::Role;
use jointwatch_shared::effect::{
    Acts, EFFECTS, Entry, Instrument, Kinematics, MAX_PARAMETERS, MAX_STATES, StateBound, Subsystem,
};
use jointwatch_shared::scalar::Scalar;
use jointwatch_shared::units::{Dimension, References};
use jointwatch_shared::wire::blob;
use proptest::prelude::*;

/// What the parameters are relative to in these tests: no two alike, so that an exponent in the
/// wrong place shows.
const SCALES: References = References {
    force: [40.0, 0.6],
    displacement: [2e-3, 0.05],
    velocity: [0.3, 9.0],
    time: 0.8,
};
/// The sample period in units of time: shapes that are times are relative to about a second, not to
/// a sample.
const PERIOD: f64 = 1e-3;

/// A motion of both axes in units of [`SCALES`], from a few random numbers.
fn motion(seed: [f64; 4], rows: usize) -> Vec<[f64; 4]> {
    let [a, b, c, d] = seed;
    (0..rows)
        .map(|row| {
            let t = row as f64 * 0.02;
            let x = 0.6 * (t + a).sin() + 0.35 * (2.7 * t + b).sin();
            let phi = 0.5 * (1.3 * t + c).sin() + 0.45 * (0.4 * t + d).sin();
            let v = 0.3 * (t + a).cos() + 0.6 * (2.7 * t + b).cos();
            let omega = 0.5 * (1.3 * t + c).cos() + 0.4 * (0.4 * t + d).cos();
            [x, v, phi, omega]
        })
        .collect()
}

/// Parameters in units of `references`: linear ones as given, shapes within what the effect allows.
fn parameters(entry: &Entry, seed: &[f64; MAX_PARAMETERS]) -> Vec<f64> {
    let listed = entry.parameters().iter().zip(seed);
    listed
        .map(|(parameter, s)| match parameter.role {
            Role::Linear { .. } | Role::SizePerRecord { .. } => 0.2 + s,
            Role::Shape(shape) => {
                let starts = shape.starts;
                let (low, high) = (starts[0], starts[starts.len() - 1]);
                low * (high / low).powf(*s)
            }
        })
        .collect()
}

/// Readings of the instruments in the given scales: mixtures of the random motion that resemble
/// none of its states.
fn readings<S: Scalar>(
    row: usize,
    [x, v, phi, omega]: [f64; 4],
    scales: &References,
    lift: impl Fn(f64) -> S,
) -> Instrument<S> {
    let acceleration = scales.displacement[0] / (scales.time * scales.time);
    Instrument {
        time: lift(row as f64 * PERIOD * scales.time),
        acceleration: lift((0.3 * v - 0.8 * x) * acceleration),
        force: lift((0.5 * x + 0.4 * phi) * scales.force[0]),
        force_rate: lift((0.6 * v - 0.3 * omega) * scales.force[0] / scales.time),
        other_force: lift((0.7 * omega + 0.2 * x) * scales.force[1]),
        phase: lift(0.3),
    }
}

/// The effects of the joint, which the device evaluates.
fn of_the_joint() -> impl Iterator<Item = &'static Entry> {
    EFFECTS.iter().filter(|e| e.subsystem == Subsystem::Plant)
}

/// The forces of a law along a motion.
fn run<S: Scalar>(
    law: jointwatch_shared::effect::Law<S>,
    taken: [S; MAX_PARAMETERS],
    rows: &[[f64; 4]],
    scales: &References,
    lift: impl Fn(f64) -> S,
) -> Vec<[S; 2]> {
    let mut states = [S::zero(); MAX_STATES];
    let mut before = None;
    let forces = rows.iter().enumerate().map(|(row, state)| {
        let [x, v, phi, omega] = state;
        let displacement = x * scales.displacement[0];
        let at = Kinematics {
            displacement: lift(displacement),
            velocity: lift(v * scales.velocity[0]),
            step: lift(displacement - before.unwrap_or(displacement)),
            other_displacement: lift(phi * scales.displacement[1]),
            other_velocity: lift(omega * scales.velocity[1]),
            period: lift(PERIOD * scales.time),
            instrument: readings(row, *state, scales, &lift),
        };
        before = Some(displacement);
        law(&taken, &at, &mut states)
    });
    forces.collect()
}

/// Parameters in the given scales, as the law takes them.
fn taken(entry: &Entry, relative: &[f64], scales: &References) -> [f64; MAX_PARAMETERS] {
    let mut taken = [0.0; MAX_PARAMETERS];
    let listed = entry.parameters().iter().zip(relative);
    for (place, (parameter, value)) in taken.iter_mut().zip(listed) {
        *place = parameter.as_law_takes_it(value * parameter.dimension.scale(scales));
    }
    taken
}

fn largest(forces: &[[f64; 2]]) -> f64 {
    forces
        .iter()
        .flatten()
        .fold(0.0, |most: f64, f| most.max(f.abs()))
}

#[test]
fn numbers_in_blobs_never_change() {
    let pinned = [
        (1, "stiffness"),
        (2, "viscous"),
        (3, "clearance"),
        (4, "clearance_coupling"),
        (5, "coulomb"),
        (6, "cubic_hardening"),
        (7, "preload"),
        (8, "stribeck"),
        (9, "quadratic_drag"),
        (10, "bilinear"),
        (11, "end_stop"),
        (12, "bouc_wen"),
        (13, "jenkins"),
        (14, "dahl"),
        (15, "lugre"),
        (16, "maxwell"),
        (17, "cogging"),
        (18, "cross_coupling"),
        (19, "stiffness_drift"),
        (20, "inertia_error"),
        (21, "force_gain"),
        (22, "time_delay"),
        (23, "crosstalk"),
        (24, "mains_hum"),
        (25, "coulomb_by_direction"),
        (26, "viscous_by_direction"),
        (27, "gap_jenkins"),
        (28, "gap_jenkins_by_direction"),
        (29, "bouc_wen_by_direction"),
        (30, "power_spring"),
        (31, "power_damper"),
        (32, "power_spring_by_direction"),
        (33, "power_damper_by_direction"),
        (34, "digressive_damping"),
        (35, "lagged_friction"),
        (36, "stiffness_by_other"),
        (37, "stiffness_by_other_squared"),
        (38, "damping_by_other"),
        (39, "damping_by_other_squared"),
        (40, "gravity"),
        (41, "position_friction"),
        (42, "load_friction"),
        (43, "iwan"),
        (44, "mullins"),
        (45, "bouc_wen_by_rate"),
        (46, "bouc_wen_by_place"),
        (47, "periodic_friction"),
        (48, "power_contact"),
        (49, "backlash"),
        (50, "force_zero"),
        (51, "bouc_wen_hardening"),
        (52, "bouc_wen_pinching"),
        (53, "force_drift"),
        (54, "generalized_maxwell"),
        (55, "self_centring"),
        (56, "blow_off_damping"),
        (57, "offset_stops"),
        (58, "gas_spring"),
        (59, "offset_contact"),
        (60, "cogging_harmonics"),
        (61, "exponential_spring"),
        (62, "bouc_wen_degrading"),
        (63, "bouc_wen_baber_noori"),
        (64, "delayed_feedback"),
        (65, "position_damping"),
    ];
    let listed: Vec<(u8, &str)> = EFFECTS.iter().map(|e| (e.tag, e.about.name)).collect();
    assert_eq!(listed, pinned);
}

#[test]
fn every_effect_says_what_it_is() {
    for entry in EFFECTS {
        let about = &entry.about;
        let texts = [
            about.title,
            about.equation,
            about.source,
            about.residual_signature,
            about.separated_by,
        ];
        assert!(texts.iter().all(|t| !t.is_empty()), "{}", about.name);
        assert_eq!(usize::from(entry.parameter_count), about.parameters.len());
        assert!((1..=MAX_PARAMETERS).contains(&about.parameters.len()));
        assert!(entry.state_bounds.len() <= MAX_STATES);
        assert!(
            about.parameters.iter().any(|p| p.is_linear()),
            "{}",
            about.name
        );
        let named = [entry.never_with, entry.replaces, entry.looks_like].concat();
        for other in named {
            assert!(
                other != about.name && Entry::named(other).is_some(),
                "{other}"
            );
        }
        for parameter in about.parameters {
            assert!(!parameter.meaning.is_empty() && !parameter.symbol.is_empty());
            let twins = about.parameters.iter().filter(|p| p.name == parameter.name);
            assert_eq!(twins.count(), 1, "{} of {}", parameter.name, about.name);
            let Role::Shape(shape) = parameter.role else {
                continue;
            };
            assert!(shape.starts.is_sorted() && !shape.starts.is_empty());
            let allowed = shape.least..=shape.most;
            assert!(shape.least > 0.0 && shape.starts.iter().all(|s| allowed.contains(s)));
            if let Some(tie) = shape.tie {
                let owner = Entry::named(tie.effect).expect("an effect to be tied to");
                assert!(owner.parameters().iter().any(|p| p.name == tie.parameter));
            }
        }
    }
}

#[test]
fn units_read_as_engineers_write_them() {
    let unit = |name: &str, index: usize, own: AxisKind, other: AxisKind| {
        let parameter = Entry::named(name).unwrap().parameters()[index];
        parameter.dimension.unit(own, other).to_string()
    };
    assert_eq!(unit("stiffness", 0, Translation, Rotation), "N/m");
    assert_eq!(unit("stiffness", 0, Rotation, Translation), "N·m/rad");
    assert_eq!(unit("viscous", 0, Translation, Rotation), "N·s/m");
    assert_eq!(unit("viscous", 0, Rotation, Translation), "N·m·s/rad");
    assert_eq!(unit("cubic_hardening", 0, Translation, Rotation), "N/m³");
    assert_eq!(unit("stiffness_drift", 0, Translation, Rotation), "N/(m·s)");
    assert_eq!(unit("inertia_error", 0, Translation, Rotation), "kg");
    assert_eq!(unit("inertia_error", 0, Rotation, Translation), "kg·m²");
    assert_eq!(unit("force_gain", 0, Translation, Rotation), "–");
    assert_eq!(unit("time_delay", 0, Rotation, Translation), "s");
    assert_eq!(unit("crosstalk", 0, Translation, Rotation), "N/(N·m)");
    assert_eq!(unit("crosstalk", 0, Rotation, Translation), "N·m/N");
    assert_eq!(unit("crosstalk", 0, Translation, Translation), "–");
    assert_eq!(
        unit("clearance_coupling", 0, Translation, Rotation),
        "N·s/(m·rad)"
    );
    assert_eq!(
        unit("clearance_coupling", 2, Translation, Rotation),
        "N·s/rad"
    );
    assert_eq!(
        Dimension::NONE.unit(Translation, Translation).to_string(),
        "–"
    );
    assert_eq!(
        Dimension::TIME
            .inverse()
            .unit(Translation, Translation)
            .to_string(),
        "Hz"
    );
}

proptest! {
    #[test]
    fn a_law_knows_no_units(
        seed in prop::array::uniform4(0.0_f64..6.0), p in prop::array::uniform6(0.05_f64..0.95),
    ) {
        let rows = motion(seed, 100);
        for entry in EFFECTS {
            let relative = parameters(entry, &p);
            let si = run(entry.real, taken(entry, &relative, &SCALES), &rows, &SCALES, |v| v);
            let machine = taken(entry, &relative, &References::SI);
            let machine = run(entry.real, machine, &rows, &References::SI, |v| v);
            for (f, g) in si.iter().zip(&machine) {
                for axis in 0..2 {
                    let difference = f[axis] - g[axis] * SCALES.force[axis];
                    let scale = largest(&machine) * SCALES.force[axis];
                    prop_assert!(difference.abs() <= 1e-9 * scale, "{} on {axis}", entry.about.name);
                }
            }
        }
    }

    #[test]
    fn states_stay_within_their_bounds(
        seed in prop::array::uniform4(0.0_f64..6.0), p in prop::array::uniform6(0.0_f64..1.0), jump in 0.1_f64..30.0,
    ) {
        let mut rows = motion(seed, 300);
        // A sensor that jumps must not drive a state beyond its bound either.
        rows[150][0] *= jump;
        rows[151][1] *= -jump;
        let least = rows.iter().map(|row| row[0]).fold(f64::INFINITY, f64::min);
        let most_seen = rows.iter().map(|row| row[0]).fold(f64::NEG_INFINITY, f64::max);
        let half_range = 0.5 * (most_seen - least);
        for entry in EFFECTS.iter().filter(|e| !e.state_bounds.is_empty()) {
            let values = taken(entry, &parameters(entry, &p), &References::SI);
            let mut states = [0.0; MAX_STATES];
            let mut before = rows[0][0];
            for [x, v, phi, omega] in &rows {
                let at = Kinematics {
                    displacement: *x,
                    velocity: *v,
                    step: x - before,
                    other_displacement: *phi,
                    other_velocity: *omega,
                    period: PERIOD,
                    instrument: Instrument::silent(),
                };
                before = *x;
                (entry.real)(&values, &at, &mut states);
                for (state, bound) in states.iter().zip(entry.state_bounds) {
                    let most = match *bound {
                        StateBound::Number(most) => f64::from(most),
                        StateBound::Displacement(times) => f64::from(times) * half_range,
                        StateBound::FromZero => least.abs().max(most_seen.abs()),
                    };
                    prop_assert!(state.abs() <= most * (1.0 + 1e-12), "{}", entry.about.name);
                }
            }
        }
    }
}

fn header(axes: usize) -> Header {
    let axis = |at: u8, name: &str, kind, displacement, velocity| Axis {
        name: Name::new(at, name).unwrap(),
        kind,
        convention: Convention::ForceMinusInertia,
        inertia: 1.0,
        displacement,
        velocity,
        input: Some(Input {
            name: Name::new(at, "voltage").unwrap(),
            range: InputRange {
                center: 3.0,
                half_range: 2.0,
            },
        }),
        validation: None,
    };
    let range = |center: f64, half_range: f64| InputRange { center, half_range };
    let all = [
        axis(0, "x", Translation, range(3e-4, 2e-3), range(0.01, 0.3)),
        axis(1, "phi", Rotation, range(-0.01, 0.05), range(0.0, 9.0)),
    ];
    Header {
        sample_rate_hz: 1000.0,
        band_hz: 50.0,
        state_band_hz: 200.0,
        axes: all.into_iter().take(axes).collect(),
    }
}

/// An effect on an axis with random parameters in SI.
fn term(entry: &'static Entry, axis: u8, p: &[f64; MAX_PARAMETERS]) -> EffectValues {
    let scales = if axis == 0 { SCALES } else { SCALES.swapped() };
    let listed = entry.parameters().iter().zip(parameters(entry, p));
    EffectValues {
        input: None,
        entry,
        axis,
        values: listed
            .map(|(parameter, relative)| relative * parameter.dimension.scale(&scales))
            .collect(),
    }
}

proptest! {
    #[test]
    fn the_device_stays_within_the_stated_bound_and_its_blob_brings_it_back(
        seed in prop::array::uniform4(0.0_f64..6.0), p in prop::array::uniform6(0.05_f64..0.95), axis in 0_u8..2,
        follows in 0_usize..5,
    ) {
        let header = header(2);
        let rows = motion(seed, 500);
        for entry in of_the_joint() {
            let axis = if entry.acts == Acts::BothAxes { 0 } else { axis };
            let mut term = term(entry, axis, &p);
            if entry.acts == Acts::OwnAxis {
                term.input = [
                    None,
                    Some("voltage"),
                    Some("voltage~20ms"),
                    Some("voltage^2"),
                    Some("voltage^2~20ms"),
                ][follows];
            }
            let model = Model::from_effects(header.clone(), std::slice::from_ref(&term), &[]).unwrap();
            prop_assert_eq!(model.base(), &Base::None { axes: 2 });
            prop_assert_eq!(&blob::decode(&blob::encode(&model)).unwrap(), &model);
            let back = model.terms().in_si(&header, model.outputs());
            prop_assert_eq!(back[0].input, term.input);
            for (a, b) in back[0].values.iter().zip(&term.values) {
                prop_assert!((a - b).abs() <= 1e-6 * b.abs(), "{}: {a} for {b}", entry.about.name);
            }

            for (force, (off, bound)) in memory::worst_errors(&model, &term, &rows).into_iter().enumerate() {
                prop_assert!(off <= bound, "{} on {force}: off by {off:e}, bound {bound:e}", entry.about.name);
            }
        }
    }
}

#[test]
fn bounds_are_a_part_in_a_million_of_the_force() {
    let header = header(2);
    for entry in of_the_joint() {
        let term = term(entry, 0, &[0.5; MAX_PARAMETERS]);
        let model = Model::from_effects(header.clone(), &[term], &[]).unwrap();
        let output = model.outputs()[0];
        let relative = output.error_bound / (output.force_per_lsb * 2_f64.powi(31));
        println!("{}: bound {relative:.1e} of full scale", entry.about.name);
        assert!(relative < 1e-6, "{}", entry.about.name);
    }
}

#[test]
fn a_model_of_effects_is_refused_where_it_cannot_be() {
    let both = EFFECTS.iter().find(|e| e.acts == Acts::BothAxes).unwrap();
    let refused = |header: Header, terms: Vec<EffectValues>, budgets: &[f64]| {
        let refusal = Model::from_effects(header, &terms, budgets).unwrap_err();
        println!("{refusal}");
        refusal.to_string()
    };
    let half = [0.5; MAX_PARAMETERS];
    assert!(refused(header(1), vec![term(both, 0, &half)], &[]).contains("two axes"));
    assert!(
        refused(header(2), vec![term(&EFFECTS[0], 0, &half); 9], &[])
            .contains("number of effects is 9")
    );
    assert!(
        refused(header(2), vec![term(&EFFECTS[0], 0, &half)], &[1e-12, 1.0]).contains("axis 0")
    );
    let crossing = Entry::named("cross_coupling").unwrap();
    assert!(refused(header(1), vec![term(crossing, 0, &half)], &[]).contains("needs two axes"));
    let mut mad = term(Entry::named("coulomb").unwrap(), 0, &half);
    mad.values[1] = 1e-14;
    assert!(refused(header(2), vec![mad], &[]).contains("too large or too small"));
    let mut other = term(Entry::named("coulomb").unwrap(), 0, &half);
    other.input = Some("pressure");
    assert!(refused(header(2), vec![other], &[]).contains("another input"));
    let mut both = term(both, 0, &half);
    both.input = Some("voltage");
    assert!(refused(header(2), vec![both], &[]).contains("both axes"));
}

#[test]
fn what_is_not_of_the_joint_is_refused_on_the_device_with_the_reason() {
    let mut refused = 0;
    for entry in EFFECTS.iter().filter(|e| e.subsystem != Subsystem::Plant) {
        let term = term(entry, 0, &[0.5; MAX_PARAMETERS]);
        let reason = match entry.subsystem {
            Subsystem::Sensor => "corrects an instrument",
            _ => "time since a record began",
        };
        let refusal = Model::from_effects(header(2), &[term], &[]).unwrap_err();
        assert!(refusal.to_string().contains(reason), "{refusal}");
        refused += 1;
    }
    assert!(refused >= 5);
}
