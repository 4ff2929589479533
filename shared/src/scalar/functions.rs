//! What force laws need of the device's number beyond sums and products: the hyperbolic tangent,
//! decay, the sine, short numbers.

use super::q::{PLACES, Q};
use super::short::{self, Short};
use super::{Number, Scalar, elementary};
use crate::base::tanh::tanh;
use crate::scalar::fixed::round_shift;

impl Scalar for Q {
    type Short = Short;

    #[inline]
    fn short(self) -> Short {
        Short::saturated(round_shift(self.raw(), PLACES - short::PLACES))
    }
    #[inline]
    fn long(short: Short) -> Self {
        Self::from_raw(i64::from(short.raw()) << (PLACES - short::PLACES))
    }
    #[inline]
    fn change(self, step: Self, factor: Self) -> Self {
        self * factor - self.minus(step) * factor
    }
    #[inline]
    fn short_change(self, step: Self, factor: Self, limit: Short) -> Short {
        // Their difference is what has to be small, not they: a position may be many times what a
        // hysteresis yields by.
        let (now, before) = (self * factor, self.minus(step) * factor);
        let cut = |q: Self| q.raw() >> (PLACES - short::PLACES);
        Short::saturated(cut(now) - cut(before)).within(limit)
    }
    #[inline]
    fn tanh(self) -> Self {
        // The table's argument has 27 places and ends at ±16, where the tangent is 1 to its last
        // bit.
        const MOST: i64 = (1 << 36) - (1 << 5);
        let argument = self.raw().clamp(-MOST, MOST);
        Self::from_q31(tanh(((argument + (1 << 4)) >> 5) as i32))
    }
    fn decay(self) -> Self {
        elementary::decay(self)
    }
    fn decay_of_either_sign(self) -> [Self; 3] {
        // One of the two is exactly 1, which takes as long to compute as the other, and the product
        // is the other.
        let decay = elementary::decay(self.abs());
        if self.raw() < 0 {
            [Self::one(), decay, decay]
        } else {
            [decay, Self::one(), decay]
        }
    }
    fn hyperbolic_decay(self) -> Self {
        elementary::hyperbolic_decay(self)
    }
    fn gaussian(self) -> Self {
        // A square that saturates decays to 0 as one that is held does.
        elementary::decay(self * self)
    }
    fn sine(self) -> Self {
        elementary::sine(self)
    }
}
