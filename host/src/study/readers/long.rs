//! Logs too long to be held in memory: their columns are told at once, and any stretch of rows is
//! read where it stands in the file.
//!
//! NumPy arrays and Parquet files say where a row is; a text is read once for that.

use super::text::long::Lines;
use super::{is_text_table, numpy, parquet};
use crate::study::log::{Column, Numbering, Request, Table};
use crate::text::error::Result;
use crate::text::hexadecimal::hexadecimal;
use crate::text::input;
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{BufReader, Read};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Rows of a NumPy array or of a text that are read at a time.
const BLOCK: usize = 1 << 18;
/// Bytes that are read at a time where all are.
const PIECE: usize = 1 << 20;
/// A NumPy array's header is looked for in so many bytes.
const HEADER: u64 = 1 << 20;

/// A log that is too long to be held in memory.
pub(crate) struct LongLog {
    path: PathBuf,
    kind: Kind,
    /// Per column of times the one that counts as 0.
    origins: Vec<Option<i64>>,
    sha256: OnceLock<String>,
}

enum Kind {
    Array(numpy::Array),
    Groups(parquet::Groups),
    Text(Lines),
}

/// Whether a file is larger than what is read as a whole.
pub(crate) fn is_long(path: &Path) -> bool {
    let about = std::fs::metadata(path);
    about.is_ok_and(|about| about.is_file() && about.len() > input::limit())
}

impl LongLog {
    /// The log of a request, where its file is too large to be read whole.
    ///
    /// # Errors
    /// As [`LongLog::open`].
    pub(crate) fn where_needed(request: &Request<'_>) -> Result<Option<Self>> {
        match request.memory.is_none() && is_long(request.path) {
            true => Self::open(request),
            false => Ok(None),
        }
    }

    /// A log whose rows can be read where they stand; nothing where its format does not allow that.
    ///
    /// # Errors
    /// One sentence: the file cannot be read, or is damaged.
    pub(crate) fn open(request: &Request<'_>) -> Result<Option<Self>> {
        let mut file = opened(request)?;
        let mut head = Vec::new();
        let failed = |e: std::io::Error| request.unreadable(&e);
        let read = (&mut file).take(HEADER).read_to_end(&mut head);
        read.map_err(failed)?;
        let length = file.metadata().map_err(failed)?.len();
        let kind = if numpy::recognises(&head) {
            let array = numpy::Array::described(request, "", &head)?;
            if !array.fits(length) {
                return Err(request
                    .error("holds a NumPy array that is cut off; write it again with numpy.save"));
            }
            Kind::Array(array)
        } else if parquet::recognises(&head) {
            Kind::Groups(parquet::Groups::described(request, &file)?)
        } else if is_text_table(&head) {
            Kind::Text(Lines::described(request, &mut file)?)
        } else {
            return Ok(None);
        };
        let mut log = Self {
            path: request.path.to_owned(),
            kind,
            origins: Vec::new(),
            sha256: OnceLock::new(),
        };
        if let Kind::Groups(groups) = &log.kind {
            let columns = groups.columns.iter();
            let needed = |c: &&parquet::Described| request.needs(&c.name);
            let origin = |c: &parquet::Described| match needed(&c) {
                true => groups.origin(request, &mut file, c),
                false => Ok(None),
            };
            log.origins = columns.map(origin).collect::<Result<_>>()?;
        }
        Ok(Some(log))
    }

    /// Rows of the whole log.
    pub(crate) fn rows(&self) -> usize {
        match &self.kind {
            Kind::Array(array) => array.rows,
            Kind::Groups(groups) => groups.rows,
            Kind::Text(lines) => lines.rows,
        }
    }

    /// Its format, in words.
    pub(crate) fn format(&self) -> &str {
        match &self.kind {
            Kind::Array(_) => "NumPy array",
            Kind::Groups(_) => "Parquet",
            Kind::Text(lines) => &lines.format,
        }
    }

    /// Its columns of numbers, with the units that the file states.
    pub(crate) fn columns(&self) -> Vec<(&str, Option<&str>)> {
        match &self.kind {
            Kind::Array(array) => array.columns.iter().map(|c| (c.as_str(), None)).collect(),
            Kind::Groups(groups) => {
                let columns = groups.columns.iter();
                columns
                    .map(|c| (c.name.as_str(), c.unit.as_deref()))
                    .collect()
            }
            Kind::Text(lines) => {
                let names = lines.names.iter().enumerate();
                names
                    .map(|(place, name)| (name.as_str(), lines.unit(place)))
                    .collect()
            }
        }
    }

