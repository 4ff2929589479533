//! ZIP archives, which `.xlsx` and `.npz` files are: their entries, unpacked up to a limit.

use super::packed;
use crate::study::log::Request;
use crate::text::error::Result;
use std::borrow::Cow;

/// One file in an archive.
pub(super) struct Entry<'a> {
    pub(super) name: String,
    method: u16,
    packed: &'a [u8],
}

/// Little-endian integers at a place, `None` beyond the end.
fn u16_at(bytes: &[u8], at: usize) -> Option<usize> {
    let bytes = bytes.get(at..at.checked_add(2)?)?;
    Some(usize::from(u16::from_le_bytes([bytes[0], bytes[1]])))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<usize> {
    let bytes = bytes.get(at..at.checked_add(4)?)?;
    usize::try_from(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])).ok()
}

/// The entries by the directory at the archive's end; `None` where that is damaged.
fn directory(bytes: &[u8]) -> Option<Vec<Entry<'_>>> {
    let earliest = bytes.len().saturating_sub(22 + 0xffff);
    let end = (earliest..bytes.len())
        .rev()
        .find(|at| bytes[*at..].starts_with(b"PK\x05\x06"))?;
    let count = u16_at(bytes, end + 10)?;
    let mut at = u32_at(bytes, end + 16)?;
    let mut entries = Vec::new();
    for _ in 0..count {
        if !bytes.get(at..)?.starts_with(b"PK\x01\x02") {
            return None;
        }
        let [name, extra, comment] = [28, 30, 32].map(|offset| u16_at(bytes, at + offset));
        let local = u32_at(bytes, at + 42)?;
        let data = local + 30 + u16_at(bytes, local + 26)? + u16_at(bytes, local + 28)?;
        entries.push(Entry {
            name: String::from_utf8_lossy(bytes.get(at + 46..at + 46 + name?)?).into_owned(),
            method: u16::try_from(u16_at(bytes, at + 10)?).ok()?,
            packed: bytes.get(data..data.checked_add(u32_at(bytes, at + 20)?)?)?,
        });
        at += 46 + name? + extra? + comment?;
    }
    Some(entries)
}

/// The archive's entries, still packed.
pub(super) fn entries<'a>(request: &Request<'_>, bytes: &'a [u8]) -> Result<Vec<Entry<'a>>> {
    directory(bytes).ok_or_else(|| {
        request.error("is a ZIP archive without a whole directory at its end; it was cut off or damaged, copy it again")
    })
}

impl<'a> Entry<'a> {
    /// Its content, unpacked.
    pub(super) fn content(&self, request: &Request<'_>) -> Result<Cow<'a, [u8]>> {
        match self.method {
            0 => Ok(Cow::Borrowed(self.packed)),
            8 => packed::unpack(request, flate2::read::DeflateDecoder::new(self.packed))
                .map(Cow::Owned),
            _ => Err(request.error(format!(
                "holds {:?} packed in a way that is not deflate; save it again without that",
                self.name
            ))),
        }
    }
}
