//! What is wrong with a model, in one answer: the data, a missing effect, something unknown, or nothing.

use super::absorbed::absorbed;
use super::answer::{Diagnosis, PerAxis, Verdict, in_words_found, in_words_ranked};
use super::base::base_of;
use super::missing::{self, Refuted, Round};
use crate::assess::compare;
use crate::assess::data_checks;
use crate::assess::noise_floor;
use crate::diagnose::add;
use crate::fit::effects::columns::Records;
use crate::fit::identify::Prepared;
use crate::fit::with_base::OnRecords;
use crate::model::effects::Bound;
use crate::model::file::{AxisError, Base, JudgedOn, ModelFile, NoBase};
use crate::signal::mixed_acceleration;
use crate::signal::motion::Motion;
use crate::study::Study;
use crate::text::error::{Error, Result};

/// What is left above the floor, as a multiple of it, may be this much before something must be missing.
const ABOVE_FLOOR: f64 = 2.0;
/// where an axis rests and the floor is known, only so much, if it is
const ABOVE_KNOWN_FLOOR: f64 = 1.4;
/// this part of the force more than the floor.
const BESIDE_FLOOR: f64 = 0.02;
/// Relative errors below this are those of any model of a real joint.
pub(super) const DISCREPANCY: f64 = 0.012;
/// Of the error's power before, this part may be left above the floor.
const LEFT_OVER: f64 = 0.1;

/// Beside an effect that is named this much above the floor counts,
const NEAR_FLOOR: f64 = 1.15;
/// or this much where the axis never rests and the floor is a guess,
const NEAR_GUESSED_FLOOR: f64 = 1.6;
/// when this part of the error's power that was above it before is left,
const BESIDE: f64 = 0.05;
/// or this part on records that were not learnt from,
const NOT_BORNE_OUT: f64 = 0.2;
/// and it is more than instruments within their tolerances make, as a part of the applied force.
const ALWAYS_WRONG: f64 = 0.003;
/// Relative errors from here on are more than a sound model's own where their spectrum ends with the motion's.
const ENDS_ABOVE: f64 = 0.02;

/// Relative error before and after everything that was found is added, and the noise floor beside the same force.
type Errors = (f64, f64, f64);

