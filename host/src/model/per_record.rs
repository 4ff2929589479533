//! Parts of a force channel that are another in every record: its zero and its drift, and the size
//! and phase of mains hum.
//!
//! Only what shapes such a law carries over from one record to the next, the frequency of the mains
//! for one. The law is evaluated at a size of 1, for hum twice, a quarter of a turn apart, for a
//! drift once at each of its sizes, and least squares says how much of it a record holds.

use crate::model::time_history::{TimeHistory, law_parameters};
use crate::study::series::dot;
use jointwatch_shared::base::terms::EffectValues;
use jointwatch_shared::effect::about::Shape;
use std::f64::consts::TAU;

/// Phases at which a law is evaluated, in turns: a sum of the two is the law at any size and phase.
pub(crate) const PHASES: [f64; 2] = [0.0, 0.25];
/// How far from a shape's starts a line is looked for, as a part of them: grids are held to a tenth
/// of that.
const NEIGHBOURHOOD: f64 = 0.01;
/// Points per width of a line (one over the length of the longest record) at which its
/// neighbourhood is scanned.
const POINTS_PER_LINE: f64 = 6.0;

/// The factors of one column or two, one per size and phase, that leave least of a series; 0 for
/// columns that cannot be told apart.
pub(crate) fn least_squares(columns: &[Vec<f64>], series: &[f64]) -> [f64; 2] {
    match columns {
        [a] if dot(a, a) > 0.0 => [dot(a, series) / dot(a, a), 0.0],
        [a, b] => {
            let (aa, ab, bb) = (dot(a, a), dot(a, b), dot(b, b));
            let (ay, by) = (dot(a, series), dot(b, series));
            let determinant = aa * bb - ab * ab;
            if determinant <= 1e-12 * aa * bb {
                return [0.0; 2];
            }
            [
                (bb * ay - ab * by) / determinant,
                (aa * by - ab * ay) / determinant,
            ]
        }
        _ => [0.0; 2],
    }
}

/// What an effect with a size of its own in every record has in one: that part, for each of the
/// record's `rows`.
///
/// `series` is what everything else leaves of the record from row `first` on, one value per
/// `period_s`.
pub(crate) fn part_of(
    term: &EffectValues,
    series: &[f64],
    first: usize,
    rows: usize,
    period_s: f64,
) -> Vec<f64> {
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let parameters = term.entry.parameters();
    for (size, parameter) in parameters.iter().enumerate() {
        let mut unit = term.clone();
        let listed = parameters.iter().zip(&mut unit.values);
        for (index, (_, value)) in listed.enumerate().filter(|(_, (p, _))| p.is_per_record()) {
            *value = f64::from(u8::from(index == size));
        }
        let phases = PHASES[..parameter.phases()].iter();
        columns.extend(phases.map(|&phase| along(&unit, phase, rows, period_s)));
    }
    let seen: Vec<Vec<f64>> = columns
        .iter()
        .map(|column| column[first..first + series.len()].to_vec())
        .collect();
    let factors = least_squares(&seen, series);
    let mut part = vec![0.0; rows];
    for (column, factor) in columns.iter().zip(factors) {
        part.iter_mut()
            .zip(column)
            .for_each(|(p, c)| *p += factor * c);
    }
    part
}

/// What such an effect adds to a record in which it begins at `phase`, in turns.
pub(crate) fn along(term: &EffectValues, phase: f64, rows: usize, period_s: f64) -> Vec<f64> {
    // Such a law takes nothing from the motion but its time.
    let still = vec![0.0; rows];
    let history = TimeHistory::of_states(&[&still, &still], period_s);
    let parameters = law_parameters(term.entry, &term.values);
    let mut force = Vec::with_capacity(rows);
    history.along(term.entry, &parameters, 0, phase, |_, [f, _]| force.push(f));
    force
}

/// Takes such effects among `terms` out of the residual of an axis in one record.
pub(crate) fn take_out(terms: &[EffectValues], axis: usize, residual: &mut [f64], period_s: f64) {
    let mine = |term: &&EffectValues| term.entry.is_per_record() && usize::from(term.axis) == axis;
    for term in terms.iter().filter(mine) {
        let part = part_of(term, residual, 0, residual.len(), period_s);
        residual.iter_mut().zip(part).for_each(|(r, p)| *r -= p);
    }
}

