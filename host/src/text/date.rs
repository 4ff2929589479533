//! The day on which something was done, for a model's history.

use crate::text::error::{Error, Result};
use jiff::Timestamp;
use std::time::{SystemTime, UNIX_EPOCH};

/// The variable that fixes the day, so that the same run gives the same bytes: seconds since 1970
/// as <https://reproducible-builds.org/specs/source-date-epoch/> has it; empty for no day at all.
const FIXED: &str = "SOURCE_DATE_EPOCH";

/// Today in UTC as `2026-03-14`; the day of SOURCE_DATE_EPOCH where that is set, none where it is
/// set to nothing.
///
/// # Errors
/// [`crate::text::error::Kind::Usage`] when SOURCE_DATE_EPOCH is no number of seconds.
pub(crate) fn today() -> Result<Option<String>> {
    Ok(moment()?.map(day))
}

/// Now, in seconds since 1970; `None` where SOURCE_DATE_EPOCH is set to nothing.
///
/// # Errors
/// As [`today`].
pub(crate) fn moment() -> Result<Option<u64>> {
    let seconds = match std::env::var(FIXED) {
        Ok(text) if text.is_empty() => return Ok(None),
        Ok(text) => text
            .trim()
            .parse()
            .ok()
            .filter(|seconds| *seconds < MAX_SECONDS)
            .ok_or_else(|| {
                Error::usage(format!(
                    "{FIXED} is {text:?}, which is no number of seconds since 1970: set it to one, to nothing, or unset it"
                ))
            })?,
        Err(_) => SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .map_or(0, |since| since.as_secs()),
    };
    Ok(Some(seconds))
}

/// The end of the year 9999.
const MAX_SECONDS: u64 = 253_402_300_800;

/// The day of a moment, s since 1970, in the Gregorian calendar.
fn day(seconds: u64) -> String {
    let moment = Timestamp::from_second(seconds as i64).unwrap_or(Timestamp::MAX);
    moment.strftime("%F").to_string()
}

#[cfg(test)]
mod tests {
    use super::day;

    #[test]
    fn days_of_known_moments() {
        // `date -u -d @N +%F`.
        for (seconds, expected) in [
            (0, "1970-01-01"),
            (951_782_400, "2000-02-29"),
            (951_868_800, "2000-03-01"),
            (1_767_225_599, "2025-12-31"),
            (1_767_225_600, "2026-01-01"),
            (4_107_542_399, "2100-02-28"),
            (4_107_542_400, "2100-03-01"),
        ] {
            assert_eq!(day(seconds), expected);
        }
    }
}
