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

/// How a number is stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Number {
    pub(super) float: bool,
    pub(super) signed: bool,
    pub(super) big_endian: bool,
    pub(super) size: usize,
}

impl Number {
    /// The number in as many bytes as its size says.
    pub(super) fn value(&self, bytes: &[u8]) -> f64 {
        let mut wide = [0; 8];
        for (to, from) in wide.iter_mut().zip(bytes) {
            *to = *from;
        }
        if self.big_endian {
            wide[..self.size].reverse();
        }
        let bits = u64::from_le_bytes(wide);
        let unused = 64 - 8 * self.size as u32;
        match (self.float, self.size, self.signed) {
            (true, 4, _) => f64::from(f32::from_bits(bits as u32)),
            (true, _, _) => f64::from_bits(bits),
            (false, _, true) => ((bits << unused) as i64 >> unused) as f64,
            (false, _, false) => bits as f64,
        }
    }
}
