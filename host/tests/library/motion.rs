//! Motions of joints whose force is known: what comes out must be the force that was put in.

use jointwatch::signal::fir::to_f64;
use jointwatch::signal::motion::{Filters, low_pass, motions};
use jointwatch::study::{Axis, AxisKind, Channels, Controller, Convention, Record, Role, Study};
use jointwatch::text::error::Kind;
use std::path::PathBuf;

const RATE: f64 = 2000.0;
const ROWS: usize = 6000;
const INERTIA: f64 = 1.7;
const STIFFNESS: f64 = 3e4;
const DAMPING: f64 = 12.0;
const GROUND_STIFFNESS: f64 = 8e3;
const GROUND_DAMPING: f64 = 5.0;

/// Amplitude, frequency and phase of three sines, and their value, first and second derivative at
/// `t`.
fn sines(list: [(f64, f64, f64); 3], t: f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (amplitude, hz, phase) in list {
        let w = 2.0 * std::f64::consts::PI * hz;
        let (sin, cos) = (w * t + phase).sin_cos();
        sum[0] += amplitude * sin;
        sum[1] += amplitude * w * cos;
        sum[2] -= amplitude * w * w * sin;
    }
    sum
}

fn body(t: f64) -> [f64; 3] {
    sines([(2e-3, 4.0, 0.1), (3e-4, 21.0, 1.0), (5e-5, 62.0, 2.0)], t)
}

fn far_side(t: f64) -> [f64; 3] {
    sines(
        [(3e-3, 5.0, 0.7), (2e-4, 17.0, 0.2), (1.5e-4, 70.0, 0.5)],
        t,
    )
}

fn restoring_force(t: f64) -> f64 {
    let (near, far) = (body(t), far_side(t));
    STIFFNESS * (far[0] - near[0]) + DAMPING * (far[1] - near[1])
}

fn study(convention: Convention, accelerometer: bool) -> Study {
    let series =
        |f: &dyn Fn(f64) -> f64| -> Vec<f64> { (0..ROWS).map(|i| f(i as f64 / RATE)).collect() };
    let sign = match convention {
        Convention::ForceMinusInertia => 1.0,
        Convention::InertiaMinusForce => -1.0,
    };
    // m·a = F − k·b − c·ḃ ∓ r, solved for the force that makes it so.
    let force = |t: f64| {
        let [b, v, a] = body(t);
        INERTIA * a + GROUND_STIFFNESS * b + GROUND_DAMPING * v + sign * restoring_force(t)
    };
    Study {
        leave_out_standstill: false,
        inputs: Vec::new(),
        unused: Vec::new(),
        name: "analytic".to_owned(),
        path: PathBuf::from("study.toml"),
        sample_rate_hz: RATE,
        band_hz: Some(120.0),
        axes: vec![Axis {
            name: "x".to_owned(),
            kind: AxisKind::Translation,
            inertia: Some(INERTIA),
            restoring_force: convention,
            ground_stiffness: GROUND_STIFFNESS,
            ground_damping: GROUND_DAMPING,
            controller: Controller::default(),
            encoder_step: None,
            velocity_alone: false,
            integrated_above_hz: None,
        }],
        records: vec![Record {
            inputs: Vec::new(),
            file: "analytic".to_owned(),
            role: Role::Train,
            first_row: 0,
            rows: ROWS,
            axes: vec![Channels {
                displacement_first: series(&|t| far_side(t)[0]),
                displacement_second: Some(series(&|t| body(t)[0])),
                velocity: None,
                body_position: Some(series(&|t| body(t)[0])),
                acceleration: accelerometer.then(|| series(&|t| body(t)[2])),
                force: series(&force),
            }],
        }],
        quasi_static: false,
        sources: Vec::new(),
        base_terms: Vec::new(),
        notes: Vec::new(),
    }
}

fn rms(series: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = series.fold((0.0, 0), |(s, n), x| (s + x * x, n + 1));
    (sum / f64::from(count)).sqrt()
}

#[test]
fn the_force_put_in_comes_out_with_both_signs_and_both_sources_of_acceleration() {
    for convention in [Convention::ForceMinusInertia, Convention::InertiaMinusForce] {
        for accelerometer in [true, false] {
            let study = study(convention, accelerometer);
            let filters = Filters::design(&study).unwrap();
            let motion = motions(&study, &filters).unwrap().remove(0);
            assert_eq!(motion.rows(), ROWS - 2 * filters.half_length());
            assert_eq!(motion.first_row, filters.half_length());
            let time = |row: usize| (row + motion.first_row) as f64 / RATE;
            let found = motion.restoring_force(0, INERTIA, convention);
            let error = rms(found
                .iter()
                .enumerate()
                .map(|(i, r)| r - restoring_force(time(i))))
                / rms(found.iter().copied());
            println!("{convention:?}, accelerometer {accelerometer}: {error:.1e}");
            assert!(error < 1e-4, "{error}");
            for (row, (x, v)) in motion.states[0].iter().zip(&motion.states[1]).enumerate() {
                let (near, far) = (body(time(row)), far_side(time(row)));
                assert!((x - (far[0] - near[0])).abs() < 1e-15);
                assert!((v - (far[1] - near[1])).abs() < 1e-4 * 0.2);
            }
        }
    }
}

