//! The three filters of a study: first derivative, second derivative and the low-pass of the common
//! band.

use super::band::{WIDEST, common_band_hz, state_band_hz};
use super::design::{Ideal, design, taps_for, transition_for};
use super::fir::{quantise, to_f64};
use crate::signal::motion::motions;
use crate::study::Study;
use crate::text::error::{Error, Result};
use crate::text::table::{hertz, rounded};
use jointwatch_shared::wire::rig::{MAX_BAND_TAPS, MAX_TAPS, Taps};
use serde::{Deserialize, Serialize};

/// The states' band is at least this many times the common band, so that a force law sees the
/// corners it makes.
const STATES_OVER_COMMON: f64 = 2.0;
/// What the filters take of a record is told from a tenth of its rows on.
const MUCH_LOST: f64 = 0.1;
/// A filter falls from its pass band to zero over this share of it, when the taps allow.
const TRANSITION_WIDTH: f64 = 0.75;
/// The common band's low-pass is made longer where it would fall to zero over more than this share
/// of the band.
const WIDEST_FALL: f64 = 1.25;
/// Fewest taps of a filter.
const SHORTEST: usize = 9;
/// Part of the way of an axis that the filters keep.
const KEPT_MOTION: f64 = 0.25;
/// A fall to so many times the band lets more noise in than it keeps out.
const FAR_FALL: f64 = 5.0;

/// The three filters of a study: what the host applies with zero phase and the device with a delay
/// of half their length.
///
/// The taps are those that integers times a power of two can hold, so host and device filter with
/// the same numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Filters {
    /// Sample rate of the study, Hz.
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
    /// Whether the study has no time: then nothing is filtered, and no frequency here means
    /// anything.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub quasi_static: bool,
    /// Why these bands, for the user to read; one sentence without a full stop.
    pub reason: String,
}

impl Filters {
    /// Chooses the bands (unless the study states `band_hz`) and designs the filters for the
    /// study's sample rate.
    ///
    /// Each filter falls to zero over three quarters of its pass band, or over what [`MAX_TAPS`]
    /// taps need where that is more; for the common band the reason says so then. The common
    /// band takes up to [`MAX_BAND_TAPS`] where with [`MAX_TAPS`] the fall would be wider than
    /// one and a quarter bands, and where it has to be shut by the end of the states' band.
    /// Accuracy: [`design`].
    ///
    /// # Errors
    /// When the stated band does not fit below half the sample rate, or a record is shorter than
    /// the filters.
    pub fn design(study: &Study) -> Result<Self> {
        if study.quasi_static {
            return Ok(Self::of_rows(study.sample_rate_hz));
        }
        let shortest = study.records.iter().map(|r| r.rows).min();
        let mut longest = longest_for(shortest.unwrap_or(usize::MAX));
        loop {
            let filters = Self::of_at_most(study, longest)?;
            if longest == SHORTEST || filters.keep_the_motion(study) {
                return Ok(filters);
            }
            longest = odd(longest / 2);
        }
    }

    /// Whether the ends that they cost leave a quarter of the way that every axis goes: a ramp
    /// before a rest, or the first swings of a decay, may be all of it.
    fn keep_the_motion(&self, study: &Study) -> bool {
        let ends = (self.velocity.len() + self.band.len()) / 2;
        let way = |part: &[f64]| -> f64 { part.windows(2).map(|w| (w[1] - w[0]).abs()).sum() };
        (0..study.axes.len()).all(|axis| {
            let displacements = study.records.iter();
            let displacements = displacements.map(|r| r.axes[axis].relative_displacement());
            let ways = displacements.map(|displacement| {
                let kept = ends..displacement.len().saturating_sub(ends);
                [displacement.get(kept).unwrap_or_default(), &displacement].map(way)
            });
            let [kept, logged] =
                ways.fold([0.0; 2], |[a, b], [kept, logged]| [a + kept, b + logged]);
            kept >= KEPT_MOTION * logged
        })
    }