    /// The stretches of rows that are best read one at a time.
    pub(crate) fn blocks(&self) -> Vec<Range<usize>> {
        match &self.kind {
            Kind::Groups(groups) => groups.blocks(),
            Kind::Array(_) | Kind::Text(_) => {
                let starts = (0..self.rows()).step_by(BLOCK);
                starts.map(|s| s..self.rows().min(s + BLOCK)).collect()
            }
        }
    }

    /// Columns that are best read together, because their numbers stand side by side.
    pub(crate) fn together<'a>(&self, columns: &'a [usize]) -> Vec<&'a [usize]> {
        match &self.kind {
            Kind::Array(_) | Kind::Text(_) => vec![columns],
            Kind::Groups(_) => columns.chunks(1).collect(),
        }
    }

    /// Some rows of some columns, by their places.
    ///
    /// # Errors
    /// One sentence: the file cannot be read, or is damaged.
    pub(crate) fn stretch(
        &self,
        request: &Request<'_>,
        columns: &[usize],
        rows: Range<usize>,
    ) -> Result<Vec<Vec<f64>>> {
        let mut file = opened(request)?;
        match &self.kind {
            Kind::Array(array) => array.stretch(&mut file, columns, rows).map_err(|e| {
                request.error(format!("cannot be read ({e}); it was changed meanwhile"))
            }),
            Kind::Groups(groups) => {
                let one = |place: &usize| {
                    let (column, mut origin) = (&groups.columns[*place], self.origins[*place]);
                    groups.stretch(request, &mut file, column, rows.clone(), &mut origin)
                };
                columns.iter().map(one).collect()
            }
            Kind::Text(lines) => lines.stretch(request, &mut file, columns, rows),
        }
    }

    /// The request's rows of the columns that it needs.
    ///
    /// # Errors
    /// One sentence: rows beyond the end, more of them than may be held at once, or a damaged file.
    pub(crate) fn table(&self, request: &Request<'_>) -> Result<Table> {
        let rows = request.range(self.rows())?;
        let known = self.columns();
        let needed: Vec<usize> = (0..known.len())
            .filter(|place| request.needs(known[*place].0))
            .collect();
        let bytes = 8_u64.saturating_mul(rows.len() as u64 * needed.len() as u64);
        if bytes > input::limit() {
            return Err(request.error(format!(
                "has {bytes} bytes in these rows, and {} are read at once; {SHORTER}",
                input::limit()
            )));
        }
        let mut values = self.stretch(request, &needed, rows.clone())?.into_iter();
        let columns = known
            .iter()
            .enumerate()
            .map(|(place, (name, unit))| Column {
                name: (*name).to_owned(),
                unit: unit.map(str::to_owned),
                values: needed
                    .contains(&place)
                    .then(|| values.next().unwrap_or_default()),
            });
        let columns = columns.collect();
        Ok(Table {
            numbering: Numbering::From(rows.start + 1),
            cut: true,
            ..Table::whole(self.format(), columns)
        })
    }

    /// SHA-256 of the file, in hexadecimal; it is read once.
    ///
    /// # Errors
    /// One sentence when it cannot be read.
    pub(crate) fn sha256(&self, request: &Request<'_>) -> Result<String> {
        if let Some(known) = self.sha256.get() {
            return Ok(known.clone());
        }
        let mut digest = Sha256::new();
        let mut bytes = BufReader::with_capacity(PIECE, opened(request)?);
        std::io::copy(&mut bytes, &mut digest).map_err(|e| request.unreadable(&e))?;
        let sha256 = hexadecimal(&digest.finalize());
        Ok(self.sha256.get_or_init(|| sha256).clone())
    }

    /// Whether it is the log at a path.
    pub(crate) fn is_at(&self, path: &Path) -> bool {
        self.path == path
    }
}

/// What to do with a log of which too much was asked for.
const SHORTER: &str = "give shorter rows = […], or choose segments with `jointwatch select`";

/// The sentence's end for a log that is too large to be read whole.
pub(crate) fn too_long(request: &Request<'_>) -> String {
    let what = format!(
        "is larger than the {} bytes that are read as a whole",
        input::limit()
    );
    match LongLog::open(request) {
        Ok(Some(_)) => format!("{what}; {SHORTER}"),
        _ => format!(
            "{what}; save it as CSV, as Parquet or as a NumPy array, of which parts can be read, or set {} to a larger number",
            input::VARIABLE
        ),
    }
}

