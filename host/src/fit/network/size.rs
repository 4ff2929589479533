//! Choosing the number of neurons: leave out one record at a time, train on the others, and see how well it is foretold.
//!
//! The paper finds its forty neurons by trial and error (Section 3.2.2). Rows of a record are far from independent, so
//! whole records are left out; a study with one training record leaves out a third of it at a time, with a guard on
//! either side. Errors are averaged by their logarithms: a record that the others say little about must not
//! outweigh the rest.

use super::outcome::{LeftOut, NetworkProgress, SizeCurve, SizeError, Watch};
use super::restarts;
use super::rows::{Piece, Rows};
use super::{NetworkOptions, parameters};
use crate::compare::{RESTS_BELOW, Sums};
use crate::error::{Error, Result};
use crate::model::InputRange;
use rayon::prelude::*;

/// The sizes that are tried.
const SIZES: [usize; 4] = [5, 10, 20, 40];

/// Stretches that the only record is cut into.
const STRETCHES: usize = 3;

/// A smaller network is taken when its error is at most this many times the smallest.
const AS_GOOD: f64 = 1.1;

/// Restarts per size and fold at most; the better one counts.
const RESTARTS: usize = 2;

/// What is trained on and what is held out.
struct Fold<'a> {
    training: Vec<Piece<'a>>,
    held_out: Piece<'a>,
}

fn folds<'a>(records: &[Piece<'a>], guard: usize) -> (Vec<Fold<'a>>, LeftOut) {
    if let [record] = records {
        let rows = record.rows();
        let folds = (0..STRETCHES).map(|stretch| {
            let (start, end) = (stretch * rows / STRETCHES, (stretch + 1) * rows / STRETCHES);
            let before = record.part(0, start.saturating_sub(guard));
            let behind = record.part((end + guard).min(rows), rows);
            Fold {
                training: [before, behind]
                    .into_iter()
                    .filter(|piece| piece.rows() > 0)
                    .collect(),
                held_out: record.part(start, end),
            }
        });
        return (folds.collect(), LeftOut::Stretches);
    }
    let folds = (0..records.len()).map(|out| Fold {
        training: records
            .iter()
            .enumerate()
            .filter(|(index, _)| *index != out)
            .map(|(_, record)| record.clone())
            .collect(),
        held_out: records[out].clone(),
    });
    (folds.collect(), LeftOut::Records)
}

