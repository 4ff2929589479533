//! A log that was looked at, as `inspect` and `init` show it: its channels, and a small plot of
//! each.

use crate::study::survey::{Survey, SurveyedColumn};
use crate::text::table::{Table, sample_rate, short};
use crate::text::text_plot::TextPlot;

/// Points of a plot.
const POINTS: usize = 400;

/// A paragraph and a table; with `plots`, each channel drawn.
pub(super) fn in_words(survey: &Survey, plots: bool) -> String {
    let mut text = format!("{}: {}, {} rows", survey.file, survey.format, survey.rows);
    if !survey.blocks.is_empty() {
        text.push_str(&format!(" in {} blocks", survey.blocks.len()));
    }
    match &survey.time {
        Some(time) => {
            text.push_str(&format!(
                ", {} by column {:?}",
                sample_rate(time.rate_hz),
                time.column
            ));
            if time.jitter > 0.1 {
                text.push_str(&format!(
                    ", stamps up to {:.2} of a sample off",
                    time.jitter
                ));
            }
            match time.gaps {
                [0, _] => {}
                [1, _] => text.push_str(", one sample missing"),
                [missing, 1] => text.push_str(&format!(", {missing} samples missing in one place")),
                [missing, places] => {
                    text.push_str(&format!(", {missing} samples missing in {places} places"))
                }
            }
            text.push('.');
        }
        None => text.push_str("; no column counts the time."),
    }
    let mut table = Table::new(&[
        "column",
        "unit",
        "rows",
        "without number",
        "lowest",
        "highest",
        "RMS about mean",
        "smallest step",
    ]);
    for column in &survey.columns {
        table.row(vec![
            column.name.clone(),
            column.unit.clone().unwrap_or_else(|| "–".into()),
            column.values.len().to_string(),
            column.missing.to_string(),
            short(column.range[0]),
            short(column.range[1]),
            short(column.rms),
            column.step.map_or("–".into(), short),
        ]);
    }
    text.push_str(&format!("\n{table}"));
    for note in &survey.notes {
        text.push_str(&format!("\nNote: {note}."));
    }
    if plots {
        let time = survey.time.as_ref().map(|t| t.column.as_str());
        for column in survey
            .columns
            .iter()
            .filter(|c| Some(c.name.as_str()) != time && c.rms > 0.0)
        {
            text.push_str(&format!("\n\n{}", plot(survey, column)));
        }
    }
    text
}

/// Value over time, or over the row where no column counts the time.
fn plot(survey: &Survey, column: &SurveyedColumn) -> String {
    let rows = column.values.len();
    let step = rows.div_ceil(POINTS).max(1);
    let (low, high) = (column.range[0], column.range[1]);
    let middle = 0.5 * (low + high);
    let seconds = survey
        .time
        .as_ref()
        .map_or(rows as f64, |t| rows as f64 / t.rate_hz);
    let points: Vec<(f64, f64)> = column
        .values
        .iter()
        .enumerate()
        .step_by(step)
        // The plot's axes cross at 0; a log starts at 0, so it is drawn about its middle.
        .map(|(row, value)| ((row as f64 / rows as f64 - 0.5) * seconds, value - middle))
        .collect();
    let unit = column.unit.as_deref().unwrap_or("–");
    let up = match middle.abs() > 1e-3 * (high - low) {
        true => format!("{} − {} [{unit}]", column.name, short(middle)),
        false => format!("{} [{unit}]", column.name),
    };
    let over = match &survey.time {
        Some(_) => format!("s from the middle of {seconds:.2} s"),
        None => format!("rows from the middle of {rows}"),
    };
    let plot = TextPlot {
        width: 60,
        height: 5,
        x: &over,
        y: &up,
    };
    plot.draw(&points)
}

/// The same as JSON, without the numbers themselves.
pub(super) fn as_json(survey: &Survey) -> serde_json::Value {
    let columns: Vec<_> = survey
        .columns
        .iter()
        .map(|c| {
            serde_json::json!({
                "name": c.name,
                "unit": c.unit,
                "rows": c.values.len(),
                "without_number": c.missing,
                "range": c.range,
                "rms": c.rms,
                "smallest_step": c.step,
            })
        })
        .collect();
    serde_json::json!({
        "file": survey.file,
        "format": survey.format,
        "rows": survey.rows,
        "time": survey.time,
        "columns": columns,
        "notes": survey.notes,
    })
}
