//! Every subcommand as a user calls it: what it prints, what it leaves behind, how it ends.

use jointwatch_tests::program::{fail, json, read_json, says, succeed};
use jointwatch_tests::story::{copy_of_rig, story};
use serde_json::Value;
use std::fs;

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn simulate_writes_a_study_with_the_truth_beside_it_and_refuses_a_folder_in_use() {
    let folder = tempfile::tempdir().unwrap();
    let simulate = |out: &str, seed: u64| {
        let words = format!("simulate --out {out} --duration 2 --axes 1 --seed {seed}");
        succeed(folder.path(), &words)
    };
    let said = simulate("rig", 9);
    says(&said, &["seed 9", "study.toml"]);
    let rig = folder.path().join("rig");
    assert!(rig.join("study.toml").is_file() && rig.join("truth/truth.json").is_file());
    let sentence = fail(folder.path(), &["simulate", "--out", "rig"], 1);
    says(&sentence, &["rig", "not empty"]);

    // The same seed gives the same bytes, another one others.
    simulate("again", 9);
    simulate("other", 10);
    let log = |study: &str| {
        let study = folder.path().join(study);
        let text = fs::read_to_string(study.join("study.toml")).unwrap();
        let file = text
            .lines()
            .find_map(|line| line.strip_prefix("file = "))
            .unwrap()
            .trim_matches('"')
            .to_string();
        fs::read(study.join(file)).unwrap()
    };
    assert_eq!(log("rig"), log("again"));
    assert_ne!(log("rig"), log("other"));
}

#[test]
fn identify_prints_verification_and_validation_and_writes_the_model() {
    let folder = tempfile::tempdir().unwrap();
    copy_of_rig(folder.path());
    for (fit, limit) in [("ridge", 256), ("least-squares", 256), ("select", 128)] {
        let identify = format!("identify rig --model polynomial --fit {fit} -o m.json");
        let said = succeed(folder.path(), &identify);
        says(&said, &["Verification", "Validation", "m.json"]);
        let model = read_json(folder.path().join("m.json"));
        assert_eq!(model["fit"], fit);
        for axis in 0..2 {
            let terms = model["fits"][axis]["terms"].as_u64().unwrap();
            assert!((1..=limit).contains(&terms), "{fit}: {terms} terms");
            let nmse = number(&model["validation"][axis]["nmse_percent"]);
            assert!(nmse > 0.0 && nmse < 60.0, "{fit}: validation NMSE {nmse} %");
        }
    }
    // A model small enough to read is printed as an equation with its units.
    let said = succeed(
        folder.path(),
        "identify rig --model polynomial --order 1,1,0,0",
    );
    says(&said, &["r_x [N] =", "r_phi [N·m] =", "m/s"]);
    assert!(folder.path().join("model.json").is_file());

    let sentence = fail(
        folder.path(),
        "identify rig --model polynomial --order 3,3",
        2,
    );
    assert!(sentence.contains("--order"), "{sentence}");
}

#[test]
fn compare_json_follows_the_contract() {
    let comparison = json(story(), "compare rig/study.toml model.json");
    let records = comparison["records"].as_array().unwrap();
    assert_eq!(records.len(), 4);
    for record in records {
        assert!(record["file"].as_str().unwrap().ends_with(".csv"));
        assert!(["train", "validate"].contains(&record["role"].as_str().unwrap()));
        assert!(record["rows"].as_u64().unwrap() > 10_000);
        for axis in ["x", "phi"] {
            let figures = &record["axes"][axis];
            for key in [
                "nmse_percent",
                "nmse_percent_wide_band",
                "relative_error",
                "peak_error",
                "outside_range",
            ] {
                assert!(number(&figures[key]) >= 0.0, "{key} of {axis}");
            }
            assert!(number(&figures["outside_range"]) <= 1.0);
        }
    }
    let places = comparison["where"].as_array().unwrap();
    assert!(!places.is_empty());
    for place in places {
        assert!(["x", "phi"].contains(&place["axis"].as_str().unwrap()));
        assert!(!place["region"].as_str().unwrap().is_empty());
        assert!((0.0..=1.0).contains(&number(&place["share_of_error"])));
    }

    let said = succeed(story(), &["compare", "rig/study.toml", "model.json"]);
    for part in [
        "Verification",
        "Validation",
        "train_x.csv",
        "valid.csv",
        "Where the error",
        "Hz",
    ] {
        assert!(said.contains(part), "{part} is missing in {said}");
    }
    // x rests while phi is driven alone: an error relative to no force would say nothing.
    assert!(said.contains("rests"), "{said}");
}

