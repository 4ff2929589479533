//! Ctrl-C during training keeps the best weights so far, also without a terminal.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

const JOINTWATCH: &str = env!("CARGO_BIN_EXE_jointwatch");

/// Whether the process has installed a handler for SIGINT, which is bit 1 of the mask of caught
/// signals.
fn listens(pid: u32) -> bool {
    let status = fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let mask = status.lines().find_map(|l| l.strip_prefix("SigCgt:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .is_some_and(|mask| mask & 2 != 0)
}

/// Exit code, standard output and standard error of a training that takes minutes, interrupted some
/// time after it began to listen.
fn interrupted(study: &Path, model: &Path, wait: Duration) -> (Option<i32>, String, String) {
    let child = Command::new(JOINTWATCH)
        .arg("identify")
        .arg(study)
        .args(["--model", "network", "--restarts", "1000", "-o"])
        .arg(model)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary starts");
    while !listens(child.id()) {
        sleep(Duration::from_millis(10));
    }
    sleep(wait);
    let sent = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status();
    assert!(sent.expect("kill runs").success());
    let output = child.wait_with_output().expect("it ends");
    (
        output.status.code(),
        String::from_utf8_lossy(&output.stdout).into_owned(),
        String::from_utf8_lossy(&output.stderr).into_owned(),
    )
}

#[test]
fn ctrl_c_keeps_the_best_weights_and_says_so() {
    let folder = tempfile::TempDir::new().unwrap();
    let (study, model) = (
        folder.path().join("study"),
        folder.path().join("model.json"),
    );
    let simulated = Command::new(JOINTWATCH)
        .args(["simulate", "--quiet", "--duration", "12", "--out"])
        .arg(&study)
        .status();
    assert!(simulated.expect("the binary starts").success());
    // On a busy machine there may be no weights yet; then nothing may be written, and a later
    // interruption is tried.
    for attempt in 0..8 {
        let wait = Duration::from_millis(500 << attempt);
        let (code, said, error) = interrupted(&study, &model, wait);
        println!("after {wait:?}: {code:?}\n{said}{error}");
        if code == Some(0) {
            assert!(said.contains("gave up when interrupted"), "{said}");
            assert!(
                said.contains(
                    "Warning: training was interrupted; these are the best weights so far"
                )
            );
            let read = jointwatch::model::file::ModelFile::read(&model).unwrap();
            assert!(read.warnings.iter().any(|w| w.contains("interrupted")));
            assert_eq!(error, "");
            return;
        }
        assert_eq!(code, Some(1));
        assert!(
            error.contains("before there were weights to keep"),
            "{error}"
        );
        assert!(!model.exists());
    }
    panic!("no weights in a minute of training");
}
