//! Logs that are not one file of time, displacement and force: without time, without displacement,
//! in several files, with the force twice, as JSON. Each becomes a study by `init`, or by a line in
//! study.toml, and gives the values that are true.

mod drafts;
mod named;

use jointwatch::fit::identify;
use jointwatch::study::Study;
use jointwatch_tests::program::{run, says, succeed};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const RATE: f64 = 500.0;
const ROWS: usize = 6000;

/// Frequency, amplitude and phase.
const TONES: [(f64, f64, f64); 3] = [(0.31, 0.9, 0.0), (1.7, 0.2, 1.0), (4.3, 0.05, 2.0)];

/// A motion of several tones: displacement, velocity, acceleration.
fn motion(t: f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (hertz, size, phase) in TONES {
        let rate = TAU * hertz;
        let (sine, cosine) = (rate * t + phase).sin_cos();
        sum[0] += size * sine;
        sum[1] += size * rate * cosine;
        sum[2] -= size * rate * rate * sine;
    }
    sum
}

/// Rows of a text: the cells of each by its time.
fn text<const N: usize>(head: &str, cells: impl Fn(f64) -> [f64; N]) -> String {
    let row = |at: usize| {
        cells(at as f64 / RATE)
            .map(|cell| format!("{cell:.9}"))
            .join(",")
    };
    let rows: Vec<String> = (0..ROWS).map(row).collect();
    format!("{head}\n{}\n", rows.join("\n"))
}

/// The first parameter of every effect of the physical model of a study.
fn values(study: &Path) -> Vec<(String, f64)> {
    let model = identify::physical(&Study::read(study).unwrap())
        .unwrap()
        .model;
    let effects = model.effects.iter();
    effects
        .map(|e| (e.effect.clone(), e.parameters[0].value))
        .collect()
}

#[track_caller]
fn assert_near(found: &[(String, f64)], effect: &str, truth: f64, within: f64) {
    let value = found
        .iter()
        .find(|(name, _)| name == effect)
        .map(|(_, v)| *v);
    assert!(
        value.is_some_and(|v| (v / truth - 1.0).abs() < within),
        "{effect} should be {truth}: {found:?}"
    );
}

/// What `init` says when it ends with this exit code, after what it shows of the logs.
fn refused(folder: &TempDir, words: &[&str], code: i32) -> String {
    let output = run(folder.path(), words);
    assert_eq!(output.status.code(), Some(code), "{words:?}");
    String::from_utf8(output.stderr).unwrap()
}

fn init(folder: &TempDir, words: &[&str]) -> String {
    let said = succeed(folder.path(), &[&["init", "--yes"], words].concat());
    println!("{said}");
    fs::read_to_string(folder.path().join("study.toml")).unwrap()
}

#[test]
fn a_motor_of_which_only_the_speed_was_logged() {
    let folder = TempDir::new().unwrap();
    let (inertia, damping, friction) = (0.02, 0.05, 0.3);
    let log = text("Time (s),Speed (rpm),Torque (Nm)", |t| {
        let [_, v, a] = motion(t);
        [
            t,
            60.0 * v / TAU,
            inertia * a + damping * v + friction * (v / 0.01).tanh(),
        ]
    });
    fs::write(folder.path().join("motor.csv"), log).unwrap();
    let study = init(&folder, &["motor.csv"]);
    assert!(
        study.contains("velocity = { column = \"Speed (rpm)\", unit = \"rpm\" }"),
        "{study}"
    );
    let path = folder.path().join("study.toml");
    let with = study.replace(
        "terms = [\"viscous@phi\"]",
        "terms = [\"viscous@phi\", \"coulomb@phi\"]",
    );
    assert_ne!(with, study);
    fs::write(&path, &with).unwrap();
    let notes = Study::read(&path).unwrap().notes;
    assert!(
        notes.iter().any(|n| n.contains("integral of the velocity")),
        "{notes:?}"
    );
    let found = values(&path);
    assert_near(&found, "viscous", damping, 0.05);
    assert_near(&found, "coulomb", friction, 0.05);
    let neither = with.replace("velocity = ", "# velocity = ");
    fs::write(&path, neither).unwrap();
    let sentence = Study::read(&path).unwrap_err().sentence;
    says(&sentence, &["needs its displacement, or its velocity"]);
}

