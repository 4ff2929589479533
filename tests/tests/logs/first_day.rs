//! The first day with a rig: mistakes of signs and units are told with the right cure, sound
//! studies are left in peace, and `init` makes a study of logs as they are exported.

use jointwatch::simulate::{Hide, SimulationOptions, simulate};
use jointwatch::study::{Study, mistakes};
use jointwatch_tests::program::{fail, json, measurements, says, succeed};
use std::fs;
use tempfile::TempDir;

/// A rig of its own for every seed: one axis or two, clean or noisy, with and without something
/// hidden.
fn rig(seed: u64) -> Study {
    let hidden = [
        "coulomb@x",
        "time_delay@x",
        "cubic_hardening@x",
        "jenkins@x",
    ];
    let hide = (!seed.is_multiple_of(5)).then(|| Hide {
        effect: hidden[seed as usize % 5 - 1].into(),
        share: 0.1,
    });
    let options = SimulationOptions {
        axes: 1 + seed as usize % 2,
        snr_db: Some([60.0, 40.0, 30.0][seed as usize % 3]),
        seed,
        duration_s: 3.0,
        hidden: hide,
        ..SimulationOptions::default()
    };
    simulate(&options).unwrap().study
}

/// Seeds of the campaign; more with `JOINTWATCH_FIRST_DAY_RIGS`.
fn seeds() -> std::ops::Range<u64> {
    let more = std::env::var("JOINTWATCH_FIRST_DAY_RIGS").ok();
    0..more.and_then(|n| n.parse().ok()).unwrap_or(6)
}

fn scaled(study: &Study, change: impl Fn(&mut jointwatch::study::Channels)) -> Study {
    let mut study = study.clone();
    for record in &mut study.records {
        change(&mut record.axes[0]);
    }
    study
}

fn times(series: &mut [f64], factor: f64) {
    series.iter_mut().for_each(|v| *v *= factor);
}

#[test]
fn the_mistakes_of_a_first_day_are_told_with_their_cure_and_sound_rigs_are_left_in_peace() {
    for seed in seeds() {
        let sound = rig(seed);
        let said = mistakes::check(&sound);
        assert!(said.is_empty(), "seed {seed}, a sound study: {said:?}");
        let cases = [
            (
                "force",
                scaled(&sound, |c| times(&mut c.force, -1.0)),
                "its sign is turned; write force",
            ),
            (
                "kN",
                scaled(&sound, |c| times(&mut c.force, 1e-3)),
                "the force is in kN",
            ),
            (
                "force of one record",
                {
                    let mut study = sound.clone();
                    times(&mut study.records.last_mut().unwrap().axes[0].force, -1.0);
                    study
                },
                "counts the other way than that of another file",
            ),
            (
                "accelerometer",
                scaled(&sound, |c| times(c.acceleration.as_mut().unwrap(), -1.0)),
                "scale = -1.0",
            ),
            (
                "g",
                scaled(&sound, |c| {
                    times(c.acceleration.as_mut().unwrap(), 1.0 / 9.80665)
                }),
                "unit = \"g\"",
            ),
            (
                "mm",
                scaled(&sound, |c| {
                    times(&mut c.displacement_first, 1e3);
                    c.displacement_second.iter_mut().for_each(|s| times(s, 1e3));
                    c.body_position.iter_mut().for_each(|s| times(s, 1e3));
                }),
                "the position is in mm",
            ),
        ];
        for (mistake, study, cure) in cases {
            let said = mistakes::check(&study);
            assert!(
                said.len() == 1 && said[0].contains(cure) && said[0].starts_with("axis x: "),
                "seed {seed}, {mistake}: {said:?}"
            );
        }
    }
}

