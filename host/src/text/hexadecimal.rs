//! Bytes as people compare them.

/// Two lower-case digits for each byte, as `sha256sum` prints a digest.
pub(crate) fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
