//! What a model on the device follows beside the motion, and what a converter reads of it.

use crate::model::effects::check_inputs;
use crate::study::{Record, Study};
use crate::text::error::Result;
use jointwatch_shared::base::Model;
use jointwatch_shared::wire::rig::RigAxis;

/// What the force of each axis follows, by name.
#[derive(Clone, Debug, Default)]
pub(super) struct Followed([Option<String>; 2]);

impl Followed {
    pub(super) fn of(model: &Model) -> Self {
        let mut names = [None, None];
        for (place, name) in names.iter_mut().zip(followed(model)) {
            *place = name.map(String::from);
        }
        Self(names)
    }

    /// The input of an axis.
    pub(super) fn name(&self, axis: usize) -> Option<&str> {
        self.0.get(axis)?.as_deref()
    }

    /// Refuses a study that has not what a model follows.
    pub(super) fn check(&self, study: &Study) -> Result<()> {
        let names = self.0.iter().flatten().map(String::as_str);
        check_inputs(names, |name| study.has_input(name))
    }

    /// What a converter reads of an axis's input at a row; 0 without one.
    pub(super) fn count(&self, axis: usize, record: &Record, rig: &RigAxis, row: usize) -> i32 {
        let series = self.name(axis).and_then(|name| record.input(name));
        let series = series.filter(|_| rig.input_step > 0.0);
        // `as` saturates, as a converter does.
        series.map_or(0, |s| {
            ((s[row] - rig.input_zero) / rig.input_step).round() as i32
        })
    }
}

/// The name of what the force of each axis follows.
fn followed(model: &Model) -> impl Iterator<Item = Option<&str>> {
    let axes = model.header().axes.iter();
    axes.map(|axis| Some(axis.input.as_ref()?.name.as_str()))
}

/// The inputs that a study has to have for a model on the device.
pub fn names(model: &Model) -> Vec<&str> {
    followed(model).flatten().collect()
}
