//! Choosing the number of neurons: leave out one record at a time, train on the others, and see how
//! well it is foretold.
//!
//! The paper finds its forty neurons by trial and error (Section 3.2.2). Rows of a record are far
//! from independent, so whole records are left out; a study with one training record leaves out a
//! third of it at a time, with a guard on either side. A network of whatever size knows nothing of
//! motions that the other records do not hold, so a left-out row counts only where another record
//! has been: within its range in every state, and in a cell of state space that was visited. Errors
//! are averaged by their logarithms, so that one bad record does not outweigh the rest.

use super::options::{NetworkOptions, parameters};
use super::outcome::{LeftOut, NetworkProgress, SizeCurve, SizeError, TrainingObserver};
use super::restarts;
use super::rows::{Piece, Rows};
use crate::fit::errors::{AT_REST_BELOW, Sums};
use crate::model::InputRange;
use crate::study::series::extent;
use crate::text::error::{Error, Result};
use rayon::prelude::*;

/// The sizes that are tried.
const SIZES: [usize; 4] = [5, 10, 20, 40];

/// Stretches that the only record is cut into.
const STRETCHES: usize = 3;

/// A smaller network is taken when its error is at most this many times the smallest.
const AS_GOOD: f64 = 1.1;

/// Restarts per size and fold at most; the better one counts.
const RESTARTS: usize = 2;

/// Cells along each of two states, and of three or four; odd numbers, so that rest lies in the
/// middle of one.
const CELLS: [usize; 2] = [21, 7];

/// Fewer rows than this in visited cells say nothing about a record.
const MIN_ROWS: usize = 100;

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
    watch: &TrainingObserver<'_>,
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
    let errors = left_out_errors(&folds, &sizes, ranges, options, watch)?;
    let axes = ranges[1].len();
    if (0..axes).any(|axis| errors.iter().all(|e| e[axis].is_none())) {
        return Err(Error::data(
            "no training record moves where the others have been, so leaving one out says nothing about the number of neurons: give --neurons",
        ));
    }
    let sizes = size_errors(&errors, folds.len(), &sizes, axes);
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

/// NMSE of every size on every left-out piece, size by size, per output; none where no other piece
/// has been.
fn left_out_errors(
    folds: &[Fold<'_>],
    sizes: &[usize],
    ranges: [&[InputRange]; 2],
    options: &NetworkOptions,
    watch: &TrainingObserver<'_>,
) -> Result<Vec<Vec<Option<f64>>>> {
    let weights = |neurons| parameters(ranges[0].len(), neurons, ranges[1].len());
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
            let watch = TrainingObserver {
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
            Ok(held_out_errors(fold, &predicted, ranges))
        })
        .collect::<Result<Vec<_>>>()?
        .into_iter()
        .rev()
        .collect();
    Ok(errors)
}

/// The error of every size, over all left-out pieces together.
fn size_errors(
    errors: &[Vec<Option<f64>>],
    folds: usize,
    sizes: &[usize],
    axes: usize,
) -> Vec<SizeError> {
    errors
        .chunks_exact(folds)
        .zip(sizes)
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
        .collect()
}

/// The cell of state space that a row lies in; there are `per_state` along each.
fn cell(states: &[&[f64]], row: usize, ranges: &[InputRange], per_state: usize) -> usize {
    ranges.iter().zip(states).fold(0, |cell, (range, series)| {
        let place = 0.5 * (range.normalise(series[row]) + 1.0) * per_state as f64;
        cell * per_state + (place.max(0.0) as usize).min(per_state - 1)
    })
}

/// The least and the largest value of every state.
fn extents(piece: &Piece<'_>) -> Vec<[f64; 2]> {
    let states = piece.states.iter();
    states.map(|s| extent(s.iter().copied())).collect()
}

/// The rows of the record left out that lie where another has been.
fn visited_rows(fold: &Fold<'_>, ranges: &[InputRange]) -> Vec<usize> {
    let per_state = CELLS[usize::from(ranges.len() > 2)];
    let mut visited = vec![false; per_state.pow(ranges.len() as u32)];
    for piece in &fold.training {
        for row in 0..piece.rows() {
            visited[cell(&piece.states, row, ranges, per_state)] = true;
        }
    }
    let extents: Vec<Vec<[f64; 2]>> = fold.training.iter().map(extents).collect();
    let states = &fold.held_out.states;
    let within = |row: usize, extent: &[[f64; 2]]| {
        let mut states = states.iter().zip(extent);
        states.all(|(series, [low, high])| (*low..=*high).contains(&series[row]))
    };
    (0..fold.held_out.rows())
        .filter(|&row| extents.iter().any(|extent| within(row, extent)))
        .filter(|&row| visited[cell(states, row, ranges, per_state)])
        .collect()
}

/// NMSE per axis in percent over visited rows; none for an axis that rests there, whose small force
/// says nothing, and none at all when there are too few.
fn held_out_errors(
    fold: &Fold<'_>,
    predicted: &[Vec<f64>],
    [inputs, outputs]: [&[InputRange]; 2],
) -> Vec<Option<f64>> {
    let rows = visited_rows(fold, inputs);
    let axes = fold.held_out.forces.iter().zip(predicted).zip(outputs);
    axes.map(|((force, predicted), range)| {
        let error: Vec<f64> = rows
            .iter()
            .map(|&row| force[row] - predicted[row])
            .collect();
        let force: Vec<f64> = rows.iter().map(|&row| force[row]).collect();
        let sums = Sums::of(&error, &force);
        let at_rest = sums.rms_force() < AT_REST_BELOW * range.half_range;
        (rows.len() >= MIN_ROWS && !at_rest).then(|| sums.nmse_percent())
    })
    .collect()
}

/// The mean of the logarithms of at least one value, as a number again.
fn geometric_mean(values: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for value in values {
        sum += value.max(f64::MIN_POSITIVE).ln();
        count += 1;
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
