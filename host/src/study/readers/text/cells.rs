//! Cells of a text log: numbers with a decimal point or comma, dates and times.

use jiff::Timestamp;
use jiff::civil::{Date, DateTime};
use std::borrow::Cow;

/// What separates the whole part of a number from its fraction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Decimal {
    Point,
    Comma,
}

/// The number in a cell; digits may be grouped in thousands, the exponent may be Fortran's `D`.
pub(super) fn number(cell: &str, decimal: Decimal) -> Option<f64> {
    match decimal {
        Decimal::Point => match cell.parse() {
            Ok(value) => Some(value),
            Err(_) => plain(cell, '.', ',')?.parse().ok(),
        },
        Decimal::Comma => plain(cell, ',', '.')?.parse().ok(),
    }
}

/// The number in Rust's spelling, or `None` when its separators make no sense.
fn plain(cell: &str, point: char, group: char) -> Option<Cow<'_, str>> {
    let end = cell
        .find(|c: char| c.is_ascii_alphabetic())
        .unwrap_or(cell.len());
    let (mantissa, exponent) = cell.split_at(end);
    let fortran = exponent.starts_with(['d', 'D']);
    if !fortran && !mantissa.contains(['.', ',', '\'', '\u{2212}', '\u{a0}', '\u{202f}']) {
        return Some(Cow::Borrowed(cell));
    }
    let (whole, fraction) = match mantissa.split_once(point) {
        Some((whole, fraction)) => (whole, Some(fraction)),
        None => (mantissa, None),
    };
    let digits = |text: &str| text.bytes().all(|b| b.is_ascii_digit());
    // A point at the end is somebody's list of numbers, not a number.
    if fraction.is_some_and(|f| f.is_empty() || !digits(f)) {
        return None;
    }
    let whole = whole.replace('\u{2212}', "-");
    let unsigned = whole.trim_start_matches(['-', '+']);
    let groups: Vec<&str> = unsigned
        .split([group, '\'', '\u{a0}', '\u{202f}'])
        .collect();
    // “1,234” alone may as well be one and a quarter: only “1,234.5” and “1,234,567” are surely
    // grouped.
    let grouped = groups.len() == 1
        || groups[1..].iter().all(|g| g.len() == 3)
            && (1..=3).contains(&groups[0].len())
            && (fraction.is_some() || groups.len() > 2 || !whole.contains(group));
    if !grouped || !groups.iter().all(|g| digits(g)) {
        return None;
    }
    let sign = if whole.starts_with('-') { "-" } else { "" };
    let mut text = format!("{sign}{}", groups.concat());
    if let Some(fraction) = fraction {
        text.push('.');
        text.push_str(fraction);
    }
    text.push_str(&exponent.replace(['d', 'D'], "e"));
    Some(Cow::Owned(text))
}

/// An instant in nanoseconds: of the calendar, or of the day or the hour when the cell holds only a
/// time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Instant {
    Calendar(i128),
    OfDay(i128),
    OfHour(i128),
}

const SECOND: i128 = 1_000_000_000;

/// An ISO 8601 date-time with or without offset, `14.03.2026 09:26:53,589`, `3/14/2026 9:26:53 PM`,
/// a bare date, or a time of day; `26.53.5897` is a time with points that can be no date.
pub(super) fn instant(cell: &str) -> Option<Instant> {
    if !cell.starts_with(|c: char| c.is_ascii_digit()) || !cell.contains([':', '-', '/', '.']) {
        return None;
    }
    let civil = |at: DateTime| {
        let stamp = at.to_zoned(jiff::tz::TimeZone::UTC).ok()?.timestamp();
        Some(Instant::Calendar(stamp.as_nanosecond()))
    };
    if let Ok(at) = cell.parse::<DateTime>() {
        // A `Z` or an offset makes it an instant; without, every row is of the same clock.
        return match cell.parse::<Timestamp>() {
            Ok(stamp) => Some(Instant::Calendar(stamp.as_nanosecond())),
            Err(_) => civil(at),
        };
    }
    if let Ok(stamp) = cell.parse::<Timestamp>() {
        return Some(Instant::Calendar(stamp.as_nanosecond()));
    }
    let (date, time) = match cell.split_once([' ', 'T']) {
        Some((date, time)) => (Some(date), Some(time.trim())),
        None if cell.contains(':') => (None, Some(cell)),
        None => (Some(cell), None),
    };
    // “9:26:53 PM” holds a blank as well.
    if let (Some(start), Some("AM" | "PM" | "am" | "pm")) = (date, time)
        && start.contains(':')
    {
        return time_of_day(cell).map(Instant::OfDay);
    }
    let time = match time {
        Some(time) => time_of_day(time)?,
        None => 0,
    };
    let Some(date) = date else {
        return Some(Instant::OfDay(time));
    };
    let Some(date) = date_of(date) else {
        return pointed(cell);
    };
    match civil(date.to_datetime(jiff::civil::Time::midnight()))? {
        Instant::Calendar(day) => Some(Instant::Calendar(day + time)),
        of_clock => Some(of_clock),
    }
}

