//! Postcard messages of fixed length: every number with its whole width, little-endian, one behind
//! the other, as model blobs and rig blocks hold them.
//!
//! What serde derives for messages of this size costs the device 10 KiB of program, most of it for
//! lengths and errors that fields of fixed width cannot have. Here a message says itself how its
//! numbers follow each other, and postcard reads and writes their bytes.

use crate::fault::Error;
use postcard::ser_flavors::Slice;
use serde::{Deserialize, Serializer as _};

/// Something that takes the same number of bytes whatever its value, and reads as something
/// whatever its bytes.
pub(crate) trait Field: Sized {
    /// Bytes that every value takes.
    const LEN: usize;
    /// What the next bytes say.
    fn read(from: &mut Reader<'_>) -> Self;
    /// Writes it into the next bytes.
    fn write(&self, to: &mut Writer<'_>);
}

/// A message to be read; zeros follow on its last byte.
pub(crate) struct Reader<'a>(postcard::Deserializer<'a, postcard::de_flavors::Slice<'a>>);

/// A message to be written; what finds no place is dropped.
pub(crate) struct Writer<'a>(postcard::Serializer<Slice<'a>>);

impl<'a> Reader<'a> {
    pub(crate) fn new(message: &'a [u8]) -> Self {
        Self(postcard::Deserializer::from_bytes(message))
    }

    /// Fills `into` with the next bytes; those that are missing leave it as it is.
    fn take(&mut self, into: &mut [u8]) {
        for place in into {
            if let Ok(byte) = u8::deserialize(&mut self.0) {
                *place = byte;
            }
        }
    }

    /// What was not read.
    pub(crate) fn rest(self) -> &'a [u8] {
        self.0.finalize().unwrap_or_default()
    }
}

impl<'a> Writer<'a> {
    pub(crate) fn new(places: &'a mut [u8]) -> Self {
        Self(postcard::Serializer {
            output: Slice::new(places),
        })
    }

    /// Puts bytes behind those before them.
    fn put(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            // Every place was counted at compile time.
            let _ = self.0.serialize_u8(byte);
        }
    }
}

macro_rules! numbers {
    ($($number:ty),*) => {$(
        impl Field for $number {
            const LEN: usize = size_of::<Self>();
            fn read(from: &mut Reader<'_>) -> Self {
                let mut bytes = [0; Self::LEN];
                from.take(&mut bytes);
                Self::from_le_bytes(bytes)
            }
            fn write(&self, to: &mut Writer<'_>) {
                to.put(&self.to_le_bytes());
            }
        }
    )*};
}

numbers!(u8, i8, u16, i32, u32, i64, u64, f32, f64);

impl<T: Field, const COUNT: usize> Field for [T; COUNT] {
    const LEN: usize = COUNT * T::LEN;
    fn read(from: &mut Reader<'_>) -> Self {
        core::array::from_fn(|_| T::read(from))
    }
    fn write(&self, to: &mut Writer<'_>) {
        self.iter().for_each(|item| item.write(to));
    }
}

/// A struct that is a [`Field`]: its fields in the order in which they stand.
macro_rules! laid_out {
    ($(#[$about:meta])* $visible:vis struct $name:ident {
        $($(#[$of_field:meta])* $seen:vis $field:ident: $kind:ty,)+
    }) => {
        $(#[$about])*
        $visible struct $name {
            $($(#[$of_field])* $seen $field: $kind,)+
        }

        impl $crate::wire::layout::Field for $name {
            const LEN: usize = 0 $(+ <$kind as $crate::wire::layout::Field>::LEN)+;
            fn read(from: &mut $crate::wire::layout::Reader<'_>) -> Self {
                Self { $($field: $crate::wire::layout::Field::read(from)),+ }
            }
            fn write(&self, to: &mut $crate::wire::layout::Writer<'_>) {
                $($crate::wire::layout::Field::write(&self.$field, to);)+
            }
        }
    };
}
pub(crate) use laid_out;

/// Refuses the first byte that is not zero; `offset` is where `bytes` begin.
pub(crate) fn unless_zero(offset: usize, bytes: &[u8]) -> Result<(), Error> {
    match bytes.iter().enumerate().find(|&(_, &byte)| byte != 0) {
        Some((place, &seen)) => Err(Error::BlobReserved {
            offset: offset + place,
            seen,
        }),
        None => Ok(()),
    }
}
