//! `identify --criterion simulation`: a model refined until its simulated motion fits the measured
//! one.

use jointwatch_tests::program::{fail, json, read_json, says, succeed};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::fs;
use std::path::Path;

const RATE_HZ: f64 = 200.0;
/// Mass, stiffness, damping and dry friction of the rig.
const TRUTH: [f64; 4] = [1.5, 600.0, 4.0, 2.0];

/// A force of random tones from 0.5 to 12 Hz.
fn force(seed: u64) -> impl Fn(f64) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let tones: Vec<[f64; 2]> = (0..24)
        .map(|k| [0.5 + 0.5 * f64::from(k), TAU * rng.random::<f64>()])
        .collect();
    move |t| {
        let tones = tones.iter();
        tones
            .map(|[hz, phase]| 3.0 * (TAU * hz * t + phase).sin())
            .sum()
    }
}

/// One record of the rig, with noise of this RMS in the displacement.
fn record(seed: u64, noise_m: f64) -> String {
    let [m, k, c, friction] = TRUTH;
    let force = force(seed);
    let mut rng = ChaCha8Rng::seed_from_u64(seed + 1000);
    let (mut x, mut v) = (0.0_f64, 0.0_f64);
    let mut csv = String::from("t,x,F\n");
    let rate =
        |t: f64, x: f64, v: f64| (force(t) - k * x - c * v - friction * (v / 0.003).tanh()) / m;
    let step_s = 1.0 / (16.0 * RATE_HZ);
    for row in 0..6000 {
        let t = f64::from(row) / RATE_HZ;
        // Three uniform numbers are near enough to a normal one, of variance ¼.
        let noise: f64 = (0..3).map(|_| rng.random::<f64>() - 0.5).sum();
        writeln!(
            csv,
            "{t:.6},{:.9e},{:.9e}",
            x + 2.0 * noise_m * noise,
            force(t)
        )
        .unwrap();
        for sub in 0..16 {
            let t = t + f64::from(sub) * step_s;
            let middle = [x + 0.5 * step_s * v, v + 0.5 * step_s * rate(t, x, v)];
            x += step_s * middle[1];
            v += step_s * rate(t + 0.5 * step_s, middle[0], middle[1]);
        }
    }
    csv
}

/// A study of two records in a folder.
fn study(folder: &Path, noise_m: f64, axis: &str, terms: &str) {
    fs::write(folder.join("train.csv"), record(1, noise_m)).unwrap();
    fs::write(folder.join("valid.csv"), record(2, noise_m)).unwrap();
    let toml = format!(
        "time = \"t\"\nsample_rate_hz = {RATE_HZ}\nband_hz = 30.0\n[[axis]]\nname = \"x\"\nkind = \"translation\"\n\
         displacement = \"x\"\nforce = \"F\"\n{axis}\n[[record]]\nfile = \"train.csv\"\nrole = \"train\"\n\
         [[record]]\nfile = \"valid.csv\"\nrole = \"validate\"\n[base]\nterms = [{terms}]\n"
    );
    fs::write(folder.join("study.toml"), toml).unwrap();
}

const TERMS: &str = r#""stiffness@x", "viscous@x", "coulomb@x""#;

fn identify(folder: &Path, more: &str) -> Value {
    let identify = format!("identify study.toml --model physical {more}");
    json(folder, &identify)
}

/// Mass, stiffness, damping, friction of a model.
fn found(model: &Value) -> [f64; 4] {
    let effect = |place: usize| {
        model["effects"][place]["parameters"][0]["value"]
            .as_f64()
            .unwrap()
    };
    let mass = model["axes"][0]["inertia"].as_f64().unwrap();
    [mass, effect(0), effect(1), effect(2)]
}

fn off(model: &Value) -> [f64; 4] {
    let found = found(model);
    std::array::from_fn(|i| (found[i] / TRUTH[i] - 1.0).abs())
}

