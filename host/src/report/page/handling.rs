//! What was done to the data before anything was fitted: channels, filters, corrections, and what
//! to be wary of.

use super::asked::Asked;
use super::contents::Handling;
use crate::assess::data_checks;
use crate::model::corrections;
use crate::study::{Study, mistakes};
use crate::text::table::rounded;

/// The keys of an `[[axis]]` that name channels.
const CHANNELS: [&str; 5] = [
    "displacement",
    "velocity",
    "body_position",
    "acceleration",
    "force",
];

/// Gathers it from the study, its file, the model and what the search said.
pub(super) fn gather(asked: &Asked<'_>) -> Handling {
    let (study, model) = (asked.study, asked.model);
    let filters = &model.filters;
    let hz = |value: f64| format!("{} Hz", rounded(value));
    let taps = |count: usize| {
        let lost_ms = 1e3 * (count / 2) as f64 / filters.sample_rate_hz;
        format!("{count} taps, {} ms at either end", rounded(lost_ms))
    };
    let row = |what: &str, value: String| [what.to_string(), value];
    let filtered = || {
        vec![
            row("Sample rate", hz(study.sample_rate_hz)),
            row("Common band of forces and errors", hz(filters.band_hz)),
            row("Band of the states", hz(filters.state_band_hz)),
            row("Low-pass of the common band", taps(filters.band.len())),
            row("Differentiators", taps(filters.velocity.len())),
        ]
    };
    Handling {
        channels: channels(study).unwrap_or_default(),
        filters: match filters.quasi_static {
            true => vec![row("Filters", "none: rows are taken as they are".into())],
            false => filtered(),
        },
        reason: filters.reason.clone(),
        corrections: corrections::in_words(&model.effects),
        notes: study.notes.clone(),
        problems: data_checks::sentences(data_checks::check(study, filters)),
        warnings: model.warnings.clone(),
        checks: mistakes::check(study),
        remarks: asked.remarks.clone(),
    }
}

/// Axis, channel, columns, unit and scale as the study's file has them; none where that file is no
/// longer there.
fn channels(study: &Study) -> Option<Vec<[String; 5]>> {
    let text = std::fs::read_to_string(&study.path).ok()?;
    let described: toml::Table = toml::from_str(&text).ok()?;
    let mut rows = Vec::new();
    for axis in described.get("axis")?.as_array()? {
        let name = axis.get("name").and_then(|n| n.as_str())?;
        for key in CHANNELS {
            match axis.get(key) {
                Some(toml::Value::Array(several)) => {
                    rows.extend(several.iter().map(|channel| row(name, key, channel)));
                }
                Some(channel) => rows.push(row(name, key, channel)),
                None => {}
            }
        }
    }
    Some(rows)
}

/// One channel: a column's name or a table.
fn row(axis: &str, key: &str, channel: &toml::Value) -> [String; 5] {
    let part = |name: &str| match channel.get(name) {
        Some(toml::Value::String(text)) => Some(text.clone()),
        Some(other) => Some(other.to_string()),
        None => None,
    };
    let column = channel
        .as_str()
        .map(String::from)
        .or_else(|| part("column"));
    let calibration = match (part("scale"), part("offset")) {
        (None, None) => "as logged".into(),
        (scale, offset) => format!(
            "× {}{}",
            scale.unwrap_or_else(|| "1".into()),
            offset.map_or(String::new(), |o| format!(" + {o}"))
        ),
    };
    [
        axis.into(),
        key.replace('_', " "),
        column.unwrap_or_default(),
        part("unit").unwrap_or_else(|| "SI".into()),
        calibration,
    ]
}

#[cfg(test)]
mod tests {
    use super::row;

    #[test]
    fn a_channel_is_a_column_or_a_table() {
        let plain = toml::Value::String("F_N".into());
        assert_eq!(
            row("x", "force", &plain),
            ["x", "force", "F_N", "SI", "as logged"]
        );
        let table: toml::Table =
            toml::from_str("column = \"vir\"\nscale = 35.5\nunit = \"kN\"").unwrap();
        let seen = row("x", "force", &toml::Value::Table(table));
        assert_eq!(seen, ["x", "force", "vir", "kN", "× 35.5"]);
    }
}
