//! Records without an applied force: a pendulum that swings out, a body on a shaken base.

use jointwatch_tests::learnt::value;
use jointwatch_tests::program::{fail, read_json, says, succeed};
use jointwatch_tests::written::write_study;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

const RATE_HZ: f64 = 500.0;
const INERTIA: f64 = 0.8;
const WEIGHT: f64 = 8.24;

/// A pendulum's pivot and air, and what reads its angle.
#[derive(Clone, Copy)]
struct Losses {
    friction: f64,
    damping: f64,
    drag: f64,
    noise: f64,
    /// Step of the encoder; 0 for a finer one.
    step: f64,
    /// Where it is let go.
    from: [f64; 3],
    /// Rows of each log, of which every so many is kept.
    rows: (usize, usize),
}

const MANY: Losses = Losses {
    friction: 0.1,
    damping: 0.0,
    drag: 0.06,
    noise: 2e-5,
    step: 0.0,
    from: [1.6, 1.0, 1.3],
    rows: (7500, 1),
};
/// So few that a viscous damper stands for either of them alone as well as the other one does
/// beside it.
const FEW: Losses = Losses {
    friction: 0.024,
    drag: 0.008,
    noise: 1e-4,
    from: [1.1, 0.7, 0.9],
    ..MANY
};
/// What an encoder of 4096 steps a turn reads at 100 Hz, until long after the pendulum has stopped.
const TO_THE_END: Losses = Losses {
    friction: 0.053,
    damping: 0.0124,
    drag: 0.0185,
    noise: 0.0,
    step: TAU / 4096.0,
    from: [1.2, 2.4, 1.0],
    rows: (45_000, 5),
};

/// Moves states on by a step of a fourth-order rule, `acceleration` from displacement, velocity and
/// time.
pub(super) fn step(
    [x, v]: [f64; 2],
    t: f64,
    dt: f64,
    acceleration: &dyn Fn(f64, f64, f64) -> f64,
) -> [f64; 2] {
    let slope = |x: f64, v: f64, t: f64| [v, acceleration(x, v, t)];
    let a = slope(x, v, t);
    let b = slope(x + 0.5 * dt * a[0], v + 0.5 * dt * a[1], t + 0.5 * dt);
    let c = slope(x + 0.5 * dt * b[0], v + 0.5 * dt * b[1], t + 0.5 * dt);
    let d = slope(x + dt * c[0], v + dt * c[1], t + dt);
    let mean = |i: usize| (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]) / 6.0;
    [x + dt * mean(0), v + dt * mean(1)]
}

/// Noise of no seed, between −1 and 1.
pub(super) fn noise(row: u32, shift: f64) -> f64 {
    ((f64::from(row) + shift) * 12.9898).sin() * 43758.5453 % 1.0
}

/// A pendulum with dry friction and drag that is let go, after a hand has moved it through these
/// angles.
fn swings_out(hand: &[f64], from: f64, losses: Losses) -> String {
    let mut text = String::from("t,angle\n");
    let before = hand.iter().chain(std::iter::repeat(&0.0));
    let mut state = [from, 0.0];
    let dt = 1.0 / RATE_HZ / 10.0;
    let acceleration = |q: f64, v: f64, _: f64| {
        let lost =
            losses.drag * v * v.abs() + losses.damping * v + losses.friction * (v / 2e-3).tanh();
        -(WEIGHT * q.sin() + lost) / INERTIA
    };
    let (rows, every) = losses.rows;
    for (row, moved) in (0..rows + hand.len()).zip(before) {
        let is_held = row < hand.len();
        let angle = if is_held { *moved } else { state[0] };
        let mut q = angle + losses.noise * noise(row as u32, from);
        if losses.step > 0.0 {
            q = ((q + 0.03) / losses.step).round() * losses.step;
        }
        if row % every == 0 {
            writeln!(text, "{:.4},{q:.8}", row as f64 / RATE_HZ).unwrap();
        }
        for _ in 0..if is_held { 0 } else { 10 } {
            state = step(state, 0.0, dt, &acceleration);
        }
    }
    text
}

const FILES: [&str; 3] = ["high.csv", "low.csv", "middle.csv"];

fn pendulum(folder: &Path, force: &str, inertia: &str, losses: Losses) {
    let head = format!(
        "time = \"t\"\n[[axis]]\nname = \"q\"\nkind = \"rotation\"\ndisplacement = \"angle\"\nforce = {force}\n{inertia}\n"
    );
    write_study(folder, &head, &FILES, 2, "\"gravity@q\", \"viscous@q\"");
    for (file, from) in FILES.iter().zip(losses.from) {
        fs::write(folder.join(file), swings_out(&[], from, losses)).unwrap();
    }
}

const IDENTIFY: &str = "identify study.toml --model physical -o model.json";
const APPLY: &str = "diagnose study.toml model.json --apply -o added.json --json verdict.json";

#[test]
fn a_free_decay_names_its_friction_and_its_drag_and_no_instrument() {
    named(MANY);
}

/// Neither lowers the error by itself.
#[test]
fn losses_that_help_only_together_are_found_together() {
    named(FEW);
}

