//! A simulated motion held against the measured one: errors in the states, and octave by octave.

use super::run::{MeasuredMotion, Simulated};
use crate::fit::errors::AT_REST_BELOW;
use crate::model::file::ModelFile;
use crate::signal::spectrum::Spectrum;
use crate::study::Study;
use crate::study::series::spread;
use serde::Serialize;
use std::collections::BTreeMap;

/// Rows per window of the spectra at least, where the record has them; else a quarter of the
/// record.
const SEGMENT: usize = 4096;
/// A band is told when its measured RMS is at least this part of the axis's.
const HEARD: f64 = 1e-3;
/// Nominal centres of the octave bands of IEC 61260-1, from 10^(3·−13/10) kHz on.
const OCTAVES_HZ: [f64; 17] = [
    0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 31.5, 63.0, 125.0, 250.0, 500.0, 1000.0, 2000.0,
    4000.0, 8000.0,
];

/// How one axis moved.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AxisResponse {
    /// 100·⟨(x−x̂)²⟩/var x: mean over the simulated rows, variance of the whole measured record,
    /// percent.
    pub displacement_nmse_percent: f64,
    /// The same of the velocity.
    pub velocity_nmse_percent: f64,
    /// Largest |x−x̂|, m or rad.
    pub peak_error: f64,
    /// RMS of the measured displacement about its mean, m or rad.
    pub rms_displacement: f64,
    /// Part of the simulated rows in which this axis's simulated displacement or velocity is
    /// outside the training range, 0 to 1.
    pub outside_range: f64,
    /// Seconds from the beginning of the file at which that happens first.
    pub first_outside_s: Option<f64>,
    /// The same part of the measured motion's rows.
    pub measured_outside_range: f64,
    /// True when the axis rests in this record, so that errors relative to its motion say nothing.
    #[serde(rename = "rests")]
    pub at_rest: bool,
    /// Octave bands of the displacement; empty when the axis rests, when the simulation diverged
    /// in the first half, and with restarts, whose jumps would be in every band.
    pub spectrum: Vec<Band>,
}

/// One octave of a displacement.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Band {
    /// Nominal middle frequency, Hz.
    pub center_hz: f64,
    /// RMS of the measured displacement in the band, m or rad.
    pub measured: f64,
    /// RMS of the simulated one.
    pub simulated: f64,
    /// Simulated over measured: 1 when the amplitude is right, whatever the phase.
    pub ratio: f64,
    /// RMS of the difference over that of the measured: 0 only when phase is right as well.
    pub relative_error: f64,
}

/// An axis on which errors in force pile up into drift.
#[derive(Clone, Debug, PartialEq)]
pub struct Drift {
    /// Name of the axis.
    pub axis: String,
    /// What holds the axis, by the best straight line through the model: N/m or N·m/rad.
    pub stiffness: f64,
    /// RMS error of the model's force at the measured states, N or N·m.
    pub force_error: f64,
    /// RMS of the displacement about its mean, m or rad.
    pub displacement: f64,
}

/// 100·⟨(x−x̂)²⟩/var x, percent, over the rows that were simulated.
fn nmse_percent(measured: &[f64], simulated: &[f64]) -> f64 {
    let (mut sum, mut rows) = (0.0, 0.0);
    for (x, y) in measured
        .iter()
        .zip(simulated)
        .filter(|(_, y)| y.is_finite())
    {
        sum += (x - y) * (x - y);
        rows += 1.0;
    }
    if sum == 0.0 {
        return 0.0;
    }
    // JSON has no infinity: an error against no motion at all is as large as a number gets.
    (100.0 * sum / rows / spread(measured).powi(2)).min(f64::MAX)
}

/// Figures of every axis, by name.
pub(super) fn figures(
    study: &Study,
    model: &ModelFile,
    motion: &MeasuredMotion,
    simulated: &Simulated,
    largest: &[f64],
) -> BTreeMap<String, AxisResponse> {
    let axis = |index: usize| {
        let [d, v] = [2 * index, 2 * index + 1];
        let (measured, moved) = (&motion.states, &simulated.states);
        let ranges = &model.base.inputs()[d..=v];
        let outside = |states: &[Vec<f64>], row: usize| {
            ranges
                .iter()
                .zip(&states[d..=v])
                .any(|(range, series)| range.normalise(series[row]).abs() > 1.0 + 1e-9)
        };
        let rows = motion.rows();
        // A row that was not simulated holds no number, and is not outside of anything.
        let left: Vec<usize> = (0..rows).filter(|&row| outside(moved, row)).collect();
        let measured_left = (0..rows).filter(|&row| outside(measured, row)).count();
        let went = moved[d].iter().filter(|x| x.is_finite()).count();
        let errors = measured[d].iter().zip(&moved[d]).map(|(x, y)| x - y);
        let rms_displacement = spread(&measured[d]);
        let at_rest = rms_displacement < AT_REST_BELOW * largest[index];
        let figures = AxisResponse {
            displacement_nmse_percent: nmse_percent(&measured[d], &moved[d]),
            velocity_nmse_percent: nmse_percent(&measured[v], &moved[v]),
            // `max` passes over what is no number.
            peak_error: errors.fold(0.0, |most: f64, e| most.max(e.abs())),
            rms_displacement,
            outside_range: left.len() as f64 / went.max(1) as f64,
            first_outside_s: left
                .first()
                .map(|&row| motion.start_s + row as f64 / motion.sample_rate_hz),
            measured_outside_range: measured_left as f64 / rows as f64,
            at_rest,
            spectrum: if at_rest || simulated.restarted {
                Vec::new()
            } else {
                octaves(
                    &measured[d],
                    &moved[d],
                    motion.sample_rate_hz,
                    model.filters.band_hz,
                )
            },
        };
        (study.axes[index].name.clone(), figures)
    };
    (0..study.axes.len()).map(axis).collect()
}

