//! What `init` makes of the times of a log: which column counts them, in which unit, and how the
//! rows come to an even rate.

use super::time_as_it_is::noise;
use jointwatch::model::file::ModelFile;
use jointwatch_tests::program::{run, says, succeed};
use std::fs;
use tempfile::TempDir;

/// A log of a spring of 2e4 N/m and a damper of 40 N·s/m: these rows of a clock with so many steps
/// per second.
fn spring_and_damper(rate_hz: f64, rows: impl Iterator<Item = u32>) -> String {
    let mut log = String::from("time_s,displacement_m,force_N\n");
    let mut noise = noise();
    for row in rows {
        let t = f64::from(row) / rate_hz;
        let (a, b) = (44.0, 107.0);
        let x = 1e-3 * ((a * t).sin() + 0.4 * (b * t).sin()) + 1e-7 * noise();
        let v = 1e-3 * (a * (a * t).cos() + 0.4 * b * (b * t).cos());
        log += &format!("{t:.3},{x:.9},{:.5}\n", 2e4 * x + 40.0 * v + 0.01 * noise());
    }
    log
}

/// Drafts a study of logs, which is said to be brought to a rate, and finds spring and damper by
/// it.
fn drafted(logs: &[(&str, String)], rate: &str) {
    finds_spring_and_damper(
        logs,
        &format!("interpolated to {rate} Hz"),
        &format!("time = {{ column = \"time_s\", resample_hz = {rate} }}   # guessed"),
    );
}

/// Drafts a study of logs, which says this and has this line, and finds spring and damper by it.
fn finds_spring_and_damper(logs: &[(&str, String)], says: &str, line: &str) {
    let folder = TempDir::new().unwrap();
    let mut command = vec!["init", "--yes"];
    for (name, log) in logs {
        fs::write(folder.path().join(name), log).unwrap();
        command.push(name);
    }
    let said = succeed(folder.path(), &command);
    assert!(said.contains(says), "{said}");
    let study = fs::read_to_string(folder.path().join("study.toml")).unwrap();
    assert!(study.contains(line), "{study}");
    succeed(folder.path(), &["identify", ".", "--model", "physical"]);
    let model = ModelFile::read(&folder.path().join("model.json")).unwrap();
    let values = model.effects.iter().map(|e| e.parameters[0].value);
    for (value, truth) in values.zip([2e4, 40.0]) {
        assert!((value / truth - 1.0).abs() < 1e-2, "{value} for {truth}");
    }
}

#[test]
fn rows_that_arrived_in_bursts_are_taken_as_even() {
    let rows = spring_and_damper(1000.0, 0..6000);
    // A serial line is read every 16 ms; what has come by then is written down at once.
    let mut bursts = String::new();
    for (row, line) in rows.lines().enumerate() {
        let arrived = row.div_ceil(16) * 16 + (row + 15) % 16 / 8;
        match line.split_once(',') {
            Some((_, rest)) if row > 0 => {
                bursts += &format!("{:.3},{rest}\n", 1e-3 * arrived as f64);
            }
            _ => bursts += &format!("{line}\n"),
        }
    }
    finds_spring_and_damper(
        &[("log.csv", bursts)],
        "the times at which rows arrived, so the rows are taken as even, at 1000 Hz",
        "sample_rate_hz = 1000.0   # guessed",
    );
}

#[test]
fn a_slow_log_of_few_rows_counts_milliseconds() {
    let rows = spring_and_damper(1000.0, 0..600);
    let slow = rows.lines().enumerate().map(|(row, line)| {
        let (_, rest) = line.split_once(',').unwrap();
        match row {
            0 => format!("t,{rest}\n"),
            row => format!("{},{rest}\n", 100 * row),
        }
    });
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("log.csv"), slow.collect::<String>()).unwrap();
    let said = succeed(folder.path(), &["init", "--yes", "log.csv"]);
    assert!(said.contains("counts ms, which makes 10 Hz"), "{said}");
}

