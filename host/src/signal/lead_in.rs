//! How the joint came to the first row of its record: what a law with memory remembers when a log
//! is cut out of a longer one.
//!
//! Nobody logged it, but what it left shows in the first seconds. The motion before is taken to be
//! one straight travel from rest. How far it went is found without a law of the joint: sliders and
//! relaxing springs of several sizes beside a smooth function of the states (a Prandtl–Ishlinskii
//! model) are fitted to the force, for every travel anew, and the travel that leaves least is kept.

use super::fir::{apply_every, thinning};
use crate::study::series::{dot, extent, peak};
use nalgebra::{DMatrix, DVector};

/// Displacements at which a slider slips, as parts of half the range of the displacement.
const SLIPS: [f64; 10] = [0.03, 0.06, 0.1, 0.16, 0.25, 0.35, 0.5, 0.63, 0.8, 1.0];
/// Times in which a spring relaxes, s.
const RELAXATIONS_S: [f64; 4] = [0.05, 0.2, 0.8, 3.0];
/// Rows that are looked at.
const MAX_ROWS: usize = 30_000;
/// Travels that are tried at a time.
const TRIED: usize = 9;
/// Memory, and a travel before the record, have to leave at most this part of the power of what is
/// left without: whatever is fitted takes away some of it, and of a law that these elements
/// describe badly any travel mends a little.
const LEFT: f64 = 0.5;
/// Rounds of trials, each between the neighbours of the best of the last.
const PASSES: usize = 3;
/// A joint stands still without a force where both are this part of their largest values.
const AT_REST: f64 = 0.05;
/// Rows from which the velocity at the beginning is read.
const FIRST_ROWS: usize = 4;
/// Samples of the travel, of the same number on every axis.
const SAMPLES: usize = 32;

/// What an axis did in a record.
pub(super) struct AxisRecord<'a> {
    /// Displacement in the records whose rows come straight before this one's; none where no
    /// record's do.
    pub(super) earlier: Vec<f64>,
    /// Displacement from the first logged row on.
    pub(super) displacement: &'a [f64],
    /// The row from which the others are known.
    pub(super) first_row: usize,
    /// Relative velocity, m/s or rad/s.
    pub(super) velocity: &'a [f64],
    /// Applied force, N or N·m.
    pub(super) force: &'a [f64],
    /// The same in the first logged row.
    pub(super) first_force: f64,
    /// Acceleration of the body.
    pub(super) acceleration: &'a [f64],
    pub(super) sample_rate_hz: f64,
    /// The low-pass that forces are compared behind.
    pub(super) band: &'a [f64],
}

/// An element with memory: a spring behind a slider, or one that relaxes.
#[derive(Clone, Copy)]
struct Element {
    slip: f64,
    keep: f64,
}

impl Element {
    /// Its stretch from the row `first` on, when it is stretched by `travel` before the first row.
    fn along(self, x: &[f64], first: usize, travel: f64) -> Vec<f64> {
        let mut stretch = travel.clamp(-self.slip, self.slip);
        let mut before = x.first().copied().unwrap_or(0.0);
        let step = |x: &f64| {
            let moved = stretch * self.keep + (x - before);
            stretch = moved.clamp(-self.slip, self.slip);
            before = *x;
            stretch
        };
        let mut all: Vec<f64> = x.iter().map(step).collect();
        all.drain(..first.min(all.len()));
        all
    }
}

