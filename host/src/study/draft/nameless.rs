//! Logs without a heading, or one that tells nothing: which of two or three columns is the
//! displacement, which the velocity and which the force.
//!
//! A joint takes in work, ∮ F·dx > 0 by the sign with which it pulls back; with the columns
//! exchanged it would give out as much, ∮ x·dF = −∮ F·dx. What does not come back to where it
//! began, or loses next to nothing, tells neither. Nor does it tell a driven body from a joint of
//! which one column is counted the other way; that the body moves more smoothly does.

use super::parts::{Log, UserChoices};
use super::trial::{BETTER, DERIVATIVE, LOSSY, with_work};
use crate::study::channels::naming::Named;
use crate::study::series::about_mean;
use crate::study::survey::{Survey, SurveyedColumn};

/// Correlation of displacement and force from which on the sign of the stiffness is told.
const PULLS_BACK: f64 = 0.3;

/// A body's motion is smoother than the force that drives it, and a joint's than its force, by more
/// than this factor where the two can be told apart.
const ROUGHER: f64 = 1.2;

/// The roles of a motion.
const MOTION: [&str; 3] = ["displacement", "velocity", "acceleration"];

/// The roles of columns that no names tell apart, as [`UserChoices`] has them: of two the
/// displacement and the force, of three the velocity as well. `None` where there are others, or
/// nothing tells.
pub(super) fn roles(
    logs: &[Log<'_>],
    time: Option<&str>,
    said: &UserChoices,
) -> Option<Vec<(String, String)>> {
    let survey = logs[0].survey;
    let timeless = said.is_timeless(survey);
    let columns = nameless(survey, time, said)?;
    let roles = match columns.as_slice() {
        [first, second] => {
            let mut sums = Sums::default();
            for log in logs {
                sums.add(log.values(first)?, log.values(second)?);
            }
            let [x, force] = match sums.first_is_displacement(timeless)? {
                true => [*first, *second],
                false => [*second, *first],
            };
            vec![("displacement", x), ("force", force)]
        }
        [_, _, _] if !timeless => {
            let [x, v] = derivative(logs, &columns)?;
            let force = columns.iter().find(|c| **c != x && **c != v)?;
            vec![("displacement", x), ("velocity", v), ("force", force)]
        }
        _ => return None,
    };
    let roles = roles.into_iter();
    Some(roles.map(|(role, c)| (role.into(), c.into())).collect())
}

/// The pair of columns of which the second is the derivative of the first; `None` where there is
/// none, or another one is nearly as much so.
fn derivative<'a>(logs: &[Log<'_>], columns: &[&'a str]) -> Option<[&'a str; 2]> {
    let likeness = |[a, b]: [&str; 2]| {
        let sums = logs.iter().try_fold([0.0; 3], |sums, log| {
            let (a, b) = (log.values(a)?, log.values(b)?);
            let slopes = a.windows(3).map(|w| w[2] - w[0]);
            let pairs = slopes.zip(b.iter().skip(1));
            Some(pairs.fold(sums, |[aa, bb, ab], (a, b)| {
                [aa + a * a, bb + b * b, ab + a * b]
            }))
        });
        sums.map_or(0.0, |[aa, bb, ab]: [f64; 3]| ab / (aa * bb).sqrt())
    };
    let pairs = columns
        .iter()
        .flat_map(|a| columns.iter().map(move |b| [*a, *b]));
    let pairs = pairs.filter(|[a, b]| a != b);
    let mut pairs: Vec<(f64, [&str; 2])> = pairs.map(|pair| (likeness(pair), pair)).collect();
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    let [(best, pair), (next, _), ..] = pairs.as_slice() else {
        return None;
    };
    (*best > DERIVATIVE && 1.0 - best < BETTER * (1.0 - next)).then_some(*pair)
}

/// The role of the only column that has no name, where nothing is applied: the position of what
/// swings.
pub(super) fn position(
    survey: &Survey,
    time: Option<&str>,
    said: &UserChoices,
) -> Option<(String, String)> {
    let moves = |c: &&SurveyedColumn| Some(c.name.as_str()) != time && c.range[0] < c.range[1];
    let mut moving = survey.columns.iter().filter(moves);
    let is_said = MOTION.iter().any(|role| said.column(role).is_some());
    let says_nothing = |c: &SurveyedColumn| c.missing == 0 && c.named == Named::default();
    let only = match (moving.next(), moving.next()) {
        // Whatever its name, as `sensor_data`, unless that says something else.
        (Some(c), None) if !is_said && says_nothing(c) => c.name.as_str(),
        _ => match nameless(survey, time, said)?.as_slice() {
            [only] => only,
            _ => return None,
        },
    };
    Some(("displacement".into(), only.into()))
}

