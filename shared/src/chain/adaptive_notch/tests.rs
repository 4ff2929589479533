extern crate std;

use super::*;
use crate::selftest::Points;
use std::f64::consts::{PI, TAU};
use std::println;
use std::vec::Vec;

/// Force units of the line that the host found.
const FOUND: f64 = 3e6;
const FOUND_HZ: f64 = 50.0;

/// Whether it is a turn of a phasor that does not grow and with which nothing can overflow.
fn is_usable(notch: &AdaptiveNotch) -> bool {
    let square = |part: i32| (i64::from(part) * i64::from(part)) as u64;
    let [cosine, sine] = notch.turn;
    let short = (1_u64 << 62).wrapping_sub(square(cosine).wrapping_add(square(sine)));
    sine > 0 && short < 1 << 37 && (1..=FIRST).contains(&notch.gain) && notch.places <= MAX_PLACES
}

fn line(rate_hz: f64) -> AdaptiveNotch {
    let hum = Hum {
        frequency_hz: FOUND_HZ,
        amplitude: FOUND * 1e-3,
    };
    let line = AdaptiveNotch::new(&hum, rate_hz, 1e-3).unwrap();
    assert!(is_usable(&line));
    line
}

fn fresh() -> Phasor {
    Phasor::NEW
}

/// What is left of a signal in force units, sample by sample.
fn left(line: &AdaptiveNotch, phasor: &mut Phasor, signal: impl Iterator<Item = f64>) -> Vec<f64> {
    let take = |force: f64| line.take_out(phasor, force.round() as i32, 0, false);
    signal.map(take).map(f64::from).collect()
}

fn sine(rate_hz: f64, hz: f64, size: f64, seconds: f64) -> impl Iterator<Item = f64> {
    let rows = (seconds * rate_hz) as usize;
    (0..rows).map(move |n| size * (TAU * hz * n as f64 / rate_hz + 1.1).sin())
}

/// dB of the RMS of `left` in half a second from `from_s` on, beside that of a line of this size.
fn decibels(left: &[f64], rate_hz: f64, from_s: f64, size: f64) -> f64 {
    let at = |s: f64| (s * rate_hz) as usize;
    let part = &left[at(from_s)..at(from_s + 0.5)];
    let power = part.iter().map(|v| v * v).sum::<f64>() / part.len() as f64;
    10.0 * (power / (size * size / 2.0)).max(1e-15).log10()
}

#[test]
fn a_line_of_the_known_frequency_is_gone_after_a_second() {
    for rate_hz in [500.0, 1000.0, 2000.0, 10_000.0] {
        for size in [0.1 * FOUND, FOUND, 3.0 * FOUND] {
            let signal = sine(rate_hz, FOUND_HZ, size, 20.0);
            let left = left(&line(rate_hz), &mut fresh(), signal);
            let seen = [1.0, 3.0, 8.0, 19.0].map(|s| decibels(&left, rate_hz, s, size));
            println!(
                "{rate_hz} Hz, {} of the size: {seen:.0?} dB after 1, 3, 8, 19 s",
                size / FOUND
            );
            assert!(seen.iter().all(|s| *s < -30.0), "{seen:?}");
            assert!(seen[3] < -45.0, "{seen:?}");
        }
    }
}

#[test]
fn a_line_beside_the_known_frequency_leaves_what_the_notch_lets_through_and_is_followed() {
    // With the angle as it was found, a share x/√(1 + x²) stays, x = 2π·Δf·τ.
    let rate_hz = 1000.0;
    for (off_hz, within_s) in [
        (0.02, 15.0),
        (0.05, 25.0),
        (-0.05, 25.0),
        (0.2, 90.0),
        (-0.2, 90.0),
    ] {
        let line = line(rate_hz);
        let x = (TAU * off_hz * TIME_CONSTANT_S).abs();
        let wanted = 20.0 * (x / (1.0 + x * x).sqrt()).log10();
        let mut phasor = Phasor::NEW;
        let fixed: Vec<f64> = sine(rate_hz, FOUND_HZ + off_hz, FOUND, 20.0)
            .map(|force| {
                let left = line.take_out(&mut phasor, force.round() as i32, 0, false);
                phasor.deviation = 0;
                f64::from(left)
            })
            .collect();
        let seen = decibels(&fixed, rate_hz, 19.0, FOUND);
        let mut phasor = Phasor::NEW;
        let signal = sine(rate_hz, FOUND_HZ + off_hz, FOUND, within_s + 1.0);
        let left = left(&line, &mut phasor, signal);
        let followed = [3.0, 10.0, within_s].map(|s| decibels(&left, rate_hz, s, FOUND));
        let angle = f64::from(phasor.deviation) / 38_f64.exp2();
        println!(
            "{off_hz:+} Hz: {seen:.1} dB for {wanted:.1} with the angle held; {followed:.0?} dB after 3, 10 and {within_s} s, \
             {:+.4} Hz",
            angle * rate_hz / TAU
        );
        assert!((seen - wanted).abs() < 0.5, "{seen} for {wanted}");
        assert!(followed[2] < -20.0, "{followed:?}");
    }
}

