//! The training records of an axis cut into blocks of equal force energy, and dealt into folds to
//! be judged.
//!
//! A burst counts as one block, however much of the force's power it holds. Beside blocks in turn,
//! every record and the blocks with the largest force are left out: these folds extrapolate, and
//! tell physics from a flexible law that imitates it.

use crate::diagnose::criteria;
use crate::study::series::{about_mean, mean, mean_square};
use std::ops::Range;

/// How many parts the blocks are dealt into; each is judged with values found on the others.
const TURNS: usize = 6;
/// Fewer rows than this make no block.
const MIN_ROWS: usize = 8;
/// Of a record's mean power, this part is added to every row's, so that rest has blocks too.
const REST: f64 = 0.1;
/// The largest force has to stand out by this factor from the blocks' median to be left out by
/// itself.
const STANDS_OUT: f64 = 1.15;
/// A record that holds less than this part of the energy is not left out by itself.
const MIN_RECORD: f64 = 0.05;

/// Blocks and folds of one axis.
pub(crate) struct Blocks {
    /// Rows of each, in order, within the axis.
    pub(crate) rows: Vec<Range<usize>>,
    /// Blocks that are judged together, learnt from the others. The first [`Blocks::turns`] deal
    /// every block once.
    pub(crate) folds: Vec<Vec<usize>>,
    /// How many folds deal blocks in turn.
    pub(crate) turns: usize,
}

impl Blocks {
    /// Cuts the force of an axis; `records` are the rows of each record.
    pub(crate) fn new(force: &[f64], records: &[usize]) -> Self {
        let power: Vec<f64> = powers(force, records);
        let whole: f64 = power.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let mut rows: Vec<Range<usize>> = Vec::new();
        let mut of_record: Vec<Vec<usize>> = Vec::new();
        let mut energies = Vec::new();
        let mut start = 0;
        for &count in records {
            let part = &power[start..start + count];
            let energy: f64 = part.iter().sum();
            energies.push(energy / whole);
            let wanted = (criteria::BLOCKS as f64 * energy / whole).round() as usize;
            let wanted = wanted.clamp(1, (count / MIN_ROWS).max(1));
            let first = rows.len();
            let (mut sum, mut from) = (0.0, 0);
            for (row, value) in part.iter().enumerate() {
                sum += value;
                let made = rows.len() - first;
                let full = sum * wanted as f64 >= energy * (made + 1) as f64;
                if full && made + 1 < wanted && row + 1 - from >= MIN_ROWS {
                    rows.push(start + from..start + row + 1);
                    from = row + 1;
                }
            }
            if count > from {
                rows.push(start + from..start + count);
            }
            of_record.push((first..rows.len()).collect());
            start += count;
        }
        let turns = TURNS.min(rows.len()).max(1);
        let mut folds: Vec<Vec<usize>> = (0..turns)
            .map(|turn| (turn..rows.len()).step_by(turns).collect())
            .collect();
        if records.len() > 1 {
            let records = of_record.into_iter().zip(&energies);
            let large = records.filter(|(_, energy)| **energy >= MIN_RECORD);
            folds.extend(large.map(|(blocks, _)| blocks));
        }
        folds.extend(largest(force, &rows));
        Self { rows, folds, turns }
    }

    /// How many blocks are judged in turn; they are judged first.
    pub(crate) fn dealt(&self) -> usize {
        self.folds[..self.turns].iter().map(Vec::len).sum()
    }
}

/// The fifth of the blocks with the largest force, where it stands out.
fn largest(force: &[f64], rows: &[Range<usize>]) -> Option<Vec<usize>> {
    let size = |block: &Range<usize>| mean_square(&about_mean(&force[block.clone()]));
    let mut sizes: Vec<(f64, usize)> = rows.iter().map(size).zip(0..).collect();
    sizes.sort_by(|a, b| b.0.total_cmp(&a.0));
    let median = sizes.get(sizes.len() / 2)?.0.sqrt();
    let stands_out = sizes.first()?.0.sqrt() > STANDS_OUT * median;
    let count = (rows.len() / 5).max(2);
    (stands_out && rows.len() > 3 * count)
        .then(|| sizes.iter().take(count).map(|&(_, block)| block).collect())
}

/// The power of every row about its record's mean.
fn powers(force: &[f64], records: &[usize]) -> Vec<f64> {
    let mut powers = Vec::with_capacity(force.len());
    let mut start = 0;
    for &count in records {
        let part = &force[start..start + count];
        let mean = mean(part);
        let own: Vec<f64> = part.iter().map(|f| (f - mean).powi(2)).collect();
        let rest = REST * own.iter().sum::<f64>() / count.max(1) as f64;
        powers.extend(own.iter().map(|p| p + rest));
        start += count;
    }
    powers
}

#[cfg(test)]
mod tests {
    use super::Blocks;

    #[test]
    fn a_burst_is_cut_into_blocks_of_equal_energy_and_every_row_is_in_one() {
        let force: Vec<f64> = (0..6000)
            .map(|row| {
                let size = if (2000..2400).contains(&row) {
                    10.0
                } else {
                    0.5
                };
                size * (0.2 * f64::from(row)).sin()
            })
            .collect();
        let blocks = Blocks::new(&force, &[3000, 3000]);
        let mut next = 0;
        for rows in &blocks.rows {
            assert_eq!(rows.start, next);
            next = rows.end;
        }
        assert_eq!(next, 6000);
        let in_burst = blocks
            .rows
            .iter()
            .filter(|r| r.start >= 1990 && r.end <= 2410);
        assert!(in_burst.count() > 10, "{:?}", blocks.rows);
        let dealt: usize = blocks.folds[..blocks.turns].iter().map(Vec::len).sum();
        assert_eq!(dealt, blocks.rows.len());
        // The second record holds next to nothing of the energy, so only the first is left out by
        // itself.
        assert!(blocks.folds.len() > blocks.turns);
    }

    #[test]
    fn half_a_second_still_makes_blocks() {
        let force: Vec<f64> = (0..150).map(|row| (0.3 * f64::from(row)).sin()).collect();
        let blocks = Blocks::new(&force, &[150]);
        assert!(blocks.rows.len() >= 5, "{:?}", blocks.rows);
        assert!(blocks.rows.iter().all(|rows| rows.len() >= 8));
    }
}