#[test]
fn quiet_says_nothing_and_json_to_a_file_leaves_the_text() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("c.json");
    let arguments = [
        "compare",
        "rig",
        "model.json",
        "--quiet",
        "--json",
        out.to_str().unwrap(),
    ];
    assert_eq!(succeed(story(), &arguments), "");
    assert!(read_json(&out)["records"].is_array());
    let said = succeed(
        story(),
        &["inspect", "model.bin", "--json", out.to_str().unwrap()],
    );
    assert!(said.contains("Blob"));
    assert_eq!(read_json(&out)["base"], "polynomial");
}

#[test]
fn export_states_its_error_and_refuses_a_budget_it_cannot_keep() {
    let folder = tempfile::tempdir().unwrap();
    let blob = folder.path().join("m.bin");
    let blob = blob.to_str().unwrap();
    let exported = json(story(), &["export", "model.json", "-o", blob]);
    assert_eq!(exported["bytes"], 4096);
    for axis in exported["axes"].as_array().unwrap() {
        assert!(
            number(&axis["largest_error"]) <= number(&axis["error_bound"]),
            "{axis}"
        );
        assert!(number(&axis["bound_relative"]) <= 1e-5, "{axis}");
    }
    assert_eq!(
        fs::read(blob).unwrap(),
        fs::read(story().join("model.bin")).unwrap()
    );

    let other = folder.path().join("refused.bin");
    let into = other.to_str().unwrap();
    let export = ["export", "model.json", "-o", into, "--budget", "1e-14"];
    let sentence = fail(story(), &export, 3);
    says(&sentence, &["coefficient", "model.json"]);
    assert!(!other.exists());
}

#[test]
fn replay_is_repeatable_and_close_to_compare() {
    let replayed = json(story(), "replay model.bin rig");
    let again = json(story(), "replay model.bin rig");
    assert_eq!(replayed, again);
    let compared = json(story(), "compare rig model.json");
    for (a, b) in replayed["records"]
        .as_array()
        .unwrap()
        .iter()
        .zip(compared["records"].as_array().unwrap())
    {
        assert_eq!(a["file"], b["file"]);
        for axis in ["x", "phi"] {
            assert_eq!(a["axes"][axis]["saturated"], 0);
            if b["axes"][axis]["rests"] == true || number(&a["outside_range"]) > 0.0 {
                continue;
            }
            // The device sees rounded counts of force and acceleration, the host what the log
            // holds.
            let (seen, wanted) = (
                number(&a["axes"][axis]["nmse_percent"]),
                number(&b["axes"][axis]["nmse_percent"]),
            );
            assert!(
                (seen - wanted).abs() < 0.01 * wanted + 1e-4,
                "{} {axis}: {seen} against {wanted}",
                a["file"]
            );
        }
    }

    let folder = tempfile::tempdir().unwrap();
    let csv = folder.path().join("out.csv");
    let csv = csv.to_str().unwrap();
    let replay = ["replay", "model.bin", "rig", "--record", "valid.csv"];
    succeed(story(), &[&replay[..], &["-o", csv]].concat());
    let text = fs::read_to_string(csv).unwrap();
    let heading = text.lines().next().unwrap();
    assert!(
        heading.starts_with("row,outside,x_measured_raw,x_measured_N,"),
        "{heading}"
    );
    let outputs = replayed["records"][3]["outputs"].as_u64().unwrap();
    assert_eq!(text.lines().count() as u64, outputs + 1);

    let sentence = fail(story(), &["replay", "model.bin", "rig", "-o", csv], 2);
    assert!(sentence.contains("--record"), "{sentence}");
    let sentence = fail(story(), "replay model.bin rig --record vali.csv", 2);
    assert!(sentence.contains("valid.csv"), "{sentence}");
}

