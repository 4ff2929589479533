//! How strong a hidden effect must be to make a wanted share of the restoring force, and how much
//! of it can show.

use super::laws::dead_zone;
use super::rig::{Rig, Trace};
use super::sensors::{Faulty, error, rms};
use nalgebra::{DMatrix, DVector};

/// Sizes of a hidden effect over the training motion, as shares of the RMS restoring force of its
/// axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shares {
    /// RMS of its own force.
    pub whole: f64,
    /// RMS of what no choice of the base's linear values takes over: all that a diagnosis can see.
    pub visible: f64,
}

/// How near the share must come.
const NEAR: f64 = 0.02;
/// Rounds of simulation; friction that nearly locks the joint needs the most.
const MAX_ROUNDS: usize = 9;

/// Scales laws and faults until their shares are as wanted, simulating anew each time, and gives
/// the motion with them. Nothing when the rig does not bear it.
pub fn find_strengths(
    rig: &mut Rig,
    faults: &mut [Faulty],
    wanted_of_laws: &[f64],
    wanted_of_faults: &[f64],
    shake: impl Fn(&Rig) -> Option<Vec<Trace>>,
) -> Option<(Vec<Trace>, Vec<Shares>, Vec<Shares>)> {
    // A millionth of the spring's force moves nothing, and gives the force per strength.
    for law in &mut rig.hidden {
        law.strength *= 1e-9;
    }
    let mut traces = shake(rig)?;
    if !rig.hidden.is_empty() {
        for round in 0..=MAX_ROUNDS {
            let factors: Vec<f64> = (0..rig.hidden.len())
                .map(|law| wanted_of_laws[law] / law_share(rig, law, &traces))
                .collect();
            if factors.iter().any(|f| !f.is_finite()) || round == MAX_ROUNDS {
                return None;
            }
            if factors.iter().all(|f| (f - 1.0).abs() < NEAR) {
                break;
            }
            for (law, factor) in rig.hidden.iter_mut().zip(&factors) {
                // Past the first round the motion answers the law, so steps are held back.
                law.strength *= if round == 0 {
                    *factor
                } else {
                    factor.clamp(0.3, 3.0)
                };
            }
            traces = shake(rig)?;
        }
    }
    for (faulty, wanted) in faults.iter_mut().zip(wanted_of_faults) {
        faulty.strength *= 1e-6;
        for _ in 0..6 {
            let share = rms(&errors(rig, faulty, &traces)) / force_size(rig, faulty.axis, &traces);
            faulty.strength *= wanted / share;
        }
        if !faulty.strength.is_finite() {
            return None;
        }
    }
    let of_laws = (0..rig.hidden.len()).map(|law| {
        let axis = rig.hidden[law].axis;
        let force: Vec<Vec<f64>> = traces.iter().map(|t| t.hidden[law][axis].clone()).collect();
        shares(rig, axis, &force, &traces)
    });
    let of_laws = of_laws.collect();
    let of_faults = faults
        .iter()
        .map(|f| shares(rig, f.axis, &errors(rig, f, &traces), &traces))
        .collect();
    Some((traces, of_laws, of_faults))
}

fn errors(rig: &Rig, faulty: &Faulty, traces: &[Trace]) -> Vec<Vec<f64>> {
    let inertia = rig.chains[faulty.axis].inertia[1];
    traces.iter().map(|t| error(faulty, t, inertia)).collect()
}

fn force_size(rig: &Rig, axis: usize, traces: &[Trace]) -> f64 {
    let forces: Vec<Vec<f64>> = traces
        .iter()
        .map(|t| t.restoring_force(rig, axis))
        .collect();
    rms(&forces)
}

fn law_share(rig: &Rig, law: usize, traces: &[Trace]) -> f64 {
    let axis = rig.hidden[law].axis;
    rms(traces.iter().map(|t| &t.hidden[law][axis])) / force_size(rig, axis, traces)
}

/// The whole share, and what is left of the force after least squares against the base's linear
/// columns.
fn shares(rig: &Rig, axis: usize, force: &[Vec<f64>], traces: &[Trace]) -> Shares {
    const EVERY: usize = 4;
    let base = &rig.base;
    let rows: Vec<([f64; 5], f64)> = traces
        .iter()
        .zip(force)
        .flat_map(|(trace, force)| trace.joint.iter().zip(force).step_by(EVERY))
        .map(|(joint, force)| {
            let [[x, v], [turn, spin]] = *joint;
            let [own, own_v] = joint[axis];
            let present = |value: f64| f64::from(u8::from(value != 0.0));
            let touches = |u: f64, gap: f64| f64::from(u8::from(u.abs() >= gap));
            let columns = [
                own * present(base.spring[axis]),
                own_v * present(base.damper[axis]),
                dead_zone(own, base.gap[axis]) * present(base.contact[axis]),
                v * turn * touches(x, base.gap[0]) * present(base.coupling[0]),
                spin * x * touches(turn, base.gap[1]) * present(base.coupling[1]),
            ];
            (columns, *force)
        })
        .collect();
    let columns = DMatrix::from_fn(rows.len(), 5, |row, column| rows[row].0[column]);
    let force_rows = DVector::from_fn(rows.len(), |row, _| rows[row].1);
    // Columns of very different units: scaled to length one before the normal equations.
    let lengths: Vec<f64> = columns.column_iter().map(|c| c.norm()).collect();
    let scaled = DMatrix::from_fn(rows.len(), 5, |row, column| {
        columns[(row, column)]
            / if lengths[column] > 0.0 {
                lengths[column]
            } else {
                1.0
            }
    });
    let gram = scaled.tr_mul(&scaled) + DMatrix::identity(5, 5) * 1e-12;
    let values = gram
        .cholesky()
        .map(|c| c.solve(&scaled.tr_mul(&force_rows)))
        .unwrap_or_else(|| DVector::zeros(5));
    let left = &force_rows - scaled * values;
    let size = force_size(rig, axis, traces);
    Shares {
        whole: rms(force) / size,
        visible: left.norm() / (rows.len() as f64).sqrt() / size,
    }
}
