//! Logs without time: laws of the path alone come back from them, whatever the rows, and nothing is
//! reported per second.

use crate::noise::noise;
use jointwatch::fit::identify;
use jointwatch::model::file::ModelFile;
use jointwatch::study::{MemoryLog, Study};
use jointwatch_tests::lab::Lab;
use jointwatch_tests::program::{fail, says, succeed};
use serde_json::json;
use std::fmt::Write as _;
use std::fs;
use tempfile::TempDir;

const STIFFNESS: f64 = 4.0e4;
const FRICTION: f64 = 25.0;
const SLIP: f64 = 2.0e-4;

/// Loops of many sizes: reversals at random places, steps of up to `step` metres between them.
fn path(seed: u64, step: f64) -> Vec<f64> {
    let mut noise = noise(seed);
    let mut x = 0.0_f64;
    let mut path = vec![x];
    for turn in 0..40 {
        let side = if turn % 2 == 0 { 1.0 } else { -1.0 };
        let target = side * 1e-3 * (0.55 + 0.45 * noise());
        let steps = ((target - x).abs() / step).ceil();
        let from = x;
        for at in 1..=steps as usize {
            x = from + (target - from) * at as f64 / steps;
            path.push(x);
        }
    }
    path
}

/// Spring and dry friction along a path; behind a spring of its own where `elastic`.
fn force(path: &[f64], elastic: bool) -> Vec<f64> {
    let mut z = 0.0_f64;
    let mut before = path[0];
    let mut force = Vec::new();
    for x in path {
        let change = x - before;
        before = *x;
        z = match elastic {
            true => (z + change / SLIP).clamp(-1.0, 1.0),
            false if change == 0.0 => z,
            false => change.signum(),
        };
        force.push(STIFFNESS * x + FRICTION * z);
    }
    force
}

fn logs(step: f64, elastic: bool) -> [MemoryLog; 2] {
    ["train", "valid"].map(|name| {
        let seed = name.len() as u64 + u64::from(name == "valid") * 70;
        let path = path(seed, step);
        let mut noise = noise(seed + 5);
        let force = force(&path, elastic).into_iter();
        MemoryLog {
            name: name.into(),
            columns: vec![
                ("F".into(), force.map(|f| f + 0.1 * noise()).collect()),
                (
                    "x".into(),
                    path.into_iter().map(|x| x + 2e-7 * noise()).collect(),
                ),
            ],
        }
    })
}

fn text(terms: &str, top: &str, axis: &str) -> String {
    format!(
        "{top}\n[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = \"x\"\nforce = \"F\"\n{axis}\n[[record]]\nfile = \
         \"train\"\nrole = \"train\"\n[[record]]\nfile = \"valid\"\nrole = \"validate\"\n[base]\nterms = [{terms}]\n"
    )
}

const NONE: &str = "time = \"none\"";

fn learnt(terms: &str, logs: &[MemoryLog]) -> ModelFile {
    let study = Study::of_memory("memory", &text(terms, NONE, ""), logs).unwrap();
    identify::physical(&study).unwrap().model
}

fn value(model: &ModelFile, name: &str) -> f64 {
    let mut all = model.effects.iter().flat_map(|e| &e.parameters);
    all.find(|p| p.name == name).unwrap().value
}

#[test]
fn spring_and_friction_come_back_from_the_path_alone() {
    for step in [1e-5, 2.3e-5, 6e-5] {
        let model = learnt("\"stiffness@x\", \"coulomb@x\"", &logs(step, false));
        let found = [value(&model, "stiffness"), value(&model, "friction")];
        println!("steps of {step}: {found:?}, error {:?}", model.validation);
        assert!((found[0] / STIFFNESS - 1.0).abs() < 2e-3, "{found:?}");
        assert!((found[1] / FRICTION - 1.0).abs() < 5e-3, "{found:?}");
        assert!(
            model.validation[0].relative_error < 0.01,
            "{:?}",
            model.validation
        );
    }
    for step in [1e-5, 4e-5] {
        let model = learnt("\"stiffness@x\", \"jenkins@x\"", &logs(step, true));
        let found = [
            value(&model, "stiffness"),
            value(&model, "slip_force"),
            value(&model, "slip_displacement"),
        ];
        println!("steps of {step}: {found:?}, error {:?}", model.validation);
        assert!((found[0] / STIFFNESS - 1.0).abs() < 5e-3, "{found:?}");
        assert!((found[1] / FRICTION - 1.0).abs() < 1e-2, "{found:?}");
        assert!((found[2] / SLIP - 1.0).abs() < 2e-2, "{found:?}");
    }
}

