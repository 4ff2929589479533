//! What the command line refuses, with which exit code, in one sentence, leaving nothing behind.

use jointwatch_tests::program::{fail, run, says};
use jointwatch_tests::story::{copy_of_rig, story};
use std::fs;

#[test]
fn damaged_models_and_blobs_are_refused_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let rig = story().join("rig");
    let rig = rig.to_str().unwrap();
    let blob = fs::read(story().join("model.bin")).unwrap();
    let spoil = |bytes: &[u8]| fs::write(folder.path().join("bad.bin"), bytes).unwrap();

    spoil(&blob[..4095]);
    assert!(fail(folder.path(), &["inspect", "bad.bin"], 3).contains("4095"));
    let mut flipped = blob.clone();
    flipped[1234] ^= 4;
    spoil(&flipped);
    assert!(fail(folder.path(), &["replay", "bad.bin", rig], 3).contains("checksum"));
    spoil(&[]);
    assert!(fail(folder.path(), &["inspect", "bad.bin"], 3).contains("bad.bin"));
    assert!(fail(folder.path(), &["inspect", "missing.bin"], 3).contains("missing.bin"));

    let model = fs::read_to_string(story().join("model.json")).unwrap();
    fs::write(folder.path().join("cut.json"), &model[..model.len() / 2]).unwrap();
    assert!(fail(folder.path(), &["export", "cut.json"], 3).contains("line"));
    fs::write(
        folder.path().join("old.json"),
        model.replace("jointwatch-model/2", "jointwatch-model/0"),
    )
    .unwrap();
    assert!(fail(folder.path(), &["compare", rig, "old.json"], 3).contains("jointwatch-model/0"));
    assert!(!folder.path().join("model.bin").exists());
}

/// A copy of the rig with one cell of a training record multiplied; the study's folder, the
/// record's name, the column's name and the line.
fn with_wrong_cell(folder: &std::path::Path, factor: f64) -> (String, String, usize) {
    let rig = copy_of_rig(folder);
    let record = rig.join("train_x.csv");
    let text = fs::read_to_string(&record).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let heading = lines
        .iter()
        .position(|line| line.contains("force_N"))
        .unwrap();
    let column = lines[heading]
        .split(',')
        .position(|c| c.trim() == "force_N")
        .unwrap();
    let cell = |line: &str| {
        line.split(',')
            .nth(column)
            .unwrap()
            .trim()
            .parse::<f64>()
            .unwrap()
    };
    let values: Vec<f64> = lines[heading + 1..].iter().map(|line| cell(line)).collect();
    let rms = (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
    let row = 500 + values[500..].iter().position(|v| v.abs() > rms).unwrap();
    let line = heading + 1 + row;
    let mut cells: Vec<String> = lines[line].split(',').map(str::to_owned).collect();
    cells[column] = format!("{:e}", values[row] * factor);
    lines[line] = cells.join(",");
    fs::write(&record, lines.join("\n") + "\n").unwrap();
    let name = record.file_name().unwrap().to_str().unwrap().to_owned();
    (name, "force_N".into(), line + 1)
}

#[test]
fn one_wrong_digit_is_refused_and_one_wrong_sign_is_said_with_file_row_and_column() {
    let learn = ["identify", "rig", "--model", "polynomial", "-o", "m.json"];
    for (factor, is_refused) in [(1e8, true), (-1.0, false)] {
        let folder = tempfile::tempdir().unwrap();
        let (file, column, line) = with_wrong_cell(folder.path(), factor);
        let said = if is_refused {
            fail(folder.path(), &learn, 3)
        } else {
            jointwatch_tests::program::succeed(folder.path(), &learn)
        };
        let row = format!("row {line} (line of the file)");
        for part in [file.as_str(), &row, &column, "stands alone"] {
            assert!(said.contains(part), "{factor}: {part} is missing in {said}");
        }
        assert_eq!(folder.path().join("m.json").exists(), !is_refused);
    }
}

#[cfg(unix)]
#[test]
fn pipes_lines_without_end_and_commands_to_the_terminal_are_refused_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let rig = copy_of_rig(folder.path());
    let learn = ["identify", "rig", "--model", "polynomial", "-o", "m.json"];
    let record = rig.join("train_x.csv");
    assert!(record.exists());
    fs::remove_file(&record).unwrap();
    let made = std::process::Command::new("mkfifo").arg(&record).status();
    assert!(made.unwrap().success());
    assert!(fail(folder.path(), &learn, 3).contains("pipe or a device"));
    assert!(fail(folder.path(), &["inspect", "rig/train_x.csv"], 3).contains("pipe or a device"));
    fs::remove_file(&record).unwrap();
    fs::write(&record, "0,".repeat(10_000_000)).unwrap();
    let said = fail(folder.path(), &learn, 3);
    assert!(
        said.len() < 5000 && said.contains("longer than"),
        "{}",
        said.len()
    );
    fs::write(&record, "t_s,\u{1b}[2J_N\n0,1\n1,2\n").unwrap();
    let said = fail(folder.path(), &learn, 3);
    assert!(!said.contains('\u{1b}'), "{said:?}");
    let said = fail(folder.path(), &["inspect", "\u{1b}[31mred.bin"], 3);
    assert!(
        !said.contains('\u{1b}') && said.contains("red.bin"),
        "{said:?}"
    );
}

