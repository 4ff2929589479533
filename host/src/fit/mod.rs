//! Learning a model from motions.
