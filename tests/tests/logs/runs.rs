//! What test stands hand over as one test: a drive of one frequency, runs side by side in one
//! sheet, a run that was broken off.

use jointwatch_tests::learnt::value;
use jointwatch_tests::program::{fail, read_json, run, says, succeed};
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const STIFFNESS: f64 = 3e4;
const DAMPING: f64 = 200.0;

/// Time, displacement in mm and force of a damper beside a spring, driven at one frequency, without
/// any noise.
fn row(row: u32, hz: f64) -> [f64; 3] {
    let t = f64::from(row) / 500.0;
    let (sine, cosine) = (TAU * hz * t).sin_cos();
    let (x, v) = (5e-3 * sine, 5e-3 * TAU * hz * cosine);
    [t, 1e3 * x, STIFFNESS * x + DAMPING * v]
}

fn cells(row: [f64; 3]) -> String {
    row.map(|value| format!("{value:.9}")).join(",")
}

fn log(hz: f64, rows: u32) -> String {
    let all = (0..rows).map(|i| cells(row(i, hz)) + "\n");
    format!("time_s,disp_mm,force_N\n{}", all.collect::<String>())
}

/// Stiffness and damping by the drafted study of some logs.
fn drafted(folder: &Path, logs: &[&str]) -> [f64; 2] {
    succeed(folder, &[&["init", "--yes"], logs].concat());
    succeed(folder, "identify study.toml --model physical -o m.json");
    let model = read_json(folder.join("m.json"));
    ["stiffness", "viscous"].map(|effect| value(&model, effect))
}

#[track_caller]
fn is_the_damper([stiffness, damping]: [f64; 2]) {
    assert!((stiffness / STIFFNESS - 1.0).abs() < 1e-3, "{stiffness}");
    assert!((damping / DAMPING - 1.0).abs() < 1e-3, "{damping}");
}

/// A mass and a spring are one to the force there, so no fit has both.
#[test]
fn a_drive_of_one_frequency_is_drafted() {
    let dir = TempDir::new().unwrap();
    fs::write(dir.path().join("sine.csv"), log(2.0, 4000)).unwrap();
    is_the_damper(drafted(dir.path(), &["sine.csv"]));
}

#[test]
fn a_run_that_was_broken_off_is_left_out_and_named() {
    let dir = TempDir::new().unwrap();
    for (name, hz, rows) in [
        ("a.csv", 2.0, 3000),
        ("b.csv", 2.0, 60),
        ("c.csv", 1.3, 2000),
    ] {
        fs::write(dir.path().join(name), log(hz, rows)).unwrap();
    }
    let said = succeed(dir.path(), &["init", "--yes", "a.csv", "b.csv", "c.csv"]);
    assert!(said.contains("b.csv has 60 rows"), "{said}");
    let text = fs::read_to_string(dir.path().join("study.toml")).unwrap();
    assert!(text.contains("c.csv") && !text.contains("b.csv"), "{text}");
    // Alone it is refused, with what a record needs.
    fs::remove_file(dir.path().join("study.toml")).unwrap();
    let alone = run(dir.path(), &["init", "--yes", "b.csv"]);
    let said = String::from_utf8_lossy(&alone.stderr);
    assert_eq!(alone.status.code(), Some(3), "{said}");
    assert!(said.contains("at least 100"), "{said}");
}

#[test]
fn runs_side_by_side_in_one_sheet_are_records_of_their_own() {
    let dir = TempDir::new().unwrap();
    let mut text = String::from(
        "2 Hz,,,,1.3 Hz,,\ntime,displacement,force,,time,displacement,force\ns,mm,N,,s,mm,N\n",
    );
    for i in 0..2000 {
        let second = if i < 1500 {
            cells(row(i, 1.3))
        } else {
            ",,".into()
        };
        writeln!(text, "{},,{second}", cells(row(i, 2.0))).unwrap();
    }
    fs::write(dir.path().join("sheet.csv"), text).unwrap();
    is_the_damper(drafted(dir.path(), &["sheet.csv"]));
    let study = fs::read_to_string(dir.path().join("study.toml")).unwrap();
    assert!(study.contains("rows = [0, 1500]"), "{study}");
    // A study that says of neither which columns it means is told what to write.
    let (axis, _) = study.split_once("[[record]]").unwrap();
    let one = format!("{axis}[[record]]\nfile = \"sheet.csv\"\nrole = \"train\"\n");
    fs::write(dir.path().join("study.toml"), one).unwrap();
    let said = fail(
        dir.path(),
        "identify study.toml --model physical -o n.json",
        3,
    );
    says(&said, &["twice", "columns = ["]);
}

