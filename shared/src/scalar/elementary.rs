//! Exponential decay and the sine on the device's numbers, in integers.
//!
//! Each brings its argument exactly to a short interval (whole halvings for the exponential, whole
//! turns for the sine) and evaluates the Taylor polynomial there, whose coefficients the compiler
//! works out. What rests stays exact: decay of 0 is 1, the sine of 0 is 0, each to the last bit, so
//! a joint that does not move adds no error to a hysteresis.
//!
//! | operation | over | largest error stated | measured, maximum and RMS |
//! |---|---|---|---|
//! | `decay` | all arguments | 3 units of 2⁻³² ([`DECAY_ERROR`]) | 1.3 and 0.29 |
//! | `hyperbolic_decay` | all arguments | 1 unit ([`HYPERBOLIC_DECAY_ERROR`]) | 1.0 and 0.58 |
//! | `sine` | all arguments | 9 units ([`SINE_ERROR`]) | 3.9 and 0.49 |
//!
//! Measured by `cargo test --release -p jointwatch-shared elementary -- --nocapture`. The stated
//! error is that against the exact function of the number that was given.

use super::q::{PLACES, Q, UNIT};
use crate::scalar::fixed::{mul_high_add, round_shift};

/// The most by which `decay` is off: the polynomial 0.1 units, its roundings 1.5, log₂e 0.5, the
/// last shift 0.5.
pub const DECAY_ERROR: f64 = 3.0 * UNIT;
/// The most by which `hyperbolic_decay` is off: it is rounded down.
pub const HYPERBOLIC_DECAY_ERROR: f64 = UNIT;
/// The most by which `sine` is off: half a unit for each of nine products and eight coefficients.
pub const SINE_ERROR: f64 = 9.0 * UNIT;

const LOG2_E: Q = Q::from_f64(core::f64::consts::LOG2_E);
/// (1 − 2⁻ᶠ)/f = Σ c_k·f^k with c_k = (−1)^k·(ln 2)^(k+1)/(k+1)!, in 2⁻³²; from the second on they
/// and their sums over f from −½ to ½ are below ½ and fit 32 bits.
const HALVING: [i64; 9] = halving();
/// sin(q·π/2)/q = Σ s_k·q^2k with s_k = (−1)^k·(π/2)^(2k+1)/(2k+1)!.
const QUARTER_WAVE: [Q; 8] = quarter_wave();

/// e⁻ᵃ; 1 for a negative argument.
pub(super) fn decay(a: Q) -> Q {
    // Beyond 2⁵ the result is 0 to the last bit; the product with log₂ e stays in range.
    halvings(Q::from_raw(a.raw().clamp(0, 1 << (PLACES + 5))) * LOG2_E)
}

/// 1/(1 + a); 1 for a negative argument.
pub(super) fn hyperbolic_decay(a: Q) -> Q {
    let below = a.raw().max(0) as u64 + (1 << PLACES);
    Q::from_raw(reciprocal(below) as i64)
}

/// ⌊2⁶⁴/d⌋ for d from 2³² to 2⁶³ + 2³². The division of 64 bits that a 32-bit processor has no
/// instruction for takes four times as long.
fn reciprocal(d: u64) -> u64 {
    // 2⁶³ over the first 32 bits of d: 14 bits of it from a division of 32 bits, twice as many by
    // each of Newton's steps.
    let places = d.leading_zeros();
    let top = (d << places) >> 32;
    // The bit that it begins with, named for the compiler: nothing divides by 0.
    let first = i64::from(u32::MAX / ((top >> 16) as u32 | 1 << 15));
    let off = (1 << 48) - first * top as i64;
    let second = (first << 15) + ((first * off) >> 33);
    let off = (1_u64 << 63).wrapping_sub(second as u64 * top) as i64;
    let third = second + ((second * (off >> 8)) >> 55);
    // Less by a few than the quotient, which are counted.
    let mut quotient = (third - 4) as u64 >> (31 - places);
    let mut rest = quotient.wrapping_mul(d).wrapping_neg();
    while rest >= d {
        rest -= d;
        quotient += 1;
    }
    quotient
}

/// sin(2πa): the sine of `a` turns.
pub(super) fn sine(a: Q) -> Q {
    // Where in the turn, from −½ to ½, in 2⁻³² of it.
    let turn = i64::from(a.raw() as u32 as i32);
    // Beyond a quarter the wave comes back.
    let half = 1_i64 << (PLACES - 1);
    let folded = turn.min(half - turn).max(-half - turn);
    let q = Q::from_raw(folded << 2);
    let square = q * q;
    let [rest @ .., last] = QUARTER_WAVE;
    let wave = rest.iter().rev().fold(last, |sum, &s| sum * square + s);
    wave * q
}

