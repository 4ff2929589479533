//! Which rows of a record the page holds, and how they are written: peaks stay, the file stays
//! small.

use super::contents::Packed;
use crate::study::series::extent;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// Largest integer of a packed series.
const FULL_SCALE: f64 = 32_767.0;

/// The rows to keep of `rows`: all when `budget` allows, else of every stretch of equal length
/// those at which one of the series is smallest or largest. The first and the last row always stay.
pub(super) fn kept_rows(rows: usize, series: &[&[f64]], budget: usize) -> Vec<usize> {
    if rows <= budget.max(2) {
        return (0..rows).collect();
    }
    let stretches = (budget / (2 * series.len().max(1))).max(1);
    let mut kept = vec![0, rows - 1];
    for stretch in 0..stretches {
        let range = stretch * rows / stretches..(stretch + 1) * rows / stretches;
        for one in series {
            let by = |a: &usize, b: &usize| one[*a].total_cmp(&one[*b]);
            kept.extend(range.clone().min_by(by));
            kept.extend(range.clone().max_by(by));
        }
    }
    kept.sort_unstable();
    kept.dedup();
    kept
}

/// Some rows of a series as integers of 16 bits: an error of at most 1/131,068 of the series'
/// range.
pub(super) fn packed(series: &[f64], rows: &[usize]) -> Packed {
    let values = || rows.iter().map(|row| series[*row]);
    let [low, high] = extent(values().filter(|v| v.is_finite()));
    let middle = if low.is_finite() {
        0.5 * (low + high)
    } else {
        0.0
    };
    let step = if high > low {
        0.5 * (high - low) / FULL_SCALE
    } else {
        1.0
    };
    let count = |v: f64| match v.is_finite() {
        true => ((v - middle) / step).round() as i16,
        false => i16::MIN,
    };
    let bytes: Vec<u8> = values().flat_map(|v| count(v).to_le_bytes()).collect();
    Packed {
        middle,
        step,
        data: STANDARD.encode(bytes),
    }
}

/// A series as a few of its rows, peaks among them, and the values there.
pub(crate) fn thinned(series: &[f64], budget: usize) -> (Vec<usize>, Packed) {
    let rows = kept_rows(series.len(), &[series], budget);
    let values = packed(series, &rows);
    (rows, values)
}

/// Base64 characters that a packed series takes per row.
pub(super) const CHARACTERS_PER_ROW: f64 = 2.0 * 4.0 / 3.0;

#[cfg(test)]
mod tests {
    use super::*;

    fn unpacked(packed: &Packed) -> Vec<f64> {
        let bytes = STANDARD.decode(&packed.data).unwrap();
        let counts = bytes
            .chunks_exact(2)
            .map(|b| i16::from_le_bytes([b[0], b[1]]));
        counts
            .map(|c| packed.middle + packed.step * f64::from(c))
            .collect()
    }

    #[test]
    fn peaks_stay_and_rows_are_few() {
        let mut series: Vec<f64> = (0..34_000).map(|i| (0.01 * f64::from(i)).sin()).collect();
        series[12_345] = 7.0;
        series[23_456] = -8.0;
        let kept = kept_rows(series.len(), &[&series], 1_000);
        assert!(kept.len() <= 1_002, "{}", kept.len());
        assert!(kept.contains(&12_345) && kept.contains(&23_456));
        assert!(kept.windows(2).all(|pair| pair[0] < pair[1]));
        assert_eq!(kept_rows(50, &[&series], 1_000).len(), 50);
    }

    #[test]
    fn a_packed_series_comes_back_within_half_a_count() {
        let series = [1e6 + 0.25, 1e6 - 3.0, 1e6 + 2.0, 1e6];
        let packed = packed(&series, &[0, 1, 2, 3]);
        for (was, is) in series.iter().zip(unpacked(&packed)) {
            assert!((was - is).abs() <= 0.51 * packed.step, "{was} {is}");
        }
        let gone = super::packed(&[1.0, f64::NAN, 2.0], &[0, 1, 2]);
        assert_eq!(
            STANDARD.decode(&gone.data).unwrap()[2..4],
            i16::MIN.to_le_bytes()
        );
        let constant = super::packed(&[4.0; 3], &[0, 2]);
        assert_eq!(unpacked(&constant), [4.0, 4.0]);
    }
}
