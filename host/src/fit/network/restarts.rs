//! Trainings from several random starts, side by side, one per core; and which of them is kept.

use super::outcome::{GaveUp, NetworkProgress, Restart, Stop, TracePoint, TrainingObserver};
use super::rows::Rows;
use super::stages::{Limits, Snapshot, Training, train};
use crate::model::{InputRange, Network};
use crate::text::error::{Error, Result};
use rayon::prelude::*;
use std::sync::atomic::Ordering;

/// Other seeds that one restart tries when values come up that are not finite.
const TRIES: u64 = 3;

/// How many restarts there can be: the seeds of their further tries begin behind.
pub(super) const MAX_RESTARTS: usize = 1000;

/// What several restarts gave.
pub(super) struct Restarts {
    pub(super) done: Vec<Restart>,
    /// The one with the largest evidence.
    pub(super) best: usize,
    pub(super) begun_anew: usize,
    pub(super) interrupted: bool,
}

/// Trains `count` networks on the same rows, with the ranges that these were normalised with.
///
/// # Errors
/// When values that are not finite came up from every seed, or when the user ended it before there
/// were weights.
pub(super) fn run(
    rows: &Rows,
    ranges: [&[InputRange]; 2],
    neurons: usize,
    count: usize,
    seed: u64,
    limits: Limits,
    watch: &TrainingObserver<'_>,
) -> Result<Restarts> {
    let outcomes: Vec<(u64, Option<Restart>)> = (0..count)
        .into_par_iter()
        .map(|index| {
            let tell = |progress: &NetworkProgress| {
                (watch.progress)(&NetworkProgress {
                    training: index,
                    trainings: count,
                    ..*progress
                });
            };
            let watch = TrainingObserver {
                progress: &tell,
                stop: watch.stop,
            };
            for attempt in 0..TRIES {
                let seed = seed.wrapping_add(index as u64 + attempt * MAX_RESTARTS as u64);
                // Whoever has not begun when the user ends it has no weights worth keeping.
                if watch.stop.load(Ordering::Relaxed) {
                    return (attempt, None);
                }
                if let Ok(training) = train(rows, neurons, seed, limits, &watch) {
                    return (attempt, restart(seed, training, ranges));
                }
            }
            (TRIES, None)
        })
        .collect();
    let begun_anew = outcomes
        .iter()
        .map(|(attempts, _)| *attempts as usize)
        .sum();
    let done: Vec<Restart> = outcomes
        .into_iter()
        .filter_map(|(_, restart)| restart)
        .collect();
    let interrupted = watch.stop.load(Ordering::Relaxed)
        || done
            .iter()
            .any(|r| r.stop == Stop::GaveUp(GaveUp::Interrupted));
    let best = (0..done.len())
        .max_by(|&a, &b| done[a].log_evidence.total_cmp(&done[b].log_evidence))
        .ok_or_else(|| {
            if interrupted {
                Error::failed("training was interrupted before there were weights to keep; nothing was written")
            } else {
                Error::data(format!(
                    "training a network of {neurons} neurons came upon values that are not finite from each of {} random starts: \
                     look for values far outside the rest in the records",
                    count as u64 * TRIES
                ))
            }
        })?;
    Ok(Restarts {
        done,
        best,
        begun_anew,
        interrupted,
    })
}

fn restart(seed: u64, training: Training, ranges: [&[InputRange]; 2]) -> Option<Restart> {
    let point = |snapshot: &Snapshot| TracePoint {
        cpu_s: snapshot.cpu_s,
        rows: snapshot.rows,
        training_nmse_percent: snapshot.errors.iter().map(|e| 100.0 * e).collect(),
        network: network(snapshot, ranges),
    };
    let trace: Vec<TracePoint> = training.trace.iter().map(point).collect();
    let last = trace.last()?.clone();
    Some(Restart {
        seed,
        network: last.network,
        stop: training.stop,
        cpu_s: last.cpu_s,
        effective_parameters: training.effective_parameters,
        alpha: training.alpha,
        beta: training.beta,
        log_evidence: training.log_evidence,
        training_nmse_percent: last.training_nmse_percent,
        trace,
    })
}

/// The network of a training's weights.
fn network(snapshot: &Snapshot, [inputs, outputs]: [&[InputRange]; 2]) -> Network {
    let neurons = snapshot.output.nrows() - 1;
    let hidden = |neuron: usize| {
        (0..inputs.len())
            .map(|input| snapshot.hidden[input * neurons + neuron])
            .collect()
    };
    let column = |k: usize| snapshot.output.col(k).iter().copied();
    Network {
        inputs: inputs.to_vec(),
        outputs: outputs.to_vec(),
        hidden_weights: (0..neurons).map(hidden).collect(),
        hidden_bias: snapshot.hidden[inputs.len() * neurons..].to_vec(),
        output_weights: (0..outputs.len())
            .map(|k| column(k).take(neurons).collect())
            .collect(),
        output_bias: (0..outputs.len())
            .map(|k| snapshot.output[(neurons, k)])
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicBool;

    const UNIT: InputRange = InputRange {
        center: 0.0,
        half_range: 1.0,
    };

    fn attempt(value: f64, stop: bool) -> Error {
        let x: Vec<f64> = (0..400).map(|i| (0.1 * f64::from(i)).sin()).collect();
        let v: Vec<f64> = (0..400).map(|i| (0.1 * f64::from(i)).cos()).collect();
        let mut y = x.clone();
        y[17] = value;
        let piece = super::super::rows::Piece {
            states: vec![&x, &v],
            forces: vec![&y],
        };
        let rows = Rows::new(&[piece], &[UNIT; 2], &[UNIT], 100);
        let watch = TrainingObserver {
            progress: &|_| (),
            stop: &AtomicBool::new(stop),
        };
        let ranges: [&[InputRange]; 2] = [&[UNIT; 2], &[UNIT]];
        let outcome = run(&rows, ranges, 3, 2, 1, Limits::default(), &watch);
        outcome.err().expect("there can be no network")
    }

    #[test]
    fn it_gives_up_with_the_reason() {
        // 1e200 is finite, its square is not.
        for value in [f64::NAN, f64::INFINITY, 1e200] {
            let error = attempt(value, false);
            assert_eq!(error.exit_code(), 3);
            assert!(
                error.sentence.contains("each of 6 random starts"),
                "{error}"
            );
        }
        assert_eq!(attempt(0.0, true).exit_code(), 1);
    }
}
