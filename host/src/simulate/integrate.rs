//! Integrating equations of motion with a joint in them: Runge–Kutta steps that end where a contact
//! opens or closes.

use super::joint::Contact;
use nalgebra::SVector;

/// How often a step may be cut at a stop before the rest of it is taken as it is; a real record
/// needs two.
const MAX_CUTS: usize = 16;

/// Equations of motion in first-order form, smooth as long as the joint's contacts stay as they
/// are.
pub trait Equations<const N: usize> {
    /// What acts from outside at one instant.
    type Drive;

    /// What acts from outside at a time, s.
    fn drive(&self, time_s: f64) -> Self::Drive;

    /// On which side of its clearance each axis of the joint is.
    fn contacts(&self, y: &SVector<f64, N>, time_s: f64) -> [Contact; 2];

    /// The time derivative of the state, with the joint's contacts held as given.
    fn rate(
        &self,
        y: &SVector<f64, N>,
        contacts: [Contact; 2],
        drive: &Self::Drive,
    ) -> SVector<f64, N>;
}

/// One classical fourth-order Runge–Kutta step with the contacts held.
fn step<const N: usize, E: Equations<N>>(
    equations: &E,
    y: &SVector<f64, N>,
    contacts: [Contact; 2],
    time_s: f64,
    step_s: f64,
) -> SVector<f64, N> {
    let start = equations.drive(time_s);
    let middle = equations.drive(time_s + 0.5 * step_s);
    let end = equations.drive(time_s + step_s);
    let k1 = equations.rate(y, contacts, &start);
    let k2 = equations.rate(&(y + 0.5 * step_s * k1), contacts, &middle);
    let k3 = equations.rate(&(y + 0.5 * step_s * k2), contacts, &middle);
    let k4 = equations.rate(&(y + step_s * k3), contacts, &end);
    y + step_s / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
}

/// Moves the state on by one step of fixed length. Where a stop is met or left inside the step, the
/// step is cut there: the force law has a corner (and the coupling a jump) at the stop, and a step
/// across it would be of first order only.
pub fn advance<const N: usize, E: Equations<N>>(
    equations: &E,
    y: &mut SVector<f64, N>,
    time_s: f64,
    step_s: f64,
) {
    let mut contacts = equations.contacts(y, time_s);
    let mut done = 0.0;
    for _ in 0..MAX_CUTS {
        let start_s = time_s + done;
        let rest = step_s - done;
        let whole = step(equations, y, contacts, start_s, rest);
        if equations.contacts(&whole, start_s + rest) == contacts {
            *y = whole;
            return;
        }
        let (mut before, mut after) = (0.0, rest);
        let mut crossed = whole;
        for _ in 0..40 {
            let middle = 0.5 * (before + after);
            let state = step(equations, y, contacts, start_s, middle);
            if equations.contacts(&state, start_s + middle) == contacts {
                before = middle;
            } else {
                (after, crossed) = (middle, state);
            }
        }
        *y = crossed;
        contacts = equations.contacts(y, start_s + after);
        done += after;
        if done >= step_s {
            return;
        }
    }
    *y = step(equations, y, contacts, time_s + done, step_s - done);
}
