//! How one logger's clock runs against another's, from something that both have logged.
//!
//! A stretch of the one series is looked for in the other by correlation, which gives the offset to
//! a sample. From there the series is followed block by block in both directions, so that clocks
//! may drift apart by many samples, and in each block the shift is refined by least squares
//! (Gauss–Newton on shift, gain and zero). A straight line through the shifts is offset and drift.
//! Its errors come from the scatter of the blocks, because what two sensors make of one motion does
//! not differ by white noise.

use crate::study::check::kinematics::{likeness, triangle};
use crate::study::series::{about_mean, dot};
use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use std::sync::Arc;

/// Rows of the stretch that is looked for at most: with 200 ppm of drift its ends are 1.6 samples
/// apart.
const LONGEST_STRETCH: usize = 8192;
/// Stretches that are tried, evenly spaced over the log; the one most alike is taken.
const TRIED: usize = 7;
/// Correlation below which two stretches show nothing in common.
const ALIKE: f64 = 0.7;
/// The same for one block beside those that are aligned already.
const FOLLOWED: f64 = 0.5;
/// What is left at the second best place must be so many times what is left at the best one; else
/// the content repeats itself. Noise alone makes a few per cent of difference.
const CLEARER: f64 = 1.2;
/// Fewest and most blocks, and rows of one.
const BLOCKS: [usize; 2] = [6, 48];
const BLOCK_ROWS: usize = 128;
/// How fast clocks may drift apart, samples per sample.
const FASTEST_DRIFT: f64 = 2e-3;
/// Rows over which both series are smoothed alike, with a triangle. Between rows an interpolation
/// takes away some of the noise, and more in the middle between two: left in, it draws shifts
/// there.
const SMOOTHED: usize = 4;
/// Steps of the refinement: it converges quadratically from within a sample.
const STEPS: usize = 6;

/// One clock against another, in samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Alignment {
    /// Row of the second series to which `offset` belongs, where it is known best.
    pub(crate) middle: f64,
    /// What is added to a row of the second series, at `middle`, to have that of the first.
    pub(crate) offset: f64,
    /// By how much that grows from row to row.
    pub(crate) drift: f64,
    /// Half-widths of the 95 % intervals of offset and drift.
    pub(crate) within: [f64; 2],
    /// Of what both have logged, once aligned.
    pub(crate) correlation: f64,
}

/// Why two series cannot be aligned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Unaligned {
    /// Fewer rows than this.
    Short(usize),
    /// The best correlation that was found.
    Unlike(f64),
    /// It fits as well so many rows further on.
    Repeats(f64),
    /// Only one place is alike, which says nothing of the drift.
    Once,
}

impl Alignment {
    /// The row of the first series that belongs to one of the second.
    pub(crate) fn at(&self, row: f64) -> f64 {
        row + self.offset + self.drift * (row - self.middle)
    }

    /// Aligns two series of the same rate.
    pub(crate) fn of(first: &[f64], second: &[f64]) -> Result<Self, Unaligned> {
        let least = BLOCKS[0] * BLOCK_ROWS;
        if first.len().min(second.len()) < least {
            return Err(Unaligned::Short(least));
        }
        let [first, second] = [first, second].map(|series| triangle(series, SMOOTHED));
        let found = Found::by_correlation(&first, &second)?;
        let blocks = followed(&first, &second, &found);
        if blocks.len() < BLOCKS[0].div_ceil(2) {
            return Err(Unaligned::Once);
        }
        let line = line(&blocks);
        Ok(Self {
            // Both have lost as many rows at their beginning.
            middle: line.middle + (SMOOTHED - 1) as f64,
            ..line
        })
    }
}

/// Where a stretch of the second series lies in the first.
struct Found {
    from: usize,
    rows: usize,
    place: usize,
    correlation: f64,
}

