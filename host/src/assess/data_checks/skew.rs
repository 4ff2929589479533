//! Skew between accelerometer and encoder of one body: the phase of their cross-spectrum grows with
//! frequency.
//!
//! The acceleration is the second derivative of the position, whatever the joint does; so what
//! their phases differ by is the instruments' doing. A force channel that is late is another
//! matter: the search names it `time_delay`.

use super::finding::Finding;
use crate::signal::fir::apply;
use crate::signal::motion::Filters;
use crate::study::Study;
use crate::study::series::mean;
use realfft::RealFftPlanner;
use realfft::num_complex::Complex;
use std::f64::consts::{PI, TAU};

/// Rows of a window of the cross-spectrum; windows overlap by half.
const SEGMENT: usize = 2048;
/// Squared coherence from which on a frequency counts.
const COHERENT: f64 = 0.95;
/// Frequencies that must count.
const MIN_LINES: usize = 8;
/// A skew of less than this part of a sample is no fault of a log.
const MIN_SAMPLES: f64 = 0.3;
/// Phase at the frequency where most of the acceleration is that is worth a word, rad: the inertia
/// force is then wrong by this part of itself, a quarter of a turn from where it should be, which
/// is where damping is.
const WORTH_A_WORD: f64 = 0.02;
/// Phase from which on a diagnosis means nothing: a twentieth of the inertia force is read as
/// damping.
const SERIOUS: f64 = 0.05;
/// Factor within which the two must agree, and the part of their difference that a delay may leave:
/// where the base of a shaken joint moves as well, amplitudes differ as phases do.
const ALIKE: f64 = 1.3;
const MOST_LEFT: f64 = 0.25;
/// Standard errors by which a skew must be beyond chance.
const SURE: f64 = 6.0;

/// The skew of an axis's accelerometer against the encoder of its body, over all records.
pub(super) fn check(study: &Study, index: usize, filters: &Filters) -> Option<Finding> {
    let rate = study.sample_rate_hz;
    let mut cross = Cross::new();
    for record in &study.records {
        let logged = &record.axes[index];
        // A single displacement is the body's own.
        let single = logged.displacement_second.is_none();
        let single = single.then_some(&logged.displacement_first);
        let body = logged.body_position.as_ref().or(single);
        let (Some(acceleration), Some(body)) = (&logged.acceleration, body) else {
            continue;
        };
        if body.len() < filters.acceleration.len() + SEGMENT {
            continue;
        }
        let half = filters.acceleration.len() / 2;
        let derived = apply(body, &filters.acceleration);
        cross.add(&acceleration[half..half + derived.len()], &derived);
    }
    let delay = cross.delay(rate, filters.state_band_hz)?;
    let phase = delay.seconds.abs() * TAU * delay.centre_hz;
    let samples = delay.seconds * rate;
    if samples.abs() < MIN_SAMPLES
        || phase < WORTH_A_WORD
        || delay.seconds.abs() < SURE * delay.error_s
    {
        return None;
    }
    Some(Finding {
        sentence: format!(
            "all records: the acceleration channel of {} is {:.3} ms ({:.1} samples) {} than its position says; shift it in the \
             logger, or leave `acceleration` out of study.toml so that it is derived from the position",
            study.axes[index].name,
            1e3 * delay.seconds.abs(),
            samples.abs(),
            if samples > 0.0 { "later" } else { "earlier" }
        ),
        serious: phase >= SERIOUS,
        spikes: None,
    })
}

/// Auto- and cross-spectra of two channels over several records.
struct Cross {
    first: Vec<f64>,
    second: Vec<f64>,
    both: Vec<Complex<f64>>,
    windows: usize,
}

/// What the cross-spectrum says at a frequency.
struct Line {
    hz: f64,
    /// The first channel over the second; its phase is by how much it is later, rad.
    ratio: Complex<f64>,
    /// Of the first channel.
    power: f64,
    weight: f64,
}

