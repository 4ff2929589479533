//! What `identify --model network` refuses: one sentence, an exit code, nothing written.

use super::{HEADING, STUDY, log, refusal, run, write};
use tempfile::TempDir;

/// Runs `identify` on a study with this first record; it must be refused in a sentence of our own.
fn said(one: &str, arguments: &[&str], exit: i32, parts: &[&str]) {
    let folder = TempDir::new().unwrap();
    write(&folder, STUDY, one);
    let all = [&["identify", ".", "-o", "model.json"], arguments].concat();
    refusal(folder.path(), &all, exit, parts);
    assert!(!folder.path().join("model.json").exists());
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
        let folder = TempDir::new().unwrap();
        write(&folder, STUDY, &good);
        let identify = ["identify", ".", "-o", "model.json", "--model", "network"];
        let done = run(folder.path(), &[&identify[..], &option].concat());
        assert_eq!(done.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&done.stderr).contains(option[0]));
        assert!(!folder.path().join("model.json").exists());
    }
}
