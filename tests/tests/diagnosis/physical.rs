//! A physical model on the simulated rig, whose truth is known: its values, its intervals, and its
//! way to the device.

use jointwatch::fit::identify;
use jointwatch::model::Evaluator;
use jointwatch::study::Study;
use jointwatch_tests::coverage::{Coverage, report};
use jointwatch_tests::program::{json, succeed};
use jointwatch_tests::story::story;
use serde_json::Value;

#[test]
fn every_parameter_of_the_clean_default_rig_is_found() {
    let coverage = Coverage::of(0..1, None).unwrap();
    println!("{}", report(&coverage));
    assert_eq!(coverage.parameters.len(), 12);
    for parameter in &coverage.parameters {
        assert!(parameter.worst < 0.01, "{parameter:?}");
    }
}

#[test]
fn intervals_cover_the_truth_of_noisy_rigs() {
    // `--bin coverage -- --seeds 100` is the full campaign; docs/notebook/fits.md has its table.
    let coverage = Coverage::of(0..12, Some(60.0)).unwrap();
    println!("{}", report(&coverage));
    assert!(coverage.share() >= 0.85, "{}", coverage.share());
    for parameter in &coverage.parameters {
        assert!(parameter.worst < 0.01, "{parameter:?}");
        // An interval that covers everything says nothing.
        assert!(parameter.half_width < 0.01, "{parameter:?}");
    }
}

#[test]
fn point_by_point_is_the_whole_record() {
    let study = Study::read(&story().join("rig")).unwrap();
    let model = identify::physical(&study).unwrap().model;
    let prepared = identify::Prepared::new(&study).unwrap();
    for motion in &prepared.motions {
        let states: Vec<&[f64]> = motion.states.iter().map(Vec::as_slice).collect();
        let whole = model.predict(&states).unwrap();
        let mut evaluator = Evaluator::new(&model).unwrap();
        for row in 0..motion.rows() {
            let state = [0, 1, 2, 3].map(|input| states[input][row]);
            let point = evaluator.force_at(&state);
            for axis in 0..2 {
                let scale = model.fits[axis].training_force_rms;
                let off = (point[axis] - whole[axis][row]).abs();
                assert!(off <= 1e-12 * scale, "row {row}, axis {axis}: {off:e}");
            }
            evaluator.advance(&state, 1.0 / motion.sample_rate_hz);
        }
    }
}

/// Learns this kind of model from the story's rig and takes it through every command.
fn goes_all_the_way(kind: &str, most_nmse_percent: f64) {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let study = story().join("rig");
    let study = study.to_str().unwrap();
    let mut identify = vec!["identify", study, "-o", "model.json", "--model"];
    identify.extend(kind.split(' '));
    succeed(folder, &identify);
    let exported = json(folder, "export model.json -o model.bin");
    for axis in exported["axes"].as_array().unwrap() {
        let [seen, bound] = ["largest_error", "error_bound"].map(|key| axis[key].as_f64().unwrap());
        assert!(seen > 0.0 && seen <= bound, "{axis}");
    }
    let compared = json(folder, &["compare", study, "model.json"]);
    let replayed = json(folder, &["replay", "model.bin", study]);
    let records = replayed["records"].as_array().unwrap();
    assert!(
        records
            .iter()
            .all(|r| r["outputs"].as_u64().unwrap() > 1000)
    );
    for axis in compared["validation"].as_array().unwrap() {
        let name = axis["axis"].as_str().unwrap();
        let nmse = axis["nmse_percent"].as_f64().unwrap();
        let device = &records.last().unwrap()["axes"][name]["nmse_percent"];
        println!("{kind} {name}: validation NMSE {nmse:.4} %, replayed {device} %");
        assert!(nmse < most_nmse_percent, "{axis}");
        // The device holds a state that leaves the training range at its edge and leaves such rows
        // out.
        let device = device.as_f64().unwrap();
        assert!(device < 2.0 * most_nmse_percent, "{name}: {device} %");
    }
    let responded = json(folder, &["respond", study, "model.json"]);
    assert!(!responded["records"].as_array().unwrap().is_empty());
}

#[test]
fn a_physical_model_goes_all_the_way() {
    goes_all_the_way("physical", 0.1);
}

#[test]
fn a_network_goes_all_the_way() {
    goes_all_the_way("network --neurons 20 --restarts 1 --seed 1", 1.0);
}

#[test]
fn inspect_shows_a_blobs_effects_in_si() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let study = story().join("rig");
    let study = study.to_str().unwrap();
    let learnt = json(folder, &["identify", study, "--model", "physical"]);
    succeed(folder, &["export", "model.json", "-o", "model.bin"]);
    let said = succeed(folder, &["inspect", "model.bin"]);
    for expected in [
        "base none",
        "stiffness@x",
        "N·m·s/rad",
        "clearance_coupling",
    ] {
        assert!(said.contains(expected), "no {expected} in {said}");
    }
    let blob = json(folder, &["inspect", "model.bin"]);
    assert_eq!(blob["base"], "none");
    let effects = |json: &Value| json["effects"].as_array().unwrap().clone();
    let (wanted, seen) = (effects(&learnt), effects(&blob));
    assert_eq!(wanted.len(), seen.len());
    for (wanted, seen) in wanted.iter().zip(&seen) {
        assert_eq!(
            (&wanted["effect"], &wanted["axis"]),
            (&seen["effect"], &seen["axis"])
        );
        let parameters = |effect: &Value| effect["parameters"].as_array().unwrap().clone();
        for (wanted, seen) in parameters(wanted).iter().zip(&parameters(seen)) {
            assert_eq!(wanted["unit"], seen["unit"]);
            let [wanted, seen] = [wanted, seen].map(|p| p["value"].as_f64().unwrap());
            assert!((seen / wanted - 1.0).abs() < 1e-6, "{seen} for {wanted}");
        }
    }
}
