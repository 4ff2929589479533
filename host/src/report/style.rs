//! How the drawings look: sizes, letters, greys and line styles, in one place.

use plotters::style::{Color, FontFamily, IntoFont, RGBAColor, RGBColor, ShapeStyle, TextStyle};

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

/// What marks a failing region, a shaded stretch or a line to be reached: vermilion, which stands
/// out from blues and greys for every kind of colour vision (M. Okabe, K. Ito, Color Universal
/// Design, 2008).
pub(super) const MARK: RGBColor = RGBColor(213, 94, 0);
/// The lightest, the middle and the darkest shade of a heat map, blue: the order shows in the
/// lightness alone.
const HEAT: [RGBColor; 3] = [
    RGBColor(236, 243, 250),
    RGBColor(86, 148, 200),
    RGBColor(3, 28, 74),
];

/// The shade of a value between 0 (least) and 1 (most).
pub(super) fn heat(share: f64) -> RGBColor {
    let share = share.clamp(0.0, 1.0);
    let (from, to, part) = if share < 0.5 {
        (HEAT[0], HEAT[1], 2.0 * share)
    } else {
        (HEAT[1], HEAT[2], 2.0 * share - 1.0)
    };
    let mix = |a: u8, b: u8| (f64::from(a) + part * (f64::from(b) - f64::from(a))).round() as u8;
    RGBColor(mix(from.0, to.0), mix(from.1, to.1), mix(from.2, to.2))
}

/// The fill of a stretch that is marked.
pub(super) fn shade() -> ShapeStyle {
    let RGBColor(r, g, b) = MARK;
    RGBAColor(r, g, b, 0.22).filled()
}

/// What a curve shows; decides how it is drawn.
///
/// The paper draws a solid line for what was measured and a dash-dot line for the model. Here the
/// solid line is broad and grey besides, so that both can be seen where they coincide.
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
/// plotters can only chop a curve into one element per dash, which makes files ten times as large;
/// SVG itself knows dashes.
pub(super) fn with_dashes(svg: &str) -> String {
    let mut text = svg.to_owned();
    for pen in [Pen::Measured, Pen::Model, Pen::Alone] {
        if let Some(dashes) = pen.dashes() {
            let RGBColor(r, g, b) = pen.shade();
            let stroke = format!("stroke=\"#{r:02X}{g:02X}{b:02X}\"");
            text = text.replace(&stroke, &format!("{stroke} stroke-dasharray=\"{dashes}\""));
        }
    }
    // Corners of a curve are rounded: the spikes of a pointed corner would show forces that nobody
    // measured.
    text.replace(
        "<polyline fill=\"none\"",
        "<polyline stroke-linejoin=\"round\" fill=\"none\"",
    )
}

pub(super) fn letters(size: u32) -> TextStyle<'static> {
    // A family that every viewer has, and letters that stay letters: nothing is drawn as outlines.
    (FontFamily::SansSerif, size).into_font().color(&TEXT)
}

/// The size of letters, at most `size`, at which a line of words fits into `room` drawing units;
/// still readable ones where it does not.
pub(super) fn fitting(words: &str, room: f64, size: u32) -> u32 {
    // A letter of a sans-serif face is a little over half as wide as high.
    let wanted = room / (0.56 * words.chars().count().max(1) as f64);
    (wanted as u32).clamp(14, size)
}

pub(super) fn grid() -> ShapeStyle {
    GRID.stroke_width(1)
}

pub(super) fn frame() -> ShapeStyle {
    FRAME.stroke_width(2)
}
