//! The monitor on a simulated joint: a healthy hour without an alarm, and a joint that changes is found in time.

use jointwatch::export::export;
use jointwatch::fit::polynomial::PolynomialOptions;
use jointwatch::identify;
use jointwatch::model_file::ModelFile;
use jointwatch::monitor_limits;
use jointwatch::replay::SetUp;
use jointwatch::sim::{
    Bodies, BodyState, Contact, Joint, JointLaw, RigParameters, Simulation, SimulationOptions,
    joint_state, record_drives, simulate,
};
use jointwatch::study::{Channels, Record, Role};
use jointwatch_shared::blob;
use jointwatch_shared::model::Model;
use jointwatch_shared::monitor::{Cause, Faults, Monitor, MonitorState, State, Verdict};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rayon::prelude::*;

/// Integration steps per row at 1 kHz: a quarter of a millisecond resolves the rig, as the simulator's own test shows.
const SUBSTEPS: usize = 4;
const RATE_HZ: f64 = 1000.0;

/// A rig, what was learnt of its joint, and the device that watches it.
struct Subject {
    simulation: Simulation,
    model: Model,
    set_up: SetUp,
    monitor: Monitor,
    relative_error: [f64; 2],
    /// RMS of force, displacement and velocity per axis on the validation record.
    rms: [[f64; 3]; 2],
}

