//! Runs of which every channel was logged into a file of its own.

use jointwatch_tests::learnt::value;
use jointwatch_tests::program::{fail, read_json, says, succeed};
use std::f64::consts::TAU;
use std::fs;
use std::path::Path;

const STIFFNESS: f64 = 3e4;
const DAMPING: f64 = 200.0;

/// Time, displacement and force of a spring and a damper in a row at 1 kHz.
fn row(row: u32) -> [f64; 3] {
    let t = 1e-3 * f64::from(row);
    let tones = [3.1, 7.7, 12.9].map(|hz| [TAU * hz, 1e-3 * (TAU * hz * t + hz).sin()]);
    let speeds = [3.1, 7.7, 12.9].map(|hz| 1e-3 * TAU * hz * (TAU * hz * t + hz).cos());
    let x: f64 = tones.iter().map(|[_, x]| x).sum();
    let v: f64 = speeds.iter().sum();
    [t, x, STIFFNESS * x + DAMPING * v]
}

/// A file of some columns, with a heading where it has names.
fn write(folder: &Path, file: &str, heading: &str, columns: &[usize], rows: u32) {
    let rows = (0..rows).map(|at| {
        let all = row(at);
        let cells = columns.iter().map(|&column| format!("{:.9}", all[column]));
        cells.collect::<Vec<_>>().join(",") + "\n"
    });
    fs::write(
        folder.join(file),
        heading.to_owned() + &rows.collect::<String>(),
    )
    .unwrap();
}

#[track_caller]
fn is_the_damper(folder: &Path) {
    succeed(folder, "identify study.toml --model physical -o m.json");
    let model = read_json(folder.join("m.json"));
    for (effect, truth) in [("stiffness", STIFFNESS), ("viscous", DAMPING)] {
        let off = value(&model, effect) / truth - 1.0;
        assert!(off.abs() < 0.01, "{effect} is off by {off}");
    }
}

#[test]
fn files_without_headings_are_called_after_themselves() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(folder, "position.txt", "", &[1], 4000);
    write(folder, "force.txt", "", &[2], 4000);
    succeed(folder, "init --yes position.txt force.txt --rate 1000");
    let study = fs::read_to_string(folder.join("study.toml")).unwrap();
    says(&study, &["file = \"position.txt + force.txt\""]);
    is_the_damper(folder);
}

#[test]
fn a_time_that_all_files_hold_stands_once_and_equal_names_give_way() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(folder, "disp.csv", "Time,Value\n", &[0, 1], 4000);
    write(folder, "load.csv", "Time,Value\n", &[0, 2], 4000);
    let study = "time = \"Time\"\n[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = \"disp\"\nforce = \"load\"\ninertia = 0\n\
                 [[record]]\nfile = \"disp.csv + load.csv\"\nrole = \"train\"\n[base]\nterms = [\"stiffness@x\", \"viscous@x\"]\n";
    fs::write(folder.join("study.toml"), study).unwrap();
    is_the_damper(folder);
}

#[test]
fn files_of_different_length_or_that_are_missing_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(folder, "disp.csv", "disp\n", &[1], 4000);
    write(folder, "load.csv", "load\n", &[2], 3999);
    let study = "sample_rate_hz = 1000\n[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = \"disp\"\nforce = \"load\"\n\
                 [[record]]\nfile = \"disp.csv + load.csv\"\nrole = \"train\"\n[base]\nterms = [\"stiffness@x\"]\n";
    fs::write(folder.join("study.toml"), study).unwrap();
    let identify = ["identify", "study.toml", "--model", "physical", "-o", "m"];
    let said = fail(folder, &identify, 3);
    says(&said, &["hold 4000 rows of \"disp\" and 3999 of \"load\""]);
    fs::remove_file(folder.join("load.csv")).unwrap();
    let said = fail(folder, &identify, 3);
    assert!(said.contains("load.csv cannot be read"), "{said}");
}

#[test]
fn files_of_several_channels_that_none_other_has_and_lines_of_numbers_are_put_together() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(folder, "motion.csv", "t,x,x_cmd\n", &[0, 1, 1], 4000);
    write(folder, "load.csv", "t,F,F_cmd\n", &[0, 2, 2], 4000);
    succeed(folder, &["init", "--yes", "motion.csv", "load.csv"]);
    let study = fs::read_to_string(folder.join("study.toml")).unwrap();
    assert!(study.contains("motion.csv + load.csv"), "{study}");
    is_the_damper(folder);
    fs::remove_file(folder.join("study.toml")).unwrap();
    for (file, column) in [("position.txt", 1), ("force.txt", 2)] {
        let cells: Vec<String> = (0..4000)
            .map(|at| format!("{:.9}", row(at)[column]))
            .collect();
        fs::write(folder.join(file), cells.join("\t") + "\t").unwrap();
    }
    let init = ["init", "--yes", "position.txt", "force.txt", "--rate"];
    succeed(folder, &[&init[..], &["1000"]].concat());
    is_the_damper(folder);
}
