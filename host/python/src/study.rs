//! `Study`: read from a folder or made of arrays; models are learnt from it.

use crate::errors::raised;
use crate::follow::followed;
use crate::model::Model;
use jointwatch::fit::identify;
use jointwatch::fit::network::{NetworkOptions, Neurons, TrainingObserver};
use jointwatch::fit::polynomial::{Method, PolynomialOptions};
use jointwatch::study::mistakes;
use jointwatch::text::work::Watch;
use jointwatch::{Error, MemoryLog, Model as ModelFile};
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use serde_json::json;
use std::path::PathBuf;
use std::sync::Arc;

/// A study, read and checked.
#[pyclass(frozen, module = "jointwatch._native")]
pub(crate) struct Study(pub(crate) Arc<jointwatch::Study>);

/// A log: its name, and its columns with their names.
pub(crate) type Log<'py> = (String, Vec<(String, PyReadonlyArray1<'py, f64>)>);

/// What a model is learnt with.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Options {
    kind: String,
    terms: Option<Vec<String>>,
    fit: Option<String>,
    neurons: Option<usize>,
    auto: bool,
    restarts: Option<usize>,
    seed: Option<u64>,
    input: Option<String>,
}

#[pymethods]
impl Study {
    /// Reads a study.toml, or the one in a folder, with its logs.
    #[staticmethod]
    fn open(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let read = py.allow_threads(|| jointwatch::Study::read(&path));
        Ok(Self(Arc::new(raised(py, read)?)))
    }

    /// The study that a description in the form of study.toml makes of arrays.
    #[staticmethod]
    fn of_memory(
        py: Python<'_>,
        called: &str,
        description: &str,
        logs: Vec<Log<'_>>,
    ) -> PyResult<Self> {
        let taken: Vec<MemoryLog> = logs.into_iter().map(log_in_memory).collect();
        let made = py.allow_threads(|| jointwatch::Study::of_memory(called, description, &taken));
        Ok(Self(Arc::new(raised(py, made)?)))
    }

    /// What it holds, as JSON.
    fn to_json(&self) -> String {
        let study = &*self.0;
        let axes = study.axes.iter().map(|axis| {
            json!({
                "name": axis.name, "kind": axis.kind, "inertia": axis.inertia, "inertia_unit": axis.kind.inertia_unit(),
                "force_unit": axis.kind.force_unit(), "displacement_unit": axis.kind.displacement_unit(),
                "restoring_force": axis.restoring_force,
            })
        });
        let records = study.records.iter().map(|record| {
            json!({
                "file": record.file, "role": record.role, "rows": record.rows,
                "seconds": record.rows as f64 / study.sample_rate_hz,
            })
        });
        let inputs = study.inputs.iter();
        json!({
            "name": study.name,
            "path": study.path,
            "sample_rate_hz": study.sample_rate_hz,
            "band_hz": study.band_hz,
            "axes": axes.collect::<Vec<_>>(),
            "inputs": inputs.map(|i| json!({ "name": i.name, "unit": i.unit })).collect::<Vec<_>>(),
            "records": records.collect::<Vec<_>>(),
            "base_terms": study.base_terms,
            "notes": study.notes,
            "checks": mistakes::check(study),
        })
        .to_string()
    }

    /// Learns a model of the kind that `options` names: `physical`, `polynomial` or `network`.
    fn identify(
        &self,
        py: Python<'_>,
        options: Options,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Model> {
        let study = &*self.0;
        let learnt = followed(py, progress, |watch| match options.kind.as_str() {
            "polynomial" => polynomial(study, &options, watch),
            "network" => network(study, &options, watch),
            "physical" => physical(study, options.terms.clone(), watch),
            kind => Err(Error::usage(format!(
                "{kind:?} is no kind of model; give \"physical\", \"polynomial\" or \"network\""
            ))),
        })?;
        Ok(Model(Arc::new(learnt)))
    }
}

/// A log as the library takes it.
pub(crate) fn log_in_memory((name, columns): Log<'_>) -> MemoryLog {
    let columns = columns.into_iter();
    let columns = columns.map(|(name, values)| (name, values.as_array().to_vec()));
    MemoryLog {
        name,
        columns: columns.collect(),
    }
}

fn physical(
    study: &jointwatch::Study,
    terms: Option<Vec<String>>,
    watch: &Watch,
) -> jointwatch::Result<ModelFile> {
    watch.say("fitting the effects", None);
    let learnt = match terms {
        None => identify::physical(study),
        Some(base_terms) => identify::physical(&jointwatch::Study {
            base_terms,
            ..study.clone()
        }),
    };
    Ok(learnt?.model)
}

fn polynomial(
    study: &jointwatch::Study,
    options: &Options,
    watch: &Watch,
) -> jointwatch::Result<ModelFile> {
    let options = PolynomialOptions {
        input: options.input.clone(),
        ..polynomial_options(options.fit.as_deref())?
    };
    let learnt = identify::polynomial(study, &options, &|done| {
        watch.say("fitting the polynomial", Some(done));
    });
    Ok(learnt?.model)
}

/// The options that a name of a fit stands for.
pub(crate) fn polynomial_options(fit: Option<&str>) -> jointwatch::Result<PolynomialOptions> {
    let method = match fit {
        None | Some("ridge") => Method::Ridge,
        Some("least-squares") => Method::LeastSquares,
        Some("select") => Method::Select,
        Some(fit) => {
            return Err(Error::usage(format!(
                "fit = {fit:?} is not known; give \"ridge\", \"least-squares\" or \"select\""
            )));
        }
    };
    Ok(PolynomialOptions {
        method,
        ..PolynomialOptions::default()
    })
}

fn network(
    study: &jointwatch::Study,
    options: &Options,
    watch: &Watch,
) -> jointwatch::Result<ModelFile> {
    let default = NetworkOptions::default();
    let neurons = match (options.auto, options.neurons) {
        (true, _) => Neurons::Auto,
        (false, Some(neurons)) => Neurons::Fixed(neurons),
        (false, None) => default.neurons,
    };
    let options = NetworkOptions {
        neurons,
        restarts: options.restarts.unwrap_or(default.restarts),
        seed: options.seed.unwrap_or(default.seed),
        input: options.input.clone(),
        ..default
    };
    let observer = TrainingObserver {
        progress: &|p| {
            watch.say(
                format!("training {} of {}", p.training + 1, p.trainings),
                Some(p.share_done),
            );
        },
        stop: watch.stopped(),
    };
    Ok(identify::network(study, &options, &observer)?.model)
}
