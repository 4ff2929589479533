//! Reader of ASAM MDF version 4 (`.mf4`): each channel of numbers is a column, with the unit that
//! the file states.

mod measurement;

use super::packed;
use crate::study::log::{Column, Request, Table};
use crate::text::error::Result;
use measurement::Measurement;

/// Whether the bytes begin like such a file.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    bytes.starts_with(b"MDF     ") || bytes.starts_with(b"UnFinMF ")
}

/// Reads the channels that the request needs; a name that several groups have gets the group's
/// number, `time[2]`.
pub(super) fn read(request: &Request<'_>, bytes: &[u8]) -> Result<Table> {
    let broken = |what: String| {
        request.error(format!(
            "is an MDF file that cannot be read ({what}); open it in the logger's software and save it as finished MDF 4, or as CSV"
        ))
    };
    let file = Measurement::open(bytes).map_err(broken)?;
    let mut columns: Vec<Column> = Vec::new();
    let mut total = 0_u64;
    for (number, group) in file.groups().map_err(broken)?.iter().enumerate() {
        let mut named = Vec::new();
        for channel in &group.channels {
            let taken = columns.iter().any(|c: &Column| c.name == channel.name);
            let name = match taken {
                true => format!("{}[{}]", channel.name, number + 1),
                false => channel.name.clone(),
            };
            if request.needs(&name) {
                total = total.saturating_add(group.cycles.saturating_mul(8));
                named.push(channel);
            }
            columns.push(Column {
                name,
                unit: channel.unit.clone(),
                values: None,
            });
        }
        if total > packed::limit() {
            return Err(request.error(packed::too_large()));
        }
        if named.is_empty() {
            continue;
        }
        let first = columns.len() - group.channels.len();
        let records = file.records(group).map_err(broken)?;
        for (channel, column) in group.channels.iter().zip(&mut columns[first..]) {
            if request.needs(&column.name) {
                column.values = Some(group.values(channel, &records));
            }
        }
    }
    Ok(Table::whole("ASAM MDF 4", columns))
}
