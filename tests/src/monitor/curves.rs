//! How soon a gross change of a joint is found, over its size: a force that is less or more in
//! steps, a joint that seizes, before the power comes on and after it, on one axis and on both, at
//! the same motion and at the one that follows.

use super::detection::story;
use super::watched::{Learnt, STUDY_LEVEL, Shaking, Subject, Worn};
use jointwatch::study::{Convention, Record};
use jointwatch_shared::monitor::{Cause, State, Verdict};
use rayon::prelude::*;

/// When the joint changes, s into its record, where it does not before the power comes on.
const CHANGES_AT_S: f64 = 6.0;
/// The steps of the force that is less or more.
pub const PARTS: [f64; 10] = [-1.0, -0.9, -0.7, -0.5, -0.3, 0.3, 0.5, 0.7, 0.9, 1.0];
/// The smallest change that is tried, as a part of the RMS force.
const SMALLEST: f64 = 0.1;
/// How many times the joint's own stiffness and damping a seized one has beside them.
const LOCK: f64 = 20.0;
/// The axes that change.
const AXES: [&[usize]; 3] = [&[0], &[1], &[0, 1]];

/// Within how many seconds of the change, or of power-on, a joint that loses 30 % or more of its
/// force or seizes raises an alarm, as `docs/explanation/monitor.md` says.
pub const fn documented_s(learnt: Learnt) -> f64 {
    match learnt {
        Learnt::Physical => 3.0,
        Learnt::Polynomial => 10.0,
    }
}

/// What becomes of the joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Change {
    /// Its whole force changes by this part, and its motion with it.
    Force(f64),
    /// Its whole force changes by this part at the same motion.
    SameMotion(f64),
    /// Its spring's stiffness changes by this part, and its motion with it.
    Stiffness(f64),
    /// Its damping changes by this part, and its motion with it.
    Damping(f64),
    /// It seizes: a stiffness and a damping beside it hardly let it move.
    Seized,
}

impl Change {
    /// Every change by each of the parts, and the joint that seizes.
    pub fn all() -> impl Iterator<Item = Self> {
        let whole = PARTS
            .iter()
            .flat_map(|&p| [Self::Force(p), Self::SameMotion(p)]);
        let effects = PARTS
            .iter()
            .flat_map(|&p| [Self::Stiffness(p), Self::Damping(p)]);
        whole.chain([Self::Seized]).chain(effects)
    }

    /// By which part something changes; infinite for a joint that seizes.
    fn part(self) -> f64 {
        match self {
            Self::Force(p) | Self::SameMotion(p) | Self::Stiffness(p) | Self::Damping(p) => p,
            Self::Seized => f64::INFINITY,
        }
    }

    /// Whether there is less force than before.
    pub fn is_less(self) -> bool {
        self.part() < 0.0
    }

    /// Whether the whole force of a joint becomes less, or its motion ends.
    pub fn is_loss(self) -> bool {
        match self {
            Self::Force(part) | Self::SameMotion(part) => part < 0.0,
            Self::Stiffness(_) | Self::Damping(_) => false,
            Self::Seized => true,
        }
    }

    /// Whether a cause names its direction, or none.
    pub fn fits(self, cause: Cause) -> bool {
        let less = [Cause::Softer, Cause::LessFriction, Cause::ForceGone];
        let more = [Cause::Stiffer, Cause::MoreFriction, Cause::ForceUnexpected];
        let wrong = if self.is_less() { more } else { less };
        cause.is_damage() && !wrong.contains(&cause)
    }
}

impl Subject {
    /// The joint with one thing about each of these axes changed.
    fn worn(&self, axes: &[usize], wear: impl Fn(&mut Worn, usize)) -> Worn {
        let mut worn = self.healthy();
        axes.iter().for_each(|&axis| wear(&mut worn, axis));
        worn
    }

    /// The RMS of what a change makes of the force of an axis at the same motion, as a part of the
    /// RMS force.
    fn size(&self, change: Change, axis: usize) -> f64 {
        let [force, x, v] = self.rms[axis];
        let share = match change {
            Change::Stiffness(_) => self.rig.joint.stiffness[axis] * x / force,
            Change::Damping(_) => self.rig.joint.damping[axis] * v / force,
            Change::Force(_) | Change::SameMotion(_) | Change::Seized => 1.0,
        };
        share * change.part().abs()
    }

    /// The validation record with the restoring force of these axes changed by `part` at the very
    /// same motion, from a row on.
    ///
    /// # Panics
    /// When the simulation has no validation record.
    pub fn same_motion(&self, axes: &[usize], part: f64, from: usize) -> Record {
        let study = &self.simulation.study;
        let mut record = study.records.last().expect("a record").clone();
        let truth = self.simulation.truth.last().expect("its truth");
        for &axis in axes {
            // Either r = m·a − F or r = F − m·a.
            let sign = match study.axes[axis].restoring_force {
                Convention::InertiaMinusForce => -part,
                Convention::ForceMinusInertia => part,
            };
            let force = record.axes[axis].force.iter_mut();
            for (value, of_joint) in force.zip(&truth.restoring_force[axis]).skip(from) {
                *value += sign * of_joint;
            }
        }
        record
    }
}

/// One change, and what was said of it.
#[derive(Clone, Debug)]
pub struct Found {
    /// What became of the joint.
    pub change: Change,
    /// The axes on which it changed, from 0.
    pub axes: &'static [usize],
    /// Whether it was so before the power came on.
    pub before_power_on: bool,
    /// Every change of each axis's verdict, with the time since the joint changed, s.
    pub seen: [Vec<(f64, Verdict)>; 2],
}

