//! One column of a log and what its numbers mean in SI.

use super::naming;
use super::signs::signed;
use super::turns::unwrap;
use super::units::Quantity;
use crate::study::AxisKind;
use crate::study::description::{ChannelTable, Source};
use crate::study::log::{Log, Request, Wanted};
use crate::text::error::{Error, Result};
use std::ops::Range;

/// One column turned into SI: (number · scale + offset) · factor.
pub(crate) struct Calibrated {
    /// Its place among [`Plan::wanted`].
    pub(crate) place: usize,
    /// Which clock it was sampled by: 0 for the log's own, n for entry n − 1 of [`Plan::clocks`].
    pub(crate) clock: usize,
    pub(crate) column: String,
    scale: f64,
    offset: f64,
    sign_bit: Option<u32>,
    quantity: Quantity,
    /// The unit that study.toml states, and how many SI units one of it is.
    stated: Option<(String, f64)>,
    /// The unit that stands in the column's name, as in `Force (kN)`.
    named: Option<String>,
}

impl Calibrated {
    /// Some rows of the column in SI; `None` where an optional column is absent.
    pub(crate) fn series(&self, log: &Log, rows: Range<usize>) -> Option<Vec<f64>> {
        if self.turns() {
            return Some(self.unwrapped(log)?.0[rows].to_vec());
        }
        let logged = log.values[self.place].as_ref()?;
        let si = self.si(log.units[self.place].as_deref());
        Some(logged[rows].iter().map(|value| si(*value)).collect())
    }

    /// Whether it is an angle.
    fn turns(&self) -> bool {
        self.quantity == Quantity::Displacement(AxisKind::Rotation)
    }

    /// The whole column in SI without its wraps, and how many there are.
    fn unwrapped(&self, log: &Log) -> Option<(Vec<f64>, usize)> {
        let si = self.si(log.units[self.place].as_deref());
        let logged = log.values[self.place].as_ref()?;
        let mut angle: Vec<f64> = logged.iter().map(|value| si(*value)).collect();
        let places = unwrap(&mut angle);
        Some((angle, places))
    }

    /// What is said of an angle that wraps.
    pub(crate) fn check_turns(&self, request: &Request<'_>, log: &Log) -> Option<String> {
        let (_, places) = self.turns().then(|| self.unwrapped(log))??;
        (places > 0).then(|| {
            format!(
                "{}: column {:?} steps by a whole turn in {places} place{}; the angle goes on there",
                log.file(self.place, request.file),
                self.column,
                if places == 1 { "" } else { "s" }
            )
        })
    }

    /// What makes SI of the numbers of a file that states this unit for them; failing that, the one
    /// in the column's name counts.
    pub(crate) fn si(&self, of_file: Option<&str>) -> impl Fn(f64) -> f64 + use<> {
        let factor = match (&self.stated, of_file.or(self.named.as_deref())) {
            (Some((_, factor)), _) => *factor,
            (None, Some(unit)) => self.factor(unit).unwrap_or(1.0),
            (None, None) => 1.0,
        };
        let (scale, offset, sign_bit) = (self.scale, self.offset, self.sign_bit);
        move |value| {
            let value = sign_bit.map_or(value, |bit| signed(value, bit));
            (value * scale + offset) * factor
        }
    }

    /// The SI unit of its quantity; empty for an input.
    pub(crate) fn unit(&self) -> String {
        self.quantity.si()
    }

    /// The unit that the file states for the column; failing that, the one in its name.
    fn unit_in<'a>(&'a self, log: &'a Log) -> Option<&'a str> {
        let of_file = log.units[self.place].as_deref();
        of_file.or(self.named.as_deref())
    }

    /// SI units in one of the file's; of volts and counts, what the study's scale says.
    fn factor(&self, unit: &str) -> std::result::Result<f64, String> {
        self.quantity.factor(unit, self.scale != 1.0)
    }

