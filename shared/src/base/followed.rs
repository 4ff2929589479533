//! How it is written what an effect follows: `voltage`, its square `voltage^2`, or `voltage~10ms`
//! behind a first-order lag.

use std::boxed::Box;
use std::collections::BTreeSet;
use std::format;
use std::string::String;
use std::sync::{Mutex, PoisonError};

/// What the force of an effect is proportional to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Follows<'a> {
    /// The name of an input of the study.
    pub name: &'a str,
    /// Whether it is the square of the input.
    pub squared: bool,
    /// The time constant of the first-order lag behind which the input acts, s; 0 without one.
    pub lag_s: f64,
}

impl<'a> Follows<'a> {
    /// Reads `voltage^2~10ms`, of which the power and the lag may be left out. What is neither
    /// stays part of the name.
    pub fn parse(text: &'a str) -> Self {
        let parts = text.split_once('~');
        let lag = parts.and_then(|(name, lag)| {
            let ms: f64 = lag.strip_suffix("ms")?.parse().ok()?;
            (ms > 0.0).then_some((name, 1e-3 * ms))
        });
        let (name, lag_s) = lag.unwrap_or((text, 0.0));
        let square = name.strip_suffix("^2");
        Self {
            name: square.unwrap_or(name),
            squared: square.is_some(),
            lag_s,
        }
    }

    /// The way back; the lag has four significant digits.
    pub fn written(&self) -> String {
        let name = format!("{}{}", self.name, if self.squared { "^2" } else { "" });
        if self.lag_s <= 0.0 {
            return name;
        }
        let ms = 1e3 * self.lag_s;
        let unit = 10_f64.powi(ms.log10().floor() as i32 - 3);
        // A division by a power of ten above 1 ends in fewer digits than a product with its
        // inverse.
        let ms = if unit < 1.0 {
            let per_unit = (1.0 / unit).round();
            (ms * per_unit).round() / per_unit
        } else {
            (ms / unit).round() * unit
        };
        format!("{name}~{ms}ms")
    }
}

/// By what share of the way a first-order lag goes to its input from one sample to the next: 1
/// without a lag.
pub(super) fn share(lag_s: f64, period_s: f64) -> f64 {
    if lag_s > 0.0 {
        -(-period_s / lag_s).exp_m1()
    } else {
        1.0
    }
}

/// The lag of such a share, s.
pub(super) fn lag_s(share: f64, period_s: f64) -> f64 {
    if share < 1.0 {
        -period_s / (-share).ln_1p()
    } else {
        0.0
    }
}

/// A name that is kept for as long as the program runs, once however often it is met, so that what
/// names an input stays a few words.
pub fn kept(name: &str) -> &'static str {
    static NAMES: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = names.get(name) {
        return known;
    }
    let new: &'static str = Box::leak(name.into());
    names.insert(new);
    new
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_followed_is_read_as_it_is_written() {
        for (text, name, squared, lag_s) in [
            ("voltage", "voltage", false, 0.0),
            ("voltage^2", "voltage", true, 0.0),
            ("voltage~10ms", "voltage", false, 0.01),
            ("p1^2~1.5ms", "p1", true, 0.0015),
            ("T~5000ms", "T", false, 5.0),
        ] {
            let follows = Follows {
                name,
                squared,
                lag_s,
            };
            assert_eq!(Follows::parse(text), follows);
            for rate in [200.0, 20_000.0] {
                let lag_s = super::lag_s(share(lag_s, 1.0 / rate), 1.0 / rate);
                assert_eq!(Follows { lag_s, ..follows }.written(), text, "at {rate} Hz");
            }
        }
        for name in ["a~b", "a~-1ms", "a^3"] {
            assert_eq!(Follows::parse(name).name, name);
        }
    }
}