#[test]
fn a_motor_current_stands_for_the_torque_until_its_constant_is_written() {
    let folder = TempDir::new().unwrap();
    let constant = 0.08;
    let log = text("t [s],q [rad],i [A]", |t| {
        let [x, v, a] = motion(t);
        [t, x, (0.02 * a + 0.05 * v) / constant]
    });
    fs::write(folder.path().join("motor.csv"), log).unwrap();
    let two = text("t [s],q [rad],i [A],supply [A]", |t| {
        let [x, v, _] = motion(t);
        [t, x, 0.05 * v / constant, 1.0 + 0.1 * v]
    });
    fs::write(folder.path().join("two.csv"), two).unwrap();
    let either = refused(&folder, &["init", "--yes", "two.csv"], 3);
    assert!(either.contains("current of a motor"), "{either}");
    let said = succeed(folder.path(), &["init", "--yes", "motor.csv"]);
    assert!(said.contains("\"i [A]\" stands for it"), "{said}");
    assert!(said.contains("torque or force constant"), "{said}");
    assert!(!said.contains("the latter was used"), "{said}");
    let path = folder.path().join("study.toml");
    let study = fs::read_to_string(&path).unwrap();
    let current = "{ column = \"i [A]\", unit = \"A\", scale = 1.0 }";
    assert!(study.contains(current), "{study}");
    assert_near(&values(&path), "viscous", 0.05 / constant, 0.05);
    let scaled = study.replace("scale = 1.0 }", "scale = 0.08 }");
    fs::write(&path, scaled).unwrap();
    assert_near(&values(&path), "viscous", 0.05, 0.05);
}

#[test]
fn a_free_decay_is_drafted_where_no_force_is_said_to_be_applied() {
    let folder = TempDir::new().unwrap();
    let (stiffness, damping) = (900.0_f64, 1.5);
    let decay = |t: f64| 0.004 * (-0.5 * damping * t).exp() * (stiffness.sqrt() * t).cos();
    let log = text("t [s],x [m],bridge [V]", |t| [t, decay(t), 1.0]);
    fs::write(folder.path().join("decay.csv"), log).unwrap();
    let said = refused(&folder, &["init", "--yes", "decay.csv"], 3);
    assert!(said.contains("--column force=0"), "{said}");
    let wrong = refused(
        &folder,
        &["init", "--yes", "decay.csv", "--column", "force=1"],
        2,
    );
    assert!(wrong.contains("no column \"1\""), "{wrong}");
    let no_motion = text("t [s],bridge [V]", |t| [t, t.sin()]);
    fs::write(folder.path().join("still.csv"), no_motion).unwrap();
    let words = ["init", "--yes", "still.csv", "--column", "force=0"];
    let nothing = refused(&folder, &words, 3);
    assert!(nothing.contains("be the displacement"), "{nothing}");
    let words = ["init", "--yes", "decay.csv", "--column", "force=0"];
    let said = succeed(folder.path(), &words);
    assert!(said.contains("nothing is applied"), "{said}");
    let path = folder.path().join("study.toml");
    assert_near(&values(&path), "stiffness", stiffness, 0.02);
    assert_near(&values(&path), "viscous", damping, 0.05);
}

/// Rubber in a testing machine: what stands in series with a damper makes it stiffer the quicker it
/// moves, which no mass does.
#[test]
fn stiffness_that_rises_with_frequency_is_no_mass_and_turns_no_sign() {
    let folder = TempDir::new().unwrap();
    let log = text("Time,disp_mm,load_N", |t| {
        let stretch = TONES.iter().map(|&(hertz, size, phase)| {
            let quick = TAU * hertz * 0.03;
            let (sine, cosine) = (TAU * hertz * t + phase).sin_cos();
            size * quick / (1.0 + quick * quick) * (quick * sine + cosine)
        });
        [
            t,
            motion(t)[0],
            200.0 * motion(t)[0] + 90.0 * stretch.sum::<f64>(),
        ]
    });
    fs::write(folder.path().join("rubber.csv"), log).unwrap();
    let study = init(&folder, &["rubber.csv"]);
    assert!(
        study.contains("force = { column = \"load_N\", unit = \"N\" }")
            && study.contains("inertia = 0.0"),
        "{study}"
    );
}

#[test]
fn columns_that_turn_are_no_translation_when_they_are_named() {
    let folder = TempDir::new().unwrap();
    let log = text("t,ref_deg,link_arcmin,tau_Nm", |t| {
        let [x, v, _] = motion(t);
        [t, x, 60.0 * x, 2.0 * x + 0.1 * v]
    });
    fs::write(folder.path().join("joint.csv"), log).unwrap();
    let words = ["displacement=link_arcmin", "force=tau_Nm"];
    let [a, b] = words.map(|word| ["--column", word]);
    let study = init(&folder, &[&["joint.csv"][..], &a, &b].concat());
    let channels = "displacement = { column = \"link_arcmin\", unit = \"arcmin\" }";
    assert!(
        study.contains("kind = \"rotation\"") && study.contains(channels),
        "{study}"
    );
    let path = folder.path().join("study.toml");
    assert_near(&values(&path), "stiffness", 2.0_f64.to_degrees(), 0.01);
}

