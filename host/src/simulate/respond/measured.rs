//! The body whose force was logged, moving under that force and a law in place of the joint.
//!
//! With `d` the relative displacement and `b` the body's position, the far side of the joint is at
//! `o`: `d = b − o` or `d = o − b`, as the study's columns are. `o` is known from the measured
//! motion and is prescribed; `b` is simulated. In a study that has the relative displacement alone
//! the far side rests, as it does in the equation of motion from which the model was learnt.

use super::compare::Drift;
use super::run::{Follower, MeasuredMotion, Mechanism};
use crate::fit::errors::AT_REST_BELOW;
use crate::model::file::ModelFile;
use crate::model::scalar::HostScalar;
use crate::signal::fir::apply;
use crate::signal::motion::{Motion, low_pass};
use crate::simulate::{self, Contact, Equations, Excitation, JointLaw};
use crate::study::series::{rms, spread};
use crate::study::time::resample::finer;
use crate::study::{Axis, Channels, Controller, Convention, Study};
use crate::text::error::{Error, Result};
use nalgebra::{Matrix3, SVector, Vector3};

/// RMS difference between a logged acceleration and the second derivative of the only displacement,
/// as a part of the former's RMS in the common band, above which they belong to different motions.
const OTHER_MOTION: f64 = 0.5;

/// Samples per row from which a drive is interpolated between the rows. A cubic through the rows
/// themselves loses 0.3 % of a tone at a ninth of the sample rate and 5 % at a quarter; through
/// four times as many, band-limited, it keeps both to 1e-3.
const FINER: usize = 4;

/// Positions of the body on both axes, then its velocities.
type State = SVector<f64, 4>;

/// One axis of the driven body.
struct DrivenAxis {
    inertia: f64,
    ground_stiffness: f64,
    ground_damping: f64,
    /// In closed loop the controller answers where the simulated body goes another way than the
    /// measured one.
    controller: Controller,
    /// +1 for d = b − o, −1 for d = o − b.
    side: f64,
    /// The logged force, with what the controller would add for a body at rest at 0.
    force: Excitation,
    /// o, m or rad.
    far: Excitation,
    /// Velocity of the far side, m/s or rad/s.
    far_velocity: Excitation,
}

/// A record that drives one body.
pub(in crate::simulate) struct DrivenBody {
    axes: Vec<DrivenAxis>,
    /// The joint's measured motion.
    pub(in crate::simulate) motion: MeasuredMotion,
}

/// Positions and velocities as plain numbers.
fn numbers(y: &State) -> [f64; 4] {
    std::array::from_fn(|i| y[i])
}

/// What acts on the body at one instant, per axis.
pub(in crate::simulate) struct Acting {
    force: [f64; 2],
    far: [f64; 2],
    far_velocity: [f64; 2],
}

impl DrivenBody {
    /// # Errors
    /// One sentence when an axis has no inertia to move, or when the motion of its far side is not
    /// in the log.
    pub(in crate::simulate) fn new(
        study: &Study,
        model: &ModelFile,
        motion: &Motion,
    ) -> Result<Self> {
        let record = &study.records[motion.record];
        let mut axes = Vec::new();
        for (index, (axis, channels)) in study.axes.iter().zip(&record.axes).enumerate() {
            let known = &model.axes[index];
            if known.inertia == 0.0 {
                return Err(Error::data(format!(
                    "{}: axis {} has inertia 0, so its force already is the restoring force and there is no equation of motion \
                     to integrate; state the body's inertia and the force on it, and identify anew",
                    study.path.display(),
                    axis.name
                )));
            }
            let (side, far) = far_side(channels, known.restoring_force);
            if far.is_none() {
                check_acceleration(study, model, motion, index)?;
            }
            let rate = FINER as f64 * study.sample_rate_hz;
            let used = FINER * motion.first_row..FINER * (motion.first_row + motion.rows());
            let smooth = |series: &[f64]| {
                Excitation::logged(finer(series, FINER)[used.clone()].to_vec(), rate)
            };
            let far = far.unwrap_or_else(|| vec![0.0; record.rows]);
            let far_velocity = apply(&far, &model.filters.velocity);
            let force = with_controller(channels, axis, (side, &far), model);
            axes.push(DrivenAxis {
                inertia: known.inertia,
                ground_stiffness: axis.ground_stiffness,
                ground_damping: axis.ground_damping,
                side,
                controller: axis.controller,
                force: smooth(&force),
                far_velocity: Excitation::logged(finer(&far_velocity, FINER), rate),
                far: smooth(&far),
            });
        }
        let names = model.input_names()?;
        let inputs = names.iter().filter_map(|name| motion.input(name));
        Ok(Self {
            axes,
            motion: MeasuredMotion {
                states: motion.states.clone(),
                sample_rate_hz: study.sample_rate_hz,
                start_s: (record.first_row + motion.first_row) as f64 / study.sample_rate_hz,
                inputs: inputs.map(<[f64]>::to_vec).collect(),
            },
        })
    }