#[test]
fn a_first_column_that_rises_evenly_is_the_time_unless_its_name_says_otherwise() {
    let rows = spring_and_damper(1000.0, 0..2000);
    let named = |name: &str| rows.replacen("time_s", name, 1);
    let folder = TempDir::new().unwrap();
    let drafts = |name: &str| {
        fs::write(folder.path().join("log.csv"), named(name)).unwrap();
        let _ = fs::remove_file(folder.path().join("study.toml"));
        run(folder.path(), &["init", "--yes", "log.csv"])
    };
    assert!(drafts("Channel name").status.success());
    let refused = drafts("travel");
    let said = String::from_utf8(refused.stderr).unwrap();
    assert_eq!(refused.status.code(), Some(3), "{said}");
    assert!(said.contains("(rising in every row: \"travel\")"), "{said}");
}

#[test]
fn a_draft_for_a_log_with_many_gaps_brings_it_to_an_even_rate_and_says_so() {
    let rows = (0..6000).filter(|row| row * row % 997 > 20);
    drafted(&[("log.csv", spring_and_damper(1000.0, rows))], "1000");
}

#[test]
fn a_draft_for_logs_of_two_rates_brings_them_to_the_slower_one() {
    let logs = [
        ("fast.csv", spring_and_damper(1000.0, 0..6000)),
        ("slow.csv", spring_and_damper(500.0, 0..2400)),
    ];
    drafted(&logs, "500");
    let folder = TempDir::new().unwrap();
    for (name, log) in &logs {
        fs::write(folder.path().join(name), log).unwrap();
    }
    let output = run(folder.path(), "init fast.csv slow.csv --yes --rate 1000");
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success());
    says(&said, &["slow.csv runs at 500 Hz and fast.csv at 1000 Hz"]);
    assert!(!folder.path().join("study.toml").exists());
}

#[test]
fn a_log_that_is_less_dense_for_a_while_is_brought_to_the_rate_that_it_has_everywhere() {
    let rows = (0..3000).filter(|row| row % 2 == 0).chain(3000..6000);
    drafted(&[("log.csv", spring_and_damper(1000.0, rows))], "500");
    // Not so where that is a moment.
    let rows = (0..300).filter(|row| row % 2 == 0).chain(300..6000);
    drafted(&[("log.csv", spring_and_damper(1000.0, rows))], "1000");
}

#[test]
fn a_log_whose_last_row_stands_first_is_told() {
    let log = spring_and_damper(1000.0, 0..600);
    let mut lines: Vec<&str> = log.lines().collect();
    lines[1..].reverse();
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("log.csv"), lines.join("\n")).unwrap();
    let output = run(folder.path(), &["init", "--yes", "log.csv"]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("so turn the rows round"), "{said}");
}

/// A row for every message, as recorders of robots write them, and a fast force beside a slow
/// position.
#[test]
fn channels_with_times_of_their_own_are_brought_to_the_rate_of_the_slowest() {
    let log = spring_and_damper(1000.0, 0..12_000);
    let cells = |row: &str| -> Vec<String> { row.split(',').map(Into::into).collect() };
    let with = |keep: fn(usize) -> [bool; 2]| -> String {
        let rows = log.lines().enumerate().filter_map(|(row, line)| {
            let [x, force] = if row == 0 { [true; 2] } else { keep(row) };
            let mut cells = cells(line);
            cells[1] = if x { cells[1].clone() } else { String::new() };
            cells[2] = if force {
                cells[2].clone()
            } else {
                String::new()
            };
            (x || force).then(|| cells.join(",") + "\n")
        });
        rows.collect()
    };
    let messages = with(|row| [row % 5 == 1, row % 4 == 2]);
    let slow_position = with(|row| [row % 4 == 1, true]);
    for (log, rate) in [(messages, "200"), (slow_position, "250")] {
        finds_spring_and_damper(
            &[("log.csv", log)],
            &format!("interpolated to {rate} Hz, the rate of the slowest"),
            &format!("time = {{ column = \"time_s\", resample_hz = {rate} }}   # guessed"),
        );
    }
}
