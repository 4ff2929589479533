//! Inputs: further columns of a study that a force may follow, at once or behind a lag.

mod columns;
mod standing;

use jointwatch_shared::wire::rig_block::decode;
use jointwatch_tests::learnt::value;
use jointwatch_tests::program::{fail, json, read_json, says, succeed};
use jointwatch_tests::written::{HEAD, write_study};
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

const RATE_HZ: f64 = 1000.0;
const STIFFNESS: f64 = 2000.0;
const DAMPING: f64 = 30.0;
const FRICTION: f64 = 4.0;
const PER_VOLT: f64 = 6.0;
const LAG_S: f64 = 0.02;
/// A friction in proportion to the voltage.
const LINE: [f64; 2] = [PER_VOLT, 0.0];

/// A damper whose dry friction follows a voltage and its square, which act behind a lag, by so much
/// each; the voltage may stand still.
fn record(seed: f64, standing: Option<f64>, [per_volt, per_square]: [f64; 2]) -> String {
    let mut text = String::from("t,x,F,U\n");
    let mut behind = standing.unwrap_or(1.0);
    for row in 0..8000 {
        let t = f64::from(row) / RATE_HZ;
        let tones = [1.3, 2.9, 5.1, 8.7].map(|f| f * (1.0 + 0.02 * seed));
        let wave = |f: &f64, shift: f64| (TAU * f * t + seed * f + shift).sin() / f;
        let x: f64 = 4e-3 * tones.iter().map(|f| wave(f, 0.0)).sum::<f64>();
        let v: f64 = 4e-3
            * tones
                .iter()
                .map(|f| TAU * f * wave(f, TAU / 4.0))
                .sum::<f64>();
        let steps = (7.0 * t + seed).floor();
        let volts = standing.unwrap_or(1.0 + (12.9898 * steps).sin());
        behind += (volts - behind) * (1.0 - (-1.0 / RATE_HZ / LAG_S).exp());
        let friction = FRICTION + behind * (per_volt + per_square * behind);
        let noise = 0.02 * (7919.0 * f64::from(row) * (1.0 + seed)).sin();
        let force = STIFFNESS * x + DAMPING * v + friction * (v / 1e-3).tanh() + noise;
        writeln!(text, "{t:.3},{x:.9},{force:.6},{volts:.4}").unwrap();
    }
    text
}

fn study(folder: &Path, terms: &str, input: &str) {
    let head = [HEAD, input].concat();
    write_study(folder, &head, &["one.csv", "two.csv"], 1, terms);
}

const VOLTAGE: &str = "[[input]]\nname = \"voltage\"\ncolumn = \"U\"\nunit = \"V\"\n";