/// A time with points between its parts: `09.26.53`, `09.26.53.589` or, since seconds have two
/// digits, minutes and seconds as `26.53.5897`.
fn pointed(cell: &str) -> Option<Instant> {
    let parts: Vec<&str> = cell.split('.').collect();
    match parts.as_slice() {
        [h, m, s] if s.len() == 2 => time_of_day(&format!("{h}:{m}:{s}")).map(Instant::OfDay),
        [h, m, s, fraction] => time_of_day(&format!("{h}:{m}:{s}.{fraction}")).map(Instant::OfDay),
        [m, s, fraction] if m.len() == 2 && s.len() == 2 => {
            time_of_day(&format!("0:{m}:{s}.{fraction}")).map(Instant::OfHour)
        }
        _ => None,
    }
}

/// A date: year first, or day and month (whichever fits) before the year.
fn date_of(text: &str) -> Option<Date> {
    let parts: Vec<&str> = text.split(['.', '/', '-']).collect();
    let [a, b, c] = parts.as_slice() else {
        return None;
    };
    let number = |part: &str| part.parse::<i16>().ok();
    if a.len() == 4 {
        return Date::new(
            number(a)?,
            number(b)?.try_into().ok()?,
            number(c)?.try_into().ok()?,
        )
        .ok();
    }
    let year = number(c)?;
    let year = if c.len() == 2 { 2000 + year } else { year };
    let (a, b): (i8, i8) = (number(a)?.try_into().ok()?, number(b)?.try_into().ok()?);
    // With slashes the month stands first in America; what cannot be a month is the day.
    let (day, month) = if text.contains('/') && b > 12 || a <= 12 && text.contains('/') && b <= 12 {
        (b, a)
    } else {
        (a, b)
    };
    Date::new(year, month, day).ok()
}

/// `h:m:s` or `h:m:s.fraction`, fraction after a point or a comma, perhaps with AM or PM;
/// nanoseconds since midnight.
fn time_of_day(text: &str) -> Option<i128> {
    let upper = text.to_ascii_uppercase();
    let (clock, noon) = match upper.trim_end_matches('Z').split_once(' ') {
        Some((clock, "AM")) => (clock.to_owned(), Some(false)),
        Some((clock, "PM")) => (clock.to_owned(), Some(true)),
        Some(_) => return None,
        None => (upper.trim_end_matches('Z').to_owned(), None),
    };
    let parts: Vec<&str> = clock.split(':').collect();
    let (hours, minutes, seconds) = match parts.as_slice() {
        [h, m, s] => (*h, *m, *s),
        [h, m] => (*h, *m, "0"),
        _ => return None,
    };
    let (whole, fraction) = seconds.split_once(['.', ',']).unwrap_or((seconds, ""));
    let number = |part: &str| {
        let digits =
            !part.is_empty() && part.len() <= 9 && part.bytes().all(|b| b.is_ascii_digit());
        digits.then(|| part.parse::<i128>().ok()).flatten()
    };
    let mut hours = number(hours)?;
    hours = match noon {
        Some(afternoon) => hours % 12 + if afternoon { 12 } else { 0 },
        None => hours,
    };
    let (minutes, whole) = (number(minutes)?, number(whole)?);
    if minutes > 59 || whole > 60 {
        return None;
    }
    let nanoseconds = if fraction.is_empty() {
        0
    } else {
        let padded = format!("{:0<9}", &fraction[..fraction.len().min(9)]);
        number(&padded)?
    };
    Some(((hours * 60 + minutes) * 60 + whole) * SECOND + nanoseconds)
}