/// Octave bands up to the common band, over the rows before a divergence if those are at least
/// half.
fn octaves(measured: &[f64], simulated: &[f64], rate_hz: f64, band_hz: f64) -> Vec<Band> {
    let rows = simulated.iter().take_while(|x| x.is_finite()).count();
    if 2 * rows < simulated.len() {
        return Vec::new();
    }
    let (measured, simulated) = (&measured[..rows], &simulated[..rows]);
    let difference: Vec<f64> = measured.iter().zip(simulated).map(|(a, b)| a - b).collect();
    let segment = SEGMENT.max(rows / 4).min(rows);
    let [all, moved, error] =
        [measured, simulated, &difference].map(|series| Spectrum::welch(series, rate_hz, segment));
    let resolution_hz = all.resolution_hz;
    let heard = HEARD * spread(measured);
    let mut bands = Vec::new();
    for (at, center_hz) in OCTAVES_HZ.into_iter().enumerate() {
        let exact_hz = 1e3 * 10_f64.powf(0.3 * (at as f64 - 13.0));
        let edge = 10_f64.powf(0.15);
        let (from, to) = (exact_hz / edge, exact_hz * edge);
        // Below, a band would hold a single line or the mean; above, the model was not fitted.
        if from < 1.5 * resolution_hz || exact_hz > band_hz {
            continue;
        }
        let [measured, simulated, error] =
            [&all, &moved, &error].map(|spectrum| spectrum.power(from, to).sqrt());
        if measured > heard {
            bands.push(Band {
                center_hz,
                measured,
                simulated,
                ratio: simulated / measured,
                relative_error: error / measured,
            });
        }
    }
    bands
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn sine(frequency_hz: f64, amplitude: f64, phase: f64) -> Vec<f64> {
        (0..20_000)
            .map(|i| amplitude * (TAU * frequency_hz * f64::from(i) / 1000.0 + phase).sin())
            .collect()
    }

    #[test]
    fn an_octave_tells_amplitude_from_phase() {
        let measured: Vec<f64> = sine(8.0, 1.0, 0.0)
            .iter()
            .zip(sine(31.0, 0.1, 0.0))
            .map(|(a, b)| a + b)
            .collect();
        // Right at 8 Hz; at 31 Hz twice as large and a quarter of a period late.
        let simulated: Vec<f64> = sine(8.0, 1.0, 0.0)
            .iter()
            .zip(sine(31.0, 0.2, -TAU / 4.0))
            .map(|(a, b)| a + b)
            .collect();
        let bands = octaves(&measured, &simulated, 1000.0, 100.0);
        let at = |hz: f64| bands.iter().find(|b| b.center_hz == hz).unwrap();
        assert!((at(8.0).ratio - 1.0).abs() < 1e-3 && at(8.0).relative_error < 1e-3);
        assert!((at(8.0).measured - 0.5_f64.sqrt()).abs() < 1e-3);
        assert!((at(31.5).ratio - 2.0).abs() < 1e-3, "{}", at(31.5).ratio);
        let error = at(31.5).relative_error;
        assert!((error - 5_f64.sqrt()).abs() < 1e-3, "{error}");
        // Nothing is heard anywhere else, and nothing is told above the band.
        assert_eq!(bands.len(), 2);
        assert_eq!(octaves(&measured, &simulated, 1000.0, 20.0).len(), 1);
    }

    #[test]
    fn errors_are_counted_over_what_was_simulated_only() {
        let measured = [1.0, -1.0, 1.0, -1.0];
        let simulated = [1.0, -1.5, f64::NAN, f64::NAN];
        assert!((nmse_percent(&measured, &simulated) - 12.5).abs() < 1e-12);
        assert!(octaves(&measured, &[1.0, f64::NAN, 1.0, 1.0], 8.0, 4.0).is_empty());
        assert_eq!(nmse_percent(&[0.0; 4], &[1e-9; 4]), f64::MAX);
    }
}
