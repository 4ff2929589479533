//! The lab in a real browser: the whole loop by mouse and by keyboard, with nothing in the console
//! and no request to elsewhere.

use jointwatch_tests::lab::Lab;
use jointwatch_tests::program::{measurements, study_with_logs, succeed, workspace};
use serde_json::Value;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What is needed besides this project; `tests/run` puts it there.
fn browser() -> Option<(PathBuf, &'static str)> {
    let modules = workspace().join("target/browser");
    let works = |program: &&str| {
        let found = Command::new(program).arg("--version").output();
        found.is_ok_and(|o| o.status.success())
    };
    let chromium = ["chromium", "chromium-browser", "google-chrome"]
        .into_iter()
        .find(|n| works(n));
    let missing = match chromium {
        None => "chromium",
        Some(_) if !works(&"node") => "node",
        Some(_) if !modules.join("node_modules/playwright-core").is_dir() => "playwright-core",
        Some(chromium) => return Some((modules, chromium)),
    };
    // Past the capture of the test harness: a skipped case must not read as a passed one.
    let _ = writeln!(
        std::io::stderr(),
        "SKIPPED: there is no {missing}, so no browser went through the lab; tests/run installs it"
    );
    None
}

#[test]
fn a_browser_goes_the_whole_loop() {
    let Some((modules, chromium)) = browser() else {
        return;
    };
    let [folder, empty] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let run = |words: &str| succeed(folder.path(), words);
    run("simulate --out rig --hidden coulomb@x --share 0.15 --duration 4 --seed 3");
    run("identify rig --model physical -o rig/base.json");
    run("compare rig rig/base.json --json figures.json");
    run("export rig/base.json -o model.bin");
    run("replay model.bin rig --record valid.csv --frames frames.bin");
    let rig = folder.path().join("rig");
    let lab = Lab::start(&rig, &["study.toml", "base.json"]);
    let first = Lab::start(empty.path(), &[]);
    let further = [
        first.url.clone().into(),
        rig.join("train_x.csv"),
        folder.path().join("frames.bin"),
    ];
    let seen = gone_through(
        (&modules, chromium),
        "lab-screenshots",
        &lab,
        folder.path(),
        &further,
    );
    assert_eq!(
        seen["steps"].as_array().unwrap().len(),
        12,
        "{:#}",
        seen["steps"]
    );
    // Share of one core while nothing happens.
    assert!(seen["idle"].as_f64().unwrap() < 0.01, "{}", seen["idle"]);
}

#[test]
fn a_browser_finds_the_dry_friction_of_a_measured_axis() {
    let (Some((modules, chromium)), Some(data)) = (browser(), measurements("data/emps")) else {
        return;
    };
    let logs = ["DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"];
    let study = include_str!("../../../docs/missing-effects/emps.toml");
    let folder = study_with_logs(&data, &logs, study);
    for words in [
        "identify study.toml --model physical -o base.json",
        "compare study.toml base.json --json figures.json",
    ] {
        succeed(folder.path(), words);
    }
    let lab = Lab::start(folder.path(), &["study.toml", "base.json"]);
    let seen = gone_through(
        (&modules, chromium),
        "lab-screenshots-emps",
        &lab,
        folder.path(),
        &[],
    );
    assert_eq!(
        seen["steps"].as_array().unwrap().len(),
        9,
        "{:#}",
        seen["steps"]
    );
}

#[test]
#[ignore = "prints the seconds of docs/notebook/front-door.md, which count on an idle machine; tests/run --campaigns"]
fn a_browser_goes_the_loop_on_four_records_of_34_000_rows_and_two_axes() {
    let Some((modules, chromium)) = browser() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    for words in [
        "simulate --out rig --hidden coulomb@x --duration 17 --seed 4",
        "identify rig --model physical -o rig/base.json",
        "compare rig rig/base.json --json figures.json",
    ] {
        succeed(folder.path(), words);
    }
    let lab = Lab::start(&folder.path().join("rig"), &["study.toml", "base.json"]);
    let seen = gone_through(
        (&modules, chromium),
        "lab-screenshots-long",
        &lab,
        folder.path(),
        &[],
    );
    assert!(seen["seconds"]["add"].as_f64().unwrap() > 0.0, "{seen:#}");
}

/// What the browser saw of a lab, with its pictures in a folder below `target`, beside the
/// `figures.json` of the command line; the part on a study of its own needs `further`: an empty
/// lab, a log, and what a device said.
fn gone_through(
    (modules, chromium): (&Path, &str),
    shots: &str,
    lab: &Lab,
    folder: &Path,
    further: &[PathBuf],
) -> Value {
    let shots = workspace().join("target").join(shots);
    fs::create_dir_all(&shots).unwrap();
    let output = Command::new("node")
        .arg(workspace().join("tests/browser/lab.mjs"))
        .args([modules, Path::new(&chromium_path(chromium)), &shots])
        .args([&lab.url, &lab.id().to_string()])
        .arg(folder.join("figures.json"))
        .args(further)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    let seen: Value = serde_json::from_str(said.trim())
        .unwrap_or_else(|e| panic!("{e}: {said}{}", String::from_utf8_lossy(&output.stderr)));
    println!("{seen:#}\nscreenshots in {}", shots.display());
    for nothing in ["errors", "console", "outside", "axe"] {
        assert_eq!(
            seen[nothing].as_array().map(Vec::len),
            Some(0),
            "{nothing}: {:#}",
            seen[nothing]
        );
    }
    seen
}

/// The browser's file: playwright takes no name to look for.
fn chromium_path(name: &str) -> String {
    let found = Command::new("sh")
        .args(["-c", &format!("command -v {name}")])
        .output()
        .unwrap();
    String::from_utf8_lossy(&found.stdout).trim().into()
}
