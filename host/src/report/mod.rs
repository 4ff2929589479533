//! Drawings of a record: time histories and phase plots of the restoring force, measured and predicted, as SVG.
//!
//! A [`Course`] holds what is drawn of one axis of one record. [`time_history`] and [`phase`] turn it into a [`Panel`], a
//! [`Figure`] lays panels out in rows, and [`Figure::svg`] draws them. Every drawing is readable without colour.

mod comparison;
mod course;
mod figure;
pub mod phase;
mod quantity;
mod simplify;
mod style;
pub mod time_history;

pub use comparison::comparison;
pub use course::{Course, courses};
pub use figure::{Curve, Figure, Panel};
pub use phase::Against;
pub use style::Pen;