impl Found {
    fn by_correlation(first: &[f64], second: &[f64]) -> Result<Self, Unaligned> {
        let rows = (second.len() / 2).min(LONGEST_STRETCH).min(first.len());
        let search = Search::new(first, rows);
        let step = (second.len() - rows) / (TRIED - 1);
        let tried = (0..TRIED).map(|n| n * step).map(|from| {
            let correlations = search.correlations(&second[from..from + rows]);
            let place = strongest(&correlations, |_| true).unwrap_or(0);
            (from, place, correlations)
        });
        let best = tried.max_by(|a, b| a.2[a.1].abs().total_cmp(&b.2[b.1].abs()));
        let (from, place, correlations) = best.ok_or(Unaligned::Unlike(0.0))?;
        let correlation = correlations[place];
        if correlation.abs() < ALIKE {
            return Err(Unaligned::Unlike(correlation.abs()));
        }
        // Beyond the peak itself, which ends where the correlation has fallen to half.
        let half = |at: &usize| correlations[*at].abs() < 0.5 * correlation.abs();
        let before = (0..place).rev().find(half).unwrap_or(0);
        let after = (place..correlations.len())
            .find(half)
            .unwrap_or(correlations.len());
        let rival = strongest(&correlations, |at| at < before || at >= after);
        let left = |correlation: f64| 1.0 - correlation * correlation;
        if let Some(rival) = rival
            && left(correlations[rival]) < CLEARER * left(correlation)
        {
            return Err(Unaligned::Repeats((rival as f64 - place as f64).abs()));
        }
        Ok(Self {
            from,
            rows,
            place,
            correlation,
        })
    }
}

/// The place of the largest magnitude among some.
fn strongest(correlations: &[f64], among: impl Fn(usize) -> bool) -> Option<usize> {
    let places = (0..correlations.len()).filter(|at| among(*at));
    places.max_by(|a, b| correlations[*a].abs().total_cmp(&correlations[*b].abs()))
}

/// The first series, transformed once to look for many stretches in it.
struct Search {
    forward: Arc<dyn RealToComplex<f64>>,
    back: Arc<dyn ComplexToReal<f64>>,
    spectrum: Vec<Complex<f64>>,
    /// Of every stretch of it, its size about its mean.
    sizes: Vec<f64>,
}

impl Search {
    fn new(series: &[f64], rows: usize) -> Self {
        let size = (series.len() + rows).next_power_of_two();
        let mut planner = RealFftPlanner::new();
        let mut padded = about_mean(series);
        let sizes = sizes(&padded, rows);
        padded.resize(size, 0.0);
        let forward = planner.plan_fft_forward(size);
        Self {
            spectrum: transformed(&*forward, &mut padded),
            back: planner.plan_fft_inverse(size),
            forward,
            sizes,
        }
    }

    /// The coefficient of correlation of a stretch with that of the series at every place.
    fn correlations(&self, stretch: &[f64]) -> Vec<f64> {
        let mut padded = about_mean(stretch);
        let own = dot(&padded, &padded).sqrt();
        padded.resize(self.forward.len(), 0.0);
        let mut spectrum = transformed(&*self.forward, &mut padded);
        for (theirs, mine) in spectrum.iter_mut().zip(&self.spectrum) {
            *theirs = mine * theirs.conj();
        }
        self.back
            .process(&mut spectrum, &mut padded)
            .expect("both are as long as the plan");
        let scale = 1.0 / (padded.len() as f64 * own);
        let places = self.sizes.iter().zip(&padded);
        places
            .map(|(size, product)| match *size > 0.0 && own > 0.0 {
                true => product * scale / size,
                false => 0.0,
            })
            .collect()
    }
}

fn transformed(plan: &dyn RealToComplex<f64>, series: &mut [f64]) -> Vec<Complex<f64>> {
    let mut spectrum = plan.make_output_vec();
    plan.process(series, &mut spectrum)
        .expect("both are as long as the plan");
    spectrum
}

