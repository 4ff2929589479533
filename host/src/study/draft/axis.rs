//! The axes of a draft: which columns belong together, and which way round the equation of motion
//! stands.

use super::parts::{DraftAxis, DraftChannel, Log, UserChoices, at_a_lever};
use super::refused::{check_said, nothing_to_draft};
use super::stand_in::{is_current, stand_in};
use super::stated::{contradictions, keep_integrals};
use super::trial::{BETTER, Parts, Trial, trials};
use super::velocity::{of_a_count, size_of_a_count, velocity_of};
use crate::study::channels::units::{Quantity, is_bare};
use crate::study::check::linear::Fitted;
use crate::study::survey::{Survey, SurveyedColumn};
use crate::study::{AxisKind, Convention};
use crate::text::error::{Error, Result};

/// The axes that the columns of the first log make, tried against all logs.
pub(super) fn axes(
    logs: &[Log<'_>],
    time: Option<&str>,
    said: &UserChoices,
    findings: &mut Vec<String>,
) -> Result<Vec<DraftAxis>> {
    let survey = logs[0].survey;
    check_said(survey, said)?;
    let mut axes = Vec::new();
    for kind in kinds(survey, time, said) {
        let mut parts = Parts::of(survey, time, kind, said, &axes);
        if parts.force.is_empty() || parts.displacement.is_empty() {
            continue;
        }
        parts.keep_common(logs, said)?;
        findings.extend(keep_integrals(logs, &mut parts, kind, said));
        axes.push(best_axis(logs, &parts, kind, said, findings)?);
        // Names that the user gave are those of one axis.
        if !said.columns.is_empty() {
            break;
        }
    }
    if !axes.is_empty() {
        return Ok(axes);
    }
    let Some(stand_in) = stand_in(logs, time, said) else {
        return Err(nothing_to_draft(survey, time, said));
    };
    let mut with_roles = said.clone();
    with_roles.columns.extend(stand_in.roles.iter().cloned());
    let mut axes = self::axes(logs, time, &with_roles, findings)?;
    findings.push(stand_in.why);
    let is_guessed = |channel: &DraftChannel| {
        let mut roles = stand_in.roles.iter();
        roles.any(|(_, column)| *column == channel.column)
    };
    for axis in &mut axes {
        let channels = axis.displacement.iter_mut().chain(&mut axis.velocity);
        for channel in channels.chain(&mut axis.force) {
            channel.guessed |= is_guessed(channel);
        }
    }
    Ok(axes)
}

/// Translation first, unless a column that the user named turns, or the only position is an angle:
/// that of a motor with a current in place of a force is one where it states no unit.
pub(super) fn kinds(survey: &Survey, time: Option<&str>, said: &UserChoices) -> [AxisKind; 2] {
    use AxisKind::{Rotation, Translation};
    let turns = |role: &str, quantity: &dyn Fn(AxisKind) -> Quantity| {
        let column = said.column(role).and_then(|name| survey.column(name));
        column.is_some_and(|c| {
            c.named.score(quantity(Rotation)) > c.named.score(quantity(Translation))
        })
    };
    let turns = turns("displacement", &Quantity::Displacement)
        || turns("velocity", &Quantity::Velocity)
        || turns("acceleration", &Quantity::Acceleration)
        || turns("force", &Quantity::Force);
    let integrated = |kind| {
        let parts = Parts::of(survey, time, kind, said, &[]);
        parts.derivative > 0 || parts.displacement.is_empty()
    };
    let force = said.column("force").and_then(|name| survey.column(name));
    let of_motor = |c: &&SurveyedColumn| c.is_sizeless() && c.named.position;
    let positions = || Parts::of(survey, time, Translation, said, &[]).displacement;
    let turns = turns || force.is_some_and(is_current) && positions().first().is_some_and(of_motor);
    match turns || (integrated(Translation) && !integrated(Rotation)) {
        true => [Rotation, Translation],
        false => [Translation, Rotation],
    }
}

fn best_axis(
    logs: &[Log<'_>],
    parts: &Parts<'_>,
    kind: AxisKind,
    said: &UserChoices,
    findings: &mut Vec<String>,
) -> Result<DraftAxis> {
    // Of columns that may as well be the force by their names, the one that the motion explains
    // best.
    let score = |c: &SurveyedColumn| c.named.score(Quantity::Force(kind));
    let likely = parts.force.iter().copied();
    let likely = likely.filter(|c| score(c) == score(parts.force[0]));
    let likely: Vec<&SurveyedColumn> = likely.collect();
    let rivals = likely
        .iter()
        .map(|force| (*force, trials(logs, parts, force, kind)));
    let least = |(_, trials): &(&SurveyedColumn, Vec<Trial<'_>>)| {
        let rests = trials.iter().map(|t| t.fitted.rest);
        rests.fold(f64::INFINITY, f64::min)
    };
    let best = rivals.min_by(|a, b| least(a).total_cmp(&least(b)));
    let (force, trials) = best.unwrap_or((parts.force[0], Vec::new()));
    if let [_, _, ..] = likely.as_slice() {
        let all: Vec<String> = likely.iter().map(|c| format!("{:?}", c.name)).collect();
        let first = parts.displacement[0];
        let others = match likely.iter().any(|f| parts.are_of_others(first, f)) {
            true => "the displacement has its number; the others are other axes or runs",
            false => "where several act on the body, write all of them as a list",
        };
        findings.push(format!(
            "of {} the motion explains {:?} best, so that is the force; {others}",
            all.join(", "),
            force.name
        ));
    }
    let singles = trials
        .iter()
        .filter(|t| t.second.is_none())
        .map(|t| t.fitted.rest);
    let single = singles.fold(f64::INFINITY, f64::min);
    // Two orders of a pair are one fit with the signs turned: the body is what the accelerometer
    // follows closer.
    let pairs = trials.iter().filter(|t| t.second.is_some());
    let best_pair = pairs
        .clone()
        .min_by(|a, b| a.fitted.rest.total_cmp(&b.fitted.rest));
    let best_pair = best_pair.and_then(|best| {
        let turned = |t: &&Trial<'_>| {
            let same = |a: &SurveyedColumn, b: Option<&SurveyedColumn>| {
                Some(&a.name) == b.map(|b| &b.name)
            };
            same(t.first, best.second) && same(best.first, t.second) && t.follows > best.follows
        };
        pairs.clone().find(turned).or(Some(best))
    });
    let pair = best_pair.is_some_and(|t| t.fitted.rest < BETTER * single);
    // The likeliest name comes first: another single column must explain clearly more.
    let mut likeliest = trials.iter().filter(|t| t.second.is_none());
    let chosen = match pair {
        true => best_pair,
        false => likeliest.find(|t| BETTER * t.fitted.rest <= single),
    };
    let Some(chosen) = chosen else {
        return Err(Error::data(format!(
            "{}: the columns {:?} and {:?} do not go together as displacement and force, or too few rows are there; name the \
             columns with --column displacement=… and --column force=…",
            logs[0].survey.file, parts.displacement[0].name, force.name
        )));
    };
    let mut axis = axis_of(logs, chosen, parts, force, kind, said, findings);
    if let Some(other) = another_side(chosen, parts, force, kind, said) {
        axis.displacement[0].guessed = true;
        findings.push(format!(
            "of {:?} and {:?} the first alone is taken as the displacement; where the joint lies between the two, write displacement = [{:?}, \
             {:?}], the far side first",
            chosen.first.name, other.name, other.name, chosen.first.name
        ));
    }
    Ok(axis)
}

/// A position that is as surely one by its name as the one that was chosen alone, in the same unit.
fn another_side<'a>(
    chosen: &Trial<'_>,
    parts: &Parts<'a>,
    force: &SurveyedColumn,
    kind: AxisKind,
    said: &UserChoices,
) -> Option<&'a SurveyedColumn> {
    let alone = chosen.second.is_none() && parts.derivative == 0;
    if !alone || said.column("displacement").is_some() {
        return None;
    }
    let score = |c: &SurveyedColumn| c.named.score(Quantity::Displacement(kind));
    let first = chosen.first;
    let mut others = parts.displacement.iter().copied();
    others.find(|c| {
        let is_like = c.unit == first.unit && score(c) == score(first);
        c.name != first.name && is_like && !parts.are_of_others(c, force)
    })
}

