//! The monitor: does the joint still behave like its model, within the range in which the model is valid?

pub mod limits;