/// The size of every stretch of a series about its own mean; 0 where it hardly moves beside the
/// liveliest.
fn sizes(series: &[f64], rows: usize) -> Vec<f64> {
    let (mut sum, mut square) = (0.0, 0.0);
    let mut squares = Vec::with_capacity(series.len() + 1 - rows);
    for (at, value) in series.iter().enumerate() {
        sum += value;
        square += value * value;
        if at >= rows {
            sum -= series[at - rows];
            square -= series[at - rows].powi(2);
        }
        if at + 1 >= rows {
            squares.push(square - sum * sum / rows as f64);
        }
    }
    let most = squares.iter().fold(0.0_f64, |most, s| most.max(*s));
    let size = |square: f64| {
        if square > 1e-6 * most {
            square.sqrt()
        } else {
            0.0
        }
    };
    squares.into_iter().map(size).collect()
}

/// A block of the second series as it lies in the first.
struct Block {
    middle: f64,
    shift: f64,
    /// One over the variance that white noise would give the shift.
    weight: f64,
    correlation: f64,
}

/// Follows the second series from where a stretch of it was found, to both ends.
fn followed(first: &[f64], second: &[f64], found: &Found) -> Vec<Block> {
    let count = (second.len() / (2 * BLOCK_ROWS)).clamp(BLOCKS[0], BLOCKS[1]);
    let rows = second.len() / count;
    let start = ((found.from + found.rows / 2) / rows).min(count - 1);
    let shift = found.place as f64 - found.from as f64;
    let sign = found.correlation.signum();
    let mut blocks = Vec::new();
    let outwards: [Vec<usize>; 2] = [(start..count).collect(), (0..start).rev().collect()];
    for order in outwards {
        let (mut near, mut away) = (shift, found.rows / rows + 1);
        for block in order {
            let from = block * rows;
            let reach = 2 + (FASTEST_DRIFT * (away * rows) as f64).ceil() as i64;
            let aligned = aligned(first, second, from..from + rows, near, reach, sign);
            match aligned {
                Some(block) => {
                    near = block.shift;
                    away = 1;
                    blocks.push(block);
                }
                None => away += 1,
            }
        }
    }
    blocks
}

/// One block at the place near a shift where it fits best; `None` where it fits nowhere or leaves
/// the first series.
fn aligned(
    first: &[f64],
    second: &[f64],
    rows: std::ops::Range<usize>,
    near: f64,
    reach: i64,
    sign: f64,
) -> Option<Block> {
    let wanted = &second[rows.clone()];
    let at = |lag: i64| {
        let from = rows.start as i64 + near.round() as i64 + lag;
        let from = usize::try_from(from).ok()?;
        let theirs = first.get(from..from + wanted.len())?;
        Some(sign * correlation(theirs, wanted))
    };
    let lags = (-reach..=reach).filter_map(|lag| Some((lag, at(lag)?)));
    let (lag, _) = lags.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let mut shift = near.round() + lag as f64;
    let mut weight = 0.0;
    for _ in 0..STEPS {
        let step = refined(first, wanted, rows.start as f64 + shift)?;
        shift += step.by.clamp(-1.0, 1.0);
        weight = step.weight;
    }
    let theirs: Option<Vec<f64>> = (0..wanted.len())
        .map(|row| interpolated(first, (rows.start + row) as f64 + shift))
        .collect();
    let correlation = sign * correlation(&theirs?, wanted);
    (correlation > FOLLOWED).then(|| Block {
        middle: rows.start as f64 + 0.5 * (wanted.len() - 1) as f64,
        shift,
        weight,
        correlation,
    })
}

struct Step {
    by: f64,
    weight: f64,
}

