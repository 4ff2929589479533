//! Logs that no study describes yet: what is in them, what `init` guesses, and every channel as a
//! plot.

use super::folder::Folder;
use crate::report::page::thinned;
use crate::study::Convention;
use crate::study::draft::{self, Draft, DraftAxis, DraftChannel, UserChoices};
use crate::study::survey::{Survey, SurveyedColumn};
use crate::text::error::Result;
use serde_json::{Value, json};

/// Points of a channel's plot.
const POINTS: usize = 600;

/// What the page shows of the logs, with what the user has said of them.
pub(super) fn draft(folder: &Folder, said: &UserChoices) -> Result<Value> {
    let look = |log: &String| {
        let mut survey = Survey::of(&folder.path.join(log))?;
        survey.file.clone_from(log);
        Ok(survey)
    };
    let surveys: Vec<Survey> = folder.logs.iter().map(look).collect::<Result<_>>()?;
    let guessed = draft::draft(&surveys, said);
    let logs: Vec<Value> = surveys.iter().map(log).collect();
    let columns = surveys.first().map_or(Vec::new(), |first| {
        first.columns.iter().map(|c| c.name.clone()).collect()
    });
    Ok(json!({
        "logs": logs,
        "columns": columns,
        "guess": guessed.as_ref().ok().map(guess),
        "sentence": guessed.as_ref().err().map(|e| e.sentence.clone()),
        "text": guessed.as_ref().ok().map(draft::text),
        "said": { "columns": said.columns, "rate": said.sample_rate_hz, "inertia": said.inertia },
    }))
}

fn log(survey: &Survey) -> Value {
    json!({
        "file": survey.file,
        "format": survey.format,
        "rows": survey.rows,
        "time": survey.time,
        "notes": survey.notes,
        "columns": survey.columns.iter().map(column).collect::<Vec<_>>(),
    })
}

fn column(column: &SurveyedColumn) -> Value {
    let (rows, values) = thinned(&column.values, POINTS);
    json!({
        "name": column.name,
        "unit": column.unit,
        "missing": column.missing,
        "range": column.range,
        "rms": column.rms,
        "of": column.values.len(),
        "rows": rows,
        "values": values,
    })
}

fn guess(draft: &Draft) -> Value {
    let records: Vec<Value> = draft
        .records
        .iter()
        .map(|r| {
            let role = r.role.words();
            json!({ "file": r.file, "role": role, "rows": r.rows })
        })
        .collect();
    json!({
        "sample_rate_hz": draft.sample_rate_hz,
        "time": draft.time,
        "axes": draft.axes.iter().map(axis).collect::<Vec<_>>(),
        "records": records,
        "findings": draft.findings,
    })
}

fn axis(axis: &DraftAxis) -> Value {
    let channel = |c: &DraftChannel| json!({ "column": c.column, "unit": c.unit, "scale": c.scale, "guessed": c.guessed });
    let convention = match axis.restoring_force {
        Convention::InertiaMinusForce => "inertia minus force",
        Convention::ForceMinusInertia => "force minus inertia",
    };
    json!({
        "name": axis.name,
        "kind": axis.kind.name(),
        "inertia_unit": axis.kind.inertia_unit(),
        "displacement": axis.displacement.iter().map(channel).collect::<Vec<_>>(),
        "velocity": axis.velocity.as_ref().map(channel),
        "acceleration": axis.acceleration.as_ref().map(channel),
        "force": axis.force.as_ref().map(channel),
        "inertia": axis.inertia,
        "inertia_seen": axis.inertia_seen,
        "restoring_force": convention,
        "base": axis.base,
    })
}
