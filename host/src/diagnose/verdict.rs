//! What is wrong with a model, in one answer: the data, a missing effect, something unknown, or
//! nothing.

use super::absorbed::absorbed;
use super::answer::{Diagnosis, Verdict};
use super::base::base_of;
use super::criteria;
use super::decide::Decision;
use super::errors::{Unseen, relative_errors};
use super::in_words;
use super::notes::{
    follows_already, in_notes, mostly_constant, never_rests, of_constants, of_motion, refutations,
};
use super::search::{Given, Search, search};
use crate::assess::compare;
use crate::assess::data_checks::{self, Finding};
use crate::assess::noise_floor::{self, Floor};
use crate::diagnose::add;
use crate::fit::effects::are_enough;
use crate::fit::effects::columns::Records;
use crate::fit::identify::Prepared;
use crate::model::effects::AxisEffect;
use crate::model::file::{AxisError, Base, ModelFile, PerAxis};
use crate::signal::mixed_acceleration;
use crate::signal::motion::Motion;
use crate::study::Study;
use crate::study::quasi_static::effects_in_time;
use crate::text::error::{Error, Result};
use crate::text::nearest::suggestion;
use crate::text::table::hertz;
use jointwatch_shared::effect::{EFFECTS, Entry};

/// What is asked beside the question.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SearchOptions {
    /// Effects that are not to be thought of.
    pub without: Vec<String>,
    /// Whether to tell every set of effects that was looked at.
    pub explain: bool,
}

impl SearchOptions {
    /// The same with the names of the effects checked.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Usage`] naming the effect that is none.
    pub fn checked(without: Vec<String>, explain: bool) -> Result<Self> {
        for name in &without {
            if Entry::named(name).is_none() {
                let known: Vec<&str> = EFFECTS.iter().map(|e| e.about.name).collect();
                return Err(Error::usage(format!(
                    "--without {name}: there is no such effect: {}",
                    suggestion(name, &known)
                )));
            }
        }
        Ok(Self { without, explain })
    }
}

/// What is said of the errors of a study without validation records.
const NO_VALIDATION: &str = "the study has no validation records, so errors are those on blocks of the training records, each predicted from the \
     rest: give a record of another run the role \"validate\" for an error that counts";

