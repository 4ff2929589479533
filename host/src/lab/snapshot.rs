//! The state as the pages are told it.

use super::models::{self, Entry};
use super::state::{Opened, State};
use crate::study::Study;
use crate::study::quasi_static::is_rate_independent;
use jointwatch_shared::effect::{Acts, EFFECTS};
use serde_json::{Value, json};

/// Everything but what is drawn and the draft, which a page asks for by their numbers.
pub(super) fn snapshot(state: &State, revision: u64) -> Value {
    let (opened, study, sentence) = match &state.opened {
        Opened::Reading => ("reading", None, None),
        Opened::Missing => ("missing", None, None),
        Opened::Study(study) => ("study", Some(study), None),
        Opened::Long => ("long", None, None),
        Opened::Wrong(sentence) => ("wrong", None, Some(sentence)),
    };
    let all = 0..state.models.len();
    let parent = |at| models::parent(&state.models, at).map(|p| state.models[p].file.clone());
    let models: Vec<Value> = all.map(|at| model(&state.models[at], parent(at))).collect();
    let current = state.current.map(|at| &state.models[at]);
    let view = state
        .view()
        .map(|v| json!({ "key": v.key, "model": v.model, "beside": v.beside }));
    let job = state.job.as_ref().map(|j| {
        json!({ "what": j.what, "command": j.command, "said": j.said, "seconds": j.begun.elapsed().as_secs_f64() })
    });
    let done: Vec<Value> = state
        .done
        .iter()
        .map(|d| {
            json!({
                "what": d.what, "command": d.command, "done": d.done, "said": d.said, "seconds": d.seconds,
                "useless": d.useless,
            })
        })
        .collect();
    json!({
        "revision": revision,
        "version": env!("CARGO_PKG_VERSION"),
        "folder": state.folder.path,
        "file": state.folder.study,
        "opened": opened,
        "study": study,
        "long": state.long.as_ref().map(|long| long.told()),
        "studies": state.studies,
        "sentence": sentence,
        "logs": state.folder.logs,
        "drafted": state.draft.is_some(),
        "models": models,
        "current": current.map(|m| &m.file),
        "diagnosis": state.diagnosis(),
        "view": view,
        "blob": state.blob.as_ref().filter(|(_, m)| current.is_some_and(|c| c.file == *m)).map(|(b, _)| b),
        "job": job,
        "done": done,
    })
}

fn model(model: &Entry, parent: Option<String>) -> Value {
    json!({
        "file": model.file,
        "stem": model.stem(),
        "base": model.base,
        "effects": model.effects,
        "errors": model.errors,
        "validated": model.validated,
        "warnings": model.warnings,
        "parent": parent,
        "diagnosed": model.diagnosis.is_some(),
    })
}

/// What the page says of a study, and which effects could be added to its models.
pub(super) fn of_study(study: &Study, checks: &[String]) -> Value {
    let timed = !study.quasi_static;
    let axes: Vec<Value> = study
        .axes
        .iter()
        .map(|a| {
            json!({
                "name": a.name, "kind": a.kind.name(), "inertia": a.inertia, "inertia_unit": a.kind.inertia_unit(),
                "force_unit": a.kind.force_unit(),
            })
        })
        .collect();
    let records: Vec<Value> = study
        .records
        .iter()
        .map(|r| {
            let role = r.role.words();
            let seconds = timed.then(|| r.rows as f64 / study.sample_rate_hz);
            json!({ "file": r.file, "role": role, "rows": r.rows, "seconds": seconds })
        })
        .collect();
    let usable = EFFECTS.iter().filter(|e| timed || is_rate_independent(e));
    let names = usable.flat_map(|entry| {
        let on = |axis: &crate::study::Axis| format!("{}@{}", entry.about.name, axis.name);
        match entry.acts {
            Acts::BothAxes => vec![entry.about.name.to_string()],
            _ => study.axes.iter().map(on).collect(),
        }
    });
    json!({
        "name": study.name,
        "sample_rate_hz": timed.then_some(study.sample_rate_hz),
        "axes": axes,
        "records": records,
        "base_terms": study.base_terms,
        "effects": names.collect::<Vec<_>>(),
        "notes": study.notes,
        "checks": checks,
    })
}
