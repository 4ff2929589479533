//! Displacements from what was logged of their derivatives.
//!
//! An acceleration a is integrated twice by regularised least squares: the x that makes
//! ‖D·x − T²·a‖² + ε·‖x‖² least, with the second difference D, the period T and
//! ε = (2·sin(π·f·T))⁴. It is a filter that passes what lies above f, and it needs no value
//! beyond the ends of a record. Three passes, each over what the last one left, pass
//! 1 − (1 + (frequency/f)⁴)⁻³ of an amplitude: 99.5 % from 1.5·f on.
//!
//! Source: Lee, Hong, Park, Design of an FIR filter for the displacement reconstruction using
//! measured acceleration in low-frequency dominant structures, Int. J. Numer. Methods Eng. 82
//! (2010); iterated as in Hanke and Hansen, Surv. Math. Ind. 3 (1993).

use crate::study::series::mean;
use realfft::RealFftPlanner;

/// Passes of the regularised integration.
const PASSES: usize = 3;
/// The frequency at which a body is fastest over that above which its motion is integrated, at
/// least.
const MARGIN: f64 = 1.5;
/// How far the power of a motion stands out of the least power below where the body is fastest:
/// what lies 15 dB above noise is mostly motion.
const STANDS_OUT: f64 = 30.0;
/// The least frequency of integration in parts of the sample rate: ε is far above rounding.
const LEAST_SHARE: f64 = 1e-4;

/// The integral of a series from 0, by the trapezoidal rule.
pub(crate) fn integral(series: &[f64], period_s: f64) -> Vec<f64> {
    let (mut sum, mut before) = (0.0, series.first().copied().unwrap_or(0.0));
    let next = |value: &f64| {
        sum += 0.5 * (before + value) * period_s;
        before = *value;
        sum
    };
    series.iter().map(next).collect()
}

/// The displacement of an acceleration, of which nothing below `above_hz` is kept; zero where there
/// are fewer than five rows.
pub(crate) fn displacement_of(acceleration: &[f64], period_s: f64, above_hz: f64) -> Vec<f64> {
    let rows = acceleration.len();
    if rows < 5 {
        return vec![0.0; rows];
    }
    let mean = mean(acceleration);
    // The second difference of a displacement follows its second derivative by this mean of three
    // (Numerov) with an error of order T⁴.
    let mut left: Vec<f64> = acceleration
        .windows(3)
        .map(|a| period_s * period_s * ((a[0] + 10.0 * a[1] + a[2]) / 12.0 - mean))
        .collect();
    let angle = std::f64::consts::PI * (above_hz * period_s).max(LEAST_SHARE);
    let factors = Factors::new(rows, (2.0 * angle.sin()).powi(4));
    let mut displacement = vec![0.0; rows];
    for _ in 0..PASSES {
        let mut step = vec![0.0; rows];
        for (row, rest) in left.iter().enumerate() {
            step[row] += rest;
            step[row + 1] -= 2.0 * rest;
            step[row + 2] += rest;
        }
        factors.solve(&mut step);
        for (rest, x) in left.iter_mut().zip(step.windows(3)) {
            *rest -= x[0] - 2.0 * x[1] + x[2];
        }
        for (x, step) in displacement.iter_mut().zip(step) {
            *x += step;
        }
    }
    displacement
}

/// DᵀD + ε·1 as L·diag(d)·Lᵀ, where L has ones and two diagonals below them.
struct Factors {
    diagonal: Vec<f64>,
    below: Vec<[f64; 2]>,
}

impl Factors {
    fn new(rows: usize, epsilon: f64) -> Self {
        let mut diagonal: Vec<f64> = Vec::with_capacity(rows);
        let mut below: Vec<[f64; 2]> = Vec::with_capacity(rows);
        for row in 0..rows {
            // How many second differences hold this row, and this one and the next.
            let from_end = row.min(rows - 1 - row);
            let own = [1.0, 5.0].get(from_end).copied().unwrap_or(6.0) + epsilon;
            let next = if row.min(rows.saturating_sub(2 + row)) == 0 {
                -2.0
            } else {
                -4.0
            };
            let before = |back: usize, place: usize| {
                let at = row.checked_sub(back)?;
                Some((below[at][place], diagonal[at]))
            };
            let (last, last_d) = before(1, 0).unwrap_or((0.0, 0.0));
            let (skip, skip_d) = before(2, 1).unwrap_or((0.0, 0.0));
            let carried = before(1, 1).map_or(0.0, |(l, _)| l);
            let pivot = own - last * last * last_d - skip * skip * skip_d;
            below.push([(next - carried * last * last_d) / pivot, 1.0 / pivot]);
            diagonal.push(pivot);
        }
        Self { diagonal, below }
    }

