//! A network on its way to the device, as a user takes it there: export, inspect, replay, and what
//! is refused.

use jointwatch_shared::scalar::fixed::q31_to_f64;
use jointwatch_shared::selftest::Points;
use jointwatch_tests::program::{fail, json, read_json, succeed};
use jointwatch_tests::story::story;
use serde_json::{Value, json};
use std::fs;
use tempfile::TempDir;

/// The study of the story with a network of random weights of up to `size` in place of the
/// polynomial that was learnt.
fn study_with_network(neurons: usize, size: f64, seed: u64) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut model = read_json(story().join("model.json"));
    let mut points = Points::new(seed);
    let mut draw = |count: usize| -> Vec<f64> {
        let numbers = (0..count).map(|_| size * q31_to_f64(points.next_word()));
        numbers.collect()
    };
    model["base"] = json!({ "network": {
        "inputs": model["base"]["polynomial"]["inputs"],
        "outputs": [{ "center": 3.0, "half_range": 40.0 }, { "center": -0.1, "half_range": 2.5 }],
        "hidden_weights": (0..neurons).map(|_| draw(4)).collect::<Vec<_>>(),
        "hidden_bias": draw(neurons),
        "output_weights": [draw(neurons), draw(neurons)],
        "output_bias": draw(2),
    } });
    fs::write(folder.path().join("network.json"), model.to_string()).unwrap();
    folder
}

#[test]
fn export_states_its_error_and_inspect_and_replay_take_the_blob() {
    let folder = study_with_network(40, 2.0, 31);
    let exported = json(folder.path(), "export network.json -o network.bin");
    assert_eq!(exported["bytes"], 4096);
    for (axis, half_range) in exported["axes"].as_array().unwrap().iter().zip([40.0, 2.5]) {
        let [seen, bound] = ["largest_error", "error_bound"].map(|key| axis[key].as_f64().unwrap());
        // Measured and proven: 5e-8 of the largest force that 40 weights of 2 and a bias could
        // give.
        let full_scale = 82.0 * half_range + 3.0;
        assert!(
            seen > 0.0 && seen <= bound && bound <= 5e-8 * full_scale,
            "{axis}"
        );
    }
    let said = succeed(folder.path(), &["inspect", "network.bin"]);
    assert!(
        said.contains("Blob: network, 40 neurons; samples at"),
        "{said}"
    );
    let inspected = json(folder.path(), "inspect network.bin");
    assert_eq!(
        (&inspected["base"], &inspected["neurons"]),
        (&json!("network"), &json!(40))
    );

    // What the device would say on the records is what the model says in f64.
    let rig = story().join("rig");
    let rig = rig.to_str().unwrap();
    let replayed = json(folder.path(), &["replay", "network.bin", rig]);
    let compared = json(folder.path(), &["compare", rig, "network.json"]);
    let records = replayed["records"].as_array().unwrap();
    assert!(!records.is_empty());
    for (a, b) in records.iter().zip(compared["records"].as_array().unwrap()) {
        for axis in ["x", "phi"] {
            let error = |of: &Value| of["axes"][axis]["relative_error"].as_f64().unwrap();
            let (device, host) = (error(a), error(b));
            // Their ends differ, where the device's filters have not filled yet.
            assert!(
                (device / host - 1.0).abs() < 0.02,
                "{axis}: {device} and {host}"
            );
        }
    }
}

#[test]
fn a_network_beyond_its_budget_or_the_device_is_refused_and_nothing_is_written() {
    let folder = study_with_network(40, 2.0, 32);
    let tight = ["export", "network.json", "--budget", "1e-12"];
    let sentence = fail(folder.path(), &tight, 3);
    for part in [
        "network.json",
        "of axis 0 may be off by",
        "neuron ",
        "output weight",
    ] {
        assert!(sentence.contains(part), "{sentence}");
    }
    let folder = study_with_network(41, 2.0, 33);
    let sentence = fail(folder.path(), &["export", "network.json"], 3);
    let part = "number of neurons is 41, but has to lie between 1 and 40";
    assert!(sentence.contains(part), "{sentence}");
    assert!(!folder.path().join("model.bin").exists());
}