impl AxisRecord<'_> {
    /// Displacement and velocity before the row `first_row`: those that were logged, and before
    /// them the records that this one continues, or else the travel by which the joint came.
    pub(super) fn before(&self) -> [Vec<f64>; 2] {
        let logged = &self.displacement[..self.first_row.min(self.displacement.len())];
        let Some(&first) = logged.first() else {
            return [Vec::new(), Vec::new()];
        };
        let came = if self.earlier.is_empty() {
            let travel = self.travel();
            let at = |k: usize| first - travel * (1.0 - k as f64 / SAMPLES as f64);
            (0..SAMPLES).map(at).collect()
        } else {
            self.earlier.clone()
        };
        let displacement = [&came, logged].concat();
        let rate = |row: usize| {
            let before = displacement[row.saturating_sub(1)];
            (displacement[row] - before) * self.sample_rate_hz
        };
        let velocity = (0..displacement.len()).map(rate).collect();
        [displacement, velocity]
    }

    /// Whether the joint stands still at the first logged row, and no force acts: then nothing in
    /// it is stretched.
    fn begins_at_rest(&self) -> bool {
        let rows = FIRST_ROWS.min(self.displacement.len() - 1);
        let moved = self.displacement[rows] - self.displacement[0];
        let velocity = moved * self.sample_rate_hz / rows.max(1) as f64;
        self.first_force.abs() <= AT_REST * peak(self.force)
            && velocity.abs() <= AT_REST * peak(self.velocity)
    }

    /// The travel from rest to the first row; 0 where the record does not say, or says that there
    /// was none.
    fn travel(&self) -> f64 {
        if self.begins_at_rest() {
            return 0.0;
        }
        let rows = self.force.len().min(MAX_ROWS);
        let x = &self.displacement[..(self.first_row + rows).min(self.displacement.len())];
        let [least, most] = extent(x.iter().copied());
        let half = 0.5 * (most - least);
        if half <= 0.0 {
            return 0.0;
        }
        let first = x.first().copied().unwrap_or(0.0);
        let every = thinning(self.band, self.sample_rate_hz);
        let thin = |series: Vec<f64>| apply_every(&series, self.band, every);
        let mut fixed: Vec<Vec<f64>> = self.states(rows, half).into_iter().map(thin).collect();
        let force = thin(self.force[..rows].to_vec());
        if force.len() < 10 * (fixed.len() + SLIPS.len() + RELAXATIONS_S.len()) {
            return 0.0;
        }
        let alone = left(&fixed, &force);
        let count = fixed.len();
        let mut with = |travel: f64| {
            fixed.truncate(count);
            let elements = self.elements(half);
            fixed.extend(elements.map(|e| thin(e.along(x, self.first_row, travel))));
            left(&fixed, &force)
        };
        let at_rest = with(0.0);
        if at_rest > LEFT * alone {
            return 0.0;
        }
        let mut best = (at_rest, 0.0);
        let mut range = [first - most, first - least];
        for _ in 0..PASSES {
            let step = (range[1] - range[0]) / (TRIED - 1) as f64;
            for number in 0..TRIED {
                let travel = range[0] + number as f64 * step;
                let left = with(travel);
                if left < best.0 {
                    best = (left, travel);
                }
            }
            let near = |end: f64| end.clamp(first - most, first - least);
            range = [near(best.1 - step), near(best.1 + step)];
        }
        if best.0 <= LEFT * at_rest {
            best.1
        } else {
            0.0
        }
    }

    /// Functions of the motion that remember nothing.
    fn states(&self, rows: usize, half: f64) -> Vec<Vec<f64>> {
        let x = &self.displacement[self.first_row..];
        let fastest = peak(self.velocity);
        let fastest = if fastest > 0.0 { fastest } else { 1.0 };
        let functions: [fn(f64, f64) -> f64; 7] = [
            |_, _| 1.0,
            |x, _| x,
            |x, _| x * x,
            |x, _| x * x * x,
            |_, v| v,
            |_, v| v * v.abs(),
            |_, v| (v / 0.05).tanh(),
        ];
        let of = |function: fn(f64, f64) -> f64| {
            let states = x.iter().zip(self.velocity).take(rows);
            states
                .map(|(x, v)| function(x / half, v / fastest))
                .collect()
        };
        let mut all: Vec<Vec<f64>> = functions.into_iter().map(of).collect();
        all.push(self.acceleration[..rows].to_vec());
        all
    }

    /// The elements that remember.
    fn elements(&self, half: f64) -> impl Iterator<Item = Element> {
        let sliders = SLIPS.map(|slip| Element {
            slip: slip * half,
            keep: 1.0,
        });
        let rate = self.sample_rate_hz;
        let relaxing = RELAXATIONS_S.map(|time_s| Element {
            slip: f64::INFINITY,
            keep: (-1.0 / (rate * time_s)).exp(),
        });
        sliders.into_iter().chain(relaxing)
    }
}

