//! Records of a healthy joint whose gain or stiffness has drifted.

use super::chained::ChainedRecord;
use crate::device::replay::SetUp;
use crate::study::{Record, Study};
use crate::text::error::Result;
use jointwatch_shared::base::Model;

/// What drifts: all forces, or all displacements, which are a joint that is softer or stiffer
/// throughout.
const QUANTITIES: [&str; 2] = ["force", "displacement"];

/// Goes through every record with its forces, and with its displacements, larger and smaller by
/// this part; through none where it is 0.
///
/// One at a time: a long study would not fit the memory five times.
///
/// # Errors
/// The first that `look` returns.
pub(super) fn each(
    study: &Study,
    set_up: &SetUp,
    model: &Model,
    part: f64,
    mut look: impl FnMut(&ChainedRecord) -> Result<()>,
) -> Result<()> {
    if part == 0.0 {
        return Ok(());
    }
    for record in &study.records {
        for quantity in QUANTITIES {
            for sign in [1.0, -1.0] {
                let record = drifted(record, quantity, sign * part);
                let mut chained = ChainedRecord::new(&record, set_up, model);
                // What is usual, and how a healthy joint's figures go with its motion, is as it was
                // logged.
                chained.validation = false;
                look(&chained)?;
            }
        }
    }
    Ok(())
}

fn drifted(record: &Record, quantity: &str, part: f64) -> Record {
    let mut record = record.clone();
    let percent = 100.0 * part;
    record.file = format!("{}, {quantity} drifted by {percent:+} %", record.file);
    let gain = |values: &mut Vec<f64>| values.iter_mut().for_each(|v| *v *= 1.0 + part);
    for axis in &mut record.axes {
        if quantity == "force" {
            gain(&mut axis.force);
        } else {
            gain(&mut axis.displacement_first);
            axis.displacement_second.iter_mut().for_each(gain);
        }
    }
    record
}
