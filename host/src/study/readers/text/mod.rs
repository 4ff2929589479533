//! Text of a log: its encoding, and its lines whatever ends them.

mod across;
mod blocks;
mod cells;
pub(super) mod csv;
mod heading;
mod labelled;
mod layout;
pub(super) mod long;
mod ways;

use crate::study::log::Request;
use crate::text::error::Result;
use std::borrow::Cow;

/// Bytes looked at to tell text from anything else.
const LOOKED_AT: usize = 1 << 16;
/// Share of control characters above which it is no text.
const CONTROL_SHARE: f64 = 1e-3;

pub(super) struct Text<'a> {
    pub(super) text: Cow<'a, str>,
    /// Its encoding, by name.
    pub(super) encoding: &'static str,
}

/// Decodes UTF-8, UTF-16 and, where neither fits, Latin-1.
pub(super) fn decode<'a>(request: &Request<'_>, bytes: &'a [u8]) -> Result<Text<'a>> {
    let head = &bytes[..bytes.len().min(LOOKED_AT)];
    let (text, encoding) = if let Some(little) = utf16(head) {
        let units = bytes.chunks_exact(2).map(|pair| {
            let pair = [pair[0], pair[1]];
            if little {
                u16::from_le_bytes(pair)
            } else {
                u16::from_be_bytes(pair)
            }
        });
        let text: String = char::decode_utf16(units)
            .map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER))
            .collect();
        (Cow::Owned(text), "UTF-16")
    } else {
        match std::str::from_utf8(bytes) {
            Ok(text) => (Cow::Borrowed(text), "UTF-8"),
            Err(_) => (
                Cow::Owned(bytes.iter().map(|b| char::from(*b)).collect()),
                "Latin-1",
            ),
        }
    };
    let text = match text.strip_prefix('\u{feff}') {
        Some(rest) => Cow::Owned(rest.to_owned()),
        None => text,
    };
    let looked: Vec<char> = text.chars().take(LOOKED_AT).collect();
    let control = |c: &&char| c.is_control() && !matches!(c, '\t' | '\n' | '\r' | '\x0c' | '\x1a');
    if looked.iter().filter(control).count() as f64 > CONTROL_SHARE * looked.len() as f64 {
        return Err(request.error(
            "is neither text nor a format known here; export the log as CSV, and check that the file is whole",
        ));
    }
    Ok(Text { text, encoding })
}

/// Whether bytes are text in one of the encodings that [`decode`] knows.
pub(super) fn is_text(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(LOOKED_AT)];
    let control = |b: &&u8| b.is_ascii_control() && !b.is_ascii_whitespace() && **b != 0x1a;
    utf16(head).is_some()
        || head.iter().filter(control).count() as f64 <= CONTROL_SHARE * head.len() as f64
}

/// Whether bytes begin as UTF-16 does: `true` for little-endian.
fn utf16(head: &[u8]) -> Option<bool> {
    match head {
        [0xff, 0xfe, ..] => Some(true),
        [0xfe, 0xff, ..] => Some(false),
        _ => byte_order_without_mark(head),
    }
}

/// UTF-16 without a mark: Latin letters and digits then have a zero in every other byte. `true` for
/// little-endian.
fn byte_order_without_mark(head: &[u8]) -> Option<bool> {
    let zeros = |odd: usize| {
        head.iter()
            .skip(odd)
            .step_by(2)
            .filter(|b| **b == 0)
            .count()
    };
    let (even, odd) = (zeros(0), zeros(1));
    let most = 0.4 * head.len() as f64;
    if odd as f64 > most && even == 0 {
        Some(true)
    } else if even as f64 > most && odd == 0 {
        Some(false)
    } else {
        None
    }
}

/// The lines with their numbers from 1, without blank lines; they end in LF, CR LF or CR.
pub(super) fn lines(text: &str) -> Box<dyn Iterator<Item = (usize, &str)> + '_> {
    let numbered = |(i, line)| (i + 1, line);
    // Excel for the Macintosh and some instruments end lines in a bare CR.
    if text.contains('\n') {
        Box::new(text.lines().enumerate().map(numbered).filter(not_blank))
    } else {
        Box::new(text.split('\r').enumerate().map(numbered).filter(not_blank))
    }
}

fn not_blank((_, line): &(usize, &str)) -> bool {
    !is_blank(line)
}

/// Whether a line has no content.
pub(super) fn is_blank(line: &str) -> bool {
    // 0x1A is how DOS programs mark the end of a text.
    line.trim_matches(|c: char| c.is_whitespace() || c == '\x1a')
        .is_empty()
}

/// Whether bytes begin like a text of which every line ends in one known byte: any but UTF-16.
pub(super) fn is_bytewise(head: &[u8]) -> bool {
    is_text(head) && utf16(&head[..head.len().min(LOOKED_AT)]).is_none()
}
