//! Hum in a force channel, from the log to the device's integers: it is followed and taken out, the
//! joint's force is not, and the monitor says what it says without hum.

use jointwatch::device::replay::SetUp;
use jointwatch::simulate::RigParameters;
use jointwatch::study::Record;
use jointwatch_shared::base::hum::Hum as DeviceHum;
use jointwatch_shared::chain::Output;
use jointwatch_shared::monitor::{MonitorState, State};
use jointwatch_tests::monitor::detection::{detect, story};
use jointwatch_tests::monitor::false_alarms::WANTED_HOURS;
use jointwatch_tests::monitor::watched::{
    Hum, Learnt, RATE_HZ, STUDY_LEVEL, Shaking, Subject, add_line,
};
use std::f64::consts::TAU;
use std::sync::OnceLock;

const HUM: Hum = Hum {
    hz: 50.03,
    part: 0.1,
};
const SEED: u64 = 3;

fn subject(learnt: Learnt) -> &'static Subject {
    static PHYSICAL: OnceLock<Subject> = OnceLock::new();
    static POLYNOMIAL: OnceLock<Subject> = OnceLock::new();
    let place = match learnt {
        Learnt::Physical => &PHYSICAL,
        Learnt::Polynomial => &POLYNOMIAL,
    };
    place.get_or_init(|| {
        let rig = RigParameters::default();
        Subject::humming(learnt, rig, SEED, WANTED_HOURS, Some(HUM))
            .unwrap_or_else(|why| panic!("{learnt:?}: {why}"))
    })
}

/// A record's outputs of the device, or of one that knows of no line.
fn outputs(subject: &Subject, record: &Record, knows: bool) -> Vec<Output> {
    if knows {
        let samples = subject.set_up.samples(record, &subject.model);
        return samples.filter_map(|sample| sample.output).collect();
    }
    let mut corrections = *subject.model.corrections();
    corrections.iter_mut().for_each(|c| c.hum = DeviceHum::NONE);
    let model = subject.model.clone().correcting(corrections).unwrap();
    let set_up = SetUp::new(&subject.simulation.study, &model).unwrap();
    let samples = set_up.samples(record, &model);
    samples.filter_map(|sample| sample.output).collect()
}

/// The amplitude of the hum in a series, N, over a second from `from_s` on.
fn line_in(series: &[f64], from_s: f64, hz: f64) -> f64 {
    let from = (from_s * RATE_HZ) as usize;
    let part = &series[from..from + RATE_HZ as usize];
    let along = |quarter: f64| {
        let wave = (from..).map(|n| (TAU * (hz * n as f64 / RATE_HZ + quarter)).sin());
        part.iter().zip(wave).map(|(v, w)| v * w).sum::<f64>() * 2.0 / part.len() as f64
    };
    along(0.0).hypot(along(0.25))
}

fn rms(values: impl Iterator<Item = f64> + Clone) -> f64 {
    (values.clone().map(|v| v * v).sum::<f64>() / values.count() as f64).sqrt()
}

#[test]
fn hum_is_gone_from_the_residual_and_the_joints_force_is_left_as_it_is() {
    // What a polynomial misses, a fifth of the force, has a part at the line's frequency, of which
    // 0.16 Hz cannot be told from hum.
    for (learnt, least_fall, most_of_force) in [
        (Learnt::Physical, [-30.0, -40.0, -50.0], 1e-3),
        (Learnt::Polynomial, [-20.0, -25.0, -25.0], 1e-2),
    ] {
        let subject = subject(learnt);
        let found = subject.model.corrections()[0].hum;
        let size = subject.hum_amplitude();
        println!("{learnt:?}: {found:?} for {size:.4} N at {} Hz", HUM.hz);
        assert!((found.amplitude / size - 1.0).abs() < 0.05, "{found:?}");
        assert!((found.frequency_hz - HUM.hz).abs() < 2e-3, "{found:?}");

        let shaking = Shaking::steady(20.0, STUDY_LEVEL, 91);
        let humming = subject.shake(shaking, None);
        let mut quiet = humming.clone();
        add_line(
            &mut quiet.axes[0].force,
            RATE_HZ,
            HUM.hz,
            -size,
            91.0 * 0.137,
        );
        let unit = subject.model.outputs()[0].force_per_lsb;
        let forces = |record: &Record, knows: bool| -> Vec<f64> {
            let outputs = outputs(subject, record, knows);
            outputs
                .iter()
                .map(|o| f64::from(o.measured[0]) * unit)
                .collect()
        };
        let [right, before, after] = [
            forces(&quiet, false),
            forces(&humming, false),
            forces(&humming, true),
        ];
        let less = |a: &[f64]| -> Vec<f64> { a.iter().zip(&right).map(|(a, b)| a - b).collect() };
        let [before, off] = [less(&before), less(&after)];
        // What is left of the hum, and whatever of the joint's force was taken for it.
        for (from_s, most) in [1.0, 3.0, 8.0].into_iter().zip(least_fall) {
            let [was, is] = [&before, &off].map(|series| line_in(series, from_s, HUM.hz));
            let fallen = 20.0 * (is / was).log10();
            println!("  after {from_s} s: {fallen:.1} dB");
            assert!(fallen < most, "{learnt:?}: {fallen} dB after {from_s} s");
        }
        let settled = (3.0 * RATE_HZ) as usize;
        let share = rms(off[settled..].iter().copied()) / rms(right[settled..].iter().copied());
        println!("  the force is off by {share:.1e} of itself");
        assert!(share < most_of_force, "{learnt:?}: {share}");
        // A joint without hum loses nothing to a canceller that finds none.
        let without: Vec<f64> = less(&forces(&quiet, true));
        let share = rms(without[settled..].iter().copied()) / rms(right[settled..].iter().copied());
        println!("  without hum by {share:.1e}");
        assert!(share < most_of_force, "{learnt:?}: {share}");
    }
}

#[test]
fn a_healthy_joint_raises_no_alarm_and_a_changed_one_is_found_in_time() {
    for (learnt, within_s) in [(Learnt::Physical, 2.0), (Learnt::Polynomial, 10.0)] {
        let subject = subject(learnt);
        println!("{learnt:?}: relative errors {:.4?}", subject.relative_error);
        for minute in 0..9 {
            let record = subject.shake(Shaking::minute(minute, SEED), None);
            let seen = subject.watch(&mut MonitorState::default(), &record, |_| ());
            let healthy = seen.iter().all(|(_, v)| v.state != State::Alarm);
            assert!(healthy, "{learnt:?}, minute {minute}: {}", story(&seen));
        }
        for watched in detect(subject, 0.1, within_s, SEED) {
            println!("  {}", watched.told());
            assert!(
                watched.is_found_within(within_s),
                "{learnt:?}: {}",
                watched.told()
            );
        }
    }
}