/// 2⁻ᵗ for t ≥ 0.
fn halvings(t: Q) -> Q {
    // The nearest whole number; from 40 on nothing is left of a number below 2.
    let whole = ((t.raw() >> PLACES) as i32).clamp(-1, 40) + (t.raw() as u32 >> 31) as i32;
    // What rests, from −½ to ½, so that roundings fade from term to term.
    let f = t.raw() as i32;
    // Written out: in a loop the compiler keeps f in two registers, and needs five instructions for
    // a product with it.
    let [first, a, b, c, d, e, g, h, i] = HALVING;
    let bend = mul_high_add(mul_high_add(i as i32, f, h as i32), f, g as i32);
    let bend = mul_high_add(mul_high_add(bend, f, e as i32), f, d as i32);
    let bend = mul_high_add(mul_high_add(bend, f, c as i32), f, b as i32);
    let bend = mul_high_add(mul_high_add(bend, f, a as i32), f, 0);
    let slope = (first + i64::from(bend)) as u32;
    let product = i64::from(slope) * i64::from(f);
    let value = (1_i64 << PLACES) - ((product + (1 << (PLACES - 1))) >> PLACES);
    Q::from_raw(round_shift(value, whole.max(0) as u32))
}

const fn halving() -> [i64; 9] {
    let mut coefficients = [0; 9];
    let mut value = 1.0;
    let mut k = 0;
    while k < coefficients.len() {
        value *= core::f64::consts::LN_2 / (k + 1) as f64;
        coefficients[k] = Q::from_f64(value).raw();
        value = -value;
        k += 1;
    }
    coefficients
}

const fn quarter_wave() -> [Q; 8] {
    let quarter = core::f64::consts::FRAC_PI_2;
    let mut coefficients = [Q::from_raw(0); 8];
    let mut value = quarter;
    let mut k = 0;
    while k < coefficients.len() {
        coefficients[k] = Q::from_f64(value);
        value *= -quarter * quarter / ((2 * k + 2) * (2 * k + 3)) as f64;
        k += 1;
    }
    coefficients
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    extern crate std;
    use std::println;

    /// Maximum and RMS of device − exact in units of 2⁻³², over arguments from `least` to `most` in
    /// `steps`.
    fn error(
        least: f64,
        most: f64,
        steps: u32,
        device: impl Fn(Q) -> Q,
        exact: impl Fn(f64) -> f64,
    ) -> (f64, f64) {
        let (mut largest, mut squares) = (0.0_f64, 0.0);
        for step in 0..=steps {
            let a = Q::from_f64(least + (most - least) * f64::from(step) / f64::from(steps));
            let off = (device(a).to_f64() - exact(a.to_f64())) / UNIT;
            largest = largest.max(off.abs());
            squares += off * off;
        }
        (largest, (squares / f64::from(steps)).sqrt())
    }

    #[test]
    fn errors_are_as_stated() {
        let (most, rms) = error(0.0, 25.0, 3_000_001, decay, |a| (-a).exp());
        println!("decay: {most:.2} units at most, {rms:.2} RMS");
        assert!(most * UNIT <= DECAY_ERROR && most <= 1.3 && rms <= 0.295);

        let (most, rms) = error(0.0, 25.0, 3_000_001, hyperbolic_decay, |a| 1.0 / (1.0 + a));
        println!("hyperbolic decay: {most:.2} units at most, {rms:.2} RMS");
        assert!(most * UNIT <= HYPERBOLIC_DECAY_ERROR && most <= 1.0 && rms <= 0.585);

        let turns = |a: f64| (a.fract() * core::f64::consts::TAU).sin();
        let (most, rms) = error(-3.0, 3.0, 3_000_017, sine, turns);
        println!("sine: {most:.2} units at most, {rms:.2} RMS");
        assert!(most * UNIT <= SINE_ERROR && most <= 3.9 && rms <= 0.495);
    }

    #[test]
    fn what_rests_stays_exact() {
        let one = Q::from_f64(1.0);
        let zero = Q::from_raw(0);
        for a in [zero, Q::from_raw(-1), Q::from_raw(i64::MIN)] {
            assert_eq!(decay(a), one);
            assert_eq!(hyperbolic_decay(a), one);
        }
        assert_eq!(decay(Q::from_raw(i64::MAX)), zero);
        assert_eq!(hyperbolic_decay(Q::from_raw(i64::MAX)), Q::from_raw(1));
        for turns in [-7.0, 0.0, 1.0, 1e6].map(Q::from_f64) {
            assert_eq!(sine(turns), zero);
        }
    }

    proptest! {
        #[test]
        fn no_argument_leaves_the_range(a: i64) {
            let size = |q: Q| q.to_f64().abs();
            let a = Q::from_raw(a);
            prop_assert!(size(decay(a)) <= 1.0);
            prop_assert!(size(sine(a)) <= 1.0 + SINE_ERROR);
        }
    }

    fn assert_reciprocal(d: u64) {
        let exact = (1_u128 << 64) / u128::from(d);
        assert_eq!(u128::from(reciprocal(d)), exact, "{d}");
    }

    #[test]
    fn a_reciprocal_is_exact_beside_every_power_of_two() {
        for places in PLACES..=63 {
            for off in 0..2000 {
                assert_reciprocal((1 << places) + off);
                if places > PLACES {
                    assert_reciprocal((1 << places) - 1 - off);
                }
            }
        }
        assert_reciprocal(i64::MAX as u64 + (1 << PLACES));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200_000))]
        #[test]
        fn a_reciprocal_is_exact(places in PLACES..63, fraction in 0.0..1.0_f64) {
            let d = (1_u64 << places) as f64 * (1.0 + fraction);
            assert_reciprocal(d as u64);
        }
    }
}
