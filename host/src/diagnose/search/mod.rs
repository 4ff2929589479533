//! The decision on every axis, and the model that it makes: everything that is missing beside the
//! base, all values found together.

pub(super) mod bench;
pub(super) mod blocks;
pub(super) mod collect;
pub(super) mod descend;
pub(super) mod hypothesis;
mod outcome;
pub(super) mod rank;
pub(super) mod score;
pub(crate) mod start;
pub(super) mod zeros;

use crate::diagnose::criteria;
use crate::diagnose::decide::gains::{falls, is_gained};
use crate::diagnose::decide::{Decision, decide};
use crate::diagnose::errors::{Unseen, relative_errors, shapes_of};
use crate::fit::effects::columns::Records;
use crate::fit::effects::{Solution, solve, solved_at};
use crate::fit::errors::AT_REST_BELOW;
use crate::model::effects::AxisEffect;
use crate::signal::motion::Motion;
use crate::study::Axis;
use crate::text::error::Result;
use crate::text::work;
use bench::{Bench, least_share};
use collect::{Library, candidates};
use hypothesis::{Column, Hypothesis};
use jointwatch_shared::effect::Entry;
use outcome::refuted;
pub(super) use outcome::{Model, Refuted};
use rank::Field;
use zeros::{OWN_ZEROS, Zeros, beside, beside_friction, judged, own_zero};

/// Rows of all records together on which shapes are searched for; hypotheses are judged on all of
/// them.
const MAX_SEARCHED: usize = 20_000;

/// Lags behind which an input may act, ms.
const LAGS_MS: [f64; 20] = [
    1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 50.0, 70.0, 100.0, 150.0, 200.0, 300.0,
    500.0, 1000.0, 2000.0, 5000.0,
];
/// How often a choice that unseen rows refute is opened again.
const MAX_REOPENED: usize = 3;
/// The longest lag that a record shows, beside its length.
const LONGEST_LAG: f64 = 0.2;

/// How a search went.
pub(super) struct Search {
    /// The base, and it with everything that is missing.
    pub(super) first: Model,
    pub(super) last: Model,
    /// What is missing: the effects of the last model that the first has not.
    pub(super) found: Vec<AxisEffect>,
    /// One per axis, in the study's order.
    pub(super) decisions: Vec<Decision>,
    pub(super) refuted: Vec<Refuted>,
    /// Per axis, the zeros of force, where they differ from record to record.
    pub(super) zeros: Vec<Option<Zeros>>,
}

impl Search {
    /// The zeros of force that the last model has.
    pub(super) fn zeros_found(&self) -> Vec<&Zeros> {
        let zeros = self.zeros.iter().flatten();
        zeros.filter(|z| self.found.contains(&z.own)).collect()
    }

    /// The first effect that unseen rows refute on an axis.
    pub(super) fn refuted_on(&self, axis: usize) -> Option<&Refuted> {
        self.refuted.iter().find(|refuted| refuted.axis == axis)
    }
}

/// What a search is given.
pub(super) struct Given<'a> {
    pub(super) axes: &'a [Axis],
    pub(super) motions: &'a [&'a Motion],
    /// Those whose zeros of force are compared, where these are more.
    pub(super) of_zeros: &'a [&'a Motion],
    pub(super) unseen: &'a Unseen<'a>,
    pub(super) low_pass: &'a [f64],
    /// Effects that are not to be thought of: by name, or on one axis.
    pub(super) without: &'a [String],
}

/// Searches for what is missing beside a base, whose fit starts from `values` where they are known.
///
/// Where unseen rows refute what was found, the choice is open again without it, for as long as the
/// errors there fall.
///
/// # Errors
/// As the fit of the terms.
pub(super) fn search(
    given: &Given<'_>,
    base: &[AxisEffect],
    values: Option<Vec<Vec<f64>>>,
) -> Result<Search> {
    let names: Vec<&str> = given.axes.iter().map(|a| a.name.as_str()).collect();
    let error = |search: &Search| -> Result<f64> {
        let last = &search.last;
        Ok(given
            .unseen
            .errors(&last.terms, &last.solution)?
            .iter()
            .sum())
    };
    let mut without = given.without.to_vec();
    let mut best = search_once(given, base, values.clone())?;
    let mut open = best.refuted.clone();
    if open.is_empty() {
        return Ok(best);
    }
    let mut least = error(&best)?;
    for _ in 0..MAX_REOPENED {
        if open.is_empty() {
            break;
        }
        without.extend(open.iter().map(|refuted| refuted.bound.name(&names)));
        let reopened = Given {
            without: &without,
            ..*given
        };
        let mut again = search_once(&reopened, base, values.clone())?;
        let after = error(&again)?;
        if after >= least {
            break;
        }
        least = after;
        open.clone_from(&again.refuted);
        again.refuted.splice(0..0, best.refuted);
        best = again;
    }
    Ok(best)
}

