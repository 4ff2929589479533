//! Measured joints that change: part of the restoring force that was measured is taken from the log
//! of the force, or put on it.
//!
//! Where the measurements are at hand; each test says so when they are not.

use jointwatch::device::export::export;
use jointwatch::device::monitor_limits::{Purpose, limits};
use jointwatch::device::replay::SetUp;
use jointwatch::fit::identify;
use jointwatch::signal::motion::motions;
use jointwatch::study::{Record, Role, Study};
use jointwatch_shared::monitor::{Monitor, MonitorState, State, Verdict};
use jointwatch_shared::wire::blob;
use jointwatch_tests::monitor::curves::Change;
use jointwatch_tests::monitor::false_alarms::WANTED_HOURS;
use jointwatch_tests::program::{measurements, study_with_logs};
use std::path::Path;

const PARTS: [f64; 7] = [-1.0, -0.9, -0.7, -0.5, -0.3, 0.5, 1.0];

/// The first alarm about each record that changes, in s after the change, and what was said.
fn alarms(folder: &Path, changes_at_s: f64) -> Vec<(f64, Option<(f64, Verdict)>)> {
    let study = Study::read(folder).unwrap();
    let file = identify::physical(&study).unwrap().model;
    let model = blob::decode(&export(&file, None).unwrap().blob).unwrap();
    let set_up = SetUp::new(&study, &model).unwrap();
    let purpose = Purpose {
        model_checksum: 0,
        false_alarm_hours: WANTED_HOURS,
        drift: 0.0,
    };
    println!("errors on validation: {:?}", file.validation);
    let limits = limits(&study, &set_up, &model, purpose).unwrap().limits;
    let monitor = Monitor::new(limits, &set_up.chain).unwrap();
    let (motions, axis) = (motions(&study, &file.filters).unwrap(), &file.axes[0]);
    let watched = |record: &Record| record.role == Role::Validate;
    let number = study.records.iter().position(watched).unwrap();
    let motion = &motions[number];
    let restoring = motion.restoring_force(0, axis.inertia, axis.restoring_force);
    let from = (changes_at_s * study.sample_rate_hz) as usize;
    let first_alarm = |part: f64| {
        let mut record = study.records[number].clone();
        let sign = axis.restoring_force.sign();
        for (row, value) in restoring.iter().enumerate() {
            if row + motion.first_row >= from {
                record.axes[0].force[row + motion.first_row] += sign * part * value;
            }
        }
        let mut state = MonitorState::default();
        let samples = set_up.samples(&record, &model).enumerate();
        let mut seen = samples.map(|(row, sample)| {
            let output = sample.output.as_ref();
            let verdict = monitor.update(&mut state, &sample.raw, output, &sample.faults);
            (row as f64 / study.sample_rate_hz - changes_at_s, verdict)
        });
        seen.find(|(_, verdict)| verdict.state == State::Alarm)
    };
    PARTS.map(|part| (part, first_alarm(part))).to_vec()
}

/// A loss of half and more is found within a second; a smaller change, and more force, where
/// `small_within_s` says so.
fn assert_found(what: &str, found: &[(f64, Option<(f64, Verdict)>)], small_within_s: Option<f64>) {
    for (part, alarm) in found {
        println!("{what}, {:+.0} %: {alarm:?}", 100.0 * part);
    }
    for (part, alarm) in found {
        let within_s = match (*part <= -0.5, small_within_s) {
            (true, _) => 1.0,
            (false, Some(within_s)) => within_s,
            (false, None) => continue,
        };
        let (time, verdict) = alarm.unwrap_or_else(|| panic!("{what}, {part}: not found"));
        let is_right = Change::SameMotion(*part).fits(verdict.cause);
        assert!(is_right, "{what}, {part}: {verdict:?}");
        assert!(
            (0.0..=within_s).contains(&time),
            "{what}, {part}: after {time} s"
        );
    }
}

#[test]
fn a_positioning_axis_whose_friction_changes_is_found() {
    let Some(data) = measurements("data/emps") else {
        return;
    };
    let logs = ["DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"];
    let study = include_str!("../../../docs/measured-axis.toml");
    let folder = study_with_logs(&data, &logs, study);
    // Its model is wrong by 5 %: a third of the force takes longer than with an exact one.
    assert_found("EMPS", &alarms(folder.path(), 10.0), Some(3.1));
}

#[test]
fn a_friction_damper_that_changes_is_found() {
    let Some(data) = measurements("data/brfd") else {
        return;
    };
    let logs = [
        "ds2_0.5Hz36lbtension1amplitude.json",
        "ds2_1Hz36lbtension1amplitude.json",
    ];
    // The longer record is the one that is watched.
    let study = include_str!("../../../docs/friction-damper.toml");
    let study = study
        .replace("\"train\"", "\"\"")
        .replace("\"validate\"", "\"train\"");
    let study = study.replace("\"\"", "\"validate\"");
    let base = r#"[base]
terms = ["bouc_wen_pinching@x", "viscous@x", "preload@x"]
"#;
    let folder = study_with_logs(&data, &logs, &format!("{study}\n{base}"));
    // Two seconds a cycle, 14 s of validation and an error of 11 %: a third of the force is not
    // found in the 6 s that are left.
    let found = alarms(folder.path(), 8.0);
    assert_found("friction damper", &found, None);
}
