//! Little-endian numbers read one after the other, never past the end.

/// What was read, or why it cannot be, in words.
pub(super) type Told<T> = std::result::Result<T, String>;

/// A message of an object's header.
pub(super) struct Message<'a> {
    pub(super) kind: u16,
    pub(super) data: &'a [u8],
}

/// Reads little-endian numbers one after the other.
pub(super) struct Cursor<'a>(pub(super) &'a [u8]);

impl<'a> Cursor<'a> {
    pub(super) fn take(&mut self, count: usize) -> Told<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or("it ends too early")?;
        self.0 = rest;
        Ok(taken)
    }

    pub(super) fn number(&mut self, size: usize) -> Told<u64> {
        let bytes = self.take(size)?;
        Ok(bytes
            .iter()
            .rev()
            .fold(0, |sum, b| (sum << 8) | u64::from(*b)))
    }
}
