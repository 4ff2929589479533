//! A record as the models see it: states, acceleration and applied force, row by row.
//!
//! The equation of motion of the body that carries the inertia `m`, with a known spring `k` and damper `c` from the body
//! (position `b`) to ground, an applied force `F` and the joint, is the paper's Eq. (8) (Eq. (9) for a rotation):
//!
//! | convention | equation of motion | restoring force |
//! | --- | --- | --- |
//! | `force_minus_inertia` (the joint opposes) | `m·a = F − k·b − c·ḃ − r` | `r = (F − k·b − c·ḃ) − m·a` |
//! | `inertia_minus_force` (the joint pulls) | `m·a = F − k·b − c·ḃ + r` | `r = m·a − (F − k·b − c·ḃ)` |
//!
//! Spring and damper act on the body in the same way in both, so both take them off the applied force first.

use crate::error::{Error, Result};
use crate::signal::band::{self, relative_displacement};
use crate::signal::design::{Ideal, design, taps_for, transition_for};
use crate::signal::fir::{apply, quantise, to_f64};
use crate::study::{Axis, Channels, Convention, Record, Study};
use jointwatch_shared::rig::{MAX_TAPS, Taps};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// A record after differentiation: what a model's inputs and its output are made of.
///
/// All series have the same length; the rows at both ends where a filter has no full support are gone.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Which record of the study.
    pub record: usize,
    /// The record's row that became row 0 here.
    pub first_row: usize,
    /// Samples per second.
    pub sample_rate_hz: f64,
    /// [x, ẋ] or [x, ẋ, φ, φ̇]: relative displacement and velocity of each axis, SI, wide-band.
    pub states: Vec<Vec<f64>>,
    /// Absolute acceleration of the body, per axis.
    pub acceleration: Vec<Vec<f64>>,
    /// Applied force per axis, known ground spring and damper already subtracted (Eqs. 8, 9).
    pub force: Vec<Vec<f64>>,
}

impl Motion {
    /// Rows.
    pub fn rows(&self) -> usize {
        self.force[0].len()
    }

    /// Restoring force of one axis in N or N·m, wide-band: `F − m·a` or `m·a − F`, as the convention says.
    ///
    /// `inertia` in kg or kg·m²; with 0 the force channel (or its negative) already is the restoring force.
    pub fn restoring_force(&self, axis: usize, inertia: f64, convention: Convention) -> Vec<f64> {
        let sign = match convention {
            Convention::ForceMinusInertia => 1.0,
            Convention::InertiaMinusForce => -1.0,
        };
        self.force[axis]
            .iter()
            .zip(&self.acceleration[axis])
            .map(|(force, acceleration)| sign * (force - inertia * acceleration))
            .collect()
    }
}

/// The three filters of a study: what the host applies with zero phase and the device with a delay of half their length.
///
/// The taps are those that integers times a power of two can hold, so host and device filter with the same numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Filters {
    /// Samples per second.
    pub sample_rate_hz: f64,
    /// Pass band of `band`, Hz: what is compared with a model is low-passed to this on both sides.
    pub band_hz: f64,
    /// Pass band of the differentiators, Hz.
    pub state_band_hz: f64,
    /// First derivative, 1/s; antisymmetric, as long as `acceleration`.
    pub velocity: Vec<f64>,
    /// Second derivative, 1/s²; symmetric, sum 0.
    pub acceleration: Vec<f64>,
    /// Low-pass; symmetric, sum 1.
    pub band: Vec<f64>,
    /// Why these bands, for the user to read; one sentence without a full stop.
    pub reason: String,
}

impl Filters {
    /// Chooses the bands (unless the study states `band_hz`) and designs the filters for the study's sample rate.
    ///
    /// The differentiators fall from their pass band to zero over half that band, the low-pass over half of its own, or
    /// over what [`MAX_TAPS`] taps need where that is more; the reason says so then.
    ///
    /// # Errors
    /// When the stated band does not fit below half the sample rate.
    pub fn design(study: &Study) -> Result<Self> {
        let rate = study.sample_rate_hz;
        let narrowest = transition_for(MAX_TAPS, rate);
        if let Some(stated) = study.band_hz
            && stated + narrowest > 0.5 * rate
        {
            return Err(Error::data(format!(
                "{}: band_hz = {stated} does not fit a sample rate of {rate} Hz, where at most {:.0} Hz can be filtered; \
                 try a lower band_hz or leave it out",
                study.path.display(),
                0.5 * rate - narrowest
            )));
        }
        let bands = band::choose(study);
        let mut filters = Self::for_bands(rate, bands.band_hz, bands.state_band_hz)?;
        filters.reason = match filters.reason.as_str() {
            "" => bands.reason,
            widened => format!("{}; {widened}", bands.reason),
        };
        Ok(filters)
    }

    /// The filters for two given bands: the same numbers wherever they are asked for.
    ///
    /// # Errors
    /// When a band does not fit below half the sample rate.
    pub fn for_bands(sample_rate_hz: f64, band_hz: f64, state_band_hz: f64) -> Result<Self> {
        let states = Edges::new(state_band_hz, sample_rate_hz);
        let common = Edges::new(band_hz, sample_rate_hz);
        let reason = if common.widened {
            format!(
                "the low-pass passes {:.3} Hz and is shut only from {:.3} Hz, the narrowest that {MAX_TAPS} taps allow at \
                 {sample_rate_hz} Hz",
                common.pass_hz, common.stop_hz
            )
        } else {
            String::new()
        };
        Ok(Self {
            sample_rate_hz,
            band_hz,
            state_band_hz,
            velocity: states.filter(Ideal::FirstDerivative, sample_rate_hz)?,
            acceleration: states.filter(Ideal::SecondDerivative, sample_rate_hz)?,
            band: common.filter(Ideal::LowPass, sample_rate_hz)?,
            reason,
        })
    }