/// The frequency, Hz, near a start of a shape at which the records hold the strongest line, phases
/// and sizes free.
pub(crate) fn strongest(records: &[&[f64]], rate_hz: f64, shape: &Shape) -> f64 {
    let rows = records.iter().map(|r| r.len()).max().unwrap_or(0).max(1);
    let step = rate_hz / rows as f64 / POINTS_PER_LINE;
    let power = |frequency: f64| -> f64 {
        let of_record = |record: &&[f64]| {
            let [re, im] = correlation(record, frequency / rate_hz);
            (re * re + im * im) / record.len().max(1) as f64
        };
        records.iter().map(of_record).sum()
    };
    let mut best = (
        f64::NEG_INFINITY,
        shape.starts.first().copied().unwrap_or(1.0),
    );
    for start in shape.starts {
        let half = (NEIGHBOURHOOD * start / step).ceil().max(1.0) as i32;
        for point in -half..=half {
            let frequency = start + f64::from(point) * NEIGHBOURHOOD * start / f64::from(half);
            // Beyond half the rate a line shows at another frequency.
            if frequency < 0.5 * rate_hz {
                let found = power(frequency);
                if found > best.0 {
                    best = (found, frequency);
                }
            }
        }
    }
    best.1
}

/// Σ y·e^(−2πi·n·turns): the recurrence of a rotating pointer, set anew before its roundings add
/// up.
fn correlation(series: &[f64], turns: f64) -> [f64; 2] {
    const AGAIN: usize = 1024;
    let (sine, cosine) = (TAU * turns).sin_cos();
    let mut sum = [0.0; 2];
    for (part, chunk) in series.chunks(AGAIN).enumerate() {
        let (mut s, mut c) = (TAU * (turns * (part * AGAIN) as f64).fract()).sin_cos();
        for y in chunk {
            sum[0] += y * c;
            sum[1] -= y * s;
            (s, c) = (s * cosine + c * sine, c * cosine - s * sine);
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use jointwatch_shared::effect::{EFFECTS, Entry};

    const RATE: f64 = 500.0;

    fn hum() -> &'static Entry {
        EFFECTS.iter().find(|e| e.is_line()).unwrap()
    }

    fn line(rows: usize, hz: f64, size: f64, phase: f64) -> Vec<f64> {
        let row = |n: usize| size * (TAU * hz * n as f64 / RATE + phase).sin();
        (0..rows).map(row).collect()
    }

    #[test]
    fn the_frequency_is_found_to_a_part_of_the_records_resolution() {
        let jointwatch_shared::effect::about::Role::Shape(shape) = hum().parameters()[1].role
        else {
            panic!("no frequency");
        };
        for hz in [49.96, 50.0, 50.213, 59.87, 60.05] {
            let records = [line(5000, hz, 1.0, 0.3), line(3000, hz, 2.0, 4.0)];
            let records: Vec<&[f64]> = records.iter().map(Vec::as_slice).collect();
            let found = strongest(&records, RATE, &shape);
            // The longest record resolves 0.1 Hz.
            assert!((found - hz).abs() < 0.02, "{found} for {hz}");
        }
    }

    #[test]
    fn a_line_is_taken_out_whatever_its_phase_and_nothing_else() {
        let term = EffectValues {
            input: None,
            entry: hum(),
            axis: 1,
            values: vec![7.0, 50.1],
        };
        let other = line(4000, 12.3, 3.0, 1.0);
        for (phase, size) in [(0.0, 0.5), (2.2, 1.5), (5.9, 0.01)] {
            let mut sum = line(4000, 50.1, size, phase);
            sum.iter_mut().zip(&other).for_each(|(s, o)| *s += o);
            let mut untouched = sum.clone();
            take_out(std::slice::from_ref(&term), 0, &mut untouched, 1.0 / RATE);
            assert_eq!(untouched, sum, "the other axis");
            take_out(std::slice::from_ref(&term), 1, &mut sum, 1.0 / RATE);
            let off = sum
                .iter()
                .zip(&other)
                .fold(0.0, |m: f64, (s, o)| m.max((s - o).abs()));
            assert!(off < 5e-3, "{off}");
        }
    }
}