#[test]
fn bad_studies_end_with_three_and_leave_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let rig = copy_of_rig(folder.path());
    let study = rig.join("study.toml");
    let good = fs::read_to_string(&study).unwrap();
    let refused = |text: String, wanted: &[&str]| {
        fs::write(&study, text).unwrap();
        let sentence = fail(
            folder.path(),
            "identify rig --model polynomial -o m.json",
            3,
        );
        says(&sentence, wanted);
        assert!(!folder.path().join("m.json").exists());
    };
    refused(
        good.replace("force_N", "forse_N"),
        &["train", "forse_N", "force_N"],
    );
    refused(
        good.replace("role = \"validate\"", "role = \"valid\""),
        &["valid", "validate"],
    );
    refused(good.replace("name = \"phi\"", "name = \"x\""), &["x"]);
    refused(
        good.replace("role = \"train\"", "role = \"validate\""),
        &["train"],
    );
    fs::write(&study, &good).unwrap();
    let log = rig.join("valid.csv");
    let text = fs::read_to_string(&log).unwrap();
    let mut lines: Vec<&str> = text.lines().collect();
    let invalidated = lines[500].replacen(',', ",nan,", 1);
    lines[500] = &invalidated;
    fs::write(&log, lines.join("\n")).unwrap();
    refused(good.clone(), &["valid.csv", "501"]);
    assert!(fail(folder.path(), &["compare", "nowhere", "m.json"], 3).contains("m.json"));
}

#[test]
fn wrong_use_ends_with_two() {
    for arguments in [
        &["identifi"][..],
        &["identify", "rig"],
        &["identify", "rig", "--model", "polinomial"],
        &["identify", "rig", "--model", "polynomial", "--order", "4,1"],
        &["simulate", "--out", "x", "--axes", "3"],
        &["simulate", "--out", "x", "--snr-db", "loud"],
        &["inspect"],
    ] {
        let output = run(story(), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    }
    assert!(!story().join("x").exists());
}

#[test]
fn a_study_of_another_joint_is_refused_for_models_and_blobs_alike() {
    let folder = tempfile::tempdir().unwrap();
    let study = copy_of_rig(folder.path()).join("study.toml");
    let good = fs::read_to_string(&study).unwrap();
    let file = |name: &str| story().join(name).to_str().unwrap().to_owned();
    let (model, blob) = (file("model.json"), file("model.bin"));
    for (from, to, wanted) in [
        (
            "kind = \"rotation\"",
            "kind = \"translation\"",
            "phi (rotation)",
        ),
        ("name = \"phi\"", "name = \"theta\"", "theta (rotation)"),
    ] {
        // The base terms name the axis too; they are not what this test is about.
        let (other, _) = good.split_once("[base]").unwrap();
        fs::write(&study, other.replace(from, to)).unwrap();
        for arguments in [["compare", "rig", &model], ["replay", &blob, "rig"]] {
            let sentence = fail(folder.path(), &arguments, 3);
            assert!(sentence.contains(wanted), "{sentence}");
        }
    }
}
