//! A shaken body of which nothing but force and acceleration is logged.

use super::free_motion::noise;
use jointwatch::model::file::ModelFile;
use jointwatch::study::{Study, mistakes};
use jointwatch_tests::program::{fail, says, succeed};
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

const MASS: f64 = 2.0;
const STIFFNESS: f64 = 5000.0;
const DAMPING: f64 = 12.0;
const CUBIC: f64 = 2e8;
const RATE_HZ: f64 = 1000.0;

/// A body on a hardening spring beside an exciter; its accelerometer has an offset, drift and
/// noise.
fn run(size: f64, phase: f64) -> String {
    const STEPS: u32 = 10;
    let mut text = String::from("t [s],acc [g],load [N]\n");
    let (mut x, mut v) = (0.0, 0.0_f64);
    for row in 0..12_000_u32 {
        let mut read = [0.0; 2];
        for step in 0..STEPS {
            let t = (f64::from(row) + f64::from(step) / f64::from(STEPS)) / RATE_HZ;
            let sines = (1..=12_u32).map(|line| {
                let line = f64::from(line);
                (TAU * (2.0 + 1.3 * line) * t + phase * line * line).sin()
            });
            let force = size * sines.sum::<f64>();
            let acceleration = (force - DAMPING * v - STIFFNESS * x - CUBIC * x * x * x) / MASS;
            let dt = 1.0 / (RATE_HZ * f64::from(STEPS));
            v += dt * acceleration;
            x += dt * v;
            if step == 0 {
                read = [acceleration, force];
            }
        }
        let t = f64::from(row) / RATE_HZ;
        let drift = 0.01 * (TAU * 0.15 * t).sin() + 0.2;
        let [a, f] = read;
        writeln!(
            text,
            "{t:.3},{:.6},{:.4}",
            (a + drift + 0.01 * noise(row, phase)) / 9.80665,
            f + 0.02 * noise(row, phase + 0.5)
        )
        .unwrap();
    }
    text
}

fn logs(folder: &Path) {
    fs::write(folder.join("a.csv"), run(3.0, 0.7)).unwrap();
    fs::write(folder.join("b.csv"), run(2.5, 1.9)).unwrap();
}

#[test]
fn force_and_acceleration_alone_give_mass_spring_and_what_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    logs(folder);
    let told = succeed(folder, &["init", "--yes", "a.csv", "b.csv"]);
    assert!(told.contains("the acceleration integrated twice"), "{told}");
    let drafted = fs::read_to_string(folder.join("study.toml")).unwrap();
    let key = "integrate_above_hz = ";
    let above = drafted.lines().find(|l| l.starts_with(key)).unwrap();
    let above = above[key.len()..].split_whitespace().next().unwrap();
    let above_hz: f64 = above.parse().unwrap();
    // The lowest line of the drive is at 3.3 Hz.
    assert!((0.5..3.3).contains(&above_hz), "{drafted}");

    succeed(folder, &["identify", ".", "--model", "physical"]);
    // What is slower than the drive is not known, so other laws that stiffen come near the cubic
    // one.
    let said = succeed(folder, &["diagnose", ".", "model.json"]);
    let named = said
        .lines()
        .filter(|l| l.starts_with("Missing:") || l.starts_with("These"));
    assert!(
        named.clone().any(|l| l.contains("cubic_hardening")),
        "{said}"
    );
    succeed(folder, "add . model.json cubic_hardening@x -o full.json");
    let model = ModelFile::read(&folder.join("full.json")).unwrap();
    let error = model.validation[0].nmse_percent;
    assert!(error < 1.0, "{error} %");
    for (effect, value) in [
        ("stiffness", STIFFNESS),
        ("viscous", DAMPING),
        ("cubic_hardening", CUBIC),
    ] {
        let found = model.effects.iter().find(|e| e.effect == effect).unwrap();
        let found = found.parameters[0].value;
        assert!((found / value - 1.0).abs() < 0.05, "{effect}: {found}");
    }
    let inertia = model.axes[0].inertia;
    assert!((inertia / MASS - 1.0).abs() < 0.02, "{inertia}");
}

