//! Lines of the mains: a narrow line near 50 or 60 Hz or a harmonic that force or acceleration have
//! and the displacement has not.
//!
//! Never serious: what a line in the force does to a model is an effect of the library, which the
//! search names.

use super::channel::{Kind, channels};
use super::finding::Finding;
use crate::signal::spectrum::{Accumulator, Spectrum, window_for};
use crate::study::Study;
use crate::text::table::short;

/// Windows of this length: lines half a hertz wide stand apart from tones of the drive a hertz
/// away.
const WINDOW_S: f64 = 4.0;
/// Mains frequencies, Hz, and how far from them a line may lie, as a part of them.
const MAINS_HZ: [f64; 2] = [50.0, 60.0];
const OFF: f64 = 0.005;
/// Harmonics that are looked at.
const HARMONICS: usize = 4;
/// Between these distances from a line, Hz, nothing stands as high: a joint that is shaken by tones
/// has lines everywhere.
const NEIGHBOURS_HZ: [f64; 2] = [1.5, 8.0];
/// Density over the highest neighbour's that makes a line.
const STANDS_OUT: f64 = 20.0;
/// Density over the highest neighbour's from which on the displacement has the line too.
const MOVES_TOO: f64 = 4.0;
/// Share of the channel's RMS below which a line is not worth a word.
const MIN_SHARE: f64 = 0.002;

/// Lines in the channels of an axis, over all records together.
pub(super) fn check(study: &Study, index: usize) -> Vec<Finding> {
    let axis = &study.axes[index];
    let rate = study.sample_rate_hz;
    let segment = window_for(
        study.records.iter().map(|r| r.rows),
        (WINDOW_S * rate) as usize,
    );
    if (segment as f64) < 0.5 * WINDOW_S * rate {
        return Vec::new();
    }
    let names = match study.records.first() {
        Some(record) => channels(axis, &record.axes[index])
            .into_iter()
            .map(|c| (c.name, c.kind, c.unit))
            .collect::<Vec<_>>(),
        None => Vec::new(),
    };
    let mut spectra: Vec<Spectrum> = Vec::new();
    for place in 0..names.len() {
        let mut sum = Accumulator::new(rate, segment);
        for record in &study.records {
            if let Some(channel) = channels(axis, &record.axes[index]).get(place) {
                sum.add(channel.series);
            }
        }
        spectra.push(sum.finish());
    }
    let moves = |hz: f64| {
        let mut positions = names.iter().zip(&spectra);
        positions.any(|((_, kind, _), spectrum)| {
            matches!(kind, Kind::Relative | Kind::Position)
                && line(spectrum, hz).is_some_and(|line| line.over > MOVES_TOO)
        })
    };
    let mut found = Vec::new();
    for ((name, kind, unit), spectrum) in names.iter().zip(&spectra) {
        if !matches!(kind, Kind::Force | Kind::Acceleration) {
            continue;
        }
        let whole = spectrum.power(0.0, 0.5 * rate);
        for mains in MAINS_HZ {
            let orders = (1..=HARMONICS).map(|order| mains * order as f64);
            let lines: Vec<SpectralLine> = orders
                .filter_map(|hz| line(spectrum, hz))
                .filter(|l| l.over > STANDS_OUT && !moves(l.hz))
                .collect();
            let power: f64 = lines.iter().map(|l| l.power).sum();
            // Harmonics alone may be a motor's; the mains begin with their own line.
            let has_first = lines.first().is_some_and(|l| l.hz < 1.5 * mains);
            if !has_first || power < MIN_SHARE * MIN_SHARE * whole {
                continue;
            }
            let at: Vec<String> = lines.iter().map(|l| format!("{:.2}", l.hz)).collect();
            found.push(Finding {
                sentence: format!(
                    "all records: {name} has mains hum at {} Hz, {} {unit} RMS, which the displacement does not have; screen \
                     its cable and earth it at one end",
                    at.join(", "),
                    short(power.sqrt())
                ),
                serious: false,
                spikes: None,
            });
        }
    }
    found
}

struct SpectralLine {
    hz: f64,
    /// Mean square about the line, in the channel's unit squared.
    power: f64,
    /// Density over that of the highest neighbour.
    over: f64,
}

/// The highest density near a frequency, beside its neighbours.
fn line(spectrum: &Spectrum, near: f64) -> Option<SpectralLine> {
    let resolution = spectrum.resolution_hz;
    let within = |distance: [f64; 2]| {
        let lines = spectrum.density.iter().enumerate();
        lines.filter(move |(i, _)| {
            let off = (*i as f64 * resolution - near).abs();
            (distance[0]..=distance[1]).contains(&off)
        })
    };
    let off = (OFF * near).max(resolution);
    let (top, density) = within([0.0, off]).max_by(|a, b| a.1.total_cmp(b.1))?;
    // Both sides must be there: the end of the spectrum is no neighbour.
    if near + NEIGHBOURS_HZ[1] > (spectrum.density.len() - 1) as f64 * resolution {
        return None;
    }
    let highest = within(NEIGHBOURS_HZ).map(|(_, d)| *d).fold(0.0, f64::max);
    let hz = top as f64 * resolution;
    Some(SpectralLine {
        hz,
        power: spectrum.power(hz - 2.5 * resolution, hz + 2.5 * resolution),
        over: density / highest.max(f64::MIN_POSITIVE),
    })
}
