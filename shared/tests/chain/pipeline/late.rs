//! Channels that are late: by whole samples they give the same bits, by part of one they are put in
//! time.

use super::{late_motion, model, motion, rig, run};
use jointwatch_shared::chain::{Chain, Output};
use jointwatch_shared::wire::rig::{ChannelDelays, MAX_TAPS};

/// Outputs by the row that they describe, for rows that both chains know.
fn aligned<'a>(
    chains: [&Chain; 2],
    outputs: [&'a [Output]; 2],
) -> impl Iterator<Item = (&'a Output, &'a Output)> {
    let first = chains[0].first_row().max(chains[1].first_row());
    let [a, b] = [0, 1].map(|i| &outputs[i][first - chains[i].first_row()..]);
    a.iter().zip(b)
}

#[test]
fn a_channel_late_by_whole_samples_gives_the_bits_of_one_in_time() {
    let model = model();
    for rig in [
        rig(4e-5, 2e-6, [350.0, 1.2], false),
        rig(0.0, 2e-6, [350.0, 1.2], true),
    ] {
        let in_time = Chain::new(&model, &rig).unwrap();
        for offset in [0, i32::MAX - 200] {
            let wanted = run(&in_time, &model, &motion(600, offset));
            for (displacement, body, acceleration) in [
                (0, 1, 0),
                (1, 0, 0),
                (2, 2, 2),
                (-1, 0, 1),
                (-2, 2, -1),
                (1, -2, 3),
                (0, 0, 2),
                (0, 0, -1),
            ] {
                let delays = ChannelDelays {
                    displacement: f64::from(displacement),
                    body: f64::from(body),
                    acceleration: f64::from(acceleration),
                    input: 0.0,
                };
                let mut rig = rig.clone();
                rig.axes.iter_mut().for_each(|axis| axis.delays = delays);
                let Ok(chain) = Chain::new(&model, &rig) else {
                    // Three samples late, and the filters wait for two: only a late counter makes
                    // them wait longer.
                    panic!("{delays:?} was refused");
                };
                let seen = run(&chain, &model, &late_motion(600, offset, delays));
                assert!(seen.len() + 8 > wanted.len());
                assert_eq!(
                    chain.delay() - in_time.delay(),
                    displacement.max(body).max(0) as usize
                );
                let mut rows = 0;
                for (a, b) in aligned([&in_time, &chain], [&wanted, &seen]) {
                    rows += 1;
                    let a = Output {
                        residual_band: None,
                        ..*a
                    };
                    assert_eq!(
                        a,
                        Output {
                            residual_band: None,
                            ..*b
                        },
                        "{delays:?}, pair {rows}"
                    );
                }
                assert!(rows > 580);
            }
        }
    }
}

#[test]
fn a_channel_late_by_part_of_a_sample_is_put_in_time() {
    let (model, rig) = (model(), rig(4e-5, 2e-6, [350.0, 1.2], true));
    let in_time = Chain::new(&model, &rig).unwrap();
    let wanted = run(&in_time, &model, &motion(1500, i32::MAX - 200));
    for late in [0.3, -0.45, 1.6] {
        let delays = ChannelDelays {
            displacement: late,
            body: -late,
            acceleration: late,
            input: 0.0,
        };
        let samples = late_motion(1500, i32::MAX - 200, delays);
        let uncorrected = run(&in_time, &model, &samples);
        let mut rig = rig.clone();
        rig.axes.iter_mut().for_each(|axis| axis.delays = delays);
        let chain = Chain::new(&model, &rig).unwrap();
        let corrected = run(&chain, &model, &samples);
        // Largest error of the first axis's position in counts, and of its force in N.
        let worst = |seen: &[Output], chain: &Chain| {
            let mut worst = [0.0_f64; 2];
            for (a, b) in aligned([&in_time, chain], [&wanted, seen]) {
                let counts = 1e-3 / 2e-6 / 2_f64.powi(31);
                let unit = model.outputs()[0].force_per_lsb;
                worst[0] = worst[0].max(f64::from(a.state[0] - b.state[0]).abs() * counts);
                worst[1] = worst[1].max(f64::from(a.measured[0].abs_diff(b.measured[0])) * unit);
            }
            worst
        };
        let (with, without) = (worst(&corrected, &chain), worst(&uncorrected, &in_time));
        println!(
            "late by {late}: counts and N off: {with:.3?} put in time, {without:.3?} as they come"
        );
        // Three roundings to a count on either side; then the cubic's own error.
        assert!(
            with[0] <= 3.0 && with[1] < 0.1 * without[1],
            "late by {late}"
        );
        assert!(without[0] > 8.0, "late by {late}: the test shows nothing");
    }
}

#[test]
fn an_accelerometer_is_refused_where_the_filters_wait_for_longer_than_its_codes_are_kept() {
    let (model, mut rig) = (model(), rig(4e-5, 2e-6, [350.0, 1.2], false));
    for taps in [&mut rig.velocity.taps, &mut rig.acceleration.taps] {
        let around = vec![0; (MAX_TAPS - taps.len()) / 2];
        let long = [&around, &taps[..], &around].concat();
        *taps = long.into_iter().collect();
    }
    for axis in &mut rig.axes {
        axis.delays.displacement = 2.0;
        axis.force_delay_samples = 2.0;
    }
    assert!(Chain::new(&model, &rig).is_err());
    for axis in &mut rig.axes {
        axis.delays.acceleration = 2.0;
    }
    assert!(Chain::new(&model, &rig).is_ok());
}
