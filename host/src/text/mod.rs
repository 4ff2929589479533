//! What people read, and what every layer needs for it: errors in one sentence, tables, plots of characters, dates, files written whole.

pub mod date;
pub mod error;
pub(crate) mod nearest;
pub mod output;
pub mod table;
pub mod text_plot;
pub(crate) mod units;
