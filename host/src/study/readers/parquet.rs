//! Reader of Parquet files: each column of numbers, group by group of rows, with the unit in its
//! Arrow field's metadata.

use super::arrow::{no_numbers, unit};
use super::cursor::Told;
use super::packed;
use crate::study::log::{Column, Request, Table};
use crate::text::error::{Error, Result};
use crate::text::guard::unless_it_panics;
use base64::Engine;
use bytes::buf::Reader;
use bytes::{Buf, Bytes};
use parquet::basic::{Compression, ConvertedType, LogicalType, TimeUnit, Type};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl, get_column_reader};
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::metadata::{
    ColumnChunkMetaData, FileMetaData, ParquetMetaData, ParquetMetaDataReader, RowGroupMetaData,
};
use parquet::file::reader::{ChunkReader, Length};
use parquet::file::serialized_reader::SerializedPageReader;
use parquet::schema::types::ColumnDescriptor;
use std::collections::HashMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::sync::Arc;

/// Rows that are decoded at a time.
const PIECE: usize = 1 << 16;

/// Whether the bytes begin like such a file.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PAR1")
}

/// Reads the columns that the request needs.
pub(super) fn read(request: &Request<'_>, bytes: &[u8]) -> Result<Table> {
    let bytes = Bytes::copy_from_slice(bytes);
    let groups = Groups::described(request, &bytes)?;
    let needed = groups.columns.iter().filter(|c| request.needs(&c.name));
    let size = (groups.rows as u64).saturating_mul(8 * needed.count() as u64);
    let Some(left) = packed::limit().checked_sub(size) else {
        return Err(request.error(packed::too_large()));
    };
    let mut columns = Vec::new();
    for described in &groups.columns {
        let mut values = request.needs(&described.name).then(Vec::new);
        let mut origin = None;
        for number in 0..groups.metadata.num_row_groups() {
            let Some(values) = &mut values else { break };
            let guarded = Guarded::new((bytes.clone(), 0), left, groups.chunk(number, described));
            groups.append(request, guarded, (number, described), &mut origin, values)?;
        }
        columns.push(Column {
            values,
            unit: described.unit.clone(),
            name: described.name.clone(),
        });
    }
    Ok(Table::whole("Parquet", columns))
}

/// A file's columns of numbers, and its groups of rows.
pub(super) struct Groups {
    metadata: ParquetMetaData,
    pub(super) columns: Vec<Described>,
    /// Rows of all groups.
    pub(super) rows: usize,
}

/// A column of numbers, as the file's metadata describe it.
pub(super) struct Described {
    pub(super) name: String,
    pub(super) unit: Option<String>,
    /// Its place among all columns.
    place: usize,
    kind: Kind,
}

impl Groups {
    /// What stands at the file's end.
    pub(super) fn described(request: &Request<'_>, file: &impl ChunkReader) -> Result<Self> {
        let metadata = unless_it_panics(|| ParquetMetaDataReader::new().parse_and_finish(file));
        let metadata = metadata.ok_or_else(|| broken(request, "its metadata is damaged"))?;
        let metadata = metadata.map_err(|e| broken(request, e))?;
        let rows = metadata
            .row_groups()
            .iter()
            .try_fold(0_usize, |sum, group| {
                sum.checked_add(usize::try_from(group.num_rows()).ok()?)
            });
        let rows = rows.ok_or_else(|| broken(request, "it has fewer than 0 rows"))?;
        let units = units(metadata.file_metadata());
        let mut columns = Vec::new();
        let schema = metadata.file_metadata().schema_descr();
        for (place, described) in schema.columns().iter().enumerate() {
            let name = described.path().parts().join(".");
            let kind = match kind(described) {
                Ok(kind) => kind,
                Err(holds) if request.wanted.is_some() && request.needs(&name) => {
                    return Err(no_numbers(request, &name, holds));
                }
                Err(_) => continue,
            };
            columns.push(Described {
                unit: match kind {
                    Kind::Ticks(_) => Some("s".to_owned()),
                    _ => units.get(&name).cloned(),
                },
                place,
                kind,
                name,
            });
        }
        Ok(Self {
            metadata,
            columns,
            rows,
        })
    }

    fn chunk(&self, group: usize, column: &Described) -> &ColumnChunkMetaData {
        self.metadata.row_group(group).column(column.place)
    }

