//! Why a block of bytes or a set of numbers is refused: which quantity, what was seen, what was
//! wanted.

use core::fmt;

/// Why the shared code refuses a model, a rig or a blob. `Display` writes one sentence without a
/// full stop.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// A quantity lies outside the range in which the arithmetic is proven.
    OutOfRange {
        /// The quantity, in words.
        quantity: &'static str,
        /// The value that was found.
        seen: f64,
        /// The smallest value allowed.
        least: f64,
        /// The largest value allowed.
        most: f64,
    },
    /// An axis's name is empty, longer than 16 bytes, not UTF-8, holds a control character, or is
    /// used twice.
    Name {
        /// The axis, from 0.
        axis: u8,
        /// What is wrong with it.
        fault: &'static str,
    },
    /// A polynomial has another number of coefficients than its orders ask for.
    CoefficientCount {
        /// The axis, from 0.
        axis: u8,
        /// How many there are.
        seen: usize,
        /// (m+1)(n+1)(o+1)(p+1) for the orders m, n, o, p.
        wanted: usize,
    },
    /// A coefficient cannot be held: not a number, too large or too small for the force unit to be
    /// a normal `f64`, or, in a blob, outside the orders or the axes that the blob states.
    Coefficient {
        /// The axis, from 0.
        axis: u8,
        /// The exponents of x, ẋ, φ, φ̇.
        exponents: [u8; 4],
        /// The coefficient seen, in N or N·m (in a blob: the stored integer).
        seen: f64,
    },
    /// The fixed-point model would be further from its `f64` original than the caller allows.
    Budget {
        /// The axis, from 0.
        axis: u8,
        /// The exponents of the largest coefficient, which sets how fine the force unit can be.
        exponents: [u8; 4],
        /// That coefficient, in N or N·m.
        coefficient: f64,
        /// The bound of the error, in N or N·m.
        bound: f64,
        /// The bound that was allowed.
        budget: f64,
    },
    /// The stored coefficients could drive a sum of the evaluation beyond its integer.
    Overflow {
        /// The axis, from 0.
        axis: u8,
        /// Which sum, in words.
        sum: &'static str,
        /// The exponents of x and ẋ of the block in which it happens (0, 0 for sums over all
        /// blocks).
        block: [u8; 2],
    },
    /// An effect of a model cannot be what it is stated to be.
    Effect {
        /// The effect's number in blobs.
        tag: u8,
        /// What is wrong with it.
        fault: &'static str,
    },
    /// A network has another number of weights than its neurons and axes ask for.
    WeightCount {
        /// Which weights, in words.
        place: &'static str,
        /// How many there are.
        seen: usize,
        /// How many are wanted.
        wanted: usize,
    },
    /// A number of a network cannot be held: not a number, too large, or, in a blob, of an axis
    /// that is not there.
    Weight {
        /// Which number of the neuron, in words.
        place: &'static str,
        /// The neuron, from 0.
        neuron: u8,
        /// The value seen: without unit, or in N or N·m for an output weight (in a blob: the
        /// stored integer).
        seen: f64,
    },
    /// The fixed-point network would be further from its `f64` original than the caller allows.
    NetworkBudget {
        /// The axis, from 0.
        axis: u8,
        /// The bound of the error, in N or N·m.
        bound: f64,
        /// The bound that was allowed.
        budget: f64,
        /// The neuron that contributes most to the bound, from 0.
        neuron: u8,
        /// What it contributes, in N or N·m.
        share: f64,
        /// The largest size that its argument can have.
        reach: f64,
        /// Its output weight, in N or N·m.
        weight: f64,
    },
    /// The stored weights could drive a sum of the evaluation beyond its integer.
    WeightOverflow {
        /// Which sum, in words.
        sum: &'static str,
        /// The neuron or the axis, from 0.
        number: u8,
    },
    /// The effects in fixed point would be further from their `f64` originals than the caller
    /// allows.
    EffectBudget {
        /// The axis, from 0.
        axis: u8,
        /// The bound of the error, in N or N·m.
        bound: f64,
        /// The bound that was allowed.
        budget: f64,
    },
    /// A blob has another length than [`BLOB_LEN`](crate::wire::blob::BLOB_LEN).
    BlobLength {
        /// Bytes that were found.
        seen: usize,
        /// Bytes that a blob has.
        wanted: usize,
    },
    /// The first bytes are not those of a model blob: an erased flash slot, or another file.
    BlobMagic {
        /// The four bytes seen.
        seen: [u8; 4],
    },
    /// The blob's format has another version than this program reads.
    BlobVersion {
        /// The format version that was found.
        seen: u16,
        /// The version that this program reads and writes.
        wanted: u16,
    },
    /// The checksum does not match: the blob is damaged.
    BlobChecksum {
        /// The checksum that stands in the blob.
        seen: u32,
        /// The checksum of the blob's bytes.
        wanted: u32,
    },
    /// A byte of the blob has a value that its field does not know.
    BlobField {
        /// The field, in words.
        field: &'static str,
        /// The value that was found.
        seen: u8,
    },
    /// A byte that has to be zero is not.
    BlobReserved {
        /// Where it stands, in bytes from the blob's start.
        offset: usize,
        /// The value that was found.
        seen: u8,
    },
}