    /// The body with `law` in place of the joint.
    pub(in crate::simulate) fn moving<L: JointLaw + Clone>(
        &self,
        law: L,
        steps: usize,
    ) -> MovingBody<'_, L> {
        MovingBody {
            driven: self,
            follower: Follower::new(law.clone()),
            law,
            inertia: self.inertia(),
            y: State::zeros(),
            steps,
        }
    }

    /// Inertia per axis, kg or kg·m²; 1 on an axis that is not there.
    fn inertia(&self) -> [f64; 2] {
        let mut inertia = [1.0; 2];
        let stated = inertia.iter_mut().zip(&self.axes);
        stated.for_each(|(inertia, axis)| *inertia = axis.inertia);
        inertia
    }

    /// What acts at a time, s from row 0.
    pub(in crate::simulate) fn acting(&self, time_s: f64) -> Acting {
        let mut acting = Acting {
            force: [0.0; 2],
            far: [0.0; 2],
            far_velocity: [0.0; 2],
        };
        for (i, axis) in self.axes.iter().enumerate() {
            acting.force[i] = axis.force.at(time_s);
            acting.far[i] = axis.far.at(time_s);
            acting.far_velocity[i] = axis.far_velocity.at(time_s);
        }
        acting
    }

    /// The joint's state [x, ẋ, φ, φ̇], for the body's positions and then its velocities.
    pub(in crate::simulate) fn relative<S: HostScalar>(
        &self,
        y: &[S; 4],
        acting: &Acting,
    ) -> [S; 4] {
        let mut state = [S::zero(); 4];
        for (i, axis) in self.axes.iter().enumerate() {
            let side = S::constant(axis.side);
            state[2 * i] = side * (y[i] - S::constant(acting.far[i]));
            state[2 * i + 1] = side * (y[i + 2] - S::constant(acting.far_velocity[i]));
        }
        state
    }

    /// The equation of motion: how the body's positions and velocities change, for what the joint
    /// exerts and an inertia per axis.
    pub(in crate::simulate) fn rate<S: HostScalar>(
        &self,
        y: &[S; 4],
        joint: [S; 2],
        inertia: [S; 2],
        acting: &Acting,
    ) -> [S; 4] {
        let mut rate = [S::zero(); 4];
        for (i, axis) in self.axes.iter().enumerate() {
            rate[i] = y[i + 2];
            let spring = S::constant(axis.ground_stiffness + axis.controller.kp) * y[i];
            let damper = S::constant(axis.ground_damping + axis.controller.kd) * y[i + 2];
            let force = S::constant(acting.force[i]) - (spring + damper) + joint[i];
            rate[i + 2] = force.over(inertia[i]);
        }
        rate
    }

    /// The body's measured positions and velocities at a row.
    pub(in crate::simulate) fn measured(&self, row: usize) -> [f64; 4] {
        let acting = self.acting(row as f64 / self.motion.sample_rate_hz);
        let state = self.motion.state(row);
        let mut y = [0.0; 4];
        for (i, axis) in self.axes.iter().enumerate() {
            y[i] = acting.far[i] + axis.side * state[2 * i];
            y[i + 2] = acting.far_velocity[i] + axis.side * state[2 * i + 1];
        }
        y
    }

    /// Which axes have no spring that would hold the model's force error within the axis's own
    /// motion; an axis that rests shows no spring. `largest` is each axis's displacement in its
    /// liveliest record, RMS.
    pub(in crate::simulate) fn drifts<L: JointLaw + Clone>(
        &self,
        model: &ModelFile,
        motion: &Motion,
        law: L,
        largest: &[f64],
    ) -> Vec<Drift> {
        let mut follower = Follower::new(law);
        let mut exerted = vec![Vec::with_capacity(motion.rows()); self.axes.len()];
        for row in 0..motion.rows() {
            let law = follower.at(row, &self.motion);
            let state = self.motion.state(row);
            let force = law.force(state, law.contacts(state));
            for (series, force) in exerted.iter_mut().zip(force) {
                series.push(force);
            }
        }
        let mut drifts = Vec::new();
        for (i, axis) in self.axes.iter().enumerate() {
            let [d, v] = [2 * i, 2 * i + 1].map(|input| self.motion.states[input].as_slice());
            let displacement = spread(d);
            if displacement < AT_REST_BELOW * largest[i] {
                continue;
            }
            // In the equation of the relative motion the joint stands as side·force.
            let along = slope(d, v, &exerted[i]);
            let stiffness = axis.ground_stiffness + axis.controller.kp - axis.side * along;
            let measured = motion.restoring_force(i, axis.inertia, Convention::InertiaMinusForce);
            let error: Vec<f64> = measured
                .iter()
                .zip(&exerted[i])
                .map(|(r, p)| r - p)
                .collect();
            let force_error = rms(&low_pass(&error, &model.filters.band));
            if force_error > stiffness.max(0.0) * displacement {
                drifts.push(Drift {
                    axis: model.axes[i].name.clone(),
                    stiffness,
                    force_error,
                    displacement,
                });
            }
        }
        drifts
    }
}

