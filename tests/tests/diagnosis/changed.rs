//! What changed in a joint since its model was made: parameters, effects, errors; and records are
//! known again by their hash.

use jointwatch_tests::program::{copy_folder, fail, json, read_json, says, succeed};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::sync::LazyLock;
use tempfile::TempDir;

fn simulate(folder: &Path, out: &str, more: &[&str]) {
    let all = ["simulate", "--out", out, "--axes", "1", "--duration", "4"];
    succeed(folder, &[&all, more].concat());
}

/// A folder with the records and the model of a joint as it was.
fn before() -> TempDir {
    static MADE: LazyLock<TempDir> = LazyLock::new(|| {
        let folder = tempfile::tempdir().unwrap();
        simulate(folder.path(), "then", &["--seed", "1"]);
        let identify = ["identify", "then", "--model", "physical", "-o", "old.json"];
        succeed(folder.path(), &identify);
        folder
    });
    let folder = tempfile::tempdir().unwrap();
    copy_folder(MADE.path(), folder.path()).unwrap();
    folder
}

fn changed(folder: &Path, more: &[&str]) -> Value {
    json(folder, &[&["changed", "old.json"], more].concat())
}

fn parameter<'a>(changed: &'a Value, name: &str) -> &'a Value {
    let mut all = changed["parameters"].as_array().unwrap().iter();
    all.find(|p| p["name"] == name).unwrap()
}

#[test]
fn another_run_of_the_same_joint_has_not_changed() {
    let folder = before();
    simulate(folder.path(), "now", &["--seed", "2"]);
    let said = changed(folder.path(), &["now"]);
    assert_eq!(said["came"].as_array().unwrap().len(), 0, "{said}");
    assert_eq!(said["errors"][0]["grew"], false, "{said}");
    for p in said["parameters"].as_array().unwrap() {
        assert_eq!(p["counts"], false, "{p}");
    }
    let words = succeed(folder.path(), &["changed", "old.json", "now"]);
    assert!(words.contains("Nothing has changed"), "{words}");
}

#[test]
fn a_stiffer_joint_is_told_with_its_figures_and_shown() {
    let folder = before();
    simulate(folder.path(), "now", &["--seed", "2", "--vary", "3"]);
    let said = changed(folder.path(), &["now"]);
    let truth = read_json(folder.path().join("now/truth/truth.json"));
    let wanted = truth["rig"]["joint"]["stiffness"][0].as_f64().unwrap();
    let stiffness = parameter(&said, "stiffness");
    let found = stiffness["new"].as_f64().unwrap();
    println!(
        "stiffness {} to {found} N/m, truth {wanted}",
        stiffness["old"]
    );
    assert!((found / wanted - 1.0).abs() < 0.02, "{stiffness}");
    assert_eq!(stiffness["counts"], true, "{stiffness}");
    assert_eq!(said["errors"][0]["grew"], true, "{said}");
    let report = ["changed", "old.json", "now", "--report", "page.html"];
    let words = succeed(folder.path(), &report);
    says(
        &words,
        &[
            "Changed: ",
            "stiffness of stiffness@x by",
            "Report written to page.html",
        ],
    );
    let page = fs::read_to_string(folder.path().join("page.html")).unwrap();
    let sentence = words.lines().find(|l| l.starts_with("Changed: ")).unwrap();
    let shown = sentence.split(';').next().unwrap();
    assert!(page.contains(shown.trim_end_matches('.')), "{sentence}");
    assert!(page.contains("\"versions\":[\"before\",\"after\"]"));
    // No report over the study.
    let over = ["changed", "old.json", "now", "--report", "now/study.toml"];
    let said = fail(folder.path(), &over, 2);
    assert!(said.contains("would be written over"), "{said}");
}

#[test]
fn an_effect_that_came_is_named_and_so_is_one_that_went() {
    let folder = before();
    let hidden = ["--seed", "2", "--hidden", "coulomb@x"];
    simulate(folder.path(), "now", &hidden);
    let said = changed(folder.path(), &["now"]);
    assert_eq!(said["came"], serde_json::json!(["coulomb@x"]), "{said}");
    // With a model of the joint as it is now, what it has more and less is what came and went.
    let added = ["add", "now", "old.json", "coulomb@x", "-o", "new.json"];
    succeed(folder.path(), &added);
    let said = changed(folder.path(), &["now", "new.json"]);
    assert_eq!(said["came"], serde_json::json!(["coulomb@x"]), "{said}");
    fs::rename(
        folder.path().join("new.json"),
        folder.path().join("tmp.json"),
    )
    .unwrap();
    fs::rename(
        folder.path().join("old.json"),
        folder.path().join("new.json"),
    )
    .unwrap();
    fs::rename(
        folder.path().join("tmp.json"),
        folder.path().join("old.json"),
    )
    .unwrap();
    simulate(folder.path(), "later", &["--seed", "3"]);
    let said = changed(folder.path(), &["later", "new.json"]);
    assert_eq!(said["went"], serde_json::json!(["coulomb@x"]), "{said}");
}

#[test]
fn records_are_known_again_whatever_they_are_called() {
    let folder = before();
    let said = fail(folder.path(), &["changed", "old.json", "then"], 3);
    assert!(said.contains("nothing can have changed"), "{said}");
    // One old record under another name beside new ones is left out.
    simulate(folder.path(), "now", &["--seed", "2"]);
    let path = |name: &str| folder.path().join(name);
    fs::copy(path("then/train_x.csv"), path("now/another.csv")).unwrap();
    let study = fs::read_to_string(path("now/study.toml")).unwrap();
    let more = "[[record]]\nfile = \"another.csv\"\nrole = \"validate\"\n\n[base]";
    fs::write(path("now/study.toml"), study.replace("[base]", more)).unwrap();
    let said = changed(folder.path(), &["now"]);
    let records = said["records"].as_array().unwrap();
    let seen: Vec<&Value> = records.iter().filter(|r| !r["seen_as"].is_null()).collect();
    assert_eq!(seen.len(), 1, "{said}");
    assert_eq!(
        (&seen[0]["file"], &seen[0]["seen_as"]),
        (&"another.csv".into(), &"train".into())
    );
}

#[test]
fn a_study_of_validation_records_alone_is_compared_and_not_learnt_from() {
    let folder = before();
    simulate(folder.path(), "now", &["--seed", "2"]);
    let path = folder.path().join("now/study.toml");
    let study = fs::read_to_string(&path).unwrap();
    fs::write(&path, study.replace("\"train\"", "\"validate\"")).unwrap();
    succeed(folder.path(), &["compare", "now", "old.json"]);
    succeed(folder.path(), &["export", "old.json", "-o", "old.bin"]);
    succeed(folder.path(), &["replay", "old.bin", "now"]);
    let said = changed(folder.path(), &["now"]);
    assert!(parameter(&said, "stiffness")["new"].as_f64().is_some());
    let refused = fail(folder.path(), "identify now --model physical", 3);
    assert!(refused.contains("role = \"train\""), "{refused}");
}
