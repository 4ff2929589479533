//! Outputs that would write over what a command reads, or that cannot be written: told before
//! anything is computed, and nothing is touched.

use super::{HEADING, STUDY, refusal, run, write};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

/// A log of a spring with a damper and dry friction that is shaken at two frequencies.
fn log() -> String {
    let line = |row: u32| {
        let t = f64::from(row) * 1e-3;
        let (slow, fast) = (60.0 * t, 97.0 * t + 0.4);
        let x = 2e-4 * slow.sin() + 1e-4 * fast.sin();
        let v = 2e-4 * 60.0 * slow.cos() + 1e-4 * 97.0 * fast.cos();
        let a = -2e-4 * 3600.0 * slow.sin() - 1e-4 * 9409.0 * fast.sin();
        let force = 1.5 * a + 9e3 * x + 3.0 * v + 0.2 * v.signum();
        format!("{t},{x:.9},{:.9},{a:.9},{force:.9}", 2.0 * x)
    };
    let lines = (0..8000).map(line);
    std::iter::once(HEADING.to_owned())
        .chain(lines)
        .collect::<Vec<_>>()
        .join("\n")
}

/// A folder with a study and a model learnt from it.
fn learnt() -> TempDir {
    let folder = TempDir::new().unwrap();
    let study = format!("{STUDY}\n[base]\nterms = [\"stiffness@x\", \"viscous@x\"]\n");
    write(&folder, &study, &log());
    fs::write(folder.path().join("two.csv"), log()).unwrap();
    let identify = ["identify", ".", "--model", "physical", "-o", "model.json"];
    let done = run(folder.path(), &identify);
    assert!(done.status.success(), "{done:?}");
    folder
}

fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let file = |entry: fs::DirEntry| {
        let name = entry.file_name().to_string_lossy().into_owned();
        (name, fs::read(entry.path()).unwrap_or_default())
    };
    files.map(file).collect()
}

/// The command has to end so, in one sentence with all `parts`, before it has printed or touched
/// anything.
fn refused(folder: &Path, arguments: &[&str], code: i32, parts: &[&str]) {
    let before = contents(folder);
    refusal(folder, arguments, code, parts);
    assert_eq!(before, contents(folder), "{arguments:?} touched a file");
}

#[test]
fn what_is_read_is_never_written_over() {
    let folder = learnt();
    let folder = folder.path();
    let add = |output| ["add", ".", "model.json", "coulomb@x", "-o", output];
    refused(folder, &add("model.json"), 2, &["this is read"]);
    refused(folder, &add("./model.json"), 2, &["would be written over"]);
    refused(folder, &add("study.toml"), 2, &["this is read"]);
    refused(folder, &add("two.csv"), 2, &["a record of the study"]);
    let apply = ["diagnose", ".", "model.json", "--apply", "-o", "one.csv"];
    refused(folder, &apply, 2, &["a record of the study"]);
    for command in ["compare", "diagnose"] {
        let json = [command, ".", "model.json", "--json", "model.json"];
        refused(folder, &json, 2, &["this is read"]);
    }
    let both = [&add("new.json")[..], &["--json", "./new.json"]].concat();
    refused(folder, &both, 2, &["same file"]);
    let learn = ["identify", ".", "--model", "physical", "-o", "two.csv"];
    refused(folder, &learn, 2, &["a record of the study"]);
    for words in [
        "export model.json -o model.json",
        "export model.json --study . -o study.toml",
        "sign model.json --development-key -o ./model.json",
        "replay model.json . --json model.json",
        "replay model.json . -o out.csv --frames out.csv",
        "study-from model.json --rig study.toml -o out --json study.toml",
        "monitor model.json --record model.json",
        "inspect model.json --json model.json",
        "merge model.json two.csv -o two.csv",
        "init one.csv -o one.csv",
    ] {
        let words: Vec<&str> = words.split(' ').collect();
        refused(folder, &words, 2, &["; name another"]);
    }
}

#[test]
fn standard_input_and_standard_output_are_not_one_file() {
    let folder = learnt();
    let done = Command::new(env!("CARGO_BIN_EXE_jointwatch"))
        .args(["inspect", "-", "--json", "-"])
        .current_dir(folder.path())
        .stdin(fs::File::open(folder.path().join("two.csv")).unwrap())
        .output()
        .expect("the binary starts");
    assert!(done.status.success(), "{done:?}");
    assert!(done.stdout.starts_with(b"{"), "{done:?}");
}

#[test]
fn where_nothing_can_be_written_is_told_before_anything_is_done() {
    let folder = learnt();
    let folder = folder.path();
    let apply = ["diagnose", ".", "model.json", "--apply"];
    let add = ["add", ".", "model.json", "coulomb@x"];
    let compare = ["compare", ".", "model.json"];
    for command in [&apply[..], &add, &compare] {
        let json = [command, &["--json", "nowhere/said.json"]].concat();
        refused(folder, &json, 1, &["no folder nowhere"]);
    }
    fs::create_dir(folder.join("here")).unwrap();
    for command in [&apply[..], &add] {
        let into = |output| [command, &["-o", output]].concat();
        refused(folder, &into("nowhere/m.json"), 1, &["no folder nowhere"]);
        refused(folder, &into("here"), 1, &["this is a folder"]);
    }
}

#[test]
fn a_study_in_other_units_is_refused_by_all_that_hold_a_model_against_it() {
    let folder = learnt();
    let folder = folder.path();
    let micrometres = STUDY.replace(
        r#"["x3_m", "x2_m"]"#,
        r#"[{ column = "x3_m", unit = "um" }, { column = "x2_m", unit = "um" }]"#,
    );
    fs::write(folder.join("study.toml"), micrometres).unwrap();
    let parts = ["study.toml", "axis x moves by", "unit"];
    for command in ["compare", "diagnose"] {
        refused(folder, &[command, ".", "model.json"], 3, &parts);
    }
    let add = ["add", ".", "model.json", "coulomb@x"];
    refused(folder, &add, 3, &parts);
}

#[test]
fn a_model_with_an_effect_that_is_unknown_is_refused_in_one_sentence() {
    let folder = learnt();
    let folder = folder.path();
    let model = fs::read_to_string(folder.join("model.json")).unwrap();
    fs::write(
        folder.join("model.json"),
        model.replace("viscous", "viscouss"),
    )
    .unwrap();
    let parts = ["model.json", "did you mean \"viscous\"?\n"];
    refused(folder, &["compare", ".", "model.json"], 3, &parts);
}