/// The study as files; gives its folder.
fn folder(terms: &str, elastic: bool) -> TempDir {
    let folder = TempDir::new().unwrap();
    for log in logs(2e-5, elastic) {
        let mut csv = String::from("F,x\n");
        for (f, x) in log.columns[0].1.iter().zip(&log.columns[1].1) {
            let _ = writeln!(csv, "{f},{x}");
        }
        fs::write(folder.path().join(&log.name), csv).unwrap();
    }
    fs::write(folder.path().join("study.toml"), text(terms, NONE, "")).unwrap();
    folder
}

/// Whether a text says anything of seconds or hertz.
fn speaks_of_time(text: &str) -> bool {
    let words = text.split(|c: char| c.is_whitespace() || ",;:()".contains(c));
    let mut words = words.map(|w| w.trim_end_matches('.'));
    words.any(|w| w.ends_with("Hz") || w.ends_with("/s") || ["s", "ms", "µs"].contains(&w))
}

#[test]
fn nothing_is_reported_per_second_and_the_missing_friction_is_named() {
    let folder = folder("\"stiffness@x\"", true);
    let folder = folder.path();
    let said = succeed(folder, &["identify", ".", "--model", "physical"]);
    assert!(
        said.contains("have no time") && !speaks_of_time(&said),
        "{said}"
    );
    let said = succeed(folder, &["compare", ".", "model.json"]);
    assert!(!speaks_of_time(&said), "{said}");
    let said = succeed(folder, &["diagnose", ".", "model.json"]);
    println!("{said}");
    assert!(
        said.contains("jenkins@x") && !speaks_of_time(&said),
        "{said}"
    );
    let said = succeed(folder, "add . model.json jenkins@x -o more.json");
    assert!(!speaks_of_time(&said), "{said}");
    let more = ModelFile::read(&folder.join("more.json")).unwrap();
    assert!((value(&more, "slip_displacement") / SLIP - 1.0).abs() < 2e-2);
    assert!(more.filters.quasi_static);
}

#[test]
fn dry_friction_has_no_velocity_of_transition() {
    let folder = folder("\"stiffness@x\", \"coulomb@x\"", false);
    let said = succeed(folder.path(), &["identify", ".", "--model", "physical"]);
    assert!(!speaks_of_time(&said), "{said}");
}

#[test]
fn sums_of_records_without_time_make_a_model_without_time() {
    let folder = folder("\"stiffness@x\"", true);
    let folder = folder.path();
    let log = logs(2e-5, true)[0].name.clone();
    for records in [&[][..], &[log.as_str()]] {
        let command = [&["accumulate", "."], records, &["-o", "s.sums"]].concat();
        let said = succeed(folder, &command);
        assert!(!speaks_of_time(&said), "{said}");
        succeed(folder, "identify --from s.sums --model physical");
        succeed(folder, &["compare", ".", "model.json"]);
        let command = ["identify", "--from", "s.sums", "--model", "polynomial"];
        let said = fail(folder, &command, 3);
        assert!(said.contains("without time"), "{said}");
        fs::remove_file(folder.join("s.sums")).unwrap();
    }
}

#[test]
fn pictures_and_report_run_over_the_rows() {
    let folder = folder("\"stiffness@x\", \"coulomb@x\"", false);
    let folder = folder.path();
    succeed(folder, &["identify", ".", "--model", "physical"]);
    let compare = ["compare", ".", "model.json", "--quiet"];
    let drawn = ["--report", "r.html", "--plots", "p"];
    succeed(folder, &[&compare[..], &drawn].concat());
    let page = fs::read_to_string(folder.join("r.html")).unwrap();
    assert!(page.contains("\"timed\":false"));
    assert!(page.contains("none: rows are taken as they are"));
    let mut forces = 0;
    for file in fs::read_dir(folder.join("p")).unwrap() {
        let file = file.unwrap().path();
        let svg = fs::read_to_string(&file).unwrap();
        assert!(!svg.contains("time (s)"), "{}", file.display());
        assert!(!svg.contains("velocity"), "{}", file.display());
        if file.to_string_lossy().ends_with("-force.svg") {
            assert!(svg.lines().any(|line| line == "row"), "{svg}");
            forces += 1;
        }
    }
    assert!(forces > 0);
}

#[test]
fn the_lab_works_over_the_rows() {
    let folder = folder("\"stiffness@x\"", false);
    succeed(folder.path(), &["identify", ".", "--model", "physical"]);
    let lab = Lab::start(folder.path(), &["study.toml", "model.json"]);
    let state = lab.rest();
    assert!(state["study"]["sample_rate_hz"].is_null(), "{state}");
    assert!(state["study"]["records"][0]["seconds"].is_null(), "{state}");
    let effects = state["study"]["effects"].to_string();
    assert!(effects.contains("coulomb@x") && !effects.contains("viscous@x"));
    let residual = &lab.view(&state)["axes"][0]["residual"][0];
    assert!(residual["over"]["displacement"].is_object(), "{residual}");
    for timed in ["plane", "spectrum", "correlation"] {
        assert!(residual[timed].is_null(), "{timed}: {residual}");
    }
    let state = lab.done(&json!({ "do": "diagnose" }));
    assert_eq!(state["diagnosis"]["found"][0]["effect"], "coulomb");
    let state = lab.done(&json!({ "do": "add", "effects": ["coulomb@x"] }));
    assert_eq!(state["current"], "jointwatch-lab/model-coulomb-x.json");
}