/// The answer for the motions that the model's filters make of the study; in `in_time` the force
/// channels are read later by what is known.
///
/// # Errors
/// As [`super::diagnose`].
pub(super) fn answer(
    study: &Study,
    prepared: &Prepared,
    in_time: &Prepared,
    model: &ModelFile,
    asked: &SearchOptions,
) -> Result<Diagnosis> {
    model.check_motion(study, &prepared.motions)?;
    let mut notes = Vec::new();
    let judged = mixed(study, model, in_time, &mut notes);
    let training = judged.training(study);
    let (base, values) = base_of(study, model, &mut notes)?;
    let logged = in_time.validation(study);
    let of_validation = Records::new(&study.axes, &logged, &model.filters.band);
    let as_logged = in_time.training(study);
    let seen = (!logged.is_empty()).then_some(&of_validation);
    let unseen = Unseen::new(study, model, &as_logged, seen);
    notes.extend(logged.is_empty().then(|| NO_VALIDATION.to_owned()));
    let with_time = effects_in_time().filter(|_| study.quasi_static);
    let without: Vec<String> = asked.without.iter().cloned().chain(with_time).collect();
    let of_zeros = of_zeros(study, &training, judged.validation(study));
    let given = Given {
        axes: &study.axes,
        motions: &training,
        of_zeros: &of_zeros,
        unseen: &unseen,
        low_pass: &model.filters.band,
        without: &without,
    };
    let mut search = search(&given, &base, values)?;
    let names: Vec<&str> = study.axes.iter().map(|a| a.name.as_str()).collect();
    let of = |m: &super::search::Model| unseen.errors(&m.terms, &m.solution);
    let (before, after) = (of(&search.first)?, of(&search.last)?);
    let [floors, as_logged] =
        [&judged.motions, &in_time.motions].map(|motions| floors(study, model, &search, motions));
    notes.extend(never_rests(study, &floors));
    notes.extend(of_motion(study, &training, &model.filters));
    let learnt = Records::new(&study.axes, &training, &model.filters.band);
    let unmeasured = unmeasured_forces(&search, (&floors, &as_logged), &learnt);
    let powers = powers(&search, &unmeasured);
    with_what_unseen_rows_say(&mut search, &powers);
    notes.extend(refutations(&search, &names, unseen.judged_on()));
    notes.extend(of_constants(study, &search, (&logged, &of_validation)));
    notes.extend(in_notes(
        &search,
        (study, &learnt),
        (&unmeasured, &floors),
        &names,
    ));
    let found = in_words::found(&search.found, &names);
    let wrong = data_checks::check(study, &model.filters);
    let short = too_short(&learnt, &base, &names);
    let serious = wrong.iter().any(|f| is_fault(f, &search)) || !short.is_empty();
    let verdict = verdict(&powers, serious, found.is_empty());
    let per_axis = |values: &[f64]| named(&names, values);
    let held = held(study, &judged);
    let held = Records::new(&study.axes, &held, &model.filters.band);
    let noise = noise(&as_logged, &held);
    let comparison = compare::compare_motions(study, model, &prepared.motions)?;
    let new = added(&search);
    let (before, after) = match model.base {
        Base::None(_) => (before, after),
        _ => errors_of_the_model(study, prepared, model, &new, &mut notes)?,
    };
    notes.extend(mostly_constant(
        &held,
        [&before, &after],
        (&names, unseen.judged_on()),
    ));
    let absorbed = absorbed(study, prepared, model, &new)?;
    notes.extend(absorbed.iter().map(|a| follows_already(model, a)));
    let (decisions, zeros) = (&search.decisions, search.zeros_found());
    Ok(Diagnosis {
        verdict,
        judged_on: unseen.judged_on(),
        relative_error_before: per_axis(&before),
        relative_error_after: per_axis(&after),
        absorbed,
        noise_floor: per_axis(&noise),
        moving: per_axis(&decisions.iter().map(|d| d.moving).collect::<Vec<_>>()),
        ranked: in_words::candidates(&search, &found, (&learnt, &base), study)?,
        found,
        probabilities: in_words::probabilities(decisions, &zeros, &names, serious),
        remainder: in_words::remainder(decisions, &names),
        looked_at: in_words::looked_at(if asked.explain { decisions } else { &[] }, &names),
        places: comparison.places,
        data_problems: [short, data_checks::sentences(wrong)].concat(),
        notes,
    })
}

/// Whether a finding is serious, and neither the effects of its axis explain more than it holds nor
/// the whole model leaves less: then the motion explains most of what looks like spikes, as the
/// push that starts a body does.
fn is_fault(finding: &Finding, search: &Search) -> bool {
    let is_explained = |(axis, power)| {
        let mut decisions = search.decisions.iter();
        decisions.any(|d| d.axis == axis && (d.named() > power || d.left.powi(2) < power))
    };
    finding.serious && !finding.spikes.is_some_and(is_explained)
}

/// The motions whose zeros of force are compared, where they are not those of training: one record
/// has one zero, which is that of its whole log, and what it differs from stands in others.
fn of_zeros<'a>(
    study: &Study,
    training: &[&'a Motion],
    validation: Vec<&'a Motion>,
) -> Vec<&'a Motion> {
    let &[only] = training else {
        return Vec::new();
    };
    let file = |motion: &Motion| &study.records[motion.record].file;
    let others = validation.into_iter().filter(|m| file(m) != file(only));
    std::iter::once(only).chain(others).collect()
}

/// A figure per axis with the axis' name.
fn named(names: &[&str], values: &[f64]) -> PerAxis {
    let names = names.iter().map(|name| (*name).to_string());
    names.zip(values.iter().copied()).collect()
}

/// The rows that errors are told of: those of the validation records, or of the training records
/// where there are none.
fn held<'a>(study: &Study, judged: &'a Prepared) -> Vec<&'a Motion> {
    match judged.validation(study) {
        none if none.is_empty() => judged.training(study),
        held => held,
    }
}

/// The noise of every axis, relative to its force.
fn noise(floors: &[Floor], held: &Records<'_>) -> Vec<f64> {
    let pairs = floors.iter().zip(&held.references.force);
    pairs.map(|(floor, force)| floor.rms / force).collect()
}

