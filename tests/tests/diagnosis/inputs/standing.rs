//! Inputs that stand still while a log runs, and differ from one log to the next: runs at a few
//! currents, or of cold and of warm joints.

use super::{DAMPING, DIAGNOSE, FRICTION, LINE, PER_VOLT, STIFFNESS, VOLTAGE, identify, record};
use jointwatch_tests::learnt::value;
use jointwatch_tests::program::{read_json, succeed};
use jointwatch_tests::written::{HEAD, write_study};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// Logs at these voltages, of which the first `training` ones are learnt from.
fn written(volts: &[f64], training: usize, input: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let files = &["0.csv", "1.csv", "2.csv", "3.csv"][..volts.len()];
    for (at, volts) in volts.iter().enumerate() {
        let log = record(0.3 + 0.7 * at as f64, Some(*volts), LINE);
        fs::write(folder.path().join(files[at]), log).unwrap();
    }
    let head = [HEAD, input].concat();
    let base = "\"stiffness@x\", \"viscous@x\", \"coulomb@x\"";
    write_study(folder.path(), &head, files, training, base);
    folder
}

fn diagnosed(folder: &Path) -> (Value, Vec<String>) {
    identify(folder);
    succeed(folder, DIAGNOSE);
    let verdict = read_json(folder.join("verdict.json"));
    let notes = verdict["notes"].as_array().unwrap().iter();
    let notes = notes
        .map(|note| note.as_str().unwrap().to_owned())
        .collect();
    (verdict, notes)
}

#[test]
fn a_friction_that_follows_a_voltage_of_each_log_is_found() {
    let folder = written(&[0.5, 2.0, 3.0, 1.2], 3, VOLTAGE);
    let (verdict, notes) = diagnosed(folder.path());
    assert_eq!(verdict["verdict"], "effect", "{verdict}");
    assert_eq!(
        verdict["found"][0]["effect"], "coulomb*voltage",
        "{verdict}"
    );
    assert!(
        !notes.iter().any(|n| n.contains("stands still")),
        "{notes:?}"
    );
    let model = read_json(folder.path().join("added.json"));
    for (effect, truth) in [
        ("coulomb", FRICTION),
        ("coulomb*voltage", PER_VOLT),
        ("stiffness", STIFFNESS),
        ("viscous", DAMPING),
    ] {
        let found = value(&model, effect);
        assert!((found / truth - 1.0).abs() < 0.02, "{effect} {found}");
    }
}

#[test]
fn two_values_of_an_input_may_be_two_kinds_of_logs() {
    let folder = written(&[0.5, 2.0, 0.5, 1.2], 3, VOLTAGE);
    let (verdict, notes) = diagnosed(folder.path());
    assert_eq!(
        verdict["found"][0]["effect"], "coulomb*voltage",
        "{verdict}"
    );
    let said = "coulomb*voltage@x: voltage stands still in every training record and has two values in all";
    assert!(notes.iter().any(|n| n.starts_with(said)), "{notes:?}");
}

#[test]
fn a_column_that_differs_as_the_joint_does_is_named() {
    let folder = written(&[0.5, 2.0, 3.0, 1.2], 3, "");
    let (_, notes) = diagnosed(folder.path());
    let said = "what the model leaves on axis x differs from record to record, as do columns";
    let note = notes.iter().find(|n| n.starts_with(said));
    assert!(note.is_some_and(|n| n.contains("\"U\"")), "{notes:?}");
    // Where the joint is the same in all logs, nothing is said of it.
    let same = written(&[1.0, 1.0, 1.0, 1.0], 3, "");
    for at in 0..4 {
        let path = same.path().join(format!("{at}.csv"));
        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, text.replace("1.0000\n", &format!("{at}.0\n"))).unwrap();
    }
    let (_, notes) = diagnosed(same.path());
    assert!(!notes.iter().any(|n| n.starts_with(said)), "{notes:?}");
}

#[test]
fn the_draft_of_a_study_shows_how_to_name_a_column_that_is_left() {
    let folder = written(&[0.5, 2.0, 3.0], 3, "");
    let folder = folder.path();
    fs::remove_file(folder.join("study.toml")).unwrap();
    succeed(folder, "init 0.csv 1.csv 2.csv --yes");
    let text = fs::read_to_string(folder.join("study.toml")).unwrap();
    let block = "# [[input]]\n# name = \"U\"\n# column = \"U\"\n";
    assert!(text.contains(block), "{text}");
    let named = text.replace(block, &block.replace("# ", ""));
    fs::write(folder.join("study.toml"), named).unwrap();
    identify(folder);
    let found = succeed(folder, "diagnose study.toml model.json");
    assert!(found.contains("*U@x"), "{found}");
}