    fn solve(&self, right: &mut [f64]) {
        for row in 0..right.len() {
            let value = right[row];
            for (place, l) in self.below[row].into_iter().enumerate() {
                if let Some(later) = right.get_mut(row + 1 + place) {
                    *later -= l * value;
                }
            }
        }
        for (value, d) in right.iter_mut().zip(&self.diagonal) {
            *value /= d;
        }
        for row in (0..right.len()).rev() {
            let later = |place: usize| right.get(row + 1 + place).copied().unwrap_or(0.0);
            let taken = self.below[row][0] * later(0) + self.below[row][1] * later(1);
            right[row] -= taken;
        }
    }
}

/// The frequency above which an acceleration may be integrated twice, Hz: the lowest that stands
/// out of the least power between 0 and where the body is fastest. `None` where nothing does, or
/// there are too few rows to tell.
pub(crate) fn lowest_frequency(acceleration: &[f64], rate_hz: f64) -> Option<f64> {
    let rows = acceleration.len();
    if rows < 32 {
        return None;
    }
    let mean = mean(acceleration);
    let hann = |row: usize| 1.0 - (std::f64::consts::TAU * row as f64 / rows as f64).cos();
    let each = acceleration.iter().enumerate();
    let mut windowed: Vec<f64> = each.map(|(row, a)| hann(row) * (a - mean)).collect();
    let transform = RealFftPlanner::new().plan_fft_forward(rows);
    let mut lines = transform.make_output_vec();
    transform.process(&mut windowed, &mut lines).ok()?;
    // First frequency, mean power and square of the speed of lines put together so that the power
    // of each group is steady, a fourth of its frequency wide.
    let mut groups: Vec<[f64; 3]> = Vec::new();
    let mut first = 1;
    while first < lines.len() {
        let group = &lines[first..lines.len().min(first + 2 + first / 4)];
        let power = group.iter().map(|l| l.norm_sqr()).sum::<f64>();
        let hz = first as f64 * rate_hz / rows as f64;
        groups.push([hz, power / group.len() as f64, power / (hz * hz)]);
        first += group.len();
    }
    let peak = (0..groups.len()).max_by(|a, b| groups[*a][2].total_cmp(&groups[*b][2]))?;
    let powers = groups[..=peak].iter().map(|[_, power, _]| *power);
    let least = STANDS_OUT * powers.fold(f64::INFINITY, f64::min);
    let standing = groups[..=peak].iter().rev();
    let mut standing = standing.take_while(|[_, power, _]| *power > least);
    let fastest = standing.next()?[0];
    let lowest = standing.last().map_or(fastest, |[hz, ..]| *hz);
    let above_hz = lowest.min(fastest / MARGIN);
    Some(above_hz.max(LEAST_SHARE * rate_hz))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// An accelerometer with an offset on what moves as a sum of sines.
    fn acceleration(rows: usize, rate_hz: f64, sines: &[(f64, f64)]) -> [Vec<f64>; 2] {
        let sum = |of: &dyn Fn(f64, f64, f64) -> f64| -> Vec<f64> {
            let at = |row: usize| row as f64 / rate_hz;
            (0..rows)
                .map(|row| sines.iter().map(|(hz, x)| of(TAU * hz, *x, at(row))).sum())
                .collect()
        };
        let mut a = sum(&|w, x, t| -w * w * x * (w * t).sin());
        a.iter_mut().for_each(|a| *a += 0.3);
        [a, sum(&|w, x, t| x * (w * t).sin())]
    }

    #[test]
    fn the_displacement_of_a_motion_comes_back_up_to_its_ends() {
        let [a, x] = acceleration(4000, 1000.0, &[(6.0, 1e-3), (17.0, 2e-4), (80.0, 1e-5)]);
        let above = lowest_frequency(&a, 1000.0).expect("enough rows");
        assert!((2.0..5.0).contains(&above), "{above}");
        let found = displacement_of(&a, 1e-3, above);
        let error = |rows: std::ops::Range<usize>| {
            let differences = rows.clone().map(|row| (found[row] - x[row]).powi(2));
            (differences.sum::<f64>() / rows.len() as f64).sqrt() / 7e-4
        };
        assert!(error(400..3600) < 0.01, "{}", error(400..3600));
        // The ends are known from one side.
        assert!(error(0..4000) < 0.15, "{}", error(0..4000));
    }

    #[test]
    fn drift_below_the_motion_is_not_taken_for_motion() {
        let [mut a, _] = acceleration(8000, 1000.0, &[(12.0, 1e-3)]);
        for (row, a) in a.iter_mut().enumerate() {
            *a += 0.02 * (TAU * 0.2 * row as f64 * 1e-3).sin();
        }
        let above = lowest_frequency(&a, 1000.0).expect("enough rows");
        assert!((3.0..9.0).contains(&above), "{above}");
        let found = displacement_of(&a, 1e-3, above);
        let largest = found.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        assert!(largest < 1.1e-3, "{largest}");
    }

    #[test]
    fn a_few_rows_do_not_move() {
        assert_eq!(displacement_of(&[1.0; 4], 1e-3, 5.0), [0.0; 4]);
        assert_eq!(lowest_frequency(&[1.0; 31], 1000.0), None);
    }
}
