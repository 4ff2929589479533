//! A study whose instruments are wrong: the faults are found, put right, and carried to the device's integers.

use jointwatch::sim::{SimulationOptions, simulate};
use jointwatch::study::Study;
use jointwatch::{compare, export, identify, model_file::ModelFile, replay};

const SEED: u64 = 4;
/// The force channel of x is late by three samples of 0.5 ms, reads 4 % too much, and hears the torque.
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

fn learnt(study: &Study, terms: &[&str]) -> ModelFile {
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
    println!("seed {SEED}");
    let options = SimulationOptions {
        seed: SEED,
        ..SimulationOptions::default()
    };
    let right = simulate(&options).unwrap().study;
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
    let device = jointwatch_shared::blob::decode(&blob.blob).unwrap();
    let set_up = replay::SetUp::new(&wrong, &device).unwrap();
    for record in &wrong.records {
        let replayed = set_up.replay(&wrong, record, &device).unwrap().summary;
        let compared = comparison
            .records
            .iter()
            .find(|r| r.file == record.file)
            .unwrap();
        for (axis, figures) in &compared.axes {
            if figures.rests {
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
