//! The trial of a new model: it is proven when it has worked for so many samples, and not before.

/// Counts the healthy samples of a model on trial. Costs one comparison and one subtraction a sample, and no flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Trial {
    left: u32,
}

impl Trial {
    /// A trial over so many healthy samples, at least one.
    pub const fn over(samples: u32) -> Self {
        Self {
            left: if samples == 0 { 1 } else { samples },
        }
    }

    /// No trial: the model has proven itself before.
    pub const fn none() -> Self {
        Self { left: 0 }
    }

    /// Whether it still goes on.
    pub const fn goes_on(&self) -> bool {
        self.left != 0
    }

    /// Takes a sample: healthy when the sensors were read and the model was evaluated in time. True once, with the sample
    /// that proves the model: then [`Store::confirm`](super::Store::confirm) is due, from a task that may wait for flash.
    pub const fn sample(&mut self, healthy: bool) -> bool {
        if !healthy || self.left == 0 {
            return false;
        }
        self.left -= 1;
        self.left == 0
    }
}

#[cfg(test)]
mod tests {
    use super::Trial;

    #[test]
    fn only_healthy_samples_count_and_the_end_is_told_once() {
        let mut trial = Trial::over(3);
        let told = [false, true, true, false, true, true].map(|healthy| trial.sample(healthy));
        assert_eq!(told, [false, false, false, false, true, false]);
        assert!(!trial.goes_on());
        assert!(!Trial::none().sample(true) && !Trial::none().goes_on());
        assert!(Trial::over(0).sample(true));
    }
}
