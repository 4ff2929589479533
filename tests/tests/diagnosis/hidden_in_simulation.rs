//! `jointwatch simulate --hidden`: the share that was asked for is in the files, and what cannot be
//! hidden is refused.

use jointwatch_tests::learnt::value;
use jointwatch_tests::program::{fail, read_json, succeed};
use serde_json::Value;
use std::fs;
use std::path::Path;

fn column(path: &Path, name: &str) -> Vec<f64> {
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let place = lines
        .next()
        .unwrap()
        .split(',')
        .position(|n| n == name)
        .unwrap();
    lines
        .map(|l| l.split(',').nth(place).unwrap().parse().unwrap())
        .collect()
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

fn truth(rig: &Path) -> Value {
    read_json(rig.join("truth/truth.json"))
}

#[test]
fn the_hidden_share_is_in_the_truth_and_a_model_with_the_effect_finds_its_values() {
    for (effect, share, tolerance) in [("coulomb@x", "0.1", 0.1), ("jenkins@phi", "0.15", 0.1)] {
        let folder = tempfile::tempdir().unwrap();
        let here = folder.path();
        let hidden = format!("--hidden {effect} --share {share}");
        let rest = "--snr-db none --duration 4";
        succeed(here, &format!("simulate --out rig {hidden} {rest}"));
        let rig = here.join("rig");
        let truth = truth(&rig);
        let hidden = &truth["effects"][0];
        let wanted: f64 = share.parse().unwrap();
        let reached = hidden["share_of_rms_force"].as_f64().unwrap();
        assert!((reached / wanted - 1.0).abs() < 0.02, "{effect}: {reached}");
        let study = fs::read_to_string(rig.join("study.toml")).unwrap();
        let name = effect.split('@').next().unwrap();
        assert!(!study.contains(name), "{study}");

        // The base with the effect beside it has the values that the truth states.
        let more = study.replace("terms = [", &format!("terms = [\"{effect}\", "));
        fs::write(rig.join("study.toml"), more).unwrap();
        succeed(here, "identify rig --model physical -o model.json");
        let model = read_json(here.join("model.json"));
        let ratio = value(&model, name) / hidden["parameters"][0]["value"].as_f64().unwrap();
        assert!(
            (ratio - 1.0).abs() < tolerance,
            "{effect}: {ratio} of the truth"
        );
    }
}

#[test]
fn faults_of_the_instruments_are_in_the_log_and_the_motion_is_as_without_them() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let simulate = |out: &str, more: &str| {
        let words = format!("simulate --out {out} --snr-db none --duration 2{more}");
        succeed(here, &words);
        let log = here.join(out).join("train_both.csv");
        (column(&log, "x2_m"), column(&log, "force_N"))
    };
    let (plain_x, plain) = simulate("plain", "");
    for effect in ["force_gain@x", "time_delay@x", "crosstalk@x"] {
        let (x, force) = simulate(effect, &format!(" --hidden {effect} --share 0.05"));
        assert_eq!(x, plain_x, "{effect}");
        let value = truth(&here.join(effect))["effects"][0]["parameters"][0]["value"]
            .as_f64()
            .unwrap();
        let difference: Vec<f64> = plain.iter().zip(&force).map(|(a, b)| b - a).collect();
        println!(
            "{effect} {value}: {} of the force",
            rms(&difference) / rms(&plain)
        );
        assert!(rms(&difference) > 0.01 * rms(&plain), "{effect}");
        match effect {
            // F = F_read·(1 − g).
            "force_gain@x" => {
                let right: Vec<f64> = plain
                    .iter()
                    .zip(&force)
                    .map(|(a, b)| b * (1.0 - value) - a)
                    .collect();
                assert!(rms(&right) < 1e-6 * rms(&plain), "{effect}");
            }
            // Late by as many samples, rounded, it fits best.
            "time_delay@x" => {
                let late = (value * 2000.0).round() as usize;
                let left = |shift: usize| {
                    let pairs = plain.iter().zip(&force[shift..]);
                    rms(&pairs.map(|(a, b)| b - a).collect::<Vec<_>>())
                };
                assert!(
                    value > 0.0 && (0..6).all(|s| left(late) <= left(s)),
                    "{value}"
                );
            }
            _ => {}
        }
    }
    let (_, force) = simulate("inertia", " --hidden inertia_error@x --share 0.05");
    assert_eq!(force, plain);
    let error = truth(&here.join("inertia"))["effects"][0]["parameters"][0]["value"]
        .as_f64()
        .unwrap();
    let study = fs::read_to_string(here.join("inertia/study.toml")).unwrap();
    let stated = study.lines().find(|l| l.starts_with("inertia")).unwrap();
    let stated: f64 = stated.split(" = ").nth(1).unwrap().parse().unwrap();
    assert!((stated + error - 1.8).abs() < 1e-9, "{stated} + {error}");
}

#[test]
fn what_cannot_be_hidden_is_refused_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    for (words, part) in [
        ("--hidden stiffness@x", "part of the simulated joint"),
        ("--hidden coloumb@x", "coulomb"),
        ("--hidden coulomb@y", "axis"),
        ("--hidden coulomb", "coulomb@x"),
        ("--hidden crosstalk@x --axes 1", "two axes"),
        ("--hidden coulomb@x --share 0", "share"),
        ("--hidden coulomb@x --share 3", "share"),
    ] {
        let all = format!("simulate --out rig --duration 1 {words}");
        let sentence = fail(folder.path(), &all, 2);
        assert!(sentence.contains(part), "{words}: {sentence}");
        assert!(!folder.path().join("rig").exists(), "{words}");
    }
}
