//! Sums of records: the same bytes in any order and partition, and the models that they give beside
//! those of the records themselves.

mod selection;

use jointwatch::fit::identify::{self, from_sums};
use jointwatch::fit::polynomial::{Method, PolynomialOptions};
use jointwatch::fit::sums::{Part, Plan};
use jointwatch::study::further::Template;
use jointwatch::{MemoryLog, Model, Study};
use jointwatch_tests::program::{fail, read_json, says, succeed};
use jointwatch_tests::story::{copy_of_rig, story};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fs;
use std::path::Path;

const DESCRIPTION: &str = r#"
    name = "fleet"
    sample_rate_hz = 1000.0
    axis = [{ name = "x", kind = "translation", displacement = "d", force = "F", inertia = 0.0 }]
    record = [{ file = "pilot", role = "train" }]
    base = { terms = ["stiffness@x", "viscous@x", "cubic_hardening@x"] }
"#;

/// A record of a hardening spring with damping, and some noise in its force.
fn log(name: &str, rows: usize, size: f64, seed: u64) -> MemoryLog {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let lines: Vec<[f64; 3]> = (0..12)
        .map(|k| {
            let hz = 2.0 + 3.0 * f64::from(k) + rng.random_range(0.0..1.0);
            let phase = rng.random_range(0.0..std::f64::consts::TAU);
            [
                std::f64::consts::TAU * hz / 1000.0,
                phase,
                size * rng.random_range(1e-4..4e-4),
            ]
        })
        .collect();
    let of = |wave: &dyn Fn(&[f64; 3], f64) -> f64| -> Vec<f64> {
        (0..rows)
            .map(|row| lines.iter().map(|line| wave(line, row as f64)).sum())
            .collect()
    };
    let x = of(&|[w, p, a], row| a * (w * row + p).sin());
    let v = of(&|[w, p, a], row| 1000.0 * a * w * (w * row + p).cos());
    let force = x
        .iter()
        .zip(&v)
        .map(|(x, v)| 2e4 * x + 30.0 * v + 4e9 * x * x * x + rng.random_range(-0.2..0.2));
    let force = force.collect();
    MemoryLog {
        name: name.into(),
        columns: vec![("d".into(), x), ("F".into(), force)],
    }
}

/// The plan of a pilot record, and what reads further ones.
fn planned(size: f64) -> (Plan, Template) {
    let study = Study::of_memory("fleet", DESCRIPTION, &[log("pilot", 6000, size, 1)]).unwrap();
    let template = Template::of_text("fleet", DESCRIPTION.into(), 1000.0);
    (Plan::of(&study, &template).unwrap(), template)
}

fn part(plan: &Plan, template: &Template, log: &MemoryLog) -> Part {
    Part::of(plan, &template.read_memory(log).unwrap()).unwrap()
}

/// What is left when parts are merged in their order.
fn merged<'a>(parts: impl IntoIterator<Item = &'a Part>) -> Part {
    let mut parts = parts.into_iter();
    let mut whole = parts.next().unwrap().clone();
    parts.for_each(|part| whole.merge(part, "a part").unwrap());
    whole
}

#[test]
fn any_order_and_any_partition_gives_the_same_bytes() {
    let (plan, template) = planned(1.0);
    let seed = 20;
    println!("seed {seed}");
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let parts: Vec<Part> = (0..1000)
        .map(|k| {
            let rows = rng.random_range(500..800);
            part(
                &plan,
                &template,
                &log(
                    &format!("log {k}"),
                    rows,
                    rng.random_range(0.2..1.6),
                    100 + k,
                ),
            )
        })
        .collect();
    let whole = merged(&parts).to_bytes().unwrap();
    for groups in [1, 2, 5, 16, 1000] {
        let mut order: Vec<usize> = (0..parts.len()).collect();
        order.shuffle(&mut rng);
        let mut group: Vec<Vec<&Part>> = vec![Vec::new(); groups];
        for (place, k) in order.into_iter().enumerate() {
            // One each first, so that none stays empty; then anywhere.
            let at = if place < groups {
                place
            } else {
                rng.random_range(0..groups)
            };
            group[at].push(&parts[k]);
        }
        // Each group goes through its file, as on its way between machines.
        let files = group.into_iter().map(|g| merged(g).to_bytes().unwrap());
        let read: Vec<Part> = files
            .map(|f| Part::of_bytes("part.acc", &f).unwrap())
            .collect();
        assert!(
            merged(&read).to_bytes().unwrap() == whole,
            "{groups} groups"
        );
    }
}