/// A sentence for every axis on which the records are too short to try an effect of two parameters
/// beside the base.
fn too_short(records: &Records<'_>, base: &[AxisEffect], names: &[&str]) -> Vec<String> {
    let rows = records.rows_per_axis();
    let axes = names.iter().enumerate().filter(|&(axis, _)| {
        let own = base.iter().filter(|term| term.acts_on(axis));
        let least = Entry::named("coulomb").map(|entry| AxisEffect {
            entry,
            axis,
            input: None,
        });
        let terms: Vec<AxisEffect> = own.copied().chain(least).collect();
        !are_enough(records, &terms, 0)
    });
    axes.map(|(_, name)| {
        format!(
            "axis {name}: {rows} independent rows (what is left behind the low-pass) are too few to try an effect beside the base: record longer"
        )
    })
    .collect()
}

/// The records as the search listens to them: to the better of two instruments. Errors are told of
/// the accelerations that were logged, as everywhere.
fn mixed(
    study: &Study,
    model: &ModelFile,
    prepared: &Prepared,
    notes: &mut Vec<String>,
) -> Prepared {
    let mut judged = prepared.clone();
    let crossovers = mixed_acceleration::mix(study, &model.filters, &mut judged.motions);
    for (axis, crossover) in study.axes.iter().zip(crossovers) {
        if let Some(hz) = crossover {
            notes.push(format!(
                "axis {}: below {} the search takes the acceleration from the body's position, which is less noisy there than the \
                 accelerometer",
                axis.name,
                hertz(hz)
            ));
        }
    }
    judged
}

/// The noise floor of every axis under everything that was found.
fn floors(study: &Study, model: &ModelFile, search: &Search, motions: &[Motion]) -> Vec<Floor> {
    let last = &search.last;
    let (terms, inertia) = last.solution.in_si(&last.terms, &study.axes);
    let all: Vec<&Motion> = motions.iter().collect();
    noise_floor::floors(&study.axes, &all, &model.filters.band, &terms, &inertia)
}

/// Above the noise of the sensors, a force that nobody measured is more than this part of what has
/// a name: no law of a joint fits to the noise.
const KNOWN_NOISE: f64 = 0.2;
/// The same where the noise was not seen at rest, and may be larger.
const GUESSED_NOISE: f64 = 1.0;

