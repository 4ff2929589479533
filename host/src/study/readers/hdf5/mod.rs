//! Reader of MATLAB files of version 7.3, which are HDF5 files, and of other HDF5 files: every
//! vector and every column of a matrix.

mod hierarchy;
mod stored;

use super::packed;
use crate::study::log::{Column, Request, Table};
use crate::text::error::Result;
use hierarchy::Hierarchy;
use stored::Dataset;

/// Columns of one matrix; wider ones are pictures or tables of something else.
const MAX_COLUMNS: u64 = 4096;

/// Whether the bytes are an HDF5 file, perhaps behind MATLAB's 512 bytes.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    Hierarchy::signature(bytes).is_some()
}

/// Reads the datasets: vectors are columns, and so are the columns of a matrix, `name[1]`,
/// `name[2]`, …; in a group, `group/name`.
pub(super) fn read(request: &Request<'_>, bytes: &[u8]) -> Result<Table> {
    let broken = |what: String| {
        request.error(format!(
            "is an HDF5 or MATLAB 7.3 file that cannot be read ({what}); it was cut off or damaged, or save it from MATLAB with -v7"
        ))
    };
    let matlab = bytes.starts_with(b"MATLAB");
    let file = Hierarchy::open(bytes).map_err(broken)?;
    let mut columns = Vec::new();
    let mut total = 0_u64;
    for dataset in file.datasets().map_err(broken)? {
        let Some((rows, parts, across)) = arrangement(&dataset, matlab) else {
            continue;
        };
        let names: Vec<String> = match parts {
            1 => vec![dataset.name.clone()],
            _ => (1..=parts)
                .map(|part| format!("{}[{part}]", dataset.name))
                .collect(),
        };
        let mut values = None;
        if names.iter().any(|name| request.needs(name)) {
            total = total.saturating_add(dataset.count().saturating_mul(8));
            if total > packed::limit() {
                return Err(request.error(packed::too_large()));
            }
            values = match file.numbers(&dataset) {
                Ok(values) => Some(values),
                // A dataset that the study does not name may be as it likes.
                Err(_) if request.wanted.is_none() => continue,
                Err(what) => return Err(broken(format!("{:?}: {what}", dataset.name))),
            };
        }
        let (rows, parts) = (rows as usize, parts as usize);
        let of_part = |part: usize, all: &Vec<f64>| -> Vec<f64> {
            match across {
                true => all.iter().skip(part).step_by(parts).copied().collect(),
                false => all[part * rows..(part + 1) * rows].to_vec(),
            }
        };
        columns.extend(names.into_iter().enumerate().map(|(part, name)| {
            let values = values.as_ref().filter(|_| request.needs(&name));
            Column {
                values: values.map(|all| of_part(part, all)),
                name,
                unit: None,
            }
        }));
    }
    Ok(Table::whole(
        if matlab { "MATLAB version 7.3" } else { "HDF5" },
        columns,
    ))
}

/// Rows, columns, and whether a row's values lie side by side; `None` for what is no vector and no
/// matrix of numbers.
fn arrangement(dataset: &Dataset, matlab: bool) -> Option<(u64, u64, bool)> {
    dataset.number.as_ref()?;
    let count = dataset.count();
    if count <= 1 {
        return None;
    }
    // MATLAB counts columns first, so that the rows of the file's matrix are MATLAB's columns.
    let (rows, parts, across) = match dataset.shape.as_slice() {
        [_] | [1, _] | [_, 1] => (count, 1, false),
        [parts, rows] if matlab => (*rows, *parts, false),
        [rows, parts] => (*rows, *parts, true),
        _ => return None,
    };
    (parts <= MAX_COLUMNS).then_some((rows, parts, across))
}
