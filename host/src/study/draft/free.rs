//! The axis of a log in which nothing is applied, as in a free decay or on a shaken base.

use super::axis::{channel, kinds, name_of};
use super::decay::free_decays;
use super::nameless;
use super::parts::{DraftAxis, Log, UserChoices, factor};
use super::refused::{check_said, nothing_to_draft};
use super::stated::{VELOCITY, contradiction, keep_integrals};
use super::trial::{BETTER, DERIVATIVE, FAR, Parts, accelerometer, relative};
use super::velocity::velocity_of;
use crate::study::channels::units::Quantity;
use crate::study::check::kinematics::{alike, clear_lag, joint_motion, motion};
use crate::study::check::linear::{Fitted, Linear};
use crate::study::series::extent;
use crate::study::survey::SurveyedColumn;
use crate::study::{AxisKind, Convention};
use crate::text::error::Result;
use std::borrow::Cow;

/// The axis of the joint that accelerates a body by itself, and of every log the stretches in which
/// it does.
///
/// # Errors
/// A column that the user named wrongly, or no displacement that all logs have.
pub(super) fn free_axis(
    logs: &[Log<'_>],
    time: Option<&str>,
    said: &UserChoices,
    findings: &mut Vec<String>,
) -> Result<(DraftAxis, Vec<Vec<[usize; 2]>>)> {
    check_said(logs[0].survey, said)?;
    let mut said = Cow::Borrowed(said);
    let nameless = nameless::position(logs[0].survey, time, &said);
    if let Some((role, column)) = nameless.clone() {
        findings.push(format!(
            "column {column:?} has no name that says what it is, and nothing else changes in time, so it is taken for the displacement"
        ));
        said.to_mut().columns.push((role, column));
    }
    let said = &*said;
    let of_kind = |kind| (kind, Parts::of(logs[0].survey, time, kind, said, &[]));
    let mut all = kinds(logs[0].survey, time, said).map(of_kind).into_iter();
    let Some((kind, mut parts)) = all.find(|(_, p)| !p.displacement.is_empty()) else {
        return Err(nothing_to_draft(logs[0].survey, time, said));
    };
    parts.keep_common(logs, said)?;
    findings.extend(keep_integrals(logs, &mut parts, kind, said));
    let swings = swings(logs, &parts, kind, said);
    let Some(swing) = chosen(&swings) else {
        return Err(nothing_to_draft(logs[0].survey, time, said));
    };
    let mut axis = axis_of(logs, swing, &parts, kind, said, findings);
    for channel in &mut axis.displacement {
        channel.guessed |= nameless.is_some();
    }
    let quantity = parts.logged(kind);
    let stretches = logs.iter().map(|log| {
        let decays = match swing.is_on_shaken_base() {
            true => None,
            false => log.si(&swing.body.name, quantity).map(|x| free_decays(&x)),
        };
        decays.unwrap_or_else(|| vec![[0, log.survey.rows]])
    });
    let stretches: Vec<_> = stretches.collect();
    findings.extend(logs.iter().zip(&stretches).filter_map(let_go));
    Ok((axis, stretches))
}

/// Says where a body is let go, where that is not at the beginning of its log.
fn let_go((log, decays): (&Log<'_>, &Vec<[usize; 2]>)) -> Option<String> {
    let rows = log.survey.rows;
    (decays[..] != [[0, rows]]).then(|| {
        let each = decays.iter().map(|[from, to]| format!("[{from}, {to}]"));
        format!(
            "{}: the body moves freely in rows {}; what is outside is left out: there a hand moves it, or it rests",
            log.survey.file,
            each.collect::<Vec<_>>().join(", ")
        )
    })
}

/// A body and what it swings on.
struct Swing<'a> {
    body: &'a SurveyedColumn,
    /// What is shaken under the body, where that was logged.
    base: Option<&'a SurveyedColumn>,
    acceleration: Option<&'a SurveyedColumn>,
    /// −1 where the accelerometer counts against the body's position.
    sign: f64,
    /// Whether the acceleration is the second derivative of the body's position; else the position
    /// is one relative to a base that nobody logged.
    is_own: bool,
    /// The acceleration by velocity, displacement and direction; nothing where too few rows are
    /// there.
    fitted: Option<Fitted>,
}

impl Swing<'_> {
    fn is_on_shaken_base(&self) -> bool {
        self.base.is_some() || !self.is_own
    }

    /// By what the acceleration follows the displacement or, where no spring shows, the velocity.
    fn slope(&self) -> Option<f64> {
        let fitted = self.fitted.as_ref()?;
        let surest = [1, 0].into_iter().find(|&of| fitted.sure(of))?;
        Some(self.sign * fitted.coefficients[surest])
    }

    fn rest(&self) -> f64 {
        self.fitted.as_ref().map_or(f64::INFINITY, |f| f.rest)
    }
}