#[test]
fn what_needs_time_is_refused_with_what_to_do() {
    let folder = folder("\"stiffness@x\", \"coulomb@x\"", false);
    let folder = folder.path();
    succeed(folder, &["identify", ".", "--model", "physical"]);
    let refused = |arguments: &[&str], words: &[&str]| {
        let said = fail(folder, arguments, 3);
        for word in words {
            assert!(said.contains(word), "{arguments:?}: {said}");
        }
    };
    refused(
        &["identify", ".", "--model", "polynomial"],
        &["--model physical"],
    );
    refused(
        &["identify", ".", "--model", "network"],
        &["--model physical"],
    );
    refused(
        &["add", ".", "model.json", "viscous@x"],
        &["viscous@x", "coulomb"],
    );
    refused(&["respond", ".", "model.json"], &["compare"]);
    refused(&["export", "model.json"], &["without time"]);
    let refused = |top: &str, axis: &str, terms: &str, words: &[&str]| {
        let text = text(terms, top, axis);
        fs::write(folder.join("study.toml"), text).unwrap();
        let said = fail(folder, &["identify", ".", "--model", "physical"], 3);
        says(&said, words);
    };
    let spring = "\"stiffness@x\"";
    refused(
        &format!("{NONE}\nband_hz = 3"),
        "",
        spring,
        &["line 2", "band_hz"],
    );
    refused(
        &format!("{NONE}\nsample_rate_hz = 3"),
        "",
        spring,
        &["line 2", "sample_rate_hz"],
    );
    refused(NONE, "inertia = 2", spring, &["line 7", "inertia"]);
    refused(NONE, "velocity = \"F\"", spring, &["line 7", "velocity"]);
    refused(NONE, "", "\"viscous@x\"", &["viscous@x", "jenkins"]);
    refused("", "", spring, &["time = \"none\""]);
    // With time the model of the path does not fit, and says so.
    fs::write(
        folder.join("study.toml"),
        text(spring, "sample_rate_hz = 1000", "inertia = 0"),
    )
    .unwrap();
    let said = fail(folder, &["compare", ".", "model.json"], 3);
    assert!(said.contains("the study has time"), "{said}");
    // A column may be called none.
    let column = "time = { column = \"none\" }";
    refused(column, "", spring, &["no column \"none\""]);
}

/// A test in which the amplitude grows is not judged where nothing was learnt: the part that is
/// kept aside moves within the others.
#[test]
fn of_one_log_a_part_within_the_others_is_kept_aside() {
    let folder = TempDir::new().unwrap();
    let drafted = |grows: bool| {
        let rows = (0..2000).map(|row| {
            let turn = f64::from(row) / 40.0;
            // One large loop near the end, as the last but one amplitude of a protocol is.
            let size = match (grows, row) {
                (true, 1700..1800) => 3.0,
                _ => 1.0,
            };
            let x = size * turn.sin();
            format!("{x:.5},{:.5}\n", 40.0 * x + 25.0 * turn.cos().signum())
        });
        let text = format!("d [mm],F [N]\n{}", rows.collect::<String>());
        fs::write(folder.path().join("run.csv"), text).unwrap();
        let init = ["init", "run.csv", "--yes", "--column", "time=none"];
        succeed(folder.path(), &[init.as_slice(), &["-o", "-"]].concat())
    };
    let parts = |text: &str| -> Vec<String> {
        let lines = text.lines().filter(|line| line.starts_with("rows = "));
        let part = |line: &str| line.split("   ").next().unwrap().to_owned();
        lines.map(part).collect()
    };
    assert_eq!(
        parts(&drafted(false)),
        ["rows = [0, 1400]", "rows = [1400, 2000]"]
    );
    assert_eq!(
        parts(&drafted(true)),
        [
            "rows = [0, 1000]",
            "rows = [1000, 1600]",
            "rows = [1600, 2000]"
        ]
    );
}

