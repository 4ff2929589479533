//! Diagnose, add what is missing, diagnose again, until nothing is missing: the staircase of
//! errors.

use crate::diagnose::add::{self, Added};
use crate::diagnose::criteria;
use crate::diagnose::in_place::{instead, simplified};
use crate::diagnose::in_time::diagnose_prepared;
use crate::diagnose::{Diagnosis, Found, PerAxis, SearchOptions, Verdict};
use crate::fit::identify::Prepared;
use crate::model::corrections::of_the_joint;
use crate::model::effects::{AxisEffect, ModelEffect};
use crate::model::file::{JudgedOn, ModelFile, per_axis};
use crate::study::Study;
use crate::text::error::Result;
use jointwatch_shared::base::terms::MAX_TERMS;
use jointwatch_shared::effect::{Acts, Entry};
use serde::Serialize;

/// Of the power that was left, most is taken away where no more than one part in so many stays.
const MOST_OF_WHAT_WAS_LEFT: f64 = 2.0;

/// What the label of a step begins with that leaves an effect out again.
pub const WITHOUT: &str = "without ";

/// One tread of the staircase.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Step {
    /// What was added last, `coulomb@x`; empty for the model that was brought, and where an effect
    /// was left out again.
    pub added: Vec<String>,
    /// The effect whose place it takes, where that explains no more with more values or means
    /// nothing beside it; the effect that was left out, where nothing was added.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub instead_of: Option<String>,
    /// RMS error over RMS force per axis, with everything that was added so far.
    pub relative_error: PerAxis,
}

impl Step {
    /// What it did, `coulomb@x`, `coulomb@x instead` or `without coulomb@x`; `None` for the model
    /// that was brought.
    pub fn label(&self) -> Option<String> {
        let names = self.added.join(", ");
        match (&self.instead_of, self.added.is_empty()) {
            (Some(former), true) => Some(format!("{WITHOUT}{former}")),
            (None, true) => None,
            (Some(_), false) => Some(format!("{names} instead")),
            (None, false) => Some(names),
        }
    }
}

/// Errors from the model that was brought down to the noise.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Staircase {
    /// The rows that the errors are measured on.
    pub judged_on: JudgedOn,
    /// The model that was brought, then one step per addition.
    pub steps: Vec<Step>,
    /// The line where the errors must stop.
    pub noise_floor: PerAxis,
    /// Why it ended, in a sentence without its full stop.
    pub ended: String,
}

impl Staircase {
    /// Adds a step: a model with these effects, where one was left out for them with that.
    fn push(&mut self, added: Vec<String>, instead_of: Option<String>, with: &Added) {
        self.steps.push(Step {
            added,
            instead_of,
            relative_error: per_axis(&with.errors.after),
        });
    }

    /// Whether an effect was added on the way.
    fn has_added(&self, name: &str) -> bool {
        let mut added = self.steps.iter().flat_map(|step| &step.added);
        added.any(|known| known == name)
    }
}

/// A model with everything that was missing.
pub struct Applied {
    /// The model; the one that was brought where nothing was added.
    pub model: ModelFile,
    /// What was said of the model that was brought.
    pub first: Diagnosis,
    /// What is said of the model that came out.
    pub last: Diagnosis,
    /// The errors on the way.
    pub staircase: Staircase,
}

impl Applied {
    /// What was named at first and is not in the model, in a sentence without its full stop.
    pub fn not_kept(&self) -> Option<String> {
        let held = |found: &&Found| {
            let mut effects = self.model.effects.iter();
            effects.any(|e| {
                e.effect == found.effect && e.axis.as_deref().is_none_or(|axis| axis == found.axis)
            })
        };
        let others = self.first.found.iter().filter(|found| !held(found));
        let others: Vec<Found> = others.cloned().collect();
        (!others.is_empty()).then(|| {
            format!(
                "named at first and not in the model, since beside what was added it is not needed or could not be kept: {}",
                listed(&others)
            )
        })
    }