    /// Appends a column's numbers of one group of rows.
    fn append(
        &self,
        request: &Request<'_>,
        guarded: Guarded,
        (number, column): (usize, &Described),
        origin: &mut Option<i64>,
        values: &mut Vec<f64>,
    ) -> Result<()> {
        let group = self.metadata.row_group(number);
        let read = unless_it_panics(|| append(guarded, group, column, origin, values));
        let read = read.unwrap_or_else(|| Err(ParquetError::General("a page is damaged".into())));
        read.map_err(|e| match e {
            ParquetError::NeedMoreData(_) => request.error(packed::too_large()),
            e => broken(
                request,
                format!("column {:?}, row group {}: {e}", column.name, number + 1),
            ),
        })
    }

    /// The rows of each group.
    pub(super) fn blocks(&self) -> Vec<Range<usize>> {
        let mut end = 0;
        let groups = self.metadata.row_groups().iter();
        let block = |group: &RowGroupMetaData| {
            let start = end;
            end += group.num_rows() as usize;
            start..end
        };
        groups.map(block).collect()
    }

    /// Some rows of a column, whose groups are read from the file; where it holds times, `origin`
    /// is the first.
    pub(super) fn stretch(
        &self,
        request: &Request<'_>,
        file: &mut File,
        column: &Described,
        rows: Range<usize>,
        origin: &mut Option<i64>,
    ) -> Result<Vec<f64>> {
        let mut all = Vec::with_capacity(rows.len());
        for (number, block) in self.blocks().into_iter().enumerate() {
            let [from, to] = [rows.start, rows.end].map(|r| r.clamp(block.start, block.end));
            if from == to {
                continue;
            }
            let chunk = self.chunk(number, column);
            let (start, length) = chunk.byte_range();
            let size = 8 * block.len() as u64;
            let left = packed::limit().checked_sub(length.saturating_add(size));
            let left = left.ok_or_else(|| request.error(GROUP_TOO_LARGE))?;
            let mut bytes = Vec::new();
            let read = file.seek(SeekFrom::Start(start));
            let read = read.and_then(|_| file.take(length).read_to_end(&mut bytes));
            read.map_err(|e| broken(request, e))?;
            let guarded = Guarded::new((bytes.into(), start), left, chunk);
            let mut values = Vec::with_capacity(block.len());
            self.append(request, guarded, (number, column), origin, &mut values)?;
            let [from, to] = [from, to].map(|row| row - block.start);
            all.extend_from_slice(&values[from..to]);
        }
        Ok(all)
    }

    /// The time that counts as 0 in a column of times: that of the first row.
    pub(super) fn origin(
        &self,
        request: &Request<'_>,
        file: &mut File,
        column: &Described,
    ) -> Result<Option<i64>> {
        let mut origin = None;
        if matches!(column.kind, Kind::Ticks(_)) {
            self.stretch(request, file, column, 0..1, &mut origin)?;
        }
        Ok(origin)
    }
}

/// Why a stretch of rows cannot be read alone.
const GROUP_TOO_LARGE: &str = "has groups of rows that are too large to be read one at a time; write it again with groups of a million rows, \
     such as row_group_size=1_000_000 of pyarrow";

fn broken(request: &Request<'_>, what: impl std::fmt::Display) -> Error {
    let what = what.to_string();
    let what = what.lines().next().unwrap_or_default();
    request.error(format!(
        "is a Parquet file that cannot be read ({what}); it was cut off or damaged, write it again"
    ))
}

/// Units by the columns' names: Arrow's writers keep their schema, with the fields' metadata,
/// beside that of Parquet.
fn units(file: &FileMetaData) -> HashMap<String, String> {
    let pairs = file.key_value_metadata().into_iter().flatten();
    let schema = pairs
        .filter(|pair| pair.key == "ARROW:schema")
        .filter_map(|pair| pair.value.as_ref())
        .filter_map(|text| base64::engine::general_purpose::STANDARD.decode(text).ok())
        .find_map(|bytes| arrow_ipc::convert::try_schema_from_ipc_buffer(&bytes).ok());
    let fields = schema.iter().flat_map(|schema| schema.fields());
    let named = fields.filter_map(|field| Some((field.name().clone(), unit(field)?)));
    named.collect()
}

