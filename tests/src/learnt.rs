//! Values in models that were read as JSON.

use serde_json::Value;

/// The first parameter of an effect.
///
/// # Panics
/// When the model has no such effect.
pub fn value(model: &Value, effect: &str) -> f64 {
    number(&named(&model["effects"], "effect", effect)["parameters"][0])
}

/// A parameter of an effect.
///
/// # Panics
/// When the model has no such effect, or the effect no such parameter.
pub fn parameter(model: &Value, effect: &str, name: &str) -> f64 {
    let effect = named(&model["effects"], "effect", effect);
    number(named(&effect["parameters"], "name", name))
}

fn named<'a>(list: &'a Value, key: &str, name: &str) -> &'a Value {
    let mut all = list.as_array().expect("a list").iter();
    let found = all.find(|one| one[key] == name);
    found.unwrap_or_else(|| panic!("{name} is not among {list}"))
}

fn number(parameter: &Value) -> f64 {
    parameter["value"].as_f64().expect("a number")
}
