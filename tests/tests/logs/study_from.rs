//! From the device back into a study: what it streamed, and what it keeps around an alarm, give the
//! values that the logs gave.

use jointwatch::device::capture::fetch;
use jointwatch::device::export::read_blob;
use jointwatch::device::rig_block;
use jointwatch::emulate::bench::Scenario;
use jointwatch::emulate::device::EmulatedDevice;
use jointwatch::emulate::line::Wire;
use jointwatch::emulate::selftest;
use jointwatch::simulate::RigParameters;
use jointwatch::study::{Record, Study};
use jointwatch::text::error::Error;
use jointwatch_tests::monitor::false_alarms::WANTED_HOURS;
use jointwatch_tests::monitor::watched::{Learnt, STUDY_LEVEL, Shaking, Subject};
use jointwatch_tests::program::{fail, json, read_json, says, succeed};
use jointwatch_tests::story::watched_rig;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock};
use tempfile::TempDir;

/// A folder with a rig's study, its physical model, and a block with the monitor's limits.
fn story() -> &'static Path {
    static STORY: OnceLock<TempDir> = OnceLock::new();
    let folder = STORY.get_or_init(|| {
        let folder = TempDir::new().unwrap();
        watched_rig(folder.path(), 1);
        let replay = "replay model.bin rig/study.toml --record train_both.csv";
        let frames = "--rig rig.bin --frames frames.bin";
        succeed(folder.path(), &format!("{replay} {frames}"));
        folder
    });
    folder.path()
}

/// Writes frames and makes a study of them in a folder of its own beside.
fn study_from(folder: &Path, frames: &[u8]) -> Value {
    fs::write(folder.join("frames.bin"), frames).unwrap();
    let rig = story().join("rig.bin");
    let rig = rig.to_str().unwrap();
    json(
        folder,
        &["study-from", "frames.bin", "--rig", rig, "-o", "now"],
    )
}

/// The effects' values and the half widths of their intervals, by name, of the physical model that
/// a study gives with these terms.
fn values(folder: &Path, study: &str) -> Vec<(String, f64, f64)> {
    let identify = ["identify", study, "--model", "physical", "-o"];
    succeed(folder, &[&identify[..], &["values.json"]].concat());
    let model = read_json(folder.join("values.json"));
    let mut all = Vec::new();
    for effect in model["effects"].as_array().unwrap() {
        for p in effect["parameters"].as_array().unwrap() {
            let name = format!(
                "{}@{} {}",
                effect["name"]
                    .as_str()
                    .or(effect["effect"].as_str())
                    .unwrap_or("?"),
                effect["axis"],
                p["name"].as_str().unwrap()
            );
            let end = |at: usize| p["interval"][at].as_f64().unwrap();
            all.push((name, p["value"].as_f64().unwrap(), (end(1) - end(0)) / 2.0));
        }
    }
    all
}

/// The terms of the story's own study, in place of those that were guessed.
fn with_terms(study: &Path) {
    let own = fs::read_to_string(story().join("rig/study.toml")).unwrap();
    let (_, base) = own.split_once("[base]").unwrap();
    let text = fs::read_to_string(study).unwrap();
    let (axes, _) = text.split_once("[base]").unwrap();
    fs::write(study, format!("{axes}[base]{base}")).unwrap();
}