/// How a column's numbers are to be taken.
#[derive(Clone, Copy)]
enum Kind {
    Number,
    Unsigned,
    /// Times, so many to the second.
    Ticks(f64),
}

/// The kind of a column, or what it holds that is no number.
fn kind(column: &ColumnDescriptor) -> Told<Kind> {
    if column.max_rep_level() > 0 {
        return Err("lists".to_owned());
    }
    let ticks = |unit: &TimeUnit| match unit {
        TimeUnit::MILLIS => Kind::Ticks(1e3),
        TimeUnit::MICROS => Kind::Ticks(1e6),
        TimeUnit::NANOS => Kind::Ticks(1e9),
    };
    match column.logical_type_ref() {
        Some(LogicalType::Timestamp(time) | LogicalType::Time(time)) => {
            return Ok(ticks(&time.unit));
        }
        Some(LogicalType::Integer(integer)) if !integer.is_signed => return Ok(Kind::Unsigned),
        Some(LogicalType::Integer(_)) | None => {}
        Some(other) => return Err(format!("{other:?}")),
    }
    match (column.converted_type(), column.physical_type()) {
        (ConvertedType::TIMESTAMP_MILLIS | ConvertedType::TIME_MILLIS, _) => Ok(Kind::Ticks(1e3)),
        (ConvertedType::TIMESTAMP_MICROS | ConvertedType::TIME_MICROS, _) => Ok(Kind::Ticks(1e6)),
        (ConvertedType::UINT_32 | ConvertedType::UINT_64, _) => Ok(Kind::Unsigned),
        (ConvertedType::DECIMAL, _) => Err("decimals".to_owned()),
        (_, Type::BYTE_ARRAY | Type::FIXED_LEN_BYTE_ARRAY) => Err("text or bytes".to_owned()),
        (_, Type::INT96) => Ok(Kind::Ticks(1e9)),
        _ => Ok(Kind::Number),
    }
}

/// Appends a column's numbers of one group of rows.
fn append(
    guarded: Guarded,
    group: &RowGroupMetaData,
    column: &Described,
    origin: &mut Option<i64>,
    values: &mut Vec<f64>,
) -> parquet::errors::Result<()> {
    let chunk = group.column(column.place);
    let rows = group.num_rows() as usize;
    let pages = SerializedPageReader::new(Arc::new(guarded), chunk, rows, None)?;
    let mut since = |at: i64, ticks: f64| {
        (i128::from(at) - i128::from(*origin.get_or_insert(at))) as f64 / ticks
    };
    let descr = chunk.column_descr_ptr();
    match (get_column_reader(descr, Box::new(pages)), column.kind) {
        (ColumnReader::BoolColumnReader(r), _) => copy(r, chunk, rows, |v| f64::from(*v), values),
        (ColumnReader::FloatColumnReader(r), _) => copy(r, chunk, rows, |v| f64::from(*v), values),
        (ColumnReader::DoubleColumnReader(r), _) => copy(r, chunk, rows, |v| *v, values),
        (ColumnReader::Int32ColumnReader(r), Kind::Number) => {
            copy(r, chunk, rows, |v| f64::from(*v), values)
        }
        (ColumnReader::Int32ColumnReader(r), Kind::Unsigned) => {
            copy(r, chunk, rows, |v| f64::from(*v as u32), values)
        }
        (ColumnReader::Int32ColumnReader(r), Kind::Ticks(ticks)) => {
            copy(r, chunk, rows, |v| since(i64::from(*v), ticks), values)
        }
        (ColumnReader::Int64ColumnReader(r), Kind::Number) => {
            copy(r, chunk, rows, |v| *v as f64, values)
        }
        (ColumnReader::Int64ColumnReader(r), Kind::Unsigned) => {
            copy(r, chunk, rows, |v| *v as u64 as f64, values)
        }
        (ColumnReader::Int64ColumnReader(r), Kind::Ticks(ticks)) => {
            copy(r, chunk, rows, |v| since(*v, ticks), values)
        }
        (ColumnReader::Int96ColumnReader(r), _) => {
            copy(r, chunk, rows, |v| since(v.to_nanos(), 1e9), values)
        }
        _ => Err(ParquetError::General("it holds no numbers".to_owned())),
    }
}

