//! Damages bytes at random, as a line, a disk or a spiteful person would.

/// Numbers that readers trip over.
const NOTABLE: [u64; 9] = [
    0,
    1,
    0x7F,
    0x80,
    0xFFFF,
    0x7FFF_FFFF,
    0x8000_0000,
    1 << 40,
    u64::MAX,
];
/// Where most formats say how long things are, in bytes from either end.
const ENDS: usize = 600;

/// Steele, Lea, Flood, "Fast splittable pseudorandom number generators" (2014).
#[derive(Clone, Debug)]
pub struct Mutation(u64);

impl Mutation {
    /// The same damage for the same seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % bound.max(1) as u64) as usize
    }

    /// Somewhere in so many bytes, more often near an end.
    fn place(&mut self, length: usize) -> usize {
        let near = self.below(ENDS.min(length));
        match self.below(3) {
            0 => near,
            1 => length.saturating_sub(1 + near),
            _ => self.below(length),
        }
    }

    /// Bytes with one to six damages.
    pub fn damaged(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        for _ in 0..1 + self.below(6) {
            self.damage(&mut bytes);
        }
        bytes
    }

    fn damage(&mut self, bytes: &mut Vec<u8>) {
        if bytes.is_empty() {
            bytes.push(self.below(256) as u8);
            return;
        }
        let at = self.place(bytes.len());
        match self.below(8) {
            0 => bytes[at] ^= 1 << self.below(8),
            1 => bytes[at] = self.below(256) as u8,
            2 | 3 => {
                let number = NOTABLE[self.below(NOTABLE.len())].to_le_bytes();
                let width = 1 << self.below(4);
                for (place, byte) in bytes[at..].iter_mut().zip(&number[..width]) {
                    *place = *byte;
                }
            }
            4 => bytes.truncate(at),
            5 => {
                let end = (at + 1 + self.below(64)).min(bytes.len());
                bytes.drain(at..end);
            }
            6 => {
                let end = (at + 1 + self.below(64)).min(bytes.len());
                let copy = bytes[at..end].to_vec();
                let to = self.place(bytes.len());
                bytes.splice(to..to, copy);
            }
            // A digit becomes another one, a sign or an exponent.
            _ => bytes[at] = b"0123456789-+.eE,;\"[]{}\n\0"[self.below(24)],
        }
    }
}