/// The columns that change, beside that of the time, in a log whose names are numbers or say the
/// same of all, as x and y do; `None` where a name or the user says what one is.
fn nameless<'a>(
    survey: &'a Survey,
    time: Option<&str>,
    said: &UserChoices,
) -> Option<Vec<&'a str>> {
    let is_said = |role: &&str| said.column(role).is_some();
    if MOTION.iter().any(is_said) || (is_said(&"force") && !said.is_free(survey)) {
        return None;
    }
    let moves = |c: &&SurveyedColumn| {
        Some(c.name.as_str()) != time && c.missing == 0 && c.range[0] < c.range[1]
    };
    let is_nameless = |name: &str| name.strip_prefix('c').unwrap_or(name).parse::<u8>().is_ok();
    let nameless = survey.columns.iter().all(|c| is_nameless(&c.name));
    let mut says = survey.columns.iter().filter(moves);
    let first = says.next()?;
    let is_like =
        |c: &SurveyedColumn| c.unit == first.unit && c.named.quantities == first.named.quantities;
    let alike =
        !first.named.quantities.is_empty() && says.next().is_some_and(is_like) && says.all(is_like);
    if !nameless && !alike {
        return None;
    }
    let mut moving: Vec<&SurveyedColumn> = survey.columns.iter().filter(moves).collect();
    moving.retain(|c| c.is_measured());
    Some(moving.iter().map(|c| c.name.as_str()).collect())
}

/// Sums over logs of two columns a and b, each about its mean.
#[derive(Default)]
struct Sums {
    products: [f64; 3],
    /// Squares of the steps of either.
    steps: [f64; 2],
    /// ∫ b·da and ∫ a·db, each with what it would be without a change of sign.
    work: [[f64; 2]; 2],
}

impl Sums {
    fn add(&mut self, a: &[f64], b: &[f64]) {
        let (a, b) = (about_mean(a), about_mean(b));
        for (a, b) in a.iter().zip(&b) {
            self.products[0] += a * a;
            self.products[1] += b * b;
            self.products[2] += a * b;
        }
        for (sum, series) in self.steps.iter_mut().zip([&a, &b]) {
            *sum += series
                .windows(2)
                .map(|w| (w[1] - w[0]).powi(2))
                .sum::<f64>();
        }
        self.work = [
            with_work(self.work[0], &a, &b),
            with_work(self.work[1], &b, &a),
        ];
    }

    fn first_is_displacement(&self, timeless: bool) -> Option<bool> {
        let correlation = self.products[2] / (self.products[0] * self.products[1]).sqrt();
        if correlation.abs() < PULLS_BACK {
            return None;
        }
        let taken_in = self
            .work
            .map(|[sum, size]| correlation.signum() * sum / size);
        let first = match taken_in {
            [a, b] if a > LOSSY && b < 0.0 => true,
            [a, b] if a < 0.0 && b > LOSSY => false,
            _ => return None,
        };
        if correlation > 0.0 || timeless {
            return Some(first);
        }
        // What drives a body goes against its position, and takes in the same work by the other
        // sign.
        let squares = [self.products[0], self.products[1]];
        let [a, b] = [0, 1].map(|of| (self.steps[of] / squares[of]).sqrt());
        let (motion, force) = if first { (a, b) } else { (b, a) };
        match () {
            () if force > ROUGHER * motion => Some(first),
            () if motion > ROUGHER * force => Some(!first),
            () => None,
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

    fn told(a: &[f64], b: &[f64], timeless: bool) -> Option<bool> {
        let mut sums = Sums::default();
        sums.add(a, b);
        sums.first_is_displacement(timeless)
    }

    #[test]
    fn a_loop_tells_the_displacement_by_the_work_that_is_taken_in() {
        for sign in [1.0, -1.0] {
            let (x, force) = loops(sign);
            assert_eq!(told(&x, &force, true), Some(true));
            assert_eq!(told(&force, &x, true), Some(false));
            // A body that is driven near one frequency would look like the contrary.
            let is_plain = sign > 0.0;
            assert_eq!(told(&x, &force, false), is_plain.then_some(true));
            assert_eq!(told(&force, &x, false), is_plain.then_some(false));
        }
    }

    #[test]
    fn what_drives_a_body_is_rougher_than_its_motion() {
        // A sweep of the force on a mass and a damper.
        let (mut position, mut speed) = (0.0, 0.0);
        let rows = (0..4000).map(|row| {
            let t = 0.01 * f64::from(row);
            let force = (2.0 * t + 0.2 * t * t).cos();
            speed += 0.01 * (force - 0.5 * speed);
            position += 0.01 * speed;
            (position, force)
        });
        let (x, force): (Vec<f64>, Vec<f64>) = rows.unzip();
        assert_eq!(told(&x, &force, false), Some(true));
        assert_eq!(told(&force, &x, false), Some(false));
    }

    #[test]
    fn a_spring_and_a_pull_one_way_tell_nothing() {
        let (x, _) = loops(1.0);
        let spring: Vec<f64> = x.iter().map(|x| 3.0 * x + x.powi(3)).collect();
        assert_eq!(told(&x, &spring, true), None);
        let pull: Vec<f64> = (0..500).map(f64::from).collect();
        let softens: Vec<f64> = pull.iter().map(|x| x.sqrt()).collect();
        assert_eq!(told(&pull, &softens, true), None);
    }
}