#[test]
fn what_was_streamed_gives_the_values_that_the_log_gave() {
    let folder = TempDir::new().unwrap();
    let frames = fs::read(story().join("frames.bin")).unwrap();
    let said = study_from(folder.path(), &frames);
    assert_eq!(said["records"][0]["rows"], 20_000, "{said}");
    assert_eq!(said["records"][0]["gaps"], 0, "{said}");
    let now = folder.path().join("now/study.toml");
    with_terms(&now);
    // The same rows of the log itself.
    let own = fs::read_to_string(story().join("rig/study.toml")).unwrap();
    let (axes, rest) = own.split_once("[[record]]").unwrap();
    let (_, base) = rest.split_once("[base]").unwrap();
    let text = fs::read_to_string(&now).unwrap();
    let (_, records) = text.split_once("[[record]]").unwrap();
    let (records, _) = records.split_once("[base]").unwrap();
    let records = records.replace("run_1.csv", "train_both.csv");
    let log = story().join("rig/log.toml");
    fs::write(&log, format!("{axes}[[record]]{records}[base]{base}")).unwrap();
    let logged = values(folder.path(), log.to_str().unwrap());
    let streamed = values(folder.path(), "now");
    assert!(logged.len() >= 4, "{logged:?}");
    assert_eq!(logged.len(), streamed.len());
    for ((name, log, width), (other, stream, _)) in logged.iter().zip(&streamed) {
        assert_eq!(name, other);
        println!("{name}: {log} ± {width} from the log, {stream} from the frames");
        assert!(
            (log - stream).abs() <= 0.5 * width,
            "{name}: {log} {stream}"
        );
    }
    for command in ["compare", "diagnose"] {
        let model = story().join("model.json");
        succeed(folder.path(), &[command, "now", model.to_str().unwrap()]);
    }
}

#[test]
fn frames_that_were_lost_become_gaps_that_are_told() {
    let folder = TempDir::new().unwrap();
    let mut frames = fs::read(story().join("frames.bin")).unwrap();
    let all = frames.len();
    for part in [3, 2, 1] {
        frames.drain(all * part / 4..all * part / 4 + 2000);
    }
    frames.truncate(frames.len() - 20);
    let said = study_from(folder.path(), &frames);
    let record = &said["records"][0];
    let missing = record["missing"].as_u64().unwrap();
    let rows = record["rows"].as_u64().unwrap();
    assert!(record["gaps"].as_u64().unwrap() >= 3, "{said}");
    assert!(missing >= 30 && rows + missing > 19_000, "{said}");
    let notes = said["notes"].to_string();
    assert!(
        notes.contains("lost on the way") && notes.contains("middle of a frame"),
        "{said}"
    );
    let study = Study::read(&folder.path().join("now")).unwrap();
    assert!(study.records.len() >= 4, "{:?}", study.notes);
    assert!(
        study.notes.iter().any(|n| n.contains("gap"))
            || study.sources.iter().any(|s| !s.time.is_empty())
    );
    succeed(folder.path(), &["identify", "now", "--model", "physical"]);
}

#[test]
fn what_is_no_recording_of_this_rig_is_refused_in_a_sentence() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    let frames = fs::read(story().join("frames.bin")).unwrap();
    let rig = story().join("rig.bin");
    let rig = rig.to_str().unwrap();
    let end = frames.iter().skip(1).position(|byte| *byte == 0).unwrap() + 2;
    let own = story().join("rig/study.toml");
    let model = story().join("model.bin");
    let replay = ["replay", model.to_str().unwrap(), own.to_str().unwrap()];
    let without = ["--record", "train_both.csv", "--frames", "without.bin"];
    succeed(folder.path(), &[&replay[..], &without].concat());
    for (name, bytes, why) in [
        ("empty.bin", Vec::new(), "holds no frame;"),
        ("text.bin", b"t,x\n1,2\n".to_vec(), "holds no whole frame"),
        (
            "half.bin",
            frames[..end / 2].to_vec(),
            "holds no whole frame",
        ),
        (
            "hello.bin",
            frames[..end].to_vec(),
            "1 messages and no sample",
        ),
        (
            "without.bin",
            fs::read(path("without.bin")).unwrap(),
            "without a rig block",
        ),
        (
            "short.bin",
            frames[..2500].to_vec(),
            "a record needs at least 100",
        ),
    ] {
        fs::write(path(name), bytes).unwrap();
        let said = fail(
            folder.path(),
            &["study-from", name, "--rig", rig, "-o", "now"],
            3,
        );
        assert!(said.contains(why), "{name}: {said}");
        assert!(!path("now").exists(), "{name}");
    }
    // The block of another joint.
    succeed(folder.path(), "simulate --out other --axes 1 --duration 4");
    succeed(
        folder.path(),
        "identify other --model physical -o other.json",
    );
    let export = "export other.json --rig defaults --study other -o other.bin";
    succeed(folder.path(), export);
    fs::write(path("frames.bin"), &frames).unwrap();
    let from = "study-from frames.bin --rig other.bin -o now";
    let said = fail(folder.path(), from, 3);
    assert!(said.contains("of a device with the rig block"), "{said}");
    // And without the introduction the axes tell.
    fs::write(path("frames.bin"), &frames[end..]).unwrap();
    let said = fail(folder.path(), from, 3);
    assert!(said.contains("a rig with 2 axes"), "{said}");
    fs::create_dir(path("now")).unwrap();
    fs::write(path("now/mine"), "").unwrap();
    let from = ["study-from", "frames.bin", "--rig", rig, "-o", "now"];
    let said = fail(folder.path(), &from, 1);
    assert!(said.contains("is not empty"), "{said}");
}