/// A test machine's steps stand one below the other, each with a preface and a clock of its own.
#[test]
fn blocks_of_one_log_with_a_heading_each_are_records_of_their_own() {
    let dir = TempDir::new().unwrap();
    let mut text = String::from("Created by a test machine\n\n");
    for (step, hz, rows) in [(1, 2.0, 2000), (2, 1.3, 1500)] {
        writeln!(
            text,
            "Step No. {step}\nSet Force = -200\nData Count,{rows}\n\nT,disp,force\nsec,mm,N\n"
        )
        .unwrap();
        (0..rows).for_each(|i| writeln!(text, "{}", cells(row(i, hz))).unwrap());
    }
    fs::write(dir.path().join("steps.csv"), text).unwrap();
    is_the_damper(drafted(dir.path(), &["steps.csv"]));
    let study = fs::read_to_string(dir.path().join("study.toml")).unwrap();
    says(&study, &["rows = [0, 2000]", "rows = [2000, 3500]"]);
    let inspected = succeed(dir.path(), &["inspect", "steps.csv"]);
    assert!(inspected.contains("3500 rows in 2 blocks"), "{inspected}");
    // Where the time goes on, a heading that stands there again breaks nothing off.
    let head = "T,disp,force\nsec,mm,N\n";
    let rows = |from: u32| {
        (from..from + 1500)
            .map(|i| cells(row(i, 2.0)) + "\n")
            .collect::<String>()
    };
    fs::write(
        dir.path().join("on.csv"),
        format!("{head}{}\nData Acquisition\n{head}{}", rows(0), rows(1500)),
    )
    .unwrap();
    let inspected = succeed(dir.path(), &["inspect", "on.csv"]);
    assert!(inspected.contains("3000 rows, 500 Hz"), "{inspected}");
    // A line that is no row, and above no heading, is refused as ever.
    let whole = fs::read_to_string(dir.path().join("steps.csv")).unwrap();
    let (above, below) = whole.rsplit_once("T,disp,force\nsec,mm,N\n").unwrap();
    fs::write(dir.path().join("steps.csv"), format!("{above}{below}")).unwrap();
    let said = fail(dir.path(), &["inspect", "steps.csv"], 3);
    assert!(said.contains("1 cell where 3 columns are named"), "{said}");
}

/// Two thermometers and two columns of words are no second run of one displacement.
#[test]
fn runs_below_one_heading_are_records_where_the_time_begins_anew() {
    let dir = TempDir::new().unwrap();
    let mut text = String::from("Run,T,disp,force\n,sec,mm,N\n");
    for (run, hz, rows) in [(1, 2.0, 2000), (2, 1.3, 1500)] {
        (0..rows).for_each(|i| writeln!(text, "{run},{}", cells(row(i, hz))).unwrap());
    }
    fs::write(dir.path().join("runs.csv"), &text).unwrap();
    is_the_damper(drafted(dir.path(), &["runs.csv"]));
    let study = fs::read_to_string(dir.path().join("study.toml")).unwrap();
    says(&study, &["rows = [0, 2000]", "rows = [2000, 3500]"]);
    // A row that is out of its place begins no run.
    let mut lines: Vec<&str> = text.lines().collect();
    lines.truncate(2000);
    lines.swap(1000, 1001);
    fs::write(dir.path().join("swapped.csv"), lines.join("\n")).unwrap();
    let init = ["init", "--yes", "swapped.csv", "-o", "swapped.toml"];
    let output = run(dir.path(), &init);
    assert_eq!(output.status.code(), Some(3));
    says(
        &String::from_utf8(output.stderr).unwrap(),
        &["does not rise"],
    );
}

#[test]
fn names_that_stand_twice_beside_one_force_make_no_runs() {
    let dir = TempDir::new().unwrap();
    let mut text = String::from("time,displacement,force,T,RH,T,RH,phase,state,phase,state\n");
    for i in 0..2000 {
        let warm = f64::from(i) * 1e-3;
        writeln!(
            text,
            "{},2{warm},4{warm},2{warm},4{warm},up,ok,up,ok",
            cells(row(i, 2.0))
        )
        .unwrap();
    }
    fs::write(dir.path().join("sheet.csv"), text).unwrap();
    succeed(dir.path(), &["init", "--yes", "sheet.csv"]);
    let study = fs::read_to_string(dir.path().join("study.toml")).unwrap();
    assert!(!study.contains("columns = ["), "{study}");
}

