//! A joint that changes by a part of its force, driven in several ways, and how soon the monitor
//! says so.

use super::watched::{STUDY_LEVEL, Shaking, Subject};
use jointwatch_shared::monitor::{MonitorState, State, Verdict};
use rayon::prelude::*;

/// When the joint changes, s into its record.
const CHANGES_AT_S: f64 = 5.0;
/// Kinds of change per axis.
const CHANGES: usize = 5;

/// One change under one drive.
#[derive(Clone, Debug)]
pub struct Watched {
    /// The change and the axis it is of.
    pub what: String,
    /// The axis of the change, from 0.
    pub axis: usize,
    /// How the joint was driven.
    pub drive: &'static str,
    /// Every change of the verdict, with the time since the joint changed in s.
    pub seen: Vec<(f64, Verdict)>,
}

impl Watched {
    /// The first alarm, as time since the change in s and verdict.
    pub fn alarm(&self) -> Option<(f64, Verdict)> {
        let mut seen = self.seen.iter().copied();
        seen.find(|(_, v)| v.state == State::Alarm)
    }

    /// Whether that alarm came after the change, in time, and is about damage of the axis that
    /// changed.
    pub fn is_found_within(&self, within_s: f64) -> bool {
        self.alarm().is_some_and(|(time, verdict)| {
            (0.0..=within_s).contains(&time)
                && verdict.cause.is_damage()
                && usize::from(verdict.axis) == self.axis
        })
    }

    /// For a person to read.
    pub fn told(&self) -> String {
        let outcome = match self.alarm() {
            Some((time, verdict)) => format!("{time:.2} s, {}", verdict.words(&["x", "phi"])),
            None => format!("no alarm; {}", story(&self.seen)),
        };
        format!("{}, {}: {outcome}", self.what, self.drive)
    }
}

/// Verdicts one after the other, for a person to read.
pub fn story(seen: &[(f64, Verdict)]) -> String {
    let told = |(time, v): &(f64, Verdict)| {
        format!(
            "{time:.2} s {}: {}",
            v.state.words(),
            v.words(&["x", "phi"])
        )
    };
    seen.iter().map(told).collect::<Vec<_>>().join("; ")
}

/// The drives of a joint that changes: as in the study, harder, both rising, and the other axis
/// undriven. One axis has to move to be judged.
fn drives(seconds: f64, axis: usize, seed: u64) -> [(&'static str, Shaking); 4] {
    let mut alone = Shaking::steady(seconds, 0.95, seed + 3);
    alone.levels[1 - axis] = [0.0; 2];
    let mut rising = Shaking::steady(seconds, 1.0, seed + 2);
    rising.levels = [[0.75, 1.0]; 2];
    [
        (
            "driven as in the study",
            Shaking::steady(seconds, STUDY_LEVEL, seed),
        ),
        ("driven harder", Shaking::steady(seconds, 1.0, seed + 1)),
        ("drive rising", rising),
        ("other axis undriven", alone),
    ]
}

/// Every change of a joint by `part` of the RMS force under every drive, watched for `within_s`
/// after the change.
pub fn detect(subject: &Subject, part: f64, within_s: f64, seed: u64) -> Vec<Watched> {
    let changes = subject.changes(part);
    let runs: Vec<_> = changes
        .into_iter()
        .enumerate()
        .flat_map(|(number, (what, worn))| {
            let axis = number / CHANGES;
            let seed = 10_000 * seed + 10 * number as u64;
            drives(CHANGES_AT_S + within_s, axis, seed)
                .map(|(drive, shaking)| (what.clone(), worn, axis, drive, shaking))
        })
        .collect();
    runs.into_par_iter()
        .map(|(what, worn, axis, drive, shaking)| {
            let record = subject.shake(shaking, Some((CHANGES_AT_S, worn)));
            let mut seen = subject.watch(&mut MonitorState::default(), &record, |_| ());
            for (time, _) in &mut seen {
                *time -= CHANGES_AT_S;
            }
            Watched {
                what,
                axis,
                drive,
                seen,
            }
        })
        .collect()
}
