//! What shells and editors get: completions, man pages, examples in every help, and a schema of
//! study.toml that names its keys.

use jointwatch::study::Study;
use jointwatch_tests::program::{jointwatch, says, succeed, workspace};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;

/// The keys that a table of study.toml may have, as the reader lists them when it meets another.
fn known(text: &str) -> BTreeSet<String> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("study.toml"), text).unwrap();
    let said = Study::read(folder.path()).unwrap_err().sentence;
    let (_, keys) = said
        .split_once("choose from ")
        .unwrap_or_else(|| panic!("{said}"));
    keys.split(", ").map(str::to_owned).collect()
}

#[test]
fn the_schema_has_the_keys_that_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let printed = succeed(folder.path(), &["study", "--schema"]);
    let schema: Value = serde_json::from_str(&printed).unwrap();
    let axis = "[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = \"x\"\n";
    let tables = [
        (&schema, "qqqqqqqqqqqq = 1\n".to_owned()),
        (
            &schema["$defs"]["time"],
            "time = { qqqqqqqqqqqq = 1 }\n".to_owned(),
        ),
        (
            &schema["$defs"]["axis"],
            "[[axis]]\nqqqqqqqqqqqq = 1\n".to_owned(),
        ),
        (
            &schema["$defs"]["channel"],
            format!("{axis}force = {{ qqqqqqqqqqqq = 1 }}\n"),
        ),
        (
            &schema["$defs"]["record"],
            "[[record]]\nqqqqqqqqqqqq = 1\n".to_owned(),
        ),
        (
            &schema["$defs"]["base"],
            "[base]\nqqqqqqqqqqqq = 1\n".to_owned(),
        ),
    ];
    for (table, text) in tables {
        let described: BTreeSet<String> = table["properties"]
            .as_object()
            .unwrap()
            .keys()
            .cloned()
            .collect();
        assert_eq!(described, known(&text), "{text}");
    }
    let explained = succeed(folder.path(), &["study"]);
    for key in [
        "resample_hz",
        "restoring_force",
        "encoder_step",
        "role (needed)",
        "terms",
    ] {
        assert!(explained.contains(key), "{key} is missing in {explained}");
    }
}

#[test]
fn shells_and_man_get_every_command() {
    let folder = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = succeed(folder.path(), &["completions", shell]);
        assert!(
            script.contains("identify") && script.contains("model"),
            "{shell}"
        );
    }
    succeed(folder.path(), &["manual", "-o", "man1"]);
    let whole = fs::read_to_string(folder.path().join("man1/jointwatch.1")).unwrap();
    says(&whole, &[".TH", "diagnose"]);
    let one = fs::read_to_string(folder.path().join("man1/jointwatch-changed.1")).unwrap();
    says(&one, &["old model", "Examples"]);
    for words in [
        ["identify", "--help"],
        ["help", "study"],
        ["help", "changed"],
    ] {
        let help = succeed(folder.path(), &words);
        says(&help, &["Examples:", "  jointwatch "]);
    }
}

#[test]
fn a_log_comes_through_a_pipe() {
    let log = workspace().join("tests/data/logs/german.csv");
    let piped = std::process::Command::new(jointwatch())
        .args(["inspect", "-"])
        .stdin(fs::File::open(&log).unwrap())
        .output()
        .unwrap();
    let said = String::from_utf8(piped.stdout).unwrap();
    let named = succeed(log.parent().unwrap(), &["inspect", "german.csv"]);
    assert_eq!(said.replacen('-', "german.csv", 1), named);
}

#[test]
fn a_model_and_a_draft_go_into_a_pipe() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    succeed(here, "simulate --out rig --axes 1 --duration 2");
    let learn = ["identify", "rig", "--model", "physical", "--quiet", "-o"];
    let piped = succeed(here, &[&learn[..], &["-"]].concat());
    succeed(here, &[&learn[..], &["model.json"]].concat());
    assert_eq!(piped, fs::read_to_string(here.join("model.json")).unwrap());
    let drafted = ["init", "--yes", "--quiet", "rig/train_x.csv", "-o", "-"];
    assert!(succeed(here, &drafted).contains("[[axis]]"));
    assert!(!here.join("-").exists());
}