impl Error {
    /// `Ok` when `seen` lies between `least` and `most` (a NaN never does), else
    /// [`Error::OutOfRange`].
    pub(crate) fn unless_within(
        quantity: &'static str,
        seen: f64,
        least: f64,
        most: f64,
    ) -> Result<(), Self> {
        let mut checks = Checks::new();
        checks.within(quantity, seen, least, most);
        checks.done()
    }
}

/// Many quantities held against their ranges, of which the first that is wrong is told.
///
/// A check gives no answer, so that a list of checks reads as a list.
pub(crate) struct Checks(Result<(), Error>);

impl Checks {
    /// Nothing is wrong yet.
    pub(crate) const fn new() -> Self {
        Self(Ok(()))
    }

    /// A real number from `least` to `most`; a NaN never is.
    pub(crate) fn within(&mut self, quantity: &'static str, seen: f64, least: f64, most: f64) {
        // A NaN is in no range.
        if !(least..=most).contains(&seen) {
            self.say(Error::OutOfRange {
                quantity,
                seen,
                least,
                most,
            });
        }
    }

    /// A whole number from `least` to `most`.
    pub(crate) fn whole(&mut self, quantity: &'static str, seen: i32, least: i32, most: i32) {
        if seen < least || seen > most {
            self.say(Error::OutOfRange {
                quantity,
                seen: f64::from(seen),
                least: f64::from(least),
                most: f64::from(most),
            });
        }
    }

    /// A whole number of up to 53 bits from `least` to `most`; what is beyond counts as more than
    /// `most`.
    pub(crate) fn long(&mut self, quantity: &'static str, seen: u64, least: u64, most: u64) {
        if seen < least || seen > most {
            self.say(Error::OutOfRange {
                quantity,
                seen: seen as f64,
                least: least as f64,
                most: most as f64,
            });
        }
    }

    /// What is wrong, where that is known already.
    pub(crate) fn say(&mut self, error: Error) {
        if self.0.is_ok() {
            self.0 = Err(error);
        }
    }

