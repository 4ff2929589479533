//! A stop or a contact on one side of a joint alone, and on both.

use jointwatch::{Kind, MemoryLog, Study, diagnose, identify};
use std::f64::consts::TAU;

const RATE_HZ: f64 = 1000.0;
/// Where a side is touched, m.
const AT: f64 = 2.5e-3;

/// A spring and a damper, with what `contact` makes of the way beyond the place that is touched.
fn log(name: &str, phase: f64, side: f64, contact: impl Fn(f64) -> f64) -> MemoryLog {
    let (mut x, mut force) = (Vec::new(), Vec::new());
    for row in 0..8000_u32 {
        let t = f64::from(row) / RATE_HZ;
        let tones = [(1.1, 2.0), (2.7, 1.4), (4.3, 0.9)];
        let [mut at, mut speed] = [0.0; 2];
        for (hz, size) in tones {
            let turn = TAU * hz * (1.0 + 0.03 * phase) * t + phase * hz;
            at += 1e-3 * size * turn.sin();
            speed += 1e-3 * size * TAU * hz * turn.cos();
        }
        let noise = (f64::from(row) * 12.9898 + phase).sin() * 43758.5453 % 1.0;
        x.push(at);
        force.push(2e4 * at + 30.0 * speed + side * contact(side * at - AT) + 0.05 * noise);
    }
    MemoryLog {
        name: name.into(),
        columns: vec![("x".into(), x), ("F".into(), force)],
    }
}

/// Learns spring and damper, and says what is missing and by how much it lowers the error.
fn missing(side: f64, contact: impl Fn(f64) -> f64) -> (Vec<String>, f64) {
    let text = format!(
        "sample_rate_hz = {RATE_HZ:.1}\n[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = \"x\"\nforce = \"F\"\n\
         inertia = 0\n[[record]]\nfile = \"a\"\nrole = \"train\"\n[[record]]\nfile = \"b\"\nrole = \"validate\"\n\
         [base]\nterms = [\"stiffness@x\", \"viscous@x\"]\n"
    );
    let logs = [log("a", 0.4, side, &contact), log("b", 1.7, side, &contact)];
    let study = Study::of_memory("memory", &text, &logs).unwrap();
    let model = identify(&study, Kind::Physical).unwrap();
    let answer = diagnose(&study, &model).unwrap();
    let found = answer.found.iter().map(|found| found.effect.clone());
    let left = answer.relative_error_after["x"] / answer.relative_error_before["x"];
    (found.collect(), left)
}

#[test]
fn a_stop_on_one_side_is_named_on_either_side() {
    for side in [1.0, -1.0] {
        let (found, left) = missing(side, |beyond| 6e4 * beyond.max(0.0));
        assert_eq!(found, ["end_stop"], "side {side}");
        assert!(left < 0.05, "side {side}: {left}");
    }
}

#[test]
fn a_rounded_contact_on_one_side_is_named() {
    let (found, left) = missing(1.0, |beyond| 8e5 * beyond.max(0.0).powf(1.5));
    assert_eq!(found, ["power_contact"]);
    assert!(left < 0.05, "{left}");
}

/// One law under two names: free play in the middle, and what only the ends of the motion meet.
#[test]
fn a_contact_on_both_sides_is_free_play_or_a_stop_by_the_motion_that_meets_it() {
    for (distance, name) in [(1e-3, "clearance"), (AT, "end_stop")] {
        let (found, left) = missing(1.0, |beyond| {
            let at = beyond + AT;
            6e4 * (at.abs() - distance).max(0.0).copysign(at)
        });
        assert_eq!(found, [name], "met at {distance} m");
        assert!(left < 0.05, "met at {distance} m: {left}");
    }
}
