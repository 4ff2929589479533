//! Measured joints in place of the paper's test rig (Figs. 14 to 18): public data, where they are
//! at hand.

use super::figures::{training, verification_and_validation};
use super::network;
use super::polynomials::Denominator;
use crate::assess::compare;
use crate::model::file::{AxisError, ModelFile};
use crate::report::Drawing;
use crate::study::{Role, Study};
use crate::text::error::{Error, Result};
use serde::Serialize;
use std::fs;
use std::path::{Path, PathBuf};

/// A joint with public measurements.
pub(super) struct Source {
    /// Its name, as a heading.
    pub(super) name: &'static str,
    /// The folder that holds its logs, and its short name in the figures' files.
    pub(super) folder: &'static str,
    /// The text of its study.toml.
    study: &'static str,
    /// Where a reader finds that study.
    pub(super) study_page: &'static str,
    /// The logs that the study names.
    pub(super) logs: [&'static str; 2],
    /// What it is and where its data come from.
    pub(super) what: &'static str,
    /// What to see in the figures.
    pub(super) reading: &'static str,
}

/// The joints of the page.
pub(super) const SOURCES: [Source; 2] = [
    Source {
        name: "A slide with dry friction: EMPS",
        folder: "emps",
        study: include_str!("../../../docs/measured-axis.toml"),
        study_page: "../measured-axis.toml",
        logs: ["DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"],
        what: "The electro-mechanical positioning system of Janot, Gautier and Brunot (2019), published at nonlinearbenchmark.org, has one \
               prismatic joint under closed-loop control. Position and motor command are logged at 1 kHz. Velocity and acceleration are \
               derived from position, and the mass is identified with the force. The second record, used for validation, contains \
               force pulses. The force is the command times the drive gain in both: the logged pulses, regressed on, get a coefficient \
               of 0.01.",
        reading: "Dry friction is a step at zero velocity. A cubic polynomial replaces the step by a slope; tanh can make it, so the \
                  network fits the training record well. But that record repeats one trajectory, and the pulses move the slide off it. \
                  There no data constrain a flexible model, and spikes appear where pulses begin and end. The paper drives its joint at \
                  random for that reason. [A measured axis](measured-axis.md) has the physical model of this slide.",
    },
    Source {
        name: "A damper with hysteresis and backlash",
        folder: "brfd",
        study: include_str!("../../../docs/friction-damper.toml"),
        study_page: "../friction-damper.toml",
        logs: [
            "ds2_0.5Hz36lbtension1amplitude.json",
            "ds2_1Hz36lbtension1amplitude.json",
        ],
        what: "The banded rotary friction damper of the ARTS-Laboratory (Dataset-Friction-Damper-with-Backlash, CC BY-SA 4.0) moves \
               sinusoidally: at 0.5 Hz for training, at 1 Hz with the same amplitude for validation.",
        reading: "Both models fail here, and they should. Twice the frequency means twice the velocity, so many validation rows lie outside \
                  the training range; the paper's Section 6 warns of that. And the force of a band that sticks, slips and has backlash \
                  depends on the history of the motion. No function of displacement and velocity has that memory. Small errors on the \
                  training record do not show this.",
    },
];

/// One fit in the table of a measured joint.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeasuredFit {
    /// How it was fitted.
    pub fit: String,
    /// Errors on the record it was learnt from.
    pub verification: Vec<AxisError>,
    /// Errors on the other record.
    pub validation: Vec<AxisError>,
}

/// What the measured joints gave, or why they gave nothing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeasuredJoint {
    /// Its folder among the data.
    pub folder: &'static str,
    /// Why it is left out; none when it is there.
    pub left_out: Option<String>,
    /// Inertia, kg or kg·m², and its standard error where it was identified.
    pub inertia: Option<f64>,
    /// Share of the validation rows outside the training range, 0 to 1.
    pub outside_range: f64,
    /// Plain, ridge, selected terms, network.
    pub fits: Vec<MeasuredFit>,
    /// Validation NMSE of every training of the network in the common band, percent, in the order
    /// of their seeds.
    pub trainings: Vec<f64>,
    /// Which of them was kept, by the evidence of the training record.
    pub kept: usize,
}

/// A measured joint with its figures: Fig. 14, Figs. 15 and 16 of the polynomial, Figs. 17 and 18
/// of the network.
pub(super) struct Section {
    pub(super) joint: MeasuredJoint,
    pub(super) drawings: Vec<Drawing>,
}