    /// The same with no filter of more than `longest` taps.
    fn of_at_most(study: &Study, longest: usize) -> Result<Self> {
        let rate = study.sample_rate_hz;
        let most = WIDEST * rate;
        if let Some(stated) = study.band_hz
            && stated > most
        {
            return Err(Error::data(format!(
                "{}: band_hz = {stated} is too wide for a sample rate of {rate} Hz, which allows {}; try a lower \
                 band_hz or leave it out",
                study.path.display(),
                hertz(most)
            )));
        }
        let noise_limited_hz = state_band_hz(study);
        let mut filters = Self::differentiators(rate, noise_limited_hz, longest)?;
        let mut reason;
        match study.band_hz {
            Some(stated) => {
                filters.band_hz = stated;
                reason = format!("band {} Hz as study.toml states", short(stated));
            }
            None => {
                filters.band_hz =
                    common_band_hz(study, &motions(study, &filters)?, noise_limited_hz);
                reason = format!(
                    "band {} Hz, which holds 99.9 % of the restoring force's power that stands out of its noise",
                    short(filters.band_hz)
                );
            }
        }
        let band_hz = filters.band_hz;
        let wanted_hz = (STATES_OVER_COMMON * band_hz).min(most);
        let common = Edges::of_band(band_hz, wanted_hz.max(noise_limited_hz), rate, longest);
        if common.widened {
            reason += &format!(
                " (falling to zero at {} Hz, as steeply as {} taps allow)",
                short(common.stop_hz),
                common.taps
            );
            if common.stop_hz > FAR_FALL * band_hz {
                reason += &format!(
                    ", which lets noise in: time = {{ …, resample_hz = {} }} has enough rows for this motion",
                    rounded_up(rate * TRANSITION_WIDTH * band_hz / (common.stop_hz - band_hz))
                );
            }
        }
        if wanted_hz > noise_limited_hz {
            filters = Self::differentiators(rate, wanted_hz, longest)?;
            filters.band_hz = band_hz;
            reason += &format!(
                "; states up to {} Hz as that band needs, although the displacement is below its noise floor above {} Hz",
                short(wanted_hz),
                short(noise_limited_hz)
            );
        } else {
            reason += &format!(
                "; states up to {} Hz: above that the displacement is below its noise floor, or the sample rate is the limit",
                short(noise_limited_hz)
            );
        }
        filters.band = common.filter(Ideal::LowPass, rate)?;
        let lost = filters.half_length() + filters.band.len() / 2;
        let shortest = study.records.iter().map(|r| r.rows).min().unwrap_or(0);
        if 2.0 * lost as f64 > MUCH_LOST * shortest as f64 {
            reason += &format!("; the filters take {lost} rows at either end of every record");
        }
        filters.reason = reason;
        Ok(filters)
    }

    /// Both differentiators, with a low-pass that changes nothing.
    fn differentiators(rate: f64, pass_hz: f64, longest: usize) -> Result<Self> {
        let edges = Edges::new(pass_hz, rate, longest);
        Ok(Self {
            sample_rate_hz: rate,
            band_hz: pass_hz,
            state_band_hz: pass_hz,
            velocity: edges.filter(Ideal::FirstDerivative, rate)?,
            acceleration: edges.filter(Ideal::SecondDerivative, rate)?,
            band: vec![1.0],
            quasi_static: false,
            reason: String::new(),
        })
    }

    /// For a study without time: differences from row to row, and nothing is low-passed.
    fn of_rows(rate: f64) -> Self {
        Self {
            sample_rate_hz: rate,
            band_hz: 0.5 * rate,
            state_band_hz: 0.5 * rate,
            velocity: vec![0.5 * rate, 0.0, -0.5 * rate],
            acceleration: vec![rate * rate, -2.0 * rate * rate, rate * rate],
            band: vec![1.0],
            quasi_static: true,
            reason: "the logs have no time: rows are compared as they are, and velocity stands for the direction of travel".into(),
        }
    }

