//! When a new model has proven itself: when it has been evaluated for so many samples; and when it
//! has had time enough.

/// How a trial ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// The model has run: [`Store::confirm`](super::Store::confirm) is due, from a task that may
    /// wait for flash.
    Proven,
    /// It has not run within its time: the one before it is to run again.
    TooLate,
}

/// Counts the healthy samples of a model on trial, and all of them. Costs two comparisons and two
/// subtractions a sample, and no flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Trial {
    length: u32,
    left: u32,
    /// Sampling instants until it is too late, those without a sample among them; 0 when no trial
    /// goes on.
    until_late: u32,
}

impl Trial {
    /// A trial over so many healthy samples, at least one, which are to come `within` so many
    /// sampling instants.
    pub const fn over(samples: u32, within: u32) -> Self {
        let length = if samples == 0 { 1 } else { samples };
        Self {
            length,
            left: length,
            until_late: if within == 0 { 1 } else { within },
        }
    }

    /// No trial: the model has proven itself before.
    pub const fn none() -> Self {
        Self {
            length: 0,
            left: 0,
            until_late: 0,
        }
    }

    /// Whether it still goes on.
    pub const fn goes_on(&self) -> bool {
        self.until_late != 0
    }

    /// Takes a sample, `missed` instants after the one before it. Says once how the trial has
    /// ended.
    pub const fn sample(&mut self, healthy: bool, missed: u32) -> Option<Ended> {
        if self.until_late == 0 {
            return None;
        }
        self.until_late = self.until_late.saturating_sub(missed).saturating_sub(1);
        // While the mark waits to be set, there is nothing left to count.
        if healthy && self.left > 0 {
            self.left -= 1;
            if self.left == 0 {
                return Some(Ended::Proven);
            }
        }
        if self.until_late == 0 {
            return Some(Ended::TooLate);
        }
        None
    }

    /// What proved the model could be marked, so that it is over; or not, so that it is to prove
    /// itself again in the time left.
    pub const fn marked(&mut self, marked: bool) {
        if marked {
            *self = Self::none();
        } else {
            self.left = self.length;
            // The time may have been over with the sample that proved it; that is still to be told.
            if self.until_late == 0 {
                self.until_late = 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_healthy_samples_count_and_the_end_is_told_once() {
        let mut trial = Trial::over(3, 100);
        let told = [false, true, true, false, true, true].map(|healthy| trial.sample(healthy, 0));
        let proven = Some(Ended::Proven);
        assert_eq!(told, [None, None, None, None, proven, None]);
        assert!(trial.goes_on());
        trial.marked(true);
        assert!(!trial.goes_on());
        let none = &mut Trial::none();
        assert!(none.sample(true, 0).is_none() && !none.goes_on());
        assert_eq!(Trial::over(0, 9).sample(true, 0), proven);
    }

    #[test]
    fn it_ends_in_time_whatever_comes() {
        let late = |trial: &mut Trial, healthy: bool, missed: u32| {
            (1..1000).find(|_| trial.sample(healthy, missed) == Some(Ended::TooLate))
        };
        assert_eq!(late(&mut Trial::over(3, 12), false, 0), Some(12));
        // Instants without a sample count as well.
        assert_eq!(late(&mut Trial::over(3, 12), false, 2), Some(4));
        assert_eq!(late(&mut Trial::over(3, 12), false, u32::MAX), Some(1));
        // A mark that cannot be set does not put it off.
        for (within, last) in [(12, 13), (11, 11), (10, 10)] {
            let mut trial = Trial::over(3, within);
            let end = (1..30).find(|_| match trial.sample(true, 0) {
                Some(Ended::Proven) => {
                    trial.marked(false);
                    false
                }
                ended => ended == Some(Ended::TooLate),
            });
            assert_eq!(end, Some(last));
        }
    }
}
