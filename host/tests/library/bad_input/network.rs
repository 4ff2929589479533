//! What `identify --model network` refuses: one sentence, an exit code, nothing written.

use super::{HEADING, STUDY, log, write};
use std::process::Command;
use tempfile::TempDir;

/// Runs `identify` on a study with this first record, and returns what it said when it was refused.
fn refused(one: &str, arguments: &[&str], exit: i32) -> String {
    let folder = TempDir::new().unwrap();
    write(&folder, STUDY, one);
    let model = folder.path().join("model.json");
    let output = Command::new(env!("CARGO_BIN_EXE_jointwatch"))
        .arg("identify")
        .arg(folder.path())
        .args(arguments)
        .arg("-o")
        .arg(&model)
        .output()
        .expect("the binary starts");
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    println!("{error}");
    assert_eq!(output.status.code(), Some(exit), "{error}");
    assert!(!model.exists());
    error
}

/// The same, in one sentence of our own.
fn said(one: &str, arguments: &[&str], exit: i32, parts: &[&str]) {
    let error = refused(one, arguments, exit);
    assert!(error.starts_with("jointwatch: ") && error.trim_end().lines().count() == 1);
    for part in parts {
        assert!(error.contains(part), "{error:?} lacks {part:?}");
    }
}

const NETWORK: [&str; 2] = ["--model", "network"];

#[test]
fn rows_that_cannot_be_learnt_from() {
    let good = log().join("\n");
    let many = ["--model", "network", "--neurons", "150"];
    said(
        &good,
        &many,
        3,
        &[
            "training rows cannot determine the 601 weights of 150 neurons",
            "fewer --neurons",
        ],
    );
    // A force that is inertia·acceleration and an offset: the joint's own force is the same
    // everywhere.
    let free: Vec<String> = log()
        .iter()
        .map(|line| match line.split(',').collect::<Vec<_>>()[..] {
            [t, x2, x3, a, _] if line != HEADING => {
                let force = 1.5 * a.parse::<f64>().unwrap() + 2.5;
                format!("{t},{x2},{x3},{a},{force}")
            }
            _ => line.clone(),
        })
        .collect();
    let parts = ["axis x", "2.500 N", "nothing to learn"];
    said(&free.join("\n"), &NETWORK, 3, &parts);
}

#[test]
fn options_of_the_other_kind_of_model() {
    let good = log().join("\n");
    for option in [["--neurons", "10"], ["--restarts", "2"], ["--seed", "7"]] {
        let arguments = ["--model", "polynomial", option[0], option[1]];
        said(&good, &arguments, 2, &[option[0], "--model network"]);
    }
    for option in [["--order", "3,3"], ["--fit", "ridge"]] {
        let arguments = ["--model", "network", option[0], option[1]];
        said(&good, &arguments, 2, &[option[0], "--model polynomial"]);
    }
}

#[test]
fn options_out_of_range() {
    let good = log().join("\n");
    for option in [
        ["--neurons", "0"],
        ["--neurons", "201"],
        ["--neurons", "many"],
        ["--restarts", "0"],
        ["--seed", "one"],
    ] {
        let arguments = ["--model", "network", option[0], option[1]];
        assert!(refused(&good, &arguments, 2).contains(option[0]));
    }
}
