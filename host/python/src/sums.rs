//! `Plan` and the bytes of sums: what workers of an engine such as Spark need, without the study's
//! own records.

use crate::errors::raised;
use crate::model::Model;
use crate::study::{Log, Study, log_in_memory, polynomial_options};
use jointwatch::fit::identify::from_sums;
use jointwatch::fit::sums::{Part, Plan as SumsPlan};
use jointwatch::study::further::Template;
use jointwatch::{Error, Result};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde_json::json;
use std::path::PathBuf;
use std::sync::Arc;

/// How logs are read and summed, set by a study.
#[pyclass(frozen, module = "jointwatch._native")]
pub(crate) struct Plan {
    plan: SumsPlan,
    template: Template,
}

#[pymethods]
impl Plan {
    /// The plan of a study; `description` is that of a study of arrays, empty for one that was read
    /// from a file.
    #[staticmethod]
    fn of(py: Python<'_>, study: &Study, description: String) -> PyResult<Self> {
        let study = &*study.0;
        let made = py.allow_threads(|| {
            let template = match description.as_str() {
                "" => Template::of_study(study)?,
                _ => Template::of_text(&study.name, description, study.sample_rate_hz),
            };
            let plan = SumsPlan::of(study, &template)?;
            Ok(Self { plan, template })
        });
        raised(py, made)
    }

    /// The plan as a text that workers get.
    fn to_json(&self) -> String {
        json!({ "plan": self.plan, "text": self.template.text(), "rate": self.template.sample_rate_hz() }).to_string()
    }

    /// The plan in such a text.
    #[staticmethod]
    fn parse(py: Python<'_>, text: &str) -> PyResult<Self> {
        raised(py, parsed(text))
    }

    /// The columns that it reads of a log, and the one that holds the time.
    fn columns(&self, py: Python<'_>) -> PyResult<(Vec<String>, Option<String>)> {
        raised(py, self.template.columns())
    }

    /// The sums of a log file.
    fn sum_file<'py>(&self, py: Python<'py>, path: PathBuf) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = py.allow_threads(|| {
            let study = self.template.read(&path)?;
            Part::of(&self.plan, &study)?.to_bytes()
        });
        Ok(PyBytes::new(py, &raised(py, bytes)?))
    }

    /// The sums of a log in memory.
    fn sum_log<'py>(&self, py: Python<'py>, log: Log<'_>) -> PyResult<Bound<'py, PyBytes>> {
        let log = log_in_memory(log);
        let bytes = py.allow_threads(|| {
            let study = self.template.read_memory(&log)?;
            Part::of(&self.plan, &study)?.to_bytes()
        });
        Ok(PyBytes::new(py, &raised(py, bytes)?))
    }

    /// The errors of a model on a log file, as JSON.
    fn score_file(&self, py: Python<'_>, model: &Model, path: PathBuf) -> PyResult<String> {
        let scored = py.allow_threads(|| score(model, &self.template.read(&path)?));
        raised(py, scored)
    }

    /// The errors of a model on a log in memory, as JSON.
    fn score_log(&self, py: Python<'_>, model: &Model, log: Log<'_>) -> PyResult<String> {
        let log = log_in_memory(log);
        let scored = py.allow_threads(|| score(model, &self.template.read_memory(&log)?));
        raised(py, scored)
    }
}

fn parsed(text: &str) -> Result<Plan> {
    let no_plan = || Error::data("this is no plan of sums; make one from a study");
    let value: serde_json::Value = serde_json::from_str(text).map_err(|_| no_plan())?;
    let said = value["text"].as_str().ok_or_else(no_plan)?;
    let rate = value["rate"].as_f64().ok_or_else(no_plan)?;
    let plan = SumsPlan::parse("the plan", &value["plan"].to_string())?;
    Ok(Plan {
        template: Template::of_text("the plan's study", said.to_owned(), rate),
        plan,
    })
}

fn score(model: &Model, study: &jointwatch::Study) -> Result<String> {
    let compared = jointwatch::compare(study, &model.0)?;
    Ok(json!(compared.records).to_string())
}

/// Adds up the bytes of parts, each with a name for messages.
#[pyfunction]
pub(crate) fn merge_sums<'py>(
    py: Python<'py>,
    parts: Vec<(String, Bound<'py, PyBytes>)>,
) -> PyResult<Bound<'py, PyBytes>> {
    let parts = parts.into_iter();
    let parts: Vec<(String, Vec<u8>)> = parts
        .map(|(called, bytes)| (called, bytes.as_bytes().to_vec()))
        .collect();
    let merged = py.allow_threads(|| {
        let mut parts = parts.iter();
        let (called, first) = parts
            .next()
            .ok_or_else(|| Error::usage("there are no parts to merge"))?;
        let mut whole = Part::of_bytes(called, first)?;
        for (called, bytes) in parts {
            whole.merge(&Part::of_bytes(called, bytes)?, called)?;
        }
        whole.to_bytes()
    });
    Ok(PyBytes::new(py, &raised(py, merged)?))
}

/// What the bytes of a part hold, as JSON.
#[pyfunction]
pub(crate) fn describe_sums(py: Python<'_>, called: &str, bytes: &[u8]) -> PyResult<String> {
    let part = raised(py, Part::of_bytes(called, bytes))?;
    Ok(json!({
        "study": part.plan().study, "rows": part.rows(), "records": part.records(), "beyond": part.beyond(),
    })
    .to_string())
}

/// A model of sums: `"polynomial"` by a fit, or `"physical"`; a study is what its errors are
/// measured on.
#[pyfunction]
pub(crate) fn identify_sums(
    py: Python<'_>,
    called: &str,
    bytes: &[u8],
    asked: (String, Option<String>),
    study: Option<&Study>,
) -> PyResult<Model> {
    let (kind, fit) = asked;
    let study = study.map(|study| Arc::clone(&study.0));
    let learnt = py.allow_threads(|| {
        let part = Part::of_bytes(called, bytes)?;
        let study = study.as_deref();
        match kind.as_str() {
            "polynomial" => {
                from_sums::polynomial(&part, &polynomial_options(fit.as_deref())?, study)
            }
            "physical" => from_sums::physical(&part, study),
            kind => Err(Error::usage(format!(
                "{kind:?} is no model that sums give; give \"polynomial\" or \"physical\""
            ))),
        }
    });
    Ok(Model(Arc::new(raised(py, learnt)?.model)))
}
