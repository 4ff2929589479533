//! Points of the curve −x² + y² = 1 + d·x²·y² over the field, which is Edwards' form of Curve25519.

use super::field::Fe;
use super::scalar::Scalar;

/// A point as X/Z, Y/Z and T = X·Y/Z.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    x: Fe,
    y: Fe,
    z: Fe,
    t: Fe,
}

/// d = −121665/121666.
const D: Fe = Fe::new([
    0x1359_78A3,
    0x75EB_4DCA,
    0x4141_D8AB,
    0x0070_0A4D,
    0x7779_E898,
    0x8CC7_4079,
    0x2B6F_FE73,
    0x5203_6CEE,
]);

/// A root of −1.
const ROOT_OF_MINUS_ONE: Fe = Fe::new([
    0x4A0E_A0B0,
    0xC4EE_1B27,
    0xAD2F_E478,
    0x2F43_1806,
    0x3DFB_D7A7,
    0x2B4D_0099,
    0x4FC1_DF0B,
    0x2B83_2480,
]);

impl Point {
    /// The neutral one.
    const ZERO: Self = Self {
        x: Fe::ZERO,
        y: Fe::ONE,
        z: Fe::ONE,
        t: Fe::ZERO,
    };

    /// The one with y = 4/5 and an even x, which keys are multiples of.
    pub(super) const BASE: Self = Self {
        x: Fe::new([
            0x8F25_D51A,
            0xC956_2D60,
            0x9525_A7B2,
            0x692C_C760,
            0xFDD6_DC5C,
            0xC0A4_E231,
            0xCD6E_53FE,
            0x2169_36D3,
        ]),
        y: Fe::new([
            0x6666_6658,
            0x6666_6666,
            0x6666_6666,
            0x6666_6666,
            0x6666_6666,
            0x6666_6666,
            0x6666_6666,
            0x6666_6666,
        ]),
        z: Fe::ONE,
        t: Fe::new([
            0xA5B7_DDA3,
            0x6DDE_8AB3,
            0x7751_52F5,
            0x20F0_9F80,
            0x64AB_E37D,
            0x66EA_4E8E,
            0xD78B_7665,
            0x6787_5F0F,
        ]),
    };

    /// From y and, in the highest bit, whether x is odd (RFC 8032, 5.1.3); `None` when no point has them, or when y has another form.
    pub(super) fn decode(bytes: &[u8; 32]) -> Option<Self> {
        let y = Fe::from_bytes(bytes);
        let [.., last] = bytes;
        let odd = last >> 7 == 1;
        let mut form = y.to_bytes();
        let [.., place] = &mut form;
        *place |= u8::from(odd) << 7;
        if form != *bytes {
            return None;
        }
        // x² = (y² − 1)/(d·y² + 1) = u/v, so x = u·v³·(u·v⁷)^((p − 5)/8), or that times a root of −1.
        let square = y * y;
        let (u, v) = (square - Fe::ONE, D * square + Fe::ONE);
        let cube = v * v * v;
        let mut x = u * cube * (u * cube * cube * v).power_of_root();
        if !(v * x * x).is(u) {
            x = x * ROOT_OF_MINUS_ONE;
            if !(v * x * x).is(u) {
                return None;
            }
        }
        if x.is_odd() != odd {
            if x.is(Fe::ZERO) {
                return None;
            }
            x = Fe::ZERO - x;
        }
        Some(Self {
            x,
            y,
            z: Fe::ONE,
            t: x * y,
        })
    }

    /// y and whether x is odd.
    pub(super) fn encode(&self) -> [u8; 32] {
        let scale = self.z.inverse();
        let mut bytes = (self.y * scale).to_bytes();
        let [.., last] = &mut bytes;
        *last |= u8::from((self.x * scale).is_odd()) << 7;
        bytes
    }

    /// Its negative.
    pub(super) fn negated(&self) -> Self {
        Self {
            x: Fe::ZERO - self.x,
            t: Fe::ZERO - self.t,
            ..*self
        }
    }

    /// Whether its order is a part of 8.
    pub(super) fn is_of_small_order(&self) -> bool {
        let mut point = *self;
        for _ in 0..3 {
            point = point.plus(&point);
        }
        point.x.is(Fe::ZERO) && point.y.is(point.z)
    }

    /// The sum, also of a point and itself (H. Hisil and others, Asiacrypt 2008, 3.1).
    #[inline(never)]
    fn plus(&self, other: &Self) -> Self {
        let a = (self.y - self.x) * (other.y - other.x);
        let b = (self.y + self.x) * (other.y + other.x);
        let c = self.t * (D + D) * other.t;
        let d = self.z * (other.z + other.z);
        let (e, f, g, h) = (b - a, d - c, d + c, b + a);
        Self {
            x: e * f,
            y: g * h,
            z: f * g,
            t: e * h,
        }
    }

    /// `m`·`a` + `n`·`b`, bit by bit for both at once.
    #[inline(never)]
    pub(super) fn sum_of_products(m: &Scalar, a: &Self, n: &Scalar, b: &Self) -> Self {
        let mut sum = Self::ZERO;
        for (of_a, of_b) in m.bits().zip(n.bits()) {
            sum = sum.plus(&sum);
            if of_a {
                sum = sum.plus(a);
            }
            if of_b {
                sum = sum.plus(b);
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_base_point_is_what_the_standard_says() {
        let mut encoded = [0x66; 32];
        encoded[0] = 0x58;
        assert_eq!(Point::BASE.encode(), encoded);
        let decoded = Point::decode(&encoded).unwrap();
        assert!(decoded.x.is(Point::BASE.x) && decoded.t.is(Point::BASE.t));
        assert!(!decoded.is_of_small_order());
        assert!(Point::ZERO.is_of_small_order());
    }

    #[test]
    fn points_of_small_order_are_found_and_other_forms_refused() {
        // Order 4: y = 0. Order 2: y = −1.
        let mut minus_one = [0xFF; 32];
        (minus_one[0], minus_one[31]) = (0xEC, 0x7F);
        for bytes in [[0; 32], minus_one] {
            assert!(Point::decode(&bytes).unwrap().is_of_small_order());
        }
        // y = 1 with an odd x, which is 0; y = p; y = p + 1.
        let mut one = [0; 32];
        (one[0], one[31]) = (1, 0x80);
        let form = |low| {
            let mut bytes = [0xFF; 32];
            (bytes[0], bytes[31]) = (low, 0x7F);
            bytes
        };
        for bytes in [one, form(0xED), form(0xEE)] {
            assert!(Point::decode(&bytes).is_none());
        }
    }
}
