//! The residual over the state plane: how large it is at which displacement and velocity, and where
//! the model fails.

pub(super) mod cells;

use crate::assess::where_it_fails::{Condition, Extent, FailingRegion};
use crate::report::axis_history::AxisHistory;
use crate::report::figure::{failed, limits};
use crate::report::quantity::{Quantity, tick};
use crate::report::style;
use crate::study::series::peak;
use crate::text::error::{Error, Result};
use crate::text::table::rounded;
use cells::{Cells, share};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Height of the map with its axes and its title.
const MAP_HEIGHT: u32 = 760;
/// Height of one line of words below it.
const LINE_HEIGHT: u32 = 44;
/// Width of the strip with the colour scale.
const SCALE_WIDTH: u32 = 250;

/// The map of one axis.
pub struct StatePlane<'a> {
    /// The axis over the records whose error is judged, one course each.
    pub histories: &'a [AxisHistory],
    /// Which axis of the study it is, from 0.
    pub axis: usize,
    /// Where the error of this axis sits.
    pub places: &'a [FailingRegion],
}

/// A rectangle of the plane, in the units of the drawing.
type Frame = [(f64, f64); 2];

/// What is drawn across and up, and from where to where.
struct Plane {
    axis: String,
    force_unit: &'static str,
    across: Quantity,
    up: Quantity,
    horizontal: (f64, f64),
    vertical: (f64, f64),
}

impl StatePlane<'_> {
    /// The map as an SVG document: the RMS of the residual as shades over displacement and
    /// velocity, the failing regions framed and lettered, and below them in words.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when there are no rows or a number is not finite.
    pub fn svg(&self) -> Result<String> {
        let (plane, points) = self.plane()?;
        let cells = Cells::of(&points, plane.horizontal, plane.vertical);
        let scale = Quantity::new(
            &format!("RMS residual of {}", plane.axis),
            plane.force_unit,
            cells.most,
        );
        let regions = self.regions(&plane);
        let height = MAP_HEIGHT + LINE_HEIGHT * regions.len() as u32 + style::MARGIN;
        let mut svg = String::new();
        {
            let root =
                SVGBackend::with_string(&mut svg, (style::WIDTH, height)).into_drawing_area();
            root.fill(&WHITE).map_err(failed)?;
            let (picture, words) = root.split_vertically(MAP_HEIGHT);
            let (map, bar) = picture.split_horizontally(style::WIDTH - SCALE_WIDTH);
            draw_map(&map, &plane, &cells, &regions)?;
            draw_scale(&bar, &scale, &cells)?;
            draw_words(&words, &regions)?;
            root.present().map_err(failed)?;
        }
        // Without this the background shines through between the cells.
        Ok(svg.replacen("<svg ", "<svg shape-rendering=\"crispEdges\" ", 1))
    }

    /// The plane that holds every row of the records, and its points: displacement and velocity as
    /// drawn, and the residual.
    fn plane(&self) -> Result<(Plane, Vec<[f64; 3]>)> {
        let Some(first) = self.histories.first() else {
            return Err(Error::data("a map of the residual needs a record"));
        };
        let all = |series: fn(&AxisHistory) -> &Vec<f64>| -> Vec<f64> {
            self.histories.iter().flat_map(series).copied().collect()
        };
        let (x, v) = (all(|c| &c.displacement), all(|c| &c.velocity));
        let residuals: Vec<f64> = self
            .histories
            .iter()
            .flat_map(AxisHistory::residual)
            .collect();
        let mut values = residuals.iter().chain(&x).chain(&v);
        if residuals.is_empty() || !values.all(|value| value.is_finite()) {
            return Err(Error::data(format!(
                "the map of the residual of {} has no points, or one that is not finite; compare the model on this record to see why",
                first.axis
            )));
        }
        let quantity = |name: &str, unit, values: &[f64]| {
            Quantity::new(&format!("{name} of {}", first.axis), unit, peak(values))
        };
        let across = quantity("displacement", first.kind.displacement_unit(), &x);
        let up = quantity("velocity", first.kind.velocity_unit(), &v);
        let points = x.iter().zip(&v).zip(&residuals);
        let points: Vec<[f64; 3]> = points
            .map(|((x, v), e)| [across.scaled(*x), up.scaled(*v), *e])
            .collect();
        let plane = Plane {
            axis: first.axis.clone(),
            force_unit: first.kind.force_unit(),
            horizontal: limits(points.iter().map(|p| p[0]), 0.0),
            vertical: limits(points.iter().map(|p| p[1]), 0.0),
            across,
            up,
        };
        Ok((plane, points))
    }

    /// The failing regions of the states, lettered, as far as they show in this plane.
    fn regions(&self, plane: &Plane) -> Vec<Region> {
        let mut regions = Vec::new();
        let mut letters = 'A'..='Z';
        for place in self.places.iter().filter(|p| p.kind == "state") {
            let Extent::States(conditions) = &place.extent else {
                regions.push(Region {
                    letter: ' ',
                    boxes: Vec::new(),
                    words: format!("Where it fails: {}.", place.region),
                });
                continue;
            };
            let of = |state: usize, quantity: &Quantity, whole| {
                let mine = conditions.iter().filter(|c| c.state == state);
                mine.fold(vec![whole], |left, c| {
                    intersection(&left, &stretches(c, quantity))
                })
            };
            let widths = of(2 * self.axis, &plane.across, plane.horizontal);
            let heights = of(2 * self.axis + 1, &plane.up, plane.vertical);
            let boxes = widths.iter().flat_map(|&(left, right)| {
                let heights = heights.iter();
                heights.map(move |&(low, high)| [(left, low), (right, high)])
            });
            let letter = letters.next().unwrap_or('Z');
            regions.push(Region {
                letter,
                boxes: boxes.collect(),
                words: format!(
                    "{letter}: {:.0} % of the error in {:.1} % of the rows, where {}",
                    100.0 * place.share_of_error,
                    100.0 * place.share_of_rows,
                    place.region
                ),
            });
        }
        regions
    }
}

