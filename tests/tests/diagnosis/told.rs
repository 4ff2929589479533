//! What is told beside the figures: loads that stand still, errors above the noise, look-alikes.

use jointwatch_tests::program::{json, says, succeed};
use jointwatch_tests::written::{HEAD, write_study};
use std::fs;
use std::path::Path;

const RATE_HZ: f64 = 100.0;

/// Writes a log of a slow swing, with a force of its own in every row.
fn write_log(folder: &Path, name: &str, force: impl Fn(f64, f64) -> f64) {
    write_swing(folder, name, 2e-3, force);
}

/// The same of a swing of this size.
fn write_swing(folder: &Path, name: &str, size: f64, force: impl Fn(f64, f64) -> f64) {
    let rows = (0..3000).map(|row| {
        let t = f64::from(row) / RATE_HZ;
        let x = size * ((2.1 * t).sin() + 0.6 * (3.7 * t).sin());
        format!("{t},{x},{}\n", force(t, x))
    });
    let log = format!("t,x_m,F_N\n{}", rows.collect::<String>());
    fs::write(folder.join(name), log).unwrap();
}

/// A force that follows nothing that was logged: tones that the motion does not have.
fn of_nothing(t: f64, phase: f64) -> f64 {
    (1.3 * t + phase).sin() + (2.9 * t + 2.0 * phase).sin() + (4.6 * t + 3.0 * phase).cos()
}

/// Drafts and identifies with a base of its own.
fn identify(folder: &Path, terms: &str) {
    succeed(folder, "init --yes a.csv b.csv --inertia 0");
    let path = folder.join("study.toml");
    let study = fs::read_to_string(&path).unwrap();
    let (before, _) = study.split_once("[base]").unwrap();
    fs::write(&path, format!("{before}[base]\nterms = [{terms}]\n")).unwrap();
    succeed(folder, "identify . --model physical -o base.json");
}

#[test]
fn of_a_load_that_stands_still_the_error_is_told_beside_what_varies() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write_log(here, "a.csv", |t, _| 5000.0 + 5.0 * of_nothing(t, 0.0));
    write_log(here, "b.csv", |t, _| 5000.0 + 5.0 * of_nothing(t, 1.0));
    identify(here, "\"viscous@x\"");
    let said = succeed(here, "compare . base.json");
    says(
        &said,
        &["In b.csv the mean force of x predicts better than the model: NMSE above 100 %."],
    );
    let said = succeed(here, "diagnose . base.json");
    says(
        &said,
        &[
            "of the power of its force on the validation records is constant",
            "relative to what varies, the error goes from",
        ],
    );
    // What varies is no tolerance of the load, and nothing explains it.
    let json = json(here, "diagnose . base.json");
    let after = json["relative_error_after"]["x"].as_f64().unwrap();
    assert!(after < 3e-3, "{after}");
    assert_eq!(json["verdict"], "unknown", "{json:#}");
}

#[test]
fn what_is_small_in_training_and_large_in_validation_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    for (name, size) in [("a.csv", 0.6e-3), ("b.csv", 4e-3)] {
        // Tones that the motion does not have stand for noise.
        write_swing(here, name, size, |t, x| {
            1e5 * x + 1.2e9 * x * x * x + 40.0 * size * of_nothing(t, size)
        });
    }
    let terms = "\"stiffness@x\", \"viscous@x\"";
    let head = HEAD.replace("\"x\"\nforce = \"F\"", "\"x_m\"\nforce = \"F_N\"");
    write_study(here, &head, &["a.csv", "b.csv"], 1, terms);
    succeed(here, "identify . --model physical -o base.json");
    let json = json(here, "diagnose . base.json");
    println!("{} {}", json["verdict"], json["found"]);
    assert_eq!(json["verdict"], "effect");
    assert_eq!(json["found"][0]["effect"], "cubic_hardening");
    let error = |when: &str| {
        json[format!("relative_error_{when}")]["x"]
            .as_f64()
            .unwrap()
    };
    assert!(error("after") < 0.05 * error("before"), "{json}");
}

#[test]
fn what_is_much_like_an_effect_and_predicts_worse_is_told_apart_from_it() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    succeed(
        here,
        "simulate --out rig --axes 1 --hidden jenkins@x --share 0.1 --duration 4",
    );
    succeed(here, "identify rig --model physical -o base.json");
    let said = succeed(here, "diagnose rig base.json");
    let open = said
        .lines()
        .find(|l| l.starts_with("These records cannot tell jenkins@x"));
    let open = open.map_or("", |line| {
        line.split_once(": one of them").map_or("", |l| l.0)
    });
    let worse = said
        .lines()
        .find(|l| l.starts_with("Much like jenkins@x, but worse here: "));
    let worse = worse.unwrap_or_else(|| panic!("{said}"));
    assert!(worse.contains("bouc_wen"), "{said}");
    assert!(!open.contains("bouc_wen,"), "{said}");
}