    /// What was added though every interval of its strengths holds 0, as the error falls by half
    /// with it, in a sentence without its full stop.
    pub fn unsure(&self) -> Option<String> {
        let effects = self.model.effects.iter().filter(|e| e.is_undetermined());
        let mut names: Vec<String> = effects.map(ModelEffect::name).collect();
        names.retain(|name| self.staircase.has_added(name));
        (!names.is_empty()).then(|| {
            format!(
                "the error falls, but these records do not tell the strength of {}, whose 95 % intervals hold 0: record more of such motion \
                 before you believe the values",
                names.join(", ")
            )
        })
    }
}

/// Diagnoses a model, adds what is found one after the other, and diagnoses again, until nothing is
/// missing.
///
/// `each` is told what was added.
///
/// # Errors
/// As [`crate::diagnose::diagnose_with`] and [`add::add`].
pub fn apply(
    study: &Study,
    model: &ModelFile,
    asked: &SearchOptions,
    each: &dyn Fn(&str),
) -> Result<Applied> {
    // Whatever is added, the filters stay.
    let prepared = Prepared::for_model(study, model)?;
    let first = diagnose_prepared(study, &prepared, model, asked)?;
    let judged_on = first.judged_on;
    let mut staircase = Staircase {
        judged_on,
        steps: vec![Step {
            added: Vec::new(),
            instead_of: None,
            relative_error: first.relative_error_before.clone(),
        }],
        noise_floor: first.noise_floor.clone(),
        ended: String::new(),
    };
    let (mut model, mut last) = (model.clone(), first.clone());
    let mut tried = Vec::new();
    loop {
        let ended = match last.verdict {
            Verdict::None => Some(format!("nothing more is missing{}", last.but_above_noise())),
            Verdict::Data if staircase.steps.len() > 1 => Some(format!(
                "the data do not tell what else is missing: {}",
                last.data_problems[0]
            )),
            Verdict::Data => {
                Some("the data are at fault, and nothing is added before they are right; `jointwatch add` adds an effect all the same".into())
            }
            _ if last.found.is_empty() => {
                Some("what is left is nothing that the library knows".into())
            }
            Verdict::Unknown if staircase.steps.len() > 1 && is_little(&first, &last) => {
                Some(format!(
                    "{} would take away less than {:.0} % of what is explained so far, and the rest has no name",
                    listed(&last.found),
                    100.0 * criteria::LEAST_IMPORTANCE
                ))
            }
            _ => add_all(
                (study, &prepared),
                &mut model,
                &last.found,
                &mut staircase,
                each,
            )?,
        };
        if let Some(ended) = ended {
            let Some(simpler) = simplify((study, &prepared), &model, &mut staircase, &mut tried)?
            else {
                staircase.ended = ended;
                break;
            };
            model = simpler;
        }
        last = diagnose_prepared(study, &prepared, &model, asked)?;
        staircase.noise_floor.clone_from(&last.noise_floor);
    }
    Ok(Applied {
        model,
        first,
        last,
        staircase,
    })
}

/// The model without an effect that was added, or with its special case, where that does as well:
/// what made it necessary may have been found since. Each that was added is tried once.
fn simplify(
    (study, prepared): (&Study, &Prepared),
    model: &ModelFile,
    staircase: &mut Staircase,
    tried: &mut Vec<String>,
) -> Result<Option<ModelFile>> {
    for effect in &model.effects {
        let name = effect.name();
        if !staircase.has_added(&name) || tried.contains(&name) {
            continue;
        }
        tried.push(name.clone());
        if let Some((special, simpler)) = simplified(study, prepared, model, &name)? {
            staircase.push(special.into_iter().collect(), Some(name), &simpler);
            return Ok(Some(simpler.model));
        }
    }
    Ok(None)
}

/// Why a model with what was added means nothing, where it does.
fn why_nothing(added: &Added) -> Option<String> {
    let unphysical = added.unphysical.as_ref().map(|name| {
        format!("found anew beside the others {name} has a value that is not physical")
    });
    let undetermined = added.undetermined.as_ref().map(|name| {
        format!("the records do not determine the strength of {name}: every 95 % interval holds 0")
    });
    unphysical.or(undetermined)
}

