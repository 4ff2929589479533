//! Logs that this project did not make: six simulated studies of an independent generator, and a
//! real positioning axis.
//!
//! They are not part of the project. Where they are absent, each test says so and what to set.

use jointwatch_tests::learnt::parameter;
use jointwatch_tests::program::{json, measurements, read_json, study_with_logs, succeed};
use std::fs;

#[test]
fn six_foreign_studies_go_through_identify_and_compare() {
    let Some(studies) = measurements("rig_cases") else {
        return;
    };
    let mut seen = 0;
    for entry in fs::read_dir(studies).unwrap() {
        let study = entry.unwrap().path();
        if !study.join("study.toml").is_file() {
            continue;
        }
        let name = study.file_name().unwrap().to_string_lossy().into_owned();
        let folder = tempfile::tempdir().unwrap();
        let path = study.to_str().unwrap();
        succeed(folder.path(), &["identify", path, "--model", "polynomial"]);
        let compared = json(folder.path(), &["compare", path, "model.json"]);
        for axis in compared["validation"].as_array().unwrap() {
            let nmse = axis["nmse_percent"].as_f64().unwrap();
            println!("{name} {}: validation NMSE {nmse:.3} %", axis["axis"]);
            // A polynomial follows none of these joints closely, but it follows each of them.
            assert!(nmse < 25.0, "{name}: {axis}");
        }
        // The device's integers see what the host saw.
        succeed(folder.path(), &["export", "model.json", "-o", "model.bin"]);
        let replayed = json(folder.path(), &["replay", "model.bin", path]);
        assert!(
            replayed["records"]
                .as_array()
                .unwrap()
                .iter()
                .all(|r| r["outputs"].as_u64().unwrap() > 10_000)
        );
        seen += 1;
    }
    assert_eq!(seen, 6, "studies gone through");
}

/// The study that `docs/notebook/measured-axis.md` prints, for the public record of an
/// electro-mechanical positioning system.
const STUDY: &str = include_str!("../../../docs/measured-axis.toml");

/// A folder with that study and its records, where they are at hand.
fn axis_study() -> Option<tempfile::TempDir> {
    let data = measurements("data/emps")?;
    let logs = ["DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"];
    Some(study_with_logs(&data, &logs, STUDY))
}

#[test]
fn a_measured_axis_with_unknown_mass_is_identified() {
    let Some(folder) = axis_study() else {
        return;
    };
    succeed(
        folder.path(),
        "identify study.toml --model polynomial -o model.json",
    );
    let model = read_json(folder.path().join("model.json"));
    let inertia = model["axes"][0]["inertia"].as_f64().unwrap();
    println!("mass {inertia:.3} kg; published 95.109 kg");
    assert!(
        (inertia - 95.109).abs() < 0.02 * 95.109,
        "mass {inertia} kg"
    );
    let compared = json(folder.path(), "compare study.toml model.json");
    let nmse = |role: &str| compared[role][0]["nmse_percent"].as_f64().unwrap();
    println!(
        "verification {:.3} %, validation {:.3} %",
        nmse("verification"),
        nmse("validation")
    );
}

#[test]
fn a_measured_axis_gives_its_published_friction_and_mass() {
    let Some(folder) = axis_study() else {
        return;
    };
    let folder = folder.path();
    let identify = "identify study.toml --model physical -o model.json";
    succeed(folder, identify);
    let model = read_json(folder.join("model.json"));
    let value = |effect: &str, name: &str| parameter(&model, effect, name);
    // Janot, Gautier, Brunot (2019).
    for (what, seen, published) in [
        (
            "mass",
            model["axes"][0]["inertia"].as_f64().unwrap(),
            95.109,
        ),
        ("viscous friction", value("viscous", "damping"), 203.50),
        ("dry friction", value("coulomb", "friction"), 20.394),
        ("offset", value("preload", "force"), -3.165),
    ] {
        println!("{what}: {seen:.3}, published {published}");
        assert!((seen / published - 1.0).abs() < 0.01, "{what}: {seen}");
    }
    let compared = json(folder, "compare study.toml model.json");
    succeed(folder, &["export", "model.json", "-o", "model.bin"]);
    let replayed = json(folder, "replay model.bin study.toml");
    for (number, (role, most)) in [("verification", 0.15), ("validation", 0.3)]
        .into_iter()
        .enumerate()
    {
        let nmse = compared[role][0]["nmse_percent"].as_f64().unwrap();
        let device = replayed["records"][number]["axes"]["x"]["nmse_percent"].as_f64();
        println!("{role}: NMSE {nmse:.4} %, replayed {device:?} %");
        assert!(nmse <= most, "{role}: {nmse} %");
        let device = device.expect("the device's NMSE");
        // The device leaves out the rows outside the training range, so its figure is not above the
        // host's.
        assert!(
            0.5 * nmse < device && device <= nmse,
            "{device} beside {nmse}"
        );
    }
}

#[test]
fn an_untouched_record_of_a_measured_axis_is_not_suspect() {
    let Some(folder) = axis_study() else {
        return;
    };
    let folder = folder.path();
    for model in ["physical", "polynomial"] {
        let identify = format!("identify study.toml --model {model} -o model.json");
        succeed(folder, &identify);
        succeed(folder, &["export", "model.json", "-o", "model.bin"]);
        let replay = "replay model.bin study.toml --monitor --fail-on suspect";
        let said = json(folder, replay);
        let pulses = &said["monitor"]["records"][1];
        println!("{model}: {}", pulses["changes"]);
        assert_eq!(pulses["file"], "DATA_EMPS_PULSES.mat");
    }
}
