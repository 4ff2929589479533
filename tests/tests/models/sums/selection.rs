//! Segments that are chosen of many records.

use super::*;
use jointwatch::fit::sums::{Choice, Selection};

/// The names and bytes of all files in a folder.
fn contents(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let mut files: Vec<(String, Vec<u8>)> = entries
        .map(|e| {
            (
                e.file_name().into_string().unwrap(),
                fs::read(e.path()).unwrap(),
            )
        })
        .collect();
    files.sort();
    files
}

#[test]
fn a_selection_is_the_same_however_it_is_shared_out_and_covers_more_cells_than_chance() {
    let (plan, template) = planned(1.0);
    let study = Study::of_memory("fleet", DESCRIPTION, &[log("pilot", 6000, 1.0, 1)]).unwrap();
    let choice = Choice {
        segments: 24,
        seconds: 0.8,
        seed: 5,
    };
    // Most records move little; a few move much.
    let logs: Vec<MemoryLog> = (0..40)
        .map(|k| {
            log(
                &format!("log {k}"),
                5000,
                if k % 10 == 0 { 1.4 } else { 0.1 },
                300 + k,
            )
        })
        .collect();
    let select = |choice: Choice, logs: &[&MemoryLog]| {
        let mut selection = Selection::new(plan.clone(), choice);
        logs.iter()
            .for_each(|log| selection.add(&template.read_memory(log).unwrap()).unwrap());
        selection
    };
    let folder = tempfile::tempdir().unwrap();
    let written = |selection: &Selection, name: &str| {
        let into = folder.path().join(name);
        selection.write(&study, &into).unwrap();
        contents(&into)
    };
    let all: Vec<&MemoryLog> = logs.iter().collect();
    let whole = select(choice, &all);
    let bytes = written(&whole, "whole");
    let mut rng = ChaCha8Rng::seed_from_u64(30);
    for groups in [2, 5, 16] {
        let mut order = all.clone();
        order.shuffle(&mut rng);
        let mut merged = Selection::new(plan.clone(), choice);
        for (at, group) in order.chunks(order.len().div_ceil(groups)).enumerate() {
            let name = format!("{groups}-{at}");
            written(&select(choice, group), &name);
            let read = Selection::read(&folder.path().join(&name)).unwrap();
            merged.merge(read.clone(), &name).unwrap();
            // The same once more changes nothing.
            merged.merge(read, &name).unwrap();
        }
        assert!(
            written(&merged, &format!("{groups}")) == bytes,
            "{groups} groups"
        );
    }
    assert_eq!(whole.len(), 24);
    let other = select(Choice { seed: 6, ..choice }, &all);
    assert!(written(&other, "other") != bytes);
    // As many segments of the first records as there are, without a choice.
    let first = select(choice, &all[1..5]);
    println!(
        "{} cells, {} without a choice",
        whole.cells(),
        first.cells()
    );
    assert!(whole.cells() > first.cells() && whole.cells() >= 8);
    let error = Selection::new(plan.clone(), choice)
        .merge(other, "other")
        .unwrap_err();
    assert!(error.sentence.contains("--seed"), "{error}");

    // It is a study, and gives the strengths.
    let read = Study::read(&folder.path().join("whole")).unwrap();
    assert_eq!(read.records.len(), 24);
    let model = identify::physical(&read).unwrap().model;
    let stiffness = model.effects[0].parameters[0].value;
    assert!((stiffness / 2e4 - 1.0).abs() < 0.02, "{stiffness}");
}

#[test]
fn the_command_line_selects_a_study_that_can_be_diagnosed() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let rig = copy_of_rig(here);
    let logs = training_logs(&rig);
    let of = ["select", "rig"];
    let into = |out| ["--segments", "12", "--seconds", "1", "-o", out];
    let all: Vec<&str> = logs.iter().map(String::as_str).collect();
    let said = succeed(here, &[&of, &all[..], &into("all")].concat());
    assert!(said.contains("12 segments of 1 s"), "{said}");
    succeed(here, &[&of, &all[..1], &into("one")].concat());
    succeed(here, &[&of, &all[1..], &into("rest")].concat());
    succeed(here, &[&of, &["rest", "one"][..], &into("merged")].concat());
    assert!(contents(&here.join("all")) == contents(&here.join("merged")));
    succeed(here, "identify all --model physical -o model.json");

    let again = fail(here, &[&of[..], &into("all")].concat(), 1);
    assert!(again.contains("not empty"), "{again}");
    let short = fail(here, "select rig --seconds 0.01 -o short", 2);
    assert!(short.contains("filters take"), "{short}");
    let long = fail(here, "select rig --seconds 9999 -o long", 3);
    assert!(long.contains("shorter --seconds"), "{long}");
    let no_list = fail(here, &["select", "rig", "rig", "-o", "none"], 3);
    assert!(
        no_list.contains("segments.json") || no_list.contains("list of segments"),
        "{no_list}"
    );
}

#[test]
fn records_of_one_name_in_two_folders_are_told_apart() {
    let description = DESCRIPTION.replace(
        "[{ file = \"pilot\", role = \"train\" }]",
        "[{ file = \"one/run\", role = \"train\" }, { file = \"two/run\", role = \"train\" }]",
    );
    let logs = [log("one/run", 6000, 1.0, 1), log("two/run", 6000, 0.8, 2)];
    let study = Study::of_memory("fleet", &description, &logs).unwrap();
    let template = Template::of_text("fleet", description, 1000.0);
    let plan = Plan::of(&study, &template).unwrap();
    let choice = Choice {
        segments: 12,
        seconds: 0.8,
        seed: 3,
    };
    let mut selection = Selection::new(plan, choice);
    selection.add(&study).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let into = folder.path().join("selected");
    selection.write(&study, &into).unwrap();
    let list = read_json(into.join("segments.json"));
    let segments = list["segments"].as_array().unwrap();
    let mut taken = [0; 2];
    for segment in segments {
        let of = study
            .sources
            .iter()
            .position(|source| segment["sha256"] == source.sha256.as_str())
            .unwrap();
        taken[of] += 1;
        let file = format!("{}.csv", segment["rank"].as_str().unwrap());
        let rows = std::fs::read_to_string(into.join(file)).unwrap();
        let first = rows.lines().nth(1).unwrap().split(',').next().unwrap();
        let row = segment["first_row"].as_u64().unwrap() as usize;
        let truth = study.records[of].axes[0].displacement_first[row];
        assert_eq!(first.parse::<f64>().unwrap(), truth, "{segment}");
    }
    assert!(taken[0] > 0 && taken[1] > 0, "{taken:?}");
}
