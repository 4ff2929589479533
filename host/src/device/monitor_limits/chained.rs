//! Records that went through the chain.

use crate::device::replay::{Sampled, SetUp};
use crate::study::{Record, Role};
use jointwatch_shared::base::Model;

/// One record after the chain.
pub(super) struct ChainedRecord {
    pub(super) file: String,
    pub(super) validation: bool,
    pub(super) samples: Vec<Sampled>,
}

impl ChainedRecord {
    pub(super) fn new(record: &Record, set_up: &SetUp, model: &Model) -> Self {
        Self {
            file: record.file.clone(),
            validation: record.role == Role::Validate,
            samples: set_up.samples(record, model).collect(),
        }
    }
}
