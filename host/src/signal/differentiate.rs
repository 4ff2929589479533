//! The differentiators against signals whose derivatives are known: sines, a chirp, polynomials.

use super::design::{Ideal, design, transition_for};
use super::fir::{apply, quantise, to_f64};
use std::f64::consts::PI;

const RATE: f64 = 2000.0;
const PASS: f64 = 350.0;
const TAPS: usize = 129;

/// The filter as the device holds it.
fn held(ideal: Ideal) -> Vec<f64> {
    let taps = design(ideal, RATE, PASS, PASS + transition_for(TAPS, RATE), TAPS);
    to_f64(&quantise::<TAPS>(&taps).unwrap())
}

fn largest_error(found: &[f64], wanted: impl Fn(f64) -> f64) -> f64 {
    let half = TAPS / 2;
    found.iter().enumerate().fold(0.0_f64, |most, (i, v)| {
        most.max((v - wanted((i + half) as f64 / RATE)).abs())
    })
}

fn sampled(rows: usize, signal: impl Fn(f64) -> f64) -> Vec<f64> {
    (0..rows).map(|i| signal(i as f64 / RATE)).collect()
}

#[test]
fn sines_in_the_pass_band_to_1e_4() {
    let (first, second) = (held(Ideal::FirstDerivative), held(Ideal::SecondDerivative));
    for frequency in [0.1, 1.0, 17.0, 120.0, 250.0, 340.0, PASS] {
        let w = 2.0 * PI * frequency;
        let x = sampled(4000, |t| (w * t + 0.3).sin());
        let v = largest_error(&apply(&x, &first), |t| w * (w * t + 0.3).cos()) / w;
        let a = largest_error(&apply(&x, &second), |t| -w * w * (w * t + 0.3).sin()) / (w * w);
        println!("{frequency} Hz: velocity {v:.1e}, acceleration {a:.1e}");
        assert!(v < 1e-4 && a < 1e-4);
    }
}

#[test]
fn sines_above_the_stop_edge_are_gone() {
    let edge = 2.0 * PI * PASS;
    for frequency in [450.0, 600.0, 999.0] {
        let x = sampled(4000, |t| (2.0 * PI * frequency * t + 0.3).sin());
        let v = largest_error(&apply(&x, &held(Ideal::FirstDerivative)), |_| 0.0) / edge;
        let a = largest_error(&apply(&x, &held(Ideal::SecondDerivative)), |_| 0.0) / (edge * edge);
        println!("{frequency} Hz: velocity {v:.1e}, acceleration {a:.1e} of the gain at {PASS} Hz");
        assert!(v < 1e-4 && a < 1e-4);
    }
}

#[test]
fn a_chirp_through_the_whole_pass_band() {
    // 5 Hz to 345 Hz in ten seconds.
    let (start, rate) = (5.0, 34.0);
    let phase = |t: f64| 2.0 * PI * (start * t + 0.5 * rate * t * t);
    let turning = |t: f64| 2.0 * PI * (start + rate * t);
    let x = sampled(20_000, |t| phase(t).sin());
    let top = turning(10.0);
    let v = largest_error(&apply(&x, &held(Ideal::FirstDerivative)), |t| {
        turning(t) * phase(t).cos()
    }) / top;
    let a = largest_error(&apply(&x, &held(Ideal::SecondDerivative)), |t| {
        2.0 * PI * rate * phase(t).cos() - turning(t).powi(2) * phase(t).sin()
    }) / (top * top);
    println!("velocity {v:.1e}, acceleration {a:.1e}");
    assert!(v < 1e-4 && a < 1e-4);
}

#[test]
fn polynomials_of_time() {
    let (first, second) = (held(Ideal::FirstDerivative), held(Ideal::SecondDerivative));
    let rest = [3.25; 300];
    assert!(apply(&rest, &first).iter().all(|v| *v == 0.0));
    assert!(apply(&rest, &second).iter().all(|a| a.abs() < 1e-6));
    let x = sampled(2000, |t| 1.0 - 2.0 * t + 3.0 * t * t);
    let v = largest_error(&apply(&x, &first), |t| 6.0 * t - 2.0);
    let a = largest_error(&apply(&x, &second), |_| 6.0);
    println!("velocity {v:.1e} m/s, acceleration {a:.1e} m/s²");
    assert!(v < 4e-4 && a < 6e-4);
}
