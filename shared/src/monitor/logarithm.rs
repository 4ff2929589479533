//! Logarithm and exponential to the base 2 in integers, good to one percent: for ratios without a
//! division.
//!
//! Both replace the mantissa by a parabola: log₂(1 + f) ≈ f + c·f·(1 − f) and 2^f ≈ 1 + f − c·f·(1
//! − f) with c = 0.3437. The host sets the limits with the same code, so its error shifts no limit.

/// One octave, a factor of two, in the units of these logarithms.
pub const OCTAVE: i32 = 1 << 10;
/// One, where a share of the force is meant.
pub const SHARE: i32 = 1 << 16;

/// c = 0.3437 in 2⁻¹⁶.
const CURVE: u32 = 22_525;

/// log₂(x) in 1/1024 octaves, off by 10 of them at most; 0 for 0.
pub(super) fn log2(x: u64) -> i32 {
    let zeros = x.leading_zeros();
    let Some(exponent) = 63_u32.checked_sub(zeros) else {
        return 0;
    };
    // The 16 bits after the leading one.
    let fraction = ((x << zeros) >> 47) as u32 & 0xFFFF;
    let bent = fraction + bow(fraction);
    ((exponent << 10) + (bent >> 6)) as i32
}

/// 2^(x/1024) in 2⁻¹⁶, off by 0.7 % at most; held to 2⁴ above, and 0 below 2⁻¹⁶.
pub(super) fn exp2(x: i32) -> i32 {
    if x >= 4 * OCTAVE {
        return 16 * SHARE;
    }
    let octave = x >> 10;
    let fraction = ((x & (OCTAVE - 1)) as u32) << 6;
    let mantissa = (1 << 16) + fraction - bow(fraction);
    if octave >= 0 {
        (mantissa << (octave & 3)) as i32
    } else {
        mantissa.checked_shr(octave.unsigned_abs()).unwrap_or(0) as i32
    }
}

/// c·f·(1 − f), all in 2⁻¹⁶.
fn bow(fraction: u32) -> u32 {
    let product = (fraction * ((1 << 16) - fraction).min(0xFFFF)) >> 16;
    (product * CURVE) >> 16
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    #[test]
    fn they_are_the_logarithm_and_its_inverse_within_what_is_stated() {
        let mut worst: f64 = 0.0;
        let all = (0..64).flat_map(|n| (0..500_u64).map(move |f| (1 << n) | ((f << n) / 500)));
        for x in all {
            worst = worst.max((f64::from(log2(x)) - 1024.0 * (x as f64).log2()).abs());
        }
        std::println!("log2 is off by {worst:.1} of 1024");
        assert!(worst <= 10.0);
        let mut worst: f64 = 0.0;
        for x in -8 * OCTAVE..4 * OCTAVE {
            let real = 65536.0 * (f64::from(x) / 1024.0).exp2();
            worst = worst.max((f64::from(exp2(x)) - real).abs() / real.max(256.0));
        }
        std::println!("exp2 is off by {:.2} %", 100.0 * worst);
        assert!(worst <= 0.007);
        assert_eq!([log2(0), log2(1), log2(u64::MAX) >> 10], [0, 0, 63]);
        assert_eq!(
            [exp2(i32::MAX), exp2(i32::MIN), exp2(0)],
            [16 * SHARE, 0, SHARE]
        );
    }
}