fn options(seed: u64, duration_s: f64, level: f64) -> SimulationOptions {
    SimulationOptions {
        seed,
        duration_s,
        sample_rate_hz: RATE_HZ,
        validation_level: level,
        ..SimulationOptions::default()
    }
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

fn subject(kind: &str, seed: u64) -> Subject {
    let simulation = simulate(&options(seed, 20.0, 0.85)).expect("a stable rig");
    let study = &simulation.study;
    let file: ModelFile = match kind {
        "physical" => identify::physical(study).expect("a fit").model,
        _ => {
            identify::polynomial(study, &PolynomialOptions::default(), &|_| ())
                .expect("a fit")
                .model
        }
    };
    let exported = export(&file, None).expect("it fits the device");
    let model = blob::decode(&exported.blob).expect("a sound blob");
    let set_up = SetUp::new(study, &model).expect("it fits the study");
    let calibration =
        monitor_limits::limits(study, &set_up, &model, 0, 720).expect("limits of a healthy joint");
    let monitor = Monitor::new(calibration.limits, &set_up.chain).expect("sound limits");
    let relative_error = [0, 1].map(|axis: usize| file.validation[axis].relative_error);
    let truth = simulation.truth.last().expect("a validation record");
    let rms = [0, 1].map(|axis: usize| {
        [
            &truth.restoring_force[axis],
            &truth.states[2 * axis],
            &truth.states[2 * axis + 1],
        ]
        .map(|series| rms(series))
    });
    Subject {
        model,
        set_up,
        monitor,
        relative_error,
        rms,
        simulation,
    }
}

/// The joint with dry friction beside it.
#[derive(Clone, Copy)]
struct Worn {
    joint: Joint,
    friction: [f64; 2],
    /// Speed at which dry friction is nearly full.
    speed: [f64; 2],
}

impl JointLaw for Worn {
    fn contacts(&self, state: [f64; 4]) -> [Contact; 2] {
        JointLaw::contacts(&self.joint, state)
    }

    fn force(&self, state: [f64; 4], contacts: [Contact; 2]) -> [f64; 2] {
        let [x, phi] = JointLaw::force(&self.joint, state, contacts);
        let dry =
            |axis: usize| self.friction[axis] * (state[2 * axis + 1] / self.speed[axis]).tanh();
        [x + dry(0), phi + dry(1)]
    }
}

/// A record of the rig, driven by another seed at `level`(s), on which the joint becomes `later` after so many seconds.
fn shake(
    subject: &Subject,
    seconds: f64,
    level: f64,
    seed: u64,
    later: Option<(f64, Worn)>,
) -> Record {
    let rig = RigParameters::default();
    let options = options(seed, seconds, level);
    let drives = record_drives(&options, "valid.csv")
        .expect("options in range")
        .expect("such a record");
    let healthy = Worn {
        joint: rig.joint,
        friction: [0.0; 2],
        speed: [1.0; 2],
    };
    let mut bodies = Bodies {
        parameters: &rig,
        joint: healthy,
    };
    let rows = (seconds * RATE_HZ) as usize;
    let mut y = BodyState::zeros();
    let mut columns = vec![Vec::new(); 8];
    for row in 0..rows {
        if let Some((after_s, worn)) = later
            && row as f64 >= after_s * RATE_HZ
        {
            bodies.joint = worn;
        }
        let rate = bodies.derivative(&y, bodies.joint.contacts(joint_state(&y)), [0.0; 2]);
        let values = [
            y[1],
            y[2],
            y[5],
            y[6],
            rate[9],
            rate[13],
            bodies.shaft_force(0, &y),
            bodies.shaft_force(1, &y),
        ];
        for (column, value) in columns.iter_mut().zip(values) {
            column.push(value);
        }
        bodies.next_row(&mut y, &drives, row, RATE_HZ, SUBSTEPS);
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x5EED);
    let noise_of = &subject.simulation.noise_rms;
    for (column, of) in [(4, 4), (5, 6), (6, 8), (7, 9)] {
        let noise = Normal::new(0.0, noise_of[of]).expect("a finite spread");
        columns[column]
            .iter_mut()
            .for_each(|v| *v += noise.sample(&mut rng));
    }
    let axis = |i: usize| Channels {
        displacement_first: columns[2 * i + 1].clone(),
        displacement_second: Some(columns[2 * i].clone()),
        velocity: None,
        body_position: Some(columns[2 * i].clone()),
        acceleration: Some(columns[4 + i].clone()),
        force: columns[6 + i].clone(),
    };
    Record {
        file: "live".into(),
        role: Role::Validate,
        first_row: 0,
        rows,
        axes: vec![axis(0), axis(1)],
    }
}

/// Every change of the verdict over a record, with its time.
fn watch(subject: &Subject, state: &mut MonitorState, record: &Record) -> Vec<(f64, Verdict)> {
    let mut seen: Vec<(f64, Verdict)> = Vec::new();
    for (row, (raw, output)) in subject.set_up.samples(record, &subject.model).enumerate() {
        let verdict = subject
            .monitor
            .update(state, &raw, output.as_ref(), &Faults::default());
        if !seen
            .last()
            .is_some_and(|(_, last)| last.same_reason(&verdict))
        {
            seen.push((row as f64 / RATE_HZ, verdict));
        }
    }
    seen
}

fn changes(subject: &Subject) -> Vec<(String, Worn)> {
    let mut all = Vec::new();
    let joint = RigParameters::default().joint;
    let same = Worn {
        joint,
        friction: [0.0; 2],
        speed: [1.0; 2],
    };
    for axis in 0..2 {
        let [force, x, v] = subject.rms[axis];
        for sign in [1.0, -1.0] {
            let mut worn = same;
            worn.joint.stiffness[axis] += sign * 0.1 * force / x;
            all.push((format!("stiffness {sign:+} on {axis}"), worn));
            let mut worn = same;
            worn.joint.damping[axis] += sign * 0.1 * force / v;
            all.push((format!("damping {sign:+} on {axis}"), worn));
        }
        let mut worn = same;
        worn.friction[axis] = 0.1 * force;
        worn.speed[axis] = 0.02 * v;
        all.push((format!("dry friction on {axis}"), worn));
    }
    all
}

/// The first alarm, if any, as time and verdict.
fn alarm(seen: &[(f64, Verdict)]) -> Option<(f64, Verdict)> {
    seen.iter().copied().find(|(_, v)| v.state == State::Alarm)
}

fn story(seen: &[(f64, Verdict)]) -> String {
    let told = |(time, v): &(f64, Verdict)| {
        format!(
            "{time:.2} s {}: {}",
            v.state.words(),
            v.words(&["x", "phi"])
        )
    };
    seen.iter().map(told).collect::<Vec<_>>().join("; ")
}

/// Every change of the joint by 10 % of the RMS force raises an alarm about that axis in time, and not before it.
fn finds_changes(kind: &str, most_error: f64, within_s: f64) {
    for seed in [1, 2, 3] {
        let subject = subject(kind, seed);
        let error = subject.relative_error;
        assert!(
            error.iter().all(|e| *e < most_error),
            "{kind} {seed}: {error:?}"
        );
        let watched: Vec<_> = changes(&subject)
            .into_par_iter()
            .map(|(what, worn)| {
                let record = shake(&subject, 5.0 + within_s, 0.85, 77 + seed, Some((5.0, worn)));
                let seen = watch(&subject, &mut MonitorState::default(), &record);
                (what, seen)
            })
            .collect();
        for (what, seen) in watched {
            let (time, verdict) = alarm(&seen).unwrap_or_else(|| {
                panic!("{kind}, seed {seed}, {what}: no alarm; {}", story(&seen))
            });
            println!(
                "{kind}, seed {seed}, {what}: {:.2} s, {}",
                time - 5.0,
                verdict.words(&["x", "phi"])
            );
            assert!(time > 5.0, "{what}: before the change");
            assert!(verdict.cause.is_damage(), "{what}: {verdict:?}");
            assert!(
                what.ends_with(&format!("on {}", verdict.axis)),
                "{what}: {verdict:?}"
            );
        }
    }
}

#[test]
fn a_changed_joint_is_found_within_two_seconds_by_a_good_model() {
    finds_changes("physical", 0.05, 2.0);
}

#[test]
fn a_changed_joint_is_found_within_ten_seconds_by_a_plain_polynomial() {
    finds_changes("polynomial", 0.25, 10.0);
}

#[test]
fn a_healthy_hour_raises_no_alarm() {
    // An hour per model, in minutes of other seeds, levels and ramps.
    for (kind, seed) in [("physical", 1), ("polynomial", 2)] {
        let subject = subject(kind, seed);
        let minutes: Vec<_> = (0..60_u64)
            .into_par_iter()
            .map(|minute| {
                let level = [0.85, 0.7, 1.0, 0.5][minute as usize % 4];
                let record = shake(&subject, 60.0, level, 1000 * seed + minute, None);
                let mut state = MonitorState::default();
                let seen = watch(&subject, &mut state, &record);
                (minute, level, seen)
            })
            .collect();
        let mut suspect = 0;
        for (minute, level, seen) in &minutes {
            suspect += seen
                .iter()
                .filter(|(_, v)| v.state == State::Suspect)
                .count();
            assert!(
                alarm(seen).is_none(),
                "{kind}, minute {minute} at {level}: {}",
                story(seen)
            );
            assert!(seen.iter().any(|(_, v)| v.state == State::Healthy));
        }
        println!("{kind}, seed {seed}: an hour without an alarm, suspect {suspect} times");
    }
}

/// A record with every channel of both axes multiplied row by row.
fn scaled(record: &Record, gain: impl Fn(usize) -> f64) -> Record {
    let mut scaled = record.clone();
    for axis in &mut scaled.axes {
        let series = [
            Some(&mut axis.displacement_first),
            axis.displacement_second.as_mut(),
            axis.body_position.as_mut(),
            axis.acceleration.as_mut(),
            Some(&mut axis.force),
        ];
        for series in series.into_iter().flatten() {
            series
                .iter_mut()
                .enumerate()
                .for_each(|(row, value)| *value *= gain(row));
        }
    }
    scaled
}

#[test]
fn rest_is_not_judged_and_a_sensor_that_fails_is_named() {
    let subject = subject("polynomial", 1);
    let record = shake(&subject, 20.0, 0.85, 9, None);
    let rest = watch(
        &subject,
        &mut MonitorState::default(),
        &scaled(&record, |_| 0.0),
    );
    let last = rest.last().expect("a verdict").1;
    assert_eq!(
        (last.state, last.cause),
        (State::Unjudged, Cause::TooGentle)
    );

    // The force channel of phi stands still from 8 s on.
    let mut stuck = record.clone();
    let at = stuck.axes[1].force[8000];
    stuck.axes[1].force[8000..].fill(at);
    let seen = watch(&subject, &mut MonitorState::default(), &stuck);
    let (time, verdict) = alarm(&seen).unwrap_or_else(|| panic!("{}", story(&seen)));
    println!("stuck force: {}", story(&seen));
    assert!((8.0..10.0).contains(&time));
    assert_eq!(
        (verdict.cause, verdict.axis, verdict.channel),
        (Cause::Stuck, 1, 4)
    );

    // One transfer in five has a wrong checksum, then none.
    let mut state = MonitorState::default();
    let mut seen = Vec::new();
    for (row, (raw, output)) in subject.set_up.samples(&record, &subject.model).enumerate() {
        let mut faults = Faults::default();
        if (5000..10_000).contains(&row) && row % 5 == 0 {
            faults.checksum = Faults::bit(0, 3);
        }
        let verdict = subject
            .monitor
            .update(&mut state, &raw, output.as_ref(), &faults);
        seen.push(verdict);
    }
    let words = |row: usize| format!("{}", seen[row].words(&["x", "phi"]));
    assert_eq!(seen[9000].state, State::Alarm);
    assert_eq!(
        words(9000),
        "accelerometer of x: wrong checksums, 20 % of the time"
    );
    assert_eq!(seen[15_000].state, State::Healthy, "{}", words(15_000));
}

#[test]
fn outside_the_range_it_says_so_and_raises_no_alarm_of_damage() {
    let subject = subject("polynomial", 1);
    let record = shake(&subject, 20.0, 0.85, 10, None);
    // Three times as far from 8 s on: most of the motion is outside, and the model is wrong there.
    let wide = scaled(&record, |row| if row < 8000 { 1.0 } else { 3.0 });
    let seen = watch(&subject, &mut MonitorState::default(), &wide);
    println!("{}", story(&seen));
    assert!(alarm(&seen).is_none(), "{}", story(&seen));
    let last = seen.last().expect("a verdict").1;
    assert_eq!(
        (last.state, last.cause),
        (State::Suspect, Cause::OutsideRange)
    );
}