/// Each log begins with a pendulum at rest that a hand lifts and holds.
#[test]
fn what_a_hand_does_before_it_lets_go_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (file, from) in FILES.iter().zip(MANY.from) {
        let lifted = (0..1000).map(|row| from * (0.001 * f64::from(row)).min(0.8) / 0.8);
        let hand: Vec<f64> = std::iter::repeat_n(0.0, 1500).chain(lifted).collect();
        fs::write(folder.join(file), swings_out(&hand, from, MANY)).unwrap();
    }
    let init = "init --yes high.csv low.csv middle.csv --column force=0";
    let findings = succeed(folder, &format!("{init} --inertia {INERTIA}"));
    assert!(
        findings.contains("the body moves freely in rows [25"),
        "{findings}"
    );
    named_in(folder, MANY);
}

/// Dry friction holds it wherever it stops, for longer than it has swung.
#[test]
fn what_follows_when_a_pendulum_has_stopped_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (file, from) in FILES.iter().zip(TO_THE_END.from) {
        fs::write(folder.join(file), swings_out(&[], from, TO_THE_END)).unwrap();
    }
    let init = "init --yes high.csv low.csv middle.csv --column force=0";
    let said = succeed(folder, &format!("{init} --inertia {INERTIA}"));
    says(
        &said,
        &["the body moves freely in rows [0, 4", "or it rests"],
    );
    succeed(folder, IDENTIFY);
    succeed(folder, APPLY);
    let model = read_json(folder.join("added.json"));
    let off = value(&model, "coulomb") / TO_THE_END.friction - 1.0;
    assert!(off.abs() < 0.05, "friction is off by {off}: {model}");
}

fn named(losses: Losses) {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    pendulum(folder, "0", &format!("inertia = {INERTIA}"), losses);
    named_in(folder, losses);
}

fn named_in(folder: &Path, losses: Losses) {
    succeed(folder, IDENTIFY);
    succeed(folder, APPLY);
    let verdict = read_json(folder.join("verdict.json"));
    let names = |key: &str| -> Vec<String> {
        let list = verdict[key].as_array().unwrap().iter();
        list.map(|e| e["effect"].as_str().unwrap().to_owned())
            .collect()
    };
    let mut found = names("found");
    found.sort();
    assert_eq!(verdict["verdict"], "effect", "{verdict}");
    assert_eq!(found, ["coulomb", "quadratic_drag"], "{verdict}");
    for instrument in ["inertia_error", "force_gain", "time_delay", "crosstalk"] {
        assert!(
            !names("ranked").iter().any(|n| n == instrument),
            "{verdict}"
        );
    }
    let model = read_json(folder.join("added.json"));
    for (effect, truth) in [
        ("gravity", WEIGHT),
        ("coulomb", losses.friction),
        ("quadratic_drag", losses.drag),
    ] {
        let off = value(&model, effect) / truth - 1.0;
        assert!(off.abs() < 0.05, "{effect} is off by {off}: {model}");
    }
}

/// Stiffness, damping and cubic stiffness of a body on a shaken base, per unit of its mass.
const ON_BASE: [f64; 3] = [900.0, 6.0, 4e6];
/// One that hardly follows its base.
const ISOLATED: [f64; 3] = [60.0, 2.0, 8e4];

/// Two logs of that body, each row made by `columns` of time, position of the base, of the body,
/// and the accelerations of both.
fn on_shaken_base(folder: &Path, law: [f64; 3], heading: &str, columns: fn([f64; 5]) -> String) {
    let [stiffness, damping, cubic] = law;
    for (name, shift) in [("one", 0.2), ("two", 1.9)] {
        let mut text = format!("{heading}\n");
        let ground = |t: f64| {
            let tones = [1.7, 3.1, 4.3, 5.9].map(|f| (TAU * f * t + shift * f).sin() / f);
            6e-3 * tones.iter().sum::<f64>()
        };
        let speed = |t: f64| (ground(t + 1e-5) - ground(t - 1e-5)) / 2e-5;
        let shaken = |t: f64| (speed(t + 1e-4) - speed(t - 1e-4)) / 2e-4;
        let acceleration = |x: f64, v: f64, t: f64| {
            let apart = x - ground(t);
            -(stiffness * apart + cubic * apart.powi(3) + damping * (v - speed(t)))
        };
        let mut state = [ground(0.0), 0.0];
        for row in 0..6000 {
            let t = f64::from(row) / RATE_HZ;
            let body = state[0] + 1e-7 * noise(row, shift);
            let a = acceleration(state[0], state[1], t) + 1e-3 * noise(row, 3.0 * shift);
            let of_base = shaken(t) + 1e-3 * noise(row, 5.0 * shift);
            writeln!(text, "{}", columns([t, ground(t), body, a, of_base])).unwrap();
            for part in 0..5 {
                let dt = 0.2 / RATE_HZ;
                state = step(state, t + f64::from(part) * dt, dt, &acceleration);
            }
        }
        fs::write(folder.join(format!("{name}.csv")), text).unwrap();
    }
}

