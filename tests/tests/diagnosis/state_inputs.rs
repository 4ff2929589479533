//! Polynomials and networks of one axis that take an input of the study as their third state, and
//! simulations of what follows inputs.

use jointwatch_tests::program::{fail, json, read_json, says, succeed};
use jointwatch_tests::written::{HEAD, write_study};
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

const RATE_HZ: f64 = 1000.0;
const MASS: f64 = 2.0;
/// Stiffness and damping at 0 V, and what a volt adds to either.
const STIFFNESS: [f64; 2] = [3000.0, 900.0];
const DAMPING: [f64; 2] = [25.0, 20.0];
const LAG_S: f64 = 0.02;
/// Integration steps per row.
const STEPS: usize = 8;

/// A voltage that goes from one level to the next in 0.4 s.
fn voltage(t: f64, seed: f64) -> f64 {
    let place = 2.5 * t + seed;
    let level = |step: f64| 1.0 + (12.9898 * step).sin();
    let (from, part) = (level(place.floor()), place - place.floor());
    from + (level(place.floor() + 1.0) - from) * part * part * (3.0 - 2.0 * part)
}

fn drive(t: f64, seed: f64) -> f64 {
    let tones = [(1.3, 0.2), (2.9, 1.1), (5.1, 2.2), (8.7, 0.4), (13.3, 3.0)];
    let tone =
        |(f, phase): (f64, f64)| (TAU * f * (1.0 + 0.02 * seed) * t + phase + seed * f).sin();
    6.0 * tones.into_iter().map(tone).sum::<f64>()
}

/// A body of 2 kg behind a spring and a damper that both grow with a voltage, at once or behind a
/// lag.
fn record(seed: f64, lag_s: f64) -> String {
    let step = 1.0 / RATE_HZ / STEPS as f64;
    let rate = |t: f64, [x, v, behind]: [f64; 3]| {
        let volts = if lag_s > 0.0 {
            behind
        } else {
            voltage(t, seed)
        };
        let [k, c] = [STIFFNESS, DAMPING].map(|[at_0, per_volt]| at_0 + per_volt * volts);
        let lagging = (voltage(t, seed) - behind) / lag_s.max(1.0 / RATE_HZ);
        [v, (drive(t, seed) - k * x - c * v) / MASS, lagging]
    };
    let moved = |y: [f64; 3], by: f64, k: [f64; 3]| [0, 1, 2].map(|i| y[i] + by * k[i]);
    let (mut y, mut text) = ([0.0, 0.0, voltage(0.0, seed)], String::from("t,x,F,U\n"));
    for row in 0..10_000 {
        let t = f64::from(row) / RATE_HZ;
        let noise = |every: f64| (every * f64::from(row) * (1.0 + seed)).sin();
        let (x, force) = (
            y[0] + 2e-7 * noise(7919.0),
            drive(t, seed) + 5e-3 * noise(104_729.0),
        );
        writeln!(text, "{t:.3},{x:.10},{force:.6},{:.5}", voltage(t, seed)).unwrap();
        for sub in 0..STEPS {
            let t = t + sub as f64 * step;
            let first = rate(t, y);
            let second = rate(t + step / 2.0, moved(y, step / 2.0, first));
            let third = rate(t + step / 2.0, moved(y, step / 2.0, second));
            let fourth = rate(t + step, moved(y, step, third));
            let slope = [0, 1, 2].map(|i| first[i] + 2.0 * (second[i] + third[i]) + fourth[i]);
            y = moved(y, step / 6.0, slope);
        }
    }
    text
}

const VOLTAGE: &str = "[[input]]\nname = \"voltage\"\ncolumn = \"U\"\nunit = \"V\"\n";

/// Records and study of the joint in a folder.
fn written(lag_s: f64) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, seed) in [("one.csv", 0.3), ("two.csv", 1.7)] {
        fs::write(folder.path().join(name), record(seed, lag_s)).unwrap();
    }
    study(folder.path(), VOLTAGE);
    folder
}

fn study(folder: &Path, inputs: &str) {
    let terms =
        "\"stiffness@x\", \"viscous@x\", \"stiffness*voltage~20ms@x\", \"viscous*voltage~20ms@x\"";
    let terms = if inputs.contains("\"voltage\"") {
        terms
    } else {
        ""
    };
    let head = HEAD.replace("inertia = 0", &format!("inertia = {MASS}"));
    write_study(folder, &(head + inputs), &["one.csv", "two.csv"], 1, terms);
}

fn identify(folder: &Path, options: &str) -> Value {
    let identify = format!("identify study.toml -o model.json --model {options} --quiet");
    json(folder, &identify)
}

fn validation(model: &Value) -> f64 {
    model["validation"][0]["relative_error"].as_f64().unwrap()
}