/// Motor and slide of a belt move nearly alike: the body is the one whose accelerometer it is.
#[test]
fn of_two_positions_the_body_is_the_one_that_its_accelerometer_follows() {
    let folder = TempDir::new().unwrap();
    let log = text("t,motor_pos_mm,slide_pos_mm,acc_m/s2,force_N", |t| {
        let ([x, _, a], [d, w, b]) = (motion(t), motion(3.7 * t));
        let acceleration = 1e-3 * (a + 0.05 * 3.7 * 3.7 * b);
        let force = 2.0 * acceleration + 15.0 * d + 0.3 * w;
        [t, x + 0.05 * d, x, acceleration, force]
    });
    fs::write(folder.path().join("belt.csv"), log).unwrap();
    let study = init(&folder, &["belt.csv"]);
    says(&study, &["\nbody_position = { column = \"motor_pos_mm\""]);
}

#[test]
fn a_loop_without_time_is_drafted_as_one() {
    let folder = TempDir::new().unwrap();
    let log = text("Weg [mm],Kraft [kN]", |t| {
        let [x, v, _] = motion(t);
        [x, 2e-3 * x + 5e-4 * v.signum()]
    });
    fs::write(folder.path().join("loop.csv"), log).unwrap();
    let said = refused(&folder, &["init", "--yes", "loop.csv"], 3);
    assert!(said.contains("--column time=none"), "{said}");
    let study = init(&folder, &["loop.csv", "--column", "time=none"]);
    says(&study, &["time = \"none\"", "\"stiffness@x\""]);
    let path = folder.path().join("study.toml");
    fs::write(
        &path,
        study.replace("\"stiffness@x\"", "\"stiffness@x\", \"coulomb@x\""),
    )
    .unwrap();
    let found = values(&path);
    assert_near(&found, "stiffness", 2e3, 0.01);
    assert_near(&found, "coulomb", 0.5, 0.01);
}

#[test]
fn topics_of_one_clock_in_several_files_are_put_together_and_split() {
    let folder = TempDir::new().unwrap();
    let position = text("t,q", |t| [t, motion(t)[0]]);
    // The second topic's times lie between those of the first.
    let effort = text("t,effort", |t| {
        let t = t + 0.4 / RATE;
        let [x, v, _] = motion(t);
        [t, 40.0 * x + 3.0 * v]
    });
    fs::write(folder.path().join("position.csv"), position).unwrap();
    fs::write(folder.path().join("effort.csv"), effort).unwrap();
    let study = "time = { column = \"t\", resample_hz = 500 }\n\
                 axis = [{ name = \"x\", kind = \"rotation\", displacement = \"q\", force = \"effort\", inertia = 0.0 }]\n\
                 base = { terms = [\"stiffness@x\", \"viscous@x\"] }\n\
                 [[record]]\nfile = \"position.csv\"\nrole = \"train\"\nrows = [0, 4000]\n\
                 [[record]]\nfile = \"position.csv\"\nrole = \"validate\"\nrows = [4000, 6000]\n\
                 [[clock]]\nfile = \"effort.csv\"\nrecord = \"position.csv\"\ntime = \"t\"\n";
    let path = folder.path().join("study.toml");
    fs::write(&path, study).unwrap();
    let read = Study::read(&path).unwrap();
    let rows: Vec<usize> = read.records.iter().map(|record| record.rows).collect();
    assert!(
        rows[0].abs_diff(4000) < 3 && rows[1].abs_diff(2000) < 3,
        "{rows:?}"
    );
    let found = values(&path);
    assert_near(&found, "stiffness", 40.0, 1e-3);
    assert_near(&found, "viscous", 3.0, 1e-3);
    let with = |line: &str| {
        fs::write(&path, format!("{study}{line}\n")).unwrap();
        Study::read(&path).unwrap_err().sentence
    };
    assert!(with("common = [\"t\", \"t\"]").contains("leave common out"));
    assert!(with("derivative = 1").contains("none is named"));
}

#[test]
fn a_file_that_holds_the_force_twice_and_one_column_for_two_roles() {
    let folder = TempDir::new().unwrap();
    let log = text("t,x_F[1],x_F[2],forc", |t| {
        let [x, v, _] = motion(t);
        let force = 40.0 * x + 3.0 * v;
        [t, x, force, force]
    });
    fs::write(folder.path().join("run.csv"), log).unwrap();
    let study = init(&folder, &["run.csv"]);
    says(&study, &["displacement = \"x_F[1]\"", "force = \"forc\""]);
    let twice = [
        "init",
        "--yes",
        "run.csv",
        "-o",
        "b.toml",
        "--column",
        "force=forc",
        "--column",
        "displacement=forc",
    ];
    let said = refused(&folder, &twice, 2);
    says(&said, &["cannot be the force and the displacement"]);
}

