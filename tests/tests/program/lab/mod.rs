//! The lab's server: its numbers are the command line's, what runs can be ended, and nobody without
//! the token changes anything.

mod guard;
mod live;

use jointwatch_tests::lab::Lab;
use jointwatch_tests::program::{fail, succeed};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A one-axis rig with dry friction that its study does not list, and its base model.
fn rig() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let run = |words: &str| succeed(folder.path(), words);
    run("simulate --out rig --axes 1 --hidden coulomb@x --share 0.15 --duration 4 --seed 5");
    run("identify rig --model physical -o rig/base.json");
    let rig = folder.path().join("rig");
    (folder, rig)
}

fn read_json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// All files of a folder with what is in them.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => found.extend(files(&path)),
            false => drop(found.insert(path.clone(), fs::read(&path).unwrap())),
        }
    }
    found
}

#[test]
fn the_loop_gives_the_numbers_of_the_command_line() {
    let (_folder, rig) = rig();
    let cli = |words: &str| succeed(&rig, words);
    let lab = Lab::start(&rig, &["study.toml", "base.json"]);
    let state = lab.rest();
    assert_eq!(state["current"], "base.json");

    // Compare: every record's figures.
    cli("compare study.toml base.json --json compared.json");
    let compared = read_json(&rig.join("compared.json"));
    let drawn = lab.view(&state);
    for (record, shown) in compared["records"]
        .as_array()
        .unwrap()
        .iter()
        .zip(drawn["records"].as_array().unwrap())
    {
        for figure in ["nmse_percent", "relative_error", "peak_error"] {
            assert_eq!(
                record["axes"]["x"][figure], shown["axes"][0]["versions"][0][figure],
                "{figure}"
            );
        }
    }

    // Diagnose, told to a page that waits.
    let seen = state["revision"].as_u64().unwrap();
    let waiting = std::thread::scope(|scope| {
        let other = scope.spawn(|| lab.state(seen));
        std::thread::sleep(Duration::from_millis(200));
        assert_eq!(lab.act(&json!({ "do": "diagnose" })).0, 200);
        other.join().unwrap()
    });
    assert_eq!(
        waiting["job"]["command"],
        "jointwatch diagnose study.toml base.json"
    );
    let (code, sentence) = lab.act(&json!({ "do": "export" }));
    assert!(
        code == 409 && sentence.contains("still runs"),
        "{code} {sentence}"
    );
    let state = lab.rest();
    cli("diagnose study.toml base.json --json diagnosed.json");
    let diagnosed = read_json(&rig.join("diagnosed.json"));
    for key in ["verdict", "found", "relative_error_after", "noise_floor"] {
        assert_eq!(state["diagnosis"][key], diagnosed[key], "{key}");
    }
    assert_eq!(lab.view(&state)["candidates"][0]["name"], "coulomb@x");

    // Add, undo, add again.
    let state = lab.done(&json!({ "do": "add", "effects": ["coulomb@x"] }));
    let added = "jointwatch-lab/base-coulomb-x.json";
    assert_eq!(state["current"], added);
    cli("add study.toml base.json coulomb@x -o added.json --quiet");
    assert_eq!(
        read_json(&rig.join(added)),
        read_json(&rig.join("added.json"))
    );
    let steps = lab.view(&state)["axes"][0]["steps"].clone();
    assert!(
        steps[1]["error"].as_f64().unwrap() < 0.1 * steps[0]["error"].as_f64().unwrap(),
        "{steps}"
    );
    let last = |state: &Value| state["done"].as_array().unwrap().last().unwrap().clone();
    assert_eq!(
        last(&state)["command"],
        format!("jointwatch add study.toml base.json coulomb@x -o {added}")
    );
    let state = lab.done(&json!({ "do": "undo" }));
    assert_eq!(state["current"], "base.json");
    assert!(
        !state["diagnosis"].is_null(),
        "what was said of it is still known"
    );
    let beside = json!({ "do": "show", "model": added, "beside": "base.json" });
    let state = lab.done(&beside);
    assert_eq!(lab.view(&state)["versions"], json!(["before", "after"]));

    // What is kept: blob, model, report.
    let state = lab.done(&json!({ "do": "export" }));
    assert!(last(&state)["done"].as_bool().unwrap(), "{}", last(&state));
    cli("export added.json -o wanted.bin");
    let kept = |what: &str| lab.request("GET", &format!("/api/download/{what}"), &[], b"");
    assert_eq!(
        kept("blob"),
        (200, fs::read(rig.join("wanted.bin")).unwrap())
    );
    assert_eq!(kept("model"), (200, fs::read(rig.join(added)).unwrap()));
    let (code, page) = kept("report");
    assert!(
        code == 200 && page.starts_with(b"<!doctype html>"),
        "{code}"
    );
    let state = lab.done(&json!({ "do": "replay", "record": "valid.csv" }));
    let said = last(&state)["said"].as_str().unwrap().to_string();
    assert_eq!(
        said,
        cli("replay wanted.bin study.toml --record valid.csv").trim()
    );
    let state = lab.done(&json!({ "do": "add", "effects": ["cubic_hardening@x"] }));
    assert_eq!(
        last(&state)["useless"],
        json!(["cubic_hardening@x"]),
        "{}",
        last(&state)
    );
    assert_eq!(state["current"], added);
    assert!(
        !rig.join("jointwatch-lab/.contents.json").exists(),
        "nothing is left lying about"
    );
}