#[test]
fn a_base_takes_the_only_input_of_its_axis_as_its_third_state_on_the_device_as_well() {
    let folder = written(0.0);
    let at = folder.path();
    let without = validation(&identify(at, "polynomial --input none"));
    for kind in [
        "polynomial",
        "network --neurons 10",
        "polynomial --fit select",
    ] {
        let model = identify(at, kind);
        assert_eq!(model["state_input"], "voltage");
        assert_eq!(model["followed"][0]["name"], "voltage");
        let error = validation(&model);
        println!("{kind}: {error:.5}, without the voltage {without:.3}");
        assert!(error < 0.002 && without > 0.1, "{kind}: {error} {without}");

        // The device's integers, from counts on.
        succeed(at, &["export", "model.json", "-o", "model.bin"]);
        let inspected = succeed(at, &["inspect", "model.bin"]);
        says(&inspected, &["Input voltage", "third state"]);
        let replayed = json(at, "replay model.bin study.toml --quiet");
        let seen = replayed["records"][1]["axes"]["x"]["relative_error"].as_f64();
        assert!(seen.unwrap() < 0.002, "{replayed}");
    }
    // The few terms of the law itself: a constant, and x and v alone and times the voltage.
    let said = succeed(at, "identify study.toml --model polynomial --fit select");
    says(&said, &["v_x·w_voltage", "w_voltage = (voltage − "]);

    // The firmware with the network, then with the polynomial.
    for kind in ["network --neurons 10", "polynomial"] {
        identify(at, kind);
        succeed(at, &["export", "model.json", "-o", "model.bin"]);
        let emulate = "emulate model.bin study.toml --record two.csv --quiet";
        let emulated = json(at, emulate);
        for record in emulated["records"].as_array().unwrap() {
            assert_eq!(record["agrees"], true, "{record}");
        }
    }
    // A study without the voltage is refused, by name.
    study(at, "");
    for command in ["compare", "respond"] {
        let sentence = fail(at, &[command, "study.toml", "model.json"], 3);
        says(&sentence, &["\"voltage\"", "[[input]]"]);
    }
}

#[test]
fn an_effect_is_added_beside_a_base_that_takes_an_input() {
    let folder = written(0.0);
    let at = folder.path();
    // The mass is found with the model, both times with the voltage's help.
    let path = at.join("study.toml");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace("inertia = 2\n", "")).unwrap();
    let flat = identify(at, "polynomial --order 1,1,0");
    succeed(
        at,
        "add study.toml model.json stiffness*voltage@x viscous*voltage@x -o added.json",
    );
    let model = read_json(at.join("added.json"));
    assert_eq!(model["state_input"], "voltage");
    let [before, after] = [&flat, &model].map(validation);
    assert!(before > 0.1 && after < 0.002, "{before} {after}");
    let stiffness = model["effects"][0]["parameters"][0]["value"]
        .as_f64()
        .unwrap();
    assert!((stiffness / STIFFNESS[1] - 1.0).abs() < 0.01, "{stiffness}");
    let mass = model["axes"][0]["inertia"].as_f64().unwrap();
    assert!((mass / MASS - 1.0).abs() < 0.002, "{mass} kg");
    succeed(at, &["export", "added.json", "-o", "model.bin"]);
    let replayed = json(at, "replay model.bin study.toml --quiet");
    let seen = replayed["records"][1]["axes"]["x"]["relative_error"].as_f64();
    assert!(seen.unwrap() < 0.002, "{replayed}");
}

#[test]
fn a_motion_is_simulated_with_the_inputs_of_its_record() {
    let folder = written(LAG_S);
    let at = folder.path();
    let nmse = || {
        let response = json(at, "respond study.toml model.json --quiet");
        let axis = &response["records"][1]["axes"]["x"];
        axis["displacement_nmse_percent"].as_f64().unwrap()
    };
    // Effects behind their lag; a base without it is a little off; one without the voltage far.
    for (kind, least, most) in [
        ("physical", 0.0, 1e-4),
        ("polynomial", 1e-4, 0.05),
        ("network --neurons 10", 1e-4, 0.05),
        ("polynomial --input none", 1.0, 100.0),
    ] {
        identify(at, kind);
        let error = nmse();
        println!("{kind}: {error:.6} %");
        assert!((least..most).contains(&error), "{kind}: {error}");
    }
    let refined = identify(at, "physical --criterion simulation");
    for (place, truth) in [STIFFNESS[0], DAMPING[0], STIFFNESS[1], DAMPING[1]]
        .iter()
        .enumerate()
    {
        let value = refined["effects"][place]["parameters"][0]["value"]
            .as_f64()
            .unwrap();
        assert!((value / truth - 1.0).abs() < 2e-3, "{refined}");
    }
    assert!(nmse() < 1e-4);
}

#[test]
fn which_input_is_taken_is_told_or_asked() {
    let folder = written(0.0);
    let at = folder.path();
    let refused = |arguments: &str, status: i32, words: &[&str]| {
        let identify = format!("identify study.toml -o none.json {arguments}");
        let sentence = fail(at, &identify, status);
        says(&sentence, words);
        assert!(!at.join("none.json").exists());
    };
    refused(
        "--model polynomial --input current",
        2,
        &["current", "voltage, none"],
    );
    refused(
        "--model physical --input voltage",
        2,
        &["effect*voltage@axis"],
    );
    refused(
        "--model polynomial --order 3,3",
        2,
        &["2 numbers", "needs 3", "\"voltage\"", "3,3,3"],
    );
    // Two inputs: neither is taken unawares.
    let second = "[[input]]\nname = \"second\"\ncolumn = \"U\"\noffset = 1.0\n";
    study(at, &[VOLTAGE, second].concat());
    let warned = |model: &Value, words: &str| {
        let warnings = model["warnings"].as_array().unwrap();
        assert!(
            warnings.iter().any(|w| w.as_str().unwrap().contains(words)),
            "{model}"
        );
    };
    let model = identify(at, "polynomial");
    assert_eq!(model["state_input"], Value::Null);
    warned(&model, "choose one of them with --input (voltage, second)");
    let model = identify(at, "polynomial --input second");
    assert_eq!(model["state_input"], "second");
    assert!(validation(&model) < 0.002);
    // One that never changes.
    study(
        at,
        &VOLTAGE.replace("unit = \"V\"", "scale = 1e-300\noffset = 4.0"),
    );
    let model = identify(at, "polynomial");
    assert_eq!(model["state_input"], Value::Null);
    warned(&model, "the same at every training row");
}
