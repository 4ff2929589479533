//! Healthy joints watched for hours: how far the monitor's cumulative sums went, and how often they would reach their limit.
//!
//! A sum's excursion is its way from zero back to zero. Excursions are taken one by one, per rig, axis and sum, as a part of the
//! threshold; beyond a high level their heights are fitted by an exponential (peaks over threshold), which
//! is what a random walk with a downward drift has, and the fit says how often the whole threshold would be reached.

use crate::watched::{Learnt, Shaking, Subject};
use jointwatch::simulate::RigParameters;
use jointwatch_shared::monitor::{MonitorState, State};
use rayon::prelude::*;
use std::fmt::Write;

/// Hours between false alarms for which limits are set, the default of the command line.
pub const WANTED_HOURS: u32 = 720;
/// The highest excursions of a sum to which the tail is fitted: a tenth of them, and this many at least.
const MIN_PEAKS: usize = 10;
/// The names of an axis's sums, in the order of the monitor.
const SUMS: [&str; 7] = [
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
    /// The rig's seed.
    pub rig: u64,
    /// Which axis.
    pub axis: usize,
    /// Which sum: the error's own, or those for more and less stiffness and friction.
    pub side: usize,
    /// Heights of its excursions, as parts of the threshold, highest first.
    pub peaks: Vec<f64>,
    /// False alarms per hour by the fitted tail; the mean excess taken larger by two of its standard errors for the second.
    pub per_hour: [f64; 2],
}

/// What a campaign saw of one kind of model.
#[derive(Clone, Debug)]
pub struct Campaign {
    /// What was learnt.
    pub learnt: Learnt,
    /// Watched hours, all rigs together.
    pub hours: f64,
    /// Hours per rig.
    pub hours_per_rig: f64,
    /// Seeds of the rigs.
    pub rigs: Vec<u64>,
    /// Relative errors of their models.
    pub errors: Vec<[f64; 2]>,
    /// Every sum of every rig.
    pub sums: Vec<Sum>,
    /// Alarms about the joint that were raised.
    pub alarms: usize,
    /// Minutes in which the monitor was suspicious of the joint.
    pub suspect_minutes: usize,
}

/// Heights of the excursions of a sum that is sampled once per block, in 1/1000 of its threshold.
fn excursions(levels: &[u16]) -> Vec<f64> {
    let mut peaks = Vec::new();
    let mut highest = 0;
    for &level in levels.iter().chain([&0]) {
        if level > 0 {
            highest = highest.max(level);
        } else if highest > 0 {
            peaks.push(f64::from(highest) / 1000.0);
            highest = 0;
        }
    }
    peaks
}

/// False alarms per hour by an exponential beyond the highest tenth of the peaks (highest first), and the same with its mean
/// excess taken larger by two standard errors. With fewer peaks than the fit needs, the highest one stands for all.
pub fn rate(peaks: &[f64], hours: f64) -> [f64; 2] {
    if peaks.is_empty() {
        return [0.0; 2];
    }
    let beyond = (peaks.len() / 10).max(MIN_PEAKS).min(peaks.len());
    let edge = peaks.get(beyond).copied().unwrap_or(0.0);
    let excess = peaks[..beyond].iter().map(|p| p - edge).sum::<f64>() / beyond as f64;
    [0.0, 2.0].map(|caution: f64| {
        let excess = excess * (1.0 + caution / (beyond as f64).sqrt());
        beyond as f64 / hours * (-(1.0 - edge) / excess.max(1e-6)).exp()
    })
}

