//! The six rig cases, where they are at hand; the test says so when they are not.
//!
//! They are looked for in `$JOINTWATCH_DATA`, else in `../shared` beside the checkout.

use jointwatch::signal::motion::{Filters, motions};
use jointwatch::study::Study;
use jointwatch_tests::program::measurements;
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
