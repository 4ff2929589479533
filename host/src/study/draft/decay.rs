//! The free decays in a log: from where the body is let go until it is taken up again.

use crate::study::quasi_static::direction_beyond;
use crate::study::series::extent;

/// A swing over less than this part of the log's range is noise, or rest.
const LEAST_SWING: f64 = 0.05;
/// A swing that is larger than the one before by this factor was given by a hand: those of two
/// bodies that swing together grow more slowly.
const GIVEN: f64 = 1.5;
/// Swings of a free decay, at least.
const MIN_SWINGS: usize = 4;
/// A body is let go where it has left this part of its first swing behind: a free one stays there
/// for a tenth of its period.
const LET_GO: f64 = 0.05;
/// A body that stands at the end of its decay keeps there within this part of its range.
const STANDS: f64 = 0.01;
/// The end that shows whether it does, as a part of the decay; a rest that is no longer than twice
/// this stays.
const LAST: usize = 20;
/// The part of a log that its free decays hold, at least: one that grows is none.
const MOST: f64 = 0.5;

/// First rows and the rows after the last of the free decays of a log, by the position of a body
/// that swings; the whole log where it is no such log.
pub(super) fn free_decays(position: &[f64]) -> Vec<[usize; 2]> {
    let turns = turning_points(position);
    let swing = |end: usize| (position[turns[end]] - position[turns[end - 1]]).abs();
    // A log may begin in the middle of a swing, which is then no longer than the next.
    let begins_free = matches!(turns[..], [_, b, c, ..] if 4 * b <= 5 * (c - b));
    let compared = if begins_free { 3 } else { 2 };
    let given = (compared..turns.len()).filter(|&end| swing(end) > GIVEN * swing(end - 1));
    // The turns that a hand's swings go from.
    let taken_up: Vec<usize> = given.map(|end| end - 1).collect();
    let from = std::iter::once(0).chain(taken_up.iter().copied());
    let to = taken_up.iter().map(|&turn| (turn, turns[turn]));
    let to = to.chain([(turns.len().saturating_sub(1), position.len())]);
    let decays: Vec<[usize; 2]> = from
        .zip(to)
        .filter_map(|(from, (to, end))| {
            let turns = turns.get(from..=to)?;
            decay(position, turns, end, from == 0 && begins_free)
        })
        .collect();
    let rows: usize = decays.iter().map(|[from, to]| to - from).sum();
    let decays = match rows as f64 > MOST * position.len() as f64 {
        true => decays,
        false => vec![[0, position.len()]],
    };
    let until_rest = |[from, to]: [usize; 2]| [from, from + moving(&position[from..to])];
    decays.into_iter().map(until_rest).collect()
}

/// Rows of a decay until it has come to rest and a little longer; all where it never does, or is at
/// rest for a short while alone.
///
/// A body that dry friction holds says nothing of how it moves, and where it is held is chance.
fn moving(position: &[f64]) -> usize {
    let rows = position.len();
    let last = rows / LAST;
    if last == 0 {
        return rows;
    }
    let [low, high] = extent(position.iter().copied());
    let [least, most] = extent(position[rows - last..].iter().copied());
    let band = most - least;
    let stands = |x: &f64| (least - band..=most + band).contains(x);
    let end = position.iter().rposition(|x| !stands(x)).unwrap_or(rows) + last / 4;
    match band <= STANDS * (high - low) && rows > end + last {
        true => end,
        false => rows,
    }
}

/// From the largest of some swings on, where enough follow; from the beginning of the log where
/// that is free.
fn decay(position: &[f64], turns: &[usize], end: usize, begins_free: bool) -> Option<[usize; 2]> {
    let swing = |pair: &[usize]| (position[pair[1]] - position[pair[0]]).abs();
    let largest = turns.windows(2).map(swing).fold(0.0, f64::max);
    let first = turns.windows(2).position(|pair| swing(pair) == largest)?;
    if turns.len() - first <= MIN_SWINGS {
        return None;
    }
    if begins_free && first <= 1 {
        return Some([0, end]);
    }
    let (top, bottom) = (turns[first], turns[first + 1]);
    let near = |row: &usize| (position[*row] - position[top]).abs() <= LET_GO * largest;
    Some([(top..bottom).rev().find(near)?, end])
}

