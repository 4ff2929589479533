//! Reader of LabVIEW TDMS files: each channel with numbers is a column, with the unit in its
//! property `unit_string`.
//!
//! Layout after National Instruments' “TDMS File Format Internal Structure”: segments of lead-in,
//! object descriptions and raw data. A file that was cut off is read up to the last whole chunk of
//! its last segment, which is reported.

use super::cursor::Number;
use crate::study::log::{Column, Request, Table};
use crate::text::error::Result;
use std::collections::BTreeMap;

/// Flags of a segment's table of contents.
const NEW_OBJECTS: u32 = 1 << 2;
const RAW_DATA: u32 = 1 << 3;
const INTERLEAVED: u32 = 1 << 5;
const BIG_ENDIAN: u32 = 1 << 6;
/// The type of time stamps: whole seconds since 1904, and 2⁻⁶⁴ of one.
const TIME_STAMP: u32 = 0x44;
/// Bytes of a lead-in.
const LEAD_IN: usize = 28;
/// Objects that one file may describe; more is a damaged count.
const MAX_OBJECTS: usize = 100_000;

/// Whether the bytes begin like such a file.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    bytes.starts_with(b"TDSm")
}

/// A channel while the file is read.
#[derive(Default)]
struct Channel {
    unit: Option<String>,
    increment_s: Option<f64>,
    start_s: f64,
    kind: u32,
    /// Values in a chunk of the current segment.
    count: usize,
    values: Vec<f64>,
    /// Of time stamps, the whole second of the first one.
    first_second: Option<i64>,
    order: usize,
}

/// Reads the channels that the request needs.
pub(super) fn read(request: &Request<'_>, bytes: &[u8]) -> Result<Table> {
    let mut file = File::default();
    let mut at = 0;
    let mut notes = Vec::new();
    while at < bytes.len() {
        match file.segment(&bytes[at..], &|name| request.needs(name)) {
            Ok(Segment { length, whole }) => {
                if !whole {
                    notes.push(format!(
                        "{} ends in the middle of a segment, as after a crash of the logger; it is read up to the last whole chunk",
                        request.file
                    ));
                    break;
                }
                at += length;
            }
            Err(what) if at > 0 && what == CUT => {
                notes.push(format!(
                    "{} ends in the middle of a segment's description; it is read up to the segment before",
                    request.file
                ));
                break;
            }
            Err(what) => {
                return Err(request.error(format!(
                    "is a TDMS file that cannot be read: {what} (in the segment at byte {at}); open it in LabVIEW and save it again, \
                     or export CSV"
                )));
            }
        }
    }
    let mut table = Table::whole("LabVIEW TDMS", file.columns(request));
    table.notes = notes;
    Ok(table)
}

/// What is said of a segment that ends too early.
const CUT: &str = "it is cut off";

/// Where a segment ends, and whether all of it is there.
struct Segment {
    length: usize,
    whole: bool,
}

#[derive(Default)]
struct File {
    channels: BTreeMap<String, Channel>,
    /// Paths of the objects with raw data in the current segment, in their order.
    active: Vec<String>,
}

/// Reads one number after another.
struct Cursor<'a> {
    bytes: &'a [u8],
    big: bool,
}

impl<'a> Cursor<'a> {
    fn take(&mut self, count: usize) -> std::result::Result<&'a [u8], &'static str> {
        let (head, rest) = self.bytes.split_at_checked(count).ok_or(CUT)?;
        self.bytes = rest;
        Ok(head)
    }

    fn u32(&mut self) -> std::result::Result<u32, &'static str> {
        Ok(self.whole(4)? as u32)
    }

    fn whole(&mut self, size: usize) -> std::result::Result<u64, &'static str> {
        let bytes = self.take(size)?.iter();
        let join = |sum: u64, byte: &u8| (sum << 8) | u64::from(*byte);
        Ok(match self.big {
            true => bytes.fold(0, join),
            false => bytes.rev().fold(0, join),
        })
    }

    fn text(&mut self) -> std::result::Result<String, &'static str> {
        let length = self.u32()? as usize;
        Ok(String::from_utf8_lossy(self.take(length)?).into_owned())
    }

    /// A property's value: a number, a text, or neither.
    fn property(
        &mut self,
        kind: u32,
    ) -> std::result::Result<(Option<f64>, Option<String>), &'static str> {
        if kind == 0x20 {
            return Ok((None, Some(self.text()?)));
        }
        if kind == TIME_STAMP {
            self.take(16)?;
            return Ok((None, None));
        }
        let number = number(kind, self.big).ok_or("a property is of a type unknown here")?;
        Ok((Some(number.value(self.take(number.size)?)), None))
    }
}

