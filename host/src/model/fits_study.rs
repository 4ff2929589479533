//! Whether a study is one of the joint that a model was learnt from.

use crate::model::effects::check_inputs;
use crate::model::file::ModelFile;
use crate::signal::motion::Motion;
use crate::study::Study;
use crate::text::error::{Error, Result};

/// A motion this many times as large as the one learnt from is in other units, or another joint's.
const MAX_LARGER: f64 = 30.0;
/// The same for a smaller one.
const MAX_SMALLER: f64 = 300.0;

impl ModelFile {
    /// Refuses a study whose axes or sample rate are not the model's.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`], one sentence.
    pub fn check_fits(&self, study: &Study) -> Result<()> {
        study.check_fits(
            "the model",
            self.axes.iter().map(|a| (a.name.as_str(), a.kind)),
            self.filters.sample_rate_hz,
        )?;
        if study.quasi_static != self.filters.quasi_static {
            let [has, lacks] = match study.quasi_static {
                true => ["the model", "the study"],
                false => ["the study", "the model"],
            };
            return Err(Error::data(format!(
                "{}: {has} has time and {lacks} has none (time = \"none\"); learn a model from this study",
                study.path.display()
            )));
        }
        check_inputs(&self.input_names()?, |name| study.has_input(name))
    }

    /// Refuses a study whose motion or sign of the force cannot be that of the joint that the model
    /// was learnt from.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`], one sentence.
    pub fn check_motion(&self, study: &Study, motions: &[Motion]) -> Result<()> {
        for (index, (mine, axis)) in self.axes.iter().zip(&study.axes).enumerate() {
            if mine.restoring_force != axis.restoring_force {
                return Err(Error::data(format!(
                    "{}: restoring_force of axis {} is not what it was in the study that the model was learnt from, so all forces \
                     would change sign: put it right, or learn from this study",
                    study.path.display(),
                    axis.name
                )));
            }
            let Some(range) = self.base.inputs().get(2 * index) else {
                continue;
            };
            let series = motions.iter().filter_map(|m| m.states.get(2 * index));
            let most = series
                .flatten()
                .fold(0.0, |most: f64, x| most.max((x - range.center).abs()));
            let times = most / range.half_range;
            if most > 0.0 && !(1.0 / MAX_SMALLER..=MAX_LARGER).contains(&times) {
                return Err(Error::data(format!(
                    "{}: axis {} moves by {most:.2e} {unit} and the model was learnt from {:.2e} {unit}: check the unit of its \
                     displacement, or learn from this study",
                    study.path.display(),
                    axis.name,
                    range.half_range,
                    unit = axis.kind.displacement_unit()
                )));
            }
        }
        Ok(())
    }
}
