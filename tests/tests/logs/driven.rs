//! Axes that a drive turns: a draft sees inertia and weight beside large friction, and a drive that
//! answers the motion is told.

use super::free_motion::{noise, step};
use super::noise::noise as seeded;
use jointwatch::model::file::ModelFile;
use jointwatch_tests::program::{says, succeed};
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use tempfile::TempDir;

const RATE_HZ: f64 = 200.0;

/// An axis with viscous and dry friction.
#[derive(Clone, Copy)]
struct Turned {
    inertia: f64,
    weight: f64,
    viscous: f64,
    friction: f64,
}

const ARM: Turned = Turned {
    inertia: 0.14,
    weight: 3.0,
    viscous: 0.05,
    friction: 0.2,
};
const MOTOR: Turned = Turned {
    inertia: 1.95e-4,
    weight: 0.0,
    viscous: 2.7e-4,
    friction: 0.03,
};

/// What a drive turns, its torque by time and velocity from row to row; torque and angle are read
/// off by so much.
fn log(turned: Turned, seconds: f64, off: [f64; 2], torque: impl Fn(f64, f64) -> f64) -> String {
    let mut text = String::from("time_s,angle_rad,torque_Nm\n");
    let (mut state, steps) = ([0.1, 0.0], 40);
    let dt = 1.0 / RATE_HZ / f64::from(steps);
    for row in 0..(seconds * RATE_HZ) as u32 {
        let t = f64::from(row) / RATE_HZ;
        let applied = torque(t, state[1]);
        let [read, angle] = [
            applied + off[0] * noise(row, 0.3),
            state[0] + off[1] * noise(row, 0.7),
        ];
        writeln!(text, "{t:.3},{angle:.7},{read:.7}").unwrap();
        let acceleration = |q: f64, v: f64, _: f64| {
            let lost = turned.viscous * v + turned.friction * (v / 0.05).tanh();
            (applied - turned.weight * q.sin() - lost) / turned.inertia
        };
        for _ in 0..steps {
            state = step(state, t, dt, &acceleration);
        }
    }
    text
}

/// Drafts a study of two logs, learns and completes its model; what `init` and `diagnose` said, and
/// the model.
fn drafted(logs: [String; 2]) -> ([String; 2], ModelFile) {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    for (name, log) in ["a.csv", "b.csv"].iter().zip(logs) {
        fs::write(folder.join(name), log).unwrap();
    }
    let drafted = succeed(folder, &["init", "a.csv", "b.csv", "--yes"]);
    succeed(folder, &["identify", ".", "--model", "physical"]);
    let said = succeed(folder, "diagnose . model.json --apply -o applied.json");
    let model = ModelFile::read(&folder.join("applied.json")).unwrap();
    ([drafted, said], model)
}

fn value(model: &ModelFile, effect: &str) -> f64 {
    let mut effects = model.effects.iter();
    effects.find(|e| e.effect == effect).unwrap().parameters[0].value
}

fn near(value: f64, truth: f64, part: f64) {
    assert!((value / truth - 1.0).abs() < part, "{value} for {truth}");
}

#[test]
fn an_arm_is_drafted_with_its_weight_and_its_inertia() {
    let swung = |phase: f64| {
        log(ARM, 20.0, [1e-3, 1e-5], move |t, _| {
            let tone = |hz: f64| (TAU * hz * t + phase * hz).sin();
            1.4 * tone(0.37) + 1.1 * tone(0.83) + 0.9 * tone(1.7)
        })
    };
    let ([drafted, said], model) = drafted([swung(0.4), swung(2.9)]);
    says(&drafted, &["goes with the sine of the angle"]);
    assert!(!drafted.contains("no inertia shows"), "{drafted}");
    near(model.axes[0].inertia, ARM.inertia, 0.03);
    near(value(&model, "gravity"), ARM.weight, 0.03);
    near(value(&model, "coulomb"), ARM.friction, 0.1);
    assert!(!said.contains("the inertia falls"), "{said}");
}

#[test]
fn an_inertia_is_seen_beside_friction_that_is_larger() {
    let ramped = |most: f64| {
        log(MOTOR, 10.0, [1e-5; 2], move |t, _| {
            let turns = t / 4.0 + 0.25;
            most * (4.0 * (turns - (turns + 0.5).floor()).abs() - 1.0)
        })
    };
    let ([drafted, said], model) = drafted([ramped(0.08), ramped(0.05)]);
    assert!(!drafted.contains("no inertia shows"), "{drafted}");
    assert!(
        !said.contains("stands alone"),
        "a command that turns round is no wrong row: {said}"
    );
    near(model.axes[0].inertia, MOTOR.inertia, 0.03);
    near(value(&model, "coulomb"), MOTOR.friction, 0.05);
}