/// Learns one measured joint and draws it; a joint whose logs are not there is left out with the
/// reason.
///
/// `data` is what `--data` gave. Without it the logs are looked for in the folder `data` of
/// `JOINTWATCH_DATA`, and without that in `../shared/data`.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the logs are there but cannot be used.
pub(super) fn section(source: &Source, data: Option<&Path>, restarts: usize) -> Result<Section> {
    let Some(folder) = locate(source, data) else {
        return Ok(Section {
            joint: MeasuredJoint {
                folder: source.folder,
                left_out: Some(left_out(source)),
                inertia: None,
                outside_range: 0.0,
                fits: Vec::new(),
                trainings: Vec::new(),
                kept: 0,
            },
            drawings: Vec::new(),
        });
    };
    let study = read(source, &folder)?;
    let polynomials = Denominator::ALL
        .iter()
        .map(|fit| Ok((fit.words(), fit.identify(&study)?)))
        .collect::<Result<Vec<(&str, ModelFile)>>>()?;
    let trained = network::train(&study, restarts)?;
    let (trainings, kept) = trained.each(&study)?;
    let network = trained.model;
    let plain = &polynomials[0].1;
    let name = |number: u8, what: &str| format!("fig{number}-{}-{what}", source.folder);
    let compared = |model, first: u8, learner: &str| {
        let names = [
            name(first, &format!("{learner}-verification")),
            name(first + 1, &format!("{learner}-validation")),
        ];
        let names = [names[0].as_str(), names[1].as_str()];
        verification_and_validation(&study, model, names, ["measured", learner])
    };
    let mut drawings = vec![training(&study, plain, &name(14, "training"))?];
    drawings.extend(compared(plain, 15, "polynomial")?);
    drawings.extend(compared(&network, 17, "network")?);

    let records = compare::compare(&study, plain)?.records;
    let validation = records.iter().filter(|r| r.role == Role::Validate);
    let outside = validation.flat_map(|r| r.axes.values().map(|a| a.outside_range));
    let fits = polynomials
        .iter()
        .map(|(fit, model)| (*fit, model))
        .chain([("network", &network)])
        .map(|(fit, model)| MeasuredFit {
            fit: fit.into(),
            verification: model.verification.clone(),
            validation: model.validation.clone(),
        });
    Ok(Section {
        joint: MeasuredJoint {
            folder: source.folder,
            left_out: None,
            inertia: plain.axes[0]
                .inertia_identified
                .then(|| plain.axes[0].inertia),
            outside_range: outside.fold(0.0, f64::max),
            fits: fits.collect(),
            trainings: trainings.iter().flat_map(|e| e.common.clone()).collect(),
            kept,
        },
        drawings,
    })
}

/// The folder with all logs of a joint.
fn locate(source: &Source, data: Option<&Path>) -> Option<PathBuf> {
    let all = match (data, std::env::var_os("JOINTWATCH_DATA")) {
        (Some(data), _) => data.to_path_buf(),
        (None, Some(beside)) => PathBuf::from(beside).join("data"),
        (None, None) => PathBuf::from("../shared/data"),
    };
    let folder = all.join(source.folder);
    let complete = source.logs.iter().all(|log| folder.join(log).is_file());
    complete.then_some(folder)
}

fn left_out(source: &Source) -> String {
    let [first, second] = source.logs;
    format!(
        "the logs {first} and {second} were not in a folder {} where this page was made: they are public, but not part of this \
         project; put them there and name the folder above it with --data",
        source.folder
    )
}

/// Reads the study of a joint, in a folder of its own: where the logs lie, nothing is written.
fn read(source: &Source, logs: &Path) -> Result<Study> {
    let failed = |e: std::io::Error| {
        Error::failed(format!(
            "the logs in {} could not be copied into a temporary folder ({e}); check that both may be read and written",
            logs.display()
        ))
    };
    let folder = tempfile::tempdir().map_err(failed)?;
    for log in source.logs {
        fs::copy(logs.join(log), folder.path().join(log)).map_err(failed)?;
    }
    fs::write(folder.path().join("study.toml"), source.study).map_err(failed)?;
    Study::read(folder.path())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logs_that_are_not_there_are_left_out_with_the_reason() {
        let empty = tempfile::tempdir().unwrap();
        for source in &SOURCES {
            let section = section(source, Some(empty.path()), 1).unwrap();
            let reason = section.joint.left_out.unwrap();
            assert!(
                reason.contains(source.logs[1]) && reason.contains("--data"),
                "{reason}"
            );
            assert!(section.drawings.is_empty());
        }
    }

    #[test]
    fn half_of_the_logs_are_not_enough() {
        let data = tempfile::tempdir().unwrap();
        let folder = data.path().join(SOURCES[0].folder);
        fs::create_dir(&folder).unwrap();
        fs::write(folder.join(SOURCES[0].logs[0]), b"").unwrap();
        assert_eq!(locate(&SOURCES[0], Some(data.path())), None);
        fs::write(folder.join(SOURCES[0].logs[1]), b"").unwrap();
        assert_eq!(locate(&SOURCES[0], Some(data.path())), Some(folder));
    }
}
