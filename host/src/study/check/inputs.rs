//! Inputs from which nothing can be learnt: those that never change, and those that are a channel
//! of the joint once more.

use crate::study::{Channels, Input, Record, Study};

/// Two series with this share of their power in common are one: noise of sensors of their own would
/// show.
const SAME: f64 = 1.0 - 1e-7;

/// A sentence for every input that is the same in all rows, and for every one that is a channel of
/// an axis but for scale and offset.
pub(in crate::study) fn inputs(study: &Study) -> Vec<String> {
    let sentences = study.inputs.iter().map(|input| {
        constant(study, input).or_else(|| {
            let axes = study.axes.iter().enumerate();
            let mut copied = axes.filter_map(|(place, axis)| {
                let channel = copied(study, input, place)?;
                Some(format!(
                    "the input {:?} is the {channel} of {} but for its scale, so what follows it follows nothing but the joint: name another \
                     column, or none",
                    input.name, axis.name
                ))
            });
            copied.next()
        })
    });
    sentences.flatten().collect()
}

fn constant(study: &Study, input: &Input) -> Option<String> {
    let records = study.records.iter();
    let mut rows = records.filter_map(|r| r.input(&input.name)).flatten();
    let first = rows.next();
    rows.all(|value| Some(value) == first).then(|| {
        format!(
            "the input {:?} is the same in all rows, so nothing can be told of what follows it: log runs with other values",
            input.name
        )
    })
}

/// The channel of an axis that the input is in every record.
fn copied(study: &Study, input: &Input, axis: usize) -> Option<&'static str> {
    type Of = fn(&Channels) -> Option<Vec<f64>>;
    let channels: [(&str, Of); 4] = [
        ("displacement", |c| Some(c.relative_displacement())),
        ("velocity", |c| c.velocity.clone()),
        ("acceleration", |c| c.acceleration.clone()),
        ("force", |c| Some(c.force.clone())),
    ];
    let is_one = |record: &Record, of: Of| {
        let series = record.axes.get(axis).and_then(of);
        let own = record.input(&input.name);
        own.zip(series)
            .is_some_and(|(own, series)| shared(own, &series) > SAME)
    };
    let found = channels
        .into_iter()
        .find(|(_, of)| study.records.iter().all(|r| is_one(r, *of)));
    found.map(|(name, _)| name)
}

/// The square of the correlation of two series; 0 where one never changes.
fn shared(a: &[f64], b: &[f64]) -> f64 {
    let count = a.len().min(b.len()).max(1) as f64;
    let mean = |s: &[f64]| s.iter().sum::<f64>() / count;
    let (p, q) = (mean(a), mean(b));
    let [mut aa, mut ab, mut bb] = [0.0; 3];
    for (a, b) in a.iter().zip(b) {
        let (a, b) = (a - p, b - q);
        (aa, ab, bb) = (aa + a * a, ab + a * b, bb + b * b);
    }
    if aa * bb > 0.0 {
        ab * ab / (aa * bb)
    } else {
        0.0
    }
}
