//! Waves over the displacement that are too short for a scan of starting values: ripple of a motor
//! or a gear, balls of a screw, of which the travel holds dozens.

use super::columns::Records;
use super::unknowns::ShapeUnknown;
use crate::model::effects::AxisEffect;
use jointwatch_shared::units::Dimension;
use realfft::RealFftPlanner;

/// Places in the travel at which a residual is summed: more than five in the shortest wave.
const PLACES: usize = 1 << 14;
/// Wave numbers in the width of a peak, so that a start lies well inside its valley.
const POINTS_PER_PEAK: usize = 4;
/// Waves that pass from row to row are whole ones within this.
const WHOLE: f64 = 0.1;
/// Pitches that are told at most.
const MAX_PITCHES: usize = 3;

impl Records<'_> {
    /// Whether a wave of this length, m or rad, over the displacement looks like a constant along
    /// most of the way, since a whole one passes from row to row there, as at a constant speed.
    /// Where no low-pass keeps faster ones out, whether more than half a wave does.
    pub(crate) fn is_aliased(&self, axis: usize, length: f64) -> bool {
        let near = if self.taps.len() > 1 { WHOLE } else { 0.5 };
        let all = self
            .histories
            .iter()
            .map(|history| history.displacement(axis));
        let steps = all.flat_map(|x| x.windows(2).map(|pair| (pair[1] - pair[0]).abs()));
        let [way, alias] = steps.fold([0.0; 2], |[way, alias], step| {
            let waves = step / length;
            let is_alias = waves >= 0.5 && (waves - waves.round()).abs() <= near;
            [way + step, alias + if is_alias { step } else { 0.0 }]
        });
        alias > 0.5 * way
    }

    /// The pitches, m or rad, at which a residual repeats most strongly over the displacement of an
    /// effect's axis, the strongest first: those that are shorter than the starts of its pitch.
    /// The wave of a friction turns its sign with the velocity.
    ///
    /// `residual` has both axes, as columns have.
    pub(crate) fn pitches_in(
        &self,
        residual: &[f64],
        bound: &AxisEffect,
        pitch: &ShapeUnknown,
    ) -> Vec<f64> {
        let rows = self.rows_per_axis();
        let own = bound.axis * rows..(bound.axis + 1) * rows;
        let of_friction = bound.entry.parameters().iter();
        let of_friction = of_friction
            .map(|p| p.dimension)
            .any(|d| d == Dimension::VELOCITY);
        let along = self.of_motion(bound.axis, None, |at| at.displacement);
        let along = &along[own.clone()];
        let sign = self.of_motion(bound.axis, None, |at| {
            if of_friction {
                at.velocity.signum()
            } else {
                1.0
            }
        });
        let least = along.iter().copied().fold(f64::INFINITY, f64::min);
        let travel = along
            .iter()
            .copied()
            .fold(0.0, |most: f64, x| most.max(x - least));
        let starts = pitch.shape.starts.iter().copied();
        let longest = pitch.reference * starts.fold(f64::INFINITY, f64::min);
        let shortest = pitch.reference * pitch.shape.least;
        if travel <= longest {
            return Vec::new();
        }
        let mut sums = vec![0.0; POINTS_PER_PEAK * PLACES];
        let pairs = residual[own.clone()].iter().zip(&sign[own]).zip(along);
        for ((left, sign), x) in pairs {
            let place = (x - least) / travel * (PLACES - 1) as f64;
            sums[place.round() as usize] += left * sign;
        }
        let transform = RealFftPlanner::new().plan_fft_forward(sums.len());
        let mut spectrum = transform.make_output_vec();
        if transform.process(&mut sums, &mut spectrum).is_err() {
            return Vec::new();
        }
        let power: Vec<f64> = spectrum.iter().map(|c| c.norm_sqr()).collect();
        let pitch_of = |number: usize| {
            (POINTS_PER_PEAK * PLACES) as f64 / (PLACES - 1) as f64 * travel / number as f64
        };
        let is_peak = |at: &usize| {
            let near = *at - POINTS_PER_PEAK..=*at + POINTS_PER_PEAK;
            let pitch = pitch_of(*at);
            shortest < pitch && pitch < longest && power[near].iter().all(|p| *p <= power[*at])
        };
        let numbers = POINTS_PER_PEAK..power.len() - POINTS_PER_PEAK;
        let mut peaks: Vec<usize> = numbers.filter(is_peak).collect();
        peaks.sort_by(|a, b| power[*b].total_cmp(&power[*a]));
        let pitches = peaks.into_iter().map(pitch_of);
        let told = pitches.filter(|pitch| !self.is_aliased(bound.axis, *pitch));
        told.take(MAX_PITCHES).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::identify::Prepared;
    use crate::study::{MemoryLog, Study};

    #[test]
    fn a_wave_that_passes_faster_than_the_rows_is_an_alias() {
        // Ten steps of a millimetre for every one of a tenth.
        let step = |row: usize| if row.is_multiple_of(11) { 1e-4 } else { 1e-3 };
        let mut x = vec![0.0];
        for row in 0..3000 {
            let way = if row / 500 % 2 == 0 { 1.0 } else { -1.0 };
            x.push(x[row] + way * step(row));
        }
        let force = x.iter().map(|x| 2e4 * x).collect();
        let log = MemoryLog {
            name: "log".into(),
            columns: vec![("x".into(), x), ("F".into(), force)],
        };
        let told = |time: &str| {
            let text = format!(
                "{time}\n[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = \"x\"\nforce = \"F\"\n\
                 inertia = 0\n[[record]]\nfile = \"log\"\nrole = \"train\"\n"
            );
            let study = Study::of_memory("memory", &text, std::slice::from_ref(&log)).unwrap();
            let prepared = Prepared::new(&study).unwrap();
            let motions = prepared.training(&study);
            let records = Records::new(&study.axes, &motions, &prepared.filters.band);
            [3e-3, 1.9e-3, 1.5e-3, 1e-3].map(|length| !records.is_aliased(0, length))
        };
        assert_eq!(told("time = \"none\""), [true, false, false, false]);
        // Behind a low-pass only what looks like a constant is an alias.
        assert_eq!(
            told("sample_rate_hz = 1000\nband_hz = 50"),
            [true, true, true, false]
        );
    }
}
