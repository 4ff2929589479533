//! Reader of Arrow IPC files and streams (also called Feather): each column of numbers, with the
//! unit in its field's metadata.
//!
//! A file is a stream of messages between a beginning of eight bytes and a table of contents. The
//! messages are read in their order, so a file whose writer died is read up to its last whole
//! batch.

use super::cursor::{Cursor, Told};
use super::packed;
use crate::study::log::{Column, Request, Table};
use crate::text::error::{Error, Result};
use crate::text::guard::unless_it_panics;
use arrow_array::cast::AsArray;
use arrow_array::{Array, types};
use arrow_buffer::Buffer;
use arrow_ipc::reader::read_record_batch;
use arrow_ipc::{Message, MessageHeader, RecordBatch};
use arrow_schema::{DataType, Field, Schema, TimeUnit};
use std::collections::HashMap;
use std::sync::Arc;

/// What every file begins with, then two bytes of nothing.
const FILE: &[u8] = b"ARROW1";
/// What every message begins with, and so a stream.
const MESSAGE: &[u8] = &[0xff; 4];

/// Whether the bytes begin like a file or a stream.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    bytes.starts_with(FILE) || bytes.starts_with(MESSAGE)
}

/// Reads the columns that the request needs.
pub(super) fn read(request: &Request<'_>, bytes: &[u8]) -> Result<Table> {
    let start = if bytes.starts_with(FILE) { 8 } else { 0 };
    let mut rest = Cursor(bytes.get(start..).unwrap_or_default());
    let mut reading: Option<Reading> = None;
    let mut whole = true;
    loop {
        let (message, body) = match next(&mut rest).map_err(|e| broken(request, e))? {
            Next::Message(message, body) => (message, body),
            Next::End => break,
            Next::CutOff => {
                whole = false;
                break;
            }
        };
        match (message.header_type(), &mut reading) {
            (MessageHeader::Schema, None) => {
                let schema = message.header_as_schema().ok_or("its schema is not one");
                let schema = schema.map_err(|e| broken(request, e))?;
                let read = unless_it_panics(|| arrow_ipc::convert::try_fb_to_schema(schema));
                let read = read.ok_or_else(|| broken(request, "its schema is damaged"))?;
                let schema = read.map_err(|e| broken(request, e))?;
                reading = Some(Reading::of(request, schema)?);
            }
            (MessageHeader::RecordBatch, Some(reading)) => reading.batch(request, message, body)?,
            // What text columns share; numbers have none.
            (MessageHeader::DictionaryBatch, Some(_)) => {}
            _ => return Err(broken(request, "a message stands where none belongs")),
        }
    }
    let Some(reading) = reading else {
        return Err(broken(request, "it ends before its schema"));
    };
    if !whole && reading.rows == 0 {
        return Err(broken(request, "it ends before its first batch"));
    }
    let mut table = Table::whole("Arrow IPC", reading.columns);
    if !whole {
        table.notes.push(format!(
            "{} ends in the middle of a batch; it was read up to the batch before, {} rows",
            request.file, reading.rows
        ));
    }
    Ok(table)
}

fn broken(request: &Request<'_>, what: impl std::fmt::Display) -> Error {
    // Some of the library's sentences have several lines.
    let what = what.to_string();
    let what = what.lines().next().unwrap_or_default();
    request.error(format!(
        "is an Arrow file that cannot be read ({what}); it was cut off or damaged, write it again"
    ))
}

/// The unit in the metadata of a field.
pub(super) fn unit(field: &Field) -> Option<String> {
    let metadata = field.metadata().iter();
    let mut units = metadata.filter(|(key, value)| {
        ["unit", "units"].contains(&key.to_lowercase().as_str()) && !value.trim().is_empty()
    });
    units.next().map(|(_, value)| value.trim().to_owned())
}

/// The error about a column that the study names and that holds no numbers.
pub(super) fn no_numbers(
    request: &Request<'_>,
    name: &str,
    holds: impl std::fmt::Display,
) -> Error {
    request.error(format!(
        "holds {holds} in the column {name:?}, not numbers; write it as float64"
    ))
}

/// What stands next in a stream.
enum Next<'a> {
    Message(Message<'a>, &'a [u8]),
    End,
    CutOff,
}

fn next<'a>(rest: &mut Cursor<'a>) -> Told<Next<'a>> {
    let Ok(mut length) = rest.number(4) else {
        return Ok(Next::CutOff);
    };
    // Writers of before 2019 leave the mark out.
    if length == u64::from(u32::MAX) {
        match rest.number(4) {
            Ok(stated) => length = stated,
            Err(_) => return Ok(Next::CutOff),
        }
    }
    if length == 0 {
        return Ok(Next::End);
    }
    let Ok(header) = rest.take(length as usize) else {
        return Ok(Next::CutOff);
    };
    let message =
        arrow_ipc::root_as_message(header).map_err(|e| format!("a message is damaged, {e}"))?;
    let length = usize::try_from(message.bodyLength());
    let length = length.map_err(|_| "a message has a length below 0")?;
    match rest.take(length) {
        Ok(body) => Ok(Next::Message(message, body)),
        Err(_) => Ok(Next::CutOff),
    }
}

/// A file whose schema is known.
struct Reading {
    schema: Arc<Schema>,
    /// Places of the fields to decode, and of their columns.
    needed: Vec<usize>,
    places: Vec<usize>,
    columns: Vec<Column>,
    origins: Vec<Option<i64>>,
    rows: usize,
}