/// Rows at which the motion begins and turns, without turns that are noise.
fn turning_points(position: &[f64]) -> Vec<usize> {
    let [low, high] = extent(position.iter().copied());
    let direction = direction_beyond(position, LEAST_SWING * (high - low));
    let pairs = direction.windows(2).enumerate();
    let turns = pairs.filter(|(_, pair)| pair[0] != pair[1]);
    turns.map(|(row, _)| row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    const PERIOD: usize = 100;

    /// So many swings of a body that is let go at 1.
    fn let_go(swings: usize) -> impl Iterator<Item = f64> {
        (0..swings * PERIOD / 2).map(|row| {
            let periods = row as f64 / PERIOD as f64;
            (-0.05 * periods).exp() * (TAU * periods).cos()
        })
    }

    /// A hand that moves a body from one place to another within a period.
    fn moved(from: f64, to: f64) -> impl Iterator<Item = f64> {
        (0..PERIOD).map(move |row| from + (to - from) * row as f64 / PERIOD as f64)
    }

    #[test]
    fn a_log_that_begins_when_a_body_is_let_go_is_whole() {
        let position: Vec<f64> = let_go(20).collect();
        assert_eq!(free_decays(&position), [[0, 1000]]);
        let later = position[PERIOD / 3..].to_vec();
        assert_eq!(free_decays(&later), [[0, later.len()]]);
    }

    #[test]
    fn what_a_hand_does_before_and_between_is_left_out() {
        let rest = || std::iter::repeat_n(0.0, 2 * PERIOD);
        let held = || std::iter::repeat_n(1.0, PERIOD);
        let once = || {
            rest()
                .chain(moved(0.0, 1.0))
                .chain(held())
                .chain(let_go(40))
        };
        let position: Vec<f64> = once().chain(once()).collect();
        let [[from, to], [again, end]] = free_decays(&position)[..] else {
            panic!("{:?}", free_decays(&position));
        };
        let (first, second) = (4 * PERIOD, 8 * PERIOD + 20 * PERIOD);
        assert!((first..first + PERIOD / 10).contains(&from), "{from}");
        assert!(
            (first + 19 * PERIOD..=second - 2 * PERIOD).contains(&to),
            "{to}"
        );
        assert!((second..second + PERIOD / 10).contains(&again), "{again}");
        assert_eq!(end, position.len());
    }

    #[test]
    fn what_follows_when_a_body_has_come_to_rest_is_left_out() {
        let position: Vec<f64> = let_go(20).collect();
        // Dry friction ends a swing in finite time, and anywhere.
        let stuck = |rows: usize| -> Vec<f64> {
            let rest = position[position.len() - 7];
            let steps = (0..rows).map(|row| rest + 1e-4 * f64::from(row as u32 % 2));
            position.iter().copied().chain(steps).collect()
        };
        let long = stuck(2000);
        let [[0, end]] = free_decays(&long)[..] else {
            panic!("{:?}", free_decays(&long));
        };
        assert!((1000..1200).contains(&end), "{end}");
        let short = stuck(50);
        assert_eq!(free_decays(&short), [[0, short.len()]]);
    }

    #[test]
    fn a_swing_that_grows_by_itself_is_kept() {
        let grown: Vec<f64> = let_go(40).collect::<Vec<_>>().into_iter().rev().collect();
        assert_eq!(free_decays(&grown), [[0, grown.len()]]);
        let beats = (0..4000).map(|row| {
            let periods = f64::from(row) / PERIOD as f64;
            (TAU * periods).cos() + 0.8 * (1.07 * TAU * periods).cos()
        });
        let beats: Vec<f64> = beats.collect();
        assert_eq!(free_decays(&beats), [[0, beats.len()]]);
    }
}
