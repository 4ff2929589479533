//! The structure of an HDF5 file as MATLAB and h5py write it by default: groups with symbol tables
//! or links in their headers, datasets stored whole or in chunks, packed with deflate and shuffle.
//! Written after the HDF5 File Format Specification 3.0; the library that reads everything takes
//! longer to build than Jointwatch itself.
//!
//! Every address and size in the file is checked before it is used.

use super::stored::{Chunks, Dataset, Layout, dataset};
use crate::study::readers::cursor::{Cursor, Message, Told};
use crate::study::readers::packed;

/// Groups within groups that are followed.
const DEEPEST: usize = 8;
/// Objects and tree nodes that are looked at; more are a loop or no log.
const MAX_OBJECTS: usize = 100_000;
const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";
const UNDEFINED: u64 = u64::MAX;

/// A file's bytes from its base address on.
pub(super) struct Hierarchy<'a> {
    bytes: &'a [u8],
    root: u64,
}

impl<'a> Hierarchy<'a> {
    /// Where the file begins: at its first byte or behind a block of the user's.
    pub(super) fn signature(bytes: &[u8]) -> Option<usize> {
        let starts = |at: &usize| bytes.get(*at..).is_some_and(|b| b.starts_with(SIGNATURE));
        [0, 512, 1024, 2048, 4096].into_iter().find(starts)
    }

    pub(super) fn open(bytes: &'a [u8]) -> Told<Self> {
        let start = Self::signature(bytes).ok_or("it has no signature")?;
        let bytes = &bytes[start..];
        let mut head = Cursor(&bytes[SIGNATURE.len()..]);
        let version = head.number(1)?;
        let sizes = match version {
            0 | 1 => {
                head.take(4)?;
                head.take(2)?
            }
            2 | 3 => head.take(2)?,
            _ => return Err(format!("its version {version} is not known")),
        };
        if sizes != [8, 8] {
            return Err("its addresses have not 8 bytes".into());
        }
        let root = match version {
            0 | 1 => {
                head.take(if version == 0 { 9 } else { 13 })?;
                // Base, free space, end of file, driver; then the name of the root's entry.
                head.take(40)?;
                head.number(8)?
            }
            _ => {
                head.take(1 + 24)?;
                head.number(8)?
            }
        };
        Ok(Self { bytes, root })
    }