fn draw_map(
    area: &DrawingArea<SVGBackend, Shift>,
    plane: &Plane,
    cells: &Cells,
    regions: &[Region],
) -> Result<()> {
    let (horizontal, vertical) = (plane.horizontal, plane.vertical);
    let mut chart = ChartBuilder::on(area)
        .margin(style::MARGIN)
        .caption(
            format!("{}: residual over the state plane", plane.axis),
            style::letters(style::TEXT_SIZE),
        )
        .x_label_area_size(style::BELOW)
        .y_label_area_size(style::BESIDE)
        .build_cartesian_2d(horizontal.0..horizontal.1, vertical.0..vertical.1)
        .map_err(failed)?;
    chart
        .configure_mesh()
        .disable_mesh()
        .axis_style(style::frame())
        .x_labels(10)
        .y_labels(8)
        .label_style(style::letters(style::NUMBER_SIZE))
        .axis_desc_style(style::letters(style::TEXT_SIZE))
        .x_desc(plane.across.label())
        .y_desc(plane.up.label())
        .x_label_formatter(&|value| tick(*value, horizontal.1 - horizontal.0))
        .y_label_formatter(&|value| tick(*value, vertical.1 - vertical.0))
        .draw()
        .map_err(failed)?;
    chart
        .draw_series(cells.boxes(horizontal, vertical))
        .map_err(failed)?;
    let frames = regions
        .iter()
        .flat_map(|region| region.boxes.iter().map(|frame| (region.letter, *frame)));
    for (letter, frame) in frames {
        let [(left, low), (right, high)] = frame;
        // plotters draws rectangles with hairlines whatever their style says.
        let outline = [
            (left, low),
            (right, low),
            (right, high),
            (left, high),
            (left, low),
        ];
        chart
            .draw_series([PathElement::new(outline, style::MARK.stroke_width(5))])
            .map_err(failed)?;
        // The letter stands inside, at the upper left.
        let tag = EmptyElement::at((left, high))
            + Rectangle::new([(0, 0), (38, 40)], style::MARK.filled())
            + Text::new(
                letter.to_string(),
                (19, 21),
                style::letters(style::TEXT_SIZE)
                    .color(&WHITE)
                    .pos(Pos::new(HPos::Center, VPos::Center)),
            );
        chart.draw_series([tag]).map_err(failed)?;
    }
    Ok(())
}

