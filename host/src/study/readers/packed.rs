//! Packed bytes, unpacked up to a limit: a few kilobytes must not be able to fill the memory.

use crate::study::log::Request;
use crate::text::error::Result;
use std::io::Read;

/// Bytes that one log may unpack to, unless the environment says otherwise.
const DEFAULT_LIMIT: u64 = 1 << 30;
/// The environment variable that raises it, in bytes.
const VARIABLE: &str = "JOINTWATCH_MAX_UNPACKED_BYTES";

/// Bytes that one log may unpack to.
pub(crate) fn limit() -> u64 {
    let stated = std::env::var(VARIABLE).ok();
    stated
        .and_then(|value| value.parse().ok())
        .unwrap_or(DEFAULT_LIMIT)
}

/// The sentence's end when a log is larger than [`limit`].
pub(crate) fn too_large() -> String {
    format!(
        "unpacks to more than {} bytes, which a broken or hostile file does as well; if it is sound, set {VARIABLE} to a larger \
         number",
        limit()
    )
}

/// Everything a packed stream holds, refused above [`limit`].
pub(crate) fn unpack(request: &Request<'_>, packed: impl Read) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    packed
        .take(limit().saturating_add(1))
        .read_to_end(&mut bytes)
        .map_err(|e| {
            request.error(format!(
                "is packed and cannot be unpacked to its end ({e}); it was cut off or damaged, copy it again"
            ))
        })?;
    if bytes.len() as u64 > limit() {
        return Err(request.error(too_large()));
    }
    Ok(bytes)
}

/// The content of a gzip file.
pub(super) fn gunzip(request: &Request<'_>, bytes: &[u8]) -> Result<Vec<u8>> {
    unpack(request, flate2::read::MultiGzDecoder::new(bytes))
}
