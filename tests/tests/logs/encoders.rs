//! Positions as encoders and absolute sensors give them: in counts of a size that nobody states,
//! and from a zero that lies elsewhere.

use crate::noise::noise;
use jointwatch_tests::program::{says, succeed};
use std::f64::consts::TAU;
use std::fmt::Write;
use std::fs;
use tempfile::TempDir;

const RATE_HZ: f64 = 500.0;
/// Radians of a count.
const COUNT: f64 = TAU / 8192.0;

/// Angle, velocity and acceleration of a drive that goes to and fro.
fn motion(t: f64) -> [f64; 3] {
    let tones = [(0.6, 0.9, 0.2), (1.7, 0.3, 1.1), (3.9, 0.08, 2.3)];
    tones.iter().fold([0.0; 3], |[x, v, a], (hz, size, phase)| {
        let w = TAU * hz;
        let (sine, cosine) = (w * t + phase).sin_cos();
        [
            x + size * sine,
            v + size * w * cosine,
            a - size * w * w * sine,
        ]
    })
}

/// A motor with inertia and friction, its current logged beside the encoder's counts and a speed in
/// turns a minute.
fn motor() -> String {
    let mut noise = noise(1);
    let mut text = String::from("t[s]\tIq[A]\tn_act[rpm]\tenc_mot[counts]\n");
    for row in 0..6000 {
        let t = row as f64 / RATE_HZ;
        let [x, v, a] = motion(t);
        let torque = 2e-3 * a + 0.02 * v + 0.05 * (v / 0.05).tanh();
        let counts = (90_000.0 + x / COUNT).round();
        writeln!(
            text,
            "{t:.3}\t{:.4}\t{:.2}\t{counts}",
            torque / 0.06 + 1e-3 * noise(),
            v * 60.0 / TAU
        )
        .unwrap();
    }
    text
}

#[test]
fn the_size_of_a_count_is_told_by_the_speed_beside_it() {
    let folder = TempDir::new().unwrap();
    let at = folder.path();
    fs::write(at.join("trace.txt"), motor()).unwrap();
    let said = succeed(at, &["init", "--yes", "trace.txt"]);
    says(&said, &["one count of \"enc_mot[counts]\" is 7.6"]);
    let study = fs::read_to_string(at.join("study.toml")).unwrap();
    assert!(study.contains("kind = \"rotation\""), "{study}");
    let scale = study
        .split_once("unit = \"counts\", scale = ")
        .expect(&study)
        .1;
    let scale: f64 = scale.split([' ', '}']).next().unwrap().parse().unwrap();
    assert!((scale / COUNT - 1.0).abs() < 0.005, "{scale}");
    says(&study, &["velocity = { column = \"n_act[rpm]\""]);
    let checked = succeed(at, &["identify", "study.toml", "--model", "physical"]);
    assert!(!checked.contains("Check:"), "{checked}");
}

/// A spring and a damper at an absolute sensor, whose zero lies 90 mm away.
fn strut() -> String {
    let mut noise = noise(2);
    let mut text = String::from("t_s,hub_mm,F_N\n");
    for row in 0..6000 {
        let t = row as f64 / RATE_HZ;
        let [x, v, _] = motion(t).map(|value| 0.02 * value);
        let force = 2300.0 * x + 400.0 * v + 0.3 * noise();
        writeln!(text, "{t:.3},{:.3},{force:.2}", 1e3 * x + 90.0).unwrap();
    }
    text
}

#[test]
fn a_position_that_counts_from_elsewhere_gets_a_constant_beside_its_spring() {
    let folder = TempDir::new().unwrap();
    let at = folder.path();
    fs::write(at.join("strut.csv"), strut()).unwrap();
    succeed(at, &["init", "--yes", "strut.csv"]);
    let study = fs::read_to_string(at.join("study.toml")).unwrap();
    let base = "terms = [\"stiffness@x\", \"preload@x\", \"viscous@x\"]";
    assert!(study.contains(base), "{study}");
    succeed(at, "identify study.toml --model physical -o m.json");
    let said = succeed(at, &["diagnose", "study.toml", "m.json"]);
    assert!(said.contains("Nothing is missing."), "{said}");
}
