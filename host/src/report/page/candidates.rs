//! The candidates of a diagnosis: figures with intervals, and the force that each would add where
//! the model fails.

use super::asked::Asked;
use super::contents::{Candidate, Packed};
use super::samples;
use super::version::Version;
use super::words;
use crate::diagnose::{Diagnosis, Ranked};
use crate::model::effects::is_correction;
use crate::model::time_history::{TimeHistory, add_forces};
use crate::report::axis_history;
use crate::signal::motion::{self, Motion, low_pass};
use crate::study::series::{at_right_angles, take_out};
use crate::text::error::Result;
use jointwatch_shared::effect::Entry;

/// As many candidates are drawn.
const MOST: usize = 8;

/// What the page says of the candidates, and their forces along one record.
pub(super) struct Candidates {
    /// In words and figures.
    pub(super) listed: Vec<Candidate>,
    /// The record that the forces are drawn along.
    record: Option<usize>,
    /// Per candidate the axis and its force there.
    forces: Vec<Option<(usize, Vec<f64>)>>,
}

impl Candidates {
    /// The candidates' forces on one axis of one record, at the rows that are kept.
    pub(super) fn packed(&self, record: usize, axis: usize, kept: &[usize]) -> Vec<Option<Packed>> {
        if self.record != Some(record) {
            return Vec::new();
        }
        let packed = |force: &Option<(usize, Vec<f64>)>| match force {
            Some((own, force)) if *own == axis => Some(samples::packed(force, kept)),
            _ => None,
        };
        self.forces.iter().map(packed).collect()
    }
}

/// The best candidates of the diagnosis, where there is one.
pub(super) fn gather(asked: &Asked<'_>, version: &Version<'_>) -> Result<Candidates> {
    let Some(diagnosis) = asked.diagnosis else {
        return Ok(Candidates {
            listed: Vec::new(),
            record: None,
            forces: Vec::new(),
        });
    };
    let ranked = &diagnosis.ranked[..diagnosis.ranked.len().min(MOST)];
    let axes: Vec<&str> = asked.study.axes.iter().map(|a| a.name.as_str()).collect();
    let listed = ranked.iter().map(|r| in_words(r, diagnosis, &axes));
    let judged = version.judged();
    let wanted = ranked
        .first()
        .and_then(|r| axes.iter().position(|a| *a == r.axis));
    let moves = |record: usize| {
        let figures = &version.comparison.records[record].axes;
        let at_rest = |axis: usize| figures.get(axes[axis]).is_some_and(|f| f.at_rest);
        asked.study.records[record].role == judged && !at_rest(wanted.unwrap_or(0))
    };
    let record = (0..asked.study.records.len()).find(|r| moves(*r));
    let forces = match record {
        None => vec![None; ranked.len()],
        Some(record) => {
            let study = version.model.corrected(asked.study)?;
            let motion = motion::motion(
                &study,
                record,
                &study.records[record],
                &version.model.filters,
            )?;
            let histories = &version.histories[record];
            let forces = ranked.iter();
            forces
                .map(|r| force(r, version, &axes, &motion, histories))
                .collect()
        }
    };
    Ok(Candidates {
        listed: listed.collect(),
        record,
        forces,
    })
}

fn in_words(ranked: &Ranked, diagnosis: &Diagnosis, axes: &[&str]) -> Candidate {
    let about = Entry::named(ranked.effect.split('*').next().unwrap_or_default()).map(|e| e.about);
    let [least, most] = ranked.error_drop_interval;
    // The scatter of the blocks, about the error that is drawn: that of all rows together.
    let spread = (most / least.max(f64::MIN_POSITIVE)).sqrt();
    let (as_good, worse) = diagnosis.equivalents(ranked);
    let owned = |names: Vec<&str>| names.into_iter().map(str::to_owned).collect();
    Candidate {
        name: format!("{}@{}", ranked.effect, ranked.axis),
        title: about.map_or("", |a| a.title).into(),
        axis: axes.iter().position(|a| *a == ranked.axis),
        found: diagnosis.has_found(ranked),
        error_before: ranked.error_before,
        error_after: ranked.error_after,
        interval: [ranked.error_after / spread, ranked.error_after * spread],
        as_good: owned(as_good),
        worse: owned(worse),
        experiment: ranked.separating_experiment.clone(),
        values: words::values(about.as_ref(), &ranked.parameters),
    }
}

/// What a candidate's force has that a constant, a spring and a damper have not, on its axis and in
/// the common band; none for a correction of an instrument and for one on both axes.
fn force(
    ranked: &Ranked,
    version: &Version<'_>,
    axes: &[&str],
    motion: &Motion,
    histories: &[axis_history::AxisHistory],
) -> Option<(usize, Vec<f64>)> {
    let axis = axes.iter().position(|a| *a == ranked.axis)?;
    if is_correction(&ranked.effect) {
        return None;
    }
    let law = ranked.as_a_term().in_si(&version.model.axes).ok()?;
    let states: Vec<&[f64]> = motion.states.iter().map(Vec::as_slice).collect();
    let mut forces = vec![vec![0.0; motion.rows()]; axes.len()];
    let along = TimeHistory::of_states(&states, 1.0 / motion.sample_rate_hz);
    let along = along.with_inputs(&motion.inputs).after(&motion.before);
    add_forces(&[law], &along, &mut forces);
    let mut force = low_pass(&forces[axis], &version.model.filters.band);
    let history = &histories[axis];
    if force.len() < history.measured.len() || !force.iter().all(|f| f.is_finite()) {
        return None;
    }
    force.truncate(history.measured.len());
    let constant = vec![1.0; force.len()];
    remove(
        &mut force,
        &[&constant, &history.displacement, &history.velocity],
    );
    Some((axis, force))
}

/// Takes out of a series what a sum of others can explain.
fn remove(series: &mut [f64], others: &[&[f64]]) {
    let basis = at_right_angles(others, 1e-12);
    basis.iter().for_each(|own| take_out(series, own));
}

#[cfg(test)]
mod tests {
    use super::remove;

    #[test]
    fn what_a_spring_and_a_damper_take_up_is_gone_and_the_rest_stays() {
        let time: Vec<f64> = (0..1_000)
            .map(|i| 0.01 * std::f64::consts::TAU * f64::from(i))
            .collect();
        let sine: Vec<f64> = time.iter().map(|t| t.sin()).collect();
        let cosine: Vec<f64> = time.iter().map(|t| t.cos()).collect();
        let third: Vec<f64> = time.iter().map(|t| (3.0 * t).sin()).collect();
        let mixed = sine.iter().zip(&cosine).zip(&third);
        let mut mixed: Vec<f64> = mixed
            .map(|((s, c), t)| 5.0 + 2.0 * s - 3.0 * c + t)
            .collect();
        remove(&mut mixed, &[&[1.0; 1_000], &sine, &sine, &cosine]);
        let worst = mixed.iter().zip(&third).map(|(m, t)| (m - t).abs());
        assert!(worst.fold(0.0, f64::max) < 1e-9);
    }
}