/// Which side of the joint the body is on (+1 for d = b − o, −1 for d = o − b), and the far side's
/// position at every row, where it moves.
fn far_side(channels: &Channels, convention: Convention) -> (f64, Option<Vec<f64>>) {
    // A joint that pulls the body when it is stretched has the body's position counted off; a
    // spring would else push away.
    let by_convention = match convention {
        Convention::InertiaMinusForce => -1.0,
        Convention::ForceMinusInertia => 1.0,
    };
    let (first, second) = (
        &channels.displacement_first,
        channels.displacement_second.as_ref(),
    );
    let Some(body) = &channels.body_position else {
        return match second {
            // The acceleration was logged, so it is the body's own, and the other column is the far
            // side.
            Some(second) if channels.acceleration.is_some() => {
                let far = if by_convention < 0.0 { first } else { second };
                (by_convention, Some(far.clone()))
            }
            // The acceleration is that of the relative displacement.
            _ => (1.0, None),
        };
    };
    let side = if Some(body) == second {
        -1.0
    } else if body == first {
        1.0
    } else {
        by_convention
    };
    if second.is_none() && body == first {
        return (side, None);
    }
    let relative = channels.relative_displacement();
    let far = body.iter().zip(&relative).map(|(b, d)| b - side * d);
    (side, Some(far.collect()))
}

/// The logged force and, where the controller's gains are known, kp·b + kd·ḃ of the measured body:
/// less the same of the simulated body it is the force of the closed loop, whatever its reference.
fn with_controller(
    channels: &Channels,
    axis: &Axis,
    (side, far): (f64, &[f64]),
    model: &ModelFile,
) -> Vec<f64> {
    let mut force = channels.force.clone();
    let Controller { kp, kd } = axis.controller;
    if (kp, kd) == (0.0, 0.0) {
        return force;
    }
    let relative = channels.relative_displacement();
    let body: Vec<f64> = relative
        .iter()
        .zip(far)
        .map(|(d, o)| o + side * d)
        .collect();
    let velocity = apply(&body, &model.filters.velocity);
    let lost = (body.len() - velocity.len()) / 2;
    for (row, force) in force.iter_mut().enumerate() {
        // Rows at the ends of the record, for which the filter has no velocity, are not simulated.
        let speed = row.checked_sub(lost).and_then(|row| velocity.get(row));
        *force += kp * body[row] + kd * speed.copied().unwrap_or(0.0);
    }
    force
}