/// The failing regions in words, a line each.
fn draw_words(area: &DrawingArea<SVGBackend, Shift>, regions: &[Region]) -> Result<()> {
    let room = f64::from(style::WIDTH - style::BESIDE - 2 * style::MARGIN);
    for (line, region) in regions.iter().enumerate() {
        let left = style::BESIDE as i32 + style::MARGIN as i32;
        let middle = (LINE_HEIGHT * line as u32 + LINE_HEIGHT / 2) as i32;
        let text = style::letters(style::fitting(&region.words, room, style::NUMBER_SIZE));
        let text = text.pos(Pos::new(HPos::Left, VPos::Center));
        area.draw(&Text::new(region.words.clone(), (left, middle), text))
            .map_err(failed)?;
    }
    Ok(())
}

/// A failing region, and the letter by which the plot names it.
struct Region {
    letter: char,
    boxes: Vec<Frame>,
    words: String,
}

/// Round numbers from 0 to `most`, four to nine of them, in steps of 1, 2 or 5.
fn round_numbers(most: f64) -> Vec<f64> {
    let decade = 10.0_f64.powf(most.max(f64::MIN_POSITIVE).log10().floor());
    let steps = [0.2, 0.5, 1.0].map(|part| part * decade);
    let step = steps.into_iter().find(|step| most / step <= 8.0);
    let step = step.unwrap_or(2.0 * decade);
    let numbers = (0..).map(|n| f64::from(n) * step);
    numbers.take_while(|value| *value <= most).collect()
}

/// The colour scale: from no residual to the largest that enough rows bear out; where few rows had
/// more, it says so.
fn draw_scale(
    area: &DrawingArea<SVGBackend, Shift>,
    scale: &Quantity,
    cells: &Cells,
) -> Result<()> {
    let margin = style::MARGIN as i32;
    let (top, bottom) = (
        margin + style::TITLE_HEIGHT as i32,
        MAP_HEIGHT as i32 - margin - style::BELOW as i32,
    );
    let (left, right) = (90, 130);
    let steps = 64;
    let height = |step: i32| bottom - (bottom - top) * step / steps;
    for step in 0..steps {
        let shade = style::heat((f64::from(step) + 0.5) / f64::from(steps));
        let corners = [(left, height(step + 1)), (right, height(step))];
        area.draw(&Rectangle::new(corners, shade.filled()))
            .map_err(failed)?;
    }
    area.draw(&Rectangle::new(
        [(left, top), (right, bottom)],
        style::frame(),
    ))
    .map_err(failed)?;
    let most = scale.scaled(cells.most);
    let place = |value: f64| bottom - (f64::from(bottom - top) * share(value, most)) as i32;
    let mut numbers: Vec<(i32, String)> = round_numbers(most)
        .into_iter()
        .map(|value| (place(value), tick(value, most)))
        .collect();
    let mut all = cells.rms.iter().flatten();
    if all.any(|rms| *rms > cells.most) {
        numbers.retain(|(at, _)| at - top > 2 * style::NUMBER_SIZE as i32);
        numbers.push((top, format!("> {}", rounded(most))));
    }
    for (at, words) in numbers {
        let letters = style::letters(style::NUMBER_SIZE).pos(Pos::new(HPos::Left, VPos::Center));
        area.draw(&Text::new(words, (right + 10, at), letters))
            .map_err(failed)?;
    }
    let turned = style::letters(style::TEXT_SIZE)
        .transform(FontTransform::Rotate270)
        .pos(Pos::new(HPos::Center, VPos::Center));
    area.draw(&Text::new(
        scale.label(),
        (left - 36, (top + bottom) / 2),
        turned,
    ))
    .map_err(failed)
}

/// Where a condition holds, as stretches of its state in the units of the drawing.
fn stretches(condition: &Condition, quantity: &Quantity) -> Vec<(f64, f64)> {
    let low = condition.above.map(|v| quantity.scaled(v));
    let high = condition
        .below
        .map_or(f64::INFINITY, |v| quantity.scaled(v));
    if !condition.magnitude {
        return vec![(low.unwrap_or(f64::NEG_INFINITY), high)];
    }
    match low {
        Some(low) if low > 0.0 => vec![(-high, -low), (low, high)],
        _ => vec![(-high, high)],
    }
}