/// Twelve seconds in which the joint becomes stiffer after four.
fn stiffer() -> Record {
    let rig = RigParameters::default();
    let subject = Subject::new(Learnt::Physical, rig, 1, WANTED_HOURS).unwrap();
    let (what, stiffer) = subject.changes(0.1).swap_remove(0);
    assert_eq!(what, "stiffness +1 on 0");
    subject.shake(Shaking::steady(12.0, STUDY_LEVEL, 77), Some((4.0, stiffer)))
}

/// A joint changes, the firmware under QEMU raises its alarm and keeps the counts around it;
/// fetched over the line, they say what has changed.
#[test]
fn the_capture_of_an_alarm_names_what_changed() {
    let model = read_blob(&story().join("model.bin")).unwrap();
    let block = rig_block::read(&story().join("rig.bin")).unwrap();
    let study = Study::read(&story().join("rig")).unwrap();
    let device = EmulatedDevice::new(&study, &model, Some(block)).unwrap();
    let image = selftest::emulated().unwrap_or_else(|why| panic!("{why}"));
    let slot = device.slot().unwrap().to_bytes();
    let frames = Arc::new(Mutex::new(Vec::new()));
    let kept = frames.clone();
    let talk = move |wire: &mut Wire| {
        let fetched = fetch(wire, |_, _| ())?;
        *kept.lock().unwrap() = fetched.frames;
        Err(Error::failed("fetched"))
    };
    let scenario = Scenario {
        // Behind the record's end, when all is recorded.
        talk: Some((12_200, Box::new(talk))),
        linger: 300,
        ..Scenario::default()
    };
    let run = device.run(&image, &slot, &stiffer(), &[], scenario);
    let run = run.unwrap_or_else(|why| panic!("{why}")).run;
    assert_eq!(run.comparison.different_bits, 0, "{:?}", run.comparison);
    println!("{:?}", run.uploaded);
    let frames = frames.lock().unwrap().clone();
    assert!(!frames.is_empty(), "{:?}", run.uploaded);

    let folder = TempDir::new().unwrap();
    let said = study_from(folder.path(), &frames);
    println!("{said}");
    let rows = |at: usize| said["records"][at]["rows"].as_u64().unwrap();
    // The emulated board has a seventh of the memory; that the board's own holds 4 s, a test of the
    // packing shows.
    assert!(rows(0) + rows(1) >= 1000, "{said}");
    assert_eq!(said["records"][1]["in_study"], true, "{said}");
    let model = story().join("model.json");
    let changed = ["changed", model.to_str().unwrap(), "now"];
    let said = json(folder.path(), &changed);
    let words = succeed(folder.path(), &changed);
    println!("{words}");
    says(&words, &["Changed: stiffness of stiffness@x by +"]);
    let parameters = said["parameters"].as_array().unwrap();
    let stiffness = parameters
        .iter()
        .find(|p| p["effect"] == "stiffness@x")
        .unwrap();
    assert_eq!(stiffness["counts"], true, "{stiffness}");
    assert_eq!(said["errors"][0]["grew"], true, "{said}");
}
