//! The lab in a real browser: the whole loop by mouse and by keyboard, with nothing in the console and no request to elsewhere.

use jointwatch_tests::lab::Lab;
use jointwatch_tests::program::{succeed, workspace};
use serde_json::Value;
use std::fs;
use std::io::Write;
use std::path::PathBuf;
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
    let run = |words: &str| succeed(folder.path(), &words.split(' ').collect::<Vec<_>>());
    run("simulate --out rig --hidden coulomb@x --share 0.15 --duration 4 --seed 3");
    run("identify rig --model physical -o rig/base.json");
    run("compare rig rig/base.json --json figures.json");
    run("export rig/base.json -o model.bin");
    run("replay model.bin rig --record valid.csv --frames frames.bin");
    let rig = folder.path().join("rig");
    let lab = Lab::start(&rig, &["study.toml", "base.json"]);
    let first = Lab::start(empty.path(), &[]);
    let shots = workspace().join("target/lab-screenshots");
    fs::create_dir_all(&shots).unwrap();
    let output = Command::new("node")
        .arg(workspace().join("tests/browser/lab.mjs"))
        .args([&modules, &PathBuf::from(chromium_path(chromium)), &shots])
        .args([&lab.url, &first.url])
        .args([rig.join("train_x.csv"), folder.path().join("figures.json")])
        .arg(lab.id().to_string())
        .arg(folder.path().join("frames.bin"))
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
    assert_eq!(
        seen["steps"].as_array().unwrap().len(),
        11,
        "{:#}",
        seen["steps"]
    );
    // Share of one core while nothing happens.
    assert!(seen["idle"].as_f64().unwrap() < 0.01, "{}", seen["idle"]);
}

/// The browser's file: playwright takes no name to look for.
fn chromium_path(name: &str) -> String {
    let found = Command::new("sh")
        .args(["-c", &format!("command -v {name}")])
        .output()
        .unwrap();
    String::from_utf8_lossy(&found.stdout).trim().into()
}
