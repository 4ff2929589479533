//! The columns that an axis can be put together from, each way of doing so, and how well it
//! explains the force.

use super::pairs::{are_numbered, leave_out_still, number, own_first};
use super::parts::{DraftAxis, Log, UserChoices, factor};
use crate::study::AxisKind;
use crate::study::channels::integrate::{displacement_of, integral, lowest_frequency};
use crate::study::channels::units::Quantity;
use crate::study::check::kinematics::{Likeness, alike, derivative_likeness, joint_motion};
use crate::study::check::linear::{Fitted, Linear};
use crate::study::series::range;
use crate::study::survey::{Survey, SurveyedColumn};
use crate::text::error::{Error, Result};
use std::borrow::Cow;

/// Candidates for one part that are tried against the numbers.
const TRIED: usize = 4;
/// What explains more must lower what is left of the force to this part before it is believed in.
pub(super) const BETTER: f64 = 0.7;
/// An angle whose sine is no straight line, rad.
pub(super) const FAR: f64 = 1.0;
/// Correlation from which on a column is the derivative of another.
pub(super) const DERIVATIVE: f64 = 0.9;
/// Part of the work to and fro that a joint keeps, from which on it is no slip of the instruments.
pub(super) const LOSSY: f64 = 0.05;
/// From which part on most of something is: of the work of one sign, of what is explained.
const MOST_OF_IT: f64 = 0.5;
/// Part of its way that an axis gets on by, from which on it goes one way.
const ONE_WAY: f64 = 0.95;

/// The columns that may be each part of an axis, the likeliest first.
pub(super) struct Parts<'a> {
    /// Velocities or accelerations, where nothing else was logged.
    pub(super) displacement: Vec<&'a SurveyedColumn>,
    pub(super) velocity: Vec<&'a SurveyedColumn>,
    pub(super) acceleration: Vec<&'a SurveyedColumn>,
    pub(super) force: Vec<&'a SurveyedColumn>,
    /// Which derivative the columns of the displacement are: 1 a velocity, 2 an acceleration.
    pub(super) derivative: usize,
    /// Above which frequency accelerations are integrated, Hz.
    above_hz: f64,
    /// Whether the rows count no time.
    timeless: bool,
    /// Whether the user named the column of the acceleration.
    pub(super) names_acceleration: bool,
}

impl<'a> Parts<'a> {
    /// Whether a displacement and a force have numbers by which each belongs to another one.
    pub(super) fn are_of_others(&self, x: &SurveyedColumn, force: &SurveyedColumn) -> bool {
        match [number(&x.name), number(&force.name)] {
            [Some(x), Some(f)] => {
                x != f && are_numbered(&self.force, x) && are_numbered(&self.displacement, f)
            }
            _ => false,
        }
    }

