//! The counts around an alarm come back as they were, for as long as is promised, whatever they
//! are.

use jointwatch_shared::chain::{RawAxis, RawSample};
use jointwatch_shared::wire::capture::{CHUNK, Capture, Chunk, NoPiece, unpack};
use jointwatch_shared::wire::telemetry::CAPTURE_PIECE;
use proptest::prelude::*;

/// Chunks of the STM32F405's core-coupled memory.
const CHUNKS: usize = (64 << 10) / CHUNK;

fn capture(chunks: usize) -> Capture {
    Capture::new(Box::leak(vec![[0; CHUNK]; chunks].into_boxed_slice()))
}

fn counts(raw: &RawSample) -> [[i32; 6]; 2] {
    raw.map(|raw| raw.counts())
}

/// Samples with their numbers.
type Samples = Vec<(u64, [[i32; 6]; 2])>;

/// Everything that is kept: number and counts of each sample, and how many chunks say that they
/// follow a gap.
fn kept(capture: &Capture) -> (Samples, usize) {
    let (mut samples, mut gaps) = (Vec::new(), 0);
    let pieces = capture.piece(0).unwrap().pieces;
    let bytes: Vec<u8> = (0..pieces)
        .flat_map(|piece| capture.piece(piece).unwrap().bytes)
        .collect();
    assert_eq!(capture.piece(pieces), Err(NoPiece::Nothing));
    for chunk in bytes.chunks(CHUNK) {
        let mut of_chunk = Vec::new();
        let contents = unpack(chunk, |counts| of_chunk.push(*counts)).unwrap();
        assert_eq!(of_chunk.len(), usize::from(contents.samples));
        gaps += usize::from(contents.follows_gap);
        samples.extend((contents.first..).zip(of_chunk));
    }
    (samples, gaps)
}

