//! Where a model fails, and why.

pub mod where_it_fails;
