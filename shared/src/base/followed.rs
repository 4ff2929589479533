//! How an effect is written that follows an input of the study: `voltage`, or `voltage~10ms` behind a first-order lag.

use std::boxed::Box;
use std::collections::BTreeSet;
use std::format;
use std::string::String;
use std::sync::{Mutex, PoisonError};

/// The name of an input, and the time constant of the first-order lag behind which it acts, s: `voltage~10ms` is `voltage` and 0.01.
pub fn with_lag(input: &str) -> (&str, f64) {
    let parts = input.split_once('~');
    let lag = parts.and_then(|(name, lag)| {
        let ms: f64 = lag.strip_suffix("ms")?.parse().ok()?;
        (ms > 0.0).then_some((name, 1e-3 * ms))
    });
    lag.unwrap_or((input, 0.0))
}

/// The way back: a lag in s is written to four significant digits.
pub(super) fn written(name: &str, lag_s: f64) -> String {
    if lag_s <= 0.0 {
        return name.into();
    }
    let ms = 1e3 * lag_s;
    let unit = 10_f64.powi(ms.log10().floor() as i32 - 3);
    // A division by a power of ten above 1 ends in fewer digits than a product with its inverse.
    let ms = if unit < 1.0 {
        let per_unit = (1.0 / unit).round();
        (ms * per_unit).round() / per_unit
    } else {
        (ms / unit).round() * unit
    };
    format!("{name}~{ms}ms")
}

/// By what share of the way a first-order lag goes to its input from one sample to the next: 1 without a lag.
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

/// A name that is kept for as long as the program runs, once however often it is met, so that what names an input stays a few words.
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
    fn a_lag_is_read_as_it_is_written() {
        for (text, name, lag) in [
            ("voltage", "voltage", 0.0),
            ("voltage~10ms", "voltage", 0.01),
            ("p1~1.5ms", "p1", 0.0015),
            ("T~5000ms", "T", 5.0),
        ] {
            assert_eq!(with_lag(text), (name, lag));
            for rate in [200.0, 20_000.0] {
                let back = lag_s(share(lag, 1.0 / rate), 1.0 / rate);
                assert_eq!(written(name, back), text, "at {rate} Hz");
            }
        }
        assert_eq!(with_lag("a~b"), ("a~b", 0.0));
        assert_eq!(with_lag("a~-1ms"), ("a~-1ms", 0.0));
    }
}
