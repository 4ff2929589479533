//! Whatever the counts, the residuals, the faults and the limits, the monitor goes on, and says
//! only what it can mean.

use jointwatch_shared::chain::{Chain, Output, RawAxis};
use jointwatch_shared::monitor::limits::{AxisLimits, CHANNELS, Cusum, Limits, TwoSided};
use jointwatch_shared::monitor::{CHANNEL_NAMES, Faults, Monitor, MonitorState, State, Window};
use jointwatch_shared::selftest::chain::{SHORT_TAPS, reference_rig};
use jointwatch_shared::selftest::reference_model;
use proptest::prelude::*;

/// One whose residuals in the band come as rarely as a block of so many samples allows.
fn chain(block: u16) -> Chain {
    let mut rig = reference_rig(SHORT_TAPS).expect("a sound rig");
    rig.band_every_log2 = (block.trailing_zeros() as u8).saturating_sub(4);
    Chain::new(reference_model(), &rig).expect("a rig that fits")
}

/// Mostly anything, often a rail.
fn word() -> impl Strategy<Value = i32> {
    prop_oneof![
        2 => any::<i32>(),
        1 => Just(i32::MAX),
        1 => Just(i32::MIN),
        1 => -100_i32..100,
    ]
}

fn cusum() -> impl Strategy<Value = Cusum> {
    let most = 1 << 24;
    (-most..=most, 1..=most).prop_map(|(drift, threshold)| Cusum { drift, threshold })
}

fn limits() -> impl Strategy<Value = Limits> {
    let two_sided = || (cusum(), cusum()).prop_map(|(more, less)| TwoSided { more, less });
    let axis = (
        (any::<bool>(), 0_u8..=30, 1_u64..=1 << 46),
        [1_u64..=1 << 30, 1_u64..=1 << 30],
        [
            -(1 << 24)..=1 << 24,
            -(1 << 24)..=1 << 24,
            -(1 << 24)..=1 << 24,
        ],
        (cusum(), two_sided(), two_sided()),
        any::<[u32; CHANNELS]>(),
        any::<[u8; 2]>(),
    );
    let axis = axis.prop_map(
        |(scale, state_power, per_octave, sums, moving_counts, gross)| {
            let (reversed, force_shift, force_power) = scale;
            let (error, stiffness, friction) = sums;
            AxisLimits {
                reversed,
                force_shift,
                force_power,
                state_power,
                per_octave,
                error,
                stiffness,
                friction,
                gross,
                moving_counts,
            }
        },
    );
    (axis, 4_u32..=10, 1_u16..=1000).prop_map(|(axis, log_block, outside_permille)| Limits {
        model_checksum: 0,
        block: 1 << log_block,
        outside_permille,
        false_alarm_hours: 1,
        axes: [axis.clone(), axis].into_iter().collect(),
    })
}

type Words = ([i32; 4], [[i32; 2]; 4], [[i32; CHANNELS]; 2]);

fn words() -> impl Strategy<Value = Words> {
    let pair = || [word(), word()];
    let channels = || std::array::from_fn(|_| word());
    (
        [word(), word(), word(), word()],
        [pair(), pair(), pair(), pair()],
        [channels(), channels()],
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn garbage_neither_stops_the_monitor_nor_leaves_its_words(
        limits in limits(),
        pieces in prop::collection::vec(
            (words(), any::<[u8; 3]>(), any::<[u16; 6]>(), 1_usize..200),
            1..20,
        ),
    ) {
        prop_assert_eq!(limits.check(), Ok(()));
        let chain = chain(limits.block);
        let monitor = Monitor::new(limits, &chain).expect("checked limits");
        let mut state = MonitorState::default();
        for ((states, forces, counts), [outside, saturated, which], faults, repeats) in pieces {
            let [measured, predicted, residual, in_band] = forces;
            let output = Output {
                state: states,
                // Mostly inside, or no block would ever be full.
                outside: if which & 1 == 0 { 0 } else { outside },
                measured,
                predicted,
                residual,
                residual_band: (which & 6 != 0).then_some(in_band),
                saturated,
            };
            let raw = counts.map(RawAxis::of_counts);
            let [too_high, out_of_range, checksum, time_out, missing, reference_lost] = faults;
            let lost = [0, 0, 0, 1, 100, 70_000, u32::MAX][usize::from(which) % 7];
            let faults = if which & 8 == 0 {
                Faults::default()
            } else {
                Faults { saturated: too_high, out_of_range, checksum, time_out, missing, reference_lost, lost }
            };
            let output = (which & 16 == 0).then_some(&output);
            for _ in 0..repeats {
                let verdict = monitor.update(&mut state, &raw, output, &faults);
                prop_assert!(verdict.axis < 2);
                prop_assert!(usize::from(verdict.channel) < CHANNEL_NAMES.len());
                prop_assert!(verdict.permille <= 1501, "{verdict:?}");
                prop_assert!(!verdict.words(&["x", "phi"]).to_string().is_empty());
                for axis in 0..3 {
                    let health = state.axis(&monitor, axis);
                    prop_assert!(health.judged_permille <= 1000);
                    prop_assert!(health.verdict.state.gravity() <= verdict.state.gravity());
                    // Healthy says that enough of the recent time was judged.
                    if health.verdict.state == State::Healthy && axis < 2 {
                        prop_assert!(health.judged_permille >= 200, "{health:?}");
                    }
                }
                if verdict.state == State::Alarm {
                    prop_assert!(verdict.cause.is_damage() || verdict.cause.is_sensor());
                }
            }
            for axis in 0..3 {
                let _ = state.nmse(&monitor, axis, Window::Fast);
                let _ = state.nmse(&monitor, axis, Window::Slow);
                prop_assert!(state.levels(&monitor, axis).iter().all(|level| *level <= 1501));
            }
            prop_assert!(state.outside_permille() <= 1000);
        }
    }
}