#[test]
fn inspect_shows_models_and_blobs() {
    let said = succeed(story(), &["inspect", "model.json"]);
    says(&said, &["polynomial", "History", "identified"]);
    let said = succeed(story(), &["inspect", "model.bin"]);
    says(&said, &["inertia − force", "error bound"]);
}

#[test]
fn help_names_every_subcommand_and_the_exit_codes() {
    let help = succeed(story(), &["--help"]);
    for part in [
        "demo",
        "simulate",
        "identify",
        "compare",
        "export",
        "inspect",
        "replay",
        "Exit codes",
        "--json",
    ] {
        assert!(help.contains(part), "{part} is missing in {help}");
    }
    for subcommand in [
        "demo", "simulate", "identify", "compare", "export", "inspect", "replay",
    ] {
        assert!(succeed(story(), &[subcommand, "--help"]).contains("Usage"));
    }
}

#[test]
fn the_demo_tells_the_whole_story_and_leaves_its_folder() {
    let folder = tempfile::tempdir().unwrap();
    let said = succeed(folder.path(), &["demo"]);
    for part in [
        "1. ",
        "2. ",
        "3. ",
        "4. ",
        "5. ",
        "6. ",
        "7. ",
        "$ jointwatch diagnose",
        "Hidden in the rig was",
        "That is what was found.",
        "the same bits as the host",
    ] {
        assert!(said.contains(part), "{part} is missing in {said}");
    }
    let out = folder.path().join("jointwatch-demo");
    for file in [
        "study.toml",
        "valid.csv",
        "truth/truth.json",
        "base.json",
        "model.json",
        "model.bin",
        "comparison.json",
        "diagnosis.json",
        "plots/before/where-x.svg",
        "plots/after/staircase.svg",
        "report.html",
    ] {
        assert!(out.join(file).is_file(), "{file} is missing");
    }
}

#[test]
fn compare_tells_what_is_wrong_with_the_data_as_diagnose_does() {
    let folder = tempfile::tempdir().unwrap();
    let rig = copy_of_rig(folder.path());
    let model = story().join("model.json");
    let model = model.to_str().unwrap();
    let run = |command: &str| json(&rig, &[command, ".", model]);
    assert_eq!(run("compare")["data_problems"], serde_json::json!([]));

    // The force channel ends at half of its range.
    let log = rig.join("valid.csv");
    let text = fs::read_to_string(&log).unwrap();
    let mut rows: Vec<Vec<String>> = text
        .lines()
        .map(|line| line.split(',').map(str::to_owned).collect())
        .collect();
    let column = rows[0].iter().position(|name| name == "force_N").unwrap();
    let force = |row: &[String]| row[column].parse::<f64>().unwrap();
    let most = rows[1..].iter().map(|row| force(row).abs());
    let rail = 0.5 * most.fold(0.0, f64::max);
    for row in &mut rows[1..] {
        row[column] = force(row).clamp(-rail, rail).to_string();
    }
    let lines: Vec<String> = rows.into_iter().map(|row| row.join(",")).collect();
    fs::write(&log, lines.join("\n")).unwrap();

    let problems = run("compare")["data_problems"].clone();
    println!("{problems}");
    assert!(problems.to_string().contains("valid.csv"), "{problems}");
    assert_eq!(problems, run("diagnose")["data_problems"]);
    let said = succeed(&rig, &["compare", ".", model]);
    let first = problems[0].as_str().unwrap();
    assert!(said.contains(&format!("Data: {first}.")), "{said}");
    assert!(said.contains("The data are at fault"), "{said}");
}