/// Values of a model's effects against those of the body on a shaken base.
fn assert_on_base(folder: &Path, law: [f64; 3], tolerance: f64) {
    let model = read_json(folder.join("added.json"));
    for (effect, truth) in ["stiffness", "viscous", "cubic_hardening"]
        .into_iter()
        .zip(law)
    {
        let off = value(&model, effect) / truth - 1.0;
        assert!(off.abs() < tolerance, "{effect} is off by {off}: {model}");
    }
}

#[test]
fn a_body_on_a_shaken_base_shows_its_spring_per_unit_of_mass() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    on_shaken_base(folder, ON_BASE, "t,base,body,a", |[t, base, body, a, _]| {
        format!("{t:.4},{base:.9},{body:.9},{a:.6}")
    });
    let head = "time = \"t\"\n[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = [\"body\", \"base\"]\n\
                body_position = \"body\"\nacceleration = \"a\"\nforce = 0\ninertia = 1\n";
    let base = "\"stiffness@x\", \"viscous@x\"";
    write_study(folder, head, &["one.csv", "two.csv"], 1, base);
    succeed(folder, IDENTIFY);
    let diagnose = "diagnose study.toml model.json --json verdict.json";
    succeed(folder, diagnose);
    let verdict = read_json(folder.join("verdict.json"));
    assert_eq!(
        verdict["found"][0]["effect"], "cubic_hardening",
        "{verdict}"
    );
    succeed(
        folder,
        "add study.toml model.json cubic_hardening@x -o added.json",
    );
    assert_on_base(folder, ON_BASE, 0.03);
}

/// A log of a shaken base: the body's law, its heading, its rows, and what study.toml has to hold.
type Logged = (
    [f64; 3],
    &'static str,
    fn([f64; 5]) -> String,
    &'static [&'static str],
);

#[test]
fn a_shaken_base_is_drafted_from_whatever_was_logged() {
    let logged: [Logged; 5] = [
        (
            ON_BASE,
            "t,x_base [m],x_body [m]",
            |[t, base, body, ..]| format!("{t:.4},{base:.9},{body:.9}"),
            &[
                "is a base that is shaken",
                "displacement = [{ column = \"x_base [m]\", unit = \"m\" }, { column = \"x_body [m]\", unit = \"m\" }]",
            ],
        ),
        (
            ON_BASE,
            "t,drift [mm],a [m/s^2]",
            |[t, base, body, a, _]| format!("{t:.4},{:.6},{a:.6}", 1e3 * (body - base)),
            &[
                "displacement = { column = \"drift [mm]\", unit = \"mm\" }",
                "acceleration = { column = \"a [m/s^2]\"",
            ],
        ),
        (
            ISOLATED,
            "t,drift [mm],a [m/s^2]",
            |[t, base, body, a, _]| format!("{t:.4},{:.6},{a:.6}", 1e3 * (base - body)),
            &[
                "displacement = { column = \"drift [mm]\", unit = \"mm\" }",
                "is no second derivative of \"drift [mm]\"",
                "restoring_force = \"inertia_minus_force\"",
                "acceleration = { column = \"a [m/s^2]\"",
            ],
        ),
        // Near its resonance the body's own acceleration looks like the drift's.
        (
            ON_BASE,
            "t,drift [mm],a_body [m/s^2],a_base [m/s^2]",
            |[t, base, body, a, of_base]| {
                format!("{t:.4},{:.6},{a:.6},{of_base:.6}", 1e3 * (body - base))
            },
            &[
                "\"a_body [m/s^2]\" is no second derivative of \"drift [mm]\"",
                "acceleration = { column = \"a_body [m/s^2]\"",
                "file = \"one.csv\"   # relative to this file\nrole = \"train\"   # learnt from\n\n",
            ],
        ),
        (
            ON_BASE,
            "t,a1 [m/s^2],a2 [m/s^2]",
            |[t, _, _, a, of_base]| format!("{t:.4},{of_base:.6},{a:.6}"),
            &[
                "is a base that is shaken",
                "integrate_above_hz",
                "acceleration = { column = \"a2 [m/s^2]\"",
            ],
        ),
    ];
    for (law, heading, rows, held) in logged {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        on_shaken_base(folder, law, heading, rows);
        let said = succeed(folder, "init --yes one.csv two.csv --column force=0");
        let study = said + &fs::read_to_string(folder.join("study.toml")).unwrap();
        for held in held {
            assert!(study.contains(held), "{held} is not in {study}");
        }
        succeed(folder, IDENTIFY);
        succeed(folder, APPLY);
        assert_on_base(folder, law, 0.1);
    }
}

#[test]
fn a_force_that_is_no_force_is_refused_with_what_to_write() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (force, inertia, words) in [
        ("0", "", "inertia = 1 to have every force per unit of it"),
        (
            "0",
            "inertia = 0",
            "inertia = 1 to have every force per unit of it",
        ),
        ("2.5", "inertia = 1", "or 0"),
        ("[]", "inertia = 1", "force needs a column"),
    ] {
        pendulum(folder, force, inertia, MANY);
        let said = fail(folder, IDENTIFY, 3);
        assert!(said.contains(words), "force = {force}: {said}");
        assert!(said.contains("line 6"), "{said}");
    }
}