/// Every body that may swing, the likeliest on a base at rest first.
fn swings<'a>(
    logs: &[Log<'_>],
    parts: &Parts<'a>,
    kind: AxisKind,
    said: &UserChoices,
) -> Vec<Swing<'a>> {
    let kinds = (kind, parts);
    let mut swings = Vec::new();
    for body in &parts.displacement {
        let Some(position) = relative(&logs[0], body, None, kinds) else {
            continue;
        };
        let own = accelerometer(&logs[0], &position, parts);
        let own = own.filter(|(a, l)| {
            // Where units are stated the size has to be right as well.
            let stated = a.unit.is_some() && body.unit.is_some();
            let gain = (l.gain * factor(a, Quantity::Acceleration(kind))).abs();
            let of_size = (BETTER..BETTER.recip()).contains(&gain);
            let is_own = l.correlation.abs() > DERIVATIVE && (of_size || !stated);
            is_own && !is_between_two(&logs[0], &position, a, parts)
        });
        let sign = own.as_ref().map_or(1.0, |(_, l)| l.gain.signum());
        let own = own.map(|(a, _)| a);
        let others = parts.acceleration.iter().copied();
        let others = others.filter(|a| Some(&a.name) != own.map(|o| &o.name));
        // A column that the user named is the acceleration.
        let named = said.column("acceleration").is_some();
        let alone = (!named || own.is_some()).then_some((None, own, true));
        let on_unlogged = others.map(|a| (None, Some(a), false));
        let bases = parts.displacement.iter().copied();
        let bases = bases.filter(|c| c.name != body.name && !parts.are_velocities());
        let on_logged = bases
            .filter(|_| !named || own.is_some())
            .map(|base| (Some(base), own, true));
        let all = alone.into_iter().chain(on_unlogged).chain(on_logged);
        swings.extend(all.map(|(base, acceleration, is_own)| Swing {
            fitted: fitted(logs, (body, base), acceleration, kinds),
            body,
            base,
            acceleration,
            sign: if is_own { sign } else { 1.0 },
            is_own,
        }));
    }
    swings
}

/// Whether a position is one between two bodies whose accelerations were logged, one of them by
/// this column: its second derivative is then the difference of both. Near its resonance a body
/// moves so much more than what shakes it that its own acceleration all but does for that.
fn is_between_two(
    log: &Log<'_>,
    position: &[f64],
    one: &SurveyedColumn,
    parts: &Parts<'_>,
) -> bool {
    let lag = clear_lag(position).max(2);
    let [_, _, derived] = motion(position, lag, log.rate_hz);
    let averaged = |column: &SurveyedColumn| Some(alike(log.values(&column.name)?, lag));
    let others = parts.acceleration.iter().filter(|a| a.name != one.name);
    let mut fits = others.filter_map(|other| {
        let mut fit = Linear::new(2);
        fit.add(&[&averaged(one)?, &averaged(other)?], &derived, 8);
        Some((fit.solve()?, fit.solve_without(1)?))
    });
    fits.any(|(both, alone)| {
        let gain = both.coefficients[1] / both.coefficients[0];
        let differ = (BETTER..BETTER.recip()).contains(&-gain);
        both.sure(0) && both.sure(1) && differ && both.rest < BETTER * alone.rest
    })
}

/// The likeliest body on a base at rest, unless another one is explained clearly better.
fn chosen<'s, 'a>(swings: &'s [Swing<'a>]) -> Option<&'s Swing<'a>> {
    let first = swings.iter().find(|s| !s.is_on_shaken_base());
    let best = swings
        .iter()
        .filter(|s| s.is_on_shaken_base())
        // Between two bodies what is pushed is the one that is drawn back.
        .filter(|s| {
            s.slope()
                .is_some_and(|slope| s.base.is_none() || slope < 0.0)
        })
        .min_by(|a, b| a.rest().total_cmp(&b.rest()));
    match (first, best) {
        (Some(first), Some(best)) if best.rest() < BETTER * first.rest() => Some(best),
        (first, best) => first.or(best).or(swings.first()),
    }
}

