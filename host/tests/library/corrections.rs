//! A study whose instruments are wrong: the faults are found, put right, and carried to the
//! device's integers.

use crate::effects_recovered::rms;
use jointwatch::assess::compare;
use jointwatch::device::{export, replay};
use jointwatch::diagnose::diagnose;
use jointwatch::fit::identify;
use jointwatch::model::file::ModelFile;
use jointwatch::simulate::{SimulationOptions, simulate};
use jointwatch::study::Study;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

const SEED: u64 = 4;
/// The force channel of x is late by three samples of 0.5 ms, reads 4 % too much, and hears the
/// torque.
const LATE_SAMPLES: usize = 3;
const EXCESS: f64 = 0.04;
const CROSS: f64 = 5.0;
/// The inertia of phi is stated this part of it too small.
const INERTIA_SHARE: f64 = 0.1;

const JOINT: [&str; 7] = [
    "stiffness@x",
    "viscous@x",
    "clearance@x",
    "stiffness@phi",
    "viscous@phi",
    "clearance@phi",
    "clearance_coupling",
];
const FAULTS: [&str; 4] = [
    "time_delay@x",
    "force_gain@x",
    "crosstalk@x",
    "inertia_error@phi",
];

/// The study through right instruments.
fn right() -> Study {
    println!("seed {SEED}");
    let options = SimulationOptions {
        seed: SEED,
        ..SimulationOptions::default()
    };
    simulate(&options).unwrap().study
}

/// The study through wrong instruments.
fn damaged(study: &Study) -> Study {
    let mut study = study.clone();
    for record in &mut study.records {
        let torque = record.axes[1].force.clone();
        let force = &mut record.axes[0].force;
        let right = force.clone();
        for (row, value) in force.iter_mut().enumerate() {
            let seen = row.saturating_sub(LATE_SAMPLES);
            *value = (right[seen] + CROSS * torque[seen]) / (1.0 - EXCESS);
        }
    }
    if let Some(inertia) = &mut study.axes[1].inertia {
        *inertia *= 1.0 - INERTIA_SHARE;
    }
    study
}

/// Whether a model's corrections leave of wrong records less than so many newtons, and an error as
/// of a model of the right ones.
#[track_caller]
fn puts_right(with: &ModelFile, [wrong, right]: [&Study; 2], newtons: f64) {
    let corrected = with.corrected(wrong).unwrap();
    for (seen, truth) in corrected.records.iter().zip(&right.records) {
        let pairs = seen.axes[0].force.iter().zip(&truth.axes[0].force);
        let off = pairs.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        assert!(off < newtons, "{}: {off} N", truth.file);
    }
    let error = |model: &ModelFile| model.validation[0].relative_error;
    assert!(error(with) < 1.1 * error(&learnt(right, &JOINT)));
}

pub(crate) fn learnt(study: &Study, terms: &[&str]) -> ModelFile {
    let mut study = study.clone();
    study.base_terms = terms.iter().map(|t| (*t).to_owned()).collect();
    identify::physical(&study).unwrap().model
}

fn value(model: &ModelFile, effect: &str) -> f64 {
    let term = model.effects.iter().find(|e| e.name() == effect).unwrap();
    term.parameters[0].value
}