/// What was found, in a row.
fn listed(found: &[Found]) -> String {
    let names = found.iter().map(Found::name);
    names.collect::<Vec<_>>().join(", ")
}

/// Whether what was found last explains next to nothing of all that is explained beside the model
/// that was brought, and not most of what was left either.
///
/// A constant force counts for nothing: that of a preload may be many times what moves.
fn is_little(first: &Diagnosis, last: &Diagnosis) -> bool {
    let power = |errors: &PerAxis| errors.values().map(|e| e * e).sum::<f64>();
    let (before, after) = (
        power(&last.relative_error_before),
        power(&last.relative_error_after),
    );
    let axes = first.relative_error_before.iter();
    let all = axes.map(|(axis, error)| (error * error).min(first.moving[axis]));
    let share = criteria::LEAST_IMPORTANCE * (all.sum::<f64>() - after);
    before - after < share && before < MOST_OF_WHAT_WAS_LEFT * after
}

/// Adds what was found, one after the other; says why when nothing could be added.
///
/// An effect that does not help by itself, is cancelled there or has no physical value waits for
/// the others: of two that act together the smaller one may help only beside the larger.
fn add_all(
    (study, prepared): (&Study, &Prepared),
    model: &mut ModelFile,
    found: &[Found],
    staircase: &mut Staircase,
    each: &dyn Fn(&str),
) -> Result<Option<String>> {
    let before = staircase.steps.len();
    // With the number of steps that there were when it was tried.
    let mut waiting: Vec<(Vec<String>, usize)> = Vec::new();
    let mut left_out: Option<String> = None;
    let mut tries: Vec<Vec<String>> = found.iter().map(|f| to_add(f, study)).collect();
    tries.reverse();
    loop {
        let steps = staircase.steps.len();
        let last_try = tries.is_empty();
        let names = match tries.pop() {
            Some(names) => names,
            // One alone is not tried again beside what it was tried with.
            None if waiting.len() > 1 || waiting.iter().any(|(_, then)| *then < steps) => {
                waiting.drain(..).flat_map(|(names, _)| names).collect()
            }
            None => break,
        };
        let listed = names.join(", ");
        each(&listed);
        let added = match add::add_to(study, prepared, model, &names) {
            Ok(added) => added,
            Err(error) => {
                left_out = Some(format!("{listed} could not be added: {error}"));
                continue;
            }
        };
        let conflicting = added.unphysical.as_ref().or(added.undetermined.as_ref());
        if let Some(other) = conflicting.filter(|name| staircase.has_added(name))
            && let Some((new, swapped)) = instead((study, prepared), model, other, &names)
        {
            staircase.push(new, Some(other.clone()), &swapped);
            *model = swapped.model;
            continue;
        }
        if let Some((cancelled, _)) = &added.cancels {
            let mut others = names.clone();
            others.retain(|name| name != cancelled);
            left_out = Some(format!(
                "{} was found on the training records but would be cancelled by {cancelled}, so it was left out",
                others.join(", ")
            ));
        } else if let Some(why) = why_nothing(&added) {
            left_out = Some(format!("{listed} was found, but {why}, so it was left out"));
        } else if of_the_joint(&added.model.effects_in_si()?).len() > MAX_TERMS {
            left_out = Some(format!(
                "{listed} is missing as well, but a device carries {MAX_TERMS} effects at most"
            ));
            continue;
        } else if added.helps {
            staircase.push(names, None, &added);
            *model = added.model;
            continue;
        } else {
            left_out = Some(format!(
                "{listed} was found on the training records but lowers no error on the {}, so it was left out",
                added.errors.judged_on.words()
            ));
        }
        waiting.extend((!last_try).then_some((names, steps)));
    }
    Ok(left_out.filter(|_| staircase.steps.len() == before))
}

