//! The six rig cases and the EMPS measurements, where they are at hand; each says so when it is
//! not.
//!
//! They are looked for in `$JOINTWATCH_DATA`, else in `../shared` beside the checkout.

use jointwatch::signal::motion::{Filters, low_pass, motions};
use jointwatch::study::Study;
use jointwatch_tests::program::measurements;
use nalgebra::{DMatrix, DVector};
use std::time::Instant;

#[test]
fn six_rig_cases() {
    let Some(folder) = measurements("rig_cases") else {
        return;
    };
    for case in [
        "coulomb_60dB",
        "delay_hard_60dB",
        "endstop_one_axis_40dB",
        "jenkins_40dB",
        "nothing_hard_40dB",
        "outside_library_60dB",
    ] {
        let start = Instant::now();
        let study = Study::read(&folder.join(case)).unwrap();
        let read = start.elapsed();
        let filters = Filters::design(&study).unwrap();
        let motions = motions(&study, &filters).unwrap();
        println!("{case}: read in {read:.0?}; {}", filters.reason);
        assert_eq!(study.sample_rate_hz, 2000.0);
        assert_eq!(motions.len(), study.records.len());
        assert!(filters.band_hz > 50.0 && filters.band_hz < 200.0);
        assert!(filters.state_band_hz >= filters.band_hz);
        for motion in &motions {
            assert_eq!(motion.states.len(), 2 * study.axes.len());
            assert!(motion.rows() + 2 * filters.half_length() == study.records[motion.record].rows);
        }
    }
}

/// Mass, viscous and dry friction and offset of the EMPS slide by least squares, against the
/// published values.
#[test]
fn emps_gives_its_published_parameters() {
    let Some(folder) = measurements("data/emps") else {
        return;
    };
    let temporary = tempfile::TempDir::new().unwrap();
    let text = format!(
        r#"time = "t"
[[axis]]
name = "x"
kind = "translation"
displacement = "qm"
force = [{{ column = "vir", unit = "V", scale = 35.15065, offset = 0.0 }}, {{ column = "pulses_N", optional = true }}]
[[record]]
file = '{0}/DATA_EMPS.mat'
role = "train"
[[record]]
file = '{0}/DATA_EMPS_PULSES.mat'
role = "validate"
"#,
        folder.display()
    );
    std::fs::write(temporary.path().join("study.toml"), text).unwrap();
    let start = Instant::now();
    let study = Study::read(temporary.path()).unwrap();
    println!("read in {:.0?}", start.elapsed());
    let filters = Filters::design(&study).unwrap();
    println!("{}", filters.reason);
    let motion = motions(&study, &filters).unwrap().remove(0);
    let velocity = &motion.states[1];
    let columns = [
        motion.acceleration[0].clone(),
        velocity.clone(),
        velocity.iter().map(|v| v.signum()).collect(),
        vec![1.0; motion.rows()],
    ]
    .map(|column| low_pass(&column, &filters.band));
    let rows = columns[0].len();
    let inputs = DMatrix::from_fn(rows, 4, |i, j| columns[j][i]);
    let force = DVector::from_vec(low_pass(&motion.force[0], &filters.band));
    let found = (inputs.transpose() * &inputs)
        .cholesky()
        .unwrap()
        .solve(&(inputs.transpose() * &force));
    let rest = &force - &inputs * &found;
    let nmse = 100.0 * rest.variance() / force.variance();
    println!("mass, viscous, dry, offset: {found:.3?}, NMSE {nmse:.3} %");
    for (value, (published, share)) in found.iter().zip([
        (95.109, 0.01),
        (203.50, 0.02),
        (20.394, 0.02),
        (-3.165, 0.05),
    ]) {
        assert!(
            (value / published - 1.0).abs() < share,
            "{value} and {published}"
        );
    }
    assert!(nmse < 0.5);
}
