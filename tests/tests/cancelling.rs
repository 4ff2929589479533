//! Two effects of which one gives back what the other takes are one too many.

use jointwatch_tests::program::succeed;
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// A record of a joint whose damping falls with the logarithm of the velocity: near it lies every difference of a power of the velocity and a
/// viscous force, and the nearer the larger both are.
fn record(phases: [f64; 3]) -> String {
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
        let damping = 300.0 * (1.0 - 0.45 * (v.abs() / 0.05 + 1e-9_f64).ln());
        // Nothing repeats in it, so that it serves as noise.
        let noise = 0.02 * (f64::from(row) * f64::from(row) * 0.7).sin();
        writeln!(text, "{t:.3},{x:.9},{:.6}", 8e3 * x + damping * v + noise).unwrap();
    }
    text
}

fn names(model: &Path) -> Vec<String> {
    let model: Value = serde_json::from_str(&fs::read_to_string(model).unwrap()).unwrap();
    let effects = model["effects"].as_array().unwrap().iter();
    effects
        .map(|e| e["effect"].as_str().unwrap().to_string())
        .collect()
}

#[test]
fn what_is_added_takes_the_place_of_what_would_cancel_it() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("a.csv"), record([0.3, 2.0, 4.4])).unwrap();
    fs::write(folder.join("b.csv"), record([1.9, 5.1, 0.8])).unwrap();
    let study = "time = \"t\"\n[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = \"x\"\nforce = \"F\"\ninertia = 0\n\
                 [[record]]\nfile = \"a.csv\"\nrole = \"train\"\n[[record]]\nfile = \"b.csv\"\nrole = \"validate\"\n\
                 [base]\nterms = [\"stiffness@x\", \"viscous@x\"]\n";
    fs::write(folder.join("study.toml"), study).unwrap();
    let identify = ["identify", "study.toml", "--model", "physical"];
    succeed(folder, &[&identify[..], &["-o", "base.json"]].concat());
    let add = ["add", "study.toml", "base.json", "power_damper@x"];
    let said = succeed(folder, &[&add[..], &["-o", "wider.json"]].concat());
    println!("{said}");
    assert!(
        said.contains("power_damper@x takes the place of viscous@x"),
        "{said}"
    );
    assert_eq!(
        names(&folder.join("wider.json")),
        ["stiffness", "power_damper"]
    );
}
