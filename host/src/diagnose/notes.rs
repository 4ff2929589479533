//! What is to be said beside the verdict, one sentence each.

use super::answer::Absorbed;
use super::criteria;
use super::decide::Decision;
use super::errors::{constants, strongest_line};
use super::learner::Knows;
use super::search::bench::moving;
use super::search::{Refuted, Search};
use crate::assess::noise_floor::Floor;
use crate::fit::coverage;
use crate::fit::effects::columns::Records;
use crate::model::effects::AxisEffect;
use crate::model::file::{JudgedOn, ModelFile};
use crate::signal::motion::{Filters, Motion};
use crate::signal::standstill;
use crate::study::Study;
use crate::study::series::rms;
use crate::text::table::rounded;
use jointwatch_shared::base::followed::Follows;

/// A sentence for every axis whose noise was not seen at rest.
pub(super) fn never_rests(study: &Study, floors: &[Floor]) -> Vec<String> {
    let axes = study.axes.iter().zip(floors);
    let axes = axes.filter(|(_, floor)| !floor.at_rest);
    axes.map(|(axis, _)| {
        let from = match study.quasi_static {
            true => "how neighbouring rows differ",
            false => "high frequencies",
        };
        format!(
            "axis {} rests for too short in every record to show its noise, so its noise floor is taken from {from} and may be too low",
            axis.name
        )
    })
    .collect()
}

/// What the motion of the training records leaves open, in a sentence each.
pub(super) fn of_motion(study: &Study, training: &[&Motion], filters: &Filters) -> Vec<String> {
    let still = standstill::in_words(study, filters.state_band_hz, filters.half_length());
    let confounded = coverage::confounded(&study.axes, training).into_iter();
    confounded.chain(still).collect()
}

/// What a polynomial or a network makes of an effect already, in a sentence.
pub(super) fn follows_already(model: &ModelFile, absorbed: &Absorbed) -> String {
    format!(
        "the {} already reproduces {:.0} % of {}@{}",
        model.base.name(),
        100.0 * absorbed.share,
        absorbed.effect,
        absorbed.axis
    )
}

/// What an effect that was found makes worse, in a sentence each.
pub(super) fn refutations(search: &Search, names: &[&str], on: JudgedOn) -> Vec<String> {
    let percent = |log_power: f64| 100.0 * (0.5 * log_power).exp_m1();
    let sentence = |refuted: &Refuted| {
        let name = refuted.bound.name(names);
        let Some([mean, error]) = refuted.rise else {
            return format!(
                "{name} explains axis {} alone, and has next to no force when everything is solved for together, so it is not added",
                names[refuted.axis]
            );
        };
        let (judged, axis) = (on.words(), names[refuted.axis]);
        let (change, error) = (percent(mean).abs(), percent(error));
        if mean < 0.0 {
            return format!(
                "{name} explains the training records by more than its gain on the {judged} bears out: there the error of axis {axis} is \
                 {change:.1} % smaller with it, and the standard error of the blocks is {error:.1} %, so it is not added"
            );
        }
        format!(
            "{name} explains the training records better, but on the {judged} the error of axis {axis} is {change:.1} % larger with it \
             (standard error of the blocks {error:.1} %), so it is not added"
        )
    };
    search.refuted.iter().map(sentence).collect()
}

/// The part of a force's power in one line of its spectrum from which on it is told as periodic.
const MOST_OF_IT: f64 = 0.5;

/// A relative error that is told though nothing explains it: a quarter, as that without a name is
/// of what has one.
const MUCH: f64 = 0.25;

/// Part of its size under which an inertia has all but gone.
const LOST: f64 = 0.5;