#[test]
fn noise_that_biases_the_equation_of_motion_does_not_bias_the_motion() {
    let folder = tempfile::tempdir().unwrap();
    study(folder.path(), 2e-4, "", TERMS);
    let equation = identify(folder.path(), "-o equation.json");
    assert!(equation.get("simulation").is_none());
    let simulation = identify(folder.path(), "--criterion simulation -o simulation.json");
    let (before, after) = (off(&equation), off(&simulation));
    println!("off by {before:?} with the equation, {after:?} with the simulation");
    assert!(
        before.iter().any(|e| *e > 0.03),
        "no bias to remove: {before:?}"
    );
    assert!(after.iter().all(|e| *e < 0.02), "{after:?}");
    let said = &simulation["simulation"];
    assert_eq!(said["kept"], true);
    assert_eq!(simulation["fit"], "output error");
    assert_eq!(said["records"].as_array().unwrap().len(), 2);
    for record in said["records"].as_array().unwrap() {
        let rms = |when: &str| record[when]["rms"].as_f64().unwrap();
        println!(
            "{}: {:.3e} m, then {:.3e} m",
            record["file"],
            rms("before"),
            rms("after")
        );
        assert!(rms("after") < rms("before"));
    }
    // Intervals of the other fit do not belong to these values.
    assert!(simulation["effects"][0]["parameters"][0]["interval"].is_null());
    // What was written is what was printed, and `respond` agrees.
    let response = json(folder.path(), "respond study.toml simulation.json");
    let nmse = &response["records"][1]["axes"]["x"]["displacement_nmse_percent"];
    let told = &said["records"][1]["after"]["nmse_percent"];
    assert!((nmse.as_f64().unwrap() - told.as_f64().unwrap()).abs() < 1e-9);
    let text = succeed(
        folder.path(),
        "identify study.toml --model physical --criterion simulation",
    );
    for part in [
        "Refinement by simulation",
        "RMS before",
        "equation error",
        "valid.csv",
    ] {
        assert!(text.contains(part), "{part} is missing in {text}");
    }
}

#[test]
fn what_cannot_be_refined_is_refused_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    study(folder.path(), 1e-5, "", TERMS);
    let refused = |kind: &str, code: i32, parts: &[&str]| {
        let identify = format!("identify study.toml --model {kind} --criterion simulation");
        let sentence = fail(folder.path(), &identify, code);
        says(&sentence, parts);
        assert!(!folder.path().join("model.json").exists());
    };
    refused("network", 2, &["network", "--model physical"]);

    // Nothing to integrate, stated and not.
    study(folder.path(), 1e-5, "inertia = 0.0", TERMS);
    refused("physical", 3, &["inertia 0", "equation of motion"]);
    study(folder.path(), 1e-5, "", TERMS);
    for file in ["train.csv", "valid.csv"] {
        let text = fs::read_to_string(folder.path().join(file)).unwrap();
        let silent = text.lines().enumerate().map(|(k, line)| match k {
            0 => format!("{line}\n"),
            _ => format!("{},0\n", line.rsplit_once(',').unwrap().0),
        });
        let silent: String = silent.collect();
        fs::write(folder.path().join(file), silent).unwrap();
    }
    refused("physical", 3, &["F"]);

    let with_drift = format!("{TERMS}, \"stiffness_drift@x\"");
    study(folder.path(), 1e-5, "", &with_drift);
    refused("physical", 3, &["stiffness_drift", "--criterion equation"]);

    // A force counted the other way round pushes away from rest.
    study(
        folder.path(),
        1e-5,
        "inertia = 1.5\nrestoring_force = \"inertia_minus_force\"",
        r#""viscous@x""#,
    );
    let text = fs::read_to_string(folder.path().join("study.toml")).unwrap();
    let fast = text.replace("force = \"F\"", "force = { column = \"F\", scale = 1e6 }");
    fs::write(folder.path().join("study.toml"), fast).unwrap();
    refused("physical", 3, &["diverges at", "train.csv"]);
}

/// Gains of a controller of the position, N/m and N·s/m.
const GAINS: [f64; 2] = [3000.0, 60.0];