    pub(super) fn of(
        survey: &'a Survey,
        time: Option<&str>,
        kind: AxisKind,
        said: &UserChoices,
        others: &[DraftAxis],
    ) -> Self {
        let free = |c: &&SurveyedColumn| {
            let taken = others
                .iter()
                .any(|axis| axis.columns().any(|name| name == c.name));
            Some(c.name.as_str()) != time && c.missing == 0 && c.rms > 0.0 && !taken
        };
        let list = |role: &str, quantity: Quantity| -> Vec<&SurveyedColumn> {
            if let Some(named) = said.column(role) {
                return survey.column(named).into_iter().collect();
            }
            let claimed = |c: &&SurveyedColumn| !said.columns.iter().any(|(_, n)| *n == c.name);
            let best = |c: &SurveyedColumn| c.named.quantities.iter().map(|(_, s)| *s).max();
            let mut found: Vec<&SurveyedColumn> = survey
                .columns
                .iter()
                .filter(free)
                .filter(claimed)
                .filter(|c| {
                    let score = c.named.score(quantity);
                    score > 0 && Some(score) == best(c) && (role == "force" || c.is_measured())
                })
                .collect();
            found.sort_by_key(|c| std::cmp::Reverse(c.named.score(quantity)));
            leave_out_still(&mut found, quantity);
            found
        };
        let mut force = list("force", Quantity::Force(kind));
        // What somebody says to turn is turned by a force at a lever where no torque was logged.
        if force.is_empty() && kind == AxisKind::Rotation && said.column("displacement").is_some() {
            force = list("force", Quantity::Force(AxisKind::Translation));
        }
        // Beside a torque, a position without a unit, or in counts, is an angle.
        let turned = kind == AxisKind::Rotation && !force.is_empty();
        let motion = |role: &str, quantity: fn(AxisKind) -> Quantity| {
            let mut found = list(role, quantity(kind));
            if found.is_empty() && turned {
                found = list(role, quantity(AxisKind::Translation));
                found.retain(|c| c.is_sizeless());
            }
            found
        };
        let mut displacement = motion("displacement", Quantity::Displacement);
        // A name such as `x_F` may be either, and a file may hold the force twice, alone and in a
        // matrix.
        if let (Some(force), None) = (force.first(), said.column("displacement")) {
            displacement.retain(|c| !is_copy(&c.values, &force.values));
        }
        displacement.truncate(TRIED);
        let mut velocity = motion("velocity", Quantity::Velocity);
        let mut acceleration = motion("acceleration", Quantity::Acceleration);
        for others in [&mut force, &mut velocity, &mut acceleration] {
            own_first(others, &displacement);
            others.truncate(TRIED);
        }
        let mut derivative = 0;
        let timeless = said.is_timeless(survey);
        for integrated in [&velocity, &acceleration] {
            if displacement.is_empty() && !timeless {
                displacement.clone_from(integrated);
                derivative += 1;
            }
        }
        Self {
            derivative,
            above_hz: 0.0,
            timeless,
            names_acceleration: said.column("acceleration").is_some(),
            displacement,
            velocity,
            acceleration,
            force,
        }
    }

    /// Keeps the columns that all logs have.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] where none is left for the force or the displacement, or
    /// a log lacks one that the user named.
    pub(super) fn keep_common(&mut self, logs: &[Log<'_>], said: &UserChoices) -> Result<()> {
        let first = logs[0].survey;
        let lists = [
            ("force", &mut self.force),
            ("displacement", &mut self.displacement),
            ("velocity", &mut self.velocity),
            ("acceleration", &mut self.acceleration),
        ];
        for (role, list) in lists {
            let needed = ["force", "displacement"].contains(&role) || said.column(role).is_some();
            let likeliest = list.first().copied();
            list.retain(|c| logs.iter().all(|log| log.values(&c.name).is_some()));
            let lacks = |name: &str| logs.iter().find(|log| log.values(name).is_none());
            if let (true, true, Some(column)) = (needed, list.is_empty(), likeliest)
                && let Some(log) = lacks(&column.name)
            {
                return Err(Error::data(format!(
                    "{} has no column {:?}, which {} has; give logs of one rig, or rename the column",
                    log.survey.file, column.name, first.file
                )));
            }
        }
        if let (2, Some(column)) = (self.derivative, self.displacement.first()) {
            let all = logs
                .iter()
                .filter_map(|log| lowest_frequency(log.values(&column.name)?, log.rate_hz));
            self.above_hz = rounded(all.fold(0.1 * logs[0].rate_hz, f64::min));
        }
        Ok(())
    }

    /// Whether the displacement is the integral of a velocity, which is the axis's own.
    pub(super) fn are_velocities(&self) -> bool {
        self.derivative == 1
    }

    /// Above which frequency the displacement is an acceleration integrated twice, Hz.
    pub(super) fn above_hz(&self) -> Option<f64> {
        (self.derivative == 2).then_some(self.above_hz)
    }

    /// What the columns of the displacement are.
    pub(super) fn logged(&self, kind: AxisKind) -> Quantity {
        match self.derivative {
            0 => Quantity::Displacement(kind),
            1 => Quantity::Velocity(kind),
            _ => Quantity::Acceleration(kind),
        }
    }
}

/// A frequency to two digits, rounded down.
fn rounded(hz: f64) -> f64 {
    let per_hz = 10_f64.powf(1.0 - hz.log10().floor());
    (hz * per_hz).floor() / per_hz
}

/// A way of putting an axis together, and how well it explains the force.
pub(super) struct Trial<'a> {
    pub(super) first: &'a SurveyedColumn,
    pub(super) second: Option<&'a SurveyedColumn>,
    pub(super) acceleration: Option<&'a SurveyedColumn>,
    /// The factor by which the acceleration follows the body's position, in SI.
    pub(super) likeness: Option<f64>,
    /// How closely it does, as a correlation; 0 without an accelerometer.
    pub(super) follows: f64,
    /// Whether the force is fitted by the weight of a body that turns, sin q and cos q, in the
    /// place of a spring.
    pub(super) weighs: bool,
    /// Force by acceleration, velocity, and displacement or its sine and cosine.
    pub(super) fitted: Fitted,
    /// The same with dry friction.
    pub(super) beside_friction: Option<Fitted>,
    /// The same without an inertia: where the motion has one frequency, a spring and a mass are
    /// one to the force.
    pub(super) without_inertia: Option<Fitted>,
    /// The mean force alone.
    pub(super) mean: Option<Fitted>,
    /// Work of the force along the displacement, and what it would be without a change of sign.
    pub(super) work: [f64; 2],
    /// Whether the axis goes one way in every log.
    one_way: bool,
}