/// One search, in which the choice is made once.
fn search_once(
    given: &Given<'_>,
    base: &[AxisEffect],
    values: Option<Vec<Vec<f64>>>,
) -> Result<Search> {
    let mut records = Records::new(given.axes, given.motions, given.low_pass);
    let from = values.map(|values| shapes_of(&records, base, &values));
    let solution = solve(&records, given.axes, base, from)?;
    let rows: usize = given.motions.iter().map(|m| m.rows()).sum();
    let each = MAX_SEARCHED / given.motions.len().max(1);
    let cut: Vec<Motion> = given.motions.iter().map(|m| m.middle(each)).collect();
    let cut: Vec<&Motion> = cut.iter().collect();
    let alike = |motions| {
        let mut alike = Records::new(given.axes, motions, given.low_pass);
        alike.references = records.references;
        alike
    };
    let mut excerpt = (rows > MAX_SEARCHED).then(|| alike(&cut));
    let mut compared = (!given.of_zeros.is_empty()).then(|| alike(given.of_zeros));
    let (model, inertia) = solution.in_si(base, given.axes);
    for records in excerpt
        .iter_mut()
        .chain(&mut compared)
        .chain([&mut records])
    {
        records.predict(&model, &inertia);
    }
    let mut known = Known {
        terms: base.to_vec(),
        values: solution.solved.values.clone(),
        of_base: base.len(),
        least_shares: least_shares(given, &records, base, &solution),
    };
    let mut decisions: Vec<Decision> = Vec::new();
    let mut zeros: Vec<Option<Zeros>> = given.axes.iter().map(|_| None).collect();
    for axis in order(&records, base, &solution, given.axes.len()) {
        let field = (&records, excerpt.as_ref());
        let compared = compared.as_ref().unwrap_or(&records);
        let (decision, own) = decided(given, field, compared, axis, &known);
        known.take(&decision.hypothesis);
        zeros[axis] = own.map(|own| Zeros::of(compared, &decision.hypothesis, own));
        if let Some(standing) = zeros[axis].as_ref().filter(|zeros| zeros.stand()) {
            known.take(&standing.as_hypothesis());
        }
        decisions.push(decision);
    }
    decisions.sort_by_key(|d| d.axis);
    // The search looks at what is predicted; a fit corrects what was logged.
    records.as_logged();
    let from = shapes_of(&records, &known.terms, &known.values);
    let fitted = if known.terms.len() > known.of_base {
        solve(&records, given.axes, &known.terms, Some(from))?
    } else {
        solved_at(&records, &known.terms, &from)?
    };
    let mut last = Model {
        terms: known.terms,
        solution: fitted,
    };
    let first = (base, solution.solved.values.as_slice());
    let of_zeros = zeros.iter().flatten().map(|z| (z.own, z.gains.clone()));
    let gains = decisions.iter().flat_map(|d| d.gains.iter().cloned());
    let gains: Vec<(AxisEffect, Vec<f64>)> = gains.chain(of_zeros).collect();
    let refuted = refuted(
        (given.unseen, given.axes),
        &records,
        &mut last,
        (known.of_base, &gains),
        first,
    )?;
    let found = last.terms.iter().filter(|term| !base.contains(term));
    Ok(Search {
        found: found.copied().collect(),
        first: Model {
            terms: base.to_vec(),
            solution,
        },
        last,
        decisions,
        refuted,
        zeros,
    })
}

/// The terms that are known so far, those of the base first, with their values.
struct Known {
    terms: Vec<AxisEffect>,
    values: Vec<Vec<f64>>,
    of_base: usize,
    /// Per axis, what an effect explains at least, RMS beside the RMS force.
    least_shares: Vec<f64>,
}

impl Known {
    /// With what was found on an axis. A term that is a special case of it is part of it.
    fn take(&mut self, found: &Hypothesis) {
        let members = found.members.iter().zip(&found.values);
        for (bound, values) in members.skip(found.base) {
            while let Some(at) = self.terms.iter().position(|term| bound.replaces(term)) {
                self.terms.remove(at);
                self.values.remove(at);
                self.of_base -= usize::from(at < self.of_base);
            }
            self.terms.push(*bound);
            self.values.push(values.clone());
        }
    }
}