/// A column as study.toml will have it; what its numbers are taken for where no log says so is a
/// finding.
pub(super) fn channel(
    logs: &[Log<'_>],
    column: &SurveyedColumn,
    quantity: Quantity,
    said: &UserChoices,
    findings: &mut Vec<String>,
) -> DraftChannel {
    let named = said.columns.iter().any(|(_, name)| *name == column.name);
    let units: Vec<Option<&str>> = logs
        .iter()
        .filter_map(|log| log.survey.column(&column.name))
        .map(|c| c.unit.as_deref())
        .collect();
    let lever = at_a_lever(column, quantity);
    let is_usable = |unit: &str| quantity.factor(unit, true).is_ok();
    let unknown = units.iter().copied().flatten().find(|u| !is_usable(u));
    let differ = units.iter().any(|unit| *unit != units[0]);
    let unit = match unknown {
        _ if lever.is_some() => {
            findings.push(format!(
                "column {:?} is a force, which turns the axis by a lever: its arm is taken for 1 m until you multiply the scale by the arm \
                 in metres, {{ column = {:?}, unit = \"N*m\", scale = ARM }}",
                column.name, column.name
            ));
            quantity.si_unit().map(str::to_owned)
        }
        Some(unit) => {
            findings.push(format!(
                "column {:?} is in {unit:?}, which is no unit of it that is known here, so its numbers are taken for {} until you write \
                 the unit, or how many of these one is as its scale",
                column.name,
                quantity.si()
            ));
            quantity.si_unit().map(str::to_owned)
        }
        // Each log then says its own.
        None if differ => {
            let each: Vec<&str> = units.iter().map(|u| u.unwrap_or("no unit")).collect();
            findings.push(format!(
                "column {:?} is in {} from log to log, each read in its own",
                column.name,
                each.join(", ")
            ));
            None
        }
        None => {
            if column.unit.is_none() && quantity != Quantity::Input {
                findings.push(format!(
                    "column {:?} states no unit, so its numbers are taken for {}",
                    column.name,
                    quantity.si()
                ));
            }
            column.unit.clone()
        }
    };
    // Volts and counts have a size that nobody has stated.
    let bare = unit.as_deref().is_some_and(is_bare);
    DraftChannel {
        column: column.name.clone(),
        guessed: !named && column.named.score(quantity) < 2 || bare || unknown.is_some() || differ,
        unit,
        scale: lever.unwrap_or(1.0),
        sign_bit: logs
            .iter()
            .filter_map(|log| log.survey.column(&column.name))
            .find_map(|c| c.sign_bit),
    }
}

/// Turns the sign of the force or of the accelerometer, one of which counts the other way where a
/// body's mass comes out negative; gives −1 when it was the force's.
fn turn_a_sign(
    chosen: &Trial<'_>,
    force: &mut DraftChannel,
    acceleration: Option<&mut DraftChannel>,
    findings: &mut Vec<String>,
) -> f64 {
    if let (Some(acceleration), Some(gain)) = (acceleration, chosen.likeness)
        && gain < 0.0
    {
        acceleration.scale = -1.0;
        acceleration.guessed = true;
        findings.push(format!(
            "column {:?} counts against the second derivative of {:?} and against the force, so its sign was turned",
            acceleration.column,
            chosen.second.unwrap_or(chosen.first).name
        ));
        return 1.0;
    }
    force.scale = -force.scale;
    force.guessed = true;
    findings.push(format!(
        "column {:?} pushes against the acceleration, which a mass does not, so its sign was turned",
        force.column
    ));
    -1.0
}

/// The terms of the base that the trial speaks for; of a position that counts from elsewhere the
/// spring's force at its zero is no force of the joint's middle.
fn base_of(
    chosen: &Trial<'_>,
    fitted: &Fitted,
    springy: bool,
    path_alone: bool,
) -> Vec<&'static str> {
    let mut base = Vec::new();
    if chosen.weighs {
        base.push("gravity");
    } else if springy {
        base.push("stiffness");
    }
    let from_elsewhere = springy && chosen.counts_from_elsewhere();
    if from_elsewhere || chosen.is_preloaded(fitted, springy) {
        base.push("preload");
    }
    if !path_alone {
        base.push("viscous");
    } else if base.is_empty() {
        // The one term of the usual base that needs no speed.
        base.push("stiffness");
    }
    base
}