impl Trial<'_> {
    /// What is positive where the force resists the motion: damping, work taken in, or stiffness,
    /// whatever tells most; 0 where that and the work contradict each other, as where a load is
    /// lifted.
    pub(super) fn resists(&self, fitted: &Fitted, timeless: bool) -> f64 {
        let [damping, stiffness] = [1, 2].map(|i| fitted.coefficients[i]);
        let tells = self.work[0].abs() > MOST_OF_IT * self.work[1];
        if fitted.sure(1) && !timeless {
            match tells && damping * self.work[0] < 0.0 {
                true => 0.0,
                false => damping,
            }
        } else if self.weighs {
            // The weight of a body pulls either way.
            self.fitted.coefficients[0]
        } else if self.work[0].abs() > LOSSY * self.work[1] {
            // What a joint takes in tells more than the slope of a wide loop.
            self.work[0]
        } else {
            stiffness
        }
    }

    /// Whether the position's zero lies outside its travel, as that of an absolute sensor does.
    pub(super) fn counts_from_elsewhere(&self) -> bool {
        let [least, most] = self.first.range;
        self.second.is_none() && least * most > 0.0
    }

    /// Whether a constant force stands beside the spring or the weight of the axis, or beside
    /// nothing that depends on place, which is larger than all that moves in the force. On one way,
    /// dry friction is one as well.
    pub(super) fn is_preloaded(&self, fitted: &Fitted, springy: bool) -> bool {
        let beside = (springy || self.weighs).then_some(fitted);
        !self.one_way
            && beside
                .or(self.mean.as_ref())
                .is_some_and(Fitted::stands_off)
    }

    /// Whether the axis goes one way in every log, at speeds that do not tell a damper from a
    /// constant force, as in a test that pulls once until something yields: only the path counts.
    pub(super) fn pulls_once(&self) -> bool {
        let fitted = self.without_inertia.as_ref().unwrap_or(&self.fitted);
        self.one_way && !self.shows_inertia() && !fitted.sure(1)
    }

    /// Whether an inertia shows, alone or beside friction, which hides it until it has a column of
    /// its own.
    pub(super) fn shows_inertia(&self) -> bool {
        let inertia = self.fitted.coefficients[0];
        // By its own position a body is accelerated against its joint: a mass of the other sign is
        // a stiffness that rises with frequency, where the joint is the surer and the larger part.
        let by_position = self.acceleration.is_none() && self.second.is_none();
        let fitted = &self.fitted;
        let mut of_joint = 1..fitted.shares.len();
        let is_joint = of_joint.any(|i| fitted.sure(i) && fitted.shares[i] > fitted.shares[0]);
        let stiffens = by_position && is_joint && inertia * self.resists(fitted, false) < 0.0;
        let beside = self.beside_friction.as_ref();
        let beside = beside.is_some_and(|f| f.sure(0) && f.coefficients[0] * inertia > 0.0);
        (self.fitted.sure(0) || beside) && !stiffens
    }
}