    fn at(&self, address: u64, size: u64) -> Told<&'a [u8]> {
        let from = usize::try_from(address).map_err(|_| "an address lies outside")?;
        let size = usize::try_from(size).map_err(|_| "a size is too large")?;
        let to = from.checked_add(size).ok_or("an address lies outside")?;
        let part = self.bytes.get(from..to);
        part.ok_or_else(|| "an address lies outside the file".to_owned())
    }

    fn from(&self, address: u64) -> Told<Cursor<'a>> {
        let from = usize::try_from(address).unwrap_or(usize::MAX);
        let rest = self.bytes.get(from..);
        Ok(Cursor(rest.ok_or("an address lies outside the file")?))
    }

    /// All datasets of the file.
    pub(super) fn datasets(&self) -> Told<Vec<Dataset>> {
        let mut datasets = Vec::new();
        let mut left = MAX_OBJECTS;
        self.walk(self.root, "", 0, &mut left, &mut datasets)?;
        Ok(datasets)
    }

    fn walk(
        &self,
        address: u64,
        name: &str,
        depth: usize,
        left: &mut usize,
        into: &mut Vec<Dataset>,
    ) -> Told<()> {
        *left = left.checked_sub(1).ok_or("it has too many objects")?;
        let messages = self.messages(address)?;
        if messages.iter().any(|m| m.kind == 0x08) {
            into.push(dataset(name, &messages)?);
            return Ok(());
        }
        for (link, child) in self.links(&messages, left)? {
            // MATLAB keeps there what its cells and objects point to.
            if depth < DEEPEST && !link.starts_with('#') {
                let path = match name {
                    "" => link,
                    group => format!("{group}/{link}"),
                };
                self.walk(child, &path, depth + 1, left, into)?;
            }
        }
        Ok(())
    }

    /// The messages of an object's header, continuations included.
    fn messages(&self, address: u64) -> Told<Vec<Message<'a>>> {
        let mut head = self.from(address)?;
        let mut messages = Vec::new();
        let mut blocks = Vec::new();
        let second = head.0.starts_with(b"OHDR");
        let mut order = 0;
        if second {
            head.take(5)?;
            let flags = head.number(1)?;
            head.take(if flags & 0x20 > 0 { 16 } else { 0 })?;
            head.take(if flags & 0x10 > 0 { 4 } else { 0 })?;
            let size = head.number(1 << (flags & 3))?;
            order = if flags & 4 > 0 { 2 } else { 0 };
            blocks.push(head.take(usize::try_from(size).unwrap_or(usize::MAX))?);
        } else {
            if head.number(1)? != 1 {
                return Err("an object's header is of an unknown version".into());
            }
            head.take(7)?;
            let size = head.number(4)?;
            head.take(4)?;
            blocks.push(head.take(size as usize)?);
        }
        while let Some(block) = blocks.pop() {
            let mut block = Cursor(block);
            while block.0.len() >= if second { 4 + order } else { 8 } {
                let kind = block.number(if second { 1 } else { 2 })?;
                let size = block.number(2)?;
                block.take(if second { 1 + order } else { 4 })?;
                let data = block.take(size as usize)?;
                if messages.len() > MAX_OBJECTS {
                    return Err("an object's header does not end".into());
                }
                if kind == 0x10 {
                    let mut place = Cursor(data);
                    let (at, size) = (place.number(8)?, place.number(8)?);
                    let whole = self.at(at, size)?;
                    // “OCHK” before, a checksum behind.
                    let inner = whole.get(4..whole.len().saturating_sub(4));
                    blocks.push(if second { inner.unwrap_or(&[]) } else { whole });
                }
                messages.push(Message {
                    kind: kind as u16,
                    data,
                });
            }
        }
        Ok(messages)
    }

    /// The names in a group and the addresses behind them.
    fn links(&self, messages: &[Message<'a>], left: &mut usize) -> Told<Vec<(String, u64)>> {
        let mut links = Vec::new();
        for message in messages {
            let mut data = Cursor(message.data);
            match message.kind {
                0x11 => {
                    let (tree, heap) = (data.number(8)?, data.number(8)?);
                    let mut head = self.from(heap)?;
                    if head.take(8)?[..4] != *b"HEAP" {
                        return Err("a group's names are damaged".into());
                    }
                    let size = head.number(8)?;
                    head.take(8)?;
                    let names = self.at(head.number(8)?, size)?;
                    self.symbols(tree, names, None, left, &mut links)?;
                }
                0x06 => links.extend(link(data)?),
                0x02 => {
                    data.take(1)?;
                    let flags = data.number(1)?;
                    data.take(if flags & 1 > 0 { 8 } else { 0 })?;
                    if data.number(8)? != UNDEFINED {
                        return Err("a group of many links is of a kind that is not read".into());
                    }
                }
                _ => {}
            }
        }
        Ok(links)
    }

    /// The entries below a node of a group's tree.
    fn symbols(
        &self,
        node: u64,
        names: &[u8],
        level: Option<u64>,
        left: &mut usize,
        links: &mut Vec<(String, u64)>,
    ) -> Told<()> {
        *left = left.checked_sub(1).ok_or("it has too many objects")?;
        let mut head = self.from(node)?;
        let is = self.node(&mut head, 0, level)?;
        for _ in 0..is.entries {
            head.take(8)?;
            let child = head.number(8)?;
            if is.level > 0 {
                self.symbols(child, names, Some(is.level - 1), left, links)?;
                continue;
            }
            let mut table = self.from(child)?;
            if table.take(6)?[..4] != *b"SNOD" {
                return Err("a group's entries are damaged".into());
            }
            for _ in 0..table.number(2)? {
                let (name, header) = (table.number(8)?, table.number(8)?);
                table.take(24)?;
                let name = names.get(usize::try_from(name).unwrap_or(usize::MAX)..);
                let name = name.and_then(|n| n.split(|b| *b == 0).next());
                links.push((text(name.ok_or("a name lies outside")?), header));
            }
        }
        Ok(())
    }

    /// A tree node's head: which level, and how many entries follow.
    fn node(&self, head: &mut Cursor<'a>, kind: u64, level: Option<u64>) -> Told<Node> {
        let damaged = "a tree is damaged";
        if head.take(4)? != b"TREE" || head.number(1)? != kind {
            return Err(damaged.into());
        }
        let own = head.number(1)?;
        if level.is_some_and(|level| level != own) {
            return Err(damaged.into());
        }
        let entries = head.number(2)?;
        head.take(16)?;
        Ok(Node {
            level: own,
            entries,
        })
    }

    /// The numbers of a dataset, in the file's order.
    pub(super) fn numbers(&self, dataset: &Dataset) -> Told<Vec<f64>> {
        let number = dataset.number.ok_or("it holds no numbers")?;
        let size = dataset.count().saturating_mul(number.size as u64);
        if size > packed::limit() {
            return Err(packed::too_large());
        }
        let size = size as usize;
        let bytes = match dataset
            .layout
            .as_ref()
            .ok_or("its storage is of a kind that is not read")?
        {
            Layout::Within(bytes) => bytes.clone(),
            Layout::At { address, .. } if *address == UNDEFINED => {
                return Err("it was never written".into());
            }
            Layout::At { address, size } => self.at(*address, *size)?.to_vec(),
            Layout::Chunks { tree, shape } => {
                if shape.len() != dataset.shape.len() || shape.contains(&0) {
                    return Err("its chunks do not fit it".into());
                }
                let chunk = shape
                    .iter()
                    .fold(number.size as u64, |all, n| all.saturating_mul(*n));
                if chunk > packed::limit() {
                    return Err(packed::too_large());
                }
                let mut whole = vec![0; size];
                let mut left = MAX_OBJECTS;
                let chunks = Chunks {
                    dataset,
                    shape,
                    number,
                    size: chunk as usize,
                };
                self.chunks(*tree, None, &chunks, &mut left, &mut whole)?;
                whole
            }
        };
        if bytes.len() < size {
            return Err("it ends too early".into());
        }
        Ok(bytes[..size]
            .chunks_exact(number.size)
            .map(|b| number.value(b))
            .collect())
    }

    fn chunks(
        &self,
        node: u64,
        level: Option<u64>,
        chunks: &Chunks<'_>,
        left: &mut usize,
        whole: &mut [u8],
    ) -> Told<()> {
        *left = left.checked_sub(1).ok_or("it has too many parts")?;
        let mut head = self.from(node)?;
        let is = self.node(&mut head, 1, level)?;
        for _ in 0..is.entries {
            let (size, mask) = (head.number(4)?, head.number(4)?);
            let origin: Vec<u64> = chunks
                .shape
                .iter()
                .map(|_| head.number(8))
                .collect::<Told<_>>()?;
            head.take(8)?;
            let child = head.number(8)?;
            if is.level > 0 {
                self.chunks(child, Some(is.level - 1), chunks, left, whole)?;
                continue;
            }
            let unpacked = chunks.unpacked(self.at(child, size)?, mask)?;
            chunks.place(&unpacked, &origin, whole)?;
        }
        Ok(())
    }
}

struct Node {
    level: u64,
    entries: u64,
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A link in a group's header; none where it is not a hard one.
fn link(mut data: Cursor<'_>) -> Told<Option<(String, u64)>> {
    data.take(1)?;
    let flags = data.number(1)?;
    let kind = if flags & 8 > 0 { data.number(1)? } else { 0 };
    data.take(if flags & 4 > 0 { 8 } else { 0 })?;
    data.take(if flags & 0x10 > 0 { 1 } else { 0 })?;
    let size = data.number(1 << (flags & 3))?;
    let name = text(data.take(usize::try_from(size).unwrap_or(usize::MAX))?);
    match kind {
        0 => Ok(Some((name, data.number(8)?))),
        _ => Ok(None),
    }
}
