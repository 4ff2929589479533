//! Numbers that hold their sign in a bit of their own, as the registers of serial servos do.

use std::collections::BTreeSet;

/// Bits that a sign is looked for in.
const BITS: std::ops::RangeInclusive<u32> = 10..=15;
/// Sizes that either sign has at least: two levels are a switch.
const MIN_SIZES: usize = 5;
/// Part of the rows that either sign has at least.
const MIN_ROWS: f64 = 0.02;

/// The number that a register means whose bit is set where it is below 0.
pub(crate) fn signed(value: f64, bit: u32) -> f64 {
    let turn = f64::from(bit).exp2();
    if value >= turn { turn - value } else { value }
}

/// The bit that numbers hold their sign in: those with and those without it are whole, and none
/// comes near to reaching it.
pub(crate) fn sign_bit(values: &[f64]) -> Option<u32> {
    if !values.iter().all(|v| *v >= 0.0 && v.fract() == 0.0) {
        return None;
    }
    let is_held = |bit: &u32| {
        let turn = f64::from(*bit).exp2();
        let signs = [0.0, turn].map(|from| {
            let own = values.iter().filter(|v| (from..from + turn).contains(*v));
            own.map(|v| (v - from) as u64).collect::<Vec<_>>()
        });
        signs.iter().map(Vec::len).sum::<usize>() == values.len()
            && signs.iter().all(|sizes| {
                let different: BTreeSet<u64> = sizes.iter().copied().collect();
                sizes.len() as f64 > MIN_ROWS * values.len() as f64
                    && different.len() >= MIN_SIZES
                    && different
                        .last()
                        .is_some_and(|most| 2.0 * *most as f64 <= turn)
            })
    };
    BITS.rev().find(is_held)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sign_in_a_bit_is_found_and_read() {
        let truth: Vec<f64> = (0..500)
            .map(|row| (300.0 * (0.05 * f64::from(row)).sin()).round())
            .collect();
        for bit in [10, 15] {
            let turn = f64::from(bit).exp2();
            let register = |v: &f64| if *v < 0.0 { turn - v } else { *v };
            let logged: Vec<f64> = truth.iter().map(register).collect();
            assert_eq!(sign_bit(&logged), Some(bit));
            let read: Vec<f64> = logged.iter().map(|v| signed(*v, bit)).collect();
            assert_eq!(read, truth);
        }
    }

    #[test]
    fn counts_switches_and_fractions_have_none() {
        let counts: Vec<f64> = (0..500)
            .map(|row| (1200.0 + 900.0 * (0.05 * f64::from(row)).sin()).round())
            .collect();
        assert_eq!(sign_bit(&counts), None);
        let switch: Vec<f64> = (0..500).map(|row| f64::from(row % 2) * 1024.0).collect();
        assert_eq!(sign_bit(&switch), None);
        let fractions: Vec<f64> = counts.iter().map(|v| v + 0.5).collect();
        assert_eq!(sign_bit(&fractions), None);
    }
}
