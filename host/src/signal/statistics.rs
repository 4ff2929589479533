//! Figures of a series of samples.

/// The largest magnitude in a series.
pub(crate) fn peak(series: &[f64]) -> f64 {
    series.iter().fold(0.0, |most, value| most.max(value.abs()))
}

/// The root of the mean square of a series.
pub(crate) fn rms(series: &[f64]) -> f64 {
    (series.iter().map(|v| v * v).sum::<f64>() / series.len().max(1) as f64).sqrt()
}
