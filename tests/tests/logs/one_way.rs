//! Runs that go one way at a constant speed each, as friction is measured on robot arms: there dry
//! friction looks like a zero of force that differs from record to record.

use super::free_motion::noise;
use super::noise::noise as seeded;
use jointwatch::model::file::ModelFile;
use jointwatch_tests::program::{json, succeed};
use jointwatch_tests::written::write_study;
use serde_json::Value;
use std::fmt::Write as _;
use std::fs;

const RATE_HZ: f64 = 100.0;
const SPEEDS: [f64; 5] = [0.35, -0.35, 0.8, -0.6, 1.2];

/// An arm of weight that turns by two radians, with dry and viscous friction.
fn run(number: usize, speed: f64) -> String {
    let mut text = String::from("t,angle,torque\n");
    let rows = (2.0 / speed.abs() * RATE_HZ) as u32;
    for row in 0..rows {
        let t = f64::from(row) / RATE_HZ;
        // The controller lets the speed ripple.
        let ripple = 9.0 + 0.7 * number as f64;
        let angle = speed * (t + 0.004 * (ripple * t).sin());
        let velocity = speed * (1.0 + 0.004 * ripple * (ripple * t).cos());
        let torque = 38.0 * angle.sin() + 3.0 * velocity + 12.0 * speed.signum();
        let read = torque + 0.15 * noise(row, 0.3 + number as f64);
        writeln!(text, "{t:.2},{angle:.6},{read:.4}").unwrap();
    }
    text
}

/// What `diagnose --apply` says of logs, and the model that it makes: the first are learnt from.
fn applied(logs: &[String], training: usize, base: &str) -> (Value, ModelFile) {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let files = &["r0.csv", "r1.csv", "r2.csv", "r3.csv", "r4.csv"][..logs.len()];
    for (file, log) in files.iter().zip(logs) {
        fs::write(folder.join(file), log).unwrap();
    }
    let head = "time = \"t\"\n[[axis]]\nname = \"phi\"\nkind = \"rotation\"\ndisplacement = \"angle\"\nforce = \"torque\"\ninertia = 0\n";
    write_study(folder, head, files, training, base);
    succeed(folder, &["identify", ".", "--model", "physical"]);
    let said = json(folder, "diagnose . model.json --apply -o full.json");
    (said, ModelFile::read(&folder.join("full.json")).unwrap())
}

#[test]
fn dry_friction_of_one_way_runs_is_no_zero_of_the_instrument() {
    let runs = SPEEDS.into_iter().enumerate();
    let runs: Vec<String> = runs.map(|(number, speed)| run(number, speed)).collect();
    let (said, model) = applied(&runs, 4, "\"gravity@phi\", \"viscous@phi\"");
    let effects: Vec<String> = model.effects.iter().map(|e| e.name()).collect();
    assert!(
        !effects.iter().any(|name| name.starts_with("force_")),
        "{effects:?}, {said}"
    );
    // One speed or two in each direction do not tell dry friction from a digressive damper.
    let values = |effect: &str| {
        let all = model.effects.iter();
        let found: Vec<f64> = all
            .filter(|e| effect.split('|').any(|one| one == e.effect))
            .map(|e| e.parameters[0].value)
            .collect();
        assert_eq!(found.len(), 1, "{effect} of {effects:?}");
        found[0]
    };
    let friction = values("coulomb|stribeck|digressive_damping");
    assert!((friction / 12.0 - 1.0).abs() < 0.05, "{friction}");
    assert!((values("gravity") / 38.0 - 1.0).abs() < 0.02);
    assert!((values("viscous") / 3.0 - 1.0).abs() < 0.2);
}

/// A swing of a servo with weight and dry friction, beside a load.
fn swing(number: usize, load: f64) -> String {
    const ROWS: u32 = 300;
    let mut text = String::from("t,angle,torque\n");
    for row in 0..ROWS {
        let (t, share) = (f64::from(row) / 400.0, f64::from(row) / f64::from(ROWS - 1));
        let angle = 2.6 * (10.0 - 15.0 * share + 6.0 * share * share) * share.powi(3);
        let speed = 2.6 * 30.0 * (share * (1.0 - share)).powi(2) / 0.7475;
        let friction = 0.237 * (speed / 0.02).tanh() + 0.03 * speed;
        let weight = -0.368 * angle.sin() - 0.264 * (angle.cos() - 1.0);
        let read = friction + weight + load + 0.017 * noise(row, 0.3 + number as f64);
        let counted = (angle / 0.002).round() * 0.002;
        writeln!(text, "{t:.4},{counted:.3},{read:.5}").unwrap();
    }
    text
}

/// Alone, the weight would be cancelled by what the loads leave: it waits until those are found.
#[test]
fn a_weight_beside_loads_that_differ_is_added_with_them() {
    let loads = [0.151, 0.129, 1.59, 1.432].into_iter().enumerate();
    let swings: Vec<String> = loads.map(|(number, load)| swing(number, load)).collect();
    let (_, model) = applied(&swings, 3, "\"viscous@phi\"");
    let effects: Vec<String> = model.effects.iter().map(|e| e.name()).collect();
    for effect in ["gravity@phi", "force_zero@phi"] {
        assert!(effects.iter().any(|name| name == effect), "{effects:?}");
    }
}

/// A bar that is pulled once at a constant speed until long after it yields.
/// As a probe is lowered: its speed is a constant, which tells no damping.
#[test]
fn a_ramp_at_one_speed_is_drafted_by_its_place_alone() {
    let mut log = String::from("z (nm),load (nN)\n");
    for row in 0..2000 {
        let depth = (f64::from(row) - 1200.0).max(0.0);
        log += &format!(
            "{:.2},{:.3}\n",
            4000.0 + 0.75 * f64::from(row),
            0.5 + 0.02 * depth
        );
    }
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("probe.csv"), log).unwrap();
    succeed(folder.path(), "init probe.csv --yes --rate 500");
    let study = fs::read_to_string(folder.path().join("study.toml")).unwrap();
    assert!(
        study.contains("\"stiffness@x\"") && !study.contains("\"viscous@x\""),
        "{study}"
    );
}

#[test]
fn a_bar_that_is_pulled_once_has_a_spring_and_no_damper_and_yields() {
    let mut noise = seeded(5);
    let mut log = String::from("Time (s),Extension (mm),Load (N)\n");
    for row in 0..600 {
        let t = f64::from(row) / 50.0;
        let x = 0.2 * t + 2e-4 * noise();
        let force = (100.0 * x).min(90.0) + 6.0 * x + 0.3 * noise();
        writeln!(log, "{t:.2},{x:.5},{force:.3}").unwrap();
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("pull.csv"), log).unwrap();
    succeed(folder, &["init", "--yes", "pull.csv"]);
    let study = fs::read_to_string(folder.join("study.toml")).unwrap();
    assert!(study.contains("terms = [\"stiffness@x\"]"), "{study}");
    succeed(folder, &["identify", ".", "--model", "physical"]);
    let said = json(folder, &["diagnose", ".", "model.json"]);
    assert_eq!(said["verdict"], "effect", "{said}");
    let found = &said["ranked"][0];
    assert_eq!(found["effect"], "jenkins", "{said}");
    let force = found["parameters"][0]["value"].as_f64().unwrap();
    assert!((force / 90.0 - 1.0).abs() < 0.05, "{force}");
}
