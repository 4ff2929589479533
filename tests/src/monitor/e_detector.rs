//! How rarely a cumulative sum may reach its threshold on a healthy joint, without an assumption
//! about tails.
//!
//! S ← max(0, S + z), alarm at S ≥ h. Class of data: E[exp(θ·z) | past] ≤ 1 at one θ > 0. Then M ←
//! (1 + M)·exp(θ·z), the e-detector of Shiryaev and Roberts, has E M ≤ number of steps, and
//! exp(θ·S) ≤ M wherever S > 0. So the mean number of steps to an alarm is at least
//! exp(θ·h) (Lorden, Ann. Math. Statist. 42, 1971, 1897–1908; Shin, Ramdas and Rinaldo,
//! E-detectors, 2024). The device holds z from above
//! ([`most_of_block`](jointwatch_shared::monitor::most_of_block)), so that exp(θ·z) is bounded and
//! its mean is one that can be measured.

use std::collections::BTreeMap;

/// Judged blocks of a second: 16 blocks of 64 ms are 1.02 s.
const SECOND: usize = 16;
/// The fewest blocks over which a mean of exp(θ·z) is taken: so many seconds of judged motion.
const FEWEST: usize = 16 * SECOND;
/// Halvings of the interval in which the largest rate is sought.
const HALVINGS: usize = 40;

/// The increments of one cumulative sum over several records, each begun with the sum at 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Increments {
    /// The sum that raises the alarm, in the unit of the increments; above 0.
    pub threshold: f64,
    /// Per record the number of its kind of drive, and the increments of one judged block after
    /// the other, as the device holds them.
    pub records: Vec<(u64, Vec<f64>)>,
}

/// Means of exp(θ·z); 0 where there is no such block.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    /// Over all blocks of all records.
    pub whole: f64,
    /// Over the blocks that follow a sum at 0, and over those that follow one above it: what the
    /// past tells.
    pub after: [f64; 2],
    /// Over the records of the kind of drive with the largest, and over the record with the
    /// largest; of those with at least 256 judged blocks.
    pub drive: f64,
    /// Over the record with the largest.
    pub record: f64,
    /// Over the 16 successive blocks with the largest.
    pub second: f64,
}

impl Moments {
    /// The largest of the means that depend on what is known beforehand: after a sum at 0, after
    /// one above it, and of every kind of drive.
    pub fn known_past(&self) -> f64 {
        let [zero, above] = self.after;
        zero.max(above).max(self.drive)
    }

    /// The same, and over the worst record, in which chance has a part.
    pub fn worst_record(&self) -> f64 {
        self.known_past().max(self.record)
    }
}

impl Increments {
    /// Means of exp(`rate`·z) over the increments z.
    pub fn moments(&self, rate: f64) -> Moments {
        let (mut whole, mut after) = (Mean::default(), [Mean::default(); 2]);
        let (mut drives, mut second) = (BTreeMap::<u64, Mean>::new(), 0.0_f64);
        let mut records = Vec::new();
        for (drive, values) in &self.records {
            let (mut own, mut sum) = (Mean::default(), 0.0_f64);
            let moments: Vec<f64> = values.iter().map(|z| (rate * z).exp()).collect();
            for (z, moment) in values.iter().zip(&moments) {
                own.add(*moment);
                after[usize::from(sum > 0.0)].add(*moment);
                sum = (sum + z).clamp(0.0, 1.5 * self.threshold);
            }
            whole.add_all(&own);
            drives.entry(*drive).or_default().add_all(&own);
            records.push(own);
            for window in moments.windows(SECOND) {
                second = second.max(window.iter().sum::<f64>() / SECOND as f64);
            }
        }
        let largest = |means: &mut dyn Iterator<Item = &Mean>| {
            let long = means.filter(|mean| mean.count >= FEWEST);
            long.map(Mean::value).fold(0.0, f64::max)
        };
        Moments {
            whole: whole.value(),
            after: after.map(|mean| mean.value()),
            drive: largest(&mut drives.values()),
            record: largest(&mut records.iter()),
            second,
        }
    }