    /// Holds the unit that the file states against the study's: a note where they differ or where
    /// only the column's name says it, an error where the study states none and the file's
    /// cannot be used.
    pub(crate) fn check_unit(&self, request: &Request<'_>, log: &Log) -> Result<Option<String>> {
        let Some(unit) = self.unit_in(log) else {
            return Ok(None);
        };
        let of_name = log.units[self.place].is_none();
        match (&self.stated, self.factor(unit)) {
            (None, Ok(factor)) if of_name && factor != 1.0 => Ok(Some(format!(
                "{}: column {:?} is read in {unit}, as its name says",
                log.file(self.place, request.file),
                self.column
            ))),
            (None, Ok(_)) => Ok(None),
            (None, Err(what)) => Err(Error::data(format!(
                "{} states for column {:?}: {what}; or write the right unit into study.toml, {{ column = {:?}, unit = … }}",
                log.file(self.place, request.file),
                self.column,
                self.column
            ))),
            (Some((_, stated)), Ok(found)) if (found / stated - 1.0).abs() < 1e-9 => Ok(None),
            (Some((stated, _)), _) if stated == unit => Ok(None),
            (Some((stated, _)), _) => Ok(Some(format!(
                "{}: column {:?} is in {unit} as the file says and in {stated} as study.toml says; the latter was used",
                log.file(self.place, request.file),
                self.column
            ))),
        }
    }
}

/// The columns that the study names, gathered channel by channel.
#[derive(Default)]
pub(crate) struct Columns {
    pub(crate) wanted: Vec<Wanted>,
    pub(crate) clocks: Vec<Calibrated>,
}

impl Columns {
    /// The place of a column among the wanted.
    pub(crate) fn place(&mut self, column: &str, optional: bool) -> usize {
        if let Some(place) = self.wanted.iter().position(|w| w.column == column) {
            self.wanted[place].optional &= optional;
            return place;
        }
        self.wanted.push(Wanted {
            column: column.to_owned(),
            optional,
        });
        self.wanted.len() - 1
    }

    /// The number of a channel's own clock; its unit is the file's, or seconds.
    fn clock(&mut self, column: &str) -> usize {
        if let Some(at) = self.clocks.iter().position(|c| c.column == column) {
            return at + 1;
        }
        let place = self.place(column, false);
        self.clocks.push(Calibrated {
            place,
            clock: 0,
            column: column.to_owned(),
            scale: 1.0,
            offset: 0.0,
            sign_bit: None,
            quantity: Quantity::Time,
            stated: None,
            named: naming::unit_for(Quantity::Time, column),
        });
        self.clocks.len()
    }
}

/// Converts the channels of one key, and notes their columns among the wanted.
pub(crate) fn calibrate(
    source: &Source<'_>,
    start: usize,
    key: &str,
    tables: &[ChannelTable],
    quantity: Quantity,
    columns: &mut Columns,
) -> Result<Vec<Calibrated>> {
    let mut list = Vec::new();
    for table in tables {
        let column = &table.column;
        let wrong = |what: String| {
            Error::data(format!(
                "{}: {key}, column {column:?}: {what}",
                source.at(start)
            ))
        };
        let stated = match &table.unit {
            Some(unit) => {
                let factor = quantity.factor(unit, table.scale.is_some());
                Some((unit.clone(), factor.map_err(&wrong)?))
            }
            None => None,
        };
        let scale = table.scale.unwrap_or(1.0);
        let offset = table.offset.unwrap_or(0.0);
        if !(scale.is_finite() && scale != 0.0 && offset.is_finite()) {
            return Err(wrong(format!(
                "scale = {scale} and offset = {offset} must be numbers, and the scale not 0; correct them or leave them out"
            )));
        }
        if let Some(bit) = table.sign_bit.filter(|bit| !(1..=31).contains(bit)) {
            return Err(wrong(format!(
                "sign_bit = {bit} is no bit of a register; give one from 1 to 31, or leave it out"
            )));
        }
        let place = columns.place(column, table.optional);
        let clock = match &table.time {
            None => 0,
            Some(time) => columns.clock(time),
        };
        list.push(Calibrated {
            place,
            clock,
            column: column.clone(),
            scale,
            offset,
            sign_bit: table.sign_bit,
            quantity,
            stated,
            named: naming::unit_for(quantity, column),
        });
    }
    Ok(list)
}
