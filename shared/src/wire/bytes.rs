//! A number of bytes in a row, on the line and in flash.

use core::fmt;
use serde::de::{Error as _, SeqAccess, Visitor};
use serde::ser::SerializeTuple;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// So many bytes, without their number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bytes<const N: usize>([u8; N]);

impl<const N: usize> Bytes<N> {
    /// Takes bytes over as they are.
    pub const fn new(bytes: [u8; N]) -> Self {
        Self(bytes)
    }

    /// The bytes, in the order in which they are sent.
    pub const fn bytes(&self) -> [u8; N] {
        self.0
    }
}

// By hand, because serde knows arrays of up to 32 elements, and what it makes of those is unrolled.
impl<const N: usize> Serialize for Bytes<N> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut all = serializer.serialize_tuple(N)?;
        for byte in &self.0 {
            all.serialize_element(byte)?;
        }
        all.end()
    }
}

impl<'de, const N: usize> Deserialize<'de> for Bytes<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Row<const N: usize>;
        impl<'de, const N: usize> Visitor<'de> for Row<N> {
            type Value = Bytes<N>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("bytes in a row")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut all: A) -> Result<Bytes<N>, A::Error> {
                let mut bytes = [0; N];
                for (place, byte) in bytes.iter_mut().enumerate() {
                    let next = all.next_element()?;
                    *byte = next.ok_or_else(|| A::Error::invalid_length(place, &self))?;
                }
                Ok(Bytes(bytes))
            }
        }
        deserializer.deserialize_tuple(N, Row)
    }
}