/// The number of neurons, and the errors of all that were tried. `ranges`: of inputs and outputs.
///
/// # Errors
/// When not even the smallest size has enough rows, or a training fails; both in one sentence.
pub(super) fn choose(
    records: &[Piece<'_>],
    ranges: [&[InputRange]; 2],
    guard: usize,
    options: &NetworkOptions,
    watch: &Watch<'_>,
) -> Result<(usize, SizeCurve)> {
    let (folds, left_out) = folds(records, guard);
    let rows_of = |fold: &Fold<'_>| fold.training.iter().map(Piece::rows).sum::<usize>();
    let least = folds.iter().map(rows_of).min().unwrap_or(0);
    let weights = |neurons| parameters(ranges[0].len(), neurons, ranges[1].len());
    let sizes: Vec<usize> = SIZES
        .into_iter()
        .filter(|neurons| weights(*neurons) <= least)
        .collect();
    if sizes.is_empty() {
        return Err(Error::data(format!(
            "{least} training rows are left when one {} is left out, too few for the {} weights of {} neurons: record longer, or \
             give --neurons",
            match left_out {
                LeftOut::Records => "record",
                LeftOut::Stretches => "third of the only record",
            },
            weights(SIZES[0]),
            SIZES[0]
        )));
    }
    let runs: Vec<(usize, usize)> = (0..sizes.len())
        .flat_map(|size| (0..folds.len()).map(move |fold| (size, fold)))
        .collect();
    let restarts = options.restarts.min(RESTARTS);
    let errors: Vec<Vec<Option<f64>>> = runs
        .par_iter()
        .enumerate()
        // The largest first, so that no core is left waiting for it.
        .rev()
        .map(|(index, &(size, fold))| {
            let neurons = sizes[size];
            let fold = &folds[fold];
            let rows = Rows::new(&fold.training, ranges[0], ranges[1], 2 * weights(neurons));
            let tell = |progress: &NetworkProgress| {
                (watch.progress)(&NetworkProgress {
                    choosing_size: true,
                    training: index * restarts + progress.training,
                    trainings: runs.len() * restarts,
                    ..*progress
                });
            };
            let watch = Watch {
                progress: &tell,
                stop: watch.stop,
            };
            let (seed, limits) = (options.seed, options.limits());
            let trained = restarts::run(&rows, ranges, neurons, restarts, seed, limits, &watch)?;
            if trained.interrupted {
                return Err(Error::failed(
                    "training was interrupted while the number of neurons was being chosen, so there are no weights to keep; give --neurons",
                ));
            }
            let predicted = trained.done[trained.best]
                .network
                .predict(&fold.held_out.states)?;
            Ok(held_out_errors(&fold.held_out, &predicted, ranges[1]))
        })
        .collect::<Result<Vec<_>>>()?
        .into_iter()
        .rev()
        .collect();
    let axes = ranges[1].len();
    let sizes: Vec<SizeError> = errors
        .chunks_exact(folds.len())
        .zip(&sizes)
        .map(|(errors, &neurons)| {
            let held_out_nmse_percent: Vec<f64> = (0..axes)
                .map(|axis| geometric_mean(errors.iter().filter_map(|e| e[axis])))
                .collect();
            SizeError {
                neurons,
                mean_nmse_percent: geometric_mean(held_out_nmse_percent.iter().copied()),
                held_out_nmse_percent,
            }
        })
        .collect();
    let best = sizes
        .iter()
        .map(|s| s.mean_nmse_percent)
        .fold(f64::INFINITY, f64::min);
    let neurons = sizes
        .iter()
        .find(|s| s.mean_nmse_percent <= AS_GOOD * best)
        .map_or(SIZES[0], |s| s.neurons);
    Ok((neurons, SizeCurve { sizes, left_out }))
}

/// NMSE per axis in percent; none for an axis that rests in the record, whose small force says nothing.
fn held_out_errors(
    record: &Piece<'_>,
    predicted: &[Vec<f64>],
    ranges: &[InputRange],
) -> Vec<Option<f64>> {
    let axes = record.forces.iter().zip(predicted).zip(ranges);
    axes.map(|((force, predicted), range)| {
        let error: Vec<f64> = force.iter().zip(predicted).map(|(r, p)| r - p).collect();
        let sums = Sums::of(&error, force);
        (sums.rms_force() >= RESTS_BELOW * range.half_range).then(|| sums.nmse_percent())
    })
    .collect()
}

/// The mean of the logarithms, as a number again; nothing at all counts as no error.
fn geometric_mean(values: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for value in values {
        sum += value.max(f64::MIN_POSITIVE).ln();
        count += 1;
    }
    if count == 0 {
        return 0.0;
    }
    (sum / f64::from(count)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_only_record_is_left_out_by_thirds_with_a_guard() {
        let series: Vec<f64> = (0..900).map(f64::from).collect();
        let record = Piece {
            states: vec![&series],
            forces: vec![&series],
        };
        let (folds_of_one, left_out) = folds(std::slice::from_ref(&record), 20);
        assert_eq!(left_out, LeftOut::Stretches);
        let rows = |pieces: &[Piece<'_>]| -> Vec<f64> {
            pieces.iter().flat_map(|p| p.forces[0].to_vec()).collect()
        };
        let middle = rows(&folds_of_one[1].training);
        assert_eq!(
            (middle.len(), middle[279], middle[280]),
            (560, 279.0, 620.0)
        );
        assert_eq!(folds_of_one[1].held_out.forces[0], &series[300..600]);
        let first = rows(&folds_of_one[0].training);
        assert_eq!((first.len(), first[0]), (580, 320.0));
        let (folds_of_two, left_out) = folds(&[record.clone(), record.part(0, 100)], 20);
        assert_eq!(left_out, LeftOut::Records);
        assert_eq!(rows(&folds_of_two[0].training).len(), 100);
        assert_eq!(folds_of_two[0].held_out.rows(), 900);
    }
}
