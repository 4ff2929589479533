//! The fixed-point operations against the same in wide integers, and at every rail.
//!
//! proptest prints the failing case and its seed, and keeps it in `proptest-regressions` as a named
//! regression.

use jointwatch_shared::scalar::fixed::{
    mul_high_add, mul_shift, q31_from_f64, q31_powers, q31_to_f64, round_shift, round_to_i64,
    saturate,
};
use proptest::prelude::*;

/// ⌊x/2ⁿ + ½⌋ in 128 bits.
fn wide_round(x: i128, n: u32) -> i128 {
    (2 * x + (1 << n)).div_euclid(1 << (n + 1))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    #[test]
    fn round_shift_is_half_up(x: i64, n in 0_u32..=62) {
        prop_assert_eq!(i128::from(round_shift(x, n)), wide_round(i128::from(x), n));
    }

    #[test]
    fn mul_shift_is_half_up(a: i32, b: i32, n in 0_u32..=62) {
        prop_assert_eq!(i128::from(mul_shift(a, b, n)), wide_round(i128::from(a) * i128::from(b), n));
    }

    #[test]
    fn mul_high_add_is_half_up(a: i32, b: i32, sum in -(1 << 30)..(1_i32 << 30)) {
        let wide = wide_round(i128::from(a) * i128::from(b), 32) + i128::from(sum);
        prop_assert_eq!(i128::from(mul_high_add(a, b, sum)), wide);
    }

    #[test]
    fn saturate_cuts_and_says_so(x in prop_oneof![any::<i64>(), -(1_i64 << 33)..(1_i64 << 33)]) {
        let cut = x.clamp(i64::from(i32::MIN), i64::from(i32::MAX));
        let (value, clipped) = saturate(x);
        prop_assert_eq!((i64::from(value), clipped), (cut, cut != x));
    }

    #[test]
    fn q31_is_the_nearest(x in -1.2_f64..1.2) {
        let nearest = (x * 2_147_483_648.0 + 0.5).floor().clamp(-2_147_483_648.0, 2_147_483_647.0);
        prop_assert_eq!(f64::from(q31_from_f64(x)), nearest);
    }

    #[test]
    fn q31_comes_back(x: i32) {
        prop_assert_eq!(q31_from_f64(q31_to_f64(x)), x);
    }

    #[test]
    fn powers_stay_within_their_stated_error(x: i32) {
        let [first, square, cube] = q31_powers(x).map(i128::from);
        let x = i128::from(x);
        prop_assert_eq!(first, x);
        // In units of 2⁻⁶² and 2⁻⁹³: half a unit of the square (a whole one of (−1)²), one of the
        // cube.
        let square_error = (square * (1 << 31) - x * x).abs();
        let half = if x == -(1 << 31) { 1 << 31 } else { 1 << 30 };
        prop_assert!(square_error <= half);
        prop_assert!((cube * (1 << 62) - x * x * x).abs() <= 1 << 62);
    }

    #[test]
    fn rounding_to_an_integer_is_half_up(x in -1e15_f64..1e15) {
        prop_assert_eq!(round_to_i64(x), (x + 0.5).floor() as i64);
    }
}

#[test]
fn rails() {
    for n in 0..=62 {
        for x in [i64::MIN, i64::MIN + 1, -1, 0, 1, i64::MAX - 1, i64::MAX] {
            assert_eq!(i128::from(round_shift(x, n)), wide_round(i128::from(x), n));
        }
        for (a, b) in [
            (i32::MIN, i32::MIN),
            (i32::MIN, i32::MAX),
            (i32::MAX, i32::MAX),
        ] {
            let wide = wide_round(i128::from(a) * i128::from(b), n);
            assert_eq!(i128::from(mul_shift(a, b, n)), wide);
        }
    }
    assert_eq!(saturate(i64::MIN), (i32::MIN, true));
    assert_eq!(saturate(i64::MAX), (i32::MAX, true));
    assert_eq!(q31_powers(i32::MIN), [i32::MIN, i32::MAX, -i32::MAX]);
    assert_eq!(round_to_i64(f64::NAN), 0);
    assert_eq!(round_to_i64(f64::NEG_INFINITY), i64::MIN);
    assert_eq!(round_to_i64(1e300), i64::MAX);
    assert_eq!(q31_from_f64(f64::NAN), 0);
    assert_eq!(q31_from_f64(f64::INFINITY), i32::MAX);
    assert_eq!(q31_from_f64(f64::NEG_INFINITY), i32::MIN);
}
