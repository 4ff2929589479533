//! Output error: stretches of the records simulated one by one, and the sum of squares of what they
//! miss.
//!
//! This is multiple shooting without conditions of continuity. Every stretch begins at a state of
//! its own, which is found with the parameters: a measured start holds the noise of the
//! displacement, and without a spring that noise becomes drift. It keeps to the measured start as
//! closely as that is known, so that it does not take up what the model misses. Nothing ties the
//! end of one stretch to the start of the next. What such a tie would teach, how errors add up over
//! a long time, longer stretches teach as well; they are lengthened until each is a whole record,
//! where continuity holds by itself, and no multipliers have to be weighed against the data.

use super::tangent::{Displacements, Stretch, simulated};
use super::unknowns::{By, Unknowns};
use crate::fit::effects::projection::product;
use crate::fit::least_squares::levenberg_marquardt::{self, SumOfSquares};
use crate::fit::least_squares::normal_equations;
use crate::model::file::ModelFile;
use crate::simulate::respond::measured::DrivenBody;
use crate::text::error::{Error, Result, in_order};
use faer::Mat;
use jointwatch_shared::scalar::dual::Dual;
use rayon::prelude::*;

/// Gauss–Newton steps for the starts alone.
const STEPS_OF_STARTS: usize = 4;

/// The model, its unknowns, and the stretches of records over which it is simulated.
pub(super) struct Shooting<'a> {
    pub(super) model: &'a ModelFile,
    pub(super) unknowns: &'a Unknowns,
    pub(super) bodies: &'a [DrivenBody],
    pub(super) stretches: Vec<Stretch>,
    /// Integration steps per row.
    pub(super) steps: usize,
    /// Per axis, one over the RMS of its displacement: what makes metres and radians comparable.
    pub(super) weights: Vec<f64>,
    /// Standard deviation of a measured start.
    pub(super) deviations: [f64; 4],
    /// Cost of the square by which a start leaves the measured one: a row that misses by as much
    /// as rows do counts as a start that is off by its standard deviation.
    pub(super) ties: [f64; 4],
}

/// Values and starts, with what they leave.
#[derive(Clone)]
pub(super) struct Point {
    /// Of the unknowns, SI.
    pub(super) values: Vec<f64>,
    /// The body's positions and velocities at the start of every stretch.
    starts: Vec<[f64; 4]>,
    /// Measured less simulated displacement times the weight, per stretch; the axes one after the
    /// other.
    left: Vec<Vec<f64>>,
    /// Σ of their squares; infinite when a stretch diverged.
    pub(super) cost: f64,
}

/// The slopes of a point, with the starts eliminated.
pub(super) struct Linearised {
    normal: Mat<f64>,
    /// Per stretch: the step of its start for no step of the unknowns in the last column, and how
    /// that falls with each of them.
    starts: Vec<Mat<f64>>,
}