#[test]
fn a_record_summed_again_gives_the_same_bytes_and_counts_once() {
    let (plan, template) = planned(1.0);
    let (one, other) = (log("one", 700, 0.5, 7), log("other", 900, 1.2, 8));
    let first = part(&plan, &template, &one);
    let retried = part(&plan, &template, &one);
    assert!(first.to_bytes().unwrap() == retried.to_bytes().unwrap());
    let mut whole = merged([&first, &part(&plan, &template, &other)]);
    let error = whole.merge(&retried, "again.acc").unwrap_err();
    assert_eq!(error.exit_code(), 3);
    for word in ["again.acc", "record one", "counted already"] {
        assert!(error.sentence.contains(word), "{error}");
    }
    // Under another name it is still the same record.
    let renamed = MemoryLog {
        name: "copy".into(),
        ..one
    };
    let error = whole
        .merge(&part(&plan, &template, &renamed), "copy.acc")
        .unwrap_err();
    assert!(error.sentence.contains("counted already"), "{error}");
}

#[test]
fn what_does_not_belong_together_does_not_merge() {
    let (plan, template) = planned(1.0);
    let base = part(&plan, &template, &log("one", 700, 0.5, 7));
    let refuse = |description: &str, size: f64| {
        let pilot = log("pilot", 6000, size, 1);
        let study = Study::of_memory("fleet", description, &[pilot]).unwrap();
        let template = Template::of_text("fleet", description.into(), 1000.0);
        let plan = Plan::of(&study, &template).unwrap();
        let other = part(&plan, &template, &log("two", 700, 0.5, 9));
        base.clone()
            .merge(&other, "other.acc")
            .unwrap_err()
            .sentence
    };
    let renamed = DESCRIPTION.replace("fleet", "yacht");
    assert!(refuse(&renamed, 1.0).contains("of another study than"));
    let newtons = DESCRIPTION.replace("force = \"F\"", "force = { column = \"F\", unit = \"kN\" }");
    assert!(refuse(&newtons, 1.0).contains("other things of the logs"));
    let sentence = refuse(DESCRIPTION, 1.5);
    // Another pilot may ask for another band as well.
    let how = [
        "normalised by other training records",
        "filtered in another band",
    ];
    assert!(how.iter().any(|how| sentence.contains(how)), "{sentence}");
    let banded = DESCRIPTION.replace("sample_rate_hz", "band_hz = 60.0\n    sample_rate_hz");
    let sentence = refuse(&banded, 1.0);
    says(&sentence, &["other.acc is of another study.toml"]);
    // Comments and layout say nothing of the logs.
    let commented = format!("# the same\n{DESCRIPTION}");
    let of_comment = Template::of_text("fleet", commented, 1000.0);
    assert_eq!(of_comment.sha256().unwrap(), template.sha256().unwrap());
}

#[test]
fn a_damaged_part_is_refused_in_one_sentence() {
    let (plan, template) = planned(1.0);
    let bytes = part(&plan, &template, &log("one", 700, 0.5, 7))
        .to_bytes()
        .unwrap();
    assert!(Part::of_bytes("a.acc", &bytes).is_ok());
    for length in [0, 7, 30, bytes.len() - 1] {
        let error = Part::of_bytes("a.acc", &bytes[..length]).unwrap_err();
        assert!(error.sentence.starts_with("a.acc: "), "{error}");
    }
    for place in (0..bytes.len()).step_by(97) {
        let mut flipped = bytes.clone();
        flipped[place] ^= 16;
        assert!(Part::of_bytes("a.acc", &flipped).is_err(), "byte {place}");
    }
}

/// The largest difference of two models' forces along the records of a study, as a part of the RMS
/// force.
fn apart(study: &Study, one: &Model, other: &Model) -> f64 {
    let prepared = identify::Prepared::new(study).unwrap();
    let mut most = 0.0_f64;
    for motion in &prepared.motions {
        let forces = [one, other].map(|m| m.predict_motion(motion).unwrap());
        for (axis, (a, b)) in forces[0].iter().zip(&forces[1]).enumerate() {
            let rms = one.fits[axis].training_force_rms;
            let off = a.iter().zip(b).map(|(a, b)| (a - b).abs() / rms);
            most = most.max(off.fold(0.0, f64::max));
        }
    }
    most
}

