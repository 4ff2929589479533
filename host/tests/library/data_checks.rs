//! A good study spoilt in every way that the data checks know: what they say, and that a good one
//! raises nothing.

use jointwatch::assess::data_checks::{Finding, check};
use jointwatch::diagnose::{Verdict, diagnose};
use jointwatch::fit::identify;
use jointwatch::signal::motion::Filters;
use jointwatch::simulate::{SimulationOptions, simulate};
use jointwatch::study::Study;
use std::f64::consts::TAU;

const SEED: u64 = 12;
/// Rows that every burst and stretch begins at, past the soft start.
const FROM: usize = 3000;

fn study(options: &SimulationOptions) -> Study {
    simulate(options).unwrap().study
}

fn good() -> Study {
    study(&SimulationOptions {
        seed: SEED,
        ..SimulationOptions::default()
    })
}

fn found(study: &Study) -> Vec<Finding> {
    let filters = Filters::design(study).unwrap();
    let found = check(study, &filters);
    for finding in &found {
        println!(
            "{}{}",
            if finding.serious { "! " } else { "" },
            finding.sentence
        );
    }
    found
}

/// One finding, with these words and the record's name in it.
fn expect(study: &Study, words: &[&str], serious: bool) {
    let found = found(study);
    assert_eq!(found.len(), 1, "{words:?}");
    for word in words {
        assert!(
            found[0].sentence.contains(word),
            "{word}: {}",
            found[0].sentence
        );
    }
    assert_eq!(found[0].serious, serious, "{}", found[0].sentence);
}

fn force(study: &mut Study) -> &mut Vec<f64> {
    &mut study.records[0].axes[0].force
}

fn largest(series: &[f64]) -> f64 {
    series.iter().fold(0.0, |most: f64, v| most.max(v.abs()))
}

#[test]
fn good_studies_raise_nothing() {
    for (seed, axes, snr_db, quantised) in [
        (SEED, 2, Some(60.0), true),
        (2, 2, Some(30.0), true),
        (3, 2, None, true),
        (4, 2, None, false),
        (5, 1, Some(40.0), true),
        (6, 1, None, false),
    ] {
        println!("seed {seed}, {axes} axes, {snr_db:?} dB, quantised: {quantised}");
        let study = study(&SimulationOptions {
            seed,
            axes,
            snr_db,
            quantised,
            ..SimulationOptions::default()
        });
        assert_eq!(found(&study), Vec::new());
    }
}

#[test]
fn a_wrong_sign_and_a_displacement_that_jumps_are_named() {
    let mut study = good();
    // Where the force is as large as usual.
    let size = (force(&mut study).iter().map(|f| f * f).sum::<f64>()
        / force(&mut study).len() as f64)
        .sqrt();
    let large = |f: &f64| f.abs() > size;
    let row = FROM + force(&mut study)[FROM..].iter().position(large).unwrap();
    force(&mut study)[row] *= -1.0;
    let at = format!("row {row} (");
    let said = found(&study);
    assert_eq!(said.len(), 1);
    for part in [at.as_str(), "the force channel of x", "stands alone"] {
        assert!(
            said[0].sentence.contains(part),
            "{part}: {}",
            said[0].sentence
        );
    }

    let mut study = good();
    let position = &mut study.records[0].axes[0].displacement_first;
    let jump = 0.2 * largest(position);
    position[FROM + 1..].iter_mut().for_each(|x| *x += jump);
    let said = found(&study);
    let jumps = said
        .iter()
        .filter(|f| f.sentence.contains("jumps from there"));
    let jumps: Vec<&Finding> = jumps.collect();
    assert!(
        jumps.len() == 1 && jumps[0].sentence.contains("row 3000 (1.500 s)"),
        "{said:?}"
    );
}

#[test]
fn a_clipped_channel_is_named() {
    let mut study = good();
    let rail = 0.5 * largest(force(&mut study));
    force(&mut study)
        .iter_mut()
        .for_each(|f| *f = f.clamp(-rail, rail));
    let file = study.records[0].file.clone();
    expect(
        &study,
        &[
            &file,
            "the force channel of x is clipped",
            "widen its range",
        ],
        true,
    );
}

#[test]
fn a_channel_that_is_stuck_while_the_axis_moves_is_named() {
    let stuck = |series: &mut Vec<f64>| {
        let value = series[FROM];
        series[FROM..FROM + 1000].fill(value);
    };
    let mut study = good();
    stuck(force(&mut study));
    expect(
        &study,
        &[
            "row 3000 (1.500 s)",
            "the force channel of x is stuck",
            "1000 rows",
        ],
        true,
    );

    let mut study = good();
    stuck(study.records[0].axes[0].acceleration.as_mut().unwrap());
    expect(&study, &["the acceleration channel of x is stuck"], true);

    // The same column is the second displacement and the body's position.
    let mut study = good();
    let logged = &mut study.records[0].axes[0];
    stuck(logged.displacement_second.as_mut().unwrap());
    logged.body_position = logged.displacement_second.clone();
    let said = found(&study);
    let stuck = |f: &Finding| {
        f.serious
            && f.sentence
                .contains("second displacement channel of x is stuck")
    };
    assert!(said.iter().any(stuck));
}

