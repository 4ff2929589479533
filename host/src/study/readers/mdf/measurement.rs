//! The blocks of an ASAM MDF 4 file: groups of channels, their records in plain, listed and packed
//! data blocks.
//!
//! Written after the ASAM MDF 4.1 base standard, for channels of numbers with a linear or rational
//! conversion; what else a file holds is left out. Every link and length is checked before it is
//! used.

use crate::study::readers::packed;
use std::io::Read;

type Told<T> = std::result::Result<T, String>;

/// Blocks in one chain; more are a loop.
const MAX_BLOCKS: usize = 100_000;

/// The bytes of a whole file; a link in it is the place of a block.
pub(super) struct Measurement<'a> {
    bytes: &'a [u8],
}

/// One block: its kind, its links, its data.
struct Block<'a> {
    kind: [u8; 2],
    links: Vec<u64>,
    data: &'a [u8],
}

impl Block<'_> {
    fn link(&self, place: usize) -> u64 {
        self.links.get(place).copied().unwrap_or(0)
    }

    /// A little-endian number of the data.
    fn number(&self, at: usize, size: usize) -> Told<u64> {
        let bytes = self
            .data
            .get(at..at + size)
            .ok_or("a block ends too early")?;
        Ok(bytes
            .iter()
            .rev()
            .fold(0, |sum, b| (sum << 8) | u64::from(*b)))
    }

    fn float(&self, at: usize) -> Told<f64> {
        Ok(f64::from_bits(self.number(at, 8)?))
    }
}

/// One channel group: channels that were sampled together.
pub(super) struct Group {
    pub(super) channels: Vec<Channel>,
    /// How many records it has.
    pub(super) cycles: u64,
    /// Bytes of a record, and of the invalidation bits behind it.
    size: usize,
    data: u64,
    /// Bytes of the number before each record, 0 where all are of this group.
    id_size: usize,
    id: u64,
    /// The numbers and sizes of all groups whose records are mixed; `None` for records that say
    /// their own length.
    mixed: Vec<(u64, Option<usize>)>,
}

/// One channel of numbers.
pub(super) struct Channel {
    pub(super) name: String,
    pub(super) unit: Option<String>,
    /// Its values are the records' numbers.
    is_virtual: bool,
    kind: u64,
    bit_offset: u32,
    byte: usize,
    bits: u32,
    /// The bit that is set where a value is not valid.
    invalid: Option<usize>,
    conversion: Conversion,
}

enum Conversion {
    None,
    Linear([f64; 2]),
    Rational([f64; 6]),
}

impl<'a> Measurement<'a> {
    pub(super) fn open(bytes: &'a [u8]) -> Told<Self> {
        if bytes.starts_with(b"UnFinMF ") {
            return Err("its logger did not finish it".into());
        }
        match bytes.get(8) {
            Some(b'4') => Ok(Self { bytes }),
            Some(version) if version.is_ascii_digit() => {
                Err(format!("it is of version {}", char::from(*version)))
            }
            Some(_) => Err("its version is no number".into()),
            None => Err("it ends too early".into()),
        }
    }