#[test]
fn sums_give_the_model_that_the_records_give() {
    let study = Study::read(&story().join("rig")).unwrap();
    let template = Template::of_study(&study).unwrap();
    let part = Part::of(&Plan::of(&study, &template).unwrap(), &study).unwrap();
    for method in [Method::Ridge, Method::LeastSquares, Method::Select] {
        let options = PolynomialOptions {
            method,
            ..PolynomialOptions::default()
        };
        let of_records = identify::polynomial(&study, &options, &|_| ())
            .unwrap()
            .model;
        let of_sums = from_sums::polynomial(&part, &options, Some(&study))
            .unwrap()
            .model;
        let apart = apart(&study, &of_records, &of_sums);
        println!("{method:?}: {apart:.1e} of the RMS force apart");
        assert!(apart < 1e-6, "{method:?}: {apart:e}");
        assert_eq!(of_records.fits[0].terms, of_sums.fits[0].terms);
        for (a, b) in of_records.fits.iter().zip(&of_sums.fits) {
            assert!((a.training_force_rms / b.training_force_rms - 1.0).abs() < 1e-9);
        }
        for (a, b) in of_records.validation.iter().zip(&of_sums.validation) {
            assert!((a.nmse_percent - b.nmse_percent).abs() < 1e-6);
        }
    }
}

#[test]
fn strengths_of_effects_are_those_of_the_records_and_their_intervals_hold_the_truth() {
    for inertia in [", inertia = 0.0", ""] {
        let description = DESCRIPTION.replace(", inertia = 0.0", inertia);
        let logs = [log("pilot", 6000, 1.0, 1)];
        let study = Study::of_memory("fleet", &description, &logs);
        let study = study.unwrap();
        let template = Template::of_text("fleet", description.clone(), 1000.0);
        let part = Part::of(&Plan::of(&study, &template).unwrap(), &study).unwrap();
        let of_sums = from_sums::physical(&part, Some(&study));
        let of_records = identify::physical(&study);
        let (of_records, of_sums) = match (of_records, of_sums) {
            (Ok(records), Ok(sums)) => (records.model, sums.model),
            // Nothing moves the mass here, so an inertia that is to be found may come out negative;
            // then both refuse it.
            (Err(_), Err(_)) if inertia.is_empty() => continue,
            other => panic!(
                "only one of both gave a model: {:?}",
                (other.0.is_ok(), other.1.is_ok())
            ),
        };
        for (term, (a, b)) in of_records.effects.iter().zip(&of_sums.effects).enumerate() {
            let (a, b) = (&a.parameters[0], &b.parameters[0]);
            println!("{} and {}, {:?}", a.value, b.value, b.interval);
            assert!(
                (a.value / b.value - 1.0).abs() < 1e-8,
                "{} and {}",
                a.value,
                b.value
            );
            let truth = [2e4, 30.0, 4e9][term];
            let [low, high] = b.interval.unwrap();
            // 95 of 100 intervals hold the truth; twice as wide, all but 1 of 10,000 do.
            let half = 0.5 * (high - low);
            assert!(
                (b.value - truth).abs() < 2.0 * half,
                "{truth} is not near {low} to {high}"
            );
            assert!(high - low < 0.05 * truth, "{low} to {high} says nothing");
        }
    }
}

#[test]
fn records_beyond_the_plan_count_as_if_the_study_listed_them() {
    let (plan, template) = planned(0.6);
    let logs = [
        log("pilot", 6000, 0.6, 1),
        log("wide", 6000, 1.5, 2),
        log("more", 5000, 1.3, 3),
    ];
    let parts: Vec<Part> = logs.iter().map(|log| part(&plan, &template, log)).collect();
    let whole = merged(&parts);
    assert!(whole.beyond() > 1.8, "{}", whole.beyond());
    let listed = DESCRIPTION.replace(
        "record = [{ file = \"pilot\", role = \"train\" }]",
        "record = [{ file = \"pilot\", role = \"train\" }, { file = \"wide\", role = \"train\" }, { file = \"more\", role = \"train\" }]",
    );
    // The same filters: the plan's bands, stated.
    let study = Study::of_memory("fleet", &listed, &logs).unwrap();
    let prepared = identify::Prepared::with_filters(&study, plan.filters.clone()).unwrap();
    let training = prepared.training(&study);
    let options = PolynomialOptions::default();
    let of_records = jointwatch::fit::polynomial::fit_polynomial(
        &study.axes,
        &training,
        &plan.filters.band,
        &options,
        &|_| (),
    )
    .unwrap();
    let of_sums = from_sums::polynomial(&whole, &options, None).unwrap().model;
    let jointwatch::model::file::Base::Polynomial(polynomial) = &of_sums.base else {
        panic!("no polynomial");
    };
    for (a, b) in of_records.polynomial.inputs.iter().zip(&polynomial.inputs) {
        assert!((a.half_range / b.half_range - 1.0).abs() < 1e-12);
    }
    let (a, b) = (
        &of_records.polynomial.coefficients[0],
        &polynomial.coefficients[0],
    );
    let largest = a.iter().fold(0.0, |most: f64, c| most.max(c.abs()));
    let apart = a
        .iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs() / largest)
        .fold(0.0, f64::max);
    println!("coefficients {apart:.1e} of the largest apart");
    assert!(apart < 1e-6, "{apart:e}");
}