/// A cart that always rolls forwards and is always pushed, less where it is fast: what varies gives
/// out energy, and the joint takes in what the whole force does.
#[test]
fn a_force_that_never_turns_takes_in_the_work_of_all_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let rows = (0..3000).map(|row| {
        let t = f64::from(row);
        let noise = (t * t * 0.37).sin();
        let speed = 6.0 + 1.5 * (0.05 * t).sin() + (0.031 * t).sin();
        format!("{t},{speed},{}\n", 85.0 - 5.0 * speed + noise)
    });
    let log = format!("t_s,speed_m/s,force_N\n{}", rows.collect::<String>());
    fs::write(folder.path().join("run.csv"), log).unwrap();
    succeed(folder.path(), "init --yes run.csv");
    let said = mistakes::check(&Study::read(folder.path()).unwrap());
    assert!(
        !said.iter().any(|s| s.contains("gives out energy")),
        "{said:?}"
    );
}

/// A joint that is driven by itself in one part of a log: there is no sensor to turn round.
#[test]
fn parts_of_one_file_count_one_way() {
    let mut study = rig(1);
    times(&mut study.records.last_mut().unwrap().axes[0].force, -1.0);
    for record in &mut study.records {
        record.file = "run.csv".into();
    }
    let said = mistakes::check(&study);
    assert!(
        !said.iter().any(|s| s.contains("counts the other way than")),
        "{said:?}"
    );
}

#[test]
fn measured_and_simulated_studies_are_left_in_peace_but_for_a_velocity_that_is_wrong() {
    let Some(data) = measurements("data") else {
        return;
    };
    let Some(rigs) = measurements("rig_cases") else {
        return;
    };
    let mut sound: Vec<_> = ["composite_beam", "mr_damper_dyke", "mr_damper_vargas"]
        .map(|f| data.join(f))
        .into();
    sound.push(data.join("brfd/earthquakes.toml"));
    let folders = fs::read_dir(rigs).unwrap().map(|e| e.unwrap().path());
    sound.extend(folders.filter(|path| path.is_dir()));
    for path in sound {
        let study = Study::read(&path).unwrap();
        assert_eq!(mistakes::check(&study), [""; 0], "{}", path.display());
        let mut notes = study.notes.iter();
        let alone = notes.find(|note| note.contains("stands alone"));
        assert_eq!(alone, None, "{}", path.display());
    }
    let wrong = Study::read(&data.join("brfd/semi_active.toml")).unwrap();
    let said = mistakes::check(&wrong);
    assert!(
        said.len() == 1 && said[0].contains("times the derivative of the displacement"),
        "{said:?}"
    );
}

#[test]
fn an_export_of_a_german_logger_becomes_a_study_in_one_step_and_its_friction_is_named() {
    let Some(folder) = measurements("log_cases/german_export") else {
        return;
    };
    let work = TempDir::new().unwrap();
    let logs: Vec<String> = ["run1.csv", "run2.csv", "check.csv"]
        .iter()
        .map(|name| folder.join(name).display().to_string())
        .collect();
    let mut words = vec!["init", "--yes"];
    words.extend(logs.iter().map(String::as_str));
    let said = succeed(work.path(), &words);
    assert!(
        said.contains("2000 Hz") && !said.contains("Check:"),
        "{said}"
    );
    let text = fs::read_to_string(work.path().join("study.toml")).unwrap();
    for part in [
        "unit = \"mm\"",
        "unit = \"g\"",
        "unit = \"kN\"",
        "# guessed",
    ] {
        assert!(text.contains(part), "{text}");
    }
    let study = Study::read(work.path()).unwrap();
    assert_eq!(study.sample_rate_hz, 2000.0);
    assert_eq!(study.records[2].role, jointwatch::study::Role::Validate);
    succeed(work.path(), "identify study.toml --model physical");
    let diagnosis = json(work.path(), "diagnose study.toml model.json");
    let found = diagnosis["found"].as_array().unwrap();
    let coulomb = |f: &serde_json::Value| f["effect"] == "coulomb" && f["axis"] == "x";
    assert!(found.iter().any(coulomb), "{found:?}");
}