/// Turns the chosen trial into an axis: signs, inertia, base.
fn axis_of(
    logs: &[Log<'_>],
    chosen: &Trial<'_>,
    parts: &Parts<'_>,
    force: &SurveyedColumn,
    kind: AxisKind,
    said: &UserChoices,
    findings: &mut Vec<String>,
) -> DraftAxis {
    let position = parts.logged(kind);
    let mut channel = |column, quantity| channel(logs, column, quantity, said, findings);
    let mut force_channel = channel(force, Quantity::Force(kind));
    let accelerometer = Quantity::Acceleration(kind);
    let mut acceleration = chosen.acceleration.map(|a| channel(a, accelerometer));
    let count = size_of_a_count(&logs[0], parts, chosen, kind);
    let velocity = velocity_of(&logs[0], parts, (chosen.first, chosen.second), kind, said);
    let velocity = velocity.or(count.map(|(_, velocity)| velocity));
    let velocity = velocity.map(|v| channel(v, Quantity::Velocity(kind)));
    let positions = std::iter::once(chosen.first).chain(chosen.second);
    let positions = positions.filter(|_| !parts.are_velocities());
    let mut displacement: Vec<DraftChannel> = positions.map(|c| channel(c, position)).collect();
    if let Some((size, velocity)) = count {
        displacement.iter_mut().for_each(|c| c.scale = size);
        findings.push(of_a_count(chosen.first, size, velocity, kind));
    }
    let pair = (chosen.first, chosen.second);
    findings.extend(contradictions(&logs[0], pair, (kind, parts), said));
    let body_position = displacement.get(1).filter(|_| parts.derivative == 0);
    let body_position = body_position.cloned();
    let timeless = said.is_timeless(logs[0].survey);
    let inertial = !timeless && chosen.shows_inertia();
    let path_alone = timeless || chosen.pulls_once();
    let fitted = match inertial {
        true => &chosen.fitted,
        false => chosen.without_inertia.as_ref().unwrap_or(&chosen.fitted),
    };
    let mut resists = chosen.resists(fitted, path_alone);
    let [mut inertia, _, mut stiffness] = [0, 1, 2].map(|i| fitted.coefficients[i]);
    if inertial && inertia < 0.0 {
        let turned = turn_a_sign(chosen, &mut force_channel, acceleration.as_mut(), findings);
        [resists, stiffness] = [resists, stiffness].map(|c| turned * c);
        inertia = -inertia;
    }
    inertia /= count.map_or(1.0, |(size, _)| size);
    // Where an accelerometer shows that a single displacement is the body's own, a joint that seems
    // to push is one whose channels are late against each other.
    let is_body = inertial && chosen.second.is_none() && chosen.likeness.is_some();
    let restoring_force = match resists < 0.0 && !is_body {
        true => Convention::InertiaMinusForce,
        false => Convention::ForceMinusInertia,
    };
    let pulls_back = restoring_force.sign() * stiffness > 0.0 && fitted.sure(2);
    let springy = pulls_back && !parts.are_velocities();
    findings.extend(chosen.weighs.then(|| as_a_weight(force)));
    if said.inertia.is_none() && !inertial {
        findings.push(format!(
            "no inertia shows in {:?}, so the force is taken as the restoring force itself",
            force.name
        ));
    }
    findings.extend(unit_to_replace(force, kind));
    DraftAxis {
        name: name_of(kind).into(),
        kind,
        displacement,
        integrate_above_hz: parts.above_hz(),
        velocity,
        body_position,
        acceleration: acceleration
            .filter(|_| inertial || said.inertia.is_some() || parts.names_acceleration),
        force: Some(force_channel),
        inertia: said.inertia.or((!inertial).then_some(0.0)),
        inertia_seen: inertial.then_some(inertia),
        restoring_force,
        base: base_of(chosen, fitted, springy, path_alone),
    }
}

/// What an axis is called unless the user says otherwise.
pub(super) fn name_of(kind: AxisKind) -> &'static str {
    match kind {
        AxisKind::Translation => "x",
        AxisKind::Rotation => "phi",
    }
}

fn as_a_weight(force: &SurveyedColumn) -> String {
    format!(
        "{:?} goes with the sine of the angle, as the weight of a body that turns does",
        force.name
    )
}

/// What to write where the force has a unit that is none of a force.
fn unit_to_replace(force: &SurveyedColumn, kind: AxisKind) -> Option<String> {
    let unit = force.unit.as_deref().filter(|unit| is_bare(unit))?;
    let constant = match unit {
        "A" | "mA" => " (of a motor, its torque or force constant)",
        _ => "",
    };
    Some(format!(
        "column {:?} is in {unit}, so forces are in {unit} too until you write how many {} one is{constant} as its scale",
        force.name,
        Quantity::Force(kind).si()
    ))
}
