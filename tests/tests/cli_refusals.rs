//! What the command line refuses, with which exit code, in one sentence, leaving nothing behind.

use jointwatch_tests::program::{fail, run};
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
            &["identify", "rig", "--model", "polynomial", "-o", "m.json"],
            3,
        );
        for part in wanted {
            assert!(sentence.contains(part), "{part} is missing in {sentence}");
        }
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
