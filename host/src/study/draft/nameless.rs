//! Logs without a heading: which of two columns is the displacement and which the force.
//!
//! A joint takes in work, ∮ F·dx > 0 by the sign with which it pulls back; with the columns
//! exchanged it would give out as much, ∮ x·dF = −∮ F·dx. What does not come back to where it
//! began, or loses next to nothing, tells neither.

use super::parts::{Log, Said};
use super::trial::{LOSSY, with_work};
use crate::study::survey::SurveyedColumn;

/// Correlation of displacement and force from which on the sign of the stiffness is told.
const PULLS_BACK: f64 = 0.3;

/// The roles of the two columns that have no name, as [`Said`] has them; `None` where there are not
/// two, or nothing tells.
pub(super) fn roles(
    logs: &[Log<'_>],
    time: Option<&str>,
    said: &Said,
) -> Option<[(String, String); 2]> {
    let motion = ["displacement", "velocity", "acceleration", "force"];
    if motion.iter().any(|role| said.column(role).is_some()) {
        return None;
    }
    let survey = logs[0].survey;
    let is_nameless = |name: &str| name.strip_prefix('c').unwrap_or(name).parse::<u8>().is_ok();
    if !survey.columns.iter().all(|c| is_nameless(&c.name)) {
        return None;
    }
    let moves = |c: &&SurveyedColumn| {
        Some(c.name.as_str()) != time && c.missing == 0 && c.range[0] < c.range[1]
    };
    let columns: Vec<&str> = survey
        .columns
        .iter()
        .filter(moves)
        .map(|c| c.name.as_str())
        .collect();
    let [first, second] = columns.as_slice() else {
        return None;
    };
    let mut sums = Sums::default();
    for log in logs {
        sums.add(log.values(first)?, log.values(second)?);
    }
    let [x, force] = match sums.first_is_displacement()? {
        true => [first, second],
        false => [second, first],
    };
    let roles = [("displacement", x), ("force", force)];
    Some(roles.map(|(role, column)| (role.into(), (*column).into())))
}

/// Sums over logs of two columns a and b, each about its mean.
#[derive(Default)]
struct Sums {
    products: [f64; 3],
    /// ∫ b·da and ∫ a·db, each with what it would be without a change of sign.
    work: [[f64; 2]; 2],
}

impl Sums {
    fn add(&mut self, a: &[f64], b: &[f64]) {
        let about_mean = |series: &[f64]| -> Vec<f64> {
            let mean = series.iter().sum::<f64>() / series.len() as f64;
            series.iter().map(|value| value - mean).collect()
        };
        let (a, b) = (about_mean(a), about_mean(b));
        for (a, b) in a.iter().zip(&b) {
            self.products[0] += a * a;
            self.products[1] += b * b;
            self.products[2] += a * b;
        }
        self.work = [
            with_work(self.work[0], &a, &b),
            with_work(self.work[1], &b, &a),
        ];
    }

    fn first_is_displacement(&self) -> Option<bool> {
        let correlation = self.products[2] / (self.products[0] * self.products[1]).sqrt();
        if correlation.abs() < PULLS_BACK {
            return None;
        }
        let taken_in = self
            .work
            .map(|[sum, size]| correlation.signum() * sum / size);
        match taken_in {
            [a, b] if a > LOSSY && b < 0.0 => Some(true),
            [a, b] if a < 0.0 && b > LOSSY => Some(false),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A spring beside a slider, to and fro.
    fn loops(sign: f64) -> (Vec<f64>, Vec<f64>) {
        let x: Vec<f64> = (0..2000).map(|i| (0.0125 * f64::from(i)).sin()).collect();
        let mut slider = 0.0_f64;
        let force = x.iter().map(|x| {
            slider = slider.clamp(x - 0.1, x + 0.1);
            sign * (5.0 + 3.0 * x + 10.0 * (x - slider))
        });
        let force = force.collect();
        (x, force)
    }

    fn told(a: &[f64], b: &[f64]) -> Option<bool> {
        let mut sums = Sums::default();
        sums.add(a, b);
        sums.first_is_displacement()
    }

    #[test]
    fn a_loop_tells_the_displacement_by_the_work_that_is_taken_in() {
        for sign in [1.0, -1.0] {
            let (x, force) = loops(sign);
            assert_eq!(told(&x, &force), Some(true));
            assert_eq!(told(&force, &x), Some(false));
        }
    }

    #[test]
    fn a_spring_and_a_pull_one_way_tell_nothing() {
        let (x, _) = loops(1.0);
        let spring: Vec<f64> = x.iter().map(|x| 3.0 * x + x.powi(3)).collect();
        assert_eq!(told(&x, &spring), None);
        let pull: Vec<f64> = (0..500).map(f64::from).collect();
        let softens: Vec<f64> = pull.iter().map(|x| x.sqrt()).collect();
        assert_eq!(told(&pull, &softens), None);
    }
}
