//! Checksums and frames around bytes of any kind, so that what is behind a checksum is reached as
//! well.

use crc::{CRC_32_ISO_HDLC, Crc};

const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// Bytes whose last four are the checksum of the others.
pub(super) fn repaired(bytes: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    if let Some((content, place)) = bytes.split_last_chunk_mut::<4>() {
        *place = CRC.checksum(content).to_le_bytes();
    }
    bytes
}

/// What a line carries: pieces, each with its length before it, as payloads of sound frames; a
/// length of 0 ends that, and the rest is on the line as it is.
pub(super) fn line(mut pieces: &[u8]) -> Vec<u8> {
    let mut line = vec![0];
    while let Some((&length, rest)) = pieces.split_first() {
        if length == 0 {
            line.extend_from_slice(rest);
            break;
        }
        let (payload, rest) = rest.split_at(usize::from(length).min(rest.len()));
        let framed = [payload, &CRC.checksum(payload).to_le_bytes()].concat();
        // Consistent overhead byte stuffing (Cheshire and Baker, 1999).
        for run in framed.split(|&byte| byte == 0) {
            let mut rest = run;
            while rest.len() >= 254 {
                line.push(255);
                line.extend_from_slice(&rest[..254]);
                rest = &rest[254..];
            }
            line.push(rest.len() as u8 + 1);
            line.extend_from_slice(rest);
        }
        line.push(0);
        pieces = rest;
    }
    line
}

/// The pieces of these payloads.
pub(super) fn pieces(payloads: &[Vec<u8>]) -> Vec<u8> {
    let pieces = payloads.iter().flat_map(|payload| {
        let length = payload.len().min(255);
        std::iter::once(length as u8).chain(payload[..length].iter().copied())
    });
    pieces.collect()
}