/// By how much the first channel is later than the second.
struct Delay {
    seconds: f64,
    error_s: f64,
    /// Where most of what both hold lies, Hz.
    centre_hz: f64,
}

impl Cross {
    fn new() -> Self {
        let lines = SEGMENT / 2 + 1;
        Self {
            first: vec![0.0; lines],
            second: vec![0.0; lines],
            both: vec![Complex::default(); lines],
            windows: 0,
        }
    }

    fn add(&mut self, first: &[f64], second: &[f64]) {
        let transform = RealFftPlanner::<f64>::new().plan_fft_forward(SEGMENT);
        let spectrum = |part: &[f64]| {
            let mean = mean(part);
            let window = |row: usize| 0.5 - 0.5 * (2.0 * PI * row as f64 / SEGMENT as f64).cos();
            let rows = part.iter().enumerate();
            let mut input: Vec<f64> = rows.map(|(row, v)| (v - mean) * window(row)).collect();
            let mut output = transform.make_output_vec();
            // Both have the lengths that the transform asks for.
            transform
                .process(&mut input, &mut output)
                .is_ok()
                .then_some(output)
        };
        let windows = first.windows(SEGMENT).zip(second.windows(SEGMENT));
        for (a, b) in windows.step_by(SEGMENT / 2) {
            let (Some(a), Some(b)) = (spectrum(a), spectrum(b)) else {
                return;
            };
            for (line, (a, b)) in a.iter().zip(&b).enumerate() {
                self.first[line] += a.norm_sqr();
                self.second[line] += b.norm_sqr();
                self.both[line] += a.conj() * b;
            }
            self.windows += 1;
        }
    }

    /// The slope of the phase over frequency, by least squares weighted with what each frequency
    /// holds.
    fn delay(&self, rate: f64, band_hz: f64) -> Option<Delay> {
        // With one window everything is coherent.
        if self.windows < 4 {
            return None;
        }
        let resolution = rate / SEGMENT as f64;
        // A displacement may count against the acceleration.
        let sign = self.both.iter().map(|both| both.re).sum::<f64>().signum();
        let mut lines = Vec::new();
        for (line, both) in self.both.iter().enumerate().skip(2) {
            let hz = line as f64 * resolution;
            let power = self.first[line] * self.second[line];
            if hz <= 0.8 * band_hz && power > 0.0 && both.norm_sqr() >= COHERENT * power {
                // Phases of a skew of a few samples stay within half a turn.
                let noise = (1.0 - both.norm_sqr() / power).max(1e-12);
                lines.push(Line {
                    hz,
                    ratio: both * sign / self.second[line],
                    power: self.first[line],
                    weight: self.first[line].sqrt() / noise,
                });
            }
        }
        if lines.len() < MIN_LINES {
            return None;
        }
        let sum = |f: &dyn Fn(&Line) -> f64| lines.iter().map(f).sum::<f64>();
        let curvature = sum(&|l| l.weight * l.hz * l.hz);
        let slope = sum(&|l| l.weight * l.hz * l.ratio.arg()) / curvature;
        let scatter =
            sum(&|l| l.weight * (l.ratio.arg() - slope * l.hz).powi(2)) / lines.len() as f64;
        let gain = sum(&|l| l.weight * l.ratio.norm()) / sum(&|l| l.weight);
        let left = |slope: f64| {
            sum(&|l| l.weight * (l.ratio - Complex::from_polar(gain, slope * l.hz)).norm_sqr())
        };
        let is_delay = (1.0 / ALIKE..ALIKE).contains(&gain) && left(slope) < MOST_LEFT * left(0.0);
        if !is_delay {
            return None;
        }
        let power = sum(&|l| l.power);
        Some(Delay {
            seconds: slope / TAU,
            error_s: (scatter / curvature).sqrt() / TAU,
            centre_hz: sum(&|l| l.power * l.hz) / power,
        })
    }
}
