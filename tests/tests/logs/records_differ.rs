//! A joint that is another one in every record, as after a bolt was tightened anew: no effect of
//! the library, and told as what it is.

use jointwatch_tests::program::{json, says, succeed};
use jointwatch_tests::written::{HEAD, write_study};
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;

const RATE_HZ: f64 = 500.0;
const BASE: &str = "\"stiffness@x\", \"viscous@x\"";

/// A spring of this stiffness and a damper, with another force that depends on the velocity.
fn record(seed: f64, stiffness: f64, besides: impl Fn(f64) -> f64) -> String {
    let mut text = String::from("t,x,F\n");
    for row in 0..6000 {
        let t = f64::from(row) / RATE_HZ;
        let tones = [0.7, 1.9, 3.1].map(|f| f * (1.0 + 0.03 * seed));
        let sum = |turn: f64, size: &dyn Fn(f64) -> f64| -> f64 {
            let each = tones.iter();
            each.map(|f| 4e-3 * size(*f) * (TAU * f * t + seed * f + turn).sin())
                .sum()
        };
        let (x, v) = (sum(0.0, &|f| 1.0 / f), sum(TAU / 4.0, &|_| TAU));
        let noise = 0.01 * (7919.0 * f64::from(row) * (1.0 + seed)).sin();
        writeln!(
            text,
            "{t:.3},{x:.9},{:.6}",
            stiffness * x + 30.0 * v + besides(v) + noise
        )
        .unwrap();
    }
    text
}

#[test]
fn a_stiffness_that_differs_from_record_to_record_is_told_as_that() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let files = ["r0.csv", "r1.csv", "r2.csv", "r3.csv"];
    for (number, stiffness) in [2000.0, 2200.0, 1850.0, 2100.0].into_iter().enumerate() {
        let text = record(number as f64, stiffness, |_| 0.0);
        fs::write(folder.join(files[number]), text).unwrap();
    }
    write_study(folder, HEAD, &files, 3, BASE);
    succeed(folder, &["identify", ".", "--model", "physical"]);
    let said = json(folder, &["diagnose", ".", "model.json"]);
    assert_eq!(said["verdict"], "unknown", "{said}");
    assert_eq!(said["found"], Value::Array(Vec::new()), "{said}");
    assert_eq!(said["remainder"][0]["follows"], "record", "{said}");
    let explained = said["remainder"][0]["explainable"].as_f64().unwrap();
    assert!(explained > 0.5, "{said}");
}

/// A zero of force that stands in one record alone shows only beside another one.
#[test]
fn a_zero_that_differs_between_one_training_record_and_the_validation_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let files = ["r0.csv", "r1.csv"];
    for (number, zero) in [0.0, 3.0].into_iter().enumerate() {
        let text = record(number as f64, 2000.0, |v| 4.0 * (v / 1e-3).tanh() + zero);
        fs::write(folder.join(files[number]), text).unwrap();
    }
    write_study(folder, HEAD, &files, 1, BASE);
    succeed(folder, &["identify", ".", "--model", "physical"]);
    let said = json(folder, "diagnose . model.json --apply -o full.json");
    let found = said["found"].as_array().unwrap();
    let mut found: Vec<&str> = found
        .iter()
        .map(|f| f["effect"].as_str().unwrap())
        .collect();
    found.sort_unstable();
    assert_eq!(found, ["coulomb", "force_zero"], "{said}");
    let notes = said["notes"].to_string();
    says(&notes, &["the zero of force differs by 3.0"]);
    let last = said["staircase"]["steps"]
        .as_array()
        .unwrap()
        .last()
        .unwrap();
    assert!(
        last["relative_error"]["x"].as_f64().unwrap() < 0.01,
        "{said}"
    );
}