/// Every way of putting an axis together with a force.
pub(super) fn trials<'a>(
    logs: &[Log<'_>],
    parts: &Parts<'a>,
    force: &SurveyedColumn,
    kind: AxisKind,
) -> Vec<Trial<'a>> {
    let mut trials: Vec<Trial<'_>> = Vec::new();
    for first in &parts.displacement {
        let others = parts.displacement.iter();
        let others = others.filter(|c| c.name != first.name && !parts.are_velocities());
        let seconds = std::iter::once(None).chain(others.map(Some));
        let seconds =
            seconds.filter(|second| second.is_some() || !parts.are_of_others(first, force));
        for second in seconds {
            trials.extend(trial(logs, first, second.copied(), parts, force, kind));
        }
    }
    trials
}

/// Relative displacement of a trial in one log, SI.
pub(super) fn relative(
    log: &Log<'_>,
    first: &SurveyedColumn,
    second: Option<&SurveyedColumn>,
    (kind, parts): (AxisKind, &Parts<'_>),
) -> Option<Vec<f64>> {
    let si = |c: &SurveyedColumn| log.si(&c.name, parts.logged(kind));
    let mut values = si(first)?;
    if let Some(second) = second {
        for (a, b) in values.iter_mut().zip(si(second)?) {
            *a -= b;
        }
    }
    let period_s = 1.0 / log.rate_hz;
    Some(match parts.derivative {
        0 => values,
        1 => integral(&values, period_s),
        _ => displacement_of(&values, period_s, parts.above_hz),
    })
}

/// The accelerometer that follows a position best, and how it does.
pub(super) fn accelerometer<'a>(
    log: &Log<'_>,
    position: &[f64],
    parts: &Parts<'a>,
) -> Option<(&'a SurveyedColumn, Likeness)> {
    let all = parts.acceleration.iter().filter_map(|a| {
        let found = derivative_likeness(log.values(&a.name)?, position, 2, log.rate_hz);
        Some((*a, found))
    });
    all.max_by(|a, b| a.1.correlation.abs().total_cmp(&b.1.correlation.abs()))
}

/// Work that is done along a path and its size to and fro, beside those of other paths.
pub(super) fn with_work(before: [f64; 2], x: &[f64], f: &[f64]) -> [f64; 2] {
    let steps = x.windows(2).zip(f.windows(2));
    steps.fold(before, |[sum, size], (x, f)| {
        let done = f64::midpoint(f[0], f[1]) * (x[1] - x[0]);
        [sum + done, size + done.abs()]
    })
}