/// Time, position and force of a mass on a slide that a controller moves along a reference, row by
/// row.
fn controlled(damping: f64) -> Vec<[f64; 3]> {
    let ([m, _, _, friction], [kp, kd]) = (TRUTH, GAINS);
    let reference = force(7);
    let force = |t: f64, x: f64, v: f64| kp * (2e-3 * reference(t) - x) - kd * v;
    let rate =
        |t: f64, x: f64, v: f64| (force(t, x, v) - damping * v - friction * (v / 0.003).tanh()) / m;
    let (mut x, mut v) = (0.0_f64, 0.0_f64);
    let step_s = 1.0 / (64.0 * RATE_HZ);
    let row = |row: u32| {
        let t = f64::from(row) / RATE_HZ;
        let seen = [t, x, force(t, x, v)];
        for sub in 0..64 {
            let t = t + f64::from(sub) * step_s;
            let middle = [x + 0.5 * step_s * v, v + 0.5 * step_s * rate(t, x, v)];
            x += step_s * middle[1];
            v += step_s * rate(t + 0.5 * step_s, middle[0], middle[1]);
        }
        seen
    };
    (0..4000).map(row).collect()
}

#[test]
fn a_controlled_drive_is_simulated_in_its_loop() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let [_, _, damping, _] = TRUTH;
    let rows = controlled(damping);
    let mut csv = String::from("t,x,F\n");
    for [t, x, force] in &rows {
        writeln!(csv, "{t:.6},{x:.12e},{force:.12e}").unwrap();
    }
    study(at, 0.0, "inertia = 1.5", r#""viscous@x", "coulomb@x""#);
    for file in ["train.csv", "valid.csv"] {
        fs::write(at.join(file), &csv).unwrap();
    }
    identify(at, "-o model.json");
    // A model whose damping is three times too large.
    let mut model = read_json(at.join("model.json"));
    model["effects"][0]["parameters"][0]["value"] = (3.0 * damping).into();
    fs::write(at.join("wrong.json"), model.to_string()).unwrap();
    let text = fs::read_to_string(at.join("study.toml")).unwrap();
    let [kp, kd] = GAINS;
    let gains = format!("inertia = 1.5\ncontroller = {{ kp = {kp}, kd = {kd} }}");
    fs::write(at.join("loop.toml"), text.replace("inertia = 1.5", &gains)).unwrap();
    // What it would have moved like, with its reference.
    let wanted = controlled(3.0 * damping);
    let apart = |study: &str, beside: &[[f64; 3]]| -> f64 {
        let respond = format!("respond {study} wrong.json --record valid.csv -o states.csv");
        succeed(at, &respond);
        let text = fs::read_to_string(at.join("states.csv")).unwrap();
        let mut square = [0.0; 2];
        for line in text.lines().skip(1) {
            let cells: Vec<f64> = line.split(',').map(|c| c.parse().unwrap_or(1e3)).collect();
            let row = beside[(cells[0] * RATE_HZ).round() as usize];
            square[0] += (cells[1] - row[1]).powi(2);
            square[1] += row[1].powi(2);
        }
        (square[0] / square[1]).sqrt()
    };
    let (in_loop, without) = (apart("loop.toml", &wanted), apart("study.toml", &wanted));
    let from_measured = apart("loop.toml", &rows);
    println!(
        "{in_loop:.4} in the loop, {without:.3} without, {from_measured:.3} from the measured motion"
    );
    assert!(in_loop < 0.01, "{in_loop}");
    assert!(
        from_measured > 5.0 * in_loop && without > 0.2,
        "{from_measured} {without}"
    );

    let bad = gains.replace("kp = 3000", "kp = -3000");
    fs::write(at.join("bad.toml"), text.replace("inertia = 1.5", &bad)).unwrap();
    let sentence = fail(at, &["respond", "bad.toml", "wrong.json"], 3);
    assert!(sentence.contains("kp and kd"), "{sentence}");
}