/// Fits the acceleration of a body by relative velocity, displacement and direction over all logs.
fn fitted(
    logs: &[Log<'_>],
    (body, base): (&SurveyedColumn, Option<&SurveyedColumn>),
    acceleration: Option<&SurveyedColumn>,
    (kind, parts): (AxisKind, &Parts<'_>),
) -> Option<Fitted> {
    let mut fit = Linear::new(3);
    for log in logs {
        let x = relative(log, body, base, (kind, parts))?;
        let of_body = match base {
            None => Cow::Borrowed(&x),
            Some(_) => Cow::Owned(relative(log, body, None, (kind, parts))?),
        };
        let logged = match acceleration {
            Some(a) => Some(log.si(&a.name, Quantity::Acceleration(kind))?),
            None => None,
        };
        let ([x, v, a], _) = joint_motion(&x, &of_body, logged.as_deref(), log.rate_hz);
        let direction: Vec<f64> = v.iter().map(|v| v.signum()).collect();
        fit.add(&[&v, &x, &direction], &a, 8);
    }
    fit.solve()
}

/// Turns a body into an axis.
fn axis_of(
    logs: &[Log<'_>],
    swing: &Swing<'_>,
    parts: &Parts<'_>,
    kind: AxisKind,
    said: &UserChoices,
    findings: &mut Vec<String>,
) -> DraftAxis {
    let log = &logs[0];
    let mut channel = |column, quantity| channel(logs, column, quantity, said, findings);
    let acceleration = swing.acceleration.map(|a| {
        let mut found = channel(a, Quantity::Acceleration(kind));
        found.scale = swing.sign;
        found.guessed |= swing.sign < 0.0;
        found
    });
    // Of two columns the body's is subtracted.
    let (first, second) = match swing.base {
        Some(base) => (base, Some(swing.body)),
        None => (swing.body, None),
    };
    let velocity = velocity_of(log, parts, (first, second), kind, said);
    let velocity = velocity.map(|v| channel(v, Quantity::Velocity(kind)));
    let position = parts.logged(kind);
    let positions = std::iter::once(first).chain(second);
    let positions = positions.filter(|_| !parts.are_velocities());
    let displacement: Vec<_> = positions.map(|c| channel(c, position)).collect();
    let body_position = displacement.get(1).filter(|_| parts.derivative == 0);
    let body_position = body_position.cloned();
    let goes_far = |x: Vec<f64>| {
        let [low, high] = extent(x.into_iter());
        high - low > FAR
    };
    let turned = || relative(log, swing.body, None, (kind, parts));
    let weighs = kind == AxisKind::Rotation && turned().is_some_and(goes_far);
    findings.extend(shaken(swing));
    let pair = (first, second);
    findings.extend(contradiction(log, VELOCITY, pair, (kind, parts), said));
    if said.inertia.is_none() {
        findings.push(
            "nothing is applied, so every force is one per unit of inertia until you write the inertia in the place of 1".into(),
        );
    }
    DraftAxis {
        name: name_of(kind).into(),
        kind,
        displacement,
        integrate_above_hz: parts.above_hz(),
        velocity,
        body_position,
        acceleration,
        force: None,
        inertia: Some(said.inertia.unwrap_or(1.0)),
        inertia_seen: None,
        restoring_force: match second.is_some() || (!swing.is_own && swing.slope() > Some(0.0)) {
            true => Convention::InertiaMinusForce,
            false => Convention::ForceMinusInertia,
        },
        base: match (weighs, swing.is_on_shaken_base()) {
            (true, _) => vec!["gravity", "viscous"],
            (false, true) => vec!["stiffness", "viscous"],
            // Where a body rests its sensor need not read 0.
            (false, false) => vec!["stiffness", "viscous", "preload"],
        },
    }
}

/// What is said of a base that is shaken.
fn shaken(swing: &Swing<'_>) -> Option<String> {
    let body = &swing.body.name;
    match (swing.base, swing.acceleration) {
        (Some(base), _) => Some(format!(
            "a spring and a damper between {body:?} and {:?} explain the motion best, so the latter is a base that is shaken",
            base.name
        )),
        (None, Some(a)) if !swing.is_own => Some(format!(
            "{:?} is no second derivative of {body:?}, so it is taken for the acceleration of a body on a shaken base, which {body:?} is \
             measured from",
            a.name
        )),
        _ => None,
    }
}
