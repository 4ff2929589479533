//! Commands for logs and studies: write one, look at one, make one smaller.

pub(super) mod init;
pub(super) mod inspect;
pub(super) mod select;
pub(super) mod simulate;
mod survey;
