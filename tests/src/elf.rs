//! Looks into a firmware image: which functions it holds, where they lie, and the same image with a
//! few bytes changed.

use object::{Object, ObjectSection, ObjectSegment, ObjectSymbol};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// An image with its symbol table.
pub struct Image {
    /// The ELF file's bytes.
    pub bytes: Vec<u8>,
    /// Every symbol's name and address.
    pub symbols: BTreeMap<String, u64>,
}

impl Image {
    /// Reads an ELF file.
    ///
    /// # Panics
    /// When it is not there or is not an ELF file: a test cannot go on without it.
    pub fn read(path: &Path) -> Self {
        let bytes = std::fs::read(path).unwrap_or_else(|why| panic!("{}: {why}", path.display()));
        let file = object::File::parse(&*bytes).expect("an ELF file");
        let named =
            |symbol: object::Symbol| Some((symbol.name().ok()?.to_owned(), symbol.address()));
        let symbols = file.symbols().filter_map(named).collect();
        Self { bytes, symbols }
    }

    /// The address of the symbol whose name contains `part`.
    ///
    /// # Panics
    /// When there is none.
    pub fn address(&self, part: &str) -> u64 {
        let found = self.symbols.iter().find(|(name, _)| name.contains(part));
        *found
            .unwrap_or_else(|| panic!("the image has no symbol {part}"))
            .1
    }

    /// The image with `patch` in place of what is loaded at `address`.
    ///
    /// # Panics
    /// When nothing of the file is loaded there.
    pub fn patched(&self, address: u64, patch: &[u8]) -> Vec<u8> {
        let file = object::File::parse(&*self.bytes).expect("it was parsed before");
        let offset = file.segments().find_map(|segment| {
            let within = address.checked_sub(segment.address())?;
            let (start, length) = segment.file_range();
            (within + patch.len() as u64 <= length).then_some(start + within)
        });
        let offset = offset.expect("something of the file is loaded there") as usize;
        let mut bytes = self.bytes.clone();
        bytes[offset..offset + patch.len()].copy_from_slice(patch);
        bytes
    }
}

impl Image {
    /// For every function, the functions that it calls or jumps to by name; calls through a pointer
    /// are not seen.
    ///
    /// # Panics
    /// When the image has no code.
    pub fn calls(&self) -> BTreeMap<String, BTreeSet<String>> {
        let file = object::File::parse(&*self.bytes).expect("it was parsed before");
        let code = file.section_by_name(".text").expect("an image has code");
        let (start, bytes) = (code.address(), code.data().expect("its bytes are there"));
        let mut functions = BTreeMap::new();
        for symbol in file.symbols() {
            if symbol.kind() == object::SymbolKind::Text
                && let Ok(name) = symbol.name()
                && !name.starts_with('$')
            {
                // The lowest bit of an address says Thumb.
                functions.insert(symbol.address() & !1, (name.to_owned(), symbol.size()));
            }
        }
        let mut calls = BTreeMap::new();
        for (address, (name, size)) in &functions {
            let callees: &mut BTreeSet<String> = calls.entry(name.clone()).or_default();
            let Some(from) = address.checked_sub(start) else {
                continue;
            };
            let body = bytes.get(from as usize..).unwrap_or_default();
            let body = &body[..body.len().min(*size as usize)];
            let words: Vec<u16> = body
                .as_chunks::<2>()
                .0
                .iter()
                .map(|word| u16::from_le_bytes(*word))
                .collect();
            let mut at = 0;
            while at < words.len() {
                let wide = words[at] >= 0xE800;
                if let (true, Some(&second)) = (wide, words.get(at + 1)) {
                    let here = address + 2 * at as u64;
                    if let Some(target) = branch(words[at], second, here)
                        && let Some((callee, _)) = functions.get(&target)
                    {
                        callees.insert(callee.clone());
                    }
                }
                at += if wide { 2 } else { 1 };
            }
        }
        calls
    }
}

/// Where a BL or a B.W at `here` goes (ARMv7-M Architecture Reference Manual, A7.7.12 and A7.7.18,
/// encodings T4 and T1).
fn branch(first: u16, second: u16, here: u64) -> Option<u64> {
    let (first, second) = (u32::from(first), u32::from(second));
    if first & 0xF800 != 0xF000 || !matches!(second & 0xD000, 0xD000 | 0x9000) {
        return None;
    }
    let sign = first >> 10 & 1;
    let i1 = !(second >> 13 & 1 ^ sign) & 1;
    let i2 = !(second >> 11 & 1 ^ sign) & 1;
    let offset = sign << 24 | i1 << 23 | i2 << 22 | (first & 0x3FF) << 12 | (second & 0x7FF) << 1;
    let offset = i64::from((offset << 7).cast_signed() >> 7);
    Some((here as i64 + 4 + offset) as u64)
}

/// A mangled name as it is written in the source, without its hash.
pub fn readable(name: &str) -> String {
    let mut parts = Vec::new();
    let mut rest = name.strip_prefix("_ZN").unwrap_or_default();
    while let Some(digits) = rest.find(|c: char| !c.is_ascii_digit()).filter(|&n| n > 0) {
        let (length, text) = rest.split_at(digits);
        let Some((part, after)) = length.parse().ok().and_then(|n| text.split_at_checked(n)) else {
            break;
        };
        parts.push(part.trim_start_matches('_').replace("..", "::"));
        rest = after;
    }
    parts.pop();
    if parts.is_empty() {
        name.to_owned()
    } else {
        parts.join("::")
    }
}

/// What a function's name contains when it leads to a panic: the formatter and the handler every
/// panic goes through, and the cold functions that slices, options and arithmetic call first.
const LEADS_TO_PANIC: [&str; 10] = [
    "panicking",
    "panic_fmt",
    "panic_nounwind",
    "rust_begin_unwind",
    "rust_panic",
    "unwrap_failed",
    "expect_failed",
    "slice_index",
    "index_fail",
    "mismatch_fail",
];

/// The names among `symbols` that only a program with a panic path has.
pub fn panic_paths<'a>(symbols: impl IntoIterator<Item = &'a String>) -> Vec<&'a str> {
    let leads = |name: &&'a str| LEADS_TO_PANIC.iter().any(|part| name.contains(part));
    symbols
        .into_iter()
        .map(String::as_str)
        .filter(leads)
        .collect()
}
