//! A figure: panels in rows above a legend, drawn as SVG.

use super::quantity::tick;
use super::simplify::{extremes, simplify, simplify_to};
use super::style::{self, Pen};
use crate::study::series::extent;
use crate::text::error::{Error, Result};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::fmt::Display;

/// Points that all curves of a figure have together at the most: about 100 kB.
const POINTS: usize = 11_000;
/// A curve may stray this far from the measured one, in drawing units, of which a figure is 1600
/// wide.
const TOLERANCE: f64 = 0.6;

/// One curve of a panel.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// How it is drawn.
    pub pen: Pen,
    /// Its points, in the units of the panel's axes.
    pub points: Vec<(f64, f64)>,
}

/// One plot of a figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// What stands above it.
    pub title: String,
    /// Quantity and unit along the horizontal axis.
    pub horizontal: String,
    /// Quantity and unit along the vertical axis.
    pub vertical: String,
    /// The curves, the later ones above the earlier ones.
    pub curves: Vec<Curve>,
    /// How long curves are thinned out.
    pub thinned: Thinned,
    /// Stretches of the horizontal axis that are shaded over the whole height.
    pub shaded: Vec<(f64, f64)>,
}

/// How a curve of more points than a drawing can show is thinned out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Thinned {
    /// To an outline that strays from the curve by less than the eye sees: for loops, and for
    /// histories of few swings.
    Outline,
    /// To the least and the largest value in every pixel column: for histories of any length, of
    /// which no peak is lost.
    Columns,
}

/// Rows of panels; the panels of a row are equally wide.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// From top to bottom, each from left to right.
    pub rows: Vec<Vec<Panel>>,
    /// What each pen stands for; none for a figure whose curves need no telling apart.
    pub legend: Vec<(Pen, String)>,
}

impl Figure {
    /// The figure as an SVG document of at most about 150 kB.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when a curve is empty or holds a number that is not
    /// finite.
    pub fn svg(&self) -> Result<String> {
        for panel in self.rows.iter().flatten() {
            panel.check()?;
        }
        let legend_height = if self.legend.is_empty() {
            0
        } else {
            style::LEGEND_HEIGHT
        };
        let rows = self.rows.len() as u32;
        let size = (style::WIDTH, rows * style::ROW_HEIGHT + legend_height);
        let mut svg = String::new();
        {
            let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
            root.fill(&WHITE).map_err(failed)?;
            let (plots, legend) = root.split_vertically(rows * style::ROW_HEIGHT);
            let curves: usize = self.rows.iter().flatten().map(|p| p.curves.len()).sum();
            let budget = POINTS / curves.max(1);
            let rows = plots.split_evenly((self.rows.len(), 1));
            for (area, panels) in rows.iter().zip(&self.rows) {
                for (area, panel) in area.split_evenly((1, panels.len())).iter().zip(panels) {
                    panel.draw(area, budget)?;
                }
            }
            if !self.legend.is_empty() {
                self.draw_legend(&legend)?;
            }
            root.present().map_err(failed)?;
        }
        Ok(style::with_dashes(&svg))
    }

    fn draw_legend(&self, area: &DrawingArea<SVGBackend, Shift>) -> Result<()> {
        let middle = style::LEGEND_HEIGHT as i32 / 2;
        let share = style::WIDTH as i32 / self.legend.len() as i32;
        for (index, (pen, text)) in self.legend.iter().enumerate() {
            let left = index as i32 * share + share / 4;
            let line = vec![(left, middle), (left + 110, middle)];
            area.draw(&PathElement::new(line, pen.stroke()))
                .map_err(failed)?;
            let letters = style::letters(style::TEXT_SIZE).pos(Pos::new(HPos::Left, VPos::Center));
            area.draw(&Text::new(text.clone(), (left + 130, middle), letters))
                .map_err(failed)?;
        }
        Ok(())
    }
}

impl Panel {
    fn check(&self) -> Result<()> {
        let sound = |curve: &Curve| {
            let mut points = curve.points.iter();
            points.len() > 0 && points.all(|(x, y)| x.is_finite() && y.is_finite())
        };
        if self.curves.is_empty() || !self.curves.iter().all(sound) {
            return Err(Error::data(format!(
                "the drawing '{}' has no points, or one that is not finite; compare the model on this record to see why",
                self.title
            )));
        }
        Ok(())
    }

