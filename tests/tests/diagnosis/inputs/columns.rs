//! Columns that the study does not name.

use super::{DIAGNOSE, LINE, identify, record, study, written};
use jointwatch_tests::program::{fail, read_json, says, succeed};
use std::fs;
use std::path::Path;

/// The logs of [`written`] with a second load cell, a word and a number that never changes.
fn with_more_columns(folder: &Path) {
    for file in ["one.csv", "two.csv"] {
        let text = fs::read_to_string(folder.join(file)).unwrap();
        let rows = text.lines().skip(1).enumerate().map(|(row, line)| {
            let force: f64 = line.split(',').nth(2).unwrap().parse().unwrap();
            let noise = 3.0 * (104_729.0 * row as f64).sin();
            format!("{line},{:.5},warm,7\n", 0.97 * force + noise)
        });
        let text = format!("t,x,F,U [V],F2,state,seven\n{}", rows.collect::<String>());
        fs::write(folder.join(file), text).unwrap();
    }
}

#[test]
fn a_column_that_the_study_does_not_name_is_taken_as_an_input() {
    let folder = written(None, LINE);
    let folder = folder.path();
    with_more_columns(folder);
    study(folder, "\"stiffness@x\", \"viscous@x\", \"coulomb@x\"", "");
    identify(folder);
    let said = succeed(folder, DIAGNOSE);
    says(&said, &["the column \"U [V]\"", "[[input]]"]);
    let verdict = read_json(folder.join("verdict.json"));
    assert_eq!(verdict["verdict"], "effect", "{verdict}");
    assert_eq!(verdict["found"].as_array().unwrap().len(), 1, "{verdict}");
    assert_eq!(verdict["found"][0]["effect"], "coulomb*U~20ms", "{verdict}");
    assert!(!verdict.to_string().contains("F2"), "{verdict}");

    // The model knows its column again on a study that does not name it.
    let compare = "compare study.toml added.json --json compared.json";
    succeed(folder, compare);
    let error =
        &read_json(folder.join("compared.json"))["records"][1]["axes"]["x"]["relative_error"];
    let said = verdict["staircase"]["steps"][1]["relative_error"]["x"]
        .as_f64()
        .unwrap();
    assert!(
        (error.as_f64().unwrap() / said - 1.0).abs() < 1e-6,
        "{error} {said}"
    );
    // It can be added by hand as well, and a column that is nowhere is told.
    succeed(folder, "add study.toml model.json coulomb*U~20ms@x");
    let sentence = fail(folder, "add study.toml model.json coulomb*W@x", 3);
    says(&sentence, &["\"W\"", "[[input]]"]);
}

#[test]
fn a_column_that_only_tells_the_records_apart_is_no_input() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // The zero of force and the mean of a noisy temperature differ from record to record.
    for (file, seed, zero, warm) in [
        ("one.csv", 0.3, -5.0, 24.9),
        ("more.csv", 0.9, 5.0, 25.3),
        ("two.csv", 1.7, 0.0, 25.1),
    ] {
        let text = record(seed, Some(1.0), LINE);
        let rows = text.lines().skip(1).enumerate().map(|(row, line)| {
            let [t, x, force, _] = line.split(',').collect::<Vec<_>>()[..] else {
                panic!("{line}");
            };
            let force: f64 = force.parse::<f64>().unwrap() + zero;
            let warm = warm + 0.3 * (104_729.0 * row as f64).sin();
            format!("{t},{x},{force:.6},{warm:.3}\n")
        });
        let text = format!("t,x,F,T [degC]\n{}", rows.collect::<String>());
        fs::write(folder.join(file), text).unwrap();
    }
    study(folder, "\"stiffness@x\", \"viscous@x\"", "");
    let text = fs::read_to_string(folder.join("study.toml")).unwrap();
    let more = "[[record]]\nfile = \"more.csv\"\nrole = \"train\"\n[base]";
    fs::write(folder.join("study.toml"), text.replace("[base]", more)).unwrap();
    identify(folder);
    let said = succeed(folder, "diagnose study.toml model.json");
    assert!(
        !said.contains("the column") && said.contains("Missing: coulomb@x. Instrument:"),
        "{said}"
    );
}