fn opened(request: &Request<'_>) -> Result<File> {
    File::open(request.path).map_err(|e| request.unopened(&e))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::readers;

    fn request<'a>(file: &'a str, path: &'a Path) -> Request<'a> {
        Request {
            file,
            path,
            wanted: None,
            rows: None,
            columns: None,
            memory: None,
            sparse: true,
        }
    }

    /// Every stretch of a file is what the same rows of the whole are.
    fn check(path: &Path) {
        let file = path.display().to_string();
        let request = request(&file, path);
        let whole = readers::read(&request, &std::fs::read(path).unwrap()).unwrap();
        let long = LongLog::open(&request).unwrap().unwrap();
        let names: Vec<&str> = whole.columns.iter().map(|c| c.name.as_str()).collect();
        let known = long.columns();
        assert_eq!(known.iter().map(|c| c.0).collect::<Vec<_>>(), names);
        let rows = long.rows();
        let places: Vec<usize> = (0..names.len()).rev().collect();
        for stretch in [0..rows, 0..1, rows - 1..rows, rows / 3..rows / 2] {
            let read = long.stretch(&request, &places, stretch.clone()).unwrap();
            for (values, place) in read.iter().zip(&places) {
                let wanted = whole.columns[*place].values.as_deref().unwrap();
                let same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits();
                assert!(
                    values.len() == stretch.len()
                        && values.iter().zip(&wanted[stretch.clone()]).all(same),
                    "{file}, column {place}, rows {stretch:?}"
                );
            }
        }
        let blocks = long.blocks();
        assert!(blocks.windows(2).all(|pair| pair[0].end == pair[1].start));
        assert_eq!(blocks.last().unwrap().end, rows);
    }

    fn logs() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/logs")
    }

    #[test]
    fn a_stretch_of_a_file_is_what_the_same_rows_of_the_whole_are() {
        let names = [
            "structured.npy",
            "matrix.npy",
            "record.parquet",
            "packed.parquet",
            "types.parquet",
            "record.csv",
        ];
        names.iter().for_each(|name| check(&logs().join(name)));
        let folder = tempfile::tempdir().unwrap();
        for (order, kind) in [("True", "<f8"), ("False", ">i2"), ("True", "<f4")] {
            let head =
                format!("{{'descr': '{kind}', 'fortran_order': {order}, 'shape': (600, 3), }}\n");
            let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
            bytes.extend((head.len() as u16).to_le_bytes());
            bytes.extend(head.as_bytes());
            bytes.extend((0..600 * 3 * 8_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 11) as u8));
            let path = folder.path().join("made.npy");
            std::fs::write(&path, bytes).unwrap();
            check(&path);
        }
        check_texts(folder.path());
    }

    /// The same of texts of more rows than stand between two places that are known.
    fn check_texts(folder: &Path) {
        let row = |i: usize| format!("{};{};{}", i / 7, i % 13, (i * 31) % 101);
        let stamp = |i: usize| {
            format!(
                "{:02}:{:02}:{:02},{:03}",
                i / 9_000 % 24,
                i / 150 % 60,
                i / 5 % 30,
                i % 5 * 200
            )
        };
        for (name, end, with) in [
            ("plain", "\n", None),
            ("dos", "\r\n", Some("# a comment\r\n\r\n")),
            ("macintosh", "\r", Some("\r\r% a comment\r")),
            ("times", "\n", None),
        ] {
            let mut text = format!("Pr\u{fc}fstand{end}Zeit;Weg;Kraft{end}s;mm;N{end}");
            for i in 0..10_000 {
                let line = match name {
                    "times" => format!("{};{};1,5", stamp(i), i % 17),
                    _ => row(i),
                };
                text += &format!("{line}{end}");
                text += with.filter(|_| i % 977 == 5).unwrap_or_default();
            }
            // The last row has no end; one text is UTF-8 with a mark, the others are Latin-1.
            let bytes = match name {
                "plain" => format!("\u{feff}{}", text.trim_end()).into_bytes(),
                _ => text.trim_end().chars().map(|c| c as u8).collect(),
            };
            let path = folder.join(name);
            std::fs::write(&path, bytes).unwrap();
            check(&path);
        }
    }

    #[test]
    fn what_is_cut_off_or_of_another_format_is_told() {
        let folder = tempfile::tempdir().unwrap();
        for (name, wanted) in [("matrix.npy", "cut off"), ("record.parquet", "cut off")] {
            let whole = std::fs::read(logs().join(name)).unwrap();
            let path = folder.path().join(name);
            std::fs::write(&path, &whole[..whole.len() - 9]).unwrap();
            let error = LongLog::open(&request(name, &path)).err().unwrap();
            assert!(error.sentence.contains(wanted), "{}", error.sentence);
        }
        let path = logs().join("record.csv.gz");
        assert!(
            LongLog::open(&request("record.csv.gz", &path))
                .unwrap()
                .is_none()
        );
    }
}