impl Campaign {
    /// Watches `rigs` rigs of seeds from `seed` on (all parameters drawn anew; unstable ones are passed over), `hours` in all, in
    /// minutes of different drives.
    ///
    /// # Errors
    /// When hardly any rig of the seeds is stable.
    pub fn run(learnt: Learnt, seed: u64, rigs: usize, hours: f64) -> Result<Self, String> {
        let minutes = (hours * 60.0 / rigs as f64).ceil() as u64;
        let mut campaign = Self {
            learnt,
            hours: minutes as f64 / 60.0 * rigs as f64,
            hours_per_rig: minutes as f64 / 60.0,
            rigs: Vec::new(),
            errors: Vec::new(),
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
        let watched: Vec<_> = (0..minutes)
            .into_par_iter()
            .map(|minute| {
                let record = subject.shake(Shaking::minute(minute, rig), None);
                let mut levels = vec![Vec::new(); 2 * SUMS.len()];
                let mut number = 0;
                let look = |state: &MonitorState| {
                    // Sums as they stood before the block that was finished just now.
                    let (finished, _) = state.last_block();
                    if finished == number {
                        return;
                    }
                    number = finished;
                    let both = [0, 1].map(|axis| state.levels(&subject.monitor, axis));
                    for (series, level) in levels.iter_mut().zip(both.as_flattened()) {
                        series.push(*level);
                    }
                };
                let seen = subject.watch(&mut MonitorState::default(), &record, look);
                let damage = |state| {
                    move |(_, v): &&(f64, jointwatch_shared::monitor::Verdict)| {
                        v.state == state && v.cause.is_damage()
                    }
                };
                let alarms = seen.iter().filter(damage(State::Alarm)).count();
                let suspect = seen.iter().any(|s| damage(State::Suspect)(&s));
                let peaks: Vec<Vec<f64>> = levels.iter().map(|l| excursions(l)).collect();
                (peaks, alarms, suspect)
            })
            .collect();
        self.rigs.push(rig);
        self.errors.push(subject.relative_error);
        self.alarms += watched.iter().map(|w| w.1).sum::<usize>();
        self.suspect_minutes += watched.iter().filter(|w| w.2).count();
        for number in 0..2 * SUMS.len() {
            let mut peaks: Vec<f64> = watched
                .iter()
                .flat_map(|w| w.0[number].iter().copied())
                .collect();
            peaks.sort_by(|a, b| b.total_cmp(a));
            self.sums.push(Sum {
                rig,
                axis: number / SUMS.len(),
                side: number % SUMS.len(),
                per_hour: rate(&peaks, self.hours_per_rig),
                peaks,
            });
        }
    }

    /// The highest that any sum went, as a part of its threshold.
    pub fn highest(&self) -> f64 {
        let highest = self.sums.iter().filter_map(|s| s.peaks.first().copied());
        highest.fold(0.0, f64::max)
    }

    /// Hours between false alarms of a rig by the fitted tails, its sums together: of the rig that is worst, and the same with
    /// two standard errors of the mean excess.
    pub fn hours_between(&self) -> [f64; 2] {
        [0, 1].map(|caution| {
            let of_rig = |rig: &u64| -> f64 {
                let mine = self.sums.iter().filter(|s| s.rig == *rig);
                mine.map(|s| s.per_hour[caution]).sum()
            };
            1.0 / self.rigs.iter().map(of_rig).fold(1e-300, f64::max)
        })
    }
}

/// A campaign for a person to read.
pub fn report(campaign: &Campaign) -> String {
    let [likely, cautious] = campaign.hours_between();
    let mut text = format!(
        "{:?} models, {} rigs of seeds {:?}, {:.1} hours: {} alarms, {} minutes suspect; highest sum {:.2} of its threshold; hours \
         between false alarms on the worst rig 10^{:.1}, with two standard errors 10^{:.1}",
        campaign.learnt,
        campaign.rigs.len(),
        campaign.rigs,
        campaign.hours,
        campaign.alarms,
        campaign.suspect_minutes,
        campaign.highest(),
        likely.log10(),
        cautious.log10(),
    );
    for (rig, errors) in campaign.rigs.iter().zip(&campaign.errors) {
        let mine = campaign.sums.iter().filter(|s| s.rig == *rig);
        let Some(worst) = mine.max_by(|a, b| a.per_hour[1].total_cmp(&b.per_hour[1])) else {
            continue;
        };
        let _ = write!(
            text,
            "\n  rig {rig}, relative errors {:.4} and {:.4}: worst sum is '{}' on {}, {} excursions, highest {:.2}, a false alarm in \
             10^{:.1} hours (10^{:.1})",
            errors[0],
            errors[1],
            SUMS[worst.side],
            worst.axis,
            worst.peaks.len(),
            worst.peaks.first().copied().unwrap_or(0.0),
            -worst.per_hour[0].max(1e-300).log10(),
            -worst.per_hour[1].max(1e-300).log10(),
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tail_of_known_excursions_gives_their_rate() {
        assert_eq!(excursions(&[0, 3, 500, 20, 0, 0, 7]), [0.5, 0.007]);
        // Exponential quantiles of mean 0.1, 1000 in 10 hours: the threshold is reached 100·e^(−10) times an hour.
        let peaks: Vec<f64> = (0..1000)
            .map(|i| -0.1 * ((f64::from(i) + 0.5) / 1000.0).ln())
            .collect();
        let [likely, cautious] = rate(&peaks, 10.0);
        let wanted = 100.0 * (-10.0_f64).exp();
        assert!((0.7..1.4).contains(&(likely / wanted)), "{likely}");
        assert!(cautious > 2.0 * likely);
        assert_eq!(rate(&[], 1.0), [0.0; 2]);
    }
}