/// Seconds since the first cell of a column of dates and times.
#[derive(Clone, Debug, Default)]
pub(super) struct Clock {
    first: Option<i128>,
    last: i128,
    midnights: i128,
    has_no_date: bool,
}

impl Clock {
    /// The instant in the next cell. Below times with points `02.04.2000` is no date.
    pub(super) fn instant(&self, cell: &str) -> Option<Instant> {
        let in_place = self.has_no_date.then(|| pointed(cell)).flatten();
        in_place.or_else(|| instant(cell))
    }

    /// The next cell; a time of day that falls back by more than half a day has passed midnight.
    pub(super) fn seconds(&mut self, at: Instant) -> f64 {
        const HOUR: i128 = 3600 * SECOND;
        let (at, period) = match at {
            Instant::Calendar(at) => (at, 0),
            Instant::OfDay(at) => (at, 24 * HOUR),
            Instant::OfHour(at) => (at, HOUR),
        };
        self.has_no_date = period > 0;
        if self.first.is_some() && period > 0 && at + period / 2 < self.last {
            self.midnights += 1;
        }
        self.last = at;
        let nanoseconds = at + self.midnights * period;
        let first = *self.first.get_or_insert(nanoseconds);
        let since = nanoseconds - first;
        // Whole microseconds, the finest that loggers write, divide exactly into the decimal that
        // they mean.
        if since % 1000 == 0 {
            (since / 1000) as f64 / 1e6
        } else {
            since as f64 / 1e9
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_as_people_and_programs_write_them() {
        for (cell, wanted) in [
            ("1.5", Some(1.5)),
            ("-1,234.5", Some(-1234.5)),
            ("1'234.5", Some(1234.5)),
            ("1.5D-3", Some(1.5e-3)),
            ("\u{2212}2.5", Some(-2.5)),
            ("1,23", None),
            ("1,234", None),
            ("1,234,567", Some(1234567.0)),
            ("3.1 N", None),
            ("", None),
            ("1.2.3", None),
        ] {
            assert_eq!(number(cell, Decimal::Point), wanted, "{cell:?}");
        }
        for (cell, wanted) in [
            ("1,5", Some(1.5)),
            ("-0,000339802", Some(-0.000339802)),
            ("1.234,5", Some(1234.5)),
            ("1,5E-03", Some(1.5e-3)),
            ("12", Some(12.0)),
            ("1,", None),
            ("1,2,3", None),
            ("0.25", None),
            ("1.234", None),
        ] {
            assert_eq!(number(cell, Decimal::Comma), wanted, "{cell:?}");
        }
    }

    #[test]
    fn instants_of_many_spellings_are_the_same_instant() {
        let wanted = instant("2026-03-14T09:26:53.589").unwrap();
        for cell in [
            "2026-03-14 09:26:53.589",
            "2026-03-14T09:26:53.589Z",
            "2026-03-14T10:26:53.589+01:00",
            "14.03.2026 09:26:53,589",
            "14.3.26 09:26:53.589",
            "3/14/2026 9:26:53.589 AM",
            "14/03/2026 09:26:53.589",
        ] {
            assert_eq!(instant(cell), Some(wanted), "{cell}");
        }
        for cell in [
            "12",
            "1.5",
            "-3",
            "2026",
            "x:y",
            "1:2:3:4",
            "14.03",
            "99.99.2026",
        ] {
            assert_eq!(instant(cell), None, "{cell}");
        }
    }

    #[test]
    fn a_clock_counts_from_its_first_cell_and_over_midnight() {
        let mut clock = Clock::default();
        let cells = ["23:59:59,5", "23:59:59,75", "00:00:00,25", "00:00:01"];
        let found: Vec<f64> = cells
            .iter()
            .map(|c| clock.seconds(instant(c).unwrap()))
            .collect();
        assert_eq!(found, [0.0, 0.25, 0.75, 1.5]);
        assert_eq!(instant("11:00:00 PM"), instant("23:00:00"));
        let mut clock = Clock::default();
        let cells = ["59.58.9995", "59.59.0000", "02.04.2000"];
        let found = cells.map(|cell| clock.seconds(clock.instant(cell).unwrap()));
        assert_eq!(found, [0.0, 0.0005, 125.2005]);
        assert_eq!(instant("14.26.53"), instant("14:26:53"));
        assert_eq!(instant("14.26.53.5"), instant("14:26:53.5"));
    }
}
