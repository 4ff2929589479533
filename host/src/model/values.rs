//! The values of a model's effects as people read them.

use super::effects::{ModelEffect, ParameterValue, is_correction};
use crate::text::table::{Table, significant};
use jointwatch_shared::effect::Entry;

/// The displacements at which an effect's stops are met, as the study counts them: −x₁ + d of the
/// upper one, x₁ − d of the lower one, of those that have a force; nothing for an effect without
/// such stops.
///
/// Its parameters count from the far ends of the travel, which nobody finds at the joint.
pub fn stops(effect: &str, parameters: &[ParameterValue]) -> Vec<ParameterValue> {
    let entry = effect.split('*').next().and_then(Entry::named);
    let entry = entry.filter(|e| e.parameters().len() == parameters.len());
    let Some((entry, [upper, lower, end])) = entry.and_then(|e| Some((e, e.stops?))) else {
        return Vec::new();
    };
    let end = parameters[end].value;
    let stop = |name: &str, distance: &ParameterValue, sign: f64| {
        let at = |distance: f64| sign * (distance - end);
        let ordered = |[low, high]: [f64; 2]| [at(low).min(at(high)), at(low).max(at(high))];
        ParameterValue {
            name: name.into(),
            value: at(distance.value),
            unit: distance.unit.clone(),
            interval: distance.interval.map(ordered),
        }
    };
    let both = [
        stop("upper_stop_at", &parameters[upper], 1.0),
        stop("lower_stop_at", &parameters[lower], -1.0),
    ];
    // One without a force is none.
    let strengths = entry.one_is_enough.iter();
    let stands = strengths.map(|&strength| parameters[strength].value != 0.0);
    let both = both.into_iter().zip(stands);
    both.filter_map(|(stop, stands)| stands.then_some(stop))
        .collect()
}

/// Every parameter of a model's effects, in a table.
pub fn table(effects: &[ModelEffect]) -> Table {
    // Where everything acts in the joint, a column that says so only takes room.
    let corrects = effects.iter().any(|e| is_correction(&e.effect));
    // A refinement by simulation knows no intervals, and a blob keeps none.
    let mut parameters = effects.iter().flat_map(|e| &e.parameters);
    let intervals = parameters.any(|p| p.interval.is_some());
    let mut heading = vec!["effect", "parameter", "value"];
    if intervals {
        heading.push("95 % interval");
    }
    heading.push("unit");
    if corrects {
        heading.push("is part of");
    }
    let mut table = Table::new(&heading);
    for effect in effects {
        let mut name = effect.name();
        let stops = stops(&effect.effect, &effect.parameters);
        for parameter in effect.parameters.iter().chain(&stops) {
            let mut row = vec![
                std::mem::take(&mut name),
                parameter.name.clone(),
                significant(parameter.value),
            ];
            if intervals {
                let known = parameter.interval;
                row.push(match known {
                    None => "not determined".into(),
                    Some([low, high]) if low == high => "given".into(),
                    Some([low, high]) => {
                        format!("{} to {}", significant(low), significant(high))
                    }
                });
            }
            row.push(parameter.unit.clone());
            if corrects {
                row.push(if is_correction(&effect.effect) {
                    "the instruments: corrects the data".into()
                } else {
                    "the joint".into()
                });
            }
            table.row(row);
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::effects::AxisEffect;
    use jointwatch_shared::base::axis::AxisKind;
    use jointwatch_shared::effect::about::Parameter;

    #[test]
    fn stops_are_met_where_their_laws_begin() {
        for name in ["offset_stops", "offset_contact"] {
            let entry = Entry::named(name).expect("an effect");
            let bound = AxisEffect {
                entry,
                axis: 0,
                input: None,
            };
            // Stops at 1 mm and at −3 mm, where the travel ends at 4 mm.
            let of = |parameter: &Parameter| match parameter.symbol {
                "d_u" => 5e-3,
                "d_l" => 7e-3,
                "x₁" => 4e-3,
                _ => 1.0,
            };
            let values: Vec<f64> = entry.parameters().iter().map(of).collect();
            let intervals: Vec<_> = values.iter().map(|v| Some([0.9 * v, 1.1 * v])).collect();
            let kinds = [AxisKind::Translation];
            let effect = ModelEffect::new(&bound, &["x"], &kinds, &values, &intervals);
            let stops = stops(name, &effect.parameters);
            let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
            assert!(near(stops[0].value, 1e-3), "{stops:?}");
            assert!(near(stops[1].value, -3e-3), "{stops:?}");
            let [low, high] = stops[1].interval.expect("an interval");
            assert!(near(low, -3.7e-3) && near(high, -2.3e-3), "{stops:?}");
        }
    }
}
