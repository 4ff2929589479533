//! The project itself: its book, its layers and the faults that its tests have to notice.

mod docs;
mod docs_figures;
mod effects_page;
mod faults;
mod layers;
