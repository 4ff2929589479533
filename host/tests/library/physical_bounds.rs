//! What a fit must not say: a mass below nothing, a friction that pushes, metres where the heading
//! says millimetres.

use crate::corrections::learnt;
use jointwatch::{MemoryLog, Study, add};
use std::f64::consts::TAU;

const RATE: f64 = 200.0;
/// Tones of the motion, Hz, with their amplitudes and phases.
const TONES: [[f64; 3]; 4] = [
    [0.31, 0.5, 0.0],
    [0.57, 0.3, 1.0],
    [0.83, 0.2, 2.0],
    [1.13, 0.1, 3.0],
];

/// Displacement, velocity and acceleration at so many rows.
fn motion(rows: usize) -> Vec<[f64; 3]> {
    let at = |row: usize| {
        let mut states = [0.0; 3];
        for [hz, size, phase] in TONES {
            let (omega, angle) = (TAU * hz, TAU * hz * row as f64 / RATE + phase);
            states[0] += size * angle.sin();
            states[1] += size * omega * angle.cos();
            states[2] -= size * omega * omega * angle.sin();
        }
        states
    };
    (0..rows).map(at).collect()
}

/// A small repeatable disturbance, so that no fit is exact.
fn noise(row: usize) -> f64 {
    (12.9898 * row as f64).sin() * 43_758.545 % 1.0
}

fn study(
    columns: [&str; 2],
    keys: &str,
    rows: usize,
    law: &dyn Fn(&[f64; 3]) -> [f64; 2],
) -> jointwatch::Result<Study> {
    let [displacement, force] = columns;
    let description = format!(
        "sample_rate_hz = {RATE}\n[[axis]]\nname = \"q\"\nkind = \"rotation\"\ndisplacement = \"{displacement}\"\nforce = \"{force}\"\n\
         {keys}\n[[record]]\nfile = \"run\"\nrole = \"train\"\n[base]\nterms = [\"viscous@q\"]\n"
    );
    let logged: Vec<[f64; 2]> = motion(rows).iter().map(law).collect();
    let column = |at: usize| logged.iter().map(|row| row[at]).collect();
    let log = MemoryLog {
        name: "run".into(),
        columns: vec![(displacement.into(), column(0)), (force.into(), column(1))],
    };
    Study::of_memory("bounds", &description, &[log])
}

/// A pendulum that is driven far below its natural frequency: gravity turns against the inertia.
fn pendulum([q, v, a]: &[f64; 3]) -> [f64; 2] {
    [
        *q,
        0.2 * a + 40.0 * q.sin() + 0.1 * v + 1e-3 * noise((1e6 * q.abs()) as usize),
    ]
}

#[test]
fn an_inertia_that_would_be_negative_is_held_at_nothing_until_what_is_missing_is_there() {
    let study = study(["q", "M"], "", 6000, &pendulum).unwrap();
    let bare = learnt(&study, &["viscous@q"]);
    assert_eq!(bare.axes[0].inertia, 0.0);
    let held = bare
        .warnings
        .iter()
        .any(|w| w.contains("inertia of axis q") && w.contains("held there"));
    assert!(held, "{:?}", bare.warnings);

    let with = add(&study, &bare, &["gravity@q".into()]).unwrap();
    assert!(with.helps);
    assert!(
        (with.model.axes[0].inertia / 0.2 - 1.0).abs() < 0.02,
        "{}",
        with.model.axes[0].inertia
    );
    assert_eq!(with.cancels, None);
}

#[test]
fn a_friction_that_would_push_is_held_at_nothing_and_its_neighbours_keep_their_intervals() {
    let pushing = |[q, v, _]: &[f64; 3]| {
        [
            *q,
            3.0 * q + 0.5 * v - 0.2 * (v / 0.01).tanh() + 1e-3 * noise((1e6 * q.abs()) as usize),
        ]
    };
    let study = study(["q", "M"], "inertia = 0", 6000, &pushing).unwrap();
    let model = learnt(&study, &["stiffness@q", "viscous@q", "coulomb@q"]);
    let term = |name: &str| model.effects.iter().find(|e| e.effect == name).unwrap();
    let friction = &term("coulomb").parameters[0];
    assert_eq!((friction.value, friction.interval), (0.0, None));
    assert!(
        model
            .warnings
            .iter()
            .any(|w| w.contains("coulomb@q would be below 0")),
        "{:?}",
        model.warnings
    );
    let [low, high] = term("stiffness").parameters[0].interval.unwrap();
    assert!(low < high);
}

#[test]
fn the_unit_in_a_heading_counts_where_study_toml_names_none() {
    let spring = |[q, _, _]: &[f64; 3]| {
        [
            q.to_degrees(),
            3.0e3 * q + 1e-3 * noise((1e6 * q.abs()) as usize),
        ]
    };
    let read = study(
        ["angle (deg)", "torque [mN*m]"],
        "inertia = 0",
        6000,
        &spring,
    )
    .unwrap();
    let notes = read.notes.join("\n");
    assert!(
        notes.contains("\"angle (deg)\" is read in deg") && notes.contains("read in mN*m"),
        "{notes}"
    );
    let model = learnt(&read, &["stiffness@q"]);
    let stiffness = model.effects[0].parameters[0].value;
    assert!((stiffness / 3.0 - 1.0).abs() < 1e-3, "{stiffness}");

    let refused = |columns| {
        study(columns, "inertia = 0", 6000, &spring)
            .unwrap_err()
            .sentence
    };
    let volts = refused(["angle (V)", "torque"]);
    assert!(volts.contains("scale"), "{volts}");
    let other = refused(["angle (bar)", "torque"]);
    assert!(other.contains("not one of angle"), "{other}");
}

#[test]
fn a_record_shorter_than_two_filters_is_learnt_from_behind_shorter_ones() {
    let study = study(["q", "M"], "inertia = 0\n", 300, &|[q, v, _]| {
        [*q, 3.0 * q + 0.5 * v]
    })
    .unwrap();
    let model = learnt(&study, &["stiffness@q", "viscous@q"]);
    let stiffness = model.effects[0].parameters[0].value;
    assert!((stiffness / 3.0 - 1.0).abs() < 0.05, "{stiffness}");
    assert!(jointwatch::export(&model, None).is_err());
}