#[test]
fn rows_as_json_objects_become_a_study() {
    let folder = TempDir::new().unwrap();
    let row = |at: usize| {
        let t = at as f64 / RATE;
        let [x, v, _] = motion(t);
        format!(
            "{{\"timestamp\": {t}, \"position\": {x}, \"force\": {}, \"on\": true}}",
            40.0 * x + 3.0 * v
        )
    };
    let rows: Vec<String> = (0..ROWS).map(row).collect();
    let log = format!("{{\"mass\": 1.2, \"entries\": [{}]}}", rows.join(", "));
    fs::write(folder.path().join("run.json"), log).unwrap();
    let seen = succeed(folder.path(), &["inspect", "run.json"]);
    assert!(seen.contains("JSON, 6000 rows, 500 Hz"), "{seen}");
    init(&folder, &["run.json"]);
    let found = values(&folder.path().join("study.toml"));
    assert_near(&found, "stiffness", 40.0, 1e-3);
}

#[test]
fn a_log_much_faster_than_its_motion_is_told_the_rate_that_serves() {
    let folder = TempDir::new().unwrap();
    let mut noise = ChaCha8Rng::seed_from_u64(8);
    let rows = (0..30_000).map(|at| {
        let t = f64::from(at) / 1000.0;
        let swing = (-0.04 * t).exp() * (TAU * 0.63 * t).cos();
        // Read by a converter of 0.5 mrad.
        let read = ((swing + noise.random_range(-3e-4..3e-4)) / 5e-4).round() * 5e-4;
        format!("{t},{read}")
    });
    let log = format!("t,q\n{}\n", rows.collect::<Vec<_>>().join("\n"));
    fs::write(folder.path().join("run.csv"), log).unwrap();
    let with = |time: &str| {
        let study = format!(
            "time = {{ column = \"t\"{time} }}\n\
             axis = [{{ name = \"x\", kind = \"rotation\", displacement = \"q\", force = 0, inertia = 1.0 }}]\n\
             base = {{ terms = [\"stiffness@x\", \"viscous@x\"] }}\n\
             record = [{{ file = \"run.csv\", role = \"train\", rows = [0, 20000] }},\n\
             {{ file = \"run.csv\", role = \"validate\", rows = [20000, 30000] }}]\n"
        );
        fs::write(folder.path().join("study.toml"), study).unwrap();
        let said = succeed(folder.path(), "identify study.toml --model physical");
        let found = said.lines().find(|line| line.starts_with("Validation"));
        let cells = found.unwrap().split_whitespace();
        let percent: Vec<f64> = cells.filter_map(|cell| cell.parse().ok()).collect();
        (said, percent[0])
    };
    let (said, fast) = with("");
    let rate = said
        .split("resample_hz = ")
        .nth(1)
        .and_then(|rest| rest.split(' ').next());
    let rate: f64 = rate.expect(&said).parse().unwrap();
    assert!((20.0..=100.0).contains(&rate), "{said}");
    // A part of the log is then shorter than the filters' longest.
    let (_, slow) = with(&format!(", resample_hz = {rate}"));
    println!("validation NMSE {fast} % at 1000 Hz, {slow} % at {rate} Hz");
    assert!(slow < 0.2 * fast, "{slow} % after {fast} %");
}

#[test]
fn of_two_forces_the_one_that_the_motion_explains_is_meant() {
    let folder = TempDir::new().unwrap();
    let log = text("t,x_mm,vertical_kN,horizontal_kN", |t| {
        let [x, v, _] = motion(t);
        let load = 40.0 + 5.0 * (TAU * 0.83 * t).sin();
        [t, 1e3 * x, load, 0.3 * load * x + 0.2 * v]
    });
    fs::write(folder.path().join("slide.csv"), log).unwrap();
    let study = init(&folder, &["slide.csv"]);
    says(&study, &["force = { column = \"horizontal_kN\""]);
}

#[test]
fn an_angle_beside_a_current_is_a_rotation() {
    let folder = TempDir::new().unwrap();
    let log = text("t,position_rad,velocity,current_A", |t| {
        let [x, v, _] = motion(t);
        [t, x, v, 0.4 * x + 0.2 * v]
    });
    fs::write(folder.path().join("motor.csv"), log).unwrap();
    let study = init(&folder, &["motor.csv", "--column", "force=current_A"]);
    assert!(study.contains("kind = \"rotation\""), "{study}");
    says(&study, &["displacement = { column = \"position_rad\""]);
}