#[test]
fn a_channel_that_rests_with_its_axis_is_not_stuck() {
    let mut study = good();
    let rows = study.records[0].rows;
    let logged = &mut study.records[0].axes[0];
    let all = [
        Some(&mut logged.displacement_first),
        logged.displacement_second.as_mut(),
        logged.body_position.as_mut(),
        logged.acceleration.as_mut(),
        Some(&mut logged.force),
    ];
    for series in all.into_iter().flatten() {
        let value = series[rows - 2000];
        series[rows - 2000..].fill(value);
    }
    assert_eq!(found(&study), Vec::new());
}

#[test]
fn drop_outs_are_named_and_weighed() {
    let fall = |study: &mut Study, bursts: usize| {
        let force = force(study);
        let far = 0.5 * largest(force);
        let high: Vec<usize> = (1..force.len() - 6)
            .filter(|&row| force[row..row + 6].iter().all(|f| f.abs() > far))
            .collect();
        let apart = high.len() / bursts;
        for row in high.into_iter().step_by(apart.max(1)).take(bursts) {
            force[row + 1..row + 5].fill(0.0);
        }
    };
    let mut study = good();
    fall(&mut study, 5);
    expect(
        &study,
        &["the force channel of x drops out", "reads exactly 0"],
        false,
    );
    let mut study = good();
    fall(&mut study, 60);
    expect(&study, &["the force channel of x drops out"], true);

    let mut study = good();
    let force = force(&mut study);
    for row in (FROM..force.len() - 20).step_by(100) {
        let value = force[row];
        force[row..row + 8].fill(value);
    }
    expect(
        &study,
        &["the force channel of x drops out", "repeats its last value"],
        true,
    );
}