impl Shooting<'_> {
    /// Cuts so many rows of every body into equal stretches of about `rows` rows.
    pub(super) fn cut(bodies: &[DrivenBody], share: [f64; 2], rows: usize) -> Vec<Stretch> {
        let mut stretches = Vec::new();
        for (body, driven) in bodies.iter().enumerate() {
            let all = driven.motion.rows();
            let [from, to] = share.map(|part| (part * all as f64).round() as usize);
            let count = ((to - from) / rows.max(2)).max(1);
            let at = |k: usize| from + k * (to - from) / count;
            stretches.extend((0..count).map(|k| Stretch {
                body,
                rows: at(k)..at(k + 1),
            }));
        }
        stretches
    }

    /// Places in a start: positions and velocities of the axes that are there.
    fn places(&self) -> Vec<usize> {
        (0..self.weights.len()).flat_map(|i| [i, i + 2]).collect()
    }

    /// The point with these values whose stretches start as measured; what it leaves says how
    /// closely starts keep to that.
    pub(super) fn started_as_measured(&mut self, values: Vec<f64>) -> Result<Point> {
        let starts = self.stretches.iter().map(|s| self.measured(s)).collect();
        let point = self.point(values, starts)?;
        let left = self.relative(&point, 0.0);
        if left.is_finite() {
            self.ties = self.deviations.map(|known| (left / known).powi(2));
        }
        Ok(point)
    }

    fn measured(&self, stretch: &Stretch) -> [f64; 4] {
        self.bodies[stretch.body].measured(stretch.rows.start)
    }

    fn point(&self, values: Vec<f64>, starts: Vec<[f64; 4]>) -> Result<Point> {
        let model = self.unknowns.with(self.model, &values);
        let moved = self.moved(&model, &starts, By::Nothing)?;
        let mut point = Point {
            values,
            starts,
            left: Vec::new(),
            cost: f64::INFINITY,
        };
        let Some(moved) = moved else {
            return Ok(point);
        };
        for (stretch, moved) in self.stretches.iter().zip(&moved) {
            let motion = &self.bodies[stretch.body].motion;
            let mut left = Vec::new();
            for (axis, (series, weight)) in moved.iter().zip(&self.weights).enumerate() {
                let measured = &motion.states[2 * axis][stretch.rows.clone()];
                let pairs = measured.iter().zip(series);
                left.extend(pairs.map(|(x, y)| weight * (x - y.value)));
            }
            point.left.push(left);
        }
        point.cost = point.left.iter().flatten().map(|e| e * e).sum::<f64>() + self.tied(&point);
        Ok(point)
    }

    /// What starts cost that leave the measured ones.
    fn tied(&self, point: &Point) -> f64 {
        let places = self.places();
        let of_one = |(stretch, start): (&Stretch, &[f64; 4])| {
            let measured = self.measured(stretch);
            let places = places.iter();
            places
                .map(|&p| self.ties[p] * (start[p] - measured[p]).powi(2))
                .sum::<f64>()
        };
        self.stretches.iter().zip(&point.starts).map(of_one).sum()
    }

    fn moved(
        &self,
        model: &ModelFile,
        starts: &[[f64; 4]],
        by: By,
    ) -> Result<Option<Vec<Displacements>>> {
        let law = (model, self.unknowns);
        simulated(law, self.bodies, &self.stretches, starts, by, self.steps)
    }

    /// The slopes of every stretch by each of `all`.
    fn slopes(&self, point: &Point, all: &[By]) -> Result<Vec<Vec<Displacements>>> {
        let model = self.unknowns.with(self.model, &point.values);
        let one = |by: &By| {
            let moved = self.moved(&model, &point.starts, *by)?;
            moved.ok_or_else(|| {
                Error::failed("the slopes of the simulated motion are not finite: it is not stable")
            })
        };
        in_order(all.par_iter().map(one))
    }

    /// The slopes by `count` unknowns, with the starts eliminated: what is left is least in them
    /// whatever the unknowns do.
    fn eliminated(&self, point: &Point, count: usize) -> Result<Linearised> {
        let places = self.places();
        let unknowns = (0..count).map(By::Unknown);
        let all: Vec<By> = unknowns
            .chain(places.iter().map(|p| By::Start(*p)))
            .collect();
        let slopes = self.slopes(point, &all)?;
        let mut normal = Mat::zeros(count, count + 1);
        let mut starts = Vec::new();
        for (stretch, left) in point.left.iter().enumerate() {
            let rows = left.len() / self.weights.len();
            let columns = all.len();
            let design = Mat::from_fn(left.len(), columns + 1, |row, column| {
                let (axis, at) = (row / rows, row % rows);
                let slope = |by: &Vec<Displacements>| -> Dual { by[stretch][axis][at] };
                slopes
                    .get(column)
                    .map_or(left[row], |by| self.weights[axis] * slope(by).slopes[0])
            });
            let products = product(&design, &design);
            let block = |r: usize, c: usize, rows: usize, cols: usize| {
                products.submatrix(r, c, rows, cols).to_owned()
            };
            let own = columns - count;
            let mut between = Mat::zeros(own, count + 1);
            for i in 0..own {
                for j in 0..count {
                    between[(i, j)] = products[(count + i, j)];
                }
                between[(i, count)] = products[(count + i, columns)];
            }
            let mut own_block = block(count, count, own, own);
            let measured = self.measured(&self.stretches[stretch]);
            for (i, &place) in places.iter().enumerate() {
                own_block[(i, i)] += self.ties[place];
                between[(i, count)] +=
                    self.ties[place] * (measured[place] - point.starts[stretch][place]);
            }
            let follow = normal_equations::solve(&own_block, &between)?;
            let follow = follow.coefficients;
            let taken = block(0, count, count, own) * &follow;
            for i in 0..count {
                for j in 0..=count {
                    let column = if j < count { j } else { columns };
                    normal[(i, j)] += products[(i, column)] - taken[(i, j)];
                }
            }
            starts.push(follow);
        }
        Ok(Linearised { normal, starts })
    }

    /// The starts after a step of the unknowns.
    fn started(&self, point: &Point, linearised: &Linearised, step: &[f64]) -> Vec<[f64; 4]> {
        let places = self.places();
        let mut starts = point.starts.clone();
        for (start, follow) in starts.iter_mut().zip(&linearised.starts) {
            for (row, place) in places.iter().enumerate() {
                let taken: f64 = step
                    .iter()
                    .enumerate()
                    .map(|(j, s)| follow[(row, j)] * s)
                    .sum();
                start[*place] += follow[(row, step.len())] - taken;
            }
        }
        starts
    }

    /// A point whose starts alone were moved to where they leave least.
    pub(super) fn settled(&self, mut point: Point) -> Result<Point> {
        for _ in 0..STEPS_OF_STARTS {
            if point.cost.is_infinite() {
                break;
            }
            let linearised = self.eliminated(&point, 0)?;
            let next = self.point(point.values.clone(), self.started(&point, &linearised, &[]))?;
            if next.cost >= point.cost {
                break;
            }
            point = next;
        }
        Ok(point)
    }

    /// RMS of what is left as a part of the RMS displacement, over all axes and the rows of every
    /// stretch behind this part of it.
    pub(super) fn relative(&self, point: &Point, behind: f64) -> f64 {
        if point.cost.is_infinite() {
            return f64::INFINITY;
        }
        let axes = self.weights.len();
        let judged = point.left.iter().flat_map(|left| {
            let rows = left.len() / axes;
            let from = (behind * rows as f64).round() as usize;
            left.chunks(rows.max(1)).flat_map(move |own| &own[from..])
        });
        let [square, rows] = judged.fold([0.0; 2], |[sum, rows], e| [sum + e * e, rows + 1.0]);
        (square / rows.max(1.0)).sqrt()
    }
}

impl SumOfSquares for Shooting<'_> {
    type Point = Point;
    type Linearised = Linearised;

    fn cost(&self, point: &Point) -> f64 {
        point.cost
    }

    fn linearised(&self, point: &Point) -> Result<Linearised> {
        let mut linearised = self.eliminated(point, self.unknowns.count())?;
        levenberg_marquardt::hold(&mut linearised.normal, |unknown, direction| {
            self.unknowns.is_held(&point.values, unknown, direction)
        });
        Ok(linearised)
    }

    fn normal<'a>(&self, linearised: &'a Linearised) -> &'a Mat<f64> {
        &linearised.normal
    }

    fn stepped(
        &self,
        point: &Point,
        linearised: &Linearised,
        step: &[f64],
    ) -> Result<Option<Point>> {
        let starts = self.started(point, linearised, step);
        match self.unknowns.stepped(&point.values, step) {
            None => Ok(None),
            Some(values) => self.point(values, starts).map(Some),
        }
    }
}
