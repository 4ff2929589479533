//! How much of a missing effect a polynomial or a network follows already, without naming it.
//!
//! A polynomial is asked what it could make of the effect's force: the force, along the training
//! motion and in the common band, is fitted by the polynomial with the penalty that its own fit
//! had. A network's functions came out of its training and cannot be asked afresh, so its residual
//! is: a model that follows the part s of an effect by least squares leaves a residual on
//! whose effect's force the regression factor is 1 − s.

use super::answer::Absorbed;
use crate::diagnose::add::strengths;
use crate::fit::effects::columns::Records;
use crate::fit::identify::Prepared;
use crate::fit::least_squares::normal_equations;
use crate::fit::with_base::OnRecords;
use crate::model::effects::AxisEffect;
use crate::model::file::{Base, ModelFile};
use crate::signal::motion::Motion;
use crate::study::Study;
use crate::text::error::Result;
use faer::Mat;
use jointwatch_shared::effect::Subsystem;

/// The shares of effects with these values that the model's base follows; none for a physical
/// model.
pub(super) fn absorbed(
    study: &Study,
    prepared: &Prepared,
    model: &ModelFile,
    found: &[(AxisEffect, Vec<f64>)],
) -> Result<Vec<Absorbed>> {
    let found: Vec<_> = found
        .iter()
        .filter(|(bound, _)| bound.entry.subsystem != Subsystem::Sensor)
        .cloned()
        .collect();
    if found.is_empty() {
        return Ok(Vec::new());
    }
    let shares = match model.base {
        Base::None(_) => return Ok(Vec::new()),
        Base::Polynomial(_) => {
            let training = prepared.training(study);
            let ridge = strengths(prepared, study, model);
            OnRecords::new(&study.axes, &training, model)?.followed(&found, &ridge)?
        }
        Base::Network(_) => by_residual(study, prepared, model, &found)?,
    };
    let mut absorbed = Vec::new();
    for ((bound, _), shares) in found.iter().zip(shares) {
        for (axis, share) in study.axes.iter().zip(shares) {
            absorbed.extend(share.map(|share| Absorbed {
                effect: bound.effect(),
                axis: axis.name.clone(),
                share,
            }));
        }
    }
    Ok(absorbed)
}

/// Per effect and axis: 1 less the factor of the effect's force in the model's residual, all
/// effects side by side.
fn by_residual(
    study: &Study,
    prepared: &Prepared,
    model: &ModelFile,
    found: &[(AxisEffect, Vec<f64>)],
) -> Result<Vec<Vec<Option<f64>>>> {
    let training = prepared.training(study);
    let left: Vec<Motion> = training
        .iter()
        .map(|motion| {
            let mut left = (*motion).clone();
            let forces = left.force.iter_mut().zip(model.predict_motion(motion)?);
            for ((force, predicted), axis) in forces.zip(&study.axes) {
                let sign = axis.restoring_force.sign();
                let pairs = force.iter_mut().zip(predicted);
                pairs.for_each(|(f, p)| *f -= sign * p);
            }
            Ok(left)
        })
        .collect::<Result<_>>()?;
    let left: Vec<&Motion> = left.iter().collect();
    // The inertia is the model's, so that what is left of the restoring force is its residual.
    let mut axes = study.axes.clone();
    for (axis, mine) in axes.iter_mut().zip(&model.axes) {
        axis.inertia = Some(mine.inertia);
    }
    let records = Records::new(&axes, &left, &model.filters.band);
    let rows = records.rows_per_axis().max(1);
    let forces: Vec<Vec<f64>> = found
        .iter()
        .map(|(bound, values)| records.force(bound, values))
        .collect();
    let mut shares = vec![vec![None; axes.len()]; found.len()];
    for (axis, _) in axes.iter().enumerate() {
        let part = axis * rows..(axis + 1) * rows;
        let acting: Vec<usize> = (0..found.len())
            .filter(|&effect| forces[effect][part.clone()].iter().any(|f| *f != 0.0))
            .collect();
        if acting.is_empty() {
            continue;
        }
        // A constant beside them: shares are about the mean.
        let columns = acting.len() + 1;
        let design = Mat::from_fn(rows, columns, |row, c| {
            acting
                .get(c)
                .map_or(1.0, |&effect| forces[effect][part.start + row])
        });
        let residual = Mat::from_fn(rows, 1, |row, _| records.measured[part.start + row]);
        let gram = design.transpose() * &design;
        let cross = design.transpose() * &residual;
        let factors = normal_equations::solve(&gram, &cross)?.coefficients;
        for (c, effect) in acting.into_iter().enumerate() {
            shares[effect][axis] = Some((1.0 - factors[(c, 0)]).clamp(0.0, 1.0));
        }
    }
    Ok(shares)
}