#[test]
fn wrong_instruments_are_found_and_put_right_up_to_the_device() {
    let right = right();
    let wrong = damaged(&right);
    let without = learnt(&wrong, &JOINT);
    let with = learnt(&wrong, &[&JOINT[..], &FAULTS[..]].concat());
    let best = learnt(&right, &JOINT);

    let inertia = right.axes[1].inertia.unwrap();
    let delay_s = LATE_SAMPLES as f64 / right.sample_rate_hz;
    for (effect, truth, tolerance) in [
        ("time_delay@x", delay_s, 0.05),
        ("force_gain@x", EXCESS, 0.2),
        ("crosstalk@x", CROSS, 0.1),
        ("inertia_error@phi", INERTIA_SHARE * inertia, 0.05),
    ] {
        let found = value(&with, effect);
        println!("{effect}: {found:.4e} for {truth:.4e}");
        assert!(
            (found / truth - 1.0).abs() < tolerance,
            "{effect}: {found:e} for {truth:e}"
        );
    }
    assert!((with.axes[1].inertia / inertia - 1.0).abs() < 0.01);

    for axis in 0..2 {
        let error = |model: &ModelFile| model.validation[axis].relative_error;
        println!(
            "axis {axis}: {:.4} without, {:.4} with, {:.4} at best",
            error(&without),
            error(&with),
            error(&best)
        );
        assert!(error(&with) < 2.0 * error(&best) && error(&with) < 0.8 * error(&without));
    }
    let comparison = compare::compare(&wrong, &with).unwrap();
    assert_eq!(comparison.validation, with.validation);
    let said = compare::in_words(&comparison, &with);
    assert!(
        said.contains("the force channel of x is 1.") && said.contains("ms late"),
        "{said}"
    );

    let blob = export::export(&with, Some(1e-3)).unwrap();
    let device = jointwatch_shared::wire::blob::decode(&blob.blob).unwrap();
    let set_up = replay::SetUp::new(&wrong, &device).unwrap();
    for record in &wrong.records {
        let replayed = set_up.replay(&wrong, record, &device).unwrap().summary;
        let compared = comparison
            .records
            .iter()
            .find(|r| r.file == record.file)
            .unwrap();
        for (axis, figures) in &compared.axes {
            if figures.at_rest {
                continue;
            }
            let device = &replayed.axes[axis];
            println!(
                "{} {axis}: {:.5} on the host, {:.5} on the device",
                record.file,
                figures.rms_error,
                device.relative_error * device.rms_force
            );
            assert!((device.rms_force / figures.rms_force - 1.0).abs() < 0.01);
            let (host, device) = (figures.relative_error, device.relative_error);
            assert!((device / host - 1.0).abs() < 0.05, "{device} for {host}");
        }
    }
}

#[test]
fn what_cannot_be_corrected_is_refused() {
    let study = simulate(&SimulationOptions::default()).unwrap().study;
    let refused = |study: &Study, terms: &[&str]| {
        let mut study = study.clone();
        study.base_terms = terms.iter().map(|t| (*t).to_owned()).collect();
        identify::physical(&study).err().map(|e| e.sentence)
    };
    let mut unstated = study.clone();
    unstated.axes[0].inertia = None;
    let sentence = refused(&unstated, &["stiffness@x", "inertia_error@x"]).unwrap();
    assert!(sentence.contains("found twice"), "{sentence}");

    let drifting = learnt(
        &study,
        &["stiffness@x", "stiffness@phi", "stiffness_drift@x"],
    );
    let Err(refusal) = export::export(&drifting, None) else {
        panic!("a drift went to the device");
    };
    assert!(
        refusal.sentence.contains("stiffness_drift") && refusal.sentence.contains("when that was"),
        "{refusal}"
    );
}

/// Mains hum in the force channel of x: a part of the largest force, another phase in every record.
const HUM_HZ: f64 = 50.03;

fn humming(study: &Study, size: f64) -> Study {
    let mut study = study.clone();
    let rate = study.sample_rate_hz;
    for (index, record) in study.records.iter_mut().enumerate() {
        for (row, force) in record.axes[0].force.iter_mut().enumerate() {
            let turns = HUM_HZ * row as f64 / rate + 0.37 * index as f64;
            *force += size * (std::f64::consts::TAU * turns).sin();
        }
    }
    study
}