/// Fits force by acceleration, relative velocity and displacement over all logs; where an axis
/// turns far, by the weight of its body as well.
fn trial<'a>(
    logs: &[Log<'_>],
    first: &'a SurveyedColumn,
    second: Option<&'a SurveyedColumn>,
    parts: &Parts<'a>,
    force: &SurveyedColumn,
    kind: AxisKind,
) -> Option<Trial<'a>> {
    let kinds = (kind, parts);
    let position = relative(&logs[0], second.unwrap_or(first), None, kinds)?;
    let is_taken = second.is_none() || parts.names_acceleration;
    let best = accelerometer(&logs[0], &position, parts)
        .filter(|(_, l)| is_taken || l.correlation.abs() > DERIVATIVE);
    let acceleration = best.map(|(a, _)| a);
    // By a spring, and where it turns by the weight of a body, each alone and beside dry friction.
    // What is turned by hand, step by step, is a spring sooner than a pendulum.
    let may_weigh = kind == AxisKind::Rotation && parts.derivative == 0 && !parts.timeless;
    let fits_of = |columns| [Linear::new(columns), Linear::new(columns + 1)];
    let mut fits = vec![fits_of(3)];
    fits.extend(may_weigh.then(|| fits_of(4)));
    let (mut turns, mut work, mut one_way) = (0.0_f64, [0.0; 2], true);
    for log in logs {
        let x = relative(log, first, second, kinds)?;
        let of_body = match second {
            None => Cow::Borrowed(&x),
            Some(body) => Cow::Owned(relative(log, body, None, kinds)?),
        };
        let f = log.si(&force.name, Quantity::Force(kind))?;
        work = with_work(work, &x, &f);
        let logged = match acceleration {
            Some(a) => Some(log.si(&a.name, Quantity::Acceleration(kind))?),
            None => None,
        };
        let ([x, v, a], lag) = joint_motion(&x, &of_body, logged.as_deref(), log.rate_hz);
        let f = alike(&f, lag);
        one_way &= goes_one_way(&v);
        let each = |of: fn(f64) -> f64, series: &[f64]| -> Vec<f64> {
            series.iter().copied().map(of).collect()
        };
        let direction = each(f64::signum, &v);
        let weight = may_weigh.then(|| [f64::sin, f64::cos].map(|of| each(of, &x)));
        let mut held: Vec<Vec<&[f64]>> = vec![vec![&a, &v, &x]];
        held.extend(
            weight
                .iter()
                .map(|[sine, cosine]| -> Vec<&[f64]> { vec![&a, &v, sine, cosine] }),
        );
        for ([alone, beside], mut columns) in fits.iter_mut().zip(held) {
            alone.add(&columns, &f, 8);
            columns.push(&direction);
            beside.add(&columns, &f, 8);
        }
        turns = turns.max(range(&x));
    }
    let mut solved = fits.iter().map(solved);
    let mut spring = solved.next()?;
    let both = spring[0].take();
    spring[0] = both.map(|both| in_place_of_a_push(&fits[0][0], both, spring[2].as_ref()));
    let most = BETTER * spring[0].as_ref()?.rest;
    let weight = solved.next().filter(|[alone, _, _]| {
        turns > FAR && alone.as_ref().is_some_and(|weight| weight.rest < most)
    });
    let weighs = weight.is_some();
    let [fitted, beside_friction, without_inertia] = weight.unwrap_or(spring);
    Some(Trial {
        first,
        second,
        acceleration,
        follows: best.as_ref().map_or(0.0, |(_, l)| l.correlation.abs()),
        likeness: best
            .filter(|(_, l)| l.correlation.abs() > DERIVATIVE)
            .map(|(a, l)| l.gain * factor(a, Quantity::Acceleration(kind))),
        weighs,
        fitted: fitted?,
        beside_friction,
        without_inertia,
        mean: fits[0][0].solve_from(3),
        work,
        one_way,
    })
}

/// Whether a motion of these velocities gets on by most of its way.
fn goes_one_way(velocity: &[f64]) -> bool {
    let net: f64 = velocity.iter().sum();
    let way: f64 = velocity.iter().map(|v| v.abs()).sum();
    net.abs() > ONE_WAY * way
}

/// A fit with an inertia where the motion tells one, the same beside dry friction, and without an
/// inertia; at one speed, by the place alone.
fn solved([alone, beside]: &[Linear; 2]) -> [Option<Fitted>; 3] {
    let without = alone.solve_from(1).or_else(|| alone.solve_from(2));
    let fitted = alone.solve().or_else(|| without.clone());
    [fitted, beside.solve(), without]
}

/// The fit by a mass alone where a mass is not sure beside a spring, and the `spring` pushes along:
/// near one frequency that is what a mass does. Its acceleration is the noisier of the two, so that
/// it need not explain all that the spring does.
fn in_place_of_a_push(fits: &Linear, both: Fitted, spring: Option<&Fitted>) -> Fitted {
    let Some(spring) = spring.filter(|s| s.sure(2) && !both.sure(0)) else {
        return both;
    };
    let mass = fits.solve_without(2).filter(|mass| {
        let [inertia, damping] = [0, 1].map(|i| mass.coefficients[i]);
        let pushes = spring.coefficients[2] * damping < 0.0;
        let explains = 1.0 - mass.rest > MOST_OF_IT * (1.0 - spring.rest);
        pushes && explains && mass.sure(0) && mass.sure(1) && inertia * damping > 0.0
    });
    mass.unwrap_or(both)
}

/// Whether a series is another one times a factor.
fn is_copy(series: &[f64], of: &[f64]) -> bool {
    let [square, other, product] = series.iter().zip(of).fold([0.0; 3], |[a, b, c], (x, y)| {
        [a + x * x, b + y * y, c + x * y]
    });
    product * product > (1.0 - 1e-9) * square * other
}