/// Power, beside that of the force, of a force on an axis that nobody measured: what stands above
/// the sensors' noise though neither effects nor a learner without physics take it away. `last` is
/// what the whole model leaves of the axis: what is found on another one may mend a term that acts
/// on both.
fn unmeasured(
    search: &Search,
    axis: usize,
    (floor, as_logged): (&Floor, &Floor),
    (learnt, last): (&Records<'_>, f64),
) -> f64 {
    let Some(decision) = search.decisions.iter().find(|d| d.axis == axis) else {
        return 0.0;
    };
    let noise = floor.rms / learnt.references.force[axis];
    let left = match search.refuted_on(axis) {
        // What the decision left was with what unseen rows refuted.
        Some(_) => last,
        None => decision.left.min(last),
    };
    let above = (left * left - noise * noise).max(0.0);
    // A load that stands still is no yardstick for what moves.
    let share = criteria::tolerance() * decision.moving.sqrt();
    if as_logged.acts_at_rest && noise > share {
        return noise * noise;
    }
    let stands_out = criteria::stands_out(left, noise, share);
    let named = decision.named();
    let known = floor.at_rest || floor.ends;
    let counts = if known { KNOWN_NOISE } else { GUESSED_NOISE } * named;
    let loud = left > floor.most / learnt.references.force[axis];
    let no_noise = known || loud || floor.follows_motion;
    if stands_out && above > counts && (no_noise || named > 0.0) {
        above
    } else {
        0.0
    }
}

/// The same on every axis.
fn unmeasured_forces(
    search: &Search,
    (floors, as_logged): (&[Floor], &[Floor]),
    learnt: &Records<'_>,
) -> Vec<f64> {
    let model = &search.last;
    let last = relative_errors(learnt, &model.terms, &model.solution.solved);
    let floors = floors.iter().zip(as_logged).zip(last).enumerate();
    floors
        .map(|(axis, (floors, last))| unmeasured(search, axis, floors, (learnt, last)))
        .collect()
}

/// Per decision, the power on its axis that has a name, and that has none. `unmeasured` is what
/// [`unmeasured_forces`] tells.
fn powers(search: &Search, unmeasured: &[f64]) -> Vec<[f64; 2]> {
    let of_axis = |decision: &Decision| {
        let (named, unnamed) = (decision.named(), decision.without_name());
        let refuted = search.refuted_on(decision.axis).is_some();
        let mut found = search.found.iter();
        let stays = found.any(|bound| bound.acts_on(decision.axis));
        // Most of an error that laws explain here and not on other records has a cause that is none
        // of them.
        let of_another = refuted && !stays && named > 0.5 * decision.moving_error_power();
        let [named, unnamed] = match of_another {
            true => [0.0, unnamed + named],
            false => [named, unnamed],
        };
        [named, unnamed.max(unmeasured[decision.axis])]
    };
    search.decisions.iter().map(of_axis).collect()
}

/// Whether what has no name is more than counts beside what has one.
fn is_unknown([named, unnamed]: [f64; 2]) -> bool {
    unnamed > criteria::UNKNOWN * named && unnamed > 0.0
}

/// Chances as they are after what the draws of blocks, all of training records, cannot tell: that
/// unseen rows refute an effect, and that more stands above the noise than motion explains.
fn with_what_unseen_rows_say(search: &mut Search, powers: &[[f64; 2]]) {
    let drawn = |decision: &Decision| is_unknown([decision.named(), decision.without_name()]);
    for (decision, powers) in search.decisions.iter_mut().zip(powers) {
        let refuted = search.refuted.iter();
        for refuted in refuted.filter(|refuted| refuted.bound.acts_on(decision.axis)) {
            decision.chances.refute(&refuted.bound);
        }
        if is_unknown(*powers) && !drawn(decision) {
            (decision.chances.unknown, decision.chances.nothing) = (1.0, 0.0);
        }
    }
}

/// What was found, with its values.
fn added(search: &Search) -> Vec<(AxisEffect, Vec<f64>)> {
    let last = search.last.terms.iter();
    let last = last.zip(&search.last.solution.solved.values);
    let found = last.filter(|(term, _)| search.found.contains(term));
    found
        .map(|(term, values)| (*term, values.clone()))
        .collect()
}

/// The verdict: an effect where what has a name explains most of what can be explained.
fn verdict(powers: &[[f64; 2]], serious: bool, none_found: bool) -> Verdict {
    let sum = |at: usize| powers.iter().map(|powers| powers[at]).sum();
    match (is_unknown([sum(0), sum(1)]), none_found) {
        _ if serious => Verdict::Data,
        (true, _) => Verdict::Unknown,
        (false, true) => Verdict::None,
        (false, false) => Verdict::Effect,
    }
}

/// RMS error over RMS force per axis of a polynomial or a network, and of the same with effects
/// added to it.
fn errors_of_the_model(
    study: &Study,
    prepared: &Prepared,
    model: &ModelFile,
    new: &[(AxisEffect, Vec<f64>)],
    notes: &mut Vec<String>,
) -> Result<(Vec<f64>, Vec<f64>)> {
    let relative = |errors: &[AxisError]| errors.iter().map(|e| e.relative_error).collect();
    let names: Vec<&str> = study.axes.iter().map(|a| a.name.as_str()).collect();
    let effects: Vec<String> = new.iter().map(|(bound, _)| bound.name(&names)).collect();
    if !effects.is_empty() {
        match add::add_to(study, prepared, model, &effects) {
            Ok(added) => {
                return Ok((
                    relative(&added.errors.before),
                    relative(&added.errors.after),
                ));
            }
            Err(e) => notes.push(format!("{} could not be added: {e}", effects.join(", "))),
        }
    }
    let errors = if prepared.validation(study).is_empty() {
        add::held_out_errors(study, prepared, model)?
    } else {
        compare::compare_motions(study, model, &prepared.motions)?.validation
    };
    Ok((relative(&errors), relative(&errors)))
}