#[test]
fn hum_is_found_and_taken_out_of_every_record_without_real_force() {
    let right = right();
    let size = 0.1 * rms(&right.records[0].axes[0].force);
    let wrong = humming(&right, size);
    let with = learnt(&wrong, &[&JOINT[..], &["mains_hum@x"]].concat());
    let best = learnt(&right, &JOINT);

    let hum = with
        .effects
        .iter()
        .find(|e| e.name() == "mains_hum@x")
        .unwrap();
    let [amplitude, frequency] = [0, 1].map(|at| hum.parameters[at].value);
    println!("{amplitude:.4e} for {size:.4e} at {frequency:.4} Hz");
    assert!((amplitude / size - 1.0).abs() < 0.05);
    assert!((frequency - HUM_HZ).abs() < 0.01);
    assert!(hum.parameters.iter().all(|p| {
        p.interval
            .is_some_and(|[low, high]| low < p.value && p.value < high)
    }));

    // Every record, validation among them, is what it was before the hum came in.
    let corrected = with.corrected(&wrong).unwrap();
    for (seen, truth) in corrected.records.iter().zip(&right.records) {
        let off: Vec<f64> = seen.axes[0]
            .force
            .iter()
            .zip(&truth.axes[0].force)
            .map(|(a, b)| a - b)
            .collect();
        println!("{}: off by {:.4} of the hum", truth.file, rms(&off) / size);
        assert!(rms(&off) < 0.1 * size, "{}", truth.file);
        assert_eq!(seen.axes[1], truth.axes[1]);
    }
    let error = |model: &ModelFile| model.validation[0].relative_error;
    assert!(
        error(&with) < 1.1 * error(&best),
        "{} for {}",
        error(&with),
        error(&best)
    );

    // The device is told of frequency and size, and follows it: its error is that of the host.
    let model = export::export(&with, None).unwrap().model;
    let told = model.corrections()[0].hum;
    assert_eq!((told.amplitude, told.frequency_hz), (amplitude, frequency));
    let set_up = replay::SetUp::new(&wrong, &model).unwrap();
    let figures = compare::compare(&wrong, &with).unwrap();
    for (record, of_host) in wrong.records.iter().zip(&figures.records) {
        let device = set_up.replay(&wrong, record, &model).unwrap().summary;
        let (host, device) = (&of_host.axes["x"], &device.axes["x"]);
        if host.at_rest {
            continue;
        }
        println!(
            "{}: {:.5} on the host, {:.5} on the device",
            record.file, host.relative_error, device.relative_error
        );
        assert!(device.relative_error < 1.2 * host.relative_error + 0.002);
    }
    let block = jointwatch::device::rig_block::of_study(&wrong, &model).unwrap();
    let said = jointwatch::device::rig_block::in_words(&block);
    assert!(said.contains("axis 0 hums at 50.0"), "{said}");
    let json = jointwatch::device::rig_block::as_json(&block);
    assert_eq!(json["axes"][0]["hum"]["amplitude"], amplitude);
    assert!(json["axes"][1]["hum"].is_null());
}

#[test]
fn a_wrong_gain_is_that_of_the_channel_and_not_of_what_a_ground_spring_leaves() {
    println!("seed {SEED}");
    let options = SimulationOptions {
        seed: SEED,
        axes: 1,
        ..SimulationOptions::default()
    };
    let free = simulate(&options).unwrap().study;
    let terms = ["stiffness@x", "viscous@x", "clearance@x", "force_gain@x"];
    let [without_spring, with_spring] = [0.0, 1.0].map(|share| {
        let mut study = free.clone();
        // A spring to ground that takes as much force as the drive gives.
        let body = |study: &Study| study.records[0].axes[0].body_position.clone().unwrap();
        let stiffness = share * rms(&free.records[0].axes[0].force) / rms(&body(&free));
        study.axes[0].ground_stiffness = stiffness;
        for record in &mut study.records {
            let logged = &mut record.axes[0];
            let body = logged.body_position.clone().unwrap();
            for (force, b) in logged.force.iter_mut().zip(body) {
                *force = (*force + stiffness * b) / (1.0 - EXCESS);
            }
        }
        learnt(&study, &terms)
    });
    for model in [&without_spring, &with_spring] {
        let (gain, error) = (
            value(model, "force_gain@x"),
            model.validation[0].relative_error,
        );
        println!("gain {gain:.5} for {EXCESS}, error {error:.5}");
        assert!((gain / EXCESS - 1.0).abs() < 0.2, "{gain}");
        assert!(
            error < 1.1 * without_spring.validation[0].relative_error,
            "{error}"
        );
    }
}

