//! The residual cell by cell over the state plane, as shades.

use crate::report::style;
use plotters::prelude::*;

/// Cells across and up.
pub(in crate::report) const CELLS: [usize; 2] = [40, 26];
/// A cell with fewer rows than this is drawn, but does not set the scale.
const ROWS_FOR_SCALE: usize = 5;

/// Which of `count` equal parts of a range a value lies in.
pub(in crate::report) fn part(value: f64, [low, high]: [f64; 2], count: usize) -> usize {
    let at = (value - low) / (high - low) * count as f64;
    (at.max(0.0) as usize).min(count - 1)
}

/// Which cell a displacement and a velocity lie in, for the ranges of both.
pub(in crate::report) fn cell([x, v]: [f64; 2], across: [f64; 2], up: [f64; 2]) -> usize {
    part(v, up, CELLS[1]) * CELLS[0] + part(x, across, CELLS[0])
}

/// RMS of the residual cell by cell, row by row from below; none where the joint never was.
pub(super) struct Cells {
    pub(super) rms: Vec<Option<f64>>,
    pub(super) most: f64,
}

impl Cells {
    pub(super) fn of(points: &[[f64; 3]], horizontal: (f64, f64), vertical: (f64, f64)) -> Self {
        let mut sums = vec![(0.0, 0_usize); CELLS[0] * CELLS[1]];
        for [x, v, e] in points {
            let place = cell([*x, *v], horizontal.into(), vertical.into());
            sums[place].0 += e * e;
            sums[place].1 += 1;
        }
        let rms = |&(sum, count): &(f64, usize)| (sum / count as f64).sqrt();
        let most = |least: usize| {
            let full = sums.iter().filter(|(_, count)| *count >= least);
            full.map(rms).fold(0.0, f64::max)
        };
        let seen = most(ROWS_FOR_SCALE);
        Self {
            most: if seen > 0.0 { seen } else { most(1) },
            rms: sums.iter().map(|s| (s.1 > 0).then(|| rms(s))).collect(),
        }
    }

    pub(super) fn boxes(
        &self,
        horizontal: (f64, f64),
        vertical: (f64, f64),
    ) -> impl Iterator<Item = Rectangle<(f64, f64)>> {
        let [columns, rows] = CELLS;
        let at = |(low, high): (f64, f64), index: usize, count: usize| {
            low + (high - low) * index as f64 / count as f64
        };
        let seen = self.rms.iter().enumerate();
        seen.filter_map(move |(place, rms)| {
            let (row, column) = (place / columns, place % columns);
            let corner = |right: usize, up: usize| {
                (
                    at(horizontal, column + right, columns),
                    at(vertical, row + up, rows),
                )
            };
            let shade = style::heat(share((*rms)?, self.most));
            Some(Rectangle::new([corner(0, 0), corner(1, 1)], shade.filled()))
        })
    }
}

/// Of the largest, as a part of it; 0 where there is none.
pub(super) fn share(value: f64, most: f64) -> f64 {
    if most > 0.0 { value / most } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shades_follow_the_residual() {
        let points: Vec<[f64; 3]> = (0..1000)
            .map(|i| [f64::from(i % 10), f64::from(i / 100), f64::from(i % 10)])
            .collect();
        let cells = Cells::of(&points, (0.0, 9.0), (0.0, 9.0));
        assert!((cells.most - 9.0).abs() < 1e-12);
        assert_eq!(cells.rms.iter().flatten().count(), 100);
        let luminance = |share| {
            let RGBColor(r, g, b) = style::heat(share);
            0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b)
        };
        let shades: Vec<f64> = (0..=20).map(|i| luminance(f64::from(i) / 20.0)).collect();
        assert!(shades.is_sorted_by(|a, b| a > b), "{shades:?}");
    }
}
