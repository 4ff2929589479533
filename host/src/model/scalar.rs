//! The kinds of number in which the host simulates a model.

use jointwatch_shared::effect::{Entry, Law as EffectLaw, SLOPES};
use jointwatch_shared::scalar::Scalar;
use jointwatch_shared::scalar::dual::Dual;

/// A kind of number in which the host simulates: f64 moves, a dual number also says how the motion
/// changes with one quantity.
pub trait HostScalar: Scalar + Send + Sync + 'static {
    /// A number that depends on nothing.
    fn constant(value: f64) -> Self;
    /// Its value alone, without what it depends on.
    fn value(self) -> f64;
    /// The quotient by another, which is not 0.
    fn over(self, other: Self) -> Self;
    /// An effect's law for this kind of number.
    fn law_of(entry: &Entry) -> EffectLaw<Self>;
}

impl HostScalar for f64 {
    fn constant(value: f64) -> Self {
        value
    }
    fn value(self) -> f64 {
        self
    }
    fn over(self, other: Self) -> Self {
        self / other
    }
    fn law_of(entry: &Entry) -> EffectLaw<Self> {
        entry.real
    }
}

/// The law of an effect for a dual number: which it is depends on how many slopes the number
/// carries.
macro_rules! dual {
    ($slopes:expr, $law:ident) => {
        impl HostScalar for Dual<{ $slopes }> {
            fn constant(value: f64) -> Self {
                Dual::constant(value)
            }
            fn value(self) -> f64 {
                self.value
            }
            fn over(self, other: Self) -> Self {
                let value = self.value / other.value;
                let slope = |k: usize| (self.slopes[k] - value * other.slopes[k]) / other.value;
                Self {
                    value,
                    slopes: std::array::from_fn(slope),
                }
            }
            fn law_of(entry: &Entry) -> EffectLaw<Self> {
                entry.$law
            }
        }
    };
}
dual!(1, dual);
dual!(SLOPES, gradient);