/// Two columns without a heading, the force first: which is which shows in the work.
#[test]
fn two_columns_without_names_are_told_apart_by_the_work_that_the_joint_takes_in() {
    let dir = TempDir::new().unwrap();
    let rows = (0..2000).map(|i| {
        let [_, x_mm, force] = row(i, 2.0);
        format!("{force:.6} {x_mm:.9}\n")
    });
    fs::write(dir.path().join("table.txt"), rows.collect::<String>()).unwrap();
    let words = ["init", "--yes", "table.txt", "--rate", "500"];
    let said = succeed(dir.path(), &words);
    assert!(said.contains("takes in work"), "{said}");
    let study = fs::read_to_string(dir.path().join("study.toml")).unwrap();
    let lines = [
        "displacement = \"c2\"   # guessed",
        "force = \"c1\"   # guessed",
    ];
    says(&study, &lines);
}

/// Of three columns without a heading the velocity is the slope of the displacement.
#[test]
fn three_columns_without_names_are_told_apart_by_the_slope_that_one_is_of_another() {
    let dir = TempDir::new().unwrap();
    let rows = (0..2000).map(|i| {
        let [t, x, force] = row(i, 2.0);
        let velocity = (row(i + 1, 2.0)[1] - x) * 500.0;
        format!("{t:.3} {force:.6} {x:.9} {velocity:.6}\n")
    });
    fs::write(dir.path().join("table.txt"), rows.collect::<String>()).unwrap();
    succeed(dir.path(), &["init", "--yes", "table.txt"]);
    let study = fs::read_to_string(dir.path().join("study.toml")).unwrap();
    let lines = [
        "time = \"c1\"",
        "displacement = \"c3\"   # guessed",
        "velocity = \"c4\"   # guessed",
        "force = \"c2\"   # guessed",
    ];
    says(&study, &lines);
}

/// What drives a body near one frequency looks like a joint that is counted the other way.
#[test]
fn two_columns_that_may_be_a_driven_body_or_a_joint_are_asked_for() {
    let dir = TempDir::new().unwrap();
    let rows = (0..2000).map(|i| {
        let [t, x, force] = row(i, 2.0);
        format!("{t:.3} {x:.9} {:.6}\n", -force)
    });
    fs::write(dir.path().join("table.txt"), rows.collect::<String>()).unwrap();
    let output = run(dir.path(), &["init", "--yes", "table.txt"]);
    assert_eq!(output.status.code(), Some(3));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("--column force="), "{said}");
}

/// Two tests of one motor in one file, of different length.
#[test]
fn tables_of_the_same_columns_in_one_document_are_records_of_their_own() {
    let dir = TempDir::new().unwrap();
    let table = |hz: f64, rows: u32| {
        let rows: Vec<String> = (0..rows)
            .map(|i| format!("[{}]", cells(row(i, hz))))
            .collect();
        rows.join(",")
    };
    let (fast, slow) = (table(2.0, 2000), table(1.3, 1500));
    let text = format!("{{\"fast\": [{fast}], \"slow\": [{slow}], \"limits\": [[0, 1], [2, 3]]}}");
    fs::write(dir.path().join("tests.json"), text).unwrap();
    let roles = ["time=0", "displacement=1", "force=2"].map(|role| ["--column", role]);
    let words = [&["init", "--yes", "tests.json"], roles.as_flattened()].concat();
    let said = succeed(dir.path(), &words);
    says(
        &said,
        &[
            "the tables \"fast\", \"slow\" one below the other, without \"limits\" of other columns",
            "tests.json holds 2 runs one below the other",
        ],
    );
    let path = dir.path().join("study.toml");
    let study = fs::read_to_string(&path).unwrap();
    says(&study, &["rows = [0, 2000]", "rows = [2000, 3500]"]);
    let stated = study.replace("\"1\"", "{ column = \"1\", unit = \"mm\" }");
    fs::write(&path, stated).unwrap();
    succeed(dir.path(), "identify study.toml --model physical -o m.json");
    let model = read_json(dir.path().join("m.json"));
    is_the_damper(["stiffness", "viscous"].map(|effect| value(&model, effect)));
}