impl File {
    /// Reads the segment at the start of `bytes`.
    fn segment(
        &mut self,
        bytes: &[u8],
        needs: &dyn Fn(&str) -> bool,
    ) -> std::result::Result<Segment, &'static str> {
        if bytes.len() < LEAD_IN {
            return Err(CUT);
        }
        if !bytes.starts_with(b"TDSm") {
            return Err("a segment does not begin as it should");
        }
        let mut lead = Cursor {
            bytes: &bytes[4..LEAD_IN],
            big: false,
        };
        let contents = lead.u32()?;
        let big = contents & BIG_ENDIAN != 0;
        lead.big = big;
        lead.u32()?;
        let (next, raw) = (lead.whole(8)?, lead.whole(8)?);
        let rest = &bytes[LEAD_IN..];
        // A logger writes the length when it closes the segment; until then it is all ones.
        let whole = usize::try_from(next).is_ok_and(|next| next <= rest.len());
        let next = if whole { next as usize } else { rest.len() };
        let raw = usize::try_from(raw).map_err(|_| CUT)?;
        if raw > next {
            return Err(CUT);
        }
        if raw > 0 {
            let mut cursor = Cursor {
                bytes: &rest[..raw],
                big,
            };
            self.objects(&mut cursor, contents & NEW_OBJECTS != 0)?;
        }
        if contents & RAW_DATA != 0 {
            self.raw(&rest[raw..next], big, contents & INTERLEAVED != 0, needs)?;
        }
        Ok(Segment {
            length: LEAD_IN + next,
            whole,
        })
    }

    fn objects(
        &mut self,
        cursor: &mut Cursor<'_>,
        anew: bool,
    ) -> std::result::Result<(), &'static str> {
        if anew {
            self.active.clear();
        }
        let count = cursor.u32()? as usize;
        if count > MAX_OBJECTS {
            return Err("it describes more objects than a log has");
        }
        for _ in 0..count {
            let path = cursor.text()?;
            let order = self.channels.len();
            let channel = self.channels.entry(path.clone()).or_default();
            if channel.order == 0 {
                channel.order = order + 1;
            }
            match cursor.u32()? {
                0xffff_ffff => self.active.retain(|p| *p != path),
                index => {
                    // 0: as in the segment before.
                    if index != 0 {
                        if index == 0x6912 || index == 0x6913 || index > 64 {
                            return Err(
                                "it holds raw data of a DAQmx device, scaled by the reader",
                            );
                        }
                        channel.kind = cursor.u32()?;
                        cursor.u32()?;
                        channel.count = usize::try_from(cursor.whole(8)?).map_err(|_| CUT)?;
                        if index > 20 {
                            cursor.take(index as usize - 20)?;
                        }
                    }
                    if !self.active.contains(&path) {
                        self.active.push(path);
                    }
                }
            }
            for _ in 0..cursor.u32()? {
                let name = cursor.text()?;
                let kind = cursor.u32()?;
                let (value, text) = cursor.property(kind)?;
                match name.as_str() {
                    "unit_string" => channel.unit = text.filter(|t| !t.is_empty()),
                    "wf_increment" => channel.increment_s = value.filter(|v| *v > 0.0),
                    "wf_start_offset" => channel.start_s = value.unwrap_or(0.0),
                    _ => {}
                }
            }
        }
        Ok(())
    }

    /// The raw data of a segment: chunks of the same layout, of which the last may be cut off.
    fn raw(
        &mut self,
        raw: &[u8],
        big: bool,
        interleaved: bool,
        needs: &dyn Fn(&str) -> bool,
    ) -> std::result::Result<(), &'static str> {
        let mut parts = Vec::new();
        for path in &self.active {
            let channel = &self.channels[path];
            let size = size_of(channel.kind).ok_or("a channel holds text or complex numbers")?;
            parts.push((path.clone(), channel.kind, size, channel.count));
        }
        let chunk = parts.iter().try_fold(0_usize, |sum, (_, _, size, count)| {
            sum.checked_add(size.checked_mul(*count)?)
        });
        let chunk = chunk.ok_or(CUT)?;
        if chunk == 0 {
            return Ok(());
        }
        for chunk in raw.chunks_exact(chunk) {
            let stride: usize = parts.iter().map(|p| p.2).sum();
            let mut from = 0;
            for (path, kind, size, count) in &parts {
                let step = if interleaved { stride } else { *size };
                if let Some(channel) = self
                    .channels
                    .get_mut(path)
                    .filter(|_| needs(&last_name(path)))
                {
                    let values = (0..*count)
                        .map_while(|i| chunk.get(from + i * step..from + i * step + size));
                    let first = &mut channel.first_second;
                    let number = number(*kind, big);
                    channel.values.extend(values.map(|raw| match number {
                        None => since(first, raw, big),
                        Some(number) => number.value(raw),
                    }));
                }
                from += if interleaved { *size } else { size * count };
            }
        }
        Ok(())
    }

    fn columns(self, request: &Request<'_>) -> Vec<Column> {
        let mut channels: Vec<(String, Channel)> = self
            .channels
            .into_iter()
            .filter(|(path, channel)| {
                path.matches("'/'").count() == 1 && size_of(channel.kind).is_some()
            })
            .collect();
        channels.sort_by_key(|(_, channel)| channel.order);
        let mut columns: Vec<Column> = Vec::new();
        let waveform = channels
            .iter()
            .find_map(|(_, c)| Some((c.increment_s?, c.start_s, c.values.len())));
        for (path, channel) in channels {
            let name = last_name(&path);
            columns.push(Column {
                values: request.needs(&name).then_some(channel.values),
                name,
                unit: match channel.first_second {
                    Some(_) => Some("s".to_owned()),
                    None => channel.unit,
                },
            });
        }
        // Waveforms hold no time but its increment.
        if let Some((increment, start, rows)) = waveform
            && !columns.iter().any(|c| c.name == "time")
        {
            columns.push(Column {
                name: "time".into(),
                unit: Some("s".into()),
                values: Some(
                    (0..rows)
                        .map(|row| start + row as f64 * increment)
                        .collect(),
                ),
            });
        }
        columns
    }
}