/// Two axes that move as a rig does, each channel with a noise of so many of its counts.
fn motion(number: u64, noise: [f64; 6]) -> RawSample {
    let t = number as f64 * 1e-3;
    let mut state = number.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mut random = || {
        // The sum of four is normal enough.
        let mut sum = 0.0;
        for _ in 0..4 {
            state ^= state >> 29;
            state = state.wrapping_mul(0xBF58_476D_1CE4_E5B9).wrapping_add(1);
            sum += (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
        }
        sum * 3.0_f64.sqrt()
    };
    [0.0, 0.4].map(|phase| {
        let wave = (60.0 * t + phase).sin() + 0.4 * (170.0 * t).sin();
        let scales = [4000.0, 2500.0, 2500.0, 1e5, 2e6, 0.0];
        let mut values = [0; 6];
        for ((value, scale), noise) in values.iter_mut().zip(scales).zip(noise) {
            *value = (scale * wave + noise * random()).round() as i32;
        }
        RawAxis::of_counts(values)
    })
}

#[test]
fn four_seconds_of_two_axes_at_a_kilohertz_are_kept_to_the_bit_on_both_sides_of_the_alarm() {
    // Encoders move by whole counts; converters have a noise in parts of their range.
    for (what, noise, least) in [
        (
            "converters as on the board",
            [0.0, 0.0, 0.0, 150.0, 800.0, 0.0],
            5.0,
        ),
        (
            "noise of a thousandth of the range",
            [0.0, 0.0, 0.0, 500.0, 8000.0, 0.0],
            4.5,
        ),
        (
            "noise of half a hundredth of the range",
            [1.0, 1.0, 1.0, 2500.0, 40_000.0, 0.0],
            4.0,
        ),
    ] {
        let mut capture = capture(CHUNKS);
        let (alarm, end) = (20_000, 40_000);
        for number in 0..end {
            capture.sample(number, &motion(number, noise), 2, false);
            if number == alarm {
                assert_eq!(capture.piece(0), Err(NoPiece::Nothing));
                capture.alarm(alarm);
                assert_eq!(capture.piece(0), Err(NoPiece::Unfinished));
            }
        }
        let (samples, gaps) = kept(&capture);
        let seconds = samples.len() as f64 / 1000.0;
        let before = (alarm - samples[0].0) as f64 / 1000.0;
        println!("{what}: {seconds:.2} s, {before:.2} s of them before the alarm");
        assert!(seconds >= least, "{what}: {seconds} s");
        assert!(
            (0.15..0.4).contains(&(before / seconds)),
            "{what}: {before} s before"
        );
        assert_eq!(gaps, 0);
        for (at, (number, found)) in samples.iter().enumerate() {
            assert_eq!(*number, samples[0].0 + at as u64);
            assert_eq!(*found, counts(&motion(*number, noise)), "{what}: {number}");
        }
    }
}

#[test]
fn the_first_alarm_is_kept_until_it_is_released() {
    let mut capture = capture(4);
    let mut number = 0;
    let mut run = |capture: &mut Capture, samples: u64| {
        for _ in 0..samples {
            capture.sample(number, &motion(number, [0.0; 6]), 2, false);
            number += 1;
        }
        number
    };
    let alarm = run(&mut capture, 3000);
    capture.alarm(alarm);
    run(&mut capture, 3000);
    let first = kept(&capture);
    assert!(first.0.iter().any(|(number, _)| *number == alarm));
    let later = run(&mut capture, 3000);
    capture.alarm(later);
    run(&mut capture, 3000);
    assert_eq!(kept(&capture), first);
    assert_eq!(capture.piece(0).unwrap().alarm, alarm);
    capture.release();
    assert_eq!(capture.piece(0), Err(NoPiece::Nothing));
    let second = run(&mut capture, 3000);
    capture.alarm(second);
    run(&mut capture, 3000);
    assert_eq!(capture.piece(0).unwrap().alarm, second);
    assert!(kept(&capture).0.iter().any(|(number, _)| *number == second));
}

#[test]
fn without_memory_nothing_is_kept() {
    let mut capture = Capture::new(&mut []);
    for number in 0..1000 {
        capture.sample(number, &motion(number, [0.0; 6]), 2, false);
    }
    capture.alarm(500);
    assert_eq!(capture.piece(0), Err(NoPiece::Nothing));
}

#[test]
fn bytes_that_are_no_chunk_are_refused() {
    assert_eq!(unpack(&[], |_| ()), None);
    assert_eq!(unpack(&[0; CHUNK], |_| ()), None);
    assert_eq!(unpack(&[0xff; CHUNK], |_| ()), None);
    assert_eq!(CHUNK % CAPTURE_PIECE, 0);
    let _: Chunk = [0; CHUNK];
}

/// Every count jumps over its whole range, so that every sample takes the most bits that it can.
#[test]
fn chunks_that_are_full_of_jumps_lose_nothing() {
    for axes in [1, 2] {
        let mut capture = capture(4);
        let mut state = 1_u32;
        let mut fed = Vec::new();
        for number in 0..2000 {
            let sample = [0, 1].map(|axis| {
                RawAxis::of_counts([0; 6].map(|_: i32| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    if axis < axes { state as i32 } else { 0 }
                }))
            });
            capture.sample(number, &sample, axes, false);
            fed.push(counts(&sample));
            if number == 500 {
                capture.alarm(number);
            }
        }
        let (samples, gaps) = kept(&capture);
        assert_eq!(gaps, 0);
        for (number, found) in samples {
            assert_eq!(found, fed[number as usize], "{axes} axes, sample {number}");
        }
    }
}

fn any_axis() -> impl Strategy<Value = [i32; 6]> {
    prop::array::uniform6(prop_oneof![-3..3_i32, -70_000..70_000_i32, any::<i32>()])
}

proptest! {
    /// Any counts, jumps over the whole range among them; gaps, lost numbers and one axis or two.
    #[test]
    fn whatever_is_recorded_comes_back(
        samples in prop::collection::vec((any_axis(), any_axis(), 0..40_u64), 300..900),
        axes in 1..=2_u8,
    ) {
        let mut capture = capture(3);
        let mut fed = std::collections::BTreeMap::new();
        let mut number = 0;
        for (at, (first, second, what)) in samples.iter().enumerate() {
            number += 1 + u64::from(*what == 0);
            let second = if axes == 2 { RawAxis::of_counts(*second) } else { RawAxis::default() };
            let sample = [RawAxis::of_counts(*first), second];
            capture.sample(number, &sample, axes, *what == 1);
            fed.insert(number, counts(&sample));
            if at == samples.len() / 4 {
                capture.alarm(number);
            }
        }
        // Enough for what is still to be filled.
        for _ in 0..20_000 {
            number += 1;
            capture.sample(number, &RawSample::default(), axes, false);
            fed.insert(number, [[0; 6]; 2]);
        }
        for (number, found) in kept(&capture).0 {
            prop_assert_eq!(Some(&found), fed.get(&number));
        }
    }

    /// Whatever the bytes are, nothing panics.
    #[test]
    fn garbage_is_no_panic(bytes in prop::collection::vec(any::<u8>(), 0..CHUNK + 2)) {
        let _ = unpack(&bytes, |_| ());
    }
}