#[test]
fn a_zero_that_differs_from_record_to_record_is_named_and_taken_out_of_every_record() {
    let right = right();
    let mut wrong = right.clone();
    let zeros = [0.0, 3.0, -2.0, 5.0];
    for (record, zero) in wrong.records.iter_mut().zip(zeros) {
        let force = record.axes[0].force.iter_mut();
        force.for_each(|f| *f += zero);
    }
    let model = learnt(&wrong, &JOINT);
    let diagnosis = diagnose(&wrong, &model).unwrap();
    let found: Vec<String> = diagnosis
        .found
        .iter()
        .map(|f| format!("{}@{}", f.effect, f.axis))
        .collect();
    assert_eq!(found, ["force_zero@x"]);
    let probabilities = &diagnosis.probabilities;
    assert!(probabilities["force_zero@x"] > 0.95 && probabilities["none"] < 0.05);
    let first = &diagnosis.ranked[0];
    assert_eq!(
        (first.effect.as_str(), first.axis.as_str()),
        ("force_zero", "x")
    );
    assert!(first.error_drop_interval[0] > 1.5, "{first:?}");
    let truth = (zeros[..3].iter().map(|z| z * z).sum::<f64>() / 3.0).sqrt();
    let [low, high] = first.parameters[0].interval.unwrap();
    assert!(low < truth && truth < high, "{low} to {high}");

    let with = learnt(&wrong, &[&JOINT[..], &["force_zero@x"]].concat());
    puts_right(&with, [&wrong, &right], 0.05);
    // The root mean square over the three training records.
    let mean_square = zeros[..3].iter().map(|z| z * z).sum::<f64>() / 3.0;
    assert!((value(&with, "force_zero@x") - mean_square.sqrt()).abs() < 0.05);

    let Err(refusal) = export::export(&with, None) else {
        panic!("a zero of each record went to the device");
    };
    assert!(refusal.sentence.contains("tare"), "{refusal}");
    let mut one = wrong.clone();
    one.records.truncate(1);
    one.base_terms = vec![
        "stiffness@x".into(),
        "stiffness@phi".into(),
        "force_zero@x".into(),
    ];
    let Err(refusal) = identify::physical(&one) else {
        panic!("one record has no zeros that differ");
    };
    assert!(refusal.sentence.contains("has one record"), "{refusal}");
}

/// The study with a zero of the force channel of x that rises along every record, by another amount
/// in each, N.
fn drifting(study: &Study, rises: &[f64]) -> Study {
    let mut study = study.clone();
    for (record, rise) in study.records.iter_mut().zip(rises) {
        let force = &mut record.axes[0].force;
        let rows = force.len() as f64;
        let line = force.iter_mut().enumerate();
        line.for_each(|(row, f)| *f += rise * (row as f64 / rows - 0.3));
    }
    study
}

