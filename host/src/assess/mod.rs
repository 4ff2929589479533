//! A model held against measurements: how large its errors are, where they sit, how loud the noise
//! is, and whether the data can be trusted.

pub mod compare;
pub mod compared;
pub mod data_checks;
pub(crate) mod noise_floor;
pub(crate) mod unmeasured;
pub mod where_it_fails;