/// Diagnoses a model on a study.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the study does not fit the model, or its records are too short.
pub fn diagnose(study: &Study, model: &ModelFile) -> Result<Diagnosis> {
    model.check_fits(study)?;
    let prepared = Prepared::with_filters(study, model.filters.clone())?;
    model.check_motion(study, &prepared.motions)?;
    let low_pass = &model.filters.band;
    let mut notes = Vec::new();
    // The search listens to the better of two instruments; errors are told of the accelerations that were logged, as everywhere.
    let mut judged = Prepared {
        filters: model.filters.clone(),
        motions: prepared.motions.clone(),
    };
    let crossovers = mixed_acceleration::mix(study, &model.filters, &mut judged.motions);
    for (axis, crossover) in study.axes.iter().zip(crossovers) {
        if let Some(hz) = crossover {
            notes.push(format!(
                "axis {}: below {hz:.0} Hz the search takes the acceleration from the body's position, which is less noisy there than the \
                 accelerometer",
                axis.name
            ));
        }
    }
    let training = judged.training(study);
    let validation = judged.validation(study);
    let (base, values) = base_of(study, model, &mut notes)?;

    let held = Records::new(
        &study.axes,
        if validation.is_empty() {
            &training
        } else {
            &validation
        },
        low_pass,
    );
    let unseen = (!validation.is_empty()).then_some(&held);
    let missing::Search {
        rounds,
        refuted,
        patterns,
    } = missing::search(&study.axes, &training, unseen, low_pass, &base, values)?;
    let (Some(first), Some(last)) = (rounds.first(), rounds.last()) else {
        return Err(Error::failed("the diagnosis ended before it began"));
    };
    let names: Vec<&str> = study.axes.iter().map(|a| a.name.as_str()).collect();
    let (before, after);
    let judged_on = if validation.is_empty() {
        notes.push(
            "the study has no validation records, so errors are those on blocks of the training records, each predicted from the \
             rest: give a record of another run the role \"validate\" for an error that counts"
                .into(),
        );
        let training = prepared.training(study);
        before = held_out_errors(study, &training, model, first)?;
        after = held_out_errors(study, &training, model, last)?;
        JudgedOn::HeldOutBlocks
    } else {
        let validation = prepared.validation(study);
        let held = Records::new(&study.axes, &validation, low_pass);
        before = errors(&held, first);
        after = errors(&held, last);
        JudgedOn::Validation
    };

    let (terms, inertia) = last.solution.in_si(&last.terms, &study.axes);
    let floors_of = |motions: &[Motion]| -> (Vec<noise_floor::Floor>, Vec<f64>) {
        let all: Vec<&Motion> = motions.iter().collect();
        let floors = noise_floor::floors(&study.axes, &all, low_pass, &terms, &inertia);
        let shares = floors.iter().zip(&held.references.force);
        let shares = shares.map(|(floor, force)| floor.rms / force).collect();
        (floors, shares)
    };
    let (floors, floor) = floors_of(&judged.motions);
    let (as_logged, floor_as_logged) = floors_of(&prepared.motions);
    for (axis, floor) in study.axes.iter().zip(&floors) {
        if !floor.at_rest {
            notes.push(format!(
                "axis {} rests in no record, so its noise floor is taken from high frequencies and may be too low",
                axis.name
            ));
        }
    }

    let found = in_words_found(&last.terms[base.len()..], &names);
    // Records learnt from say whether the effects found are the ones that act; other records also ask whether their values
    // hold there. Something unknown shows in both.
    let learnt = Records::new(&study.axes, &training, low_pass);
    let [learnt_before, learnt_after] = [first, last].map(|r| errors_within(&learnt, r, last));
    let [held_before, held_after] = [first, last].map(|r| errors_within(&held, r, last));
    let above = |e: f64, floor: f64| (e * e - floor * floor).max(0.0);
    let left_over = |axis: usize, (before, after, floor): Errors| {
        let known = floor.hypot(BESIDE_FLOOR).max(ABOVE_KNOWN_FLOOR * floor);
        let limit = (ABOVE_FLOOR * floor).max(DISCREPANCY);
        (after > limit || (floors[axis].at_rest && after > known))
            && above(after, floor) > LEFT_OVER * above(before, floor)
    };
    let near = |axis: usize| {
        if floors[axis].at_rest {
            NEAR_FLOOR
        } else {
            NEAR_GUESSED_FLOOR
        }
    };
    let stands_out = |axis: usize, after: f64, floor: f64| after > near(axis) * floor;
    // An effect that is named explains nearly everything that can be seen. Gains are wrong by a part of the applied force, which
    // can be many times what the joint gives back.
    let left_beside = |axis: usize, records: &Records<'_>, (before, after, floor): Errors, part| {
        let applied = records.applied_rms(axis) / records.references.force[axis];
        let wrong = ALWAYS_WRONG * applied.max(1.0);
        last.terms[base.len()..].iter().any(|t| t.acts_on(axis))
            && stands_out(axis, after, floor)
            && above(after, floor.hypot(wrong)) > part * above(before, floor)
    };
    let learnt_floor = |axis: usize| floors[axis].rms / learnt.references.force[axis];
    let nobody_measures = |axis: usize| {
        // An accelerometer's noise is flat, but only half of it is in the mix.
        let at_rest =
            as_logged[axis].acts_at_rest && floor[axis].min(learnt_floor(axis)) > DISCREPANCY;
        let ends = floors[axis].ends
            && found.is_empty()
            && held_after[axis].min(learnt_after[axis]) > ENDS_ABOVE;
        if at_rest {
            Some(
                "while the axis rests the force channel shows more than noise: a force that nobody measures acts there",
            )
        } else {
            ends.then_some(
                "the spectrum of what is left ends, as a force's does and noise's does not: a force that nobody measures, or a law that the \
                 library does not have",
            )
        }
    };
    let unexplained = (0..study.axes.len()).any(|axis| {
        let learnt_floor = learnt_floor(axis);
        let unseen = (held_before[axis], held_after[axis], floor[axis]);
        let seen = (learnt_before[axis], learnt_after[axis], learnt_floor);
        [unseen, seen].iter().all(|&errors| left_over(axis, errors))
            // Where the noise is known, also of what is small; and what is right on the records learnt from is right on others.
            || (floors[axis].at_rest
                && left_beside(axis, &held, unseen, BESIDE)
                && left_beside(axis, &learnt, seen, BESIDE))
            || (left_beside(axis, &held, unseen, NOT_BORNE_OUT)
                && stands_out(axis, seen.1, seen.2))
            || nobody_measures(axis).is_some()
    });
    // What other records speak against is something all the same, unless it was in the noise.
    let spoken_against = refuted.as_ref().is_some_and(|refuted| {
        let axis = refuted.axis;
        found.is_empty()
            && stands_out(axis, held_after[axis], floor[axis])
            && stands_out(axis, learnt_after[axis], learnt_floor(axis))
    });
    let follows = patterns.iter().any(|pattern| pattern.decides);
    let unexplained = unexplained || spoken_against || follows;
    if let Some(Refuted {
        bound,
        axis,
        errors,
    }) = refuted
    {
        notes.push(format!(
            "{} explains the training records better, but on the validation records the relative error of axis {} would go from {:.4} \
             to {:.4} with it, so it is not added: what it does there is not this effect",
            bound.name(&names),
            names[axis],
            errors[0],
            errors[1]
        ));
    }
    notes.extend(names.iter().enumerate().filter_map(|(axis, name)| {
        let pattern = patterns.iter().find(|p| p.axis == axis);
        let words = pattern.map_or_else(|| nobody_measures(axis), |p| Some(p.words.as_str()));
        words.map(|words| format!("axis {name}: {words}"))
    }));
    let wrong = data_checks::check(study, &model.filters);
    let verdict = match (unexplained, found.is_empty()) {
        _ if wrong.iter().any(|finding| finding.serious) => Verdict::Data,
        (true, _) => Verdict::Unknown,
        (false, true) => Verdict::None,
        (false, false) => Verdict::Effect,
    };
    let per_axis = |values: &[f64]| -> PerAxis {
        let pairs = names.iter().zip(values);
        pairs.map(|(name, v)| ((*name).to_string(), *v)).collect()
    };
    let comparison = compare::compare_motions(study, model, &prepared.motions)?;
    let new = last.terms.iter().zip(&last.solution.solved.values);
    let new: Vec<(Bound, Vec<f64>)> = new
        .skip(base.len())
        .map(|(term, values)| (*term, values.clone()))
        .collect();
    let (before, after) = match model.base {
        Base::None(_) => (before, after),
        _ => errors_of_the_model(study, &prepared, model, &new, &mut notes)?,
    };
    let absorbed = absorbed(study, &prepared, model, &new)?;
    notes.extend(absorbed.iter().map(|a| {
        format!(
            "the {} already reproduces {:.0} % of {}@{}",
            model.base.name(),
            100.0 * a.share,
            a.effect,
            a.axis
        )
    }));
    Ok(Diagnosis {
        verdict,
        judged_on,
        relative_error_before: per_axis(&before),
        relative_error_after: per_axis(&after),
        absorbed,
        noise_floor: per_axis(&floor_as_logged),
        ranked: in_words_ranked(first, &found, study),
        found,
        places: comparison.places,
        data_problems: data_checks::sentences(wrong),
        notes,
    })
}