#[test]
fn what_cannot_be_integrated_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    logs(folder);
    let study = |keys: &str| {
        let text = format!(
            "time = \"t [s]\"\n[[axis]]\nname = \"x\"\nkind = \"translation\"\nforce = \"load [N]\"\n{keys}\n\
             [[record]]\nfile = \"a.csv\"\nrole = \"train\"\n"
        );
        fs::write(folder.join("study.toml"), text).unwrap();
        fail(folder, &["identify", ".", "--model", "physical"], 3)
    };
    let said = study("acceleration = \"acc [g]\"\nintegrate_above_hz = 2.0");
    assert!(said.contains("there is no displacement"), "{said}");
    let said = study("displacement = \"acc [g]\"\nintegrate_above_hz = -2.0");
    assert!(said.contains("must be a number above 0"), "{said}");
    let said = study("displacement = \"acc [g]\"\nintegrate_above_hz = 600.0");
    assert!(said.contains("not below half the sample rate"), "{said}");
    // An acceleration as a displacement by mistake.
    let said = study("displacement = \"acc [g]\"");
    assert!(said.contains("\"g\""), "{said}");
}

/// Where the displacement begins at 12 Hz, the drive's lines below that say nothing of the joint.
#[test]
fn the_band_reaches_what_is_known_of_an_integrated_displacement() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    logs(folder);
    let study = |band: &str| {
        let text = format!(
            "time = \"t [s]\"\n{band}\n[[axis]]\nname = \"x\"\nkind = \"translation\"\nforce = \"load [N]\"\n\
             displacement = \"acc [g]\"\nacceleration = \"acc [g]\"\nintegrate_above_hz = 12.0\ninertia = {MASS}\n\
             restoring_force = \"inertia_minus_force\"\n[[record]]\nfile = \"a.csv\"\nrole = \"train\"\n\
             [base]\nterms = [\"stiffness@x\"]\n"
        );
        fs::write(folder.join("study.toml"), text).unwrap();
    };
    study("");
    succeed(folder, &["identify", ".", "--model", "physical"]);
    let model = ModelFile::read(&folder.join("model.json")).unwrap();
    assert!(model.filters.band_hz > 12.0, "{}", model.filters.reason);
    // The displacement is made of the accelerometer, which says nothing of its sign.
    let told = mistakes::check(&Study::read(&folder.join("study.toml")).unwrap());
    assert!(
        !told.iter().any(|said| said.contains("the acceleration")),
        "{told:?}"
    );
    study("band_hz = 8.0");
    let said = fail(folder, &["identify", ".", "--model", "physical"], 3);
    says(&said, &["band_hz = 8", "integrated above 12 Hz", "lower"]);
}

#[test]
fn two_accelerometers_without_that_of_the_body_are_told_what_is_derived() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let log = run(3.0, 0.7);
    let beside = |(row, line): (usize, &str)| match row {
        0 => format!("{line},far [g]\n"),
        _ => format!("{line},{:.6}\n", 0.02 * (0.05 * row as f64).sin()),
    };
    let with_far: String = log.lines().enumerate().map(beside).collect();
    fs::write(folder.join("a.csv"), with_far).unwrap();
    let text = format!(
        "time = \"t [s]\"\n[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = [\"far [g]\", \"acc [g]\"]\n\
         integrate_above_hz = 2.0\nforce = \"load [N]\"\ninertia = {MASS}\nrestoring_force = \"inertia_minus_force\"\n\
         [[record]]\nfile = \"a.csv\"\nrole = \"train\"\n[base]\nterms = [\"stiffness@x\", \"viscous@x\"]\n"
    );
    fs::write(folder.join("study.toml"), text).unwrap();
    let said = succeed(folder, &["identify", ".", "--model", "physical"]);
    says(&said, &["the acceleration integrated twice above 2 Hz"]);
    assert!(
        said.contains("acceleration is derived from the relative displacement"),
        "{said}"
    );
}