#[test]
fn what_is_far_beyond_the_plan_is_refused() {
    let (plan, template) = planned(1.0);
    let study = template.read_memory(&log("huge", 700, 400.0, 5)).unwrap();
    let error = Part::of(&plan, &study).unwrap_err();
    for word in ["huge: ", "no room", "units"] {
        assert!(error.sentence.contains(word), "{error}");
    }
    let slow = Template::of_text("fleet", DESCRIPTION.replace("1000.0", "500.0"), 500.0);
    let study = slow.read_memory(&log("slow", 700, 1.0, 5)).unwrap();
    assert!(
        Part::of(&plan, &study)
            .unwrap_err()
            .sentence
            .contains("500 Hz")
    );
}

fn training_logs(rig: &Path) -> Vec<String> {
    let text = fs::read_to_string(rig.join("study.toml")).unwrap();
    let files = text
        .lines()
        .filter_map(|line| line.strip_prefix("file = \""));
    let files: Vec<String> = files
        .filter_map(|f| Some(f.split('"').next()?.to_owned()))
        .collect();
    let train = files.into_iter().filter(|f| f.starts_with("train"));
    train.map(|f| format!("rig/{f}")).collect()
}

#[test]
fn the_command_line_sums_merges_and_identifies() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let rig = copy_of_rig(here);
    let logs = training_logs(&rig);
    assert!(logs.len() >= 2, "{logs:?}");
    succeed(here, &["accumulate", "rig", "-o", "own.acc"]);
    let mut parts = vec!["merge".to_owned()];
    for (k, log) in logs.iter().enumerate() {
        let part = format!("{k}.acc");
        succeed(here, &["accumulate", "rig", log, "-o", &part]);
        parts.insert(1, part);
    }
    let words: Vec<&str> = parts.iter().map(String::as_str).collect();
    succeed(here, &[&words[..], &["-o", "all.acc"]].concat());
    // The study's own records, all at once, and one by one from the last to the first.
    assert!(fs::read(here.join("own.acc")).unwrap() == fs::read(here.join("all.acc")).unwrap());

    let identify = "identify rig --from all.acc -o a.json --model polynomial";
    let said = succeed(here, identify);
    says(&said, &["Sums of study", "Validation (other records)"]);
    let identify = "identify --from all.acc -o b.json --model polynomial";
    succeed(here, identify);
    succeed(here, "export b.json -o b.bin");
    let compared = succeed(here, &["compare", "rig", "b.json"]);
    assert!(compared.contains("Validation"), "{compared}");

    let refused = |words: &str, code| fail(here, words, code);
    let twice = refused("merge 0.acc 1.acc 0.acc", 3);
    says(&twice, &["0.acc", "counted already"]);
    let network = refused("identify --from all.acc --model network", 2);
    assert!(network.contains("network"), "{network}");
    let physical = refused("identify --from all.acc --model physical", 3);
    says(&physical, &["shapes its force", "select"]);
    let words = "identify --from all.acc --criterion simulation --model polynomial";
    assert!(refused(words, 2).contains("needs records"));
    assert!(refused("identify --model polynomial", 2).contains("study"));
    let no_part = refused("merge rig/study.toml", 3);
    assert!(no_part.contains("no sums"), "{no_part}");
    let missing = refused("accumulate rig gone.csv", 3);
    assert!(missing.contains("gone.csv"), "{missing}");
    let over = refused("accumulate rig -o rig/study.toml", 2);
    assert!(over.contains("written over"), "{over}");
}
