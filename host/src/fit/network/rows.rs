//! The training rows as the network sees them: normalised, and in such an order that the first few
//! stand for all.

use crate::model::InputRange;

/// A record, or a stretch of one: states and restoring force as series, SI.
#[derive(Clone, Debug)]
pub(super) struct Piece<'a> {
    /// One series per input.
    pub(super) states: Vec<&'a [f64]>,
    /// One series per axis.
    pub(super) forces: Vec<&'a [f64]>,
}

impl<'a> Piece<'a> {
    pub(super) fn rows(&self) -> usize {
        self.forces.first().map_or(0, |series| series.len())
    }

    /// The rows from `start` to before `end`.
    pub(super) fn part(&self, start: usize, end: usize) -> Self {
        let cut =
            |series: &Vec<&'a [f64]>| series.iter().map(|s| &s[start..end.max(start)]).collect();
        Self {
            states: cut(&self.states),
            forces: cut(&self.forces),
        }
    }
}

/// Normalised inputs and outputs, row after row, ordered for training in stages.
///
/// The first [`Rows::stage`]`(0)` rows are every 2^(s−1)-th of all records together, so they are
/// spread over each; every further stage adds the rows half-way between, which doubles them.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    /// Numbers of each row in `x`.
    pub(super) inputs: usize,
    /// Numbers of each row in `y`.
    pub(super) outputs: usize,
    /// Row after row, every input.
    pub(super) x: Vec<f64>,
    /// Row after row, every output.
    pub(super) y: Vec<f64>,
    /// Rows of each stage; the last has all of them.
    ends: Vec<usize>,
}

/// The stages there are at most.
const MAX_STAGES: usize = 6;

impl Rows {
    /// Of records in SI, normalised with the given ranges; no stage has fewer than `least_rows`
    /// rows unless there are fewer in all.
    pub(super) fn new(
        records: &[Piece<'_>],
        inputs: &[InputRange],
        outputs: &[InputRange],
        least_rows: usize,
    ) -> Self {
        let places: Vec<(usize, usize)> = records
            .iter()
            .enumerate()
            .flat_map(|(record, piece)| (0..piece.rows()).map(move |row| (record, row)))
            .collect();
        let mut stages = 1;
        while stages < MAX_STAGES && places.len() >> stages >= least_rows {
            stages += 1;
        }
        let mut rows = Self {
            inputs: inputs.len(),
            outputs: outputs.len(),
            x: Vec::with_capacity(places.len() * inputs.len()),
            y: Vec::with_capacity(places.len() * outputs.len()),
            ends: Vec::new(),
        };
        let coarsest = 1 << (stages - 1);
        for stage in 0..stages {
            let (first, step) = match stage {
                0 => (0, coarsest),
                _ => (coarsest >> stage, coarsest >> (stage - 1)),
            };
            for &(record, row) in places.iter().skip(first).step_by(step) {
                let x = inputs.iter().zip(&records[record].states);
                rows.x.extend(x.map(|(range, s)| range.normalise(s[row])));
                let y = outputs.iter().zip(&records[record].forces);
                rows.y.extend(y.map(|(range, s)| range.normalise(s[row])));
            }
            rows.ends.push(rows.y.len() / outputs.len());
        }
        rows
    }

    /// Rows of the last stage, which are all.
    pub(super) fn count(&self) -> usize {
        self.y.len() / self.outputs
    }

    /// How many stages there are.
    pub(super) fn stages(&self) -> usize {
        self.ends.len()
    }

    /// Rows of a stage; they come first.
    pub(super) fn stage(&self, stage: usize) -> usize {
        self.ends[stage]
    }

    /// Σ (y − ȳ)² of every output over the first `count` rows.
    pub(super) fn spread(&self, count: usize) -> Vec<f64> {
        (0..self.outputs)
            .map(|k| {
                let y = || self.y[k..].iter().step_by(self.outputs).take(count);
                let mean = y().sum::<f64>() / count as f64;
                y().map(|y| (y - mean).powi(2)).sum()
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_stage_doubles_the_one_before_and_covers_every_record() {
        let unit = InputRange {
            center: 0.0,
            half_range: 1.0,
        };
        let first: Vec<f64> = (0..700).map(f64::from).collect();
        let second: Vec<f64> = (700..1000).map(f64::from).collect();
        let records = [&first, &second].map(|series| Piece {
            states: vec![series],
            forces: vec![series],
        });
        let rows = Rows::new(&records, &[unit], &[unit], 60);
        assert_eq!(rows.stages(), 5);
        for stage in 0..5 {
            let mut seen = rows.x[..rows.stage(stage)].to_vec();
            seen.sort_by(f64::total_cmp);
            let step = 16 >> stage;
            let expected: Vec<f64> = (0..1000).step_by(step).map(|v| v as f64).collect();
            assert_eq!(seen, expected, "stage {stage}");
        }
        assert_eq!(rows.x, rows.y);
        let few = Rows::new(&records, &[unit], &[unit], 600);
        assert_eq!((few.stages(), few.count()), (1, 1000));
    }
}
