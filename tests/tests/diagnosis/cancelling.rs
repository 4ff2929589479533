//! Two effects of which one gives back what the other takes are one too many, and so are values
//! that explain nothing.

use jointwatch::diagnose::in_place::simplified;
use jointwatch::fit::identify::{Prepared, physical};
use jointwatch::study::Study;
use jointwatch_tests::program::{read_json, says, succeed};
use jointwatch_tests::written::{HEAD, write_study};
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// A restoring force by displacement and velocity.
type Force = fn(f64, f64) -> f64;

/// A record of a joint with this restoring force.
fn record(phases: [f64; 3], force: Force) -> String {
    let mut text = "t,x,F\n".to_string();
    for row in 0..4000 {
        let t = f64::from(row) / 500.0;
        let (mut x, mut v) = (0.0, 0.0);
        for (place, phase) in phases.iter().enumerate() {
            let rate = TAU * (1.1 + 1.3 * place as f64);
            let amplitude = 4e-3 / (1.0 + place as f64);
            x += amplitude * (rate * t + phase).sin();
            v += amplitude * rate * (rate * t + phase).cos();
        }
        // Nothing repeats in it, so that it serves as noise.
        let noise = 0.02 * (f64::from(row) * f64::from(row) * 0.7).sin();
        writeln!(text, "{t:.3},{x:.9},{:.6}", force(x, v) + noise).unwrap();
    }
    text
}

/// A study of two records of such a joint.
fn written(folder: &Path, terms: &str, force: Force) {
    fs::write(folder.join("a.csv"), record([0.3, 2.0, 4.4], force)).unwrap();
    fs::write(folder.join("b.csv"), record([1.9, 5.1, 0.8], force)).unwrap();
    write_study(folder, HEAD, &["a.csv", "b.csv"], 1, terms);
}

/// Damping that falls with the logarithm of the velocity: near it lies every difference of a power
/// of the velocity and a viscous force, and the nearer the larger both are.
fn logarithmic(x: f64, v: f64) -> f64 {
    8e3 * x + 300.0 * (1.0 - 0.45 * (v.abs() / 0.05 + 1e-9).ln()) * v
}

const IDENTIFY: &str = "identify study.toml --model physical -o base.json";

fn names(model: &Path) -> Vec<String> {
    let model = read_json(model);
    let effects = model["effects"].as_array().unwrap().iter();
    effects
        .map(|e| e["effect"].as_str().unwrap().to_string())
        .collect()
}

#[test]
fn what_is_added_takes_the_place_of_what_would_cancel_it() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    written(folder, "\"stiffness@x\", \"viscous@x\"", logarithmic);
    succeed(folder, IDENTIFY);
    let add = "add study.toml base.json power_damper@x -o wider.json";
    let said = succeed(folder, add);
    println!("{said}");
    says(&said, &["power_damper@x takes the place of viscous@x"]);
    assert_eq!(
        names(&folder.join("wider.json")),
        ["stiffness", "power_damper"]
    );
}

/// Dry friction with a strength per direction in a joint whose friction is the same both ways, and
/// in one where it is not.
#[test]
fn a_simpler_law_takes_the_place_of_a_general_one_where_it_does_as_well() {
    fn alike(x: f64, v: f64) -> f64 {
        2e3 * x + 12.0 * (v / 2e-3).tanh()
    }
    fn unlike(x: f64, v: f64) -> f64 {
        alike(x, v) + (v / 2e-3).tanh().max(0.0)
    }
    let cases: [(Force, _); 2] = [(alike, Some("coulomb@x")), (unlike, None)];
    for (force, simpler) in cases {
        let folder = tempfile::tempdir().unwrap();
        let terms = "\"stiffness@x\", \"coulomb_by_direction@x\"";
        written(folder.path(), terms, force);
        let study = Study::read(folder.path()).unwrap();
        let model = physical(&study).unwrap().model;
        let prepared = Prepared::with_filters(&study, model.filters.clone()).unwrap();
        let found = simplified(&study, &prepared, &model, "coulomb_by_direction@x").unwrap();
        let last = found.map(|(_, added)| added.model.effects.last().unwrap().name());
        assert_eq!(last.as_deref(), simpler);
    }
}

