//! Waves over the displacement of which the travel holds dozens: the ripple of a motor behind a
//! screw, of a gear that turns on and on.

use super::noise::noise;
use jointwatch_tests::learnt::parameter;
use jointwatch_tests::program::{read_json, succeed};
use jointwatch_tests::written::write_study;
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

const RATE_HZ: f64 = 500.0;
/// After which the ripple repeats, rad; the joint goes through about fifty turns.
const PITCH: f64 = TAU / 6.0;
const RIPPLE: f64 = 0.05;
const FRICTION: f64 = 0.3;
const DAMPING: f64 = 0.04;

/// A spindle that goes on and on, at a speed that swells and now and then turns round. The ripple
/// is the motor's, or that of its friction.
fn record(seed: f64, of_friction: bool) -> String {
    let mut text = String::from("t,phi,M\n");
    let (mut x, mut noise) = (0.7 * seed, noise(1 + (1e3 * seed) as u64));
    for row in 0..12_000 {
        let t = f64::from(row) / RATE_HZ;
        let tones = [0.11, 0.23, 0.41].map(|f| (TAU * f * t + seed * 7.0 * f).sin());
        let v = 9.0 + 8.0 * tones.iter().sum::<f64>() / 1.5;
        x += v / RATE_HZ;
        let friction = (v / 0.05).tanh();
        let wave = RIPPLE * (TAU * x / PITCH + 0.4).sin();
        let torque = DAMPING * v
            + friction * FRICTION
            + if of_friction { wave * friction } else { wave }
            + 0.002 * noise();
        writeln!(text, "{t:.3},{x:.7},{torque:.6}").unwrap();
    }
    text
}

fn study(folder: &Path, of_friction: bool, terms: &str) {
    for (name, seed) in [("one.csv", 0.3), ("two.csv", 1.9)] {
        fs::write(folder.join(name), record(seed, of_friction)).unwrap();
    }
    let head = "time = \"t\"\n[[axis]]\nname = \"phi\"\nkind = \"rotation\"\ndisplacement = \"phi\"\nforce = \"M\"\ninertia = 0\n";
    write_study(folder, head, &["one.csv", "two.csv"], 1, terms);
}

/// Whether a model holds the wave as it was made.
fn check(model: &Value, effect: &str) {
    let pitch = parameter(model, effect, "pitch");
    assert!((pitch / PITCH - 1.0).abs() < 1e-3, "{model}");
    let [sine, cosine] = ["sine", "cosine"].map(|name| parameter(model, effect, name));
    assert!((sine.hypot(cosine) / RIPPLE - 1.0).abs() < 0.05, "{model}");
}

#[test]
fn a_ripple_of_which_the_travel_holds_hundreds_is_found_beside_friction() {
    for (of_friction, effect) in [(false, "cogging"), (true, "periodic_friction")] {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        study(folder, of_friction, "\"viscous@phi\", \"coulomb@phi\"");
        succeed(folder, "identify study.toml --model physical -o model.json");
        let diagnose = "diagnose study.toml model.json --json verdict.json --apply -o added.json";
        succeed(folder, diagnose);
        let verdict = read_json(folder.join("verdict.json"));
        assert_eq!(verdict["verdict"], "effect", "{verdict}");
        assert_eq!(verdict["found"][0]["effect"], effect, "{verdict}");
        check(&read_json(folder.join("added.json")), effect);

        // Named in the base, it is found by `identify` as well, and the device takes it.
        study(
            folder,
            of_friction,
            &format!("\"viscous@phi\", \"coulomb@phi\", \"{effect}@phi\""),
        );
        succeed(folder, "identify study.toml --model physical -o model.json");
        check(&read_json(folder.join("model.json")), effect);
        succeed(folder, "export model.json -o model.bin");
    }
}
