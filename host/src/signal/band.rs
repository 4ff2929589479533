//! Which band a study's logs support: the common band of fits, and the wider band of the states.

use super::design::NARROWEST_DERIVATIVE;
use super::spectrum::{Accumulator, Spectrum};
use crate::study::{Channels, Study};

/// Rows per window of the spectra; a record shorter than this uses its own length.
const SEGMENT: usize = 4096;
/// The noise floor is read here, as shares of the sample rate: above any motion worth learning, below the last lines,
/// which an anti-aliasing filter takes down.
const FLOOR_FROM: f64 = 0.40;
/// See [`FLOOR_FROM`].
const FLOOR_TO: f64 = 0.48;
/// A line stands out of the noise when its density is this many times the floor.
const STANDS_OUT: f64 = 10.0;
/// Share of a signal's power above its floor that the common band keeps.
const KEPT: f64 = 0.99;
/// The states' band is at most this share of the sample rate: the differentiators need room to fall to zero.
const WIDEST: f64 = 0.36;

/// The two bands and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Bands {
    /// Common band of fits and error figures, Hz.
    pub band_hz: f64,
    /// Pass band of the differentiators, Hz.
    pub state_band_hz: f64,
    /// Where the numbers come from, one sentence without a full stop.
    pub reason: String,
}

/// Chooses the bands from the spectra of all records together.
pub fn choose(study: &Study) -> Bands {
    let rate = study.sample_rate_hz;
    let widest = WIDEST * rate;
    let mut band: f64 = 0.0;
    let mut drowned = f64::INFINITY;
    for axis in 0..study.axes.len() {
        let displacement = spectrum_of(study, axis, relative_displacement);
        let force = spectrum_of(study, axis, |c| c.force.clone());
        let velocity = Spectrum {
            resolution_hz: displacement.resolution_hz,
            density: derivative_density(&displacement),
        };
        band = band.max(power_edge(&velocity)).max(power_edge(&force));
        drowned = drowned.min(drowning_edge(&displacement));
    }
    let stated = study.band_hz;
    let band_hz = stated.unwrap_or(band).clamp(rate * 1e-3, widest);
    let state_band_hz = drowned.clamp(
        (2.0 * band_hz).max(NARROWEST_DERIVATIVE * rate).min(widest),
        widest,
    );
    Bands {
        band_hz,
        state_band_hz,
        reason: format!(
            "band {band_hz:.0} Hz {}, states to {state_band_hz:.0} Hz (the displacement drowns in its noise at {drowned:.0} Hz)",
            if stated.is_some() {
                "as study.toml states".to_owned()
            } else {
                format!(
                    "holds {:.0} % of the power of force and velocity",
                    100.0 * KEPT
                )
            }
        ),
    }
}

/// First minus second, or the first alone.
pub(crate) fn relative_displacement(channels: &Channels) -> Vec<f64> {
    match &channels.displacement_second {
        None => channels.displacement_first.clone(),
        Some(second) => channels
            .displacement_first
            .iter()
            .zip(second)
            .map(|(a, b)| a - b)
            .collect(),
    }
}

fn spectrum_of(study: &Study, axis: usize, channel: impl Fn(&Channels) -> Vec<f64>) -> Spectrum {
    let shortest = study.records.iter().map(|r| r.rows).min().unwrap_or(0);
    let mut sum = Accumulator::new(study.sample_rate_hz, SEGMENT.min(shortest));
    for record in &study.records {
        sum.add(&channel(&record.axes[axis]));
    }
    sum.finish()
}

fn derivative_density(spectrum: &Spectrum) -> Vec<f64> {
    spectrum
        .density
        .iter()
        .enumerate()
        .map(|(i, d)| d * (2.0 * std::f64::consts::PI * i as f64 * spectrum.resolution_hz).powi(2))
        .collect()
}

/// Median density where only noise is expected.
fn floor_of(spectrum: &Spectrum) -> f64 {
    let lines = spectrum.density.len().saturating_sub(1) as f64 * 2.0;
    let from = (FLOOR_FROM * lines) as usize;
    let to = ((FLOOR_TO * lines) as usize).max(from);
    let mut densities = spectrum.density.get(from..to).unwrap_or_default().to_vec();
    densities.sort_by(f64::total_cmp);
    densities.get(densities.len() / 2).copied().unwrap_or(0.0)
}

/// The frequency below which [`KEPT`] of the power above the floor lies.
fn power_edge(spectrum: &Spectrum) -> f64 {
    let floor = floor_of(spectrum);
    let above: Vec<f64> = spectrum
        .density
        .iter()
        .map(|d| (d - floor).max(0.0))
        .collect();
    let total: f64 = above.iter().sum();
    let mut sum = 0.0;
    for (i, d) in above.iter().enumerate() {
        sum += d;
        if sum >= KEPT * total {
            return i as f64 * spectrum.resolution_hz;
        }
    }
    0.0
}

/// The highest frequency at which the density, averaged over nine lines, stands out of its floor.
fn drowning_edge(spectrum: &Spectrum) -> f64 {
    let limit = STANDS_OUT * floor_of(spectrum);
    spectrum
        .density
        .windows(9)
        .rposition(|lines| lines.iter().sum::<f64>() > 9.0 * limit)
        .map_or(0.0, |i| (i + 4) as f64 * spectrum.resolution_hz)
}
