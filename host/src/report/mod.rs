//! Drawings of a model on a record, as SVG: time histories, phase plots, the residual over the
//! state plane, the staircase of errors.
//!
//! A [`AxisHistory`] holds what is drawn of one axis of one record. [`time_history`] and [`phase`]
//! turn it into a [`Panel`], a [`Figure`] lays panels out in rows, and [`Figure::svg`] draws them;
//! [`StatePlane`] and [`staircase`] draw their own kind of picture. [`pictures`] makes all of them
//! for a model and a study. Every drawing is readable without colour.

mod axis_history;
mod comparison;
pub mod drawing;
pub mod effects_page;
mod figure;
pub mod page;
pub mod phase;
pub mod pictures;
mod quantity;
mod simplify;
mod staircase;
mod state_plane;
pub mod steps;
mod style;
pub mod time_history;

pub use axis_history::{AxisHistory, histories};
pub use comparison::comparison;
pub use drawing::Drawing;
pub use figure::{Curve, Figure, Panel, Thinned};
pub use phase::Against;
pub use staircase::{Step, staircase};
pub use state_plane::StatePlane;
pub use style::Pen;
