//! Something that is wrong with the data, and where it was found.

/// Something that is wrong with the data.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// What, in which channel and record, from which row on, and what to do; without a full stop.
    pub sentence: String,
    /// Whether a diagnosis means nothing before it is put right.
    pub serious: bool,
    /// Of rows of a force channel that stand out: the axis, and their power behind the low-pass
    /// over the force's. An effect that explains more is none of them.
    pub spikes: Option<(usize, f64)>,
}

/// Where in which record something was found.
pub(super) struct RecordPosition<'a> {
    pub(super) file: &'a str,
    pub(super) axis: usize,
    pub(super) first_row: usize,
    pub(super) sample_rate_hz: f64,
}

impl RecordPosition<'_> {
    /// A row as the file counts it, and when it was since the file began.
    pub(super) fn row(&self, row: usize) -> String {
        format!(
            "row {} ({:.3} s)",
            self.first_row + row,
            (self.first_row + row) as f64 / self.sample_rate_hz
        )
    }
}
