//! Force channels that are late by more than the first order of a shift describes, as behind a
//! filter of their own.

use jointwatch_tests::learnt::parameter;
use jointwatch_tests::program::{read_json, succeed};
use jointwatch_tests::written::{HEAD, write_study};
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

const RATE_HZ: f64 = 1000.0;
const ROWS: u32 = 8000;

/// Displacement and velocity of a record with a phase of its own.
fn motion(t: f64, shift: f64) -> [f64; 2] {
    let mut at = [0.0; 2];
    for (place, f) in [0.43, 1.1, 1.9, 3.2, 4.7, 6.1, 7.7].into_iter().enumerate() {
        let (rate, phase) = (TAU * f, shift * (1.0 + place as f64).powi(2));
        let size = 1.6e-3 / (1.0 + 0.25 * place as f64);
        at[0] += size * (rate * t + phase).sin();
        at[1] += size * rate * (rate * t + phase).cos();
    }
    at
}

/// Writes two records to learn from and one to judge by, of a joint whose force is logged late.
fn written(folder: &Path, late_s: f64, force: &dyn Fn(f64, [f64; 2]) -> f64) {
    let files = ["a.csv", "b.csv", "v.csv"];
    for (file, shift) in files.into_iter().zip([0.7, 1.9, 2.6]) {
        let mut log = String::from("t,x,F\n");
        for row in 0..ROWS {
            let t = f64::from(row) / RATE_HZ;
            // Nothing repeats in it, so that it serves as noise.
            let noise = 1.0 * (f64::from(row) * f64::from(row) * 0.7 + shift).sin();
            let logged = force(shift, motion(t - late_s, shift)) + noise;
            writeln!(log, "{t:.3},{:.9},{logged:.6}", motion(t, shift)[0]).unwrap();
        }
        fs::write(folder.join(file), log).unwrap();
    }
    write_study(folder, HEAD, &files, 2, "\"stiffness@x\", \"viscous@x\"");
}

/// What is found, and the model that it is added to.
fn applied(folder: &Path) -> (Vec<String>, Value) {
    succeed(folder, "identify . --model physical -o base.json");
    let diagnose = "diagnose . base.json --apply -o model.json --json said.json";
    println!("{}", succeed(folder, diagnose));
    let said = read_json(folder.join("said.json"));
    let found = said["found"].as_array().unwrap().iter();
    let found = found.map(|f| f["effect"].as_str().unwrap().to_string());
    let mut found: Vec<String> = found.collect();
    found.sort();
    (found, read_json(folder.join("model.json")))
}

/// Dry friction and a stop on one side behind a channel that is three rows late: friction that is
/// late looks like several laws with memory, none of which is there.
#[test]
fn a_late_channel_is_put_in_time_before_laws_are_looked_for() {
    let folder = tempfile::tempdir().unwrap();
    written(folder.path(), 3e-3, &|_, [x, v]| {
        2e4 * x + 80.0 * v + 15.0 * (v / 1e-3).tanh() + 8e4 * (x - 2.5e-3).max(0.0)
    });
    let (found, model) = applied(folder.path());
    let stop = |name: &str| ["end_stop", "offset_stops", "power_contact"].contains(&name);
    assert_eq!(found.iter().filter(|n| stop(n)).count(), 1, "{found:?}");
    let others: Vec<&String> = found.iter().filter(|n| !stop(n)).collect();
    assert_eq!(others, ["coulomb", "time_delay"]);
    for (effect, name, truth) in [
        ("time_delay", "delay", 3e-3),
        ("coulomb", "friction", 15.0),
        ("viscous", "damping", 80.0),
    ] {
        let off = parameter(&model, effect, name) / truth - 1.0;
        assert!(off.abs() < 0.03, "{effect} is off by {off}");
    }
}

/// A spring and a damper in series follow the motion late as well, and no channel is: the law says
/// more than a shift.
#[test]
fn a_joint_that_follows_late_has_no_late_channel() {
    let folder = tempfile::tempdir().unwrap();
    let state = std::cell::Cell::new((0.0, 0.0, 0.0));
    written(folder.path(), 0.0, &|shift, [x, v]| {
        let (of, last, series) = state.get();
        let series = if of == shift {
            (series + x - last) * (-1.0 / RATE_HZ / 0.02_f64).exp()
        } else {
            0.0
        };
        state.set((shift, x, series));
        8e3 * x + 40.0 * v + 3e4 * series
    });
    let (found, _) = applied(folder.path());
    assert_eq!(found, ["maxwell"]);
}