/// The simulated joint is between two bodies; its gap hides from a linear fit that both positions
/// belong to it, so `init` takes one and says which columns it leaves out.
#[test]
fn init_finds_both_axes_of_a_simulated_rig_and_names_what_it_leaves_out() {
    let work = TempDir::new().unwrap();
    succeed(work.path(), &["simulate", "--out", "rig", "--seed", "3"]);
    let rig = work.path().join("rig");
    let wanted = Study::read(&rig).unwrap();
    fs::remove_file(rig.join("study.toml")).unwrap();
    let said = succeed(&rig, &["init", "--yes", "train_both.csv", "valid.csv"]);
    says(&said, &["columns not used in the logs: x3_m"]);
    let found = Study::read(&rig).unwrap();
    for (a, b) in found.axes.iter().zip(&wanted.axes) {
        assert_eq!((&a.name, a.kind), (&b.name, b.kind));
    }
    assert_eq!(found.axes.len(), wanted.axes.len());
    let files = ["train_both.csv", "valid.csv"];
    for (record, file) in found.records.iter().zip(files) {
        let logged = wanted.records.iter().find(|r| r.file == file).unwrap();
        assert_eq!((&*record.file, record.role), (file, logged.role));
        for (a, b) in record.axes.iter().zip(&logged.axes) {
            assert_eq!((&a.acceleration, &a.force), (&b.acceleration, &b.force));
        }
    }
}

#[test]
fn inspect_shows_the_channels_of_a_log() {
    let folder = jointwatch_tests::program::workspace().join("tests/data/logs");
    let said = succeed(&folder, &["inspect", "german.csv"]);
    for part in ["500 rows", "1000 Hz", "x_m", "m/s^2", "decimal comma", "│"] {
        assert!(said.contains(part), "{said}");
    }
    let said = json(&folder, "inspect record.tdms");
    assert_eq!(said["rows"], 500);
    assert_eq!(said["time"]["rate_hz"], 1000.0);
}

#[test]
fn a_wrong_unit_is_put_right_whatever_the_study_says_and_a_copied_record_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let simulated = ["simulate", "--out", "bench", "--axes", "1", "--quiet"];
    succeed(folder, &simulated);
    let bench = folder.join("bench");
    let right = fs::read_to_string(bench.join("study.toml")).unwrap();
    let said = |study: &str| {
        fs::write(bench.join("study.toml"), study).unwrap();
        succeed(&bench, &["identify", ".", "--model", "physical"])
    };
    let with_unit = |unit: &str| {
        let force = format!("force = {{ column = \"force_N\", unit = \"{unit}\" }}");
        said(&right.replace("force = \"force_N\"", &force))
    };
    let sound = said(&right);
    assert!(!sound.contains("moves a mass"), "{sound}");
    assert!(!sound.contains("holds the same"), "{sound}");
    for wrong in ["kN", "mN"] {
        let told = with_unit(wrong);
        assert!(
            told.contains("the force is in N; write force"),
            "{wrong}: {told}"
        );
    }
    // The unit that the study has is no cure.
    let light = said(&right.replace("inertia = 1.8", "inertia = 0.66"));
    assert!(light.contains("moves a mass"), "{light}");
    assert!(!light.contains("the force is in N;"), "{light}");
    fs::copy(bench.join("train_x.csv"), bench.join("valid.csv")).unwrap();
    let told = said(&right);
    assert!(
        told.contains("valid.csv holds the same forces and displacements as train_x.csv"),
        "{told}"
    );
    let drafted = ["init", "train_x.csv", "--yes", "-o", "draft.toml"];
    let told = succeed(&bench, &drafted);
    says(&told, &["the first alone is taken as the displacement"]);
    let draft = fs::read_to_string(bench.join("draft.toml")).unwrap();
    let displacement = draft.lines().find(|l| l.starts_with("displacement"));
    assert!(
        displacement.is_some_and(|line| line.ends_with("# guessed")),
        "{draft}"
    );
    let swapped = fail(&bench, &["compare", "model.json", "study.toml"], 3);
    assert!(swapped.contains("give the study first"), "{swapped}");
}
