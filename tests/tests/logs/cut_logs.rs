//! Logs that are cut out of longer ones: what the joint remembers from before shows in the first
//! seconds, and no model can know it beforehand.

use super::noise::noise;
use jointwatch_tests::learnt::parameter;
use jointwatch_tests::program::{read_json, succeed};
use jointwatch_tests::written::{HEAD, write_study};
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

const RATE_HZ: f64 = 500.0;
/// Samples before the log begins, and in it.
const BEFORE: usize = 1500;
const LOGGED: usize = 8000;
const STIFFNESS: f64 = 2e4;
const SLIP: f64 = 0.003;

/// Force at every displacement of a path that begins at rest: a spring, and another one behind a
/// slider.
fn force(path: &[f64]) -> Vec<f64> {
    let mut stretch = 0.0_f64;
    let mut before = path[0];
    let step = |x: &f64| {
        stretch = (stretch + x - before).clamp(-SLIP, SLIP);
        before = *x;
        STIFFNESS * (0.5 * x + 2.0 * stretch)
    };
    path.iter().map(step).collect()
}

/// A record of many tones, cut where the joint is anywhere.
fn record(seed: f64) -> String {
    let tones = [0.13, 0.21, 0.37, 0.55];
    let at = |row: usize| {
        let t = row as f64 / RATE_HZ;
        let tone = |f: f64| (TAU * f * t + seed * (3.0 + 7.0 * f)).sin();
        0.0025 * tones.iter().map(|f| tone(*f)).sum::<f64>()
    };
    let path: Vec<f64> = (0..BEFORE + LOGGED).map(at).collect();
    let force = force(&path);
    let mut noise = noise(1 + (1e3 * seed) as u64);
    let mut text = String::from("t,x,F\n");
    for (row, (x, force)) in path.iter().zip(force).enumerate().skip(BEFORE) {
        let t = (row - BEFORE) as f64 / RATE_HZ;
        writeln!(text, "{t:.3},{x:.9},{:.6}", force + 0.1 * noise()).unwrap();
    }
    text
}

/// The model of a study whose base is a damper and a slider.
fn identified(folder: &Path) -> Value {
    let files = ["one.csv", "two.csv", "three.csv"];
    for (file, seed) in files.into_iter().zip([0.3, 1.1, 1.9]) {
        fs::write(folder.join(file), record(seed)).unwrap();
    }
    let head = ["band_hz = 10\n", HEAD].concat();
    let base = "\"stiffness@x\", \"viscous@x\", \"jenkins@x\"";
    write_study(folder, &head, &files, 2, base);
    succeed(folder, "identify . --model physical -o m.json");
    read_json(folder.join("m.json"))
}

#[test]
fn what_was_before_the_record_is_found_with_it() {
    let folder = tempfile::tempdir().unwrap();
    let model = identified(folder.path());
    for of in ["verification", "validation"] {
        let error = model[of][0]["relative_error"].as_f64().unwrap();
        println!("{of} {error:.5}");
        // From rest at the first row it is 0.08 in training.
        assert!(error < 0.01, "{of} {error}");
    }
    let slip = parameter(&model, "jenkins", "slip_displacement");
    assert!((slip / SLIP - 1.0).abs() < 0.01, "{slip}");
}
