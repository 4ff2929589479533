//! The whole simulated rig with a law in place of its joint, shaken by the drive with which the
//! study was simulated.

use super::run::{Follower, MeasuredMotion, Mechanism};
use crate::model::ModelEffect;
use crate::simulate::{
    Bodies, BodyState, Excitation, HiddenJoint, JointLaw, RigParameters, SUBSTEPS,
    SimulationOptions, joint_state, record_drives,
};
use crate::study::Study;
use crate::text::error::{Error, Result};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// Largest RMS difference between logged and re-simulated displacement, as a part of the latter's
/// RMS, at which a truth file counts as that of the record: encoder counts are far below, another
/// seed or another rig far above.
const SAME_MOTION: f64 = 0.02;

/// What `jointwatch simulate` left beside the study.
pub(super) struct Truth {
    path: PathBuf,
    file: TruthFile,
}

#[derive(Deserialize)]
struct TruthFile {
    seed: u64,
    sample_rate_hz: f64,
    drive_band_hz: [f64; 2],
    validation_level: f64,
    rig: RigParameters,
    /// What is hidden in the rig.
    #[serde(default)]
    effects: Vec<ModelEffect>,
}

/// The truth beside a study, when it was simulated by `jointwatch simulate`.
///
/// # Errors
/// When there is a truth file that cannot be read.
pub(super) fn read_truth(study: &Study) -> Result<Option<Truth>> {
    if !study.path.is_file() {
        return Ok(None);
    }
    let folder = study.path.parent().unwrap_or(Path::new("."));
    let path = folder.join("truth").join("truth.json");
    if !path.is_file() {
        return Ok(None);
    }
    let text = std::fs::read_to_string(&path)
        .map_err(|e| Error::data(format!("{}: it cannot be read ({e})", path.display())))?;
    let file = serde_json::from_str(&text).map_err(|e| {
        Error::data(format!(
            "{}: this is not the truth of a simulated rig ({e}); simulate the study anew, or use the logged force with \
             --measured",
            path.display()
        ))
    })?;
    Ok(Some(Truth { path, file }))
}

/// A record of a simulated rig: how it was shaken, and how all bodies truly moved.
pub(super) struct ShakenRecord<'a> {
    parameters: &'a RigParameters,
    drive: [Excitation; 2],
    /// All bodies at every row of the file.
    bodies: Vec<BodyState>,
    /// The row of the file at which the record begins.
    first_row: usize,
    /// The joint's true motion.
    pub(super) motion: MeasuredMotion,
}

impl<'a> ShakenRecord<'a> {
    /// Shakes the true rig once more: that gives the bodies that nobody logged, and shows that
    /// truth and log belong together.
    ///
    /// # Errors
    /// When they do not.
    pub(super) fn new(study: &Study, index: usize, truth: &'a Truth) -> Result<Self> {
        let record = &study.records[index];
        let foreign = |why: &str| {
            Error::data(format!(
                "{}: it is not the truth of {} ({why}); simulate the study anew, or use the logged force with --measured",
                truth.path.display(),
                record.file
            ))
        };
        // The drive depends on the length of the whole file, of which the study may use a part.
        let states = truth.path.with_file_name(&record.file);
        let rows = std::fs::read_to_string(&states)
            .map_err(|e| foreign(&format!("{}: {e}", states.display())))?
            .lines()
            .count()
            .saturating_sub(1);
        let options = SimulationOptions {
            rig: truth.file.rig,
            axes: study.axes.len(),
            seed: truth.file.seed,
            duration_s: rows as f64 / truth.file.sample_rate_hz,
            sample_rate_hz: truth.file.sample_rate_hz,
            band_hz: truth.file.drive_band_hz,
            validation_level: truth.file.validation_level,
            ..SimulationOptions::default()
        };
        let drive = record_drives(&options, &record.file)
            .map_err(|e| foreign(&e.sentence))?
            .ok_or_else(|| foreign("a simulated study has no such record"))?;
        if (study.sample_rate_hz - options.sample_rate_hz).abs() > 1e-6 * options.sample_rate_hz
            || record.first_row + record.rows > rows
        {
            return Err(foreign("its rows or its sample rate are others"));
        }
        let parameters = &truth.file.rig;
        let names: Vec<&str> = study.axes.iter().map(|a| a.name.as_str()).collect();
        let hidden: Vec<_> = (truth.file.effects.iter())
            .map(|e| e.bound_in_si(&names))
            .collect::<Result<_>>()
            .map_err(|e| foreign(&e.sentence))?;
        let step_s = 1.0 / (options.sample_rate_hz * SUBSTEPS as f64);
        let mut bodies = Bodies {
            parameters,
            joint: HiddenJoint::new(parameters, study.axes.len(), hidden.first(), step_s),
        };
        let bodies = bodies.run(&drive, rows, options.sample_rate_hz, SUBSTEPS);
        let first_row = record.first_row;
        let used = &bodies[first_row..first_row + record.rows];
        let states: Vec<Vec<f64>> = (0..2 * study.axes.len())
            .map(|input| used.iter().map(|y| joint_state(y)[input]).collect())
            .collect();
        for (axis, channels) in record.axes.iter().enumerate() {
            let logged = channels.relative_displacement();
            let (mut difference, mut size) = (0.0, 0.0);
            for (logged, truly) in logged.iter().zip(&states[2 * axis]) {
                difference += (logged - truly) * (logged - truly);
                size += truly * truly;
            }
            let step = study.axes[axis].encoder_step.unwrap_or(0.0);
            let allowed = SAME_MOTION * SAME_MOTION * size + step * step * record.rows as f64;
            if difference > allowed {
                return Err(foreign(&format!(
                    "with its parameters and its drive {} moves otherwise than it was logged",
                    study.axes[axis].name
                )));
            }
        }
        Ok(Self {
            parameters,
            drive,
            bodies,
            first_row,
            motion: MeasuredMotion {
                states,
                sample_rate_hz: study.sample_rate_hz,
                start_s: first_row as f64 / study.sample_rate_hz,
                inputs: Vec::new(),
            },
        })
    }

    /// The rig with `law` in place of the joint.
    pub(super) fn moving<L: JointLaw + Clone>(&self, law: L, steps: usize) -> MovingRig<'_, L> {
        MovingRig {
            record: self,
            bodies: Bodies {
                parameters: self.parameters,
                joint: law.clone(),
            },
            follower: Follower::new(law),
            y: BodyState::zeros(),
            steps,
        }
    }
}

/// The rig under way.
pub(super) struct MovingRig<'a, L> {
    record: &'a ShakenRecord<'a>,
    bodies: Bodies<'a, L>,
    follower: Follower<L>,
    y: BodyState,
    steps: usize,
}

impl<L: JointLaw + Clone> Mechanism for MovingRig<'_, L> {
    fn place(&mut self, row: usize) {
        self.y = self.record.bodies[self.record.first_row + row];
        self.bodies.joint = self.follower.at(row, &self.record.motion);
    }

    fn next_row(&mut self, row: usize) {
        self.bodies.next_row(
            &mut self.y,
            &self.record.drive,
            self.record.first_row + row,
            self.record.motion.sample_rate_hz,
            self.steps,
        );
    }

    fn joint_state(&self, _row: usize) -> [f64; 4] {
        joint_state(&self.y)
    }
}