#[test]
fn what_runs_can_be_ended_and_leaves_nothing() {
    let (_folder, rig) = rig();
    let lab = Lab::start(&rig, &["."]);
    let state = lab.rest();
    let before = files(&rig);
    assert_eq!(
        lab.act(&json!({ "do": "identify", "kind": "network" })).0,
        200
    );
    std::thread::sleep(Duration::from_millis(300));
    let begun = Instant::now();
    assert_eq!(lab.act(&json!({ "do": "cancel" })).0, 200);
    let after = lab.rest();
    assert!(
        begun.elapsed() < Duration::from_secs(3),
        "{:?}",
        begun.elapsed()
    );
    let last = after["done"].as_array().unwrap().last().unwrap().clone();
    assert_eq!(
        (&last["said"], &last["done"]),
        (&json!("Cancelled"), &json!(false))
    );
    assert_eq!(after["models"], state["models"]);
    assert_eq!(files(&rig), before);
}

#[test]
fn a_study_that_cannot_be_read_is_told_in_its_own_sentence_and_read_again() {
    let (_folder, rig) = rig();
    let log = rig.join("valid.csv");
    let whole = fs::read_to_string(&log).unwrap();
    let broken = whole.replacen("\n0.1,", "\nnan,", 1);
    fs::write(
        &log,
        if broken == whole {
            whole.replacen(",", ",x", 9)
        } else {
            broken
        },
    )
    .unwrap();
    let sentence = fail(&rig, &["compare", "study.toml", "base.json"], 3);
    let lab = Lab::start(&rig, &["study.toml"]);
    let state = lab.rest();
    assert_eq!(state["opened"], "wrong");
    let told = state["sentence"].as_str().unwrap();
    // The command was given the path as study.toml, the lab has it whole.
    let end = sentence.trim().split_once("valid.csv").unwrap().1;
    assert!(
        told.ends_with(end.trim_end_matches('.')),
        "{told}\n{sentence}"
    );
    fs::write(&log, whole).unwrap();
    let state = lab.done(&json!({ "do": "reopen" }));
    assert_eq!(
        (&state["opened"], &state["current"]),
        (&json!("study"), &json!("base.json"))
    );
}

#[test]
fn a_dropped_log_becomes_the_study_that_init_writes() {
    let (_folder, rig) = rig();
    let [cli, here] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let folders = [cli.path().join("bench"), here.path().join("bench")];
    folders.iter().for_each(|f| fs::create_dir(f).unwrap());
    let log = fs::read(rig.join("train_x.csv")).unwrap();
    fs::write(folders[0].join("run.csv"), &log).unwrap();
    succeed(&folders[0], &["init", "--yes", "--inertia=1.5", "run.csv"]);

    let lab = Lab::start(&folders[1], &[]);
    assert_eq!(lab.rest()["opened"], "missing");
    let put =
        |name: &str, bytes: &[u8]| lab.request("PUT", &format!("/api/log/{name}"), &[], bytes);
    for name in [
        "..%2Frun.csv",
        "%2Fetc%2Frun.csv",
        "study.toml",
        ".run.csv",
        "a%00.csv",
    ] {
        let (code, body) = put(name, &log);
        assert!(
            code >= 400,
            "{name}: {code} {}",
            String::from_utf8_lossy(&body)
        );
    }
    assert_eq!(put("empty.csv", b"").0, 422);
    let (code, body) = put("photo.csv", &[0xff, 0xd8, 0xff, 0xe0, 0, 1, 2, 3]);
    assert!(code == 422, "{code} {}", String::from_utf8_lossy(&body));
    assert!(
        files(here.path()).is_empty(),
        "what cannot be read is not kept"
    );
    assert_eq!(put("run.csv", &log).0, 200);
    assert_eq!(put("run.csv", b"other").0, 409, "a log is not written over");
    let state = lab.rest();
    assert_eq!(state["drafted"], true);
    let (code, draft) = lab.request("GET", "/api/draft", &[], b"");
    let draft: Value = serde_json::from_slice(&draft).unwrap();
    assert_eq!((code, &draft["logs"][0]["file"]), (200, &json!("run.csv")));
    lab.done(&json!({ "do": "draft", "inertia": 1.5 }));
    let state = lab.done(&json!({ "do": "init", "inertia": 1.5 }));
    assert_eq!(state["opened"], "study", "{state}");
    let text = |folder: &Path| fs::read_to_string(folder.join("study.toml")).unwrap();
    assert_eq!(text(&folders[0]), text(&folders[1]));
    assert_eq!(put("more.csv", &log).0, 409, "a study has its records");
}

#[test]
fn wrong_uses_are_one_sentence() {
    let (folder, rig) = rig();
    let sentence = fail(folder.path(), &["lab", "nowhere"], 1);
    assert!(sentence.contains("nowhere is not there"), "{sentence}");
    let sentence = fail(&rig, &["lab", "train_x.csv"], 2);
    assert!(sentence.contains("study.toml already"), "{sentence}");
    let sentence = fail(&rig, &["lab", "study.toml", "none.json"], 1);
    assert!(sentence.contains("none.json"), "{sentence}");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let sentence = fail(&rig, &["lab", "study.toml", "--port", &port], 1);
    assert!(sentence.contains("--port"), "{sentence}");
}