#[test]
fn the_low_pass_leaves_what_lies_in_the_band_and_stays_aligned() {
    let filters = Filters::design(&study(Convention::default(), true)).unwrap();
    let series: Vec<f64> = (0..2000).map(|i| far_side(i as f64 / RATE)[0]).collect();
    let smooth = low_pass(&series, &filters.band);
    let lost = filters.band.len() - 1;
    assert_eq!(smooth.len(), series.len() - lost);
    for (a, b) in smooth.iter().zip(&series[lost / 2..]) {
        assert!((a - b).abs() < 1e-4 * 3e-3);
    }
}

#[test]
fn host_and_device_hold_the_same_filters() {
    let filters = Filters::design(&study(Convention::default(), true)).unwrap();
    assert_eq!(filters.velocity.len(), filters.acceleration.len());
    let (velocity, acceleration, band) = filters.taps().unwrap();
    assert_eq!(to_f64(&velocity), filters.velocity);
    assert_eq!(to_f64(&acceleration), filters.acceleration);
    assert_eq!(to_f64(&band), filters.band);
    assert_eq!(filters.band.iter().sum::<f64>(), 1.0);
    assert_eq!(filters.acceleration.iter().sum::<f64>(), 0.0);
    println!("{}", filters.reason);
    assert!(filters.reason.contains("120 Hz as study.toml states"));
    let text = serde_json::to_string(&filters).unwrap();
    assert_eq!(serde_json::from_str::<Filters>(&text).unwrap(), filters);
}

#[test]
fn a_band_as_narrow_as_the_taps_allow_is_said_to_be_so() {
    let mut study = study(Convention::default(), true);
    study.band_hz = Some(20.0);
    let filters = Filters::design(&study).unwrap();
    println!("{}", filters.reason);
    assert_eq!((filters.band_hz, filters.band.len()), (20.0, 257));
    assert!(filters.reason.contains("257 taps"));
}

#[test]
fn a_band_chosen_from_the_data_holds_the_force() {
    let mut study = study(Convention::InertiaMinusForce, true);
    study.band_hz = None;
    let filters = Filters::design(&study).unwrap();
    println!("{}", filters.reason);
    // Its highest sine, at 70 Hz, holds more than a thousandth of the power of the force.
    assert!(
        filters.band_hz > 69.0 && filters.band_hz < 72.0,
        "{}",
        filters.band_hz
    );
    assert!(filters.state_band_hz >= 2.0 * filters.band_hz);
}

#[test]
fn a_ramp_before_a_hold_is_not_cut_off_by_the_filters() {
    // A relaxation test of 1000 rows at 6 Hz: pulled for 20 s, then held.
    let mut study = study(Convention::ForceMinusInertia, false);
    let relaxes = |i: usize| {
        let t = i as f64 / 6.0;
        let after = (t - 20.0).max(0.0);
        let ramp = 4e-3 * t.min(20.0);
        [ramp, 1500.0 * ramp * (0.7 + 0.3 * (-after / 60.0).exp())]
    };
    study.sample_rate_hz = 6.0;
    study.band_hz = None;
    study.axes[0].inertia = Some(0.0);
    study.axes[0].ground_stiffness = 0.0;
    study.axes[0].ground_damping = 0.0;
    let record = &mut study.records[0];
    record.rows = 1000;
    record.axes[0].displacement_first = (0..1000).map(|i| relaxes(i)[0]).collect();
    record.axes[0].displacement_second = None;
    record.axes[0].body_position = None;
    record.axes[0].force = (0..1000).map(|i| relaxes(i)[1]).collect();
    let filters = Filters::design(&study).unwrap();
    println!("{}", filters.reason);
    let motion = &motions(&study, &filters).unwrap()[0];
    let [x, low] = [
        &motion.states[0],
        &low_pass(&motion.states[0], &filters.band),
    ];
    let way = |x: &[f64]| x[x.len() - 1] - x[0];
    assert!(way(x) > 0.25 * 0.08 && way(low) > 0.2 * 0.08);
}

#[test]
fn what_the_filters_cannot_do_is_refused() {
    let mut wide = study(Convention::default(), true);
    wide.band_hz = Some(900.0);
    let error = Filters::design(&wide).unwrap_err();
    println!("{error}");
    assert!(error.kind == Kind::Data && error.sentence.contains("band_hz = 900"));
    let mut short = study(Convention::default(), true);
    let filters = Filters::design(&short).unwrap();
    short.records[0].rows = 120;
    let error = motions(&short, &filters).unwrap_err();
    println!("{error}");
    assert!(error.kind == Kind::Data && error.sentence.contains("120 rows are too few"));
}