/// What an effect explains of each axis at least, RMS beside the RMS force of the training records.
///
/// Where the base fails more on the validation records, what explains little of the training
/// records may explain much there: so much less counts as the training records show it less. An
/// axis that rests in validation says nothing.
fn least_shares(
    given: &Given<'_>,
    records: &Records<'_>,
    base: &[AxisEffect],
    solution: &Solution,
) -> Vec<f64> {
    let axes = 0..given.axes.len();
    let Some(validation) = given.unseen.validation() else {
        return axes.map(|axis| least_share(records, axis)).collect();
    };
    let [learnt, unseen] =
        [records, validation].map(|r| relative_errors(r, base, &solution.solved));
    let [of_learnt, of_unseen] = [records, validation].map(|r| &r.references.force);
    axes.map(|axis| {
        let rests = of_unseen[axis] < AT_REST_BELOW * of_learnt[axis];
        let shown = if rests {
            1.0
        } else {
            learnt[axis] / unseen[axis]
        };
        least_share(records, axis) * shown.min(1.0)
    })
    .collect()
}

/// The axes, those of which the base leaves most first: what acts on both is then found where it
/// does most.
fn order(
    records: &Records<'_>,
    base: &[AxisEffect],
    solution: &Solution,
    axes: usize,
) -> Vec<usize> {
    let errors = relative_errors(records, base, &solution.solved);
    let mut order: Vec<usize> = (0..axes).collect();
    order.sort_by(|a, b| errors[*b].total_cmp(&errors[*a]));
    order
}

/// The terms that act on an axis, as a base.
pub(super) fn of_axis(axis: usize, terms: &[AxisEffect], values: &[Vec<f64>]) -> Hypothesis {
    let own = terms
        .iter()
        .zip(values)
        .filter(|(term, _)| term.acts_on(axis));
    let (members, values): (Vec<AxisEffect>, Vec<Vec<f64>>) =
        own.map(|(bound, values)| (*bound, values.clone())).unzip();
    Hypothesis {
        base: members.len(),
        members,
        values,
    }
}

/// The ways in which forces may follow an input: behind the lag at which a spring, a damper and dry
/// friction that follow it and its square explain most beside a base, and as its square too where
/// they explain more with both.
fn ways_to_follow(bench: &Bench<'_>, base: &Hypothesis, input: &'static str) -> Vec<&'static str> {
    let beside = bench.design(base, &bench.parts(base, &[]));
    let entries = ["stiffness", "viscous", "coulomb"].map(Entry::named);
    let following = |way: &'static str| {
        let bound = move |entry| AxisEffect {
            entry,
            axis: bench.axis,
            input: Some(way),
        };
        entries.into_iter().flatten().map(bound)
    };
    let left = |bounds: &mut dyn Iterator<Item = AxisEffect>| {
        let parts = bounds.map(|bound| bench.part(&bound, &bench.middle(&bound)));
        let design = beside.iter().cloned();
        let design: Vec<Column> = design.chain(parts.flat_map(|part| part.columns)).collect();
        bench.solved(&design).1.iter().map(|e| e * e).sum::<f64>()
    };
    let with_square = |way: &'static str| {
        let squares = following(way).filter_map(|bound| bound.squared());
        left(&mut following(way).chain(squares))
    };
    let is_less = |less: f64, than: f64| (than / less).ln() > criteria::LEAST_DIFFERENCE;
    // A force that rises and falls with the input shows its lag beside the square alone.
    let at_once = with_square(input);
    let longest_s = bench.records.longest_s();
    let lags = LAGS_MS
        .into_iter()
        .filter(|ms| 1e-3 * ms < LONGEST_LAG * longest_s);
    let tried = lags.map(|ms| {
        let lagged = AxisEffect::kept_input(&format!("{input}~{ms}ms"));
        (lagged, with_square(lagged))
    });
    let best = tried.min_by(|a, b| a.1.total_cmp(&b.1));
    let lagged = best.filter(|(_, left)| is_less(*left, at_once));
    let (way, both) = lagged.unwrap_or((input, at_once));
    let mut ways = vec![way];
    if is_less(both, left(&mut following(way))) {
        let square = following(way).find_map(|bound| bound.squared()?.input);
        ways.extend(square);
    }
    ways
}

