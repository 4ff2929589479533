//! Healthy joints watched for hours: how far the monitor's cumulative sums went, and the bound on
//! false alarms that their increments allow ([`super::e_detector`]).

use super::e_detector::{Increments, Moments, alarms_per_step};
use super::watched::{DRIVES, Learnt, RATE_HZ, Shaking, Subject};
use jointwatch::simulate::RigParameters;
use jointwatch_shared::monitor::{MonitorState, SIDES, State, Verdict, most_of_block};
use rayon::prelude::*;
use std::fmt::Write;

/// Hours between false alarms for which limits are set, the default of the command line.
pub const WANTED_HOURS: u32 = 720;
/// Where the sums of gross changes begin among an axis's.
const GROSS: usize = 5;
/// The names of an axis's sums, in the order of the monitor.
const SUMS: [&str; SIDES] = [
    "error",
    "stiffer",
    "softer",
    "more friction",
    "less friction",
    "force gone",
    "force not expected",
];

/// One cumulative sum of one rig.
#[derive(Clone, Debug, PartialEq)]
pub struct Sum {
    /// The seed that its rig was drawn from.
    pub rig: u64,
    /// The axis that it watches, from 0.
    pub axis: usize,
    /// Which sum: the error's own, those for more and less stiffness and friction, or those of a
    /// gross change.
    pub side: usize,
    /// The highest that it went, as a part of the threshold.
    pub highest: f64,
    /// θ·h for which the limit was set: ln(blocks in the stated interval × sums).
    pub stated: f64,
    /// Means of exp(θ·z) at that θ.
    pub moments: Moments,
    /// The largest θ·h up to the stated one at which they keep the condition: given what is known
    /// beforehand, and in every record too.
    pub kept: [f64; 2],
}

impl Sum {
    /// Whether its increments keep the condition at the θ for which the limit was set: given what
    /// is known beforehand, and in every record too.
    pub fn keeps(&self) -> [bool; 2] {
        [self.moments.known_past(), self.moments.worst_record()].map(|worst| worst <= 1.0)
    }
}

/// What a campaign saw of one kind of model.
#[derive(Clone, Debug)]
pub struct Campaign {
    /// What was learnt of every rig's joint.
    pub learnt: Learnt,
    /// Watched hours, all rigs together.
    pub hours: f64,
    /// Seeds of the rigs.
    pub rigs: Vec<u64>,
    /// Relative errors of their models.
    pub errors: Vec<[f64; 2]>,
    /// Hours of one block.
    pub block_hours: f64,
    /// Every sum of every rig.
    pub sums: Vec<Sum>,
    /// Alarms about the joint that were raised.
    pub alarms: usize,
    /// Minutes in which the monitor was suspicious of the joint.
    pub suspect_minutes: usize,
}

/// What one record adds to every sum, axis by axis, and whether the monitor was suspicious or
/// worse.
struct Watched {
    increments: Vec<Vec<f64>>,
    alarms: usize,
    is_suspect: bool,
}

/// One record of a healthy joint, from a fresh start.
fn watch(subject: &Subject, shaking: Shaking) -> Watched {
    let record = subject.shake(shaking, None);
    let log_values = subject.monitor.log_values();
    let mut increments = vec![Vec::new(); 2 * SIDES];
    let mut numbers = [0; 2];
    let seen = subject.watch(&mut MonitorState::default(), &record, |state| {
        let mut add = |axis: usize, side: usize, value: i32| {
            let limits = subject.monitor.limits().axes[axis].sides()[side];
            let most = most_of_block(side, limits.threshold);
            let step = value.saturating_sub(limits.drift).min(most);
            increments[axis * SIDES + side].push(f64::from(step));
        };
        let (number, sums) = state.last_block();
        let (of_gross, gross, outside) = state.last_gross_block();
        for (axis, limits) in subject.monitor.limits().axes.iter().enumerate() {
            let said = sums[axis].statistics(limits, log_values);
            if number != numbers[0] && said.moves {
                let (s, f) = (said.stiffness, said.friction);
                for (side, value) in [said.error, s, -s, f, -f].into_iter().enumerate() {
                    add(axis, side, value);
                }
            }
            let said = gross[axis].judged(limits, log_values, outside);
            if let Some(said) = said.filter(|_| of_gross != numbers[1]) {
                add(axis, GROSS + said.side, said.value);
            }
        }
        numbers = [number, of_gross];
    });
    let of = |state: State| move |(_, v): &&(f64, Verdict)| v.state == state && v.cause.is_damage();
    Watched {
        increments,
        alarms: seen.iter().filter(of(State::Alarm)).count(),
        is_suspect: seen.iter().any(|s| of(State::Suspect)(&s)),
    }
}

impl Campaign {
    /// Watches `rigs` rigs of seeds from `seed` on (all parameters drawn anew; unstable ones are
    /// passed over), `hours` in all, in minutes of different drives.
    ///
    /// # Errors
    /// When hardly any rig of the seeds is stable.
    pub fn run(learnt: Learnt, seed: u64, rigs: usize, hours: f64) -> Result<Self, String> {
        let minutes = (hours * 60.0 / rigs as f64).ceil() as u64;
        let mut campaign = Self {
            learnt,
            hours: minutes as f64 / 60.0 * rigs as f64,
            rigs: Vec::new(),
            errors: Vec::new(),
            block_hours: 0.0,
            sums: Vec::new(),
            alarms: 0,
            suspect_minutes: 0,
        };
        let mut refused = String::new();
        for rig in (seed..).take(4 * rigs) {
            if campaign.rigs.len() == rigs {
                break;
            }
            match Subject::new(learnt, RigParameters::draw(rig), rig, WANTED_HOURS) {
                Ok(subject) => campaign.watch(&subject, rig, minutes),
                Err(why) => refused = why,
            }
        }
        if campaign.rigs.len() < rigs {
            return Err(format!(
                "only {} of the rigs from seed {seed} on can be watched: {refused}",
                campaign.rigs.len()
            ));
        }
        Ok(campaign)
    }