fn intersection(some: &[(f64, f64)], others: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let pairs = some.iter().flat_map(|a| others.iter().map(move |b| (a, b)));
    pairs
        .map(|(a, b)| (a.0.max(b.0), a.1.min(b.1)))
        .filter(|(low, high)| low < high)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::axis_history::Along;
    use crate::study::AxisKind;

    fn history(rows: u32) -> AxisHistory {
        let x: Vec<f64> = (0..rows)
            .map(|i| 2e-3 * (f64::from(i) * 0.37).sin())
            .collect();
        let measured = x.iter().map(|x| 10.0 * (x.abs() - 1e-3).max(0.0));
        AxisHistory {
            axis: "x".into(),
            kind: AxisKind::Translation,
            along: Along::Time,
            at: (0..rows).map(|i| 1e-3 * f64::from(i)).collect(),
            velocity: (0..rows)
                .map(|i| 0.1 * (f64::from(i) * 0.0723).cos())
                .collect(),
            measured: measured.collect(),
            predicted: vec![0.0; rows as usize],
            displacement: x,
        }
    }

    fn place(conditions: Vec<Condition>) -> FailingRegion {
        FailingRegion {
            axis: "x".into(),
            kind: "state",
            region: "|x| above 1.00 mm".into(),
            share_of_error: 0.9,
            share_of_rows: 0.3,
            extent: Extent::States(conditions),
        }
    }

    #[test]
    fn a_magnitude_is_framed_on_both_sides_and_a_velocity_halves_the_frames() {
        let beyond = Condition {
            state: 0,
            magnitude: true,
            above: Some(1e-3),
            below: None,
        };
        let rising = Condition {
            state: 1,
            magnitude: false,
            above: Some(0.0),
            below: None,
        };
        // A condition on another axis frames nothing here.
        let other = Condition { state: 2, ..beyond };
        let histories = [history(4000)];
        let frames = |conditions: Vec<Condition>| {
            let places = [place(conditions)];
            let plane = StatePlane {
                histories: &histories,
                axis: 0,
                places: &places,
            };
            let drawn = Plane {
                axis: "x".into(),
                force_unit: "N",
                across: Quantity::new("x", "m", 2e-3),
                up: Quantity::new("v", "m/s", 0.1),
                horizontal: (-2.0, 2.0),
                vertical: (-0.1, 0.1),
            };
            plane.regions(&drawn)[0].boxes.clone()
        };
        assert_eq!(
            frames(vec![beyond]),
            [[(-2.0, -0.1), (-1.0, 0.1)], [(1.0, -0.1), (2.0, 0.1)]]
        );
        assert_eq!(
            frames(vec![beyond, rising, other]),
            [[(-2.0, 0.0), (-1.0, 0.1)], [(1.0, 0.0), (2.0, 0.1)]]
        );
        let places = [place(vec![beyond])];
        let plane = StatePlane {
            histories: &histories,
            axis: 0,
            places: &places,
        };
        let svg = plane.svg().unwrap();
        assert!(svg.contains("A: 90 % of the error") && svg.contains("RMS residual of x (mN)"));
        let framed = format!("stroke=\"#{:02X}{:02X}{:02X}\"", 213, 94, 0);
        assert_eq!(svg.matches(&framed).count(), 2, "{svg}");
    }

    #[test]
    fn the_scale_has_round_numbers() {
        assert_eq!(round_numbers(13.6), [0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0]);
        assert_eq!(round_numbers(3.1), [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]);
        assert_eq!(round_numbers(73.0).last(), Some(&70.0));
        assert_eq!(
            round_numbers(1.0),
            [0.0, 0.2, 0.4, 0.6000000000000001, 0.8, 1.0]
        );
        assert_eq!(round_numbers(0.0), [0.0]);
    }

    #[test]
    fn nothing_to_draw_is_refused() {
        let empty = StatePlane {
            histories: &[history(0)],
            axis: 0,
            places: &[],
        };
        assert_eq!(empty.svg().unwrap_err().exit_code(), 3);
        let mut broken = history(100);
        broken.predicted[7] = f64::NAN;
        let plane = StatePlane {
            histories: &[broken],
            axis: 0,
            places: &[],
        };
        assert!(plane.svg().unwrap_err().sentence.contains("not finite"));
    }
}
