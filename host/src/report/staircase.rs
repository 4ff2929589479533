//! The staircase of errors: how far each added effect brings every axis, down to the noise floor.

use super::figure::failed;
use super::quantity::tick;
use super::style;
use crate::diagnose::PerAxis;
use crate::diagnose::apply::WITHOUT;
use crate::text::error::{Error, Result};
use crate::text::table::rounded;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// One step: what was done, and the error of every axis after it.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// What was done: `before`, `coulomb@x`, …
    pub label: String,
    /// RMS error over RMS force, per axis.
    pub errors: PerAxis,
}

/// Height of one axis's panel.
const PANEL_HEIGHT: u32 = 560;
/// Room below a panel for two lines of words.
const LABELS: u32 = 96;

/// A panel per axis: the error before and after every step as treads leading down, each with its
/// number, and the noise floor as the line where they must stop. The error's axis is logarithmic,
/// so that the way to the floor can be seen.
///
/// `floors` are relative errors like those of the steps; an axis of which no floor is known gets no
/// line.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when there is no step, or an axis has no error in one of
/// them.
pub fn staircase(axes: &[&str], steps: &[Step], floors: &PerAxis) -> Result<String> {
    if axes.is_empty() || steps.is_empty() {
        return Err(Error::data(
            "a staircase of errors needs an axis and a step",
        ));
    }
    let mut svg = String::new();
    {
        let size = (style::WIDTH, PANEL_HEIGHT * axes.len() as u32);
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE).map_err(failed)?;
        let areas = root.split_evenly((axes.len(), 1));
        for (area, axis) in areas.iter().zip(axes) {
            let mut treads = Vec::new();
            for step in steps {
                let error = step.errors.get(*axis).copied().unwrap_or(f64::NAN);
                if !error.is_finite() {
                    return Err(Error::data(format!(
                        "the staircase of errors has no number for {axis} after '{}'",
                        step.label
                    )));
                }
                treads.push((step.label.as_str(), 100.0 * error));
            }
            let floor = floors.get(*axis).filter(|f| f.is_finite() && **f > 0.0);
            panel(area, axis, &treads, floor.map(|f| 100.0 * f))?;
        }
        root.present().map_err(failed)?;
    }
    Ok(svg)
}

fn panel(
    area: &DrawingArea<SVGBackend, Shift>,
    axis: &str,
    treads: &[(&str, f64)],
    floor: Option<f64>,
) -> Result<()> {
    let (low, high) = ends(treads, floor);
    let count = treads.len() as f64;
    let mut chart = ChartBuilder::on(area)
        .margin(style::MARGIN)
        .margin_right(2 * style::MARGIN)
        .caption(
            format!("{axis}: error after every step, on a logarithmic axis"),
            style::letters(style::TEXT_SIZE),
        )
        .x_label_area_size(LABELS)
        .y_label_area_size(style::BESIDE + 20)
        .build_cartesian_2d(0.0..count, (low..high).log_scale())
        .map_err(failed)?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .x_labels(0)
        .y_labels(8)
        .max_light_lines(1)
        .light_line_style(TRANSPARENT)
        .bold_line_style(style::grid())
        .axis_style(style::frame())
        .label_style(style::letters(style::NUMBER_SIZE))
        .axis_desc_style(style::letters(style::TEXT_SIZE))
        .y_desc(format!("relative error of {axis} (%)"))
        .y_label_formatter(&|value| tick(*value, 4.0 * value))
        .draw()
        .map_err(failed)?;
    let height = |error: f64| error.max(low);
    let treads_of = || treads.iter().enumerate();
    let below = treads_of().map(|(index, (_, error))| {
        let corners = [(index as f64, low), (index as f64 + 1.0, height(*error))];
        Rectangle::new(corners, style::heat(0.12).filled())
    });
    chart.draw_series(below).map_err(failed)?;
    let edge = treads_of().flat_map(|(index, (_, error))| {
        [index as f64, index as f64 + 1.0].map(|x| (x, height(*error)))
    });
    let edge = PathElement::new(edge.collect::<Vec<_>>(), style::heat(0.8).stroke_width(5));
    chart.draw_series([edge]).map_err(failed)?;
    if let Some(floor) = floor {
        let line = PathElement::new([(0.0, floor), (count, floor)], style::MARK.stroke_width(4));
        chart.draw_series([line]).map_err(failed)?;
    }
    // Drawn last and on the whole area: the labels stand outside the plot itself.
    let (left, top) = area.get_base_pixel();
    for label in labels(treads, floor, low) {
        let (x, y) = chart.backend_coord(&label.at);
        let place = (x - left, y - top + label.lower);
        area.draw(&Text::new(label.text, place, label.letters))
            .map_err(failed)?;
    }
    Ok(())
}

