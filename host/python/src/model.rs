//! `Model`: what was learnt; it predicts, is compared, diagnosed, widened and exported.

use crate::errors::raised;
use crate::follow::followed;
use crate::results::{Added, Comparison, Diagnosis, Response};
use crate::study::Study;
use jointwatch::assess::compared::compared;
use jointwatch::diagnose::{SearchOptions, diagnose_with};
use jointwatch::report::histories;
use jointwatch::signal::motion;
use jointwatch::simulate::respond::{self, Options};
use jointwatch::text::output;
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;

/// A learnt model of the joint's restoring force.
#[pyclass(frozen, module = "jointwatch._native")]
pub(crate) struct Model(pub(crate) Arc<jointwatch::Model>);

/// A force that numpy owns.
type Force<'py> = Bound<'py, PyArray1<f64>>;

/// A record as a model sees it: file, and per axis its name, time, displacement, velocity, measured
/// and predicted force.
type Seen<'py> = (String, Vec<(String, [Force<'py>; 5])>);

#[pymethods]
impl Model {
    /// Reads and checks a model file.
    #[staticmethod]
    fn open(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let read = py.allow_threads(|| jointwatch::Model::read(&path));
        Ok(Self(Arc::new(raised(py, read)?)))
    }

    /// The model that a text in the form of model.json holds.
    #[staticmethod]
    fn parse(py: Python<'_>, called: &str, text: &str) -> PyResult<Self> {
        let model = raised(py, jointwatch::Model::parse(called, text))?;
        Ok(Self(Arc::new(model)))
    }

    /// Writes it in one step.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        raised(py, py.allow_threads(|| self.0.write(&path)))
    }

    /// The text of model.json.
    fn to_json(&self, py: Python<'_>) -> PyResult<String> {
        raised(py, output::json_text(&*self.0))
    }

    /// The force of every axis along rows of states, each contiguous, and of inputs with their
    /// names.
    fn predict<'py>(
        &self,
        py: Python<'py>,
        states: Vec<PyReadonlyArray1<'py, f64>>,
        inputs: Vec<(String, PyReadonlyArray1<'py, f64>)>,
    ) -> PyResult<Vec<Force<'py>>> {
        let states: Vec<&[f64]> = states
            .iter()
            .map(|s| s.as_slice())
            .collect::<Result<_, _>>()?;
        let inputs: Vec<(String, Vec<f64>)> = inputs
            .into_iter()
            .map(|(name, values)| (name, values.as_array().to_vec()))
            .collect();
        let forces = py.allow_threads(|| self.0.predict_with(&states, &inputs));
        let forces = raised(py, forces)?.into_iter();
        Ok(forces.map(|force| PyArray1::from_vec(py, force)).collect())
    }

    /// Measured and predicted force along the records of a study, low-passed alike.
    fn predict_study<'py>(&self, py: Python<'py>, study: &Study) -> PyResult<Vec<Seen<'py>>> {
        let model = &*self.0;
        let seen = followed(py, None, |_| {
            model.check_fits(&study.0)?;
            let corrected = model.corrected(&study.0)?;
            let motions = motion::motions(&corrected, &model.filters)?;
            let one = |motion| histories(model, motion);
            motions
                .iter()
                .map(one)
                .collect::<jointwatch::Result<Vec<_>>>()
        })?;
        let records = study.0.records.iter().zip(seen);
        Ok(records
            .map(|(record, axes)| {
                let axes = axes.into_iter().map(|h| {
                    let series = [h.at, h.displacement, h.velocity, h.measured, h.predicted];
                    (h.axis, series.map(|s| PyArray1::from_vec(py, s)))
                });
                (record.file.clone(), axes.collect())
            })
            .collect())
    }

    /// Holds it against every record of a study.
    fn compare(
        &self,
        py: Python<'_>,
        study: &Study,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Comparison> {
        let found = followed(py, progress, |watch| {
            watch.say("comparing", None);
            compared(&study.0, &self.0)
        })?;
        Ok(Comparison {
            study: Arc::clone(&study.0),
            model: Arc::clone(&self.0),
            found,
        })
    }

    /// Says what it lacks.
    fn diagnose(
        &self,
        py: Python<'_>,
        study: &Study,
        asked: (Vec<String>, bool),
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Diagnosis> {
        let found = followed(py, progress, |watch| {
            watch.say("searching for missing effects", None);
            diagnose_with(
                &study.0,
                &self.0,
                &SearchOptions::checked(asked.0, asked.1)?,
            )
        })?;
        Ok(Diagnosis {
            study: Arc::clone(&study.0),
            model: Arc::clone(&self.0),
            found,
        })
    }

    /// Adds effects and finds all values anew.
    fn add(
        &self,
        py: Python<'_>,
        study: &Study,
        effects: Vec<String>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Added> {
        let added = followed(py, progress, |watch| {
            watch.say("finding all values anew", None);
            jointwatch::add(&study.0, &self.0, &effects)
        })?;
        Ok(Added {
            study: Arc::clone(&study.0),
            before: Arc::clone(&self.0),
            effects,
            added,
        })
    }

    /// Simulates the records of a study with the model in place of the joint.
    fn respond(
        &self,
        py: Python<'_>,
        study: &Study,
        options: (Option<String>, Option<f64>, bool),
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Response> {
        let (record, restart_s, measured) = options;
        let response = followed(py, progress, |watch| {
            watch.say("simulating the response", None);
            let options = Options {
                record,
                restart_s,
                measured,
            };
            respond::respond(&*self.0.corrected(&study.0)?, &self.0, &options)
        })?;
        Ok(Response {
            study: Arc::clone(&study.0),
            model: Arc::clone(&self.0),
            response,
        })
    }

    /// Writes the blob that a device evaluates; what `export --json` says.
    fn export(&self, py: Python<'_>, path: PathBuf, budget: Option<f64>) -> PyResult<String> {
        let written = py.allow_threads(|| {
            let exported = jointwatch::export(&self.0, budget)?;
            output::write_whole(&path, &exported.blob)?;
            output::json_text(&exported.as_json(Some(&path)))
        });
        raised(py, written)
    }
}