/// The decision on one axis, and with which zeros of force it was made, where they are more than
/// one zero for all records.
///
/// A zero of each record is asked before anything else is searched for, as it costs a number for
/// each and hides next to nothing but the friction of a joint that goes one way in each record. A
/// drift may hide a slow force of the joint, and a large force that is missing hides both. So both
/// are asked again afterwards, and the search beside what is found then has to predict blocks
/// better than the search without, by lines that hold for as long as the records last: where a law
/// of the joint does as well, that is what is missing.
fn decided(
    given: &Given<'_>,
    (records, excerpt): (&Records<'_>, Option<&Records<'_>>),
    compared: &Records<'_>,
    axis: usize,
    known: &Known,
) -> (Decision, Option<AxisEffect>) {
    let mut names = OWN_ZEROS.to_vec();
    let on_axis_of = |name: &str| format!("{name}@{}", given.axes[axis].name);
    names.retain(|name| {
        let mut without = given.without.iter();
        !without.any(|w| w == name || *w == on_axis_of(name))
    });
    let base = of_axis(axis, &known.terms, &known.values);
    let friction = ["coulomb".to_string(), on_axis_of("coulomb")];
    let with_friction = !given.without.iter().any(|w| friction.contains(w));
    let asked = |hypothesis: &Hypothesis, names: &[&str]| {
        let beside = with_friction.then(|| beside_friction(compared, axis, hypothesis));
        own_zero(compared, axis, beside.as_ref().unwrap_or(hypothesis), names)
    };
    let standing: Vec<&str> = names
        .iter()
        .filter(|n| **n == OWN_ZEROS[0])
        .copied()
        .collect();
    let first = asked(&base, &standing);
    let decision = on_axis(given, records, excerpt, axis, known, first);
    let other = [&base, &decision.hypothesis]
        .into_iter()
        .filter_map(|hypothesis| asked(hypothesis, &names))
        .find(|own| Some(*own) != first);
    if let Some(other) = other {
        let beside_it = on_axis(given, records, excerpt, axis, known, Some(other));
        let errors =
            |decision: &Decision, own| judged(compared, axis, &decision.hypothesis, own).log_errors;
        let falls = falls(&errors(&decision, first), &errors(&beside_it, Some(other)));
        if is_gained(&falls) && Zeros::of(compared, &beside_it.hypothesis, other).stand() {
            return (beside_it, Some(other));
        }
    }
    if first.is_some() && asked(&decision.hypothesis, &standing).is_none() {
        // What was found explains what looked like a zero of each record: then one zero for all may
        // be missing.
        return (on_axis(given, records, excerpt, axis, known, None), None);
    }
    (decision, first)
}

/// The decision on one axis, beside all terms that are known; `own_zero` gives every record a zero
/// of its own.
fn on_axis(
    given: &Given<'_>,
    records: &Records<'_>,
    excerpt: Option<&Records<'_>>,
    axis: usize,
    known: &Known,
    own_zero: Option<AxisEffect>,
) -> Decision {
    let (terms, values) = (known.terms.as_slice(), known.values.as_slice());
    let base = beside(own_zero, &of_axis(axis, terms, values));
    let bench = |records| {
        let mut bench = Bench::new(records, axis, &base, own_zero);
        bench.least_share = known.least_shares[axis];
        bench
    };
    let (full, part) = (bench(records), excerpt.map(bench));
    let searched = part.as_ref().unwrap_or(&full);
    let inputs = searched.records.inputs().into_iter();
    let inputs: Vec<&'static str> = inputs
        .flat_map(|name| ways_to_follow(searched, &base, name))
        .collect();
    let name = &given.axes[axis].name;
    work::say(&format!("axis {name}: candidates"));
    let mut candidates = candidates(searched, given.axes, terms, &inputs, given.without);
    if own_zero.is_some() {
        candidates.retain(|bound| bound.effect() != "preload");
    }
    let parts = searched.parts(&base, &[]);
    let own = searched.solved(&searched.design(&base, &parts)).1;
    let mut residual = vec![0.0; searched.records.measured.len()];
    let rows = own.len();
    residual[axis * rows..(axis + 1) * rows].copy_from_slice(&own);
    let library = Library::new(searched, &candidates, terms, values, &residual);
    let field = Field {
        full: &full,
        excerpt: searched,
        library: &library,
        inputs: &inputs,
    };
    work::say(&format!("axis {name}: sets of effects"));
    decide(&field, given.axes.len(), &base)
}
