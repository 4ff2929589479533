//! An overview of long channels: the smallest and the largest value of every bin of rows, so that
//! no peak is lost.

use std::ops::Range;

/// As many bins are kept at most.
const BINS: usize = 1 << 17;

/// The extremes of some channels, bin by bin.
#[derive(Clone, Debug, PartialEq)]
pub struct Overview {
    /// Rows of all channels.
    rows: usize,
    /// Rows of a bin.
    bin: usize,
    /// Rows that were absorbed.
    read: usize,
    /// Per channel and bin the smallest and the largest value; the largest is below the smallest
    /// where there is none.
    extremes: Vec<Vec<[f64; 2]>>,
}

/// The extremes of a bin without a value.
const NONE: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

fn united(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// Smallest and largest value, not-a-number left out.
fn extremes(values: &[f64]) -> [f64; 2] {
    // Comparisons and not min and max: the compiler makes vector code of them.
    values.iter().fold(NONE, |[low, high], v| {
        [
            if *v < low { *v } else { low },
            if *v > high { *v } else { high },
        ]
    })
}

impl Overview {
    /// Of so many channels of so many rows, of which none was read yet.
    pub fn new(channels: usize, rows: usize) -> Self {
        let bin = rows.div_ceil(BINS).max(1).next_power_of_two();
        Self {
            rows,
            bin,
            read: 0,
            extremes: vec![vec![NONE; rows.div_ceil(bin)]; channels],
        }
    }

    /// How many rows were read.
    pub fn read(&self) -> usize {
        self.read
    }

    /// Rows of a bin.
    pub fn bin(&self) -> usize {
        self.bin
    }

    /// The extremes of a stretch of rows that begins at `start`, bin by bin, per channel; apart
    /// from `absorb` so that several threads can do it.
    pub fn condensed(&self, start: usize, channels: &[Vec<f64>]) -> Vec<Vec<[f64; 2]>> {
        let of_one = |values: &Vec<f64>| {
            let head = (self.bin - start % self.bin) % self.bin;
            let (head, rest) = values.split_at(head.min(values.len()));
            let head = (!head.is_empty()).then(|| extremes(head));
            head.into_iter()
                .chain(rest.chunks(self.bin).map(extremes))
                .collect()
        };
        channels.iter().map(of_one).collect()
    }

    /// Takes in what [`Overview::condensed`] made of so many rows from `start`.
    pub fn absorb(&mut self, start: usize, rows: usize, condensed: &[Vec<[f64; 2]>]) {
        for (mine, new) in self.extremes.iter_mut().zip(condensed) {
            for (bin, new) in mine.iter_mut().skip(start / self.bin).zip(new) {
                *bin = united(*bin, *new);
            }
        }
        self.read += rows;
    }

    /// Per channel the extremes of `points` parts of some rows; a part has whole bins.
    pub fn thinned(&self, rows: Range<usize>, points: usize) -> Vec<Vec<[f64; 2]>> {
        let first = rows.start.min(self.rows) / self.bin;
        let last = rows.end.min(self.rows).div_ceil(self.bin).max(first);
        let parts = points.clamp(1, (last - first).max(1));
        let edge = |part: usize| first + part * (last - first) / parts;
        let of_one = |channel: &Vec<[f64; 2]>| {
            let part = |part| {
                let bins = channel[edge(part)..edge(part + 1)].iter();
                bins.fold(NONE, |all, bin| united(all, *bin))
            };
            (0..parts).map(part).collect()
        };
        self.extremes.iter().map(of_one).collect()
    }

    /// The same of rows that were read themselves.
    pub fn of_rows(channels: &[Vec<f64>], points: usize) -> Vec<Vec<[f64; 2]>> {
        let rows = channels.first().map_or(0, Vec::len);
        let parts = points.clamp(1, rows.max(1));
        let part = |values: &[f64], part| {
            extremes(&values[part * rows / parts..(part + 1) * rows / parts])
        };
        let of_one = |values: &Vec<f64>| (0..parts).map(|p| part(values, p)).collect();
        channels.iter().map(of_one).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(rows: usize) -> Vec<f64> {
        (0..rows).map(|i| (0.001 * i as f64).sin()).collect()
    }

    /// Absorbs in stretches of these lengths, out of order.
    fn absorbed(values: &[f64], lengths: &[usize]) -> Overview {
        let mut overview = Overview::new(1, values.len());
        let mut stretches = Vec::new();
        let mut start = 0;
        for length in lengths.iter().cycle() {
            let end = values.len().min(start + length);
            stretches.push(start..end);
            start = end;
            if end == values.len() {
                break;
            }
        }
        for rows in stretches.into_iter().rev() {
            let condensed = overview.condensed(rows.start, &[values[rows.clone()].to_vec()]);
            overview.absorb(rows.start, rows.len(), &condensed);
        }
        overview
    }

    #[test]
    fn any_cut_of_the_rows_gives_the_same_overview_with_every_peak() {
        let mut values = wave(300_000);
        values[123_457] = 9.0;
        values[123_459] = -8.0;
        values[77] = f64::NAN;
        let whole = absorbed(&values, &[300_000]);
        for lengths in [&[1_000, 1, 77_777][..], &[4096], &[3]] {
            assert_eq!(absorbed(&values, lengths), whole, "{lengths:?}");
        }
        assert_eq!(whole.read(), 300_000);
        assert!(whole.bin() > 1 && whole.extremes[0].len() <= BINS);
        let drawn = &whole.thinned(0..300_000, 700)[0];
        assert_eq!(drawn.len(), 700);
        let at = 700 * 123_457 / 300_000;
        assert_eq!(drawn[at], [-8.0, 9.0]);
        assert!(drawn[at + 2][1] <= 1.0);
    }

    #[test]
    fn what_was_not_read_has_no_value() {
        let mut overview = Overview::new(1, 1_000);
        let condensed = overview.condensed(500, &[vec![2.0; 100]]);
        overview.absorb(500, 100, &condensed);
        let drawn = &overview.thinned(0..1_000, 10)[0];
        assert!(drawn[0][0] > drawn[0][1]);
        assert_eq!(drawn[5], [2.0, 2.0]);
        assert!(overview.thinned(2_000..3_000, 10)[0].len() == 1);
    }

    #[test]
    fn rows_that_were_read_are_drawn_one_by_one_where_there_are_few() {
        let drawn = Overview::of_rows(&[vec![1.0, 5.0, -2.0]], 600);
        assert_eq!(drawn[0], [[1.0, 1.0], [5.0, 5.0], [-2.0, -2.0]]);
    }
}