/// What was found, as `add` takes it: once per axis where it was found on both.
pub fn to_add(found: &Found, study: &Study) -> Vec<String> {
    let both = found.axis == "both";
    let alone = Entry::named(&found.effect).is_some_and(|e| e.acts == Acts::BothAxes);
    let axes: Vec<&str> = study.axes.iter().map(|a| a.name.as_str()).collect();
    match (both, alone) {
        (_, true) => vec![found.effect.clone()],
        (true, false) => axes
            .iter()
            .map(|axis| format!("{}@{axis}", found.effect))
            .filter(|name| AxisEffect::parse(name, &axes).is_ok())
            .collect(),
        (false, false) => vec![found.name()],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::identify;
    use crate::study::MemoryLog;
    use std::f64::consts::TAU;

    /// A spring and a damper with dry friction, and a drag that bends the other way and is smaller.
    fn record(name: &str, phase: f64) -> MemoryLog {
        let rate_hz = 500.0;
        let state = |row: usize, ahead: f64| -> f64 {
            let t = row as f64 / rate_hz;
            let tone = |f: f64| {
                (TAU * f * t + phase * f + ahead).sin() * if ahead > 0.0 { TAU * f } else { 1.0 }
            };
            4e-3 * (tone(1.1) + 0.6 * tone(2.3) + 0.4 * tone(3.7))
        };
        let x: Vec<f64> = (0..4000).map(|row| state(row, 0.0)).collect();
        let force = |row: usize| {
            let v = state(row, TAU / 4.0);
            let noise = 0.02 * (row as f64 * row as f64 * 0.7).sin();
            8e3 * x[row] + 40.0 * v + 6.0 * (v / 1e-3).tanh() + 80.0 * v * v.abs() + noise
        };
        let force = (0..4000).map(force).collect();
        MemoryLog {
            name: name.into(),
            columns: vec![("x".into(), x), ("F".into(), force)],
        }
    }

    #[test]
    fn what_has_no_physical_value_alone_waits_for_what_is_found_beside_it() {
        let text = "sample_rate_hz = 500.0\n[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = \"x\"\nforce = \"F\"\n\
                    inertia = 0\n[[record]]\nfile = \"a\"\nrole = \"train\"\n[[record]]\nfile = \"b\"\nrole = \"validate\"\n\
                    [base]\nterms = [\"stiffness@x\", \"viscous@x\"]\n";
        let logs = [record("a", 0.3), record("b", 1.9)];
        let study = Study::of_memory("memory", text, &logs).unwrap();
        let mut model = identify::physical(&study).unwrap().model;
        let prepared = Prepared::for_model(&study, &model).unwrap();
        // Beside spring and damper alone the drag would have to be negative.
        let alone = add::add_to(&study, &prepared, &model, &["quadratic_drag@x".into()]).unwrap();
        assert_eq!(alone.unphysical.as_deref(), Some("quadratic_drag@x"));
        assert!(
            add::add(&study, &model, &["quadratic_drag@x".into()])
                .unwrap()
                .model
                .warnings
                .iter()
                .any(|w| w.starts_with("quadratic_drag@x has a value that is not physical"))
        );

        let found = ["quadratic_drag", "coulomb"].map(|effect| Found {
            effect: effect.into(),
            axis: "x".into(),
        });
        let mut staircase = Staircase {
            judged_on: JudgedOn::Validation,
            steps: Vec::new(),
            noise_floor: PerAxis::default(),
            ended: String::new(),
        };
        let ended = add_all(
            (&study, &prepared),
            &mut model,
            &found,
            &mut staircase,
            &|_| (),
        )
        .unwrap();
        let steps: Vec<_> = staircase.steps.iter().map(|s| s.added.join(", ")).collect();
        assert_eq!(
            (ended, steps),
            (
                None,
                vec!["coulomb@x".to_string(), "quadratic_drag@x".into()]
            )
        );
        let values = model.effects_in_si().unwrap();
        let drag = values
            .iter()
            .find(|e| e.entry.about.name == "quadratic_drag")
            .unwrap();
        assert!(
            (drag.values[0] / 80.0 - 1.0).abs() < 0.1,
            "{:?}",
            drag.values
        );
    }
}
