//! Zero in one form: −0 and 0 are the same number, but not the same bytes.

use serde::Serializer;

/// Writes a real number of which zero has one form, so that equal rigs have equal bytes.
pub(crate) fn plain_zero<S: Serializer>(value: &f64, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_f64(value + 0.0)
}