    fn block(&self, at: u64) -> Told<Block<'a>> {
        let outside = "a link leads outside the file";
        let from = usize::try_from(at).map_err(|_| outside)?;
        let head = self
            .bytes
            .get(from..)
            .and_then(|b| b.get(..24))
            .ok_or(outside)?;
        let number = |at: usize| {
            head[at..at + 8]
                .iter()
                .rev()
                .fold(0_u64, |sum, b| (sum << 8) | u64::from(*b))
        };
        let length = usize::try_from(number(8)).map_err(|_| outside)?;
        let links = usize::try_from(number(16)).map_err(|_| outside)?;
        let to = from.checked_add(length).ok_or(outside)?;
        let whole = self
            .bytes
            .get(from..to)
            .ok_or("a block goes on behind the file's end")?;
        let data = links
            .checked_mul(8)
            .and_then(|n| n.checked_add(24))
            .ok_or(outside)?;
        if &head[..2] != b"##" || data > whole.len() {
            return Err("a block is damaged".into());
        }
        let links = whole[24..data].chunks_exact(8);
        Ok(Block {
            kind: [head[2], head[3]],
            links: links
                .map(|b| {
                    b.iter()
                        .rev()
                        .fold(0_u64, |sum, b| (sum << 8) | u64::from(*b))
                })
                .collect(),
            data: &whole[data..],
        })
    }

    /// The blocks of a chain, each with the link to the next first.
    fn chain(&self, first: u64, kind: &[u8; 2]) -> Told<Vec<Block<'a>>> {
        let mut blocks = Vec::new();
        let mut at = first;
        while at != 0 {
            let block = self.block(at)?;
            if block.kind != *kind || blocks.len() >= MAX_BLOCKS {
                return Err("a chain of blocks is damaged".into());
            }
            at = block.link(0);
            blocks.push(block);
        }
        Ok(blocks)
    }

    /// A text block's words, or the first `<TX>` of one with XML.
    fn text(&self, at: u64) -> Told<Option<String>> {
        if at == 0 {
            return Ok(None);
        }
        let block = self.block(at)?;
        let text = String::from_utf8_lossy(block.data.split(|b| *b == 0).next().unwrap_or(&[]))
            .into_owned();
        let text = match block.kind {
            [b'M', b'D'] => {
                let inner = text
                    .split_once("<TX>")
                    .and_then(|(_, rest)| rest.split_once("</TX>"));
                inner.map_or(String::new(), |(words, _)| words.to_owned())
            }
            _ => text,
        };
        let text = text.trim();
        Ok((!text.is_empty()).then(|| text.to_owned()))
    }

    /// All groups that have records.
    pub(super) fn groups(&self) -> Told<Vec<Group>> {
        let head = self.block(64)?;
        let mut groups = Vec::new();
        for data in self.chain(head.link(0), b"DG")? {
            let id_size = data.number(0, 1)? as usize;
            if !matches!(id_size, 0 | 1 | 2 | 4 | 8) {
                return Err("a data group is damaged".into());
            }
            let chain = self.chain(data.link(1), b"CG")?;
            let mut mixed = Vec::new();
            for group in &chain {
                let own_length = group.number(16, 2)? & 1 == 1;
                let size = group.number(24, 4)? + group.number(28, 4)?;
                mixed.push((group.number(0, 8)?, (!own_length).then_some(size as usize)));
            }
            for group in &chain {
                if group.number(16, 2)? & 1 == 1 {
                    continue;
                }
                let bytes = group.number(24, 4)? as usize;
                groups.push(Group {
                    channels: self.channels(group, bytes)?,
                    cycles: group.number(8, 8)?,
                    size: bytes + group.number(28, 4)? as usize,
                    data: data.link(2),
                    id_size,
                    id: group.number(0, 8)?,
                    mixed: mixed.clone(),
                });
            }
        }
        Ok(groups)
    }

    fn channels(&self, group: &Block<'a>, bytes: usize) -> Told<Vec<Channel>> {
        let mut channels = Vec::new();
        for block in self.chain(group.link(1), b"CN")? {
            let flags = block.number(12, 4)?;
            let mut channel = Channel {
                name: self.text(block.link(2))?.unwrap_or_default(),
                unit: None,
                is_virtual: matches!(block.number(0, 1)?, 3 | 6),
                kind: block.number(2, 1)?,
                bit_offset: block.number(3, 1)? as u32,
                byte: block.number(4, 4)? as usize,
                bits: block.number(8, 4)? as u32,
                invalid: match flags & 3 {
                    0 => None,
                    _ => Some(block.number(16, 4)? as usize + 8 * bytes),
                },
                conversion: Conversion::None,
            };
            let sized = match channel.kind {
                0..=3 => {
                    (1..=64).contains(&channel.bits) && channel.bit_offset + channel.bits <= 64
                }
                4 | 5 => matches!(channel.bits, 32 | 64) && channel.bit_offset == 0,
                _ => false,
            };
            let inside = channel.byte.saturating_add(channel.width()) <= bytes;
            // Arrays, texts and values of changing length are no columns.
            let fixed = matches!(block.number(0, 1)?, 0 | 2 | 3 | 6) && block.link(1) == 0;
            if !fixed || !(channel.is_virtual || sized && inside) {
                continue;
            }
            let Some((conversion, unit)) = self.conversion(block.link(4))? else {
                continue;
            };
            channel.conversion = conversion;
            channel.unit = self.text(block.link(6))?.or(unit);
            channels.push(channel);
        }
        Ok(channels)
    }

    /// How raw numbers become physical ones, and in which unit; `None` where they become text.
    fn conversion(&self, at: u64) -> Told<Option<(Conversion, Option<String>)>> {
        if at == 0 {
            return Ok(Some((Conversion::None, None)));
        }
        let block = self.block(at)?;
        let value = |place: usize| block.float(24 + 8 * place);
        let conversion = match block.number(0, 1)? {
            0 => Conversion::None,
            1 => Conversion::Linear([value(0)?, value(1)?]),
            2 => {
                let mut all = [0.0; 6];
                for (place, to) in all.iter_mut().enumerate() {
                    *to = value(place)?;
                }
                Conversion::Rational(all)
            }
            _ => return Ok(None),
        };
        Ok(Some((conversion, self.text(block.link(1))?)))
    }

    /// The records of a group, one behind the other, without their numbers.
    pub(super) fn records(&self, group: &Group) -> Told<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut left = MAX_BLOCKS;
        self.data(group.data, &mut left, &mut bytes)?;
        if group.id_size == 0 {
            return Ok(bytes);
        }
        let mut own = Vec::new();
        let mut rest = bytes.as_slice();
        while let Some((id, after)) = rest.split_at_checked(group.id_size) {
            let id = id.iter().rev().fold(0, |sum, b| (sum << 8) | u64::from(*b));
            let known = group.mixed.iter().find(|(known, _)| *known == id);
            let (_, size) = known.ok_or("a record belongs to no group")?;
            let (skip, size) = match size {
                Some(size) => (0, *size),
                None => match after.first_chunk::<4>() {
                    Some(length) => (4, u32::from_le_bytes(*length) as usize),
                    None => break,
                },
            };
            let Some((record, after)) = after.split_at_checked(skip + size) else {
                break;
            };
            if id == group.id {
                own.extend_from_slice(record);
            }
            rest = after;
        }
        Ok(own)
    }

    /// Adds what a data block, or a list of them, holds.
    fn data(&self, at: u64, left: &mut usize, into: &mut Vec<u8>) -> Told<()> {
        let mut next = at;
        while next != 0 {
            *left = left.checked_sub(1).ok_or("it has too many data blocks")?;
            let block = self.block(next)?;
            next = 0;
            match &block.kind {
                b"DT" => into.extend_from_slice(block.data),
                b"DZ" => unpack(&block, into)?,
                b"HL" => next = block.link(0),
                b"DL" => {
                    for part in block.links.iter().skip(1).filter(|link| **link != 0) {
                        let part = self.block(*part)?;
                        *left = left.checked_sub(1).ok_or("it has too many data blocks")?;
                        match &part.kind {
                            b"DT" => into.extend_from_slice(part.data),
                            b"DZ" => unpack(&part, into)?,
                            _ => return Err("a list of data is damaged".into()),
                        }
                    }
                    next = block.link(0);
                }
                other => {
                    let kind = String::from_utf8_lossy(other).into_owned();
                    return Err(format!(
                        "its data stand in a block {kind:?}, which is not read"
                    ));
                }
            }
            if into.len() as u64 > packed::limit() {
                return Err(packed::too_large());
            }
        }
        Ok(())
    }
}