#[test]
fn what_the_model_leaves_beside_the_line_is_not_taken_for_it() {
    // A tone d beside the line loses at most 1/√(1 + (2π·d·τ)²) of its amplitude: 4 % at 2 Hz.
    let rate_hz = 1000.0;
    let settled = |hz: f64| {
        let tone = sine(rate_hz, hz, FOUND, 30.0);
        let left = left(&line(rate_hz), &mut fresh(), tone);
        decibels(&left, rate_hz, 29.0, FOUND)
    };
    for hz in [5.0, 20.0, 45.0, 48.0, 52.0, 60.0, 100.0, 150.0, 400.0] {
        let bound = 1.0 / (1.0 + (TAU * (hz - FOUND_HZ) * TIME_CONSTANT_S).powi(2)).sqrt();
        let seen = 10_f64.powf(settled(hz) / 20.0);
        println!("{hz} Hz: {seen:.4}, at most {bound:.4} off");
        assert!((seen - 1.0).abs() < 1.1 * bound + 2e-3, "{hz}: {seen}");
    }
    // Noise as large as five lines beside it moves the phasor by what the mean over 2 s lets
    // through.
    let mut points = Points::new(4);
    let mut noise = || {
        (0..12)
            .map(|_| f64::from(points.next_word()) / 31_f64.exp2())
            .sum::<f64>()
            / 2.0
    };
    let signal: Vec<f64> = sine(rate_hz, FOUND_HZ, FOUND, 40.0)
        .map(|force| force + 5.0 * FOUND * noise())
        .collect();
    let left = left(&line(rate_hz), &mut fresh(), signal.iter().copied());
    let line_in = |values: &[f64]| {
        let parts = [0.0, 0.25].map(|turns| {
            let from = values.len() - 20_000;
            let wave = (from..).map(|n| (TAU * (FOUND_HZ * n as f64 / rate_hz + turns)).sin());
            values[from..]
                .iter()
                .zip(wave)
                .map(|(v, w)| v * w)
                .sum::<f64>()
                / 10_000.0
        });
        parts[0].hypot(parts[1])
    };
    let [before, after] = [line_in(&signal), line_in(&left)];
    println!(
        "beside noise of five lines: {:.1} dB",
        20.0 * (after / before).log10()
    );
    assert!(after < 0.1 * before);
}

#[test]
fn it_is_held_bounded_and_comes_to_rest() {
    // No whole number of samples per turn, so that roundings do not repeat.
    let rate_hz = 2003.7;
    let line = line(rate_hz);
    let mut phasor = Phasor::NEW;
    left(&line, &mut phasor, sine(rate_hz, FOUND_HZ, FOUND, 10.0));
    // Held, it goes on as it was: an hour later as large, and only its phase is what roundings of
    // the angle make it.
    let before = phasor;
    let mut most = 0;
    for _ in 0..3600 * 2000 {
        most = most.max(line.take_out(&mut phasor, 0, 0, true).abs());
    }
    let length = |p: &Phasor| f64::from(p.along).hypot(f64::from(p.across));
    println!("held for an hour: {:.4}", length(&phasor) / length(&before));
    assert!((length(&phasor) / length(&before) - 1.0).abs() < 0.05);
    assert_eq!(
        (phasor.fallen, phasor.deviation),
        (before.fallen, before.deviation)
    );
    // Without a line it goes to rest: what roundings keep of it is nothing beside the line.
    let quiet = left(&line, &mut phasor, core::iter::repeat_n(0.0, 120_000));
    let rest = quiet[100_000..]
        .iter()
        .fold(0.0_f64, |most, v| most.max(v.abs()));
    println!("at rest: {rest} force units of {FOUND}");
    assert!(rest < 3e-5 * FOUND);
    // A line a hundred times as large is not followed, nor one that stands at the rails.
    for size in [100.0 * FOUND, 2e9] {
        let left = left(&line, &mut phasor, sine(rate_hz, FOUND_HZ, size, 20.0));
        let taken = sine(rate_hz, FOUND_HZ, size, 20.0)
            .zip(&left)
            .map(|(f, l)| (f - l).abs());
        let most = taken.fold(0.0, f64::max);
        println!(
            "of {size:.0e} at most {:.1} lines are taken out",
            most / FOUND
        );
        assert!(most < 2_f64.sqrt() * 8.0 * FOUND);
    }
    // And it comes back.
    let signal = sine(rate_hz, FOUND_HZ, FOUND, 40.0);
    let after = left(&line, &mut phasor, signal);
    assert!(decibels(&after, rate_hz, 39.0, FOUND) < -40.0);
}

#[test]
fn nothing_overflows_whatever_the_block_and_the_forces() {
    // In builds with overflow checks this would panic.
    let mut points = Points::new(9);
    for (hz, rate_hz, amplitude) in [
        (50.0, 1e6, 1e-3),
        (1.0, 1e6, 1.0),
        (0.49, 1.0, 1e8),
        (60.0, 1000.0, 1e3),
    ] {
        let hum = Hum {
            frequency_hz: hz,
            amplitude,
        };
        let line = AdaptiveNotch::new(&hum, rate_hz, 1.0).unwrap();
        assert!(is_usable(&line));
        let mut phasor = Phasor::NEW;
        for n in 0..20_000 {
            let rail = |word: i32| {
                if n % 3 == 0 {
                    word
                } else {
                    i32::MAX ^ (word >> 31)
                }
            };
            let [measured, predicted] = [points.next_word(), points.next_word()].map(rail);
            line.take_out(&mut phasor, measured, predicted, n % 7 == 0);
        }
        let [along, across] = [phasor.along, phasor.across].map(|part| f64::from(part).abs());
        assert!(along.max(across) < 2_f64.powi(29), "{phasor:?}");
    }
    let hum = |frequency_hz, amplitude| Hum {
        frequency_hz,
        amplitude,
    };
    for (hum, words) in [
        (hum(500.0, 1.0), "frequency of a line"),
        (hum(50.0, 1e9), "amplitude of a line"),
    ] {
        let said = std::format!("{}", AdaptiveNotch::new(&hum, 1000.0, 1.0).unwrap_err());
        assert!(said.contains(words), "{said}");
    }
    let notch_hz = 1.0 / (PI * TIME_CONSTANT_S);
    assert!((notch_hz - 0.16).abs() < 0.001, "{notch_hz}");
}
