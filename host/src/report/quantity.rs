//! A quantity on an axis of a drawing: its name, the unit with a fitting prefix, and the numbers
//! along the axis.

use crate::text::units::prefixed;

/// A physical quantity, and how its SI values become the numbers on paper.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Quantity {
    name: String,
    unit: String,
    factor: f64,
}

impl Quantity {
    /// A quantity of which the largest value drawn is `peak` (in `unit`, an SI symbol).
    pub(super) fn new(name: &str, unit: &str, peak: f64) -> Self {
        let (unit, factor) = prefixed(unit, peak);
        Self {
            name: name.into(),
            unit,
            factor,
        }
    }

    /// Name and unit, as they stand along the axis.
    pub(super) fn label(&self) -> String {
        format!("{} ({})", self.name, self.unit)
    }

    /// A value in the unit of the label.
    pub(super) fn scaled(&self, value: f64) -> f64 {
        self.factor * value
    }
}

/// A number along an axis that spans `span`: no more decimals than the ticks differ by, and a minus
/// that is not a hyphen.
pub(super) fn tick(value: f64, span: f64) -> String {
    // Ticks are about a fifth of the span apart, in steps of 1, 2 or 5.
    let decimals = (-(0.1 * span).log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{:.decimals$}", value.abs());
    let text = if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    };
    if value < 0.0 && text != "0" {
        format!("−{text}")
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prefixes_keep_the_numbers_readable() {
        let quantity = Quantity::new("displacement of x", "m", 0.0024);
        assert_eq!(quantity.label(), "displacement of x (mm)");
        assert!((quantity.scaled(0.0024) - 2.4).abs() < 1e-12);
        assert_eq!(Quantity::new("force", "N", 37.0).label(), "force (N)");
        assert_eq!(Quantity::new("x", "m", 2e-6).label(), "x (µm)");
        assert_eq!(Quantity::new("x", "N", 2.1e4).label(), "x (kN)");
    }

    #[test]
    fn ticks_say_what_they_differ_by_and_no_more() {
        assert_eq!(tick(-0.5, 3.0), "−0.5");
        assert_eq!(tick(20.0, 100.0), "20");
        assert_eq!(tick(0.30000000000000004, 0.6), "0.3");
        assert_eq!(tick(-1e-17, 2.0), "0");
        assert_eq!(tick(0.02, 0.1), "0.02");
        assert_eq!(tick(1200.0, 5000.0), "1200");
    }
}
