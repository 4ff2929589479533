//! A curve drawn with characters: for a terminal, and for pages that hold no pictures.
//!
//! Every character cell holds two by four Braille dots, so a plot of 56 by 12 characters has 112 by
//! 48 dots.

use std::fmt::Write;

/// Where Unicode's Braille patterns begin; each of the eight low bits is a dot.
const BRAILLE: u32 = 0x2800;
/// The bit of each dot, by row from the top and column from the left.
const DOTS: [[u32; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];

/// A plot of y over x, its size in characters without the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextPlot<'a> {
    /// Characters of a line.
    pub width: usize,
    /// Lines of text that the plot takes.
    pub height: usize,
    /// What is drawn to the right.
    pub x: &'a str,
    /// What is drawn upwards.
    pub y: &'a str,
}

impl TextPlot<'_> {
    /// Draws a curve through points (x, y), point to point; points that are not finite are left
    /// out.
    ///
    /// Both scales are symmetric about 0, which a dotted cross marks.
    pub fn draw(&self, points: &[(f64, f64)]) -> String {
        let reach = |pick: fn(&(f64, f64)) -> f64| {
            let sizes = points
                .iter()
                .map(|p| pick(p).abs())
                .filter(|v| v.is_finite());
            let most = sizes.fold(0.0, f64::max);
            if most > 0.0 { most } else { 1.0 }
        };
        let (right, top) = (reach(|p| p.0), reach(|p| p.1));
        let (columns, rows) = (2 * self.width, 4 * self.height);
        let mut cells = vec![0_u32; self.width * self.height];
        let mut dot = |column: usize, row: usize| {
            cells[row / 4 * self.width + column / 2] |= DOTS[row % 4][column % 2];
        };
        // The cross: every fourth dot.
        for column in (0..columns).step_by(4) {
            dot(column, rows / 2);
        }
        for row in (0..rows).step_by(4) {
            dot(columns / 2, row);
        }
        let place = |value: f64, reach: f64, dots: usize| {
            0.5 * (value / reach + 1.0) * (dots.saturating_sub(1)) as f64
        };
        let at = |p: &(f64, f64)| (place(p.0, right, columns), place(-p.1, top, rows));
        let finite = |p: &&(f64, f64)| p.0.is_finite() && p.1.is_finite();
        let kept: Vec<(f64, f64)> = points.iter().filter(finite).map(at).collect();
        let ends = kept.iter().zip(kept.iter().skip(1).chain(kept.last()));
        for (&(a, b), &(c, d)) in ends {
            let steps = (c - a).abs().max((d - b).abs()).ceil().max(1.0);
            for step in 0..=steps as usize {
                let t = step as f64 / steps;
                dot(
                    (a + t * (c - a)).round() as usize,
                    (b + t * (d - b)).round() as usize,
                );
            }
        }
        self.framed(&cells, right, top)
    }

    fn framed(&self, cells: &[u32], right: f64, top: f64) -> String {
        let (high, low) = (format!("{top:.3}"), format!("{:.3}", -top));
        let margin = high.len().max(low.len());
        let mut text = format!("{:margin$} {}\n", "", self.y);
        for (number, line) in cells.chunks(self.width.max(1)).enumerate() {
            let label = match number {
                0 => high.as_str(),
                n if n + 1 == self.height => low.as_str(),
                _ => "",
            };
            let line = line
                .iter()
                .filter_map(|bits| char::from_u32(BRAILLE + bits));
            let _ = writeln!(text, "{label:>margin$} │{}", line.collect::<String>());
        }
        let _ = writeln!(text, "{:margin$} └{}", "", "─".repeat(self.width));
        let (left, right) = (format!("{:.3}", -right), format!("{right:.3}"));
        let between = self.width.saturating_sub(left.len() + right.len());
        let _ = write!(text, "{:margin$}  {left}{:^between$}{right}", "", self.x);
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLOT: TextPlot<'_> = TextPlot {
        width: 20,
        height: 4,
        x: "x",
        y: "y",
    };

    #[test]
    fn a_rising_line_ends_in_the_corners() {
        let text = PLOT.draw(&[(-2.0, -5.0), (2.0, 5.0)]);
        let lines: Vec<Vec<char>> = text.lines().map(|l| l.chars().collect()).collect();
        assert_eq!(lines.len(), 7, "{text}");
        let bits = |c: char| u32::from(c) - BRAILLE;
        let (first, last) = (&lines[1], &lines[4]);
        assert_ne!(bits(*first.last().unwrap()) & DOTS[0][1], 0, "{text}");
        let start = last.iter().position(|c| *c == '│').unwrap() + 1;
        assert_ne!(bits(last[start]) & DOTS[3][0], 0, "{text}");
        assert!(text.contains("5.000") && text.contains("-2.000"), "{text}");
    }

    #[test]
    fn nothing_and_numbers_that_are_none_draw_only_the_cross() {
        let empty = PLOT.draw(&[]);
        assert_eq!(empty, PLOT.draw(&[(f64::NAN, 1.0), (1.0, f64::INFINITY)]));
        assert_eq!(empty.lines().count(), 7);
    }
}
