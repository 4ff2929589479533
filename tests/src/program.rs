//! The `jointwatch` program as a user runs it: built once, then called as a process of its own.

use serde_json::Value;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;
use tempfile::TempDir;

/// The program's file, built in release through the cargo that runs the tests.
///
/// It is built as `cargo test --workspace` builds it, for a test of its own package: another choice
/// of packages would have other features in the dependencies, and everything would be built once
/// more.
///
/// # Panics
/// When it does not build: no test of it can then mean anything.
pub fn jointwatch() -> &'static Path {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let built = Command::new(cargo)
            .current_dir(workspace())
            .args(["test", "--release", "--workspace", "--no-run"])
            .args(["--test", "library", "--message-format", "json"])
            .output()
            .expect("cargo starts");
        assert!(
            built.status.success(),
            "{}",
            String::from_utf8_lossy(&built.stderr)
        );
        let messages = String::from_utf8_lossy(&built.stdout);
        let program = messages.lines().find_map(|line| {
            let message: serde_json::Value = serde_json::from_str(line).ok()?;
            let target = &message["target"];
            let is_program = target["kind"][0] == "bin" && target["name"] == "jointwatch";
            let file = message["executable"].as_str()?;
            is_program.then(|| PathBuf::from(file))
        });
        program.expect("cargo says where it put the program")
    })
}

/// The folder that holds the whole project.
pub fn workspace() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("the tests lie in the workspace")
}

/// The words of a command line: one text with spaces between them, or a list where one of them may
/// hold a space itself.
pub trait Words {
    /// One by one.
    fn words(&self) -> Vec<&str>;
}

impl Words for str {
    fn words(&self) -> Vec<&str> {
        self.split(' ').collect()
    }
}

impl Words for String {
    fn words(&self) -> Vec<&str> {
        self.as_str().words()
    }
}

impl Words for [&str] {
    fn words(&self) -> Vec<&str> {
        self.to_vec()
    }
}

impl<const COUNT: usize> Words for [&str; COUNT] {
    fn words(&self) -> Vec<&str> {
        self.to_vec()
    }
}

impl Words for Vec<&str> {
    fn words(&self) -> Vec<&str> {
        self.clone()
    }
}

/// Runs it in a folder.
///
/// # Panics
/// When the process does not start.
pub fn run(folder: &Path, arguments: &(impl Words + ?Sized)) -> Output {
    Command::new(jointwatch())
        .current_dir(folder)
        .args(arguments.words())
        .output()
        .expect("the program starts")
}

/// Runs it, expects success, and gives what it printed.
///
/// # Panics
/// When it fails.
pub fn succeed(folder: &Path, arguments: &(impl Words + ?Sized)) -> String {
    let output = run(folder, arguments);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success(),
        "{:?} ended with {:?}: {said}",
        arguments.words(),
        output.status.code()
    );
    String::from_utf8(output.stdout).expect("text is UTF-8")
}

/// Runs it with `--json -` behind its arguments, and gives what it printed.
///
/// # Panics
/// When it fails, or prints anything else.
pub fn json(folder: &Path, arguments: &(impl Words + ?Sized)) -> Value {
    let arguments = [&arguments.words()[..], &["--json", "-"]].concat();
    parsed(&succeed(folder, &arguments))
}

/// What a file holds as JSON.
///
/// # Panics
/// When it is not there, or holds anything else.
pub fn read_json(file: impl AsRef<Path>) -> Value {
    parsed(&std::fs::read_to_string(file).expect("a file"))
}

fn parsed(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|e| panic!("{e}: {text}"))
}

/// Runs it, expects this exit code, one sentence on standard error and nothing on standard output;
/// gives the sentence.
///
/// # Panics
/// When anything else happens.
pub fn fail(folder: &Path, arguments: &(impl Words + ?Sized), code: i32) -> String {
    let output = run(folder, arguments);
    let arguments = arguments.words();
    let said = String::from_utf8(output.stderr).expect("text is UTF-8");
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
    assert_eq!(said.lines().count(), 1, "one sentence, not {said:?}");
    assert!(
        output.stdout.is_empty(),
        "{arguments:?} printed {:?}",
        String::from_utf8_lossy(&output.stdout)
    );
    said
}

/// Whether a text holds all of these parts.
///
/// # Panics
/// When it lacks one.
#[track_caller]
pub fn says(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "no {part:?} in {text}");
    }
}

/// A folder with this study and copies of its logs.
///
/// # Panics
/// When a log is not in `data`, or nothing can be written.
pub fn study_with_logs(data: &Path, logs: &[&str], study: &str) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for log in logs {
        std::fs::copy(data.join(log), folder.path().join(log)).expect("a log");
    }
    std::fs::write(folder.path().join("study.toml"), study).expect("a study");
    folder
}

/// The measurements and studies that lie beside the project on some machines; says so and gives
/// nothing where not.
pub fn measurements(folder: &str) -> Option<PathBuf> {
    let beside = std::env::var_os("JOINTWATCH_DATA")
        .map_or_else(|| workspace().join("../shared"), PathBuf::from);
    let folder = beside.join(folder);
    if folder.is_dir() {
        return Some(folder);
    }
    // Past the capture of the test harness: a skipped case must not read as a passed one.
    let _ = writeln!(
        std::io::stderr(),
        "SKIPPED: {} is not there; set JOINTWATCH_DATA to the folder that holds the measurements",
        folder.display()
    );
    None
}

/// Copies a folder and all that is in it.
///
/// # Errors
/// When a file cannot be read or written.
pub fn copy_folder(from: &Path, to: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(to)?;
    for entry in std::fs::read_dir(from)? {
        let entry = entry?;
        let to = to.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            copy_folder(&entry.path(), &to)?;
        } else {
            std::fs::copy(entry.path(), to)?;
        }
    }
    Ok(())
}