/// Adds what a packed block holds.
fn unpack(block: &Block<'_>, into: &mut Vec<u8>) -> Told<()> {
    let transposed = block.number(2, 1)? == 1;
    let columns = block.number(4, 4)? as usize;
    let size = block.number(8, 8)?;
    let packed = block.data.get(24..).ok_or("a block ends too early")?;
    if size.saturating_add(into.len() as u64) > packed::limit() {
        return Err(packed::too_large());
    }
    let mut plain = Vec::new();
    let unpacked = flate2::read::ZlibDecoder::new(packed)
        .take(size.saturating_add(1))
        .read_to_end(&mut plain);
    unpacked.map_err(|e| format!("a block cannot be unpacked, {e}"))?;
    if plain.len() as u64 != size {
        return Err("a packed block has not the size it states".into());
    }
    if !transposed || columns == 0 {
        into.extend_from_slice(&plain);
        return Ok(());
    }
    let rows = plain.len() / columns;
    for row in 0..rows {
        into.extend((0..columns).map(|column| plain[column * rows + row]));
    }
    into.extend_from_slice(&plain[rows * columns..]);
    Ok(())
}

impl Channel {
    /// Bytes that hold its bits.
    fn width(&self) -> usize {
        (self.bit_offset as usize + self.bits as usize).div_ceil(8)
    }

    fn raw(&self, record: &[u8]) -> f64 {
        let mut bytes = [0; 8];
        let width = self.width();
        bytes[..width].copy_from_slice(&record[self.byte..self.byte + width]);
        if self.kind % 2 == 1 {
            bytes[..width].reverse();
        }
        let all = u64::from_le_bytes(bytes) >> self.bit_offset;
        let unused = 64 - self.bits;
        match self.kind {
            0 | 1 => (all << unused >> unused) as f64,
            2 | 3 => ((all << unused) as i64 >> unused) as f64,
            _ if self.bits == 32 => f64::from(f32::from_bits(all as u32)),
            _ => f64::from_bits(all),
        }
    }
}

impl Group {
    /// A channel's physical values; what the file marks as invalid is not a number.
    pub(super) fn values(&self, channel: &Channel, records: &[u8]) -> Vec<f64> {
        let whole = records.chunks_exact(self.size.max(1));
        let rows = whole.take(usize::try_from(self.cycles).unwrap_or(usize::MAX));
        rows.enumerate()
            .map(|(row, record)| {
                let marked =
                    |bit: usize| record.get(bit / 8).is_some_and(|b| b >> (bit % 8) & 1 == 1);
                if channel.invalid.is_some_and(marked) {
                    return f64::NAN;
                }
                let raw = match channel.is_virtual {
                    true => row as f64,
                    false => channel.raw(record),
                };
                channel.conversion.apply(raw)
            })
            .collect()
    }
}

impl Conversion {
    fn apply(&self, x: f64) -> f64 {
        match self {
            Self::None => x,
            Self::Linear([offset, factor]) => offset + factor * x,
            Self::Rational([a, b, c, d, e, f]) => (a * x * x + b * x + c) / (d * x * x + e * x + f),
        }
    }
}