impl Found {
    /// The first alarm about an axis.
    fn alarm(&self, axis: usize) -> Option<(f64, Verdict)> {
        let mut seen = self.seen[axis].iter().copied();
        seen.find(|(_, v)| v.state == State::Alarm)
    }

    /// When the last of the axes that changed raised an alarm, s; none when one of them did not.
    pub fn found_after(&self) -> Option<f64> {
        let times = self.axes.iter().map(|&axis| Some(self.alarm(axis)?.0));
        let times: Option<Vec<f64>> = times.collect();
        times.map(|times| times.into_iter().fold(0.0, f64::max))
    }

    /// Whether every axis that changed raised an alarm in the documented time.
    pub fn is_in_time(&self, learnt: Learnt) -> bool {
        self.found_after()
            .is_some_and(|time| time <= documented_s(learnt))
    }

    /// The first alarm at all, as axis, time and verdict.
    pub fn first_alarm(&self) -> Option<(usize, f64, Verdict)> {
        let alarms = (0..2).filter_map(|axis| Some((axis, self.alarm(axis)?)));
        let first = alarms.min_by(|a, b| a.1.0.total_cmp(&b.1.0));
        first.map(|(axis, (time, verdict))| (axis, time, verdict))
    }

    /// What is wrong with what was said, if anything: an alarm before the change, the wrong axis
    /// blamed first, or the wrong direction.
    pub fn wrong(&self) -> Option<String> {
        let (axis, time, verdict) = self.first_alarm()?;
        let what = if time < 0.0 {
            "an alarm before the change"
        } else if !self.axes.contains(&axis) {
            "the other axis is blamed first"
        } else if !self.change.fits(verdict.cause) {
            "the wrong direction"
        } else {
            return None;
        };
        Some(format!("{what}: {}", self.told()))
    }

    /// The time during which an axis that changed was called healthy, s from a time on, in a record
    /// that ends at `end_s`.
    pub fn healthy_after(&self, from_s: f64, end_s: f64) -> f64 {
        let of_axis = |axis: usize| -> f64 {
            let seen = &self.seen[axis];
            let ends = seen.iter().skip(1).map(|(time, _)| *time).chain([end_s]);
            let spans = seen.iter().zip(ends);
            spans
                .filter(|((_, v), _)| v.state == State::Healthy)
                .map(|((begin, _), end)| (end - begin.max(from_s)).max(0.0))
                .sum()
        };
        self.axes
            .iter()
            .map(|&axis| of_axis(axis))
            .fold(0.0, f64::max)
    }

    /// For a person to read.
    pub fn told(&self) -> String {
        format!(
            "{:?} on {:?}{}: x {}; phi {}",
            self.change,
            self.axes,
            if self.before_power_on {
                " before power-on"
            } else {
                ""
            },
            story(&self.seen[0]),
            story(&self.seen[1])
        )
    }
}

/// Every one of these changes on either axis and on both, before and after power-on, watched for so
/// long after it. Left out where the simulated bodies, with nothing that holds them, fly apart
/// beyond all numbers: no sensor would follow them; and where an axis's force changes by less than
/// a tenth of its RMS.
pub fn curves(subject: &Subject, changes: &[Change], watched_s: f64, seed: u64) -> Vec<Found> {
    let all = changes.iter().flat_map(|&change| {
        AXES.iter()
            .flat_map(move |&axes| [false, true].map(|before| (change, axes, before)))
    });
    let is_large = |change: Change, axes: &[usize]| {
        let mut sizes = axes.iter().map(|&axis| subject.size(change, axis));
        sizes.all(|size| size >= SMALLEST)
    };
    let all: Vec<_> = all
        .filter(|(change, axes, _)| is_large(*change, axes))
        .collect();
    all.into_par_iter()
        .filter_map(|(change, axes, before_power_on)| {
            let at_s = if before_power_on { 0.0 } else { CHANGES_AT_S };
            let record = changed(subject, change, axes, at_s, at_s + watched_s, seed);
            if !is_finite(&record) {
                return None;
            }
            let mut seen = subject.watch_axes(&record);
            for (time, _) in seen.iter_mut().flatten() {
                *time -= at_s;
            }
            Some(Found {
                change,
                axes,
                before_power_on,
                seen,
            })
        })
        .collect()
}

fn is_finite(record: &Record) -> bool {
    let forces = record.axes.iter().flat_map(|axis| &axis.force);
    forces.copied().all(f64::is_finite)
}

fn changed(
    subject: &Subject,
    change: Change,
    axes: &[usize],
    at_s: f64,
    seconds: f64,
    seed: u64,
) -> Record {
    let worn = match change {
        Change::SameMotion(part) => {
            let rows = (at_s * super::watched::RATE_HZ) as usize;
            return subject.same_motion(axes, part, rows);
        }
        Change::Force(part) => subject.worn(axes, |worn, axis| worn.gain[axis] = 1.0 + part),
        Change::Stiffness(part) => subject.worn(axes, |worn, axis| {
            worn.joint.stiffness[axis] *= 1.0 + part;
        }),
        Change::Damping(part) => {
            subject.worn(axes, |worn, axis| worn.joint.damping[axis] *= 1.0 + part)
        }
        // A stiffness and a damping beside it hardly let it move.
        Change::Seized => subject.worn(axes, |worn, axis| {
            let [force, x, v] = subject.rms[axis];
            worn.lock[axis] = [LOCK * force / x, LOCK * force / v];
        }),
    };
    let shaking = Shaking::steady(seconds, STUDY_LEVEL, seed);
    subject.shake(shaking, Some((at_s, worn)))
}
