//! `jointwatch export`: from a model to the blob that the device evaluates.

use super::Console;
use crate::error::{Error, Result};
use crate::export;
use crate::model_file::ModelFile;
use crate::output;
use crate::table::Table;
use clap::Args;
use std::path::PathBuf;

/// Options of `jointwatch export`.
#[derive(Args)]
pub(crate) struct Export {
    /// The model that `identify` wrote.
    pub(super) model: PathBuf,
    /// Where to write the blob.
    #[arg(short, long, value_name = "FILE", default_value = "model.bin")]
    pub(super) output: PathBuf,
    /// The largest error that fixed point may cost, as a part of each axis's RMS training force
    /// (default: 1e-5 for a polynomial, 1e-3 for a network).
    #[arg(long, value_name = "PART")]
    pub(super) budget: Option<f64>,
}

impl Export {
    pub(super) fn run(self, console: &Console) -> Result<()> {
        if let Some(budget) = self.budget.filter(|part| part.is_nan() || *part <= 0.0) {
            return Err(Error::usage(format!(
                "--budget {budget} has to be above zero"
            )));
        }
        let file = ModelFile::read(&self.model)?;
        let exported = export::export(&file, self.budget).map_err(|e| Error {
            sentence: format!("{}: {e}", self.model.display()),
            ..e
        })?;
        output::write_whole(&self.output, &exported.blob)?;
        let mut table = Table::new(&[
            "axis",
            "force unit",
            "largest error seen",
            "proven bound",
            "bound / RMS force",
        ]);
        for (axis, learnt) in exported.axes.iter().zip(&file.axes) {
            let unit = learnt.kind.force_unit();
            table.row(vec![
                axis.axis.clone(),
                format!("{:.3e} {unit}", axis.force_per_lsb),
                format!("{:.2e} {unit}", axis.largest_error),
                format!("{:.2e} {unit}", axis.error_bound),
                format!("{:.1e}", axis.bound_relative),
            ]);
        }
        console.say(format!(
            "Blob of {} bytes written to {}.\nWhat fixed point costs against f64, over the whole training range:\n{table}",
            exported.blob.len(),
            self.output.display()
        ))?;
        console.json(&serde_json::json!({ "blob": self.output, "bytes": exported.blob.len(), "axes": exported.axes }))
    }
}
