//! What people read, and what every layer needs for it: errors in one sentence, tables, plots of
//! characters, dates, files written whole and read up to a size; work that is followed from
//! outside.

pub mod date;
pub mod error;
pub(crate) mod guard;
pub(crate) mod hexadecimal;
pub(crate) mod input;
pub(crate) mod nearest;
pub mod output;
pub(crate) mod printable;
pub mod table;
pub mod text_plot;
pub(crate) mod units;
pub mod work;