/// An effect that nothing is left for once the right one is there goes again; the right one stays.
#[test]
fn what_explains_nothing_beside_the_others_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let terms = "\"stiffness@x\", \"cubic_hardening@x\", \"coulomb@x\"";
    written(folder.path(), terms, |x, v| {
        2e3 * x + 12.0 * (v / 2e-3).tanh()
    });
    let study = Study::read(folder.path()).unwrap();
    let model = physical(&study).unwrap().model;
    let prepared = Prepared::with_filters(&study, model.filters.clone()).unwrap();
    let without = |effect| simplified(&study, &prepared, &model, effect).unwrap();
    let (special, added) = without("cubic_hardening@x").unwrap();
    let names: Vec<String> = added.model.effects.iter().map(|e| e.name()).collect();
    assert_eq!(special, None);
    assert_eq!(names, ["stiffness@x", "coulomb@x"]);
    assert!(without("coulomb@x").is_none());
}

/// A damper that would have to push, beside a preload: without the preload no effect has a strength
/// at all, and a sum of effects has one at least.
#[test]
fn the_last_effect_stays_though_it_has_no_strength() {
    let folder = tempfile::tempdir().unwrap();
    let terms = "\"viscous@x\", \"preload@x\"";
    written(folder.path(), terms, |_, v| 150.0 - 5.0 * v);
    let study = Study::read(folder.path()).unwrap();
    let model = physical(&study).unwrap().model;
    let prepared = Prepared::with_filters(&study, model.filters.clone()).unwrap();
    let without = simplified(&study, &prepared, &model, "preload@x").unwrap();
    assert!(without.is_none());
}

/// A damper that is seven times as strong one way, on a base with one strength for both: while the
/// law with two strengths is judged, the base's must not take up what they share, or one of them
/// would be nothing and no physics.
#[test]
fn a_general_law_is_judged_in_the_place_of_its_special_case() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    written(folder, "\"viscous@x\"", |_, v| {
        if v > 0.0 { 540.0 * v } else { 3650.0 * v }
    });
    succeed(folder, IDENTIFY);
    let diagnose = "diagnose study.toml base.json --apply -o wider.json";
    let said = succeed(folder, diagnose);
    println!("{said}");
    assert_eq!(names(&folder.join("wider.json")), ["viscous_by_direction"]);
}

/// Springs whose best description by two effects are values that cancel: moderate ones are kept for
/// their sum, with a warning, as long as neither does it alone; a stiffness of thousands of times
/// the force over the travel never is.
#[test]
fn two_that_cancel_are_kept_only_for_a_sum_of_moderate_sizes() {
    fn bent(x: f64, _: f64) -> f64 {
        let u = x / 7e-3;
        250.0 * (u.abs().powf(1.5) * u.signum() - 0.88 * u)
    }
    fn logarithmic(x: f64, _: f64) -> f64 {
        4e3 * x * (x.abs() / 3e-3 + 1e-9).ln()
    }
    let cases: [(Force, bool); 2] = [(bent, true), (logarithmic, false)];
    for (force, kept) in cases {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        written(folder, "\"stiffness@x\"", force);
        succeed(folder, IDENTIFY);
        let add = "add study.toml base.json power_spring@x -o wider.json";
        let said = succeed(folder, add);
        println!("{said}");
        let both = ["stiffness", "power_spring"];
        let expected = if kept { &both[..] } else { &both[1..] };
        assert_eq!(names(&folder.join("wider.json")), expected);
        assert_eq!(said.contains("cancel for the most part"), kept, "{said}");
    }
}