    /// The filters for two given bands: the same numbers as [`Filters::design`] gives when it
    /// chooses these bands for records that are long enough for every filter.
    ///
    /// # Errors
    /// When a band does not fit below half the sample rate.
    pub fn for_bands(sample_rate_hz: f64, band_hz: f64, state_band_hz: f64) -> Result<Self> {
        let mut filters = Self::differentiators(sample_rate_hz, state_band_hz, MAX_BAND_TAPS)?;
        filters.band_hz = band_hz;
        filters.band = Edges::of_band(band_hz, state_band_hz, sample_rate_hz, MAX_BAND_TAPS)
            .filter(Ideal::LowPass, sample_rate_hz)?;
        Ok(filters)
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
        let bands = [
            ("band_hz", self.band_hz),
            ("state_band_hz", self.state_band_hz),
        ];
        for (name, band) in bands {
            if !positive(band) || band > 0.5 * self.sample_rate_hz {
                return Err(format!(
                    "its {name} is {band} at a sample rate of {} Hz",
                    self.sample_rate_hz
                ));
            }
        }
        let all = [
            ("velocity", &self.velocity, MAX_TAPS),
            ("acceleration", &self.acceleration, MAX_TAPS),
            ("band", &self.band, MAX_BAND_TAPS),
        ];
        for (name, taps, most) in all {
            let length = taps.len();
            if length.is_multiple_of(2) || length > most || taps.iter().any(|tap| !tap.is_finite())
            {
                return Err(format!(
                    "its {name} filter is not an odd number of up to {most} finite taps"
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

    /// Velocity, acceleration and band filter with integer taps, as the device's rig block holds
    /// them.
    ///
    /// # Errors
    /// When the taps were changed to something the device cannot hold.
    pub fn taps(&self) -> Result<(Taps, Taps, Taps<MAX_BAND_TAPS>)> {
        Ok((
            quantise(&self.velocity)?,
            quantise(&self.acceleration)?,
            quantise(&self.band)?,
        ))
    }
}

/// The next number of 1, 2 or 5 times a power of ten.
fn rounded_up(number: f64) -> f64 {
    let ten = 10_f64.powf(number.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0];
    let next = steps.iter().find(|step| **step * ten >= number);
    next.map_or(number, |step| step * ten)
}

/// Three digits are enough to judge a band by.
fn short(hz: f64) -> String {
    if hz >= 100.0 {
        format!("{hz:.0}")
    } else {
        rounded(hz)
    }
}

/// The most taps of each filter of a record of so many rows: a quarter, so that half of a short
/// record is left behind the filters. Odd.
fn longest_for(rows: usize) -> usize {
    odd((rows / 4).min(MAX_BAND_TAPS))
}

/// The odd number of taps at or below `taps`, at least [`SHORTEST`].
fn odd(taps: usize) -> usize {
    let most = taps.max(SHORTEST);
    most - usize::from(most.is_multiple_of(2))
}

/// Edges and length of one filter.
struct Edges {
    pass_hz: f64,
    stop_hz: f64,
    taps: usize,
    /// The fall is wider than wanted.
    widened: bool,
}

impl Edges {
    /// A differentiator of at most `longest` taps.
    fn new(pass_hz: f64, rate: f64, longest: usize) -> Self {
        let most = longest.min(MAX_TAPS);
        Self::with_taps(pass_hz, TRANSITION_WIDTH * pass_hz, rate, most)
    }

    /// The low-pass of the common band. It is shut where the states' band ends: beyond, an
    /// acceleration that is derived falls behind the force.
    fn of_band(pass_hz: f64, state_band_hz: f64, rate: f64, longest: usize) -> Self {
        let most = longest.min(MAX_BAND_TAPS);
        let usual = TRANSITION_WIDTH * pass_hz;
        let room = state_band_hz - pass_hz;
        if room < usual && room > 0.0 {
            return Self::with_taps(pass_hz, room, rate, most);
        }
        let short = Self::with_taps(pass_hz, usual, rate, most.min(MAX_TAPS));
        if short.stop_hz > (1.0 + WIDEST_FALL) * pass_hz {
            Self::with_taps(pass_hz, usual, rate, most)
        } else {
            short
        }
    }

    fn with_taps(pass_hz: f64, wanted: f64, rate: f64, most: usize) -> Self {
        let room = 0.5 * rate - pass_hz;
        let wanted = wanted.min(room);
        let taps = taps_for(wanted, rate).min(most);
        let fall = transition_for(taps, rate).max(wanted).min(room);
        Self {
            pass_hz,
            stop_hz: pass_hz + fall,
            taps,
            widened: fall > 1.01 * wanted,
        }
    }

    fn filter(&self, ideal: Ideal, rate: f64) -> Result<Vec<f64>> {
        let taps = design(ideal, rate, self.pass_hz, self.stop_hz, self.taps);
        Ok(to_f64(&quantise::<MAX_BAND_TAPS>(&taps)?))
    }
}
