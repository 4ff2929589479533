//! The tests of the Python package, in Python: with the extension that cargo has just built, and
//! the command line beside it.

use jointwatch_tests::program::{jointwatch, workspace};
use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::io::Write;
use std::process::Command;

#[test]
fn the_package_passes_its_tests() {
    let skipped = |why: &str| {
        // Past the capture of the test harness: a skipped case must not read as a passed one.
        let _ = writeln!(std::io::stderr(), "{why}");
    };
    let works = |program: &&str| {
        let answer = Command::new(program)
            .args(["-c", "import sys; sys.exit(sys.version_info < (3, 9))"])
            .status();
        answer.is_ok_and(|status| status.success())
    };
    let Some(python) = ["python3", "python"].into_iter().find(|p| works(p)) else {
        return skipped(
            "SKIPPED: there is no Python 3.9 or later, so nobody tried the package; install it",
        );
    };
    let program = std::env::current_exe().expect("a test has a file");
    let library = program.with_file_name(format!("{DLL_PREFIX}jointwatch_native{DLL_SUFFIX}"));
    let target = program.ancestors().nth(3).expect("target/release/deps");
    let output = Command::new(python)
        .arg(workspace().join("host/python/tests/run.py"))
        .arg(library)
        .arg(jointwatch())
        .arg(target.join("python"))
        .output()
        .expect("Python starts");
    let said = String::from_utf8_lossy(&output.stdout);
    println!("{said}");
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}\n{complaint}");
    for line in said.lines().filter(|line| line.starts_with("SKIPPED:")) {
        skipped(line);
    }
}
