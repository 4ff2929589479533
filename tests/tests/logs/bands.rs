//! The band that a log supports: no wider than the noise of what was logged allows, and wide enough
//! to try an effect.

use jointwatch::{Kind, MemoryLog, Study, Verdict, add, diagnose, identify};
use std::f64::consts::TAU;

/// Numbers from −0.5 to 0.5 that repeat for a seed.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
    }
}

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

/// A motor on a torque sensor whose velocity comes in steps that are a third of its size: rounding
/// in a derived acceleration is taken for inertia force by a wide band, and for none by least
/// squares.
#[test]
fn the_steps_of_a_logged_velocity_end_the_band_of_its_inertia_force() {
    const RATE_HZ: f64 = 1100.0;
    const INERTIA: f64 = 1e-4;
    const DAMPING: f64 = 4e-3;
    const STEP: f64 = 0.06;
    let mut drive = noise(3);
    let (mut wanted, mut speed) = (0.0, 0.0_f64);
    let (mut velocity, mut torque) = (Vec::new(), Vec::new());
    for _ in 0..4000 {
        wanted += 0.05 * (0.02 * drive() - wanted);
        torque.push(wanted + 1e-6 * drive());
        velocity.push((speed / STEP).round() * STEP);
        speed += (wanted - DAMPING * speed) / INERTIA / RATE_HZ;
    }
    let axis = "name = \"phi\"\nkind = \"rotation\"\nvelocity = \"v\"\nforce = \"M\"\n\
                restoring_force = \"force_minus_inertia\"";
    let columns = vec![("v".into(), velocity), ("M".into(), torque)];
    let study = study(axis, "viscous@phi", RATE_HZ, columns);
    let model = identify(&study, Kind::Physical).unwrap();
    assert!(model.filters.band_hz < 50.0, "{}", model.filters.reason);
    let inertia = model.axes[0].inertia;
    assert!((inertia / INERTIA - 1.0).abs() < 0.06, "{inertia}");
}

/// The same drive by which the velocity is four samples late: half of a period at the band's end,
/// of which the first order of a shift is no description.
#[test]
fn a_delay_of_much_of_a_period_is_added_and_inertia_and_damping_come_out() {
    const RATE_HZ: f64 = 1100.0;
    const INERTIA: f64 = 1e-4;
    const DAMPING: f64 = 4e-3;
    const LATE: usize = 4;
    let mut drive = noise(5);
    let (mut wanted, mut speed) = (0.0, 0.0_f64);
    let (mut velocity, mut torque) = (Vec::new(), Vec::new());
    for _ in 0..3000 {
        wanted += 0.3 * (0.02 * drive() - wanted);
        torque.push(wanted + 1e-3 * drive());
        velocity.push((speed / 0.06).round() * 0.06);
        speed += (wanted - DAMPING * speed) / INERTIA / RATE_HZ;
    }
    velocity.truncate(velocity.len() - LATE);
    torque.drain(..LATE);
    let axis = "name = \"phi\"\nkind = \"rotation\"\nvelocity = \"v\"\nforce = \"M\"\n\
                restoring_force = \"force_minus_inertia\"";
    let columns = vec![("v".into(), velocity), ("M".into(), torque)];
    let study = study(axis, "viscous@phi", RATE_HZ, columns);
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
    let late = -of("time_delay") * RATE_HZ;
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
        force.push(4e4 * at + 6e8 * at.powi(3) + 1e5 * (at - slider) + 0.2 * random());
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