    /// The first that was wrong.
    pub(crate) fn done(self) -> Result<(), Error> {
        self.0
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::OutOfRange {
                quantity,
                seen,
                least,
                most,
            } => write!(
                f,
                "{quantity} is {seen}, but has to lie between {least} and {most}"
            ),
            Self::Name { axis, fault } => write!(f, "the name of axis {axis} {fault}"),
            Self::CoefficientCount { axis, seen, wanted } => write!(
                f,
                "axis {axis} has {seen} coefficients, but its orders ask for {wanted}"
            ),
            Self::Coefficient {
                axis,
                exponents: [i, j, k, l],
                seen,
            } => write!(
                f,
                "the coefficient of x^{i} x'^{j} phi^{k} phi'^{l} of axis {axis} is {seen}, which the model cannot hold"
            ),
            Self::Budget {
                axis,
                exponents: [i, j, k, l],
                coefficient,
                bound,
                budget,
            } => write!(
                f,
                "the fixed-point model of axis {axis} may be off by {bound:e}, but {budget:e} is allowed; its largest \
                 coefficient is {coefficient:e} at x^{i} x'^{j} phi^{k} phi'^{l}: fit fewer terms or a stronger ridge"
            ),
            Self::Overflow {
                axis,
                sum,
                block: [i, j],
            } => write!(
                f,
                "the stored coefficients of axis {axis} can overflow the {sum} (block x^{i} x'^{j}): export the model again"
            ),
            Self::Effect { tag, fault } => write!(f, "effect number {tag} {fault}"),
            Self::EffectBudget {
                axis,
                bound,
                budget,
            } => write!(
                f,
                "the effects on axis {axis} may be off by {bound:e} in fixed point, but {budget:e} is allowed: look for one \
                 whose parameters are far out of proportion"
            ),
            Self::WeightCount { .. }
            | Self::Weight { .. }
            | Self::NetworkBudget { .. }
            | Self::WeightOverflow { .. } => self.fmt_of_network(f),
            Self::BlobLength { .. }
            | Self::BlobMagic { .. }
            | Self::BlobVersion { .. }
            | Self::BlobChecksum { .. }
            | Self::BlobField { .. }
            | Self::BlobReserved { .. } => self.fmt_of_blob(f),
        }
    }
}

impl Error {
    /// What is wrong with a network; of anything else nothing.
    fn fmt_of_network(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::WeightCount {
                place,
                seen,
                wanted,
            } => write!(
                f,
                "the network has {seen} {place}, but its neurons and axes ask for {wanted}"
            ),
            Self::Weight {
                place,
                neuron,
                seen,
            } => write!(
                f,
                "the {place} of neuron {neuron} is {seen}, which the model cannot hold"
            ),
            Self::NetworkBudget {
                axis,
                bound,
                budget,
                neuron,
                share,
                reach,
                weight,
            } => write!(
                f,
                "the fixed-point network of axis {axis} may be off by {bound:.2e}, but {budget:.2e} is allowed; neuron \
                 {neuron} costs most, {share:.2e}, with an output weight of {weight:.2e} and an argument of up to \
                 {reach:.2e}: train with fewer neurons or from another seed"
            ),
            Self::WeightOverflow { sum, number } => write!(
                f,
                "the stored weights can overflow the {sum} {number}: export the model again"
            ),
            _ => Ok(()),
        }
    }

    /// What is wrong with the bytes of a blob; of anything else nothing.
    fn fmt_of_blob(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::BlobLength { seen, wanted } => {
                write!(
                    f,
                    "the blob has {seen} bytes, but a model blob has {wanted}"
                )
            }
            Self::BlobMagic { seen } => write!(
                f,
                "the blob begins with the bytes {seen:02x?}, which is not a Jointwatch model"
            ),
            Self::BlobVersion { seen, wanted } => write!(
                f,
                "the blob has format version {seen}, but this program reads version {wanted}: export the model again"
            ),
            Self::BlobChecksum { seen, wanted } => write!(
                f,
                "the blob's checksum is {seen:08x}, but its bytes give {wanted:08x}: it is damaged, copy it again"
            ),
            Self::BlobField { field, seen } => {
                write!(
                    f,
                    "the blob's {field} is {seen}, which this program does not know"
                )
            }
            Self::BlobReserved { offset, seen } => {
                write!(f, "byte {offset} of the blob is {seen}, but has to be 0")
            }
            _ => Ok(()),
        }
    }
}

impl core::error::Error for Error {}

#[cfg(test)]
mod tests {
    use super::Error;

    #[test]
    fn a_range_holds_its_ends_and_both_zeros_and_a_nan_is_within_nothing() {
        let within = |seen, least, most| Error::unless_within("it", seen, least, most).is_ok();
        assert!(within(1.0, 1.0, 2.0) && within(2.0, 1.0, 2.0));
        assert!(!within(0.999, 1.0, 2.0) && !within(2.001, 1.0, 2.0));
        assert!(within(-0.0, 0.0, 0.0) && within(0.0, -0.0, -0.0));
        for nan in [f64::NAN, -f64::NAN] {
            assert!(!within(nan, f64::NEG_INFINITY, f64::INFINITY));
        }
    }
}
