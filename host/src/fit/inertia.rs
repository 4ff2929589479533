//! Finding the inertia of the body from the records when the study does not state it (the paper's
//! Section 6).
//!
//! The acceleration joins the inputs and the output becomes the applied force: F = m·a ∓ r(x, ẋ, φ,
//! φ̇). Noise in the acceleration would pull m towards zero, so force, acceleration and every term
//! are low-passed alike first. The corners of a joint with free play, which no low polynomial
//! follows, would leak into m through the acceleration; straight-line pieces of the displacement
//! stand beside the polynomial to take them up.

use crate::fit::least_squares::normal_equations;
use crate::model::InputRange;
use crate::signal::fir::apply_every;
use crate::signal::motion::Motion;
use crate::study::Axis;
use crate::study::series::mean;
use crate::text::error::{Error, Result};
use faer::Mat;

/// The inertia of an axis, stated in the study or identified with the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertia {
    /// The inertia, kg or kg·m².
    pub value: f64,
    /// True when it was found from the records, false when the study stated it.
    pub identified: bool,
    /// Standard error of an identified value, kg or kg·m², by leaving out one stretch of every
    /// record at a time.
    pub standard_error: Option<f64>,
}

/// Stretches per record that are left out in turn.
const STRETCHES: usize = 10;

/// Highest total degree of the polynomial terms of two axes; one axis has all its sixteen.
const TOTAL_DEGREE: u8 = 3;

/// Where the straight-line pieces begin, in normalised displacement.
const CORNERS: [f64; 7] = [-0.6, -0.4, -0.2, 0.0, 0.2, 0.4, 0.6];

/// Rows that enter the regression; more are thinned out, neighbours being nearly equal.
const MAX_ROWS: usize = 200_000;

/// The range of every state of the polynomial, and the name of the input that is one of them.
pub type Known<'a> = (&'a [InputRange], Option<&'a str>);

/// The columns that stand for the restoring force, each a series over the record's rows.
fn features<'a>(
    motion: &'a Motion,
    states: &'a [&'a [f64]],
    ranges: &'a [InputRange],
) -> impl Iterator<Item = Vec<f64>> + 'a {
    let inputs = ranges.len();
    let value = move |input: usize, row: usize| ranges[input].normalise(states[input][row]);
    let orders = vec![3; inputs];
    let terms = crate::model::exponents(&orders)
        .into_iter()
        .filter(move |term| inputs == 2 || term.iter().sum::<u8>() <= TOTAL_DEGREE);
    let powers = terms.map(move |term| {
        (0..motion.rows())
            .map(|row| {
                (0..inputs)
                    .map(|input| value(input, row).powi(i32::from(term[input])))
                    .product()
            })
            .collect()
    });
    let displacements = (0..motion.states.len()).step_by(2);
    let pieces = displacements.flat_map(move |input| {
        CORNERS.into_iter().map(move |corner| {
            (0..motion.rows())
                .map(|row| (value(input, row) - corner).max(0.0))
                .collect()
        })
    });
    powers.chain(pieces)
}

/// Normal equations of one stretch: the columns, then one column of acceleration and one of force
/// per axis.
struct Stretches {
    grams: Vec<Mat<f64>>,
}

impl Stretches {
    fn new(motions: &[&Motion], (ranges, input): Known<'_>, low_pass: &[f64]) -> Self {
        let rows: usize = motions.iter().map(|m| m.rows()).sum();
        let step = (low_pass.len() / 16).max(rows / MAX_ROWS).max(1);
        let mut grams: Vec<Mat<f64>> = Vec::new();
        for motion in motions {
            let states = motion.base_states(input);
            let filtered = |series: &[f64]| {
                let filtered = apply_every(series, low_pass, step);
                motion.counted(filtered, low_pass.len(), step)
            };
            let series: Vec<Vec<f64>> = features(motion, &states, ranges)
                .map(|feature| filtered(&feature))
                .chain(motion.acceleration.iter().map(|a| filtered(a)))
                .chain(motion.force.iter().map(|f| filtered(f)))
                .collect();
            let rows = series[0].len();
            for stretch in 0..STRETCHES {
                let (start, end) = (stretch * rows / STRETCHES, (stretch + 1) * rows / STRETCHES);
                let design =
                    Mat::from_fn(end - start, series.len(), |row, c| series[c][start + row]);
                let gram = design.transpose() * &design;
                match grams.get_mut(stretch) {
                    Some(sum) => *sum += gram,
                    None => grams.push(gram),
                }
            }
        }
        Self { grams }
    }