#[test]
fn of_several_logs_one_within_the_others_is_kept_aside() {
    let drafted = |sizes: &[(f64, i32)]| {
        let folder = TempDir::new().unwrap();
        let mut init: Vec<String> = ["init", "--yes", "--column", "time=none", "-o", "-"]
            .map(String::from)
            .to_vec();
        for (at, (size, rows)) in sizes.iter().enumerate() {
            let row = |row: i32| {
                let turn = f64::from(row) / 40.0;
                let x = size * turn.sin();
                format!("{x:.5},{:.5}\n", 40.0 * x + 25.0 * turn.cos().signum())
            };
            let text = format!("d [mm],F [N]\n{}", (0..*rows).map(row).collect::<String>());
            fs::write(folder.path().join(format!("{at}.csv")), text).unwrap();
            init.push(format!("{at}.csv"));
        }
        let text = succeed(
            folder.path(),
            &init.iter().map(String::as_str).collect::<Vec<_>>(),
        );
        let (before, _) = text.split_once("role = \"validate\"").unwrap();
        let file = before.rsplit("file = ").next().unwrap();
        file.split('"').nth(1).unwrap().to_owned()
    };
    // The last of those that are alike; else the last that goes not beyond the others; shorter ones
    // first.
    assert_eq!(drafted(&[(1.0, 2000), (1.0, 2000), (1.0, 2000)]), "2.csv");
    assert_eq!(drafted(&[(1.0, 2000), (2.0, 2000), (3.0, 2000)]), "1.csv");
    assert_eq!(
        drafted(&[(2.0, 2000), (1.0, 1000), (1.5, 1000), (3.0, 1000)]),
        "2.csv"
    );
    assert_eq!(drafted(&[(1.0, 2000), (2.0, 1000)]), "1.csv");
}

#[test]
fn a_stretch_of_a_log_remembers_the_stretch_before_it() {
    const SOFTENING: f64 = 1.5e7;
    // The second half moves half as far as the first, which left the spring softer.
    let [first, second] = [3, 9].map(|seed| path(seed, 2e-5));
    let rows = [first.len(), first.len() + second.len()];
    let x: Vec<f64> = [first, second.iter().map(|x| 0.5 * x).collect()].concat();
    let mut largest = 0.0_f64;
    let force = x.iter().map(|x| {
        largest = largest.max(x.abs());
        (STIFFNESS - SOFTENING * largest) * x
    });
    let log = MemoryLog {
        name: "log".into(),
        columns: vec![("F".into(), force.collect()), ("x".into(), x.clone())],
    };
    let error = |begins: usize| {
        let text = text("\"stiffness@x\", \"mullins@x\"", NONE, "");
        let text = text.replace(
            "file = \"train\"",
            &format!("file = \"log\"\nrows = [0, {}]", rows[0]),
        );
        let text = text.replace(
            "file = \"valid\"",
            &format!("file = \"log\"\nrows = [{begins}, {}]", rows[1]),
        );
        let study = Study::of_memory("memory", &text, std::slice::from_ref(&log)).unwrap();
        let model = identify::physical(&study).unwrap().model;
        model.validation[0].relative_error
    };
    let [joined, apart] = [rows[0], rows[0] + 1].map(error);
    println!("relative error {joined}, with a row between them {apart}");
    assert!(joined < 1e-3 && apart > 0.1, "{joined}, {apart}");
}

/// A damper that softens, as tables of a paper give it: a row wherever the curve bends, and a mean
/// slope against its own force.
#[test]
fn wide_loops_of_few_rows_tell_their_sign() {
    const SIZES: [f64; 10] = [2.0, 2.0, 4.0, 8.0, 12.0, 16.0, 20.0, 24.0, 28.0, 32.0];
    let (mut z, mut before, mut rows) = (0.0_f64, 0.0, Vec::new());
    for (at, size) in SIZES.iter().enumerate() {
        for row in 0..18 {
            let turn = (f64::from(row) / 18.0 + at as f64) * std::f64::consts::TAU;
            // The rows are not even.
            let x = size * (turn + 0.2 * (3.0 * turn).sin()).sin() + 0.03 * size * turn.cos();
            for _ in 0..400 {
                let step = (x - before) / 400.0;
                z += step * (1.0 - z * f64::signum(step));
            }
            before = x;
            rows.push([x, 200.0 * z - 3.0 * x]);
        }
    }
    for (sign, written) in [(1.0, "force_minus_inertia"), (-1.0, "inertia_minus_force")] {
        let folder = TempDir::new().unwrap();
        let folder = folder.path();
        let lines = rows
            .iter()
            .map(|[x, f]| format!("{x:.4},{:.2}\n", sign * f));
        let log = format!("d [mm],F [kN]\n{}", lines.collect::<String>());
        fs::write(folder.join("loops.csv"), log).unwrap();
        let init = ["init", "loops.csv", "--yes", "--column", "time=none"];
        succeed(folder, &init);
        let study = fs::read_to_string(folder.join("study.toml")).unwrap();
        let line = format!("restoring_force = \"{written}\"");
        assert!(study.contains(&line), "{study}");
        succeed(folder, &["identify", ".", "--model", "physical"]);
        let said = succeed(folder, &["diagnose", ".", "model.json"]);
        assert!(said.contains("Missing: dahl@x"), "{said}");
    }
}
