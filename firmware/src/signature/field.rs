//! Numbers modulo p = 2²⁵⁵ − 19, as eight words of 32 bits: what one multiplication with addition of a Cortex-M4 takes.

use core::ops::{Add, Mul, Sub};

/// A number modulo p: any number below 2²⁵⁶ that leaves the same rest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fe([u32; 8]);

/// 2²⁵⁶ modulo p.
const FOLD: i64 = 38;

/// What is beyond the eight words, `carry`·2²⁵⁶, folded back into them.
#[inline(never)]
fn fold(words: &mut [u32; 8], mut carry: i64) {
    // The first round leaves −1, 0 or 1, and then words so close to the end that the second leaves nothing.
    for _ in 0..2 {
        carry *= FOLD;
        for word in words.iter_mut() {
            let sum = i64::from(*word) + carry;
            *word = sum as u32;
            carry = sum >> 32;
        }
    }
}

/// Takes the highest bit off, 2²⁵⁵, and gives it.
fn cut(words: &mut [u32; 8]) -> u32 {
    let [.., last] = words;
    let bit = *last >> 31;
    *last &= u32::MAX >> 1;
    bit
}

/// A little more; what is beyond 2²⁵⁶ is lost.
fn plus(mut words: [u32; 8], more: u32) -> [u32; 8] {
    let mut carry = u64::from(more);
    for word in &mut words {
        carry += u64::from(*word);
        *word = carry as u32;
        carry >>= 32;
    }
    words
}

impl Fe {
    pub(super) const ZERO: Self = Self([0; 8]);
    pub(super) const ONE: Self = Self([1, 0, 0, 0, 0, 0, 0, 0]);

    /// From its words, the lowest first.
    pub(super) const fn new(words: [u32; 8]) -> Self {
        Self(words)
    }

    /// From bytes, the lowest first; the highest bit is not read.
    pub(super) fn from_bytes(bytes: &[u8; 32]) -> Self {
        let mut words = [0; 8];
        for (word, bytes) in words.iter_mut().zip(bytes.as_chunks().0) {
            *word = u32::from_le_bytes(*bytes);
        }
        cut(&mut words);
        Self(words)
    }

    /// The number below p that it stands for, as bytes, the lowest first.
    #[inline(never)]
    pub(super) fn to_bytes(self) -> [u8; 32] {
        let mut words = self.0;
        // Two rounds leave a number below 2²⁵⁵; p is still in it where 19 more reach that.
        for _ in 0..2 {
            let above = cut(&mut words);
            words = plus(words, 19 * above);
        }
        let mut less = plus(words, 19);
        if cut(&mut less) == 1 {
            words = less;
        }
        let mut bytes = [0; 32];
        for (place, word) in bytes.as_chunks_mut().0.iter_mut().zip(words) {
            *place = word.to_le_bytes();
        }
        bytes
    }

    /// Its power, with the exponent of 256 bits whose lowest and highest byte these are, and whose other bits are all ones.
    #[inline(never)]
    fn power(self, lowest: u8, highest: u8) -> Self {
        let mut result = Self::ONE;
        for place in (0..32).rev() {
            let byte = match place {
                0 => lowest,
                31 => highest,
                _ => 0xFF,
            };
            for bit in (0..8).rev() {
                result = result * result;
                if byte >> bit & 1 == 1 {
                    result = result * self;
                }
            }
        }
        result
    }

    /// One over it, 0 of 0: its power p − 2.
    pub(super) fn inverse(self) -> Self {
        self.power(0xEB, 0x7F)
    }

    /// Its power (p − 5)/8, with which roots are found.
    pub(super) fn power_of_root(self) -> Self {
        self.power(0xFD, 0x0F)
    }

    /// Whether two stand for the same number.
    pub(super) fn is(self, other: Self) -> bool {
        self.to_bytes() == other.to_bytes()
    }

    /// Whether the number below p that it stands for is odd.
    pub(super) fn is_odd(self) -> bool {
        let [lowest, ..] = self.to_bytes();
        lowest & 1 == 1
    }
}

impl Add for Fe {
    type Output = Self;

    #[inline(never)]
    fn add(self, other: Self) -> Self {
        let (mut words, mut carry) = (self.0, 0);
        for (a, b) in words.iter_mut().zip(other.0) {
            carry += i64::from(*a) + i64::from(b);
            *a = carry as u32;
            carry >>= 32;
        }
        fold(&mut words, carry);
        Self(words)
    }
}

impl Sub for Fe {
    type Output = Self;

    #[inline(never)]
    fn sub(self, other: Self) -> Self {
        let (mut words, mut carry) = (self.0, 0);
        for (a, b) in words.iter_mut().zip(other.0) {
            carry += i64::from(*a) - i64::from(b);
            *a = carry as u32;
            carry >>= 32;
        }
        fold(&mut words, carry);
        Self(words)
    }
}

impl Mul for Fe {
    type Output = Self;

    #[inline(never)]
    fn mul(self, other: Self) -> Self {
        let mut product = [[0_u32; 8]; 2];
        for (place, a) in self.0.into_iter().enumerate() {
            let mut carry = 0;
            let sums = product.as_flattened_mut().iter_mut().skip(place);
            for (sum, b) in sums.zip(other.0.into_iter().chain([0])) {
                // At most 2⁶⁴ − 1.
                carry += u64::from(a) * u64::from(b) + u64::from(*sum);
                *sum = carry as u32;
                carry >>= 32;
            }
        }
        let [mut words, high] = product;
        let mut carry = 0;
        for (low, high) in words.iter_mut().zip(high) {
            carry += i64::from(*low) + FOLD * i64::from(high);
            *low = carry as u32;
            carry >>= 32;
        }
        fold(&mut words, carry);
        Self(words)
    }
}

#[cfg(test)]
mod tests {
    use super::Fe;

    /// p − 1, p, p + 1, 2p, and the largest number that eight words hold.
    fn edges() -> [Fe; 6] {
        let low = |low: u32, high: u32| Fe::new([low, !0, !0, !0, !0, !0, !0, high]);
        [
            Fe::ZERO,
            low(!0 - 19, !0 >> 1),
            low(!0 - 18, !0 >> 1),
            low(!0 - 17, !0 >> 1),
            low(!0 - 37, !0),
            low(!0, !0),
        ]
    }

    #[test]
    fn every_form_of_a_number_is_that_number() {
        let [zero, minus_one, p, one, two_p, most] = edges();
        assert!(p.is(zero) && two_p.is(zero) && one.is(Fe::ONE));
        assert!((minus_one + Fe::ONE).is(zero) && (zero - Fe::ONE).is(minus_one));
        let thirty_seven = Fe::new([37, 0, 0, 0, 0, 0, 0, 0]);
        assert!(most.is(thirty_seven));
        assert!((minus_one * minus_one).is(one) && (most * most).is(thirty_seven * thirty_seven));
    }

    #[test]
    fn the_laws_of_a_field_hold_at_the_edges() {
        for a in edges() {
            for b in edges() {
                assert!((a + b - b).is(a) && (a - b + b).is(a));
                assert!((a * b).is(b * a));
                for c in edges() {
                    assert!((a * (b - c)).is(a * b - a * c));
                    assert!(((a * b) * c).is(a * (b * c)));
                }
            }
            if !a.is(Fe::ZERO) {
                assert!((a * a.inverse()).is(Fe::ONE));
            }
        }
        assert!(Fe::ZERO.inverse().is(Fe::ZERO));
    }
}