    fn draw(&self, area: &DrawingArea<SVGBackend, Shift>, budget: usize) -> Result<()> {
        let (width, height) = area.dim_in_pixel();
        let points = || self.curves.iter().flat_map(|curve| &curve.points);
        let (left, right) = limits(points().map(|p| p.0), 0.03);
        let (bottom, top) = limits(points().map(|p| p.1), 0.06);
        let mut chart = ChartBuilder::on(area)
            .margin(style::MARGIN)
            // Half of the last number stands beyond the end of its axis.
            .margin_right(2 * style::MARGIN)
            .caption(&self.title, style::letters(style::TEXT_SIZE))
            .x_label_area_size(style::BELOW)
            .y_label_area_size(style::BESIDE)
            .build_cartesian_2d(left..right, bottom..top)
            .map_err(failed)?;
        let ticks = (width / 150).clamp(3, 10) as usize;
        chart
            .configure_mesh()
            .x_labels(ticks)
            .y_labels(6)
            .max_light_lines(1)
            .light_line_style(TRANSPARENT)
            .bold_line_style(style::grid())
            .axis_style(style::frame())
            .label_style(style::letters(style::NUMBER_SIZE))
            .axis_desc_style(style::letters(style::TEXT_SIZE))
            .x_desc(&self.horizontal)
            .y_desc(&self.vertical)
            .x_label_formatter(&|value| tick(*value, right - left))
            .y_label_formatter(&|value| tick(*value, top - bottom))
            .draw()
            .map_err(failed)?;
        // Thinned out in units of the drawing, so that what goes cannot be seen.
        let across = f64::from(width - style::BESIDE - 3 * style::MARGIN) / (right - left);
        let titled = style::BELOW + 2 * style::MARGIN + style::TITLE_HEIGHT;
        let up = f64::from(height - titled) / (top - bottom);
        let shades = self.shaded.iter().map(|&(from, to)| {
            let corners = [(from.max(left), bottom), (to.min(right), top)];
            Rectangle::new(corners, style::shade())
        });
        chart.draw_series(shades).map_err(failed)?;
        for curve in &self.curves {
            let drawn: Vec<(f64, f64)> = curve
                .points
                .iter()
                .map(|(x, y)| (across * (x - left), up * (y - bottom)))
                .collect();
            let thin = match self.thinned {
                Thinned::Outline => simplify_to(&drawn, TOLERANCE, budget),
                Thinned::Columns => simplify(&extremes(&drawn), TOLERANCE),
            };
            let thin = thin
                .into_iter()
                .map(|(x, y)| (left + x / across, bottom + y / up));
            chart
                .draw_series(LineSeries::new(thin, curve.pen.stroke()))
                .map_err(failed)?;
        }
        Ok(())
    }
}

/// The range of an axis: from the least to the largest value and a share of that beyond on either
/// side.
pub(super) fn limits(values: impl Iterator<Item = f64>, beyond: f64) -> (f64, f64) {
    let [low, high] = extent(values);
    let span = if high > low {
        high - low
    } else {
        high.abs().max(1.0)
    };
    let beyond = if high > low { beyond } else { 0.5 };
    (low - beyond * span, high + beyond * span)
}

pub(super) fn failed(error: impl Display) -> Error {
    Error::failed(format!("a figure could not be drawn ({error})"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel(points: Vec<(f64, f64)>) -> Panel {
        Panel {
            title: "x & its < force".into(),
            horizontal: "displacement of x (mm)".into(),
            vertical: "force of x (N)".into(),
            curves: [Pen::Measured, Pen::Model]
                .map(|pen| Curve {
                    pen,
                    points: points.clone(),
                })
                .into(),
            thinned: Thinned::Outline,
            shaded: Vec::new(),
        }
    }

    fn figure(points: Vec<(f64, f64)>) -> Figure {
        Figure {
            rows: vec![vec![panel(points.clone()), panel(points)]],
            legend: vec![
                (Pen::Measured, "measured".into()),
                (Pen::Model, "model".into()),
            ],
        }
    }

    #[test]
    fn long_records_make_small_files_with_real_letters_and_dashes() {
        // Noise that no simplification can thin out within its first tolerance.
        let noisy = |i: u32| {
            (
                f64::from(i % 977),
                f64::from(i.wrapping_mul(2_654_435_761) % 1000),
            )
        };
        let svg = figure((0..200_000).map(noisy).collect()).svg().unwrap();
        assert!(svg.len() < 150_000, "{} bytes", svg.len());
        assert!(
            svg.contains("displacement of x (mm)") && svg.contains("font-family=\"sans-serif\"")
        );
        assert!(svg.contains("x &amp; its &lt; force"));
        // One dash-dot curve per panel and one in the legend.
        assert_eq!(svg.matches("stroke-dasharray").count(), 3);
    }

    #[test]
    fn what_is_not_finite_is_refused_and_a_constant_is_drawn() {
        let error = figure(vec![(0.0, 1.0), (1.0, f64::NAN)]).svg().unwrap_err();
        assert_eq!(error.exit_code(), 3);
        assert!(figure(Vec::new()).svg().is_err());
        let svg = figure(vec![(0.0, 2.0), (1.0, 2.0)]).svg().unwrap();
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }
}
