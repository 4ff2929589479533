//! An axis that sticks between its moves: its force there is whatever the drive pushes with, and
//! follows no motion.

use super::free_motion::noise;
use jointwatch::model::file::ModelFile;
use jointwatch_tests::program::{fail, succeed};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

const MASS: f64 = 2.0;
const FRICTION: f64 = 6.0;
const DAMPING: f64 = 4.0;
const RATE_HZ: f64 = 500.0;

/// A slide that a drive pushes this way and that with a force of this size: most pushes leave it
/// where it is, and nothing but its friction holds it.
fn run(push: f64, phase: f64) -> String {
    const STEPS: u32 = 20;
    let mut text = String::from("t,x,force\n");
    let (mut x, mut v) = (0.0, 0.0_f64);
    for row in 0..6000_u32 {
        let mut read = 0.0;
        for step in 0..STEPS {
            let t = (f64::from(row) + f64::from(step) / f64::from(STEPS)) / RATE_HZ;
            let force = push * (4.0 * t + phase).sin() * (0.4 * t + 0.3 * phase).sin();
            let dt = 1.0 / (RATE_HZ * f64::from(STEPS));
            let free = v + dt * (force - DAMPING * v) / MASS;
            let most = dt * FRICTION / MASS;
            v = if free.abs() <= most {
                0.0
            } else {
                free - most * free.signum()
            };
            x += dt * v;
            if step == 0 {
                read = force;
            }
        }
        let t = f64::from(row) / RATE_HZ;
        let counted = (x / 1e-4).round() * 1e-4;
        writeln!(
            text,
            "{t:.3},{counted:.4},{:.4}",
            read + 0.02 * noise(row, phase)
        )
        .unwrap();
    }
    text
}

fn write_study(folder: &Path, said: &str) {
    let study = format!(
        "{said}time = \"t\"\n[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = \"x\"\nforce = \"force\"\ninertia = {MASS}\n\
         [[record]]\nfile = \"a.csv\"\nrole = \"train\"\n[[record]]\nfile = \"b.csv\"\nrole = \"validate\"\n[base]\nterms = [\"viscous@x\"]\n"
    );
    fs::write(folder.join("study.toml"), study).unwrap();
}

/// The validation error, per cent, and what `coulomb@x` comes to, with what the program said.
fn with_friction(folder: &Path, said: &str) -> (f64, f64, String) {
    write_study(folder, said);
    let words = succeed(folder, &["identify", ".", "--model", "physical"]);
    succeed(folder, "add . model.json coulomb@x -o full.json");
    let model = ModelFile::read(&folder.join("full.json")).unwrap();
    let friction = model
        .effects
        .iter()
        .find(|e| e.effect == "coulomb")
        .unwrap();
    (
        model.validation[0].nmse_percent,
        friction.parameters[0].value,
        words,
    )
}

#[test]
fn rows_in_which_an_axis_sticks_are_told_and_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("a.csv"), run(18.0, 0.3)).unwrap();
    fs::write(folder.join("b.csv"), run(16.0, 1.1)).unwrap();
    let key = "leave_out_standstill = true\n";
    let (error, _, told) = with_friction(folder, "");
    assert!(told.contains("nothing moves in"), "{told}");
    assert!(told.contains(key.trim()), "{told}");
    let (moving, friction, told) = with_friction(folder, key);
    assert!(!told.contains("nothing moves in"), "{told}");
    assert!(moving < 0.5 * error, "{moving} of {error}");
    assert!((friction / FRICTION - 1.0).abs() < 0.02, "{friction}");
    succeed(folder, &["identify", ".", "--model", "physical"]);
    let given = ["diagnose", ".", "model.json", "--apply", "-o", "full.json"];
    let said = succeed(folder, &given);
    assert!(said.contains("Missing: coulomb@x"), "{said}");
    for model in ["polynomial", "network"] {
        succeed(folder, &["identify", ".", "--model", model]);
    }
}

#[test]
fn a_record_in_which_nothing_moves_is_refused_where_such_rows_are_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("a.csv"), run(18.0, 0.3)).unwrap();
    fs::write(folder.join("b.csv"), run(1.03 * FRICTION, 1.1)).unwrap();
    write_study(folder, "leave_out_standstill = true\n");
    let said = fail(folder, &["identify", ".", "--model", "physical"], 3);
    assert!(said.contains("b.csv: nothing moves in"), "{said}");
}
