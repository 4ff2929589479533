//! A column that the study does not name and that rises with the time, as temperatures do.

use jointwatch_tests::program::{json, succeed};
use jointwatch_tests::written::{HEAD, write_study};
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;

const RATE_HZ: f64 = 1000.0;
const FRICTION: f64 = 10.0;
const PER_DEGREE: f64 = -0.1;

/// A spring and a damper with dry friction that falls with a temperature.
fn record(seed: f64, start: f64) -> String {
    let mut text = String::from("t,x,F,oil temp [degC],count\n");
    for row in 0..8000 {
        let t = f64::from(row) / RATE_HZ;
        let tones = [1.3, 2.9, 5.1, 8.7].map(|f| f * (1.0 + 0.02 * seed));
        let sum = |turn: f64, size: &dyn Fn(f64) -> f64| -> f64 {
            let each = tones.iter();
            each.map(|f| 4e-3 * size(*f) * (TAU * f * t + seed * f + turn).sin())
                .sum()
        };
        let (x, v) = (sum(0.0, &|f| 1.0 / f), sum(TAU / 4.0, &|_| TAU));
        let temperature = start + 60.0 * (1.0 - (-t / 5.0).exp());
        let noise = 0.02 * (7919.0 * f64::from(row) * (1.0 + seed)).sin();
        let friction = FRICTION + PER_DEGREE * (temperature - 20.0);
        let force = 2000.0 * x + 30.0 * v + friction * (v / 1e-3).tanh() + noise;
        writeln!(text, "{t:.3},{x:.9},{force:.6},{temperature:.2},{row}").unwrap();
    }
    text
}

#[test]
fn what_rises_with_time_is_an_input_unless_it_is_a_clock() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("one.csv"), record(0.3, 20.0)).unwrap();
    fs::write(folder.join("two.csv"), record(1.7, 30.0)).unwrap();
    let base = "\"stiffness@x\", \"viscous@x\", \"coulomb@x\"";
    write_study(folder, HEAD, &["one.csv", "two.csv"], 1, base);
    succeed(folder, "identify study.toml --model physical");
    let said = json(folder, "diagnose study.toml model.json");
    assert_eq!(said["verdict"], "effect", "{said}");
    let found = said["found"][0]["effect"].as_str().unwrap();
    assert!(found.starts_with("coulomb*oil_temp"), "{said}");
    let parameters = said["ranked"][0]["parameters"].as_array().unwrap();
    let friction = parameters[0]["value"].as_f64().unwrap();
    // What rises so slowly may be followed behind any short lag, which costs a few per cent of the
    // slope.
    assert!((friction / PER_DEGREE - 1.0).abs() < 0.05, "{said}");
    assert!(!said.to_string().contains("*count"), "{said}");
}