/// One step of Gauss–Newton on shift, gain and zero, from a place of the first series.
fn refined(first: &[f64], wanted: &[f64], place: f64) -> Option<Step> {
    let mut gram = nalgebra::Matrix3::<f64>::zeros();
    let mut right = nalgebra::Vector3::<f64>::zeros();
    let mut square = 0.0;
    for (row, value) in wanted.iter().enumerate() {
        let at = place + row as f64;
        let slope = interpolated(first, at + 0.5)? - interpolated(first, at - 0.5)?;
        let column = nalgebra::Vector3::new(interpolated(first, at)?, 1.0, slope);
        gram += column * column.transpose();
        right += column * *value;
        square += value * value;
    }
    let inverse = gram.try_inverse()?;
    let found = inverse * right;
    let (gain, slope) = (found[0], found[2]);
    let left = (square - found.dot(&right)).max(1e-12 * square) / wanted.len() as f64;
    let by = slope / gain;
    by.is_finite().then_some(Step {
        by,
        weight: gain * gain / (left * inverse[(2, 2)]),
    })
}

/// A series between its rows: the cubic through the four around.
fn interpolated(series: &[f64], at: f64) -> Option<f64> {
    let row = at.floor();
    let t = at - row;
    let row = row as i64;
    let near = series.get(usize::try_from(row - 1).ok()?..usize::try_from(row + 3).ok()?)?;
    let weights = [
        -t * (t - 1.0) * (t - 2.0) / 6.0,
        (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
        -(t + 1.0) * t * (t - 2.0) / 2.0,
        (t + 1.0) * t * (t - 1.0) / 6.0,
    ];
    Some(dot(near, &weights))
}

fn correlation(first: &[f64], second: &[f64]) -> f64 {
    likeness(first, second).correlation
}

/// The line through the blocks' shifts, with what their scatter says of it.
fn line(blocks: &[Block]) -> Alignment {
    let total: f64 = blocks.iter().map(|b| b.weight).sum();
    let mean =
        |of: &dyn Fn(&Block) -> f64| blocks.iter().map(|b| b.weight * of(b)).sum::<f64>() / total;
    let middle = mean(&|b| b.middle);
    let offset = mean(&|b| b.shift);
    let spread = total * mean(&|b| (b.middle - middle).powi(2));
    let drift = total * mean(&|b| (b.middle - middle) * (b.shift - offset)) / spread;
    let free = blocks.len() as f64 - 2.0;
    let scatter = |of: &dyn Fn(&Block) -> f64| {
        let of_one = |b: &Block| {
            let off = b.shift - offset - drift * (b.middle - middle);
            (b.weight * of(b) * off).powi(2)
        };
        let sum: f64 = blocks.iter().map(of_one).sum();
        sum * blocks.len() as f64 / free
    };
    let variances = [
        (scatter(&|_| 1.0) / total.powi(2)).max(1.0 / total),
        (scatter(&|b| b.middle - middle) / spread.powi(2)).max(1.0 / spread),
    ];
    // Student's 97.5 % quantile, to two digits from three degrees of freedom on.
    let quantile = 1.96 + 2.4 / free + 3.0 / free.powi(2);
    Alignment {
        middle,
        offset,
        drift,
        within: variances.map(|v| quantile * v.sqrt()),
        correlation: mean(&|b| b.correlation),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::time::noise::noise;
    use std::f64::consts::TAU;

    /// A motion that never repeats itself: tones up to a twentieth of the rate, at frequencies of
    /// no common measure.
    fn motion(seed: u64) -> impl Fn(f64) -> f64 {
        let mut noise = noise(seed);
        let tones: Vec<[f64; 3]> = (0..40)
            .map(|_| [0.001 + 0.024 * (1.0 + noise()), noise(), TAU * noise()])
            .collect();
        move |row| {
            tones
                .iter()
                .map(|[f, a, p]| a * (TAU * f * row + p).sin())
                .sum()
        }
    }

    /// A motion as two loggers see it, of which the second begins `offset` rows later and drifts.
    fn logged(seed: u64, rows: [usize; 2], offset: f64, drift: f64, share: f64) -> [Vec<f64>; 2] {
        let motion = motion(seed);
        let mut noise = noise(seed + 99);
        let first = (0..rows[0]).map(|row| motion(row as f64) + share * noise());
        let first: Vec<f64> = first.collect();
        let second = (0..rows[1]).map(|row| {
            let at = offset + (1.0 + drift) * row as f64;
            0.3 - 1.7 * motion(at) + share * noise()
        });
        [first, second.collect()]
    }

    #[test]
    fn offset_and_drift_come_back_within_their_intervals() {
        let mut outside = [0, 0];
        let mut worst = 0.0_f64;
        for seed in 0..60 {
            let mut noise = noise(1000 + seed);
            let (offset, drift) = (700.0 + 400.0 * noise(), 3e-4 * noise());
            let [first, second] = logged(seed, [12_000, 9_000], offset, drift, 0.3);
            let found = Alignment::of(&first, &second).unwrap();
            let off = [
                found.at(found.middle) - (offset + (1.0 + drift) * found.middle),
                found.drift - drift,
            ];
            worst = worst.max(off[0].abs());
            let pairs = off.iter().zip(found.within);
            for (outside, (off, within)) in outside.iter_mut().zip(pairs) {
                *outside += usize::from(off.abs() > within);
            }
        }
        println!("of 60: outside the 95 % interval {outside:?}, worst {worst:.1e} of a row");
        assert!(outside[0] <= 8 && outside[1] <= 8, "{outside:?}");
        assert!(worst < 0.05, "{worst}");
    }

    #[test]
    fn a_clock_that_drifts_by_many_rows_is_followed() {
        let [first, second] = logged(7, [60_000, 50_000], 2_000.0, 1e-3, 0.05);
        let found = Alignment::of(&first, &second).unwrap();
        assert!((found.drift - 1e-3).abs() < 1e-6, "{found:?}");
        assert!((found.at(0.0) - 2_000.0).abs() < 0.05, "{found:?}");
    }

    #[test]
    fn one_knock_alone_says_nothing_of_the_drift_and_three_do() {
        let knock = |row: f64, at: f64| (-((row - at) / 20.0).powi(2)).exp();
        let mut noise = noise(3);
        let mut logged = |rows: u32, from: f64, knocks: &[f64]| -> Vec<f64> {
            let of_all = |row: f64| knocks.iter().map(|at| knock(row, *at)).sum::<f64>();
            (0..rows)
                .map(|row| of_all(f64::from(row) + from) + 1e-3 * noise())
                .collect()
        };
        let once = [
            logged(9_000, 0.0, &[5_000.0]),
            logged(8_000, 123.4, &[5_000.0]),
        ];
        assert_eq!(Alignment::of(&once[0], &once[1]), Err(Unaligned::Once));
        let at = [1_000.0, 2_300.0, 5_000.0, 7_100.0];
        let [first, second] = [logged(9_000, 0.0, &at), logged(8_000, 123.4, &at)];
        let found = Alignment::of(&first, &second).unwrap();
        assert!((found.at(4_000.0) - 4_123.4).abs() < 0.1, "{found:?}");
    }

    #[test]
    fn what_cannot_be_aligned_is_refused() {
        let [first, _] = logged(1, [9_000, 10], 0.0, 0.0, 0.0);
        let [_, other] = logged(2, [10, 9_000], 0.0, 0.0, 0.0);
        assert!(matches!(
            Alignment::of(&first, &other),
            Err(Unaligned::Unlike(_))
        ));
        assert!(matches!(
            Alignment::of(&first, &other[..500]),
            Err(Unaligned::Short(_))
        ));
        let mut noise = noise(5);
        let mut sine = |rows: u32| -> Vec<f64> {
            let tone = |row: u32| (TAU * f64::from(row) / 100.0).sin();
            (0..rows).map(|row| tone(row) + 0.1 * noise()).collect()
        };
        let repeats = Alignment::of(&sine(9_000), &sine(8_000));
        assert!(matches!(repeats, Err(Unaligned::Repeats(_))), "{repeats:?}");
        let flat = Alignment::of(&first, &[1.0; 4_000]);
        assert!(matches!(flat, Err(Unaligned::Unlike(_))), "{flat:?}");
    }
}
