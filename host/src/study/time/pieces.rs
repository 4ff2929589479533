//! Gaps and pieces: when a step between two samples is a gap, and which pieces between gaps are
//! long enough.

use super::{LONGEST_GAP, round_rate};
use crate::study::series::median;
use jointwatch_shared::wire::rig::{MAX_BAND_TAPS, MAX_TAPS};

/// Fewest rows of a piece between gaps: after the longest differentiator there are twice as many
/// left as the longest low-pass has taps.
pub(crate) const SHORTEST_PIECE: usize = MAX_TAPS + 2 * MAX_BAND_TAPS - 1;
/// Fewest rows of a record.
pub(crate) const MIN_ROWS: usize = 100;

/// “split at 2 gaps, the first before …”.
pub(crate) fn said_of_gaps(gaps: usize, before: &str, left_out: usize) -> String {
    let gaps = match gaps {
        1 => "a gap".to_owned(),
        n => format!("{n} gaps, the first"),
    };
    let left_out = match left_out {
        0 => String::new(),
        1 => format!("; one part of fewer than {SHORTEST_PIECE} rows is left out"),
        n => format!("; {n} parts of fewer than {SHORTEST_PIECE} rows are left out"),
    };
    format!(
        "split at {gaps} before {before}: nothing is differentiated or filtered across{left_out}"
    )
}

/// A channel sampled less often than this part of the wanted rate leaves a part of the band empty.
pub(crate) const TOO_FINE: f64 = 0.8;

/// Steps over which the density is a mean: of fewer a jitter makes most of it.
const AROUND: usize = 20;
/// The part of the time in which the times may lie less densely than is said.
const SPARSE: f64 = 0.1;

/// How densely times lie that are in order.
pub(crate) struct Density {
    /// Different times per second, gaps left out; of times that lie far less densely for a while,
    /// as many as there are then: an even series has nothing to go by between them.
    pub(crate) rate_hz: f64,
    /// A longer step is a gap, s.
    pub(crate) gap_s: f64,
}

/// `None` where there are no two different times.
pub(crate) fn density(sorted: &[f64]) -> Option<Density> {
    let steps = || {
        let steps = sorted.windows(2).map(|w| w[1] - w[0]);
        steps.filter(|s| *s > 0.0)
    };
    let gap_s = (LONGEST_GAP as f64 + 1.5) * median(steps().collect())?;
    let short: Vec<f64> = steps().filter(|s| *s <= gap_s).collect();
    let whole_s: f64 = short.iter().sum();
    let mean = short.len() as f64 / whole_s;
    // Each piece with its rate and how long it lasts, the least dense one first.
    let mut pieces: Vec<[f64; 2]> = short
        .chunks_exact(AROUND)
        .map(|piece| piece.iter().sum())
        .map(|lasts_s: f64| [AROUND as f64 / lasts_s, lasts_s])
        .collect();
    pieces.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    let mut passed_s = 0.0;
    let sparse = pieces.iter().find(|[_, lasts_s]| {
        passed_s += lasts_s;
        passed_s > SPARSE * whole_s
    });
    let sparse = sparse.map(|[rate, _]| *rate);
    let sparse = sparse.filter(|rate| *rate < TOO_FINE * mean);
    Some(Density {
        rate_hz: round_rate(sparse.unwrap_or(mean), 1e-4),
        gap_s,
    })
}

/// The rows in which times begin anew: they fall back by most of the way that they went, nowhere by
/// less, and not after every few rows, as those do of which the last stands first.
pub(crate) fn restarts(times: &[f64]) -> Vec<usize> {
    let mut first = times.first().copied().unwrap_or_default();
    let mut found = Vec::new();
    for (row, pair) in times.windows(2).enumerate() {
        let (went, back) = (pair[0] - first, pair[0] - pair[1]);
        if back > 0.0 && 2.0 * back < went {
            return Vec::new();
        }
        if back > 0.0 {
            found.push(row + 1);
            first = pair[1];
        }
    }
    match found.len() * MIN_ROWS < times.len() {
        true => found,
        false => Vec::new(),
    }
}