#[test]
fn a_zero_that_drifts_is_named_and_taken_out_of_every_record() {
    let right = right();
    let rises = [4.0, -7.0, 3.0, 6.0];
    let wrong = drifting(&right, &rises);
    let found = |study: &Study| -> Vec<String> {
        let diagnosis = diagnose(study, &learnt(study, &JOINT)).unwrap();
        println!("{:?}", diagnosis.notes);
        let found = diagnosis.found.iter();
        found.map(|f| format!("{}@{}", f.effect, f.axis)).collect()
    };
    assert_eq!(found(&wrong), ["force_drift@x"]);
    // Of one record as well, where no zero can differ.
    let mut one = wrong.clone();
    one.records.truncate(1);
    assert_eq!(found(&one), ["force_drift@x"]);

    let with = learnt(&wrong, &[&JOINT[..], &["force_drift@x"]].concat());
    puts_right(&with, [&wrong, &right], 0.1);

    // Both sizes, root mean square over the three training records, within their intervals.
    let seconds = right
        .records
        .iter()
        .map(|r| r.rows as f64 / right.sample_rate_hz);
    let slopes: Vec<f64> = rises
        .iter()
        .zip(seconds)
        .map(|(rise, s)| rise / s)
        .collect();
    let term = with.effects.iter().find(|e| e.name() == "force_drift@x");
    let [zero, drift] = [0, 1].map(|at| &term.unwrap().parameters[at]);
    for (parameter, truth) in [(zero, 0.3 * rms(&rises[..3])), (drift, rms(&slopes[..3]))] {
        println!("{} {:.5} for {truth:.5}", parameter.name, parameter.value);
        assert!(
            (parameter.value / truth - 1.0).abs() < 0.03,
            "{}",
            parameter.name
        );
    }
    // The zero is that of the first row behind the filters.
    let [low, high] = drift.interval.unwrap();
    let truth = rms(&slopes[..3]);
    assert!(
        low < truth && truth < high && high - low < 0.2 * truth,
        "{low} to {high}"
    );
    let said = jointwatch::model::corrections::in_words(&with.effects);
    assert!(said.iter().any(|s| s.contains("each second")), "{said:?}");
    assert!(export::export(&with, None).is_err());
}

/// A joint in a testing machine, as CSV below `folder`: a spring beside a Maxwell element that
/// forgets in a fifth of a record, and slow motion beside quick.
fn relaxing(folder: &Path) -> Study {
    const RATE: f64 = 200.0;
    const TIME_CONSTANT_S: f64 = 4.0;
    let mut text = "time = \"t\"\naxis = [{ name = \"x\", kind = \"translation\", displacement = \"x\", force = \"f\", inertia = 0 }]\n\
                    base = { terms = [\"stiffness@x\", \"viscous@x\"] }\n"
        .to_owned();
    for record in 0..4 {
        let (mut log, mut held, mut last) = (String::from("t,x,f\n"), 0.0, 0.0);
        for row in 0..4000 {
            let t = f64::from(row) / RATE;
            let slow = (0.5 * t + f64::from(record)).sin() - f64::from(record).sin();
            let x = 1e-3 * (slow + 0.4 * ((9.0 + f64::from(record)) * t).sin());
            held = held * (-1.0 / (RATE * TIME_CONSTANT_S)).exp() + 400.0 * (x - last);
            last = x;
            let noise = (f64::from(row) * 12.9898 + f64::from(record)).sin() * 43758.5453 % 1.0;
            let f = 1000.0 * x + held + 0.01 * noise;
            writeln!(log, "{t:.3},{x:.9},{f:.6}").unwrap();
        }
        fs::write(folder.join(format!("r{record}.csv")), log).unwrap();
        let role = if record == 3 { "validate" } else { "train" };
        text += &format!("[[record]]\nfile = \"r{record}.csv\"\nrole = \"{role}\"\n");
    }
    fs::write(folder.join("study.toml"), text).unwrap();
    Study::read(&folder.join("study.toml")).unwrap()
}

#[test]
fn a_slow_force_of_the_joint_is_no_drift_of_the_instrument() {
    let folder = tempfile::tempdir().unwrap();
    let study = relaxing(folder.path());
    let model = identify::physical(&study).unwrap().model;
    let diagnosis = diagnose(&study, &model).unwrap();
    let found: Vec<&str> = diagnosis.found.iter().map(|f| f.effect.as_str()).collect();
    println!("{found:?}, {:?}", diagnosis.notes);
    assert!(found.contains(&"maxwell"), "{found:?}");
    assert!(!found.contains(&"force_drift"), "{found:?}");
}