fn written(standing: Option<f64>, follows: [f64; 2]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, seed) in [("one.csv", 0.3), ("two.csv", 1.7)] {
        let text = record(seed, standing, follows);
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

/// What `identify` says about a physical model.
fn identified(folder: &Path) -> String {
    succeed(folder, "identify study.toml --model physical -o model.json")
}

fn identify(folder: &Path) -> Value {
    identified(folder);
    read_json(folder.join("model.json"))
}

const DIAGNOSE: &str = "diagnose study.toml model.json --apply -o added.json --json verdict.json";

/// The verdict on a joint whose friction is known and whose voltage is not, and the model with all
/// that it names, which explains the force.
fn explained(folder: &Path) -> (Value, Value) {
    let base = "\"stiffness@x\", \"viscous@x\", \"coulomb@x\"";
    study(folder, base, VOLTAGE);
    identify(folder);
    succeed(folder, DIAGNOSE);
    let verdict = read_json(folder.join("verdict.json"));
    assert_eq!(verdict["verdict"], "effect", "{verdict}");
    let after = verdict["relative_error_after"]["x"].as_f64().unwrap();
    assert!(after < 0.01, "{verdict}");
    (verdict, read_json(folder.join("added.json")))
}

#[test]
fn a_friction_that_follows_a_voltage_is_found_with_its_parts_and_its_lag() {
    let folder = written(None, LINE);
    let folder = folder.path();
    study(
        folder,
        "\"stiffness@x\", \"viscous@x\", \"coulomb@x\", \"coulomb@x * input(voltage~20ms)\"",
        VOLTAGE,
    );
    let model = identify(folder);
    let near = |said: f64, truth: f64| (said / truth - 1.0).abs() < 0.02;
    assert!(near(value(&model, "coulomb"), FRICTION), "{model}");
    assert!(
        near(value(&model, "coulomb*voltage~20ms"), PER_VOLT),
        "{model}"
    );
    assert!(near(value(&model, "stiffness"), STIFFNESS), "{model}");
    // The joint with and without its voltage: one shape for both parts.
    let shape = |effect: &str| {
        let effects = model["effects"].as_array().unwrap();
        let effect = effects.iter().find(|e| e["effect"] == effect).unwrap();
        effect["parameters"][1]["value"].as_f64().unwrap()
    };
    assert_eq!(shape("coulomb"), shape("coulomb*voltage~20ms"));

    // Left out, it is found again, and the lag to the next of those that are tried.
    let (verdict, _) = explained(folder);
    assert_eq!(
        verdict["found"][0]["effect"], "coulomb*voltage~20ms",
        "{verdict}"
    );
}

#[test]
fn a_friction_that_rises_and_falls_with_a_voltage_is_found_with_its_square() {
    // The straight line through it is next to level: without the square neither the lag nor most of
    // the force shows.
    let folder = written(None, [PER_VOLT, -2.6]);
    let (_, model) = explained(folder.path());
    for (effect, truth) in [
        ("coulomb", FRICTION),
        ("coulomb*voltage~20ms", PER_VOLT),
        ("coulomb*voltage^2~20ms", -2.6),
    ] {
        let found = value(&model, effect);
        assert!((found / truth - 1.0).abs() < 0.02, "{effect}: {found}");
    }
}

/// A joint whose friction follows a voltage, learnt in this folder and exported.
fn exported() -> tempfile::TempDir {
    let folder = written(None, LINE);
    let at = folder.path();
    study(
        at,
        "\"stiffness@x\", \"viscous@x\", \"coulomb@x\", \"coulomb*voltage~20ms@x\"",
        VOLTAGE,
    );
    identify(at);
    succeed(at, "export model.json -o model.bin");
    folder
}

#[test]
fn a_force_that_follows_a_voltage_runs_on_the_device_with_the_hosts_bits() {
    let folder = exported();
    let at = folder.path();
    let inspected = succeed(at, "inspect model.bin");
    assert!(inspected.contains("coulomb*voltage~20ms@x"), "{inspected}");
    // The device's arithmetic misses as little as the model itself.
    let error = |replayed: &Value| {
        let record = &replayed["records"][1];
        record["axes"]["x"]["relative_error"].as_f64().unwrap()
    };
    let replayed = json(at, "replay model.bin study.toml --quiet");
    assert!(error(&replayed) < 0.01, "{replayed}");
    // And with a voltage that stands still it would not.
    let text = fs::read_to_string(at.join("study.toml")).unwrap();
    let still = text.replace(
        "column = \"U\"",
        "column = \"U\"\nscale = 1e-9\noffset = 1.0",
    );
    fs::write(at.join("still.toml"), still).unwrap();
    let replayed = json(at, "replay model.bin still.toml --quiet");
    assert!(error(&replayed) > 0.05, "{replayed}");

    // A study without it is refused, by name.
    fs::write(at.join("none.toml"), text.replace(VOLTAGE, "")).unwrap();
    let sentence = fail(at, &["replay", "model.bin", "none.toml"], 3);
    says(&sentence, &["voltage", "[[input]]"]);

    // The firmware, its converter fed with force and voltage.
    let emulated = json(at, "emulate model.bin study.toml --quiet");
    for record in emulated["records"].as_array().unwrap() {
        assert_eq!(record["agrees"], true, "{record}");
        let outputs = record["comparison"]["outputs"].as_u64();
        assert!(outputs.unwrap() > 7000, "{record}");
    }
}

#[test]
fn a_friction_that_goes_with_the_square_of_a_voltage_is_found_and_exported() {
    let folder = written(None, [0.0, PER_VOLT]);
    let at = folder.path();
    study(
        at,
        "\"stiffness@x\", \"viscous@x\", \"coulomb@x\", \"coulomb*voltage~20ms@x\", \"coulomb*voltage^2~20ms@x\"",
        VOLTAGE,
    );
    let model = identify(at);
    let near = |said: f64, truth: f64| (said - truth).abs() < 0.02 * PER_VOLT;
    assert!(near(value(&model, "coulomb"), FRICTION), "{model}");
    assert!(near(value(&model, "coulomb*voltage~20ms"), 0.0), "{model}");
    let square = value(&model, "coulomb*voltage^2~20ms");
    assert!(near(square, PER_VOLT), "{model}");
    let unit = &model["effects"][4]["parameters"][0]["unit"];
    assert_eq!(unit, "N per voltage^2", "{model}");
    succeed(at, "export model.json -o model.bin");
    let replayed = json(at, "replay model.bin study.toml --quiet");
    let error = &replayed["records"][1]["axes"]["x"]["relative_error"];
    assert!(error.as_f64().unwrap() < 0.01, "{replayed}");
}

#[test]
fn the_description_of_a_rig_states_where_the_input_is_wired() {
    let folder = exported();
    let at = folder.path();
    let rig = |input: &str| {
        format!(
            "[wiring]\noversampling = 1024\ncounters = [{{}}]\n\n[[axis]]\nname = \"x\"\nfar = \"+0\"\ncounts_per_m = 1e6\n\
             bridge = \"+0\"\ngain = 32\nsensitivity = 250000.0\nexcitation_V = 3.0\n{input}"
        )
    };
    let export = ["export", "model.json", "--rig", "rig.toml", "-o", "rig.bin"];
    let with = |input: &str| fs::write(at.join("rig.toml"), rig(input)).unwrap();
    let input = "input = { channel = \"-2\", gain = 2, per_V = 4.0, at_0_V = 0.5 }\n";
    with(&format!("{input}skew_us = {{ force = 620.0 }}\n"));
    succeed(at, &export);
    let block = decode(&fs::read(at.join("rig.bin")).unwrap()).unwrap();
    let axis = &block.axes[0];
    let step = 1.2 / 2.0 / 8_388_608.0 * 4.0;
    assert!((axis.input_step / step - 1.0).abs() < 1e-12);
    assert_eq!(axis.input_zero, 0.5);
    let late = 620e-6 * block.sample_rate_hz;
    assert!((axis.delays.input - late).abs() < 1e-9);
    assert_eq!(block.wiring.converter.gain_log2, [5, 0, 1, 0]);
    let wired = block.wiring.axes[0].input.unwrap();
    assert_eq!((wired.place, wired.negative), (2, true));
    // A record's channels belong to one instant.
    with(input);
    succeed(at, &export);
    let said = json(at, "replay model.bin study.toml --rig rig.bin --quiet");
    let error = said["records"][1]["axes"]["x"]["relative_error"].as_f64();
    assert!(error.unwrap() < 0.02, "{said}");

    for (input, words) in [
        ("", "follows the input \"voltage\""),
        (
            "input = { channel = \"+0\", gain = 32, per_V = 1.0 }\n",
            "channel 0 is given away",
        ),
        (
            "input = { channel = \"+4\", gain = 1, per_V = 1.0 }\n",
            "converter channel",
        ),
        (
            "input = { channel = \"+2\", gain = 3, per_V = 1.0 }\n",
            "gain = 3",
        ),
        (
            "input = { channel = \"+2\", gain = 1, per_V = -1.0 }\n",
            "per_V",
        ),
        (
            "input = { channel = \"+2\", gain = 1, per_V = 1.0, at_0_V = nan }\n",
            "at_0_V",
        ),
    ] {
        with(input);
        let sentence = fail(at, &export, 3);
        assert!(sentence.contains(words), "{words}: {sentence}");
    }
}

#[test]
fn what_a_device_cannot_follow_is_said_when_it_is_exported() {
    let folder = written(None, LINE);
    let at = folder.path();
    let second = "[[input]]\nname = \"second\"\ncolumn = \"U\"\noffset = 1.0\n";
    let long = VOLTAGE.replace("voltage", "supply_voltage_of_the_coil");
    for (effects, inputs, words) in [
        (
            "\"coulomb*voltage@x\", \"viscous*second@x\"",
            [VOLTAGE, second].concat(),
            "one input channel an axis",
        ),
        (
            "\"coulomb*supply_voltage_of_the_coil@x\"",
            long,
            "longer than 16 bytes",
        ),
    ] {
        study(at, &format!("\"stiffness@x\", {effects}"), &inputs);
        identify(at);
        let sentence = fail(at, &["export", "model.json", "-o", "blob.bin"], 3);
        assert!(sentence.contains(words), "{words}: {sentence}");
        assert!(!at.join("blob.bin").exists());
    }
    // A model of a version that did not keep the range.
    study(at, "\"stiffness@x\", \"coulomb*voltage@x\"", VOLTAGE);
    let mut model = identify(at);
    model.as_object_mut().unwrap().remove("followed").unwrap();
    fs::write(at.join("old.json"), model.to_string()).unwrap();
    let sentence = fail(at, &["export", "old.json", "-o", "blob.bin"], 3);
    assert!(sentence.contains("between which values"), "{sentence}");
}

#[test]
fn an_input_that_is_wrong_is_told_in_a_sentence() {
    let folder = written(Some(1.0), LINE);
    let folder = folder.path();
    let refused = |terms: &str, input: &str, words: &[&str]| {
        study(folder, terms, input);
        let sentence = fail(
            folder,
            "identify study.toml --model physical -o model.json",
            3,
        );
        says(&sentence, words);
    };
    let base = "\"stiffness@x\", \"viscous@x\"";
    refused(
        "\"stiffness@x\", \"coulomb*voltage@x\"",
        "",
        &["coulomb*voltage@x", "[[input]]"],
    );
    refused(
        base,
        "[[input]]\nname = \"voltage\"\ncolumn = \"W\"\n",
        &["\"W\"", "one.csv"],
    );
    refused(
        base,
        "[[input]]\nname = \"two words\"\ncolumn = \"U\"\n",
        &["two words", "line"],
    );
    refused(base, &VOLTAGE.repeat(2), &["voltage", "twice"]);
    refused(
        "\"stiffness@x\", \"time_delay*voltage@x\"",
        VOLTAGE,
        &["time_delay", "joint"],
    );
    refused("\"coulomb*voltage~fast@x\"", VOLTAGE, &["milliseconds"]);
    refused(
        "\"coulomb*voltage@x * input(current)\"",
        VOLTAGE,
        &["two inputs", "voltage and current"],
    );
    // One that never changes is told, and nothing is made of it.
    study(folder, base, VOLTAGE);
    let said = identified(folder);
    says(&said, &["voltage", "same in all rows"]);
    succeed(folder, "diagnose study.toml model.json --json verdict.json");
    let verdict = fs::read_to_string(folder.join("verdict.json")).unwrap();
    assert!(!verdict.contains("*voltage"), "{verdict}");
}

#[test]
fn an_input_that_is_a_channel_once_more_is_told() {
    let folder = written(None, LINE);
    let folder = folder.path();
    let base = "\"stiffness@x\", \"viscous@x\"";
    let told = |column: &str| {
        let input = format!(
            "[[input]]\nname = \"voltage\"\ncolumn = {column}\nscale = -3.0\noffset = 1.0\n"
        );
        study(folder, base, &input);
        identified(folder)
    };
    for (column, channel) in [("\"x\"", "displacement"), ("\"F\"", "force")] {
        let said = told(column);
        let words = format!("the input \"voltage\" is the {channel} of x but for its scale");
        assert!(said.contains(&words), "{said}");
    }
    assert!(!told("\"U\"").contains("but for its scale"));
}