/// The sum of squares that a least-squares fit of columns leaves of a series.
fn left(columns: &[Vec<f64>], series: &[f64]) -> f64 {
    /// What holds columns apart that say the same, beside their squares.
    const RIDGE: f64 = 1e-10;
    let sizes: Vec<f64> = columns.iter().map(|c| dot(c, c).sqrt()).collect();
    let kept: Vec<usize> = (0..columns.len()).filter(|&c| sizes[c] > 0.0).collect();
    let count = kept.len();
    let size = |place: usize| sizes[kept[place]];
    let column = |place: usize| columns[kept[place]].as_slice();
    let mut normal = DMatrix::from_diagonal_element(count, count, 1.0 + RIDGE);
    for a in 0..count {
        for b in 0..a {
            let product = dot(column(a), column(b)) / (size(a) * size(b));
            normal[(a, b)] = product;
            normal[(b, a)] = product;
        }
    }
    let right = DVector::from_fn(count, |place, _| dot(column(place), series) / size(place));
    let power = dot(series, series);
    let Some(factors) = normal.cholesky().map(|c| c.solve(&right)) else {
        return power;
    };
    (power - factors.dot(&right)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 200.0;
    const SLIP: f64 = 0.25;
    const FIRST_ROW: usize = 20;

    /// Displacement, velocity, force and stretch of a spring that stiffens beside a slider, in
    /// swings that grow from rest.
    fn swings() -> [Vec<f64>; 4] {
        let x = (0..4000).map(|row| {
            let t = f64::from(row) / RATE_HZ;
            (0.1 * t).min(1.0) * (3.0 * t).sin() * (1.0 - (-4.0 * t * t).exp())
        });
        let x: Vec<f64> = x.collect();
        let slider = Element {
            slip: SLIP,
            keep: 1.0,
        };
        let stretch = slider.along(&x, 0, 0.0);
        let rates = x.windows(2).map(|w| (w[1] - w[0]) * RATE_HZ);
        let velocity = std::iter::once(0.0).chain(rates).collect();
        let force = x.iter().zip(&stretch);
        let force = force.map(|(x, s)| 20.0 * x + 30.0 * x.powi(3) + 50.0 * s);
        let force = force.collect();
        [x, velocity, force, stretch]
    }

    /// The travel that the rows from `from` on tell of.
    fn travel(from: usize) -> f64 {
        let [x, velocity, force, _] = swings();
        let none = vec![0.0; x.len()];
        let rows = from + FIRST_ROW..;
        let record = AxisRecord {
            earlier: Vec::new(),
            displacement: &x[from..],
            first_row: FIRST_ROW,
            velocity: &velocity[rows.clone()],
            force: &force[rows.clone()],
            first_force: force[from],
            acceleration: &none[rows],
            sample_rate_hz: RATE_HZ,
            band: &[1.0],
        };
        let [before, _] = record.before();
        assert_eq!(before.len(), SAMPLES + FIRST_ROW);
        before[SAMPLES] - before[0]
    }

    #[test]
    fn a_record_that_begins_at_rest_remembers_nothing_and_one_that_was_cut_out_does() {
        assert_eq!(travel(0), 0.0);
        let [.., stretch] = swings();
        // Cut out where the joint turns round and the slider is stretched fully, to either side.
        for sign in [1.0, -1.0] {
            let stretched = |row: &usize| sign * stretch[*row] > 0.999 * SLIP;
            let turns = |row: &usize| stretched(row) && !stretched(&(row + 1));
            let from = (2000..3999).find(turns).expect("a large swing");
            let came = travel(from);
            assert!(sign * came > 0.8 * SLIP, "{came} at row {from}");
        }
    }
}
