//! Figures of a series of samples.

/// The mean of a series; 0 of an empty one.
pub(crate) fn mean(series: &[f64]) -> f64 {
    series.iter().sum::<f64>() / series.len().max(1) as f64
}

/// The mean of the squares of a series.
pub(crate) fn mean_square(series: &[f64]) -> f64 {
    series.iter().map(|v| v * v).sum::<f64>() / series.len().max(1) as f64
}

/// The root of the mean square of a series.
pub(crate) fn rms(series: &[f64]) -> f64 {
    mean_square(series).sqrt()
}

/// RMS about the mean, also of values that vary little around a large one.
pub(crate) fn spread(series: &[f64]) -> f64 {
    rms(&about_mean(series))
}

/// A series without its mean.
pub(crate) fn about_mean(series: &[f64]) -> Vec<f64> {
    let mean = mean(series);
    series.iter().map(|value| value - mean).collect()
}

/// The sum of the products of two series, row by row.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Takes out of a series what is proportional to another one.
pub(crate) fn take_out(series: &mut [f64], other: &[f64]) {
    let share = dot(series, other) / dot(other, other);
    let pairs = series.iter_mut().zip(other);
    pairs.for_each(|(s, o)| *s -= share * o);
}

/// Series at right angles that make the same sums as these, by Gram–Schmidt; one of whose power the
/// ones before leave no more than the part `least` adds none.
pub(crate) fn at_right_angles(series: &[impl AsRef<[f64]>], least: f64) -> Vec<Vec<f64>> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for whole in series.iter().map(AsRef::as_ref) {
        let mut own = whole.to_vec();
        basis.iter().for_each(|known| take_out(&mut own, known));
        if dot(&own, &own) > least * dot(whole, whole) {
            basis.push(own);
        }
    }
    basis
}

/// The largest magnitude in a series.
pub(crate) fn peak(series: &[f64]) -> f64 {
    series.iter().fold(0.0, |most, value| most.max(value.abs()))
}

/// The smallest and the largest of some values.
pub(crate) fn extent(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let nothing = [f64::INFINITY, f64::NEG_INFINITY];
    values.fold(nothing, |[low, high], v| [low.min(v), high.max(v)])
}

/// Largest minus smallest of some values; 0 where there are none.
pub(crate) fn range(values: &[f64]) -> f64 {
    let [low, high] = extent(values.iter().copied());
    (high - low).max(0.0)
}

/// The middle one of some values, of which there is at least one.
pub(crate) fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The standard error of what was estimated from several blocks, by what it is without each of
/// them.
pub(crate) fn jackknife(without_each: impl Iterator<Item = f64>) -> f64 {
    let estimates: Vec<f64> = without_each.collect();
    let (count, middle) = (estimates.len() as f64, mean(&estimates));
    let squares = estimates.iter().map(|e| (e - middle).powi(2));
    ((count - 1.0) / count * squares.sum::<f64>()).sqrt()
}

#[cfg(test)]
mod tests {
    use super::spread;

    #[test]
    fn a_channel_that_varies_little_around_a_large_count_is_seen_to_vary() {
        let counts: Vec<f64> = (0..30_000).map(|n| 2e9 + f64::from(n % 8)).collect();
        assert_eq!(spread(&counts).round(), 2.0);
    }
}
