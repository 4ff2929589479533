//! A single log of one event: no part of it can stand for the others, so that all of it trains.

use super::free_motion::noise;
use jointwatch_tests::program::{fail, says, succeed};
use std::fmt::Write as _;
use std::fs;
use tempfile::TempDir;

const ROWS: u32 = 6000;

/// A probe at rest that is pressed into something from this row on, for 900 rows, again and again
/// after so many.
fn log(first: u32, every: u32) -> String {
    let mut text = String::from("t (s),indent (nm),load (nN)\n");
    for row in 0..ROWS {
        let since = row
            .checked_sub(first)
            .map_or(0.0, |rows| f64::from(rows % every));
        let depth = 500.0 * (1.0 - (since - 450.0).abs() / 450.0).max(0.0);
        let load = 3e-3 * depth.powf(1.5) + 0.2 * noise(row, 0.3);
        writeln!(text, "{:.4},{depth:.4},{load:.4}", f64::from(row) * 1e-3).unwrap();
    }
    text
}

fn drafted(log: String) -> (TempDir, [String; 2]) {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("run.csv"), log).unwrap();
    let said = succeed(folder.path(), &["init", "--yes", "run.csv"]);
    let study = fs::read_to_string(folder.path().join("study.toml")).unwrap();
    (folder, [said, study])
}

#[test]
fn one_event_is_learnt_from_as_a_whole_and_several_are_split() {
    // The contact is in the last seconds, and its way in and its way out differ.
    let (_, [said, study]) = drafted(log(4800, ROWS));
    says(&said, &["none of it is kept aside for validation"]);
    assert!(!study.contains("role = \"validate\""), "{study}");
    says(&study, &["unit = \"nN\""]);
    let (_, [said, study]) = drafted(log(0, 1000));
    assert!(!said.contains("kept aside for validation"), "{said}");
    says(&study, &["role = \"validate\""]);
}

#[test]
fn a_part_in_which_nothing_moves_is_refused_by_its_rows() {
    let (folder, [_, study]) = drafted(log(4800, ROWS));
    let still = "role = \"train\"\nrows = [3000, 6000]\n[[record]]\nfile = \"run.csv\"\nrole = \"validate\"\nrows = [0, 3000]\n";
    let study = study.replacen("role = \"train\"   # learnt from\n", still, 1);
    fs::write(folder.path().join("study.toml"), study).unwrap();
    let said = fail(folder.path(), "identify . --model physical", 3);
    says(&said, &["run.csv, rows 0 to 3000, column \"indent (nm)\""]);
}