/// The channel's own name in a path: `/'run'/'x'`.
fn last_name(path: &str) -> String {
    let last = path.rsplit("'/'").next().unwrap_or(path);
    last.trim_end_matches('\'').replace("''", "'")
}

/// Bytes of a number or a time stamp; `None` for anything else.
fn size_of(kind: u32) -> Option<usize> {
    match kind {
        TIME_STAMP => Some(16),
        kind => Some(number(kind, false)?.size),
    }
}

/// How a number is stored; `None` for what is no number.
fn number(kind: u32, big_endian: bool) -> Option<Number> {
    let size = match kind {
        1 | 5 | 0x21 => 1,
        2 | 6 => 2,
        3 | 7 | 9 | 0x19 => 4,
        4 | 8 | 10 | 0x1a => 8,
        _ => return None,
    };
    Some(Number {
        float: matches!(kind, 9 | 10 | 0x19 | 0x1a),
        signed: kind <= 4,
        big_endian,
        size,
    })
}

/// Seconds of a time stamp since the whole second of the first one, which is kept.
fn since(first: &mut Option<i64>, raw: &[u8], big: bool) -> f64 {
    let mut bytes = [0_u8; 16];
    bytes.copy_from_slice(raw);
    if big {
        bytes.reverse();
    }
    let stamp = i128::from_le_bytes(bytes);
    let seconds = (stamp >> 64) as i64;
    let first = *first.get_or_insert(seconds);
    seconds.wrapping_sub(first) as f64 + stamp as u64 as f64 / 2_f64.powi(64)
}
