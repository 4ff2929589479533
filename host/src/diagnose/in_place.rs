//! Models in which something else stands in the place of an effect: nothing, its special case, or
//! what it stood in for.

use super::add::{self, Added};
use crate::fit::identify::Prepared;
use crate::model::ModelEffect;
use crate::model::effects::AxisEffect;
use crate::model::file::{Base, ModelFile};
use crate::study::Study;
use crate::text::error::Result;
use jointwatch_shared::effect::Entry;

/// The model without an effect, or with its special case in its place, as dry friction is of one
/// with a strength per direction, and the name of that; `None` where the error on any axis is
/// clearly higher with either.
///
/// # Errors
/// As [`add::add`].
pub fn simplified(
    study: &Study,
    prepared: &Prepared,
    from: &ModelFile,
    effect: &str,
) -> Result<Option<(Option<String>, Added)>> {
    let names: Vec<&str> = study.axes.iter().map(|a| a.name.as_str()).collect();
    for (terms, special) in without(from, effect, &[], &names)? {
        let special = special.map(|special| special.name(&names));
        let mut added = add::refitted(study, prepared, from, terms, special.as_slice())?;
        if is_as_good(&added) {
            match &special {
                Some(special) => added.model.warnings.push(format!(
                    "{special} takes the place of {effect}, which explains no more with more values"
                )),
                None => {
                    if let Some(last) = added.model.history.last_mut() {
                        last.what = format!("left out: {effect}");
                    }
                }
            }
            return Ok(Some((special, added)));
        }
    }
    Ok(None)
}

/// The model with new effects, and nothing or its special case in the place of one that was added
/// before and means nothing beside them: what stood in for something is not needed where that is
/// found. Of several the one that leaves least, with the names of what is new in it; `None` where
/// an error rises, or none falls.
pub(super) fn instead(
    (study, prepared): (&Study, &Prepared),
    from: &ModelFile,
    other: &str,
    names: &[String],
) -> Option<(Vec<String>, Added)> {
    let axes: Vec<&str> = study.axes.iter().map(|a| a.name.as_str()).collect();
    let ways = without(from, other, names, &axes).ok()?.into_iter();
    let ways = ways.filter_map(|(terms, special)| {
        let special = special.map(|special| special.name(&axes));
        let all: Vec<String> = names.iter().cloned().chain(special).collect();
        let mut added = add::refitted(study, prepared, from, terms, &all).ok()?;
        added.model.warnings.push(format!(
            "{} takes the place of {other}, which means nothing beside it",
            all.join(", ")
        ));
        (added.helps && is_as_good(&added)).then_some((all, added))
    });
    let left = |added: &Added| -> f64 {
        let errors = added.errors.after.iter();
        errors.map(|e| e.relative_error).sum()
    };
    ways.min_by(|(_, a), (_, b)| left(a).total_cmp(&left(b)))
}

/// A model's terms and new ones, with nothing in the place of one of them and with each of its
/// special cases there.
fn without(
    from: &ModelFile,
    effect: &str,
    new: &[String],
    axes: &[&str],
) -> Result<Vec<(Vec<AxisEffect>, Option<AxisEffect>)>> {
    let bound = AxisEffect::parse(effect, axes)?;
    let others = from.effects.iter().map(ModelEffect::name);
    let others = others.filter(|name| name != effect);
    let others: Vec<String> = others.chain(new.iter().cloned()).collect();
    let others = AxisEffect::parse_all(&others, axes)?;
    let special = bound.entry.replaces.iter().filter_map(|n| Entry::named(n));
    let special = special.map(|entry| AxisEffect { entry, ..bound });
    let allowed =
        special.filter(|s| !others.contains(s) && !others.iter().any(|term| s.rules_out(term)));
    // A sum of effects has one at least.
    let none = (!others.is_empty() || !matches!(from.base, Base::None(_))).then_some(None);
    let places = none.into_iter().chain(allowed.map(Some));
    let ways = places.map(|place| (others.iter().copied().chain(place).collect(), place));
    Ok(ways.collect())
}

/// Whether a model with other effects means something and no error is clearly higher.
fn is_as_good(added: &Added) -> bool {
    let mut pairs = added.errors.before.iter().zip(&added.errors.after);
    let as_good = pairs.all(|(b, a)| a.relative_error < (1.0 + add::MIN_HELP) * b.relative_error);
    as_good && added.means_something()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::identify;
    use crate::study::MemoryLog;
    use std::f64::consts::TAU;

    /// A spring, a damper and dry friction, of which the force is logged 4 ms late.
    fn record(name: &str, phase: f64) -> MemoryLog {
        let rate_hz = 500.0;
        let tones = |t: f64, quarter: f64| -> f64 {
            let tone = |f: f64| {
                (TAU * f).powf(quarter) * (TAU * f * t + phase * f + quarter * TAU / 4.0).sin()
            };
            4e-3 * (tone(1.1) + 0.6 * tone(2.3) + 0.4 * tone(3.7))
        };
        let time = |row: usize| row as f64 / rate_hz;
        let x = (0..4000).map(|row| tones(time(row), 0.0)).collect();
        let force = |row: usize| {
            let then = time(row) - 0.004;
            let v = tones(then, 1.0);
            let noise = 0.02 * (row as f64 * row as f64 * 0.7).sin();
            2e3 * tones(then, 0.0) + 40.0 * v + 12.0 * (v / 4e-3).tanh() + noise
        };
        MemoryLog {
            name: name.into(),
            columns: vec![
                ("x".into(), x),
                ("F".into(), (0..4000).map(force).collect()),
            ],
        }
    }

    #[test]
    fn what_stood_in_for_a_late_channel_gives_way_to_it() {
        let text = "sample_rate_hz = 500.0\n[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = \"x\"\nforce = \"F\"\n\
                    inertia = 0\n[[record]]\nfile = \"a\"\nrole = \"train\"\n[[record]]\nfile = \"b\"\nrole = \"validate\"\n\
                    [base]\nterms = [\"stiffness@x\", \"viscous@x\", \"lagged_friction@x\"]\n";
        let study =
            Study::of_memory("memory", text, &[record("a", 0.3), record("b", 1.9)]).unwrap();
        let model = identify::physical(&study).unwrap().model;
        let prepared = Prepared::for_model(&study, &model).unwrap();
        let (new, added) = instead(
            (&study, &prepared),
            &model,
            "lagged_friction@x",
            &["time_delay@x".into()],
        )
        .unwrap();
        assert_eq!(new, ["time_delay@x", "coulomb@x"]);
        let [before, after] =
            [&added.errors.before, &added.errors.after].map(|e| e[0].relative_error);
        println!("{before:.4} → {after:.4}");
        assert!(after < 0.5 * before);
        // Nothing takes the place of the spring.
        assert!(
            instead(
                (&study, &prepared),
                &model,
                "stiffness@x",
                &["time_delay@x".into()]
            )
            .is_none()
        );
    }
}
