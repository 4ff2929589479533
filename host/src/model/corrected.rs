//! A study with its force channels put right by what a model knows of them.

use super::corrections::Corrections;
use super::file::ModelFile;
use super::per_record;
use crate::signal::motion;
use crate::study::{Record, Study};
use crate::text::error::{Result, in_order};
use rayon::prelude::*;
use std::borrow::Cow;

impl ModelFile {
    /// The study with its force channels put right, as the right instruments would have logged it;
    /// itself when they are. Its inertias stay as they are stated.
    ///
    /// # Errors
    /// As [`ModelFile::corrections`] and `ModelFile::corrected_record`.
    pub fn corrected<'a>(&self, study: &'a Study) -> Result<Cow<'a, Study>> {
        let corrections = self.corrections()?;
        if corrections.is_none() {
            return Ok(Cow::Borrowed(study));
        }
        let records = (0..study.records.len()).into_par_iter();
        let records = records.map(|index| self.corrected_record(study, index, &corrections));
        Ok(Cow::Owned(Study {
            records: in_order(records)?,
            ..study.clone()
        }))
    }

    /// One record of it, the one at `index`.
    ///
    /// # Errors
    /// A record that is too short to see such a part in.
    pub(crate) fn corrected_record(
        &self,
        study: &Study,
        index: usize,
        corrections: &Corrections,
    ) -> Result<Record> {
        let rate = study.sample_rate_hz;
        let mut record = corrections.record(&study.records[index], rate);
        if corrections.per_record.is_empty() {
            return Ok(record);
        }
        let motion = motion::motion(study, index, &record, &self.filters)?;
        let predicted = self.predict_motion(&motion)?;
        for term in &corrections.per_record {
            let axis = usize::from(term.axis);
            let of = &self.axes[axis];
            let mut left = motion.restoring_force(axis, of.inertia, of.restoring_force);
            left.iter_mut()
                .zip(&predicted[axis])
                .for_each(|(r, p)| *r -= p);
            let part = per_record::part_of(term, &left, motion.first_row, record.rows, 1.0 / rate);
            let sign = of.restoring_force.sign();
            for (f, p) in record.axes[axis].force.iter_mut().zip(part) {
                *f -= sign * p;
            }
        }
        Ok(record)
    }
}
