//! A line that damages bits, an image that is none, and the command line.

use super::subject::{counters, polynomial, run, same_bits, validation};
use jointwatch::emulate::bench::Scenario;
use jointwatch::emulate::size;
use jointwatch_tests::program::{fail, json};
use jointwatch_tests::story::story;
use std::path::Path;

#[test]
fn noise_on_the_line_destroys_frames_and_nothing_else() {
    let device = polynomial();
    for (bit_error_rate, arrive) in [(1e-3, 0.2), (1e-2, 1e-4), (1e-1, 0.0)] {
        let run = run(
            &device,
            Scenario {
                bit_error_rate,
                seed: 31,
                ..Scenario::default()
            },
        );
        let c = &run.comparison;
        assert_eq!(
            (c.different_bits, c.wrong_counts),
            (0, 0),
            "{bit_error_rate}: {c:?}"
        );
        assert!(c.samples as f64 >= arrive * run.instants as f64, "{c:?}");
        println!("{bit_error_rate}: {c:?} {:?}", run.tally);
    }
}

#[test]
fn samples_that_come_late_are_counted_and_never_hidden() {
    let device = polynomial();
    let run = run(
        &device,
        Scenario {
            late: vec![(700, 3), (701, 1), (2000, 200)],
            ..Scenario::default()
        },
    );
    same_bits(&run);
    assert_eq!(counters(&run).missed_deadlines, 204);
}

#[test]
fn an_image_that_is_missing_or_no_image_is_said_in_a_sentence() {
    let device = polynomial();
    let slot = device.slot().unwrap().to_bytes();
    let absent = Path::new("/nowhere/jointwatch-link");
    let why = device
        .run(absent, &slot, validation(), &[], Scenario::default())
        .map(|_| ())
        .unwrap_err();
    assert!(why.sentence.contains("/nowhere/jointwatch-link"), "{why}");
    let text = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml"));
    let why = device.run(text, &slot, validation(), &[], Scenario::default());
    assert!(why.is_err());
    assert!(size::of(text).is_err());
}

#[test]
fn the_program_says_what_agrees_and_refuses_bad_input_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let blob = story().join("model.bin");
    let study = story().join("rig/study.toml");
    let [blob, study] = [&blob, &study].map(|path| path.to_str().unwrap());
    let arguments = ["emulate", blob, study, "--record", "valid.csv"];
    let said = json(folder.path(), &arguments);
    assert_eq!(said["records"][0]["agrees"], true, "{said}");
    assert_eq!(said["records"][0]["comparison"]["different_bits"], 0);

    let sentence = fail(
        folder.path(),
        &["emulate", blob, study, "--record", "x.csv"],
        2,
    );
    assert!(sentence.contains("x.csv"), "{sentence}");
    for command in ["emulate", "replay"] {
        let sentence = fail(folder.path(), &[command, blob, study, "--rig", "no.bin"], 3);
        assert!(sentence.contains("no.bin"), "{sentence}");
        let sentence = fail(folder.path(), &[command, blob, study, "--rig", blob], 3);
        assert!(sentence.contains("model.bin"), "{sentence}");
    }
}
