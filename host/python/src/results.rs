//! What `compare`, `diagnose`, `add` and `respond` answer: JSON as on the command line, pictures,
//! and the report's page.

use crate::errors::raised;
use crate::follow::followed;
use crate::model::Model;
use jointwatch::assess::compared::Compared;
use jointwatch::diagnose::add;
use jointwatch::diagnose::apply::to_add;
use jointwatch::report::page::{self, Asked};
use jointwatch::report::{Drawing, pictures, steps};
use jointwatch::simulate::respond;
use jointwatch::text::output;
use numpy::PyArray1;
use pyo3::prelude::*;
use std::sync::Arc;

/// Names and SVG documents.
type Pictures = Vec<(String, String)>;

fn named(drawings: Vec<Drawing>) -> Pictures {
    drawings.into_iter().map(|d| (d.file, d.svg)).collect()
}

/// A model held against the records of a study.
#[pyclass(frozen, module = "jointwatch._native")]
pub(crate) struct Comparison {
    pub(crate) study: Arc<jointwatch::Study>,
    pub(crate) model: Arc<jointwatch::Model>,
    pub(crate) found: Compared,
}

#[pymethods]
impl Comparison {
    /// What `compare --json` says.
    fn to_json(&self, py: Python<'_>) -> PyResult<String> {
        raised(py, output::json_text(&self.found))
    }

    /// What `compare --plots` draws.
    fn pictures(&self, py: Python<'_>) -> PyResult<Pictures> {
        let draw = || pictures::of_model(&self.study, &self.model, &self.found.comparison);
        followed(py, None, |_| draw()).map(named)
    }

    /// The page of `compare --report`.
    fn page(&self, py: Python<'_>, command: String) -> PyResult<String> {
        followed(py, None, |_| {
            page::html(&Asked {
                command,
                ..Asked::of_model(&self.study, &self.model)
            })
        })
    }
}

/// What a model lacks.
#[pyclass(frozen, module = "jointwatch._native")]
pub(crate) struct Diagnosis {
    pub(crate) study: Arc<jointwatch::Study>,
    pub(crate) model: Arc<jointwatch::Model>,
    pub(crate) found: jointwatch::Diagnosis,
}

#[pymethods]
impl Diagnosis {
    /// What `diagnose --json` says.
    fn to_json(&self, py: Python<'_>) -> PyResult<String> {
        raised(py, output::json_text(&self.found))
    }

    /// What was found, as `add` takes it.
    fn effects(&self) -> Vec<String> {
        let found = self.found.found.iter();
        found.flat_map(|f| to_add(f, &self.study)).collect()
    }

    /// What `diagnose --plots` draws.
    fn pictures(&self, py: Python<'_>) -> PyResult<Pictures> {
        let steps = steps::found(&self.found);
        let draw =
            || pictures::with_staircase(&self.study, &self.model, &steps, &self.found.noise_floor);
        followed(py, None, |_| draw()).map(named)
    }

    /// The page of `diagnose --report`.
    fn page(&self, py: Python<'_>, command: String) -> PyResult<String> {
        followed(py, None, |_| {
            let asked = Asked::of_diagnosis(&self.study, &self.model, &self.found);
            page::html(&Asked { command, ..asked })
        })
    }
}

/// A model with more effects, and what they brought.
#[pyclass(frozen, module = "jointwatch._native")]
pub(crate) struct Added {
    pub(crate) study: Arc<jointwatch::Study>,
    pub(crate) before: Arc<jointwatch::Model>,
    pub(crate) effects: Vec<String>,
    pub(crate) added: add::Added,
}

#[pymethods]
impl Added {
    /// What `add --json` says, without a file of the model.
    fn to_json(&self, py: Python<'_>) -> PyResult<String> {
        raised(py, output::json_text(&self.added.as_json(None)))
    }

    /// The model with the added effects in it.
    fn model(&self) -> Model {
        Model(Arc::new(self.added.model.clone()))
    }

    /// What `add --plots` draws.
    fn pictures(&self, py: Python<'_>) -> PyResult<Pictures> {
        let (steps, floors) = steps::added(&self.added, &self.effects.join(", "));
        let draw = || pictures::with_staircase(&self.study, &self.added.model, &steps, &floors);
        followed(py, None, |_| draw()).map(named)
    }

    /// The page of `add --report`.
    fn page(&self, py: Python<'_>, command: String) -> PyResult<String> {
        followed(py, None, |_| {
            let added = (&self.added, self.effects.as_slice());
            let asked = Asked::of_added(&self.study, &self.before, added);
            page::html(&Asked { command, ..asked })
        })
    }
}

/// How the rig would move with a model in place of its joint.
#[pyclass(frozen, module = "jointwatch._native")]
pub(crate) struct Response {
    pub(crate) study: Arc<jointwatch::Study>,
    pub(crate) model: Arc<jointwatch::Model>,
    pub(crate) response: respond::Response,
}

/// The states of a record, or what they are held against.
type States<'py> = Vec<Bound<'py, PyArray1<f64>>>;

#[pymethods]
impl Response {
    /// What `respond --json` says.
    fn to_json(&self, py: Python<'_>) -> PyResult<String> {
        raised(py, output::json_text(&self.response))
    }

    /// Simulated and measured states of a record.
    fn states<'py>(&self, py: Python<'py>, record: usize) -> Option<(States<'py>, States<'py>)> {
        let record = self.response.records.get(record)?;
        let arrays = |series: &[Vec<f64>]| {
            let series = series.iter();
            series.map(|s| PyArray1::from_slice(py, s)).collect()
        };
        Some((arrays(&record.states), arrays(&record.measured)))
    }

    /// The page of `respond --report`.
    fn page(&self, py: Python<'_>, command: String) -> PyResult<String> {
        followed(py, None, |_| {
            let asked = Asked::of_response(&self.study, &self.model, &self.response);
            page::html(&Asked { command, ..asked })
        })
    }
}