/// Refuses a logged acceleration that is not that of the only displacement there is: the far side
/// then moves, and nothing in the log says how.
fn check_acceleration(
    study: &Study,
    model: &ModelFile,
    motion: &Motion,
    index: usize,
) -> Result<()> {
    let record = &study.records[motion.record];
    let channels = &record.axes[index];
    if channels.acceleration.is_none() {
        return Ok(());
    }
    let band = &model.filters.band;
    let relative = channels.relative_displacement();
    let derived = low_pass(&apply(&relative, &model.filters.acceleration), band);
    let logged = low_pass(&motion.acceleration[index], band);
    let difference: Vec<f64> = logged.iter().zip(&derived).map(|(a, b)| a - b).collect();
    let [difference, logged] = [difference, logged].map(|s| rms(&s));
    if difference > OTHER_MOTION * logged {
        return Err(Error::data(format!(
            "{}: the logged acceleration of {} is not that of its displacement, so the far side of the joint moves and the log \
             does not say how; name body_position in study.toml",
            record.file, study.axes[index].name
        )));
    }
    Ok(())
}

/// ∂force/∂displacement of the straight line in displacement and velocity that fits a force best.
fn slope(displacement: &[f64], velocity: &[f64], force: &[f64]) -> f64 {
    let (d_size, v_size) = (rms(displacement), rms(velocity));
    let mut gram = Matrix3::zeros();
    let mut moment = Vector3::zeros();
    for ((d, v), f) in displacement.iter().zip(velocity).zip(force) {
        let row = Vector3::new(1.0, d / d_size, v / v_size);
        gram += row * row.transpose();
        moment += row * *f;
    }
    // An axis that stands still has no slope.
    gram.lu().solve(&moment).map_or(0.0, |line| {
        if line[1].is_finite() {
            line[1] / d_size
        } else {
            0.0
        }
    })
}

/// The body under way.
pub(in crate::simulate) struct MovingBody<'a, L> {
    driven: &'a DrivenBody,
    follower: Follower<L>,
    law: L,
    inertia: [f64; 2],
    y: State,
    steps: usize,
}

impl<L: JointLaw> Equations<4> for MovingBody<'_, L> {
    type Drive = Acting;

    fn drive(&self, time_s: f64) -> Acting {
        self.driven.acting(time_s)
    }

    fn contacts(&self, y: &State, time_s: f64) -> [Contact; 2] {
        self.law.contacts(
            self.driven
                .relative(&numbers(y), &self.driven.acting(time_s)),
        )
    }

    fn rate(&self, y: &State, contacts: [Contact; 2], acting: &Acting) -> State {
        let y = numbers(y);
        let joint = self.law.force(self.driven.relative(&y, acting), contacts);
        State::from(self.driven.rate(&y, joint, self.inertia, acting))
    }
}

impl<L: JointLaw + Clone> Mechanism for MovingBody<'_, L> {
    fn place(&mut self, row: usize) {
        self.y = State::from(self.driven.measured(row));
        self.law = self.follower.at(row, &self.driven.motion);
    }

    fn next_row(&mut self, row: usize) {
        let step_s = 1.0 / (self.driven.motion.sample_rate_hz * self.steps as f64);
        for sub in 0..self.steps {
            let time_s = row as f64 / self.driven.motion.sample_rate_hz + sub as f64 * step_s;
            let middle = row as f64 + (sub as f64 + 0.5) / self.steps as f64;
            self.law.follow(&self.driven.motion.inputs_at(middle));
            let mut y = self.y;
            simulate::advance(self, &mut y, time_s, step_s);
            self.y = y;
            let acting = self.driven.acting(time_s + step_s);
            self.law
                .advance(self.driven.relative(&numbers(&self.y), &acting), step_s);
        }
    }

    fn joint_state(&self, row: usize) -> [f64; 4] {
        let time_s = row as f64 / self.driven.motion.sample_rate_hz;
        self.driven
            .relative(&numbers(&self.y), &self.driven.acting(time_s))
    }
}