/// Near one frequency a spring that pushes stands for a mass, and the noise of the angle hides the
/// acceleration sooner than the displacement.
#[test]
fn a_motor_that_follows_a_sine_shows_its_inertia_and_no_spring_that_pushes() {
    let (rate_hz, most, friction) = (1000.0, 0.4, 0.07);
    let swings = TAU * 2.0;
    let mut state = [0.0, -most / MOTOR.inertia / swings];
    let (dt, mut random) = (1.25e-4, super::noise::noise(4));
    let mut text = String::from("time_s,angle_rad,torque_Nm\n");
    for row in 0..585 {
        let t = f64::from(row) / rate_hz;
        let applied = most * (swings * t).sin();
        let [angle, torque] = [state[0] + 0.05 * random(), applied + 1e-3 * random()];
        writeln!(text, "{t:.4},{angle:.5},{torque:.5}").unwrap();
        let acceleration = |_: f64, v: f64, _: f64| {
            (applied - 5e-5 * v - friction * (v / 0.05).tanh()) / MOTOR.inertia
        };
        for _ in 0..8 {
            state = step(state, t, dt, &acceleration);
        }
    }
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("a.csv"), text).unwrap();
    let drafted = succeed(folder.path(), &["init", "a.csv", "--yes"]);
    assert!(!drafted.contains("no inertia shows"), "{drafted}");
    succeed(folder.path(), &["identify", ".", "--model", "physical"]);
    let model = ModelFile::read(&folder.path().join("model.json")).unwrap();
    near(model.axes[0].inertia, MOTOR.inertia, 0.1);
}

#[test]
fn a_drive_that_pushes_along_the_velocity_is_told() {
    // The encoder is coarse, so that the drive's own law is the clearer one.
    let pushed = |most: f64| log(ARM, 8.0, [0.02, 3e-3], move |_, v| most * (v / 0.05).tanh());
    let ([_, said], model) = drafted([pushed(0.88), pushed(0.8)]);
    assert!(
        said.contains("how the drive answers the motion"),
        "{said} {:?}",
        model.axes[0]
    );
}

/// Rows of a motion of three tones, and of the force that goes with its acceleration, velocity and
/// displacement.
fn rows(force: impl Fn(f64, f64, f64) -> f64) -> String {
    let mut text = String::from("time (s),height (m),load (N)\n");
    for row in 0..4000 {
        let t = f64::from(row) / RATE_HZ;
        let tones = [(0.31, 0.05), (0.9, 0.03), (1.7, 0.02)];
        let sum = |order: i32, turn: fn(f64) -> f64| -> f64 {
            let each = tones
                .iter()
                .map(|(hz, size)| size * (TAU * hz).powi(order) * turn(TAU * hz * t));
            each.sum()
        };
        let [x, v, a] = [sum(0, f64::sin), sum(1, f64::cos), -sum(2, f64::sin)];
        writeln!(text, "{t:.3},{:.6},{:.4}", 1.0 + x, force(a, v, x)).unwrap();
    }
    text
}

/// The weight is much larger than what moves; what else is in the force seems to push, by far less
/// than the mass.
#[test]
fn what_stands_on_a_plate_shows_its_mass_and_its_weight() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    fs::write(
        folder.join("a.csv"),
        rows(|a, _, x| 72.0 * (9.81 + a) - 100.0 * x),
    )
    .unwrap();
    let drafted = succeed(folder, &["init", "a.csv", "--yes"]);
    assert!(!drafted.contains("no inertia shows"), "{drafted}");
    let study = fs::read_to_string(folder.join("study.toml")).unwrap();
    says(&study, &["\"preload@x\""]);
    succeed(folder, &["identify", ".", "--model", "physical"]);
    let model = ModelFile::read(&folder.join("model.json")).unwrap();
    near(model.axes[0].inertia, 72.0, 0.03);
    // At a height of 0.
    near(value(&model, "preload").abs(), 72.0 * 9.81 + 100.0, 0.03);
}

#[test]
fn a_line_under_tension_keeps_it_and_a_damper_about_zero_has_none() {
    for (tension, is_there) in [(5e4, true), (0.0, false), (40.0, false)] {
        let folder = TempDir::new().unwrap();
        fs::write(
            folder.path().join("a.csv"),
            rows(|_, v, _| tension + 300.0 * v),
        )
        .unwrap();
        succeed(folder.path(), &["init", "a.csv", "--yes"]);
        let study = fs::read_to_string(folder.path().join("study.toml")).unwrap();
        assert_eq!(
            study.contains("\"preload@x\""),
            is_there,
            "{tension}: {study}"
        );
    }
}

/// A log without a heading, of a servo that follows steps: the time in ms, two commands, position,
/// speed and current.
#[test]
fn commands_beside_columns_without_names_are_no_measurements() {
    let mut text = String::new();
    let mut noise = seeded(7);
    let (mut x, mut v) = (0.0_f64, 0.0_f64);
    for row in 0..1500 {
        let target = [5.0, -5.0, 2.0][row / 90 % 3];
        let mut pushed = 0.0;
        for _ in 0..20 {
            let force = (20.0 * (target - x) - 1.2 * v).clamp(-40.0, 40.0);
            let resists = 0.3 * v + 4.0 * (v / 0.2).tanh();
            v += 5e-4 * (force - resists) / 0.2;
            x += 5e-4 * v;
            pushed = force;
        }
        text += &format!(
            "{}\t{target}\t{target}\t{x:.4}\t{:.3}\t{:.3}\n",
            10 * row,
            v + 0.01 * noise(),
            pushed + 0.05 * noise()
        );
    }
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    fs::write(folder.join("servo.txt"), text).unwrap();
    let said = succeed(folder, &["init", "--yes", "servo.txt"]);
    assert!(said.contains("\"c6\" is left for the force"), "{said}");
    succeed(folder, &["identify", ".", "--model", "physical"]);
    let said = succeed(folder, &["diagnose", ".", "model.json"]);
    assert!(said.contains("coulomb@x would have friction"), "{said}");
}
