//! How the drawings look: sizes, letters, greys and line styles, in one place.

use plotters::style::{Color, FontFamily, IntoFont, RGBColor, ShapeStyle, TextStyle};

/// Width of every figure in drawing units; a page shows it at about half this size.
pub(super) const WIDTH: u32 = 1600;
/// Height of a row of panels.
pub(super) const ROW_HEIGHT: u32 = 460;
/// Height of the legend below the panels.
pub(super) const LEGEND_HEIGHT: u32 = 56;
/// Space around a panel.
pub(super) const MARGIN: u32 = 14;
/// Space for the numbers and the description of the horizontal axis.
pub(super) const BELOW: u32 = 74;
/// The same for the vertical axis.
pub(super) const BESIDE: u32 = 112;
/// Height of a panel's title.
pub(super) const TITLE_HEIGHT: u32 = 44;
/// Letters of titles, descriptions and the legend.
pub(super) const TEXT_SIZE: u32 = 30;
/// Letters of the numbers along the axes.
pub(super) const NUMBER_SIZE: u32 = 26;

const GRID: RGBColor = RGBColor(225, 225, 225);
const FRAME: RGBColor = RGBColor(90, 90, 90);
const TEXT: RGBColor = RGBColor(0, 0, 0);

/// What a curve shows; decides how it is drawn.
///
/// The paper draws a solid line for what was measured and a dash-dot line for the model. Here the solid line is broad and
/// grey besides, so that both can be seen where they coincide.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pen {
    /// Measured, beside a model: broad, grey, solid.
    Measured,
    /// The model: narrow, black, dash-dot.
    Model,
    /// A curve by itself: narrow, dark, solid.
    Alone,
}

impl Pen {
    /// Every shade belongs to one pen alone: [`with_dashes`] finds the curves by it.
    fn shade(self) -> RGBColor {
        match self {
            Self::Measured => RGBColor(176, 176, 177),
            Self::Model => RGBColor(1, 1, 2),
            Self::Alone => RGBColor(51, 51, 52),
        }
    }

    fn width(self) -> u32 {
        match self {
            Self::Measured => 5,
            Self::Model => 2,
            Self::Alone => 1,
        }
    }

    fn dashes(self) -> Option<&'static str> {
        match self {
            Self::Model => Some("14 5 3 5"),
            Self::Measured | Self::Alone => None,
        }
    }

    pub(super) fn stroke(self) -> ShapeStyle {
        self.shade().stroke_width(self.width())
    }
}

/// Gives the dash-dot curves of a finished drawing their dashes.
///
/// plotters can only chop a curve into one element per dash, which makes files ten times as large; SVG itself knows dashes.
pub(super) fn with_dashes(svg: &str) -> String {
    let mut text = svg.to_owned();
    for pen in [Pen::Measured, Pen::Model, Pen::Alone] {
        if let Some(dashes) = pen.dashes() {
            let RGBColor(r, g, b) = pen.shade();
            let stroke = format!("stroke=\"#{r:02X}{g:02X}{b:02X}\"");
            text = text.replace(&stroke, &format!("{stroke} stroke-dasharray=\"{dashes}\""));
        }
    }
    // Corners of a curve are rounded: the spikes of a pointed corner would show forces that nobody measured.
    text.replace(
        "<polyline fill=\"none\"",
        "<polyline stroke-linejoin=\"round\" fill=\"none\"",
    )
}

pub(super) fn letters(size: u32) -> TextStyle<'static> {
    // A family that every viewer has, and letters that stay letters: nothing is drawn as outlines.
    (FontFamily::SansSerif, size).into_font().color(&TEXT)
}

pub(super) fn grid() -> ShapeStyle {
    GRID.stroke_width(1)
}

pub(super) fn frame() -> ShapeStyle {
    FRAME.stroke_width(2)
}