    /// The largest rate up to `stated` at which `worst` of the moments is not above 1; 0 where
    /// there is none.
    ///
    /// Every mean is convex in the rate and 1 at 0, so those that keep the condition are an
    /// interval from 0 on.
    pub fn largest_rate(&self, stated: f64, worst: fn(&Moments) -> f64) -> f64 {
        let keeps = |rate: f64| worst(&self.moments(rate)) <= 1.0;
        if keeps(stated) {
            return stated;
        }
        let (mut low, mut high) = (0.0, stated);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if keeps(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }

    /// The highest that the sum went, as a part of its threshold.
    pub fn highest(&self) -> f64 {
        let of_record = |(_, values): &(u64, Vec<f64>)| {
            let (mut sum, mut highest) = (0.0_f64, 0.0_f64);
            for z in values {
                sum = (sum + z).clamp(0.0, 1.5 * self.threshold);
                highest = highest.max(sum);
            }
            highest / self.threshold
        };
        self.records.iter().map(of_record).fold(0.0, f64::max)
    }
}

/// The bound on false alarms of several sums, in alarms per step: Σ exp(−θ·h), for each its θ and
/// h.
pub fn alarms_per_step(sums: impl Iterator<Item = (f64, f64)>) -> f64 {
    sums.map(|(rate, threshold)| (-rate * threshold).exp())
        .sum()
}

#[derive(Clone, Copy, Debug, Default)]
struct Mean {
    sum: f64,
    count: usize,
}

impl Mean {
    fn add(&mut self, value: f64) {
        self.sum += value;
        self.count += 1;
    }

    fn add_all(&mut self, other: &Self) {
        self.sum += other.sum;
        self.count += other.count;
    }

    fn value(&self) -> f64 {
        self.sum / self.count.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Steps of +1 with probability 1/3 and of −1 else: E exp(θ·z) = 1 at θ = ln 2.
    fn step(rng: &mut ChaCha8Rng) -> f64 {
        if rng.random_range(0..3) == 0 {
            1.0
        } else {
            -1.0
        }
    }

    #[test]
    fn a_walk_that_just_keeps_the_condition_alarms_no_sooner_than_the_bound() {
        let (rate, threshold) = (2.0_f64.ln(), 6.0);
        let bound = 1.0 / alarms_per_step([(rate, threshold)].into_iter());
        assert!((bound - 64.0).abs() < 1e-9);
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let runs = 20_000;
        let mut steps = 0_u32;
        for _ in 0..runs {
            let mut sum = 0.0_f64;
            while sum < threshold {
                sum = (sum + step(&mut rng)).max(0.0);
                steps += 1;
            }
        }
        let time = f64::from(steps) / f64::from(runs);
        // From k to k + 1 it takes D = 3 + 2·D(k − 1) steps, 3 from 0: 360 in all.
        println!("mean time to alarm {time:.1} steps, bound {bound:.1}");
        assert!((time - 360.0).abs() < 12.0 && time >= bound, "{time}");
    }

    #[test]
    fn the_condition_is_measured_as_it_is() {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let walk = |rng: &mut ChaCha8Rng| (0..50_000).map(|_| step(rng)).collect();
        let increments = Increments {
            threshold: 6.0,
            records: vec![(0, walk(&mut rng)), (1, walk(&mut rng))],
        };
        let moments = increments.moments(2.0_f64.ln());
        for mean in [
            moments.whole,
            moments.after[0],
            moments.after[1],
            moments.drive,
        ] {
            assert!((mean - 1.0).abs() < 0.01, "{moments:?}");
        }
        assert!(moments.second > 1.3);
        let rate = increments.largest_rate(1.0, Moments::known_past);
        assert!((rate - 2.0_f64.ln()).abs() < 0.03, "{rate}");
        assert_eq!(increments.largest_rate(0.5, Moments::known_past), 0.5);
        // A sum that rises where it has risen already: steps come in pairs of one kind.
        let pairs = |rng: &mut ChaCha8Rng| -> Vec<f64> {
            let steps = (0..25_000).map(|_| step(rng));
            steps.flat_map(|z| [z, z]).collect()
        };
        let twice = Increments {
            threshold: 6.0,
            records: vec![(0, pairs(&mut rng))],
        };
        let moments = twice.moments(2.0_f64.ln());
        assert!(
            (moments.whole - 1.0).abs() < 0.02 && moments.after[1] > 1.05,
            "{moments:?}"
        );
        assert!(twice.largest_rate(1.0, Moments::known_past) < 0.6);
        // One that drifts upwards keeps it nowhere.
        let rising = Increments {
            threshold: 6.0,
            records: vec![(0, vec![1.0, 1.0, -1.0])],
        };
        assert!(
            rising.largest_rate(1.0, Moments::known_past) < 1e-9 && rising.highest() == 2.0 / 6.0
        );
    }
}