/// Copies one column of a group, not-a-number where there is no value.
fn copy<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    chunk: &ColumnChunkMetaData,
    rows: usize,
    mut number: impl FnMut(&T::T) -> f64,
    values: &mut Vec<f64>,
) -> parquet::errors::Result<()> {
    let defined = chunk.column_descr().max_def_level();
    let (mut read, mut levels) = (Vec::new(), Vec::new());
    let mut left = rows;
    while left > 0 {
        read.clear();
        levels.clear();
        let (records, ..) =
            reader.read_records(left.min(PIECE), Some(&mut levels), None, &mut read)?;
        if records == 0 {
            return Err(ParquetError::General(format!(
                "{left} of {rows} rows are missing"
            )));
        }
        if read.len() == records {
            values.extend(read.iter().map(&mut number));
        } else {
            let mut read = read.iter();
            values.extend(levels.iter().map(|level| match *level == defined {
                true => read.next().map_or(f64::NAN, &mut number),
                false => f64::NAN,
            }));
        }
        left -= records;
    }
    Ok(())
}

/// A file whose pages are refused where they unpack to more than there is room for, before that is
/// done.
struct Guarded {
    bytes: Bytes,
    /// Where in the file these bytes begin.
    start: u64,
    left: u64,
    gzip: bool,
}

/// Page of the second version, in which only a part is packed.
const SECOND_VERSION: i64 = 3;

impl Guarded {
    fn new((bytes, start): (Bytes, u64), left: u64, chunk: &ColumnChunkMetaData) -> Self {
        Self {
            bytes,
            start,
            left,
            gzip: matches!(chunk.compression(), Compression::GZIP(_)),
        }
    }

    fn part(&self, start: u64, length: usize) -> parquet::errors::Result<Bytes> {
        let start = start.checked_sub(self.start);
        let start = start.and_then(|at| usize::try_from(at).ok());
        let start = start.unwrap_or(usize::MAX);
        let end = start
            .checked_add(length)
            .filter(|end| *end <= self.bytes.len());
        match end {
            Some(end) => Ok(self.bytes.slice(start..end)),
            None => Err(ParquetError::EOF("a part lies outside the file".to_owned())),
        }
    }
}

/// Kind and unpacked size of a page, the first two numbers of its header (Thrift's compact
/// protocol).
fn page(mut header: &[u8]) -> Option<(i64, i64)> {
    let mut number = || {
        // A field of 32 bits, numbered one above the last.
        let [0x15, rest @ ..] = header else {
            return None;
        };
        let length = 1 + rest.iter().position(|byte| byte & 0x80 == 0)?;
        let (digits, rest) = rest.split_at_checked(length.min(5))?;
        header = rest;
        let zigzag = digits
            .iter()
            .rev()
            .fold(0_i64, |sum, b| sum << 7 | i64::from(b & 0x7f));
        Some(zigzag >> 1 ^ -(zigzag & 1))
    };
    Some((number()?, number()?))
}

impl Length for Guarded {
    fn len(&self) -> u64 {
        self.start + self.bytes.len() as u64
    }
}

impl ChunkReader for Guarded {
    type T = Reader<Bytes>;

    fn get_read(&self, start: u64) -> parquet::errors::Result<Self::T> {
        let length = self.len().saturating_sub(start) as usize;
        let rest = self.part(start, length)?;
        let wrong = |what: &str| Err(ParquetError::General(what.to_owned()));
        match page(&rest) {
            None => wrong("a page is damaged"),
            Some((_, size)) if size > 0 && size as u64 > self.left => {
                Err(ParquetError::NeedMoreData(size as usize))
            }
            Some((SECOND_VERSION, _)) if self.gzip => {
                wrong("pages of version 2 are packed with gzip, use another packing")
            }
            Some(_) => Ok(rest.reader()),
        }
    }

    fn get_bytes(&self, start: u64, length: usize) -> parquet::errors::Result<Bytes> {
        let part = self.part(start, length)?;
        // The library unpacks gzip to its end, however long that is.
        if self.gzip {
            let unpacked = flate2::read::MultiGzDecoder::new(part.clone().reader());
            let mut unpacked = std::io::Read::take(unpacked, self.left.saturating_add(1));
            let size = std::io::copy(&mut unpacked, &mut std::io::sink()).unwrap_or(0);
            if size > self.left {
                return Err(ParquetError::NeedMoreData(size as usize));
            }
        }
        Ok(part)
    }
}
