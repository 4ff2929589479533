//! Datasets of an HDF5 file: how their numbers are stored, cut into chunks and packed.

use crate::study::readers::cursor::{Cursor, Message, Number, Told};
use std::io::Read;

pub(super) enum Layout {
    Within(Vec<u8>),
    At { address: u64, size: u64 },
    Chunks { tree: u64, shape: Vec<u64> },
}

/// One dataset, not yet read.
pub(super) struct Dataset {
    /// Path from the root.
    pub(super) name: String,
    pub(super) shape: Vec<u64>,
    /// `None` for text, structures and references.
    pub(super) number: Option<Number>,
    pub(super) layout: Option<Layout>,
    filters: Vec<u16>,
}

impl Dataset {
    /// How many numbers it holds.
    pub(super) fn count(&self) -> u64 {
        self.shape.iter().fold(1, |all, n| all.saturating_mul(*n))
    }
}

/// How a dataset is cut into chunks.
pub(super) struct Chunks<'a> {
    pub(super) dataset: &'a Dataset,
    pub(super) shape: &'a [u64],
    pub(super) number: Number,
    /// Bytes of a chunk.
    pub(super) size: usize,
}

impl Chunks<'_> {
    /// A chunk's bytes, its filters undone last first.
    pub(super) fn unpacked(&self, bytes: &[u8], mask: u64) -> Told<Vec<u8>> {
        let mut bytes = bytes.to_vec();
        for (place, filter) in self.dataset.filters.iter().enumerate().rev() {
            if mask >> place & 1 == 1 {
                continue;
            }
            bytes = match filter {
                1 => {
                    let mut plain = Vec::new();
                    let most = self.size as u64 + 64;
                    let unpacked = flate2::read::ZlibDecoder::new(bytes.as_slice())
                        .take(most)
                        .read_to_end(&mut plain);
                    unpacked.map_err(|e| format!("a part cannot be unpacked, {e}"))?;
                    plain
                }
                2 => unshuffled(&bytes, self.number.size),
                // A checksum behind the data.
                3 => bytes[..bytes.len().saturating_sub(4)].to_vec(),
                other => {
                    return Err(format!(
                        "it is packed with filter {other}, which is not read"
                    ));
                }
            };
        }
        match bytes.len() < self.size {
            true => Err("a part ends too early".into()),
            false => Ok(bytes),
        }
    }

    /// Copies a chunk to where it belongs, row by row of its last dimension; what hangs over the
    /// edge is padding.
    pub(super) fn place(&self, chunk: &[u8], origin: &[u64], whole: &mut [u8]) -> Told<()> {
        let shape = &self.dataset.shape;
        let size = self.number.size;
        let (Some(width), Some(chunk_width)) = (shape.last(), self.shape.last()) else {
            return Err("a part has no shape".into());
        };
        let first = origin[origin.len() - 1];
        let kept = width.saturating_sub(first).min(*chunk_width) as usize * size;
        for (row, part) in chunk[..self.size]
            .chunks_exact(*chunk_width as usize * size)
            .enumerate()
        {
            // The row's place in the chunk and in the whole, dimension by dimension from the last
            // but one.
            let (mut rest, mut at, mut stride, mut inside) = (row as u64, first, *width, true);
            for axis in (0..shape.len() - 1).rev() {
                let place = origin[axis].saturating_add(rest % self.shape[axis]);
                rest /= self.shape[axis];
                inside &= place < shape[axis];
                at = at.saturating_add(place.saturating_mul(stride));
                stride = stride.saturating_mul(shape[axis]);
            }
            if inside && kept > 0 {
                let at = usize::try_from(at)
                    .unwrap_or(usize::MAX)
                    .saturating_mul(size);
                let target = whole.get_mut(at..at.saturating_add(kept));
                target
                    .ok_or("a part lies outside")?
                    .copy_from_slice(&part[..kept]);
            }
        }
        Ok(())
    }
}

/// Undoes the shuffle filter, which puts first bytes of all numbers first.
fn unshuffled(bytes: &[u8], size: usize) -> Vec<u8> {
    let count = bytes.len() / size;
    let mut plain = bytes.to_vec();
    for (place, byte) in bytes[..count * size].iter().enumerate() {
        plain[place % count * size + place / count] = *byte;
    }
    plain
}

pub(super) fn dataset(name: &str, messages: &[Message<'_>]) -> Told<Dataset> {
    let mut dataset = Dataset {
        name: name.to_owned(),
        shape: Vec::new(),
        number: None,
        layout: None,
        filters: Vec::new(),
    };
    for message in messages {
        let mut data = Cursor(message.data);
        match message.kind {
            0x01 => {
                let version = data.number(1)?;
                let dimensions = data.number(1)?;
                data.take(if version == 1 { 6 } else { 2 })?;
                dataset.shape = (0..dimensions)
                    .map(|_| data.number(8))
                    .collect::<Told<_>>()?;
            }
            0x03 => dataset.number = number(data)?,
            0x08 => dataset.layout = layout(data)?,
            0x0b => dataset.filters = filters(data)?,
            _ => {}
        }
    }
    Ok(dataset)
}

fn number(mut data: Cursor<'_>) -> Told<Option<Number>> {
    let class = data.number(1)? & 15;
    let bits = data.number(3)?;
    let size = data.number(4)? as usize;
    let sound = match class {
        0 => matches!(size, 1 | 2 | 4 | 8),
        1 => matches!(size, 4 | 8),
        _ => false,
    };
    Ok(sound.then_some(Number {
        float: class == 1,
        signed: bits & 8 > 0,
        big_endian: bits & 1 > 0,
        size,
    }))
}

/// How a dataset is stored; none where it is in a way that only newer libraries write.
fn layout(mut data: Cursor<'_>) -> Told<Option<Layout>> {
    let version = data.number(1)?;
    let class = data.number(1)?;
    Ok(match (version, class) {
        (3 | 4, 0) => {
            let size = data.number(2)?;
            Some(Layout::Within(data.take(size as usize)?.to_vec()))
        }
        (3 | 4, 1) => Some(Layout::At {
            address: data.number(8)?,
            size: data.number(8)?,
        }),
        (3, 2) => {
            // The last dimension is the size of a number.
            let dimensions = data.number(1)?.saturating_sub(1);
            let tree = data.number(8)?;
            let shape = (0..dimensions)
                .map(|_| data.number(4))
                .collect::<Told<_>>()?;
            Some(Layout::Chunks { tree, shape })
        }
        _ => None,
    })
}

/// The numbers of the filters, first applied first.
fn filters(mut data: Cursor<'_>) -> Told<Vec<u16>> {
    let version = data.number(1)?;
    let count = data.number(1)?;
    data.take(if version == 1 { 6 } else { 0 })?;
    let mut filters = Vec::new();
    for _ in 0..count {
        let id = data.number(2)?;
        let named = version == 1 || id >= 256;
        let name = if named { data.number(2)? } else { 0 };
        data.take(2)?;
        let values = data.number(2)? as usize;
        data.take(name as usize)?;
        data.take(4 * values + if version == 1 { 4 * (values % 2) } else { 0 })?;
        filters.push(id as u16);
    }
    Ok(filters)
}
