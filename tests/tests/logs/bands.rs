//! The band that a log supports: no wider than the noise of what was logged allows, and wide enough
//! to try an effect.

use crate::noise::noise;
use jointwatch::{Kind, MemoryLog, Study, Verdict, add, diagnose, identify};
use std::f64::consts::TAU;

fn study(axis: &str, terms: &str, rate_hz: f64, columns: Vec<(String, Vec<f64>)>) -> Study {
    let text = format!(
        "sample_rate_hz = {rate_hz:.1}\n[[axis]]\n{axis}\n[[record]]\nfile = \"a\"\nrole = \"train\"\n\
         [base]\nterms = [\"{terms}\"]\n"
    );
    let log = MemoryLog {
        name: "a".into(),
        columns,
    };
    Study::of_memory("memory", &text, &[log]).unwrap()
}

const MOTOR_HZ: f64 = 1100.0;
const INERTIA: f64 = 1e-4;
const DAMPING: f64 = 4e-3;

/// A motor on a torque sensor: its drive is noise behind a lag that takes `follows` of what is left
/// in each row, and its velocity comes in steps and `late` rows after the torque.
fn motor(seed: u64, rows: usize, (follows, torque_noise): (f64, f64), late: usize) -> Study {
    const STEP: f64 = 0.06;
    let mut noise = noise(seed);
    let mut drive = || 0.5 * noise();
    let (mut wanted, mut speed) = (0.0, 0.0_f64);
    let (mut velocity, mut torque) = (Vec::new(), Vec::new());
    for _ in 0..rows {
        wanted += follows * (0.02 * drive() - wanted);
        torque.push(wanted + torque_noise * drive());
        velocity.push((speed / STEP).round() * STEP);
        speed += (wanted - DAMPING * speed) / INERTIA / MOTOR_HZ;
    }
    velocity.truncate(rows - late);
    torque.drain(..late);
    let axis = "name = \"phi\"\nkind = \"rotation\"\nvelocity = \"v\"\nforce = \"M\"\n\
                restoring_force = \"force_minus_inertia\"";
    let columns = vec![("v".into(), velocity), ("M".into(), torque)];
    study(axis, "viscous@phi", MOTOR_HZ, columns)
}

/// The steps are a third of the velocity's size: rounding in a derived acceleration is taken for
/// inertia force by a wide band, and for none by least squares.
#[test]
fn the_steps_of_a_logged_velocity_end_the_band_of_its_inertia_force() {
    let study = motor(3, 4000, (0.05, 1e-6), 0);
    let model = identify(&study, Kind::Physical).unwrap();
    assert!(model.filters.band_hz < 50.0, "{}", model.filters.reason);
    let inertia = model.axes[0].inertia;
    assert!((inertia / INERTIA - 1.0).abs() < 0.06, "{inertia}");
}

/// The velocity is four samples late: half of a period at the band's end, of which the first order
/// of a shift is no description.
#[test]
fn a_delay_of_much_of_a_period_is_added_and_inertia_and_damping_come_out() {
    let study = motor(5, 3000, (0.3, 1e-3), 4);
    let model = identify(&study, Kind::Physical).unwrap();
    let added = add(&study, &model, &["time_delay@phi".into()]).unwrap();
    let (before, after) = (&added.errors.before[0], &added.errors.after[0]);
    assert!(
        after.relative_error < 0.3 * before.relative_error,
        "{:?}",
        added.errors
    );
    let inertia = added.model.axes[0].inertia;
    assert!((inertia / INERTIA - 1.0).abs() < 0.1, "{inertia}");
    let of = |effect: &str| {
        let all = added.model.effects.iter();
        let mut own = all.filter(|e| e.effect == effect);
        own.next().expect("the effect").parameters[0].value
    };
    assert!(
        (of("viscous") / DAMPING - 1.0).abs() < 0.05,
        "{}",
        of("viscous")
    );
    // From one sample to the next, a step comes half a sample later still.
    let late = -of("time_delay") * MOTOR_HZ;
    assert!((4.0..5.0).contains(&late), "{late} samples");
}

/// A slow test in a testing machine, of half a cycle: nearly all of the force's power lies within
/// so narrow a band that less than thirty independent values would be left.
#[test]
fn a_short_slow_log_is_not_too_short_for_two_effects() {
    const RATE_HZ: f64 = 5.0;
    let mut random = noise(7);
    let (mut x, mut force, mut slider) = (Vec::new(), Vec::new(), 0.0_f64);
    for row in 0..160_u32 {
        let t = f64::from(row) / RATE_HZ;
        let at = 0.01 * (1.0 - (-t / 3.0).exp()) * (TAU * t / 60.0).sin();
        slider = slider.clamp(at - 1e-3, at + 1e-3);
        x.push(at);
        force.push(4e4 * at + 6e8 * at.powi(3) + 1e5 * (at - slider) + 0.1 * random());
    }
    let axis =
        "name = \"x\"\nkind = \"translation\"\ndisplacement = \"x\"\nforce = \"F\"\ninertia = 0";
    let columns = vec![("x".into(), x), ("F".into(), force)];
    let study = study(axis, "stiffness@x\", \"viscous@x", RATE_HZ, columns);
    let model = identify(&study, Kind::Physical).unwrap();
    let answer = diagnose(&study, &model).unwrap();
    assert_eq!(answer.verdict, Verdict::Effect, "{:?}", answer.notes);
    let mut found: Vec<&str> = answer.found.iter().map(|f| f.effect.as_str()).collect();
    found.sort_unstable();
    assert_eq!(found, ["cubic_hardening", "jenkins"]);
    let left = answer.relative_error_after["x"] / answer.relative_error_before["x"];
    assert!(left < 0.01, "{left}");
}
