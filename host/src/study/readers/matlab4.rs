//! Reader of MATLAB files of version 4 (`save -v4`), which older programs still write: matrices one
//! behind the other, each below a header of 20 bytes and its name.
//!
//! Source: The MathWorks, MAT-File Format, chapter “Level 4 MAT-File Format”.

use super::matlab::{Matrix, table_of};
use crate::study::log::{Request, Table};
use crate::text::error::Result;

/// Bytes of the numbers in a header, and of one of them.
const HEADER: usize = 20;
const WORD: usize = 4;

/// Whether the bytes begin like such a file.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    Header::of(bytes).is_some()
}

/// Reads the wanted columns.
pub(super) fn read(request: &Request<'_>, bytes: &[u8]) -> Result<Table> {
    let (mut matrices, mut rest) = (Vec::new(), bytes);
    while !rest.is_empty() {
        let (matrix, after) = matrix(rest).ok_or_else(|| {
            request.error(format!(
                "is a MATLAB file of version 4 that cannot be read from byte {} on; it was cut off or damaged, save it again with -v7",
                bytes.len() - rest.len()
            ))
        })?;
        matrices.extend(matrix);
        rest = after;
    }
    table_of(request, "MATLAB version 4", &matrices)
}

/// What stands above the numbers of a matrix.
struct Header<'a> {
    is_big: bool,
    /// The digit that says how a number is stored.
    precision: u32,
    /// Whether it holds numbers, and neither text nor the places of a few.
    is_full: bool,
    size: [usize; 2],
    is_complex: bool,
    name: &'a str,
    length: usize,
}

impl<'a> Header<'a> {
    fn of(bytes: &'a [u8]) -> Option<Self> {
        let first: [u8; WORD] = *bytes.first_chunk()?;
        // The first word in decimal digits: byte order, 0, precision, kind.
        let is_type = |word: u32, order: u32| {
            word / 10 / 10 == 10 * order && word / 10 % 10 < 6 && word % 10 < 3
        };
        let is_big = is_type(u32::from_be_bytes(first), 1);
        if !is_big && !is_type(u32::from_le_bytes(first), 0) {
            return None;
        }
        let mut words = bytes.get(..HEADER)?.chunks_exact(WORD).map(|word| {
            let word = word.try_into().unwrap_or_default();
            if is_big {
                u32::from_be_bytes(word)
            } else {
                u32::from_le_bytes(word)
            }
        });
        let kind = words.next()?;
        let [rows, columns, complex, name] = [(); 4].map(|()| words.next().unwrap_or(0) as usize);
        let length = HEADER.checked_add(name)?;
        let (end, name) = bytes.get(HEADER..length)?.split_last()?;
        let is_letter = |b: &u8| b.is_ascii_alphanumeric() || *b == b'_';
        let is_name =
            *end == 0 && name.first()?.is_ascii_alphabetic() && name.iter().all(is_letter);
        (is_name && complex < 2).then_some(Self {
            is_big,
            precision: kind / 10 % 10,
            is_full: kind % 10 == 0,
            size: [rows, columns],
            is_complex: complex == 1,
            name: std::str::from_utf8(name).ok()?,
            length,
        })
    }

    /// Numbers that were stored one behind the other.
    fn numbers(&self, bytes: &[u8]) -> Vec<f64> {
        macro_rules! stored {
            ($number:ty) => {{
                let each = bytes.chunks_exact(size_of::<$number>());
                let value = |bytes: &[u8]| {
                    let bytes = bytes.try_into().unwrap_or_default();
                    if self.is_big {
                        <$number>::from_be_bytes(bytes)
                    } else {
                        <$number>::from_le_bytes(bytes)
                    }
                };
                each.map(|bytes| f64::from(value(bytes))).collect()
            }};
        }
        match self.precision {
            0 => stored!(f64),
            1 => stored!(f32),
            2 => stored!(i32),
            3 => stored!(i16),
            4 => stored!(u16),
            _ => stored!(u8),
        }
    }
}

