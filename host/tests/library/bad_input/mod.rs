//! Every bad study and every bad log gets one sentence that says what, which file, row and column,
//! and what to try.

mod logs;
mod network;
mod outputs;
mod physical;
mod study_file;

use jointwatch::study::Study;
use jointwatch::text::error::{Error, Kind};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

const STUDY: &str = r#"name = "bench"
sample_rate_hz = 1000.0
time = "t_s"

[[axis]]
name = "x"
kind = "translation"
displacement = ["x3_m", "x2_m"]
acceleration = "a2_m_s2"
force = "force_N"
inertia = 1.5
encoder_step = 1e-6

[[record]]
file = "one.csv"
role = "train"

[[record]]
file = "two.csv"
role = "validate"
"#;

const HEADING: &str = "t_s,x2_m,x3_m,a2_m_s2,force_N";
/// A good log: line by line, the heading first.
fn log() -> Vec<String> {
    let rows = (0..700).map(|i| {
        let t = f64::from(i) * 1e-3;
        let w = 60.0 * t;
        format!(
            "{t},{},{:.7},{:.3e},{:.3}",
            1e-4 * w.sin(),
            2e-4 * (w + 0.4).sin(),
            -0.4 * w.sin(),
            3.0 * (w + 1.0).cos()
        )
    });
    std::iter::once(HEADING.to_owned()).chain(rows).collect()
}

/// Runs the program in a folder.
fn run(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_jointwatch"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the binary starts")
}

/// Runs the program in a folder, which it has to refuse with this code, in one sentence with all
/// `parts` and nothing on standard output.
fn refusal(folder: &Path, arguments: &[&str], code: i32, parts: &[&str]) {
    let done = run(folder, arguments);
    let error = String::from_utf8_lossy(&done.stderr).into_owned();
    println!("{error}");
    assert_eq!(done.status.code(), Some(code), "{arguments:?}: {error}");
    assert!(error.starts_with("jointwatch: ") && error.trim_end().lines().count() == 1);
    for part in parts {
        assert!(error.contains(part), "{error:?} lacks {part:?}");
    }
    assert!(done.stdout.is_empty(), "{arguments:?} printed something");
}

fn write(folder: &TempDir, study: &str, one: &str) {
    fs::write(folder.path().join("study.toml"), study).unwrap();
    fs::write(folder.path().join("one.csv"), one).unwrap();
    fs::write(folder.path().join("two.csv"), log().join("\n")).unwrap();
}

fn read(study: &str, one: &str) -> Result<Study, Error> {
    let folder = TempDir::new().unwrap();
    write(&folder, study, one);
    Study::read(folder.path())
}

/// The sentence with which a study is refused; it must be one, of kind `Data`, and contain all
/// `parts`.
fn refused(result: Result<Study, Error>, parts: &[&str]) {
    let error = result.expect_err("this must be refused");
    println!("{error}");
    assert_eq!(error.kind, Kind::Data, "{error}");
    assert_eq!(error.exit_code(), 3);
    assert!(
        !error.sentence.contains('\n') && !error.sentence.ends_with('.'),
        "{error}"
    );
    for part in parts {
        assert!(error.sentence.contains(part), "{error:?} lacks {part:?}");
    }
}
