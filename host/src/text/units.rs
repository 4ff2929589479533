//! Units as people read them: SI symbols with the prefix that suits a value.

/// An SI unit with the prefix that suits values of which the largest is `peak` (small ones get
/// milli or micro, large ones kilo), and what an SI value is multiplied by to be in it.
pub(crate) fn prefixed(unit: &str, peak: f64) -> (String, f64) {
    let (prefix, factor) = if peak >= 5e3 {
        ("k", 1e-3)
    } else if peak >= 0.1 || peak == 0.0 {
        ("", 1.0)
    } else if peak >= 1e-4 {
        ("m", 1e3)
    } else {
        ("µ", 1e6)
    };
    (format!("{prefix}{unit}"), factor)
}
