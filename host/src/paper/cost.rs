//! What a fit costs: CPU seconds of one thread.

use crate::text::error::{Error, Result};
use cpu_time::ThreadTime;

/// Fits are repeated so many times; the median counts, because other programs may use the machine.
const RUNS: usize = 5;

/// CPU seconds that `work` takes in one thread, the median of five runs.
///
/// CPU time rather than time on the clock, and one thread rather than all: only so is it the same
/// quantity for a fit that uses every core and one that does not, on a machine that may be busy.
///
/// # Errors
/// What `work` gives, or that no thread could be started.
pub(super) fn cpu_seconds<T>(work: impl Fn() -> Result<T> + Sync) -> Result<f64> {
    let alone = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .map_err(|e| Error::failed(format!("a thread could not be started ({e})")))?;
    alone.install(|| {
        let mut runs = Vec::new();
        for _ in 0..RUNS {
            let clock = ThreadTime::now();
            work()?;
            runs.push(clock.elapsed().as_secs_f64());
        }
        runs.sort_by(f64::total_cmp);
        Ok(runs[RUNS / 2])
    })
}