    /// The inertia of one axis without one stretch, or from all of them.
    fn inertia(&self, axis: usize, axes: usize, without: Option<usize>) -> Result<f64> {
        let kept = self
            .grams
            .iter()
            .enumerate()
            .filter(|(i, _)| Some(*i) != without);
        let mut sum = Mat::<f64>::zeros(self.grams[0].nrows(), self.grams[0].ncols());
        for (_, gram) in kept {
            sum += gram;
        }
        let shared = sum.nrows() - 2 * axes;
        let column = |i: usize| if i < shared { i } else { shared + axis };
        let gram = Mat::from_fn(shared + 1, shared + 1, |i, j| sum[(column(i), column(j))]);
        let force = shared + axes + axis;
        let cross = Mat::from_fn(shared + 1, 1, |i, _| sum[(column(i), force)]);
        Ok(normal_equations::solve(&gram, &cross)?.coefficients[(shared, 0)])
    }
}

/// The inertia of every axis: as stated, or found from the training records.
///
/// `low_pass` are the taps of a symmetric filter, applied with zero phase; `ranges` those of the
/// inputs.
///
/// # Errors
/// One sentence when an identified inertia is not positive, or a record is shorter than the filter.
pub fn inertias(
    axes: &[Axis],
    motions: &[&Motion],
    known: Known<'_>,
    low_pass: &[f64],
) -> Result<Vec<Inertia>> {
    let mut identified = None;
    axes.iter()
        .enumerate()
        .map(|(i, axis)| {
            if let Some(value) = axis.inertia {
                return Ok(Inertia { value, identified: false, standard_error: None });
            }
            let shortest = motions.iter().map(|m| m.rows()).min().unwrap_or(0);
            let taps = if low_pass.is_empty() { &[1.0] } else { low_pass };
            if shortest < taps.len() + 10 * STRETCHES {
                return Err(Error::data(format!(
                    "a training record of {shortest} rows is too short to identify the inertia of axis {} behind a filter of {} taps: state inertia in study.toml, or record longer",
                    axis.name,
                    taps.len()
                )));
            }
            let stretches = identified.get_or_insert_with(|| Stretches::new(motions, known, taps));
            identify(stretches, axis, i, axes.len())
        })
        .collect()
}

fn identify(stretches: &Stretches, axis: &Axis, index: usize, axes: usize) -> Result<Inertia> {
    let value = stretches.inertia(index, axes, None)?;
    let left_out: Vec<f64> = (0..STRETCHES)
        .map(|stretch| stretches.inertia(index, axes, Some(stretch)))
        .collect::<Result<_>>()?;
    let n = STRETCHES as f64;
    let mean = mean(&left_out);
    let square: f64 = left_out.iter().map(|m| (m - mean).powi(2)).sum();
    let standard_error = ((n - 1.0) / n * square).sqrt();
    if !(value > 0.0 && value.is_finite()) {
        return Err(Error::data(format!(
            "the inertia identified for axis {} is {value:.4e} ± {standard_error:.1e}, not positive: check the sign of its force column and restoring_force in study.toml, or state inertia there",
            axis.name
        )));
    }
    Ok(Inertia {
        value,
        identified: true,
        standard_error: Some(standard_error),
    })
}
