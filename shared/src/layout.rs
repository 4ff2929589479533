//! Fields of fixed width, little-endian, one behind the other: how the numbers of a model blob and of a rig block lie in their bytes.
//!
//! They are what postcard makes of the same fields with its fixed-width integers. A deserialiser that knows every type of
//! wire costs the device 10 KiB of program; this knows one.

/// Something that takes the same number of bytes whatever its value, and reads as something whatever its bytes.
pub(crate) trait Field: Sized {
    /// Bytes of it.
    const LEN: usize;
    /// What the next bytes say.
    fn read(from: &mut Reader<'_>) -> Self;
    /// Writes it into the next bytes.
    fn write(&self, to: &mut Writer<'_>);
}

/// Bytes to be read; zeros follow on the last.
pub(crate) struct Reader<'a>(pub(crate) &'a [u8]);

/// Places to be written; what finds none is dropped.
pub(crate) struct Writer<'a>(pub(crate) &'a mut [u8]);

impl Reader<'_> {
    /// The next bytes.
    #[inline(never)]
    fn take(&mut self, into: &mut [u8]) {
        for place in into {
            if let Some((&byte, rest)) = self.0.split_first() {
                (*place, self.0) = (byte, rest);
            }
        }
    }
}

impl Writer<'_> {
    /// Puts bytes behind those before them.
    #[inline(never)]
    fn put(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            if let Some((place, rest)) = core::mem::take(&mut self.0).split_first_mut() {
                *place = byte;
                self.0 = rest;
            }
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

numbers!(u8, i8, u16, i32, u32, i64, f32, f64);

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

        impl $crate::layout::Field for $name {
            const LEN: usize = 0 $(+ <$kind as $crate::layout::Field>::LEN)+;
            fn read(from: &mut $crate::layout::Reader<'_>) -> Self {
                Self { $($field: $crate::layout::Field::read(from)),+ }
            }
            fn write(&self, to: &mut $crate::layout::Writer<'_>) {
                $($crate::layout::Field::write(&self.$field, to);)+
            }
        }
    };
}
pub(crate) use laid_out;
