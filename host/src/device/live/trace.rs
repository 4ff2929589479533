//! The forces of the last seconds, thinned so that peaks stay: a plot costs the same at 10 samples
//! a second and at 5000.

use serde::Serialize;
use std::collections::VecDeque;

/// Seconds that a plot goes back.
pub const SHOWN_S: f64 = 6.0;
/// Seconds of one column.
pub const COLUMN_S: f64 = 0.01;
/// Columns of a whole plot.
const COLUMNS: u64 = 600;
/// Seconds between two points of the loop at least, and the most points: the last two seconds.
const LOOP_S: f64 = 0.002;
const LOOP_POINTS: usize = 1000;
/// Samples for which displacements are kept, until the force that belongs to them comes; the
/// longest filters have fewer taps.
const WAITING: usize = 4096;

/// One sample's forces, N or N·m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forces {
    /// Restoring force from the equation of motion.
    pub measured: f64,
    /// Restoring force from the model.
    pub predicted: f64,
    /// Measured minus predicted restoring force.
    pub residual: f64,
}

/// The least and the largest of a time of [`COLUMN_S`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Column {
    /// Its place in time, in units of [`COLUMN_S`] since the device's restart.
    pub at: u64,
    /// Of the measured force, N or N·m.
    pub measured: [f64; 2],
    /// Of the predicted force.
    pub predicted: [f64; 2],
    /// Of the residual, measured minus predicted.
    pub residual: [f64; 2],
}

/// A point of the loop of force over displacement.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LoopPoint {
    /// Counted from the first point that was seen.
    pub number: u64,
    /// Relative displacement, counts of the encoder.
    pub counts: f64,
    /// Restoring force from the equation of motion, N or N·m.
    pub measured: f64,
    /// Restoring force from the model, N or N·m.
    pub predicted: f64,
}

/// What is drawn of one axis.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    columns: VecDeque<Column>,
    points: VecDeque<LoopPoint>,
    /// Displacements by sample, which came before the forces that belong to them.
    waiting: VecDeque<(u64, f64)>,
    last: Option<Forces>,
    looped_at_s: f64,
    numbered: u64,
}

impl Trace {
    /// The columns of the last [`SHOWN_S`], the oldest first.
    pub fn columns(&self) -> impl DoubleEndedIterator<Item = &Column> + Clone {
        self.columns.iter()
    }

    /// The loop's last points, the oldest first.
    pub fn points(&self) -> impl DoubleEndedIterator<Item = &LoopPoint> + Clone {
        self.points.iter()
    }

    /// The forces that came last.
    pub fn last(&self) -> Option<Forces> {
        self.last
    }

    /// The displacement that was read with a sample.
    pub(super) fn displaced(&mut self, sample: u64, counts: f64) {
        if self.waiting.len() == WAITING {
            self.waiting.pop_front();
        }
        self.waiting.push_back((sample, counts));
    }

    /// The forces of a sample, `rate_hz` samples a second; `delay` samples lie between their
    /// instant and the sample's own.
    pub(super) fn add(&mut self, sample: u64, delay: u64, rate_hz: f64, forces: Forces) {
        let of = sample.saturating_sub(delay);
        let time_s = of as f64 / rate_hz;
        self.last = Some(forces);
        // `as` saturates: a number that no device comes to draws nothing, and breaks nothing.
        let at = (time_s / COLUMN_S) as u64;
        let Forces {
            measured,
            predicted,
            residual,
        } = forces;
        match self.columns.back_mut() {
            Some(last) if last.at == at => {
                widen(&mut last.measured, measured);
                widen(&mut last.predicted, predicted);
                widen(&mut last.residual, residual);
            }
            Some(last) if last.at > at => {}
            _ => self.columns.push_back(Column {
                at,
                measured: [measured; 2],
                predicted: [predicted; 2],
                residual: [residual; 2],
            }),
        }
        let oldest = at.saturating_sub(COLUMNS);
        while self.columns.front().is_some_and(|c| c.at < oldest) {
            self.columns.pop_front();
        }
        if let Some(counts) = self.displacement_at(of)
            && (time_s - self.looped_at_s > 0.999 * LOOP_S || self.points.is_empty())
        {
            self.looped_at_s = time_s;
            if self.points.len() == LOOP_POINTS {
                self.points.pop_front();
            }
            self.points.push_back(LoopPoint {
                number: self.numbered,
                counts,
                measured,
                predicted,
            });
            self.numbered += 1;
        }
    }

    /// The displacement at a sample, between the two that were read around it; forgets what came
    /// before.
    fn displacement_at(&mut self, sample: u64) -> Option<f64> {
        while self.waiting.get(1).is_some_and(|(at, _)| *at <= sample) {
            self.waiting.pop_front();
        }
        let (before, one) = *self.waiting.front()?;
        if before >= sample {
            return (before == sample).then_some(one);
        }
        let (after, other) = *self.waiting.get(1)?;
        let part = (sample - before) as f64 / (after - before) as f64;
        Some(one + part * (other - one))
    }
}

fn widen(range: &mut [f64; 2], value: f64) {
    *range = [range[0].min(value), range[1].max(value)];
}

#[cfg(test)]
mod tests {
    use super::*;

    fn forces(measured: f64) -> Forces {
        Forces {
            measured,
            predicted: 0.5 * measured,
            residual: 0.5 * measured,
        }
    }

    #[test]
    fn a_minute_of_5_khz_leaves_a_plots_worth_and_every_peak() {
        let mut trace = Trace::default();
        for sample in 0..300_000_u64 {
            trace.displaced(sample, sample as f64);
            let spike = if sample == 299_000 { 77.0 } else { 1.0 };
            trace.add(sample, 20, 5000.0, forces(spike));
        }
        assert!((600..=601).contains(&trace.columns().count()));
        let peaks = trace.columns().filter(|c| c.measured[1] == 77.0).count();
        assert_eq!(peaks, 1);
        assert_eq!(trace.points().count(), LOOP_POINTS);
        // Forces stand over the displacement of their own instant.
        let first = trace.points().next().unwrap();
        assert_eq!(first.counts.fract(), 0.0);
        assert_eq!(first.counts as u64 % 10, 0);
        assert!(trace.waiting.len() < 30);
    }

    #[test]
    fn every_fifth_sample_is_drawn_over_the_displacement_between_two() {
        let mut trace = Trace::default();
        for sample in (0..1000_u64).step_by(5) {
            trace.displaced(sample, 2.0 * sample as f64);
            if sample >= 23 {
                trace.add(sample, 23, 1000.0, forces(sample as f64));
            }
        }
        for point in trace.points() {
            let sample = point.measured - 23.0;
            assert!((point.counts - 2.0 * sample).abs() < 1e-9, "{point:?}");
        }
        assert!(trace.points().count() > 150);
    }

    #[test]
    fn numbers_that_no_device_comes_to_break_nothing() {
        let mut trace = Trace::default();
        for sample in [u64::MAX, 0, 7, u64::MAX - 1, 1 << 40] {
            trace.displaced(sample, f64::from(i32::MIN));
            trace.add(sample, 20, 1e-300, forces(f64::MAX));
            trace.add(sample, u64::MAX, 5000.0, forces(-f64::MAX));
        }
        assert!(trace.columns().count() <= 601);
    }
}
