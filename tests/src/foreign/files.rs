//! Files: logs, the study, the rig's description, models, signed models.

use crate::program::workspace;
use jointwatch::device::rig_block;
use jointwatch::device::signing::SignedModel;
use jointwatch::simulate::{SimulationOptions, simulate};
use jointwatch::study::Study;
use jointwatch::study::survey::Survey;
use jointwatch::text::error::{Error, Kind};
use jointwatch::{Kind as JointKind, Model, identify};
use jointwatch_shared::selftest::reference_model;
use std::cell::RefCell;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

thread_local! {
    static FOLDER: RefCell<Option<TempDir>> = const { RefCell::new(None) };
}

/// A folder of this thread's own.
fn folder() -> PathBuf {
    FOLDER.with_borrow_mut(|folder| {
        let folder = folder.get_or_insert_with(|| tempfile::tempdir().expect("a folder"));
        folder.path().to_owned()
    })
}

/// A file of this thread's own with these bytes.
fn written(name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder().join(name);
    fs::write(&path, bytes).expect("a file");
    path
}

/// Bad data is refused in one sentence.
fn refused(error: &Error) {
    assert_eq!(error.kind, Kind::Data, "{error}");
    assert!(!error.sentence.contains('\n'), "{error}");
}

fn repository(path: &str) -> Vec<u8> {
    fs::read(workspace().join(path)).expect("a file of the repository")
}

/// Logs of the tests.
pub(super) fn logs(names: &[&str]) -> Vec<Vec<u8>> {
    let read = |name: &&str| repository(&format!("tests/data/logs/{name}"));
    names.iter().map(read).collect()
}

/// Rows as objects, columns as arrays, and an object around either.
pub(super) fn json_logs() -> Vec<Vec<u8>> {
    let seeds = [
        "{\"t_s\": [0.0, 0.001, 0.002], \"F_N\": [1, -2.5, 3e2]}",
        "{\"data\": {\"t_s\": [0.0, 0.001], \"F_N\": [1, null]}}",
        "[{\"t_s\": 0, \"F_N\": 1.0}, {\"t_s\": 0.001, \"F_N\": \"2\"}]",
        "[[0, 1], [0.001, 2]]",
        "{\"data\": [[0, 1], [0.001, 2]], \"columns\": [\"t_s\", \"F_N\"]}",
    ];
    seeds.map(|text| text.as_bytes().to_vec()).to_vec()
}

/// Reads a log in whatever format it is.
pub(super) fn log(bytes: &[u8]) {
    if let Err(error) = Survey::of(&written("log", bytes)) {
        refused(&error);
    }
}

/// Descriptions of the study of one short log.
pub(super) fn studies() -> Vec<Vec<u8>> {
    let plain = "time = \"t_s\"\n[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = \"x_m\"\nacceleration = \"a_m_s2\"\n\
                 force = { column = \"F_N\", unit = \"kN\", scale = 2.0, offset = 0.5 }\ninertia = 1.5\n[[record]]\nfile = \
                 \"log.csv\"\nrole = \"train\"\nrows = [0, 400]\n[base]\nterms = [\"stiffness@x\"]\n";
    let uneven = "time = { column = \"t_s\", resample_hz = 500.0 }\nband_hz = 100.0\n[[axis]]\nname = \"x\"\nkind = \
                  \"rotation\"\ndisplacement = [\"x_m\", \"x_m\"]\nforce = \"F_N\"\nencoder_step = 1e-6\n[[record]]\nfile = \"log.csv\"\n\
                  role = \"validate\"\n";
    let still = "time = \"none\"\n[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = \"x_m\"\nforce = \"F_N\"\n\
                 [[record]]\nfile = \"log.csv\"\nrole = \"train\"\n";
    [plain, uneven, still]
        .map(|text| text.as_bytes().to_vec())
        .to_vec()
}

/// Reads a description, and the log that it names.
pub(super) fn study(bytes: &[u8]) {
    let log = folder().join("log.csv");
    if !log.exists() {
        fs::write(&log, repository("tests/data/logs/record.csv")).expect("a file");
    }
    if let Err(error) = Study::read(&written("study.toml", bytes)) {
        refused(&error);
    }
}

/// The example of the reference.
pub(super) fn rigs() -> Vec<Vec<u8>> {
    let page = repository("docs/reference/rig-block.md");
    let page = String::from_utf8(page).expect("text");
    let example = page
        .split("```toml\n")
        .nth(1)
        .and_then(|rest| rest.split("```").next());
    vec![example.expect("an example").as_bytes().to_vec()]
}

/// Reads the description of a rig for a model.
pub(super) fn rig(bytes: &[u8]) {
    match rig_block::of_file(&written("rig.toml", bytes), reference_model()) {
        Ok(rig) => {
            rig_block::in_words(&rig);
        }
        Err(error) => refused(&error),
    }
}

/// A model of every kind, of a rig of one axis.
pub(super) fn models() -> Vec<Vec<u8>> {
    let options = SimulationOptions {
        axes: 1,
        duration_s: 4.0,
        ..SimulationOptions::default()
    };
    let study = simulate(&options).expect("a simulated rig").study;
    let kinds = [
        JointKind::Physical,
        JointKind::Polynomial,
        JointKind::Network,
    ];
    let model = |kind| identify(&study, kind).expect("a model");
    let text = |kind| serde_json::to_vec(&model(kind)).expect("JSON");
    kinds.map(text).to_vec()
}

/// Reads a model file, and does with it what every command does.
pub(super) fn model(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    match Model::parse("model.json", text) {
        Ok(model) => {
            let states = [[0.0, 1e-3, -1e-3]; 4];
            let states: Vec<&[f64]> = states.iter().map(<[f64; 3]>::as_slice).collect();
            for result in [
                model.effects_in_si().map(|_| ()),
                model.corrections().map(|_| ()),
                model
                    .predict(&states[..states.len().min(model.base.inputs().len())])
                    .map(|_| ()),
            ] {
                if let Err(error) = result {
                    refused(&error);
                }
            }
        }
        Err(error) => refused(&error),
    }
}

/// Reads a file that `jointwatch sign` wrote, or did not.
pub(super) fn signed_model(bytes: &[u8]) {
    let read = |path: &Path| match SignedModel::read(path) {
        Ok(signed) => assert_eq!(
            signed.to_bytes().len(),
            fs::read(path).expect("a file").len()
        ),
        Err(error) => refused(&error),
    };
    read(&written("model.signed", bytes));
    super::device::seal(bytes);
}
