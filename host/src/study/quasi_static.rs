//! Logs without time: a force measured at one displacement after another, as a testing machine
//! writes them.
//!
//! Only the path counts then. A law that depends on it alone gives the same force however fast the
//! path is run through, so rows stand in for time, and the velocity is replaced by its sign: the
//! direction of travel. Everything that has a second in its unit is refused.

use super::series::median;
use jointwatch_shared::effect::{EFFECTS, Entry};

/// Rows that count as one second, for what is measured in rows inside: the length of blocks and of
/// guards between them. No number that is reported contains it.
pub(crate) const ROWS_PER_SECOND: f64 = 1000.0;
/// A reversal counts when the displacement has come back by more than so many standard deviations
/// of its noise, to either side.
const REVERSES: f64 = 3.0;
/// The velocity within which dry friction turns round: a number without meaning where only the
/// direction is known.
const TRANSITION: &str = "transition_velocity";

/// Whether a law gives the same force however fast a path is run through: then none of its
/// parameters has a second in its unit.
pub(crate) fn is_rate_independent(entry: &Entry) -> bool {
    let mut parameters = entry.parameters().iter();
    parameters.all(|p| {
        let d = p.dimension;
        p.name == TRANSITION || (d.velocity == 0 && d.other_velocity == 0 && d.time == 0)
    })
}

/// Whether a parameter says nothing where there is no time.
pub(crate) fn is_without_meaning(parameter: &str) -> bool {
    parameter == TRANSITION
}

/// Names of all other effects.
pub(crate) fn effects_in_time() -> impl Iterator<Item = String> {
    let effects = EFFECTS.iter().filter(|entry| !is_rate_independent(entry));
    effects.map(|entry| entry.about.name.to_owned())
}

/// The direction of travel in each row, 1 or −1: that of the step to it, reversals within the noise
/// or one count left out; 0 before the first step.
pub(super) fn direction(displacement: &[f64], count: Option<f64>) -> Vec<f64> {
    let reach = (2.0 * REVERSES * noise(displacement)).max(count.unwrap_or(0.0));
    direction_beyond(displacement, reach)
}

/// The same, with reversals of no more than `reach` left out.
pub(crate) fn direction_beyond(displacement: &[f64], reach: f64) -> Vec<f64> {
    let mut direction = vec![0.0; displacement.len()];
    let mut towards = 0.0;
    // The farthest row so far in the direction of travel; what comes after it turns round when
    // enough has come back.
    let mut farthest = 0;
    let mut lowest = 0;
    for (row, x) in displacement.iter().enumerate().skip(1) {
        if towards == 0.0 {
            // Before the first step either extreme may be where it begins.
            if *x > displacement[farthest] {
                farthest = row;
            }
            if *x < displacement[lowest] {
                lowest = row;
            }
            let (from, sign) = match () {
                () if x - displacement[lowest] > reach => (lowest, 1.0),
                () if displacement[farthest] - x > reach => (farthest, -1.0),
                () => continue,
            };
            towards = sign;
            direction[from + 1..=row].fill(towards);
            farthest = row;
            continue;
        }
        let ahead = towards * (x - displacement[farthest]);
        if ahead >= 0.0 {
            farthest = row;
        } else if -ahead > reach {
            towards = -towards;
            direction[farthest + 1..=row].fill(towards);
            farthest = row;
            continue;
        }
        direction[row] = towards;
    }
    direction
}

/// Standard deviation of a displacement's noise: of white noise the sixth difference has 924 times
/// the variance, of a motion sampled well next to nothing. The median passes over corners and
/// steps.
fn noise(displacement: &[f64]) -> f64 {
    let sixth = displacement.windows(7).map(|w| {
        (w[0] - 6.0 * w[1] + 15.0 * w[2] - 20.0 * w[3] + 15.0 * w[4] - 6.0 * w[5] + w[6]).abs()
    });
    // Of a normal distribution half lies within 0.6745 standard deviations.
    median(sixth.collect()).unwrap_or(0.0) / (0.6745 * 924_f64.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_direction_is_that_of_the_step_to_each_row() {
        let up = (0..20).map(f64::from);
        let down = (0..20).rev().map(f64::from);
        let path: Vec<f64> = up.clone().chain(down).chain([0.0; 3]).chain(up).collect();
        let wanted = |row: usize| match row {
            0 => 0.0,
            // Where it turns round, two rows are at the same place.
            1..=20 | 44.. => 1.0,
            _ => -1.0,
        };
        let wanted: Vec<f64> = (0..path.len()).map(wanted).collect();
        assert_eq!(direction(&path, None), wanted);
        assert_eq!(direction(&[1.0; 4], None), [0.0; 4]);
    }

    #[test]
    fn noise_turns_nothing_round() {
        let mut noise = crate::study::time::noise::noise(3);
        let triangle = |row: usize| (((row + 500) % 2000) as f64 / 1000.0 - 1.0).abs();
        let noisy: Vec<f64> = (0..6000)
            .map(|row| triangle(row) + 2e-3 * noise())
            .collect();
        let found = direction(&noisy, None);
        let turns = found.windows(2).filter(|w| w[0] != w[1]).count();
        assert_eq!(turns, 7, "six reversals and the first step");
        let clean: Vec<f64> = (0..6000).map(triangle).collect();
        let right = direction(&clean, None);
        let wrong = found.iter().zip(&right).filter(|(a, b)| a != b).count();
        // The noise moves a turning point by a few rows.
        assert!(wrong < 60, "{wrong} rows");
    }

    #[test]
    fn laws_of_the_path_alone_are_those_without_a_second() {
        let fast = |name: &str| EFFECTS.iter().find(|e| e.about.name == name).unwrap();
        for name in [
            "stiffness",
            "coulomb",
            "jenkins",
            "bouc_wen",
            "iwan",
            "preload",
            "mullins",
            "self_centring",
        ] {
            assert!(is_rate_independent(fast(name)), "{name}");
        }
        for name in [
            "viscous",
            "stribeck",
            "lugre",
            "maxwell",
            "generalized_maxwell",
            "lagged_friction",
            "time_delay",
            "mains_hum",
            "inertia_error",
        ] {
            assert!(!is_rate_independent(fast(name)), "{name}");
        }
    }
}
