//! The measured body under way, and how its motion changes with one quantity.
//!
//! The joint's law works on dual numbers, and the integrator moves values and slopes side by side.
//! A Runge–Kutta step is made of sums and products, so the slopes are those of the simulated motion
//! itself, to rounding, whatever its step.

use super::unknowns::{By, Unknowns};
use crate::model::file::ModelFile;
use crate::simulate::respond::ModelLaw;
use crate::simulate::respond::measured::{Acting, DrivenBody};
use crate::simulate::respond::run::{DIVERGED, Follower};
use crate::simulate::{Contact, Equations, JointLaw, advance};
use crate::text::error::Result;
use jointwatch_shared::scalar::dual::Dual;
use nalgebra::SVector;
use std::ops::Range;

/// Positions and velocities of both axes, then their slopes.
type State = SVector<f64, 8>;

/// A stretch of a record that is simulated from a start of its own.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stretch {
    /// Which of the records that drive a body.
    pub(super) body: usize,
    /// Rows of that record's motion.
    pub(super) rows: Range<usize>,
}

/// Relative displacement at every row of a stretch, per axis.
pub(super) type Displacements = Vec<Vec<Dual>>;

struct Tangent<'a> {
    driven: &'a DrivenBody,
    law: ModelLaw<Dual>,
    inertia: [Dual; 2],
    y: State,
}

fn dual(y: &State) -> [Dual; 4] {
    std::array::from_fn(|i| Dual {
        value: y[i],
        slopes: [y[i + 4]],
    })
}

fn flat(y: [Dual; 4]) -> State {
    State::from_fn(|i, _| {
        if i < 4 {
            y[i].value
        } else {
            y[i - 4].slopes[0]
        }
    })
}

impl Equations<8> for Tangent<'_> {
    type Drive = Acting;

    fn drive(&self, time_s: f64) -> Acting {
        self.driven.acting(time_s)
    }

    /// A model's law has no corner that a step would have to end at.
    fn contacts(&self, _y: &State, _time_s: f64) -> [Contact; 2] {
        [Contact::Inside; 2]
    }

    fn rate(&self, y: &State, contacts: [Contact; 2], acting: &Acting) -> State {
        let y = dual(y);
        let joint = self.law.force(self.driven.relative(&y, acting), contacts);
        flat(self.driven.rate(&y, joint, self.inertia, acting))
    }
}

impl Tangent<'_> {
    fn next_row(&mut self, row: usize, steps: usize) {
        let rate_hz = self.driven.motion.sample_rate_hz;
        let step_s = 1.0 / (rate_hz * steps as f64);
        for sub in 0..steps {
            let time_s = row as f64 / rate_hz + sub as f64 * step_s;
            let middle = row as f64 + (sub as f64 + 0.5) / steps as f64;
            self.law.follow(&self.driven.motion.inputs_at(middle));
            let mut y = self.y;
            advance(self, &mut y, time_s, step_s);
            self.y = y;
            let acting = self.driven.acting(time_s + step_s);
            self.law
                .advance(self.driven.relative(&dual(&self.y), &acting), step_s);
        }
    }

    /// The joint's state, unless it is no number or has left all that the model knows.
    fn state(&self, row: usize, model: &ModelFile) -> Option<[Dual; 4]> {
        let time_s = row as f64 / self.driven.motion.sample_rate_hz;
        let state = self
            .driven
            .relative(&dual(&self.y), &self.driven.acting(time_s));
        let mut known = model.base.motion_ranges().iter().zip(state);
        // Written so that a value that is no number counts as gone.
        let near = known.all(|(range, s)| range.normalise(s.value).abs() <= DIVERGED);
        (near && state.iter().all(|s| s.slopes[0].is_finite())).then_some(state)
    }
}

/// Simulates every stretch from its start and differentiates it; none when one of them diverges.
///
/// What the law remembers has followed the measured motion before each start, as in `respond`.
/// Stretches come in the order of the bodies and of their rows.
pub(super) fn simulated(
    (model, unknowns): (&ModelFile, &Unknowns),
    bodies: &[DrivenBody],
    stretches: &[Stretch],
    starts: &[[f64; 4]],
    by: By,
    steps: usize,
) -> Result<Option<Vec<Displacements>>> {
    let (evaluator, inertia) = unknowns.lifted(model, by)?;
    let law = ModelLaw::of(model, evaluator);
    let mut all = Vec::with_capacity(stretches.len());
    let mut follower = Follower::new(law.clone());
    let mut last = None;
    for (stretch, start) in stretches.iter().zip(starts) {
        let driven = &bodies[stretch.body];
        if last != Some(stretch.body) {
            follower = Follower::new(law.clone());
            last = Some(stretch.body);
        }
        let mut y = start.map(Dual::constant);
        if let By::Start(place) = by {
            y[place].slopes = [1.0];
        }
        let mut tangent = Tangent {
            driven,
            law: follower.at(stretch.rows.start, &driven.motion),
            inertia,
            y: flat(y),
        };
        let mut series = vec![Vec::with_capacity(stretch.rows.len()); model.axes.len()];
        for row in stretch.rows.clone() {
            let Some(state) = tangent.state(row, model) else {
                return Ok(None);
            };
            for (axis, series) in series.iter_mut().enumerate() {
                series.push(state[2 * axis]);
            }
            if row + 1 < stretch.rows.end {
                tangent.next_row(row, steps);
            }
        }
        all.push(series);
    }
    Ok(Some(all))
}