/// The ends of the error's axis: room for the words below the floor and the numbers above the
/// treads; an axis without any error gets one to draw on.
fn ends(treads: &[(&str, f64)], floor: Option<f64>) -> (f64, f64) {
    let seen = treads.iter().map(|t| t.1).chain(floor).filter(|v| *v > 0.0);
    let (low, high) = seen.fold((f64::INFINITY, 0.0_f64), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    if high > 0.0 {
        (0.3 * low, 2.5 * high)
    } else {
        (0.01, 1.0)
    }
}

/// Words at a point of the panel, so many pixels lower.
struct Label {
    text: String,
    at: (f64, f64),
    lower: i32,
    letters: TextStyle<'static>,
}

/// The number above every tread, its name below the panel, and the noise floor's; `low` is the
/// panel's lower edge.
fn labels(treads: &[(&str, f64)], floor: Option<f64>, low: f64) -> Vec<Label> {
    let count = treads.len() as f64;
    let mut labels = Vec::new();
    let letters = |size, place| style::letters(size).pos(Pos::new(HPos::Center, place));
    let room = f64::from(style::WIDTH - style::BESIDE - 3 * style::MARGIN) / count;
    for (index, (label, error)) in treads.iter().enumerate() {
        let middle = index as f64 + 0.5;
        labels.push(Label {
            text: format!("{} %", rounded(*error)),
            at: (middle, error.max(low)),
            lower: -8,
            letters: letters(style::NUMBER_SIZE, VPos::Bottom),
        });
        for (line, text) in lines(label).into_iter().enumerate() {
            let size = style::fitting(&text, room, style::NUMBER_SIZE);
            labels.push(Label {
                text,
                at: (middle, low),
                lower: 14 + 36 * line as i32,
                letters: letters(size, VPos::Top),
            });
        }
    }
    if let Some(floor) = floor {
        labels.push(Label {
            text: format!("noise floor {} %", rounded(floor)),
            at: (0.02 * count, floor),
            lower: 10,
            letters: style::letters(style::NUMBER_SIZE)
                .color(&style::MARK)
                .pos(Pos::new(HPos::Left, VPos::Top)),
        });
    }
    labels
}

/// An effect and its axis on two lines; other words on one.
fn lines(label: &str) -> Vec<String> {
    match label.split_once('@') {
        Some((effect, axis)) if !label.contains(',') => {
            let sign = if label.starts_with(WITHOUT) { "" } else { "+ " };
            vec![format!("{sign}{effect}"), format!("on {axis}")]
        }
        _ => vec![label.to_string()],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(label: &str, x: f64, phi: f64) -> Step {
        Step {
            label: label.into(),
            errors: [("x".into(), x), ("phi".into(), phi)].into(),
        }
    }

    #[test]
    fn every_step_stands_with_its_number_and_the_floor_is_drawn_per_axis() {
        let steps = [
            step("before", 0.123, 0.02),
            step("coulomb@x", 0.0456, 0.02),
            step("clearance_coupling", 0.0051, 0.004),
        ];
        let floors: PerAxis = [("x".to_string(), 0.0048), ("phi".to_string(), 0.0039)].into();
        let svg = staircase(&["x", "phi"], &steps, &floors).unwrap();
        for words in [
            "12.3 %",
            "4.56 %",
            "0.510 %",
            "+ coulomb",
            "on x",
            "clearance_coupling",
            "noise floor 0.480 %",
            "noise floor 0.390 %",
            "relative error of phi (%)",
        ] {
            assert!(svg.contains(words), "{words} is missing");
        }
        let without = staircase(&["x", "phi"], &steps, &PerAxis::new()).unwrap();
        assert!(!without.contains("noise floor"));
    }

    #[test]
    fn steps_that_lack_an_axis_or_a_number_are_refused() {
        assert!(staircase(&["x"], &[], &PerAxis::new()).is_err());
        let mut missing = step("coulomb@x", 0.1, 0.1);
        missing.errors.remove("phi");
        let steps = [step("before", 0.2, 0.1), missing];
        let error = staircase(&["x", "phi"], &steps, &PerAxis::new()).unwrap_err();
        assert!(error.sentence.contains("phi"), "{error}");
    }
}