#[test]
fn counts_that_are_too_coarse_are_named() {
    for (counts, serious) in [(30.0, false), (6.0, true)] {
        let mut study = good();
        let training = study
            .records
            .iter()
            .filter(|r| r.role == jointwatch::study::Role::Train);
        let range = |r: &jointwatch::study::Record| {
            let logged = &r.axes[0];
            let second = logged.displacement_second.as_ref().unwrap();
            let relative = logged
                .displacement_first
                .iter()
                .zip(second)
                .map(|(a, b)| a - b);
            let (low, high) = relative.fold((0.0_f64, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
            high - low
        };
        let step = training.map(range).fold(0.0, f64::max) / counts;
        study.axes[0].encoder_step = Some(step);
        expect(&study, &["axis x", "counts of the encoder"], serious);
    }
}

#[test]
fn a_force_that_the_motion_switches_is_named_and_a_switching_drive_is_not() {
    let mut study = study(&SimulationOptions {
        seed: SEED,
        axes: 1,
        ..SimulationOptions::default()
    });
    let mut finds = |switch: &dyn Fn(usize, f64) -> bool| {
        for record in &mut study.records {
            let logged = &mut record.axes[0];
            let relative = logged.relative_displacement();
            let steps = relative.windows(2).map(|pair| pair[1] - pair[0]);
            let steps = steps.chain([0.0]).enumerate();
            let levels = steps.map(|(row, step)| if switch(row, step) { 12.0 } else { -12.0 });
            logged.force = levels.collect();
        }
        let found = found(&study);
        let mut found = found.iter();
        let switched = found.find(|f| f.sentence.contains("takes 2 values alone"));
        switched.map(|f| f.serious)
    };
    assert_eq!(finds(&|_, step| step > 0.0), Some(true));
    // Every 0.1 s anew, by a rule that knows nothing of the motion.
    let random = |row: usize| (row / 200).wrapping_mul(2_654_435_761) >> 7 & 1 == 0;
    assert_eq!(finds(&|row, _| random(row)), None);
}

#[test]
fn a_motion_of_which_the_turns_alone_were_logged_is_named() {
    let mut study = study(&SimulationOptions {
        seed: SEED,
        axes: 1,
        ..SimulationOptions::default()
    });
    for record in &mut study.records {
        let logged = &mut record.axes[0];
        let zigzag = |row: usize| [0.0, 1e-3, 2e-3, 1e-3][row % 4] * (1.0 + 1e-4 * row as f64);
        logged.displacement_first = (0..logged.force.len()).map(zigzag).collect();
        logged.displacement_second = None;
    }
    let found = found(&study);
    let turns = found
        .iter()
        .find(|f| f.sentence.contains("its motion turns every 2 rows"));
    assert!(turns.is_some_and(|f| !f.serious), "{found:?}");
}

#[test]
fn a_line_of_the_mains_is_a_remark() {
    // In the drive's own band a line is one among many, and the search for effects has to find it.
    let mut study = study(&SimulationOptions {
        seed: SEED,
        band_hz: [2.0, 20.0],
        ..SimulationOptions::default()
    });
    assert_eq!(found(&study), Vec::new());
    for record in &mut study.records {
        let rate = study.sample_rate_hz;
        let force = &mut record.axes[0].force;
        let size = 0.2 * largest(force);
        for (row, f) in force.iter_mut().enumerate() {
            *f += size * (TAU * 50.02 * row as f64 / rate).sin();
        }
    }
    expect(
        &study,
        &["the force channel of x has mains hum at 50", "N RMS"],
        false,
    );
}

#[test]
fn an_accelerometer_that_is_late_is_the_datas_fault_and_a_late_force_is_not() {
    let later = |series: &mut Vec<f64>| {
        series.rotate_right(3);
    };
    let words = [
        "the acceleration channel of x is 1.",
        "ms (3.0 samples)",
        "later than its position",
    ];
    let mut study = good();
    for record in &mut study.records {
        later(record.axes[0].acceleration.as_mut().unwrap());
    }
    expect(&study, &words, true);

    // A single displacement is the body's own, whichever way it counts.
    for sign in [1.0, -1.0] {
        let mut study = good();
        for record in &mut study.records {
            let axis = &mut record.axes[0];
            let body = axis.body_position.take().unwrap();
            axis.displacement_first = body.iter().map(|x| sign * x).collect();
            axis.displacement_second = None;
            later(axis.acceleration.as_mut().unwrap());
        }
        expect(&study, &words, true);
    }
    // One to a base that moves as well says nothing of the body alone.
    let mut study = good();
    for record in &mut study.records {
        let axis = &mut record.axes[0];
        axis.displacement_first = axis.relative_displacement();
        [axis.displacement_second, axis.body_position] = [None, None];
    }
    assert_eq!(found(&study), Vec::new());

    let mut study = good();
    for record in &mut study.records {
        later(&mut record.axes[0].force);
    }
    assert_eq!(found(&study), Vec::new());
}

/// Adds spikes of a size to some rows of the force.
fn add_spikes(study: &mut Study, size: f64) {
    let force = force(study);
    let rows = (FROM..force.len()).filter(|row| (row * 2_654_435_761) >> 16 & 63 == 0);
    for (number, row) in rows.collect::<Vec<_>>().into_iter().enumerate() {
        force[row] += if number % 2 == 0 { size } else { -size };
    }
}

#[test]
fn spikes_make_the_verdict_unless_an_effect_explains_more() {
    println!("seed {SEED}");
    let options = SimulationOptions {
        seed: SEED,
        axes: 1,
        ..SimulationOptions::default()
    };
    for (base, verdict) in [
        (
            &["stiffness@x", "viscous@x", "clearance@x"][..],
            Verdict::Data,
        ),
        (&["viscous@x"][..], Verdict::Effect),
    ] {
        let mut study = study(&options);
        study.base_terms = base.iter().map(|term| (*term).to_string()).collect();
        let most = largest(force(&mut study));
        add_spikes(&mut study, most);
        let model = identify::physical(&study).unwrap().model;
        let found = diagnose(&study, &model).unwrap();
        assert_eq!(found.verdict, verdict, "{base:?}: {:?}", found.found);
        assert!(found.data_problems[0].contains("as spikes do"));
    }
}

#[test]
fn serious_findings_make_the_verdict() {
    println!("seed {SEED}");
    let options = SimulationOptions {
        seed: SEED,
        axes: 1,
        ..SimulationOptions::default()
    };
    let mut study = study(&options);
    study.base_terms = ["stiffness@x", "viscous@x", "clearance@x"]
        .map(String::from)
        .to_vec();
    let model = identify::physical(&study).unwrap().model;
    let healthy = diagnose(&study, &model).unwrap();
    assert_ne!(healthy.verdict, Verdict::Data);
    assert!(healthy.data_problems.is_empty());

    let value = force(&mut study)[FROM];
    force(&mut study)[FROM..FROM + 1000].fill(value);
    let invalidated = diagnose(&study, &model).unwrap();
    assert_eq!(invalidated.verdict, Verdict::Data);
    assert!(
        invalidated.data_problems[0].contains("is stuck"),
        "{:?}",
        invalidated.data_problems
    );
}

#[test]
fn spikes_among_which_none_is_alone_are_named() {
    // Of small ones the low-pass leaves next to nothing.
    for (part, serious) in [(1.0, true), (0.5, false)] {
        let mut study = good();
        let most = part * largest(force(&mut study));
        add_spikes(&mut study, most);
        expect(
            &study,
            &["force channel", "as spikes do", "running median"],
            serious,
        );
    }
}