/// RMS error over RMS force per axis of a polynomial or a network, and of the same with effects added to it.
fn errors_of_the_model(
    study: &Study,
    prepared: &Prepared,
    model: &ModelFile,
    new: &[(Bound, Vec<f64>)],
    notes: &mut Vec<String>,
) -> Result<(Vec<f64>, Vec<f64>)> {
    let relative = |errors: &[AxisError]| errors.iter().map(|e| e.relative_error).collect();
    let names: Vec<&str> = study.axes.iter().map(|a| a.name.as_str()).collect();
    let effects: Vec<String> = new.iter().map(|(bound, _)| bound.name(&names)).collect();
    if !effects.is_empty() {
        match add::add(study, model, &effects) {
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

/// RMS error over RMS force per axis on blocks of the training records, with the shapes that a round found.
fn held_out_errors(
    study: &Study,
    training: &[&Motion],
    model: &ModelFile,
    round: &Round,
) -> Result<Vec<f64>> {
    let terms = round.terms.iter().zip(&round.solution.solved.values);
    let terms: Vec<_> = terms
        .map(|(term, values)| (*term, values.clone()))
        .collect();
    let alone = ModelFile {
        base: Base::None(NoBase {
            inputs: model.base.inputs().to_vec(),
        }),
        ..model.clone()
    };
    let errors = OnRecords::new(&study.axes, training, &alone)?
        .held_out_errors(&terms, &vec![0.0; study.axes.len()])?;
    Ok(errors.iter().map(|e| e.relative_error).collect())
}

/// RMS error over RMS force per axis on other records, with the values that a round found.
fn errors(records: &Records<'_>, round: &Round) -> Vec<f64> {
    missing::relative_errors(records, &round.terms, &round.solution.solved, &[])
}

/// The same without what instruments that were found to be within their tolerances make of it.
fn errors_within(records: &Records<'_>, round: &Round, last: &Round) -> Vec<f64> {
    let solved = &round.solution.solved;
    missing::relative_errors(records, &round.terms, solved, &last.within)
}