    fn watch(&mut self, subject: &Subject, rig: u64, minutes: u64) {
        let watched: Vec<Watched> = (0..minutes)
            .into_par_iter()
            .map(|minute| watch(subject, Shaking::minute(minute, rig)))
            .collect();
        self.rigs.push(rig);
        self.errors.push(subject.relative_error);
        self.alarms += watched.iter().map(|w| w.alarms).sum::<usize>();
        self.suspect_minutes += watched.iter().filter(|w| w.is_suspect).count();
        let limits = subject.monitor.limits();
        self.block_hours = f64::from(limits.block) / RATE_HZ / 3600.0;
        let blocks = f64::from(WANTED_HOURS) / self.block_hours;
        let stated = (blocks * (SIDES * limits.axes.len()) as f64).ln();
        for number in 0..2 * SIDES {
            let (axis, side) = (number / SIDES, number % SIDES);
            let threshold = f64::from(limits.axes[axis].sides()[side].threshold);
            let drives = (0..minutes).map(|minute| minute % DRIVES);
            let records = drives
                .zip(&watched)
                .map(|(drive, w)| (drive, w.increments[number].clone()));
            let increments = Increments {
                threshold,
                records: records.collect(),
            };
            let rate = stated / threshold;
            self.sums.push(Sum {
                rig,
                axis,
                side,
                highest: increments.highest(),
                stated,
                moments: increments.moments(rate),
                kept: [Moments::known_past, Moments::worst_record]
                    .map(|worst| increments.largest_rate(rate, worst) * threshold),
            });
        }
    }

    /// The highest that any sum went, as a part of its threshold.
    pub fn highest(&self) -> f64 {
        self.sums.iter().map(|s| s.highest).fold(0.0, f64::max)
    }

    fn of_rig(&self, rig: u64) -> impl Iterator<Item = &Sum> {
        self.sums.iter().filter(move |s| s.rig == rig)
    }

    /// Hours between false alarms of a rig at least, its sums together: by what they keep given
    /// what is known beforehand, and by what they keep in every record.
    pub fn hours_between(&self, rig: u64) -> [f64; 2] {
        [0, 1].map(|strictness| {
            let sums = self.of_rig(rig).map(|s| (s.kept[strictness], 1.0));
            self.block_hours / alarms_per_step(sums)
        })
    }

    /// The same of the rig that is worst.
    pub fn worst_hours(&self) -> [f64; 2] {
        let hours = self.rigs.iter().map(|&rig| self.hours_between(rig));
        hours.fold([f64::INFINITY; 2], |worst, own| {
            [0, 1].map(|i| worst[i].min(own[i]))
        })
    }

    /// How many sums, and how many rigs with all of theirs, keep the condition in either way.
    pub fn keeping(&self) -> [[usize; 2]; 2] {
        [0, 1].map(|strictness| {
            let sums = self.sums.iter().filter(|s| s.keeps()[strictness]).count();
            let whole = |rig: &&u64| self.of_rig(**rig).all(|s| s.keeps()[strictness]);
            [sums, self.rigs.iter().filter(whole).count()]
        })
    }
}

/// A campaign for a person to read: of every rig the sums that miss the condition, or the one that
/// is nearest to it.
pub fn report(campaign: &Campaign) -> String {
    let ([known, record], [known_hours, record_hours]) =
        (campaign.keeping(), campaign.worst_hours());
    let mut text = format!(
        "{:?} models, {} rigs, {:.1} hours: {} alarms, {} minutes suspect; highest sum {:.2} of its threshold; E exp(θz) ≤ 1 at the θ of \
         the limits, given drive and sum: {} of {} sums, {} rigs, at least {known_hours:.1} hours between false alarms on the worst; in \
         every minute: {} sums, {} rigs, {record_hours:.1} hours",
        campaign.learnt,
        campaign.rigs.len(),
        campaign.hours,
        campaign.alarms,
        campaign.suspect_minutes,
        campaign.highest(),
        known[0],
        campaign.sums.len(),
        known[1],
        record[0],
        record[1],
    );
    for (&rig, errors) in campaign.rigs.iter().zip(&campaign.errors) {
        let [known_hours, record_hours] = campaign.hours_between(rig);
        let _ = write!(
            text,
            "\n  rig {rig}, relative errors {:.4} and {:.4}: at least {known_hours:.1} hours, {record_hours:.1} by the worst minutes",
            errors[0], errors[1],
        );
        let nearest = campaign.of_rig(rig).max_by(|a, b| {
            let [a, b] = [a, b].map(|sum| sum.moments.worst_record());
            a.total_cmp(&b)
        });
        let misses = campaign.of_rig(rig).filter(|s| !s.keeps()[1]);
        for sum in misses.chain(nearest.filter(|s| s.keeps()[1])) {
            let _ = write!(text, "\n    {}", line(sum));
        }
    }
    text
}

fn line(sum: &Sum) -> String {
    let [zero, above] = sum.moments.after;
    let Moments {
        whole,
        drive,
        record,
        second,
        ..
    } = sum.moments;
    format!(
        "'{}' on {}: highest {:.2}; E exp(θz) {whole:.3}, after a sum at 0 {zero:.3}, above 0 {above:.3}, worst drive {drive:.3}, worst \
         minute {record:.3}, worst second {second:.3}; θh {:.1} and {:.1} of {:.1}",
        SUMS[sum.side], sum.axis, sum.highest, sum.kept[0], sum.kept[1], sum.stated,
    )
}