/// What is to be said beside the verdict.
pub(super) fn in_notes(
    search: &Search,
    (study, learnt): (&Study, &Records<'_>),
    (unmeasured, floors): (&[f64], &[Floor]),
    names: &[&str],
) -> Vec<String> {
    let mut notes = Vec::new();
    for bound in &search.found {
        if let Some(follows) = bound.input.map(Follows::parse)
            && follows.lag_s > 0.0
        {
            notes.push(format!(
                "{}: the force follows {} behind a lag of about {:.0} ms",
                bound.name(names),
                follows.name,
                1e3 * follows.lag_s
            ));
        }
        notes.extend(of_two_values(bound, learnt, names));
    }
    for (axis, zeros) in search.zeros.iter().enumerate() {
        if let Some(zeros) = zeros {
            let does = match (zeros.drift(), zeros.stand()) {
                (false, true) => "differs by {} from record to record",
                (false, false) => {
                    "differs by {} from record to record, and drifts as much within them, so no zero per record mends it"
                }
                (true, _) => "drifts by {} (RMS) along the records",
            };
            let unit = study.axes[axis].kind.force_unit();
            let does = does.replace("{}", &format!("{} {unit}", rounded(zeros.size())));
            notes.push(format!("axis {}: the zero of force {does}", names[axis]));
        }
    }
    notes.extend(of_lost_inertia(search, (study, learnt)));
    for decision in &search.decisions {
        let axis = names[decision.axis];
        notes.extend(of_pieces(decision, names));
        let unnamed = decision.unnamed();
        if unnamed > 0.0 {
            let follows = decision.follows.map_or("the motion", Knows::in_words);
            notes.push(format!(
                "axis {axis}: of the relative error {:.4} that is left, a learner without physics takes away {:.0} % of the power: it \
                 follows {follows}",
                decision.errors[1],
                100.0 * (unnamed / decision.taken.power[0].max(f64::MIN_POSITIVE)).min(1.0)
            ));
        } else if unmeasured[decision.axis] > 0.0 {
            let refuted = search.refuted_on(decision.axis);
            notes.push(match (refuted, floors[decision.axis].follows_motion) {
                (Some(refuted), _) => format!(
                    "axis {axis}: what is left stands above the noise of the sensors. {} may act in one part of the records, which the others \
                     cannot confirm, or the joint changes with something that nobody measures: record the motion of that part again",
                    refuted.bound.name(names)
                ),
                (None, true) => format!(
                    "axis {axis}: what is left stands above the noise of the sensors and is larger where the axis moves more, but follows \
                     neither place, speed nor past: the joint changes with something that nobody measures"
                ),
                (None, false) => of_a_force(search, learnt, decision.axis, axis),
            });
        } else if decision.left > MUCH && !floors[decision.axis].at_rest {
            notes.push(format!(
                "axis {axis}: relative error {:.2} is left, which neither an effect nor the motion explains; the axis rests in no record, so \
                 nothing tells whether it is noise or a force that nobody measures: look at the log, and record at rest as well",
                decision.left
            ));
        }
    }
    notes
}

/// That an effect follows an input of which the records say no more than that there are two kinds
/// of them, where it does.
fn of_two_values(bound: &AxisEffect, learnt: &Records<'_>, names: &[&str]) -> Option<String> {
    let name = Follows::parse(bound.input?).name;
    let mut values = learnt.standing(name)?;
    values.sort_by(f64::total_cmp);
    values.dedup();
    (values.len() == 2).then(|| {
        format!(
            "{}: {name} stands still in every training record and has two values in all, so whatever else differs between those records \
             may act in its place: log runs at a third value",
            bound.name(names)
        )
    })
}

/// That the inertia of an axis all but goes where effects are found, on every axis where it does. A
/// drive that answers the motion, as one that pushes along the velocity does, makes a force that
/// looks like friction, and beside it nothing is left for the inertia.
fn of_lost_inertia(search: &Search, (study, learnt): (&Study, &Records<'_>)) -> Vec<String> {
    let inertia = |model: &super::search::Model| model.solution.in_si(&model.terms, &study.axes).1;
    let pairs = inertia(&search.first)
        .into_iter()
        .zip(inertia(&search.last));
    let axes = study.axes.iter().zip(pairs).enumerate();
    let lost = axes.filter(|(at, (_, (before, after)))| {
        // Of an inertia that hardly shows nothing is lost.
        let shows = |acceleration: &Vec<f64>| {
            before * rms(acceleration) > criteria::LEAST_SHARE * learnt.references.force[*at]
        };
        learnt.accelerations[*at].as_ref().is_some_and(shows) && *after < LOST * before
    });
    lost.map(|(_, (axis, (before, after)))| {
        format!(
            "axis {}: the inertia falls from {} to {} {} beside what was found, so that may be how the drive answers the motion and not \
             how the joint resists it: state the inertia in study.toml",
            axis.name,
            rounded(before),
            rounded(after),
            axis.kind.inertia_unit()
        )
    })
    .collect()
}

/// That effects may be pieces of a shape without a name, where they may.
fn of_pieces(decision: &Decision, names: &[&str]) -> Option<String> {
    let (axis, pieces) = (names[decision.axis], pieces(decision, names));
    if let Some(curve) = &decision.curve {
        let of_curve: Vec<String> = curve.pieces.iter().map(|b| b.name(names)).collect();
        return Some(format!(
            "axis {axis}: a smooth function of {} without a law predicts as well as {}: they may be pieces of one shape that is no law here",
            curve.of,
            of_curve.join(" + ")
        ));
    }
    (!pieces.is_empty()).then(|| {
        format!(
            "axis {axis}: {} explains little more than what is left without a name: it may be a piece of a shape that is no law here",
            pieces.join(" + ")
        )
    })
}

/// That a force that nobody measures acts on an axis, and at which frequency where it has one.
fn of_a_force(search: &Search, learnt: &Records<'_>, axis: usize, name: &str) -> String {
    let model = (&*search.last.terms, &search.last.solution.solved);
    let line = strongest_line(learnt, model, axis);
    let line = line.filter(|(_, share)| *share > MOST_OF_IT);
    let line = line.map_or(String::new(), |(hz, share)| {
        format!(
            ", {:.0} % of its power at {} Hz",
            100.0 * share,
            rounded(hz)
        )
    });
    format!(
        "axis {name}: what is left stands above the noise of the sensors and follows no motion: a force that nobody measures acts there{line}, \
         unless a column drives the joint that study.toml does not name, as a pressure or a coil's current does: name it with [[input]]"
    )
}

/// A sentence for every validation record in which the error of an axis is mostly a constant.
pub(super) fn of_constants(
    study: &Study,
    search: &Search,
    (motions, records): (&[&Motion], &Records<'_>),
) -> Vec<String> {
    if motions.is_empty() {
        return Vec::new();
    }
    let model = (&*search.last.terms, &search.last.solution.solved);
    let axes = study.axes.iter().enumerate();
    let each = axes.flat_map(|(at, axis)| {
        let of_record = constants(records, model, at).into_iter().zip(motions);
        let mostly = of_record.filter(move |([constant, part], _)| {
            *part > MOST_OF_IT && constant.abs() > criteria::ZERO * records.references.force[at]
        });
        mostly.map(|([constant, part], motion)| {
            format!(
                "axis {}: {:.0} % of the error in {} is a constant, {} {}: the zero of its force channel, its preload, or what moves the mean \
                 force differs from the training records",
                axis.name,
                100.0 * part,
                study.records[motion.record].file,
                rounded(constant),
                axis.kind.force_unit()
            )
        })
    });
    each.collect()
}

/// A sentence for every axis whose force is mostly a constant: an error beside all of it says
/// little of what moves.
pub(super) fn mostly_constant(
    records: &Records<'_>,
    [before, after]: [&[f64]; 2],
    (names, on): (&[&str], JudgedOn),
) -> Vec<String> {
    let axes = names.iter().enumerate();
    let axes = axes.map(|(axis, name)| (axis, name, moving(records, axis)));
    axes.filter(|(.., moving)| *moving > 0.0 && 1.0 - moving > MOST_OF_IT)
        .map(|(axis, name, moving)| {
            let [before, after] = [before, after].map(|errors| rounded(errors[axis] / moving.sqrt()));
            format!(
                "axis {name}: {:.4} % of the power of its force on the {} is constant, and errors are relative to all of it; relative to what \
                 varies, the error goes from {before} to {after}",
                100.0 * (1.0 - moving),
                on.words()
            )
        })
        .collect()
}

/// Effects that may be pieces of a shape without a name.
fn pieces(decision: &Decision, names: &[&str]) -> Vec<String> {
    let laws = decision.laws.hypothesis.added();
    let all = decision.hypothesis.added().iter();
    all.filter(|bound| !laws.contains(bound))
        .map(|bound| bound.name(names))
        .collect()
}