    /// What is wrong with filters that come from a file, if anything.
    ///
    /// # Errors
    /// One clause that names the number.
    pub fn check(&self) -> std::result::Result<(), String> {
        let positive = |value: f64| value.is_finite() && value > 0.0;
        if !positive(self.sample_rate_hz) {
            return Err(format!("its sample rate is {} Hz", self.sample_rate_hz));
        }
        for (name, band) in [
            ("band_hz", self.band_hz),
            ("state_band_hz", self.state_band_hz),
        ] {
            if !positive(band) || band > 0.5 * self.sample_rate_hz {
                return Err(format!(
                    "its {name} is {band} at a sample rate of {} Hz",
                    self.sample_rate_hz
                ));
            }
        }
        let all = [
            ("velocity", &self.velocity),
            ("acceleration", &self.acceleration),
            ("band", &self.band),
        ];
        for (name, taps) in all {
            let length = taps.len();
            if length % 2 == 0 || length > MAX_TAPS || taps.iter().any(|tap| !tap.is_finite()) {
                return Err(format!(
                    "its {name} filter is not an odd number of up to {MAX_TAPS} finite taps"
                ));
            }
        }
        if self.velocity.len() != self.acceleration.len() {
            return Err("its velocity and acceleration filters differ in length".into());
        }
        Ok(())
    }

    /// Rows that a motion loses at each end of a record; also the device's delay in samples.
    pub fn half_length(&self) -> usize {
        self.velocity.len() / 2
    }

    /// Velocity, acceleration and band filter with integer taps, as the device's rig block holds them.
    ///
    /// # Errors
    /// When the taps were changed to something the device cannot hold.
    pub fn taps(&self) -> Result<[Taps; 3]> {
        Ok([
            quantise(&self.velocity)?,
            quantise(&self.acceleration)?,
            quantise(&self.band)?,
        ])
    }
}

/// Edges and length of one filter.
struct Edges {
    pass_hz: f64,
    stop_hz: f64,
    taps: usize,
    /// The transition is wider than half the pass band.
    widened: bool,
}

impl Edges {
    fn new(pass_hz: f64, rate: f64) -> Self {
        let room = 0.5 * rate - pass_hz;
        let wanted = (0.5 * pass_hz).min(room);
        let taps = taps_for(wanted, rate).min(MAX_TAPS);
        Self {
            pass_hz,
            stop_hz: pass_hz + transition_for(taps, rate).max(wanted).min(room),
            taps,
            widened: taps == MAX_TAPS && transition_for(taps, rate) > wanted,
        }
    }

    fn filter(&self, ideal: Ideal, rate: f64) -> Result<Vec<f64>> {
        let taps = design(ideal, rate, self.pass_hz, self.stop_hz, self.taps);
        Ok(to_f64(&quantise(&taps)?))
    }
}

/// Turns every record of the study into a motion, in the study's order.
///
/// # Errors
/// A record with no row left between the ends that the filters cost.
pub fn motions(study: &Study, filters: &Filters) -> Result<Vec<Motion>> {
    study
        .records
        .par_iter()
        .enumerate()
        .map(|(index, record)| motion(study, index, record, filters))
        .collect()
}

fn motion(study: &Study, index: usize, record: &Record, filters: &Filters) -> Result<Motion> {
    let half = filters.half_length();
    let least = filters.velocity.len() + filters.band.len() - 1;
    if record.rows < least {
        return Err(Error::data(format!(
            "{}: {} rows are too few for filters that need {least}; try a longer record or a higher band_hz",
            record.file, record.rows
        )));
    }
    let mut motion = Motion {
        record: index,
        first_row: half,
        sample_rate_hz: study.sample_rate_hz,
        states: Vec::new(),
        acceleration: Vec::new(),
        force: Vec::new(),
    };
    for (axis, channels) in study.axes.iter().zip(&record.axes) {
        let inner = |series: &[f64]| series[half..series.len() - half].to_vec();
        let relative = relative_displacement(channels);
        let velocity = match &channels.velocity {
            Some(logged) => inner(logged),
            None => apply(&relative, &filters.velocity),
        };
        let body = channels.body_position.as_deref().unwrap_or(&relative);
        // The logged acceleration is used where there is one, because the device uses it as well.
        motion.acceleration.push(match &channels.acceleration {
            Some(logged) => inner(logged),
            None => apply(body, &filters.acceleration),
        });
        motion.force.push(joint_and_inertia(
            axis,
            channels,
            body,
            &filters.velocity,
            half,
        ));
        motion.states.push(inner(&relative));
        motion.states.push(velocity);
    }
    Ok(motion)
}

/// The applied force less what the known spring and damper to ground take of it.
fn joint_and_inertia(
    axis: &Axis,
    channels: &Channels,
    body: &[f64],
    velocity: &[f64],
    half: usize,
) -> Vec<f64> {
    let mut force = channels.force[half..channels.force.len() - half].to_vec();
    if axis.ground_stiffness != 0.0 {
        for (f, b) in force.iter_mut().zip(&body[half..]) {
            *f -= axis.ground_stiffness * b;
        }
    }
    if axis.ground_damping != 0.0 {
        for (f, v) in force.iter_mut().zip(apply(body, velocity)) {
            *f -= axis.ground_damping * v;
        }
    }
    force
}

/// Low-passes a series with zero phase; `taps.len() − 1` rows are lost, half of them at each end.
pub fn low_pass(series: &[f64], taps: &[f64]) -> Vec<f64> {
    apply(series, taps)
}