impl Reading {
    fn of(request: &Request<'_>, schema: Schema) -> Result<Self> {
        let (mut columns, mut needed, mut places) = (Vec::new(), Vec::new(), Vec::new());
        for (place, field) in schema.fields().iter().enumerate() {
            let name = field.name();
            let needs = request.needs(name);
            if !is_number(field.data_type()) {
                if request.wanted.is_some() && needs {
                    return Err(no_numbers(request, name, field.data_type()));
                }
                continue;
            }
            if needs {
                needed.push(place);
                places.push(columns.len());
            }
            columns.push(Column {
                name: name.clone(),
                unit: match ticks(field.data_type()) {
                    Some(_) => Some("s".to_owned()),
                    None => unit(field),
                },
                values: needs.then(Vec::new),
            });
        }
        Ok(Self {
            schema: Arc::new(schema),
            origins: vec![None; needed.len()],
            needed,
            places,
            columns,
            rows: 0,
        })
    }

    fn batch(&mut self, request: &Request<'_>, message: Message<'_>, body: &[u8]) -> Result<()> {
        let batch = message
            .header_as_record_batch()
            .ok_or_else(|| broken(request, "a batch is not one"))?;
        let unpacked = unpacked(&batch, body).map_err(|e| broken(request, e))?;
        let rows = usize::try_from(batch.length()).unwrap_or(usize::MAX);
        self.rows = self.rows.saturating_add(rows);
        let bytes = self.rows.saturating_mul(8 * self.needed.len());
        if unpacked.saturating_add(bytes as u64) > packed::limit() {
            return Err(request.error(packed::too_large()));
        }
        if self.needed.is_empty() {
            return Ok(());
        }
        let decoded = unless_it_panics(|| {
            read_record_batch(
                &Buffer::from(body),
                batch,
                self.schema.clone(),
                &HashMap::new(),
                Some(&self.needed),
                &message.version(),
            )
        });
        let decoded = decoded.ok_or_else(|| broken(request, "a batch is damaged"))?;
        let decoded = decoded.map_err(|e| broken(request, e))?;
        let targets = self.places.iter().zip(&mut self.origins);
        for (array, (place, origin)) in decoded.columns().iter().zip(targets) {
            let values = self.columns[*place].values.get_or_insert_default();
            append(array.as_ref(), origin, values);
        }
        Ok(())
    }
}

/// Bytes that a batch unpacks to, when each of its parts lies within its body: the library takes
/// that for granted.
fn unpacked(batch: &RecordBatch<'_>, body: &[u8]) -> Told<u64> {
    let mut total = 0_u64;
    for buffer in batch.buffers().into_iter().flatten() {
        let part = usize::try_from(buffer.offset())
            .ok()
            .zip(usize::try_from(buffer.length()).ok())
            .and_then(|(from, length)| body.get(from..from.checked_add(length)?))
            .ok_or("a column lies outside its batch")?;
        let size = match batch.compression() {
            // −1 for what is not packed.
            Some(_) if part.len() >= 8 => Cursor(part).number(8)? as i64,
            _ => 0,
        };
        total = total.saturating_add(size.max(0) as u64);
    }
    Ok(total)
}

fn is_number(kind: &DataType) -> bool {
    kind.is_integer() || kind.is_floating() || *kind == DataType::Boolean || ticks(kind).is_some()
}

/// How many counts of a type of times make a second.
fn ticks(kind: &DataType) -> Option<f64> {
    let unit = match kind {
        DataType::Timestamp(unit, _)
        | DataType::Duration(unit)
        | DataType::Time32(unit)
        | DataType::Time64(unit) => unit,
        _ => return None,
    };
    Some(match unit {
        TimeUnit::Second => 1.0,
        TimeUnit::Millisecond => 1e3,
        TimeUnit::Microsecond => 1e6,
        TimeUnit::Nanosecond => 1e9,
    })
}

/// Appends a column's numbers, not-a-number where there is none; times in seconds from the first.
fn append(array: &dyn Array, origin: &mut Option<i64>, values: &mut Vec<f64>) {
    macro_rules! each {
        ($($kind:ident => $number:expr),* $(,)?) => {
            $(if let Some(array) = array.as_primitive_opt::<types::$kind>() {
                return values.extend(array.iter().map(|v| v.map_or(f64::NAN, $number)));
            })*
        };
    }
    let ticks = ticks(array.data_type()).unwrap_or(1.0);
    let mut since =
        |at: i64| (i128::from(at) - i128::from(*origin.get_or_insert(at))) as f64 / ticks;
    if let Some(array) = array.as_boolean_opt() {
        return values.extend(array.iter().map(|v| v.map_or(f64::NAN, f64::from)));
    }
    each! {
        Float64Type => |v| v,
        Float32Type => f64::from,
        Float16Type => f64::from,
        Int64Type => |v| v as f64,
        Int32Type => f64::from,
        Int16Type => f64::from,
        Int8Type => f64::from,
        UInt64Type => |v| v as f64,
        UInt32Type => f64::from,
        UInt16Type => f64::from,
        UInt8Type => f64::from,
        TimestampSecondType => &mut since,
        TimestampMillisecondType => &mut since,
        TimestampMicrosecondType => &mut since,
        TimestampNanosecondType => &mut since,
        DurationSecondType => &mut since,
        DurationMillisecondType => &mut since,
        DurationMicrosecondType => &mut since,
        DurationNanosecondType => &mut since,
        Time32SecondType => |v| since(i64::from(v)),
        Time32MillisecondType => |v| since(i64::from(v)),
        Time64MicrosecondType => &mut since,
        Time64NanosecondType => &mut since,
    }
}
