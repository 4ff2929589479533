//! The physical terms that missing effects are searched beside.

use crate::fit::identify::base_terms;
use crate::model::effects::AxisEffect;
use crate::model::file::{Base, ModelFile};
use crate::study::Study;
use crate::text::error::Result;

/// Every parameter of every term, SI.
pub(super) type Values = Vec<Vec<f64>>;

/// The physical terms to search beside, and where they are known from a fit, their values.
pub(super) fn base_of(
    study: &Study,
    model: &ModelFile,
    notes: &mut Vec<String>,
) -> Result<(Vec<AxisEffect>, Option<Values>)> {
    let names: Vec<&str> = model.axes.iter().map(|a| a.name.as_str()).collect();
    if let Base::None(_) = model.base {
        let terms = model
            .effects
            .iter()
            .map(|e| AxisEffect::parse(&e.name(), &names));
        let values = model.effects_in_si()?.into_iter().map(|e| e.values);
        return Ok((terms.collect::<Result<_>>()?, Some(values.collect())));
    }
    let (mut terms, proposed) = base_terms(study)?;
    // What was added to it before is no longer missing.
    for effect in &model.effects {
        let added = AxisEffect::parse(&effect.name(), &names)?;
        terms.retain(|term| *term != added && !term.rules_out(&added));
        terms.push(added);
    }
    notes.push(format!(
        "a {} takes up most of what a missing effect does, so the effect is named beside the study's physical base instead",
        model.base.name()
    ));
    notes.extend(proposed);
    Ok((terms, None))
}
