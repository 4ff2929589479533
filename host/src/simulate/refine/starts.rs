//! How exactly a measured start is known: the noise of the displacement, brought through the
//! filters that make states of it.

use crate::model::file::ModelFile;
use crate::signal::motion::Motion;
use crate::study::Study;

/// Variance of the fourth difference of white noise of variance 1.
const FOURTH: f64 = 70.0;
/// No state is known better than to this part of its RMS.
const EXACT: f64 = 1e-6;

/// Standard deviation of a measured start: positions of both axes, then velocities.
pub(super) fn deviations(study: &Study, model: &ModelFile, training: &[&Motion]) -> [f64; 4] {
    let mut deviations = [1.0; 4];
    for axis in 0..study.axes.len() {
        let logged = training.iter().map(|m| {
            let channels = &study.records[m.record].axes[axis];
            (channels.relative_displacement(), channels.velocity.as_ref())
        });
        let (mut displacement, mut velocity) = (0.0_f64, None::<f64>);
        for (series, logged) in logged {
            displacement = displacement.max(white(&series));
            velocity = logged.map_or(velocity, |v| Some(velocity.unwrap_or(0.0).max(white(v))));
        }
        let gain = |taps: &[f64]| taps.iter().map(|t| t * t).sum::<f64>().sqrt();
        let band = gain(&model.filters.band);
        let velocity = velocity.map_or(displacement * gain(&model.filters.velocity), |own| {
            own * band
        });
        let rms = |state: usize| {
            let series = || training.iter().flat_map(|m| &m.states[2 * axis + state]);
            (series().map(|v| v * v).sum::<f64>() / series().count().max(1) as f64).sqrt()
        };
        deviations[axis] = (displacement * band).max(EXACT * rms(0));
        deviations[axis + 2] = velocity.max(EXACT * rms(1));
    }
    deviations
}

/// RMS of the white noise in a series, from its fourth differences: what moves slowly leaves next
/// to nothing in them.
fn white(series: &[f64]) -> f64 {
    let fourth = series
        .windows(5)
        .map(|w| w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4]);
    let square: f64 = fourth.map(|d| d * d).sum();
    (square / FOURTH / series.len().saturating_sub(4).max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::white;
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn noise_is_told_from_motion() {
        let mut rng = StdRng::seed_from_u64(1);
        let motion = |row: usize| (row as f64 * 0.05).sin();
        let mut noise = || rng.random_range(-1.0..1.0) * 3e-4;
        let series: Vec<f64> = (0..4000).map(|row| motion(row) + noise()).collect();
        let wanted = 3e-4 / 3.0_f64.sqrt();
        assert!((white(&series) / wanted - 1.0).abs() < 0.1);
        let still: Vec<f64> = (0..4000).map(motion).collect();
        assert!(white(&still) < 1e-6);
    }
}