/// The matrix that bytes begin with, where it holds numbers, and the bytes behind it.
fn matrix(bytes: &[u8]) -> Option<(Option<Matrix>, &[u8])> {
    let header = Header::of(bytes)?;
    let width = [8, 4, 4, 2, 2, 1][header.precision as usize];
    let parts = 1 + usize::from(header.is_complex);
    let count = header.size[0].checked_mul(header.size[1])?;
    let end = count
        .checked_mul(width * parts)?
        .checked_add(header.length)?;
    let stored = bytes.get(header.length..end)?;
    let matrix = header.is_full.then(|| Matrix {
        name: header.name.to_owned(),
        size: header.size.to_vec(),
        values: (!header.is_complex).then(|| header.numbers(stored)),
    });
    Some((matrix, &bytes[end..]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// A matrix as MATLAB stores it, in either order of bytes.
    fn stored(
        is_big: bool,
        [precision, kind]: [u32; 2],
        name: &str,
        size: [u32; 2],
        numbers: &[u8],
    ) -> Vec<u8> {
        let first = if is_big { 1000 } else { 0 } + 10 * precision + kind;
        let words = [first, size[0], size[1], 0, name.len() as u32 + 1];
        let words = words.map(|w| {
            if is_big {
                w.to_be_bytes()
            } else {
                w.to_le_bytes()
            }
        });
        [words.as_flattened(), name.as_bytes(), &[0], numbers].concat()
    }

    fn table(bytes: &[u8]) -> Result<Table> {
        let request = Request {
            file: "old.mat",
            path: Path::new("old.mat"),
            wanted: None,
            rows: None,
            columns: None,
            memory: None,
            sparse: false,
        };
        read(&request, bytes)
    }

    #[test]
    fn vectors_matrices_and_scalars_come_back_in_either_order_of_bytes() {
        for is_big in [false, true] {
            let ordered = |x: f64| {
                if is_big {
                    x.to_be_bytes()
                } else {
                    x.to_le_bytes()
                }
            };
            let short = |x: i16| {
                if is_big {
                    x.to_be_bytes()
                } else {
                    x.to_le_bytes()
                }
            };
            let force = [1.5, -2.0, 1e6].map(ordered);
            let raw = [1, -2, 3, 4, 5, 600].map(short);
            let bytes = [
                stored(is_big, [0, 0], "fs", [1, 1], &ordered(500.0)),
                stored(is_big, [5, 1], "day", [1, 2], b"Mo"),
                stored(is_big, [0, 0], "force", [3, 1], force.as_flattened()),
                stored(is_big, [3, 0], "raw", [3, 2], raw.as_flattened()),
            ]
            .concat();
            assert!(recognises(&bytes));
            let table = table(&bytes).unwrap();
            let columns: Vec<_> = table
                .columns
                .iter()
                .map(|c| (c.name.as_str(), c.values.clone().unwrap()))
                .collect();
            assert_eq!(
                columns,
                [
                    ("force", vec![1.5, -2.0, 1e6]),
                    ("raw[1]", vec![1.0, -2.0, 3.0]),
                    ("raw[2]", vec![4.0, 5.0, 600.0])
                ]
            );
            assert_eq!(table.rate, Some(("fs".to_owned(), 500.0)));
            let cut = self::table(&bytes[..bytes.len() - 1])
                .map(|_| ())
                .unwrap_err()
                .sentence;
            assert!(
                cut.contains("cut off") && cut.contains("from byte"),
                "{cut}"
            );
        }
    }

    #[test]
    fn text_and_zeros_are_no_such_file() {
        for bytes in [&b"t,x,F\n0.1,2,3\n0.2,3,4\n"[..], &[0; 64], b""] {
            assert!(!recognises(bytes));
        }
    }
}
