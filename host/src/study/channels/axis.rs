//! The channels of an axis as a log gives them: sums, differences, and what is integrated.

use super::calibrated::Calibrated;
use super::integrate::{displacement_of, integral};
use crate::study::Channels;
use crate::study::plan::AxisPlan;

impl AxisPlan {
    /// The axis's channels of one log, each as `series` gives it in SI, and the optional columns
    /// that the log lacks.
    pub(crate) fn channels(
        &self,
        (rows, period_s): (usize, f64),
        series: impl Fn(&Calibrated) -> Option<Vec<f64>>,
    ) -> (Channels, Vec<String>) {
        let required = |c: &Calibrated| {
            series(c).expect("a column that is not optional was located before the log was read")
        };
        let mut absent = Vec::new();
        let mut force = vec![0.0; rows];
        for part in &self.force {
            match series(part) {
                Some(series) => force.iter_mut().zip(series).for_each(|(f, s)| *f += s),
                None => absent.push(part.column.clone()),
            }
        }
        let velocity = match self.velocity.as_slice() {
            [] => None,
            [one] => Some(required(one)),
            [first, second, ..] => {
                let mut difference = required(first);
                for (a, b) in difference.iter_mut().zip(required(second)) {
                    *a -= b;
                }
                Some(difference)
            }
        };
        let position = |channel: &Calibrated| match self.integrate_above_hz {
            None => required(channel),
            Some(hz) => displacement_of(&required(channel), period_s, hz),
        };
        let displacement = match (self.displacement.first(), &velocity) {
            (Some(first), _) => position(first),
            (None, velocity) => integral(velocity.as_deref().unwrap_or_default(), period_s),
        };
        let channels = Channels {
            displacement_first: displacement,
            displacement_second: self.displacement.get(1).map(position),
            velocity,
            body_position: self.body_position.as_ref().map(required),
            acceleration: self.acceleration.as_ref().map(required),
            force,
        };
        (channels, absent)
    }
}
