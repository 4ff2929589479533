//! Numbers modulo the order of the group, L = 2²⁵² + 27742317777372353535851937790883648493: what a point is multiplied by.

/// A number below L, its lowest word first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scalar([u32; 8]);

/// L.
const ORDER: [u32; 8] = [
    0x5CF5_D3ED,
    0x5812_631A,
    0xA2F7_9CD6,
    0x14DE_F9DE,
    0,
    0,
    0,
    0x1000_0000,
];

/// What is left when L is taken off; `None` when it is not in it.
fn less_order(words: &[u32; 8]) -> Option<[u32; 8]> {
    let (mut rest, mut borrow) = (*words, 0);
    for (word, order) in rest.iter_mut().zip(ORDER) {
        borrow += i64::from(*word) - i64::from(order);
        *word = borrow as u32;
        borrow >>= 32;
    }
    (borrow == 0).then_some(rest)
}

impl Scalar {
    /// From bytes, the lowest first; `None` for a number that is not below L, which would be a second form of another.
    pub(super) fn below_order(bytes: &[u8; 32]) -> Option<Self> {
        let mut words = [0; 8];
        for (word, bytes) in words.iter_mut().zip(bytes.as_chunks().0) {
            *word = u32::from_le_bytes(*bytes);
        }
        match less_order(&words) {
            Some(_) => None,
            None => Some(Self(words)),
        }
    }

    /// What a number of 512 bits, its lowest byte first, leaves modulo L: bit by bit, from the highest on.
    #[inline(never)]
    pub(super) fn reduced(bytes: &[u8; 64]) -> Self {
        let mut words = [0; 8];
        for byte in bytes.iter().rev() {
            for bit in (0..8).rev() {
                let mut next = u32::from(byte >> bit & 1);
                for word in &mut words {
                    (*word, next) = (*word << 1 | next, *word >> 31);
                }
                words = less_order(&words).unwrap_or(words);
            }
        }
        Self(words)
    }

    /// Its 256 bits, from the highest on.
    pub(super) fn bits(&self) -> impl Iterator<Item = bool> {
        let words = self.0.into_iter().rev();
        words.flat_map(|word| (0..32).rev().map(move |bit| word >> bit & 1 == 1))
    }
}

#[cfg(test)]
mod tests {
    use super::{ORDER, Scalar};

    fn bytes(words: [u32; 8]) -> [u8; 32] {
        let mut bytes = [0; 32];
        for (place, word) in bytes.as_chunks_mut().0.iter_mut().zip(words) {
            *place = word.to_le_bytes();
        }
        bytes
    }

    #[test]
    fn the_order_is_refused_and_one_less_is_not() {
        let [low, rest @ ..] = ORDER;
        let near = |low| {
            let [a, b, c, d, e, f, g] = rest;
            bytes([low, a, b, c, d, e, f, g])
        };
        assert!(Scalar::below_order(&near(low)).is_none());
        assert!(Scalar::below_order(&near(low + 1)).is_none());
        assert!(Scalar::below_order(&[0xFF; 32]).is_none());
        let most = Scalar::below_order(&near(low - 1)).unwrap();
        assert_eq!(most.0[0], low - 1);
    }

    #[test]
    fn a_long_number_leaves_its_rest() {
        let mut long = [0; 64];
        long[..32].copy_from_slice(&bytes(ORDER));
        assert_eq!(Scalar::reduced(&long).0, [0; 8]);
        long[0] += 5;
        assert_eq!(Scalar::reduced(&long).0, [5, 0, 0, 0, 0, 0, 0, 0]);
        // 2⁵¹² − 1 modulo L, computed with integers of any length.
        let rest = [
            0x449C_0F00,
            0xA406_11E3,
            0x68859347,
            0xD00E_1BA7,
            0x17F5_BE65,
            0xCEEC_73D2,
            0x7C30_9A3D,
            0x0399_411B,
        ];
        assert_eq!(Scalar::reduced(&[0xFF; 64]).0, rest);
    }
}
