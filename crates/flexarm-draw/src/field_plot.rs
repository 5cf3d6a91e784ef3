//! A number over a plane of cells as a picture (SVG): colours with their scale, axes, marked places.
//!
//! Cells of one colour that are neighbours in a row are one rectangle, and finer grids than a picture can show are thinned to
//! the largest of what falls together: a page with many maps stays small.

use std::fmt::Write as _;

use crate::palette::{hex, magnitude};
use flexarm_settings::written::markup;

/// Most cells along an axis of the picture.
const MOST_CELLS: usize = 120;
/// Shades of the scale.
const SHADES: f64 = 48.0;
/// Longest side of the cells' field (pixels).
const FIELD: f64 = 300.0;
/// Room at the left, above, at the right with the scale, and below.
const ROOM: [f64; 4] = [52.0, 26.0, 86.0, 42.0];

/// A number over a plane.
#[derive(Clone, Debug, Default)]
pub struct FieldPlot<'a> {
    /// Above the picture.
    pub title: &'a str,
    /// What is on the horizontal and on the vertical axis.
    pub labels: [&'a str; 2],
    /// Centres of the first and of the last cell along both axes.
    pub ranges: [[f64; 2]; 2],
    /// Cells along both axes.
    pub count: [usize; 2],
    /// A number per cell, along the horizontal axis first; NaN stays white.
    pub values: &'a [f64],
    /// What the numbers are, beside the scale.
    pub value_label: &'a str,
    /// Numbers of the first and last colour; those of the values without it.
    pub scale: Option<[f64; 2]>,
    /// Whether a unit is as long on both axes.
    pub equal: bool,
    /// Rectangles to be outlined: lower left and upper right corner.
    pub outlines: &'a [[[f64; 2]; 2]],
    /// Places to be marked, each with a letter.
    pub marks: &'a [([f64; 2], &'a str)],
}

impl FieldPlot<'_> {
    /// The text of an SVG file; empty if there is no finite number.
    #[must_use]
    pub fn svg(&self) -> String {
        let finite = || self.values.iter().copied().filter(|x| x.is_finite());
        let [low, high] = self
            .scale
            .unwrap_or_else(|| [finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max)]);
        if !(low.is_finite() && high.is_finite()) || self.count.contains(&0) {
            return String::new();
        }
        let field = self.field();
        let (width, height) = (ROOM[0] + field[0] + ROOM[2], ROOM[1] + field[1] + ROOM[3]);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" width=\"{width:.0}\" \
             font-family=\"system-ui, sans-serif\" font-size=\"11\" fill=\"#1c2530\">\n<text x=\"{:.1}\" y=\"15\" font-size=\"12\" \
             font-weight=\"600\">{}</text>\n",
            ROOM[0],
            markup(self.title)
        );
        self.cells(&mut svg, field, low, high);
        self.axes(&mut svg, field);
        self.overlays(&mut svg, field);
        scale_bar(&mut svg, field, low, high, self.value_label);
        svg + "</svg>\n"
    }

    /// Size of the field (pixels).
    fn field(&self) -> [f64; 2] {
        let span = [0, 1].map(|c| self.edge(c)[1] - self.edge(c)[0]);
        if !self.equal || span.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
            return [FIELD, FIELD];
        }
        let longest = span[0].max(span[1]);
        span.map(|s| (FIELD * s / longest).max(12.0))
    }

    /// Where the cells begin and end along an axis.
    fn edge(&self, axis: usize) -> [f64; 2] {
        let [first, last] = self.ranges[axis];
        let half = match self.count[axis] {
            0 | 1 => 0.5 * (last - first).abs().max(1e-9),
            n => 0.5 * (last - first) / (n - 1) as f64,
        };
        [first - half, last + half]
    }

    /// Place in the picture of a coordinate.
    fn at(&self, axis: usize, value: f64, field: [f64; 2]) -> f64 {
        let [first, last] = self.edge(axis);
        let share = (value - first) / (last - first);
        if axis == 0 { ROOM[0] + share * field[0] } else { ROOM[1] + (1.0 - share) * field[1] }
    }

    fn cells(&self, svg: &mut String, field: [f64; 2], low: f64, high: f64) {
        let every = [0, 1].map(|c| self.count[c].div_ceil(MOST_CELLS));
        let shown = [0, 1].map(|c| self.count[c].div_ceil(every[c]));
        let cell = [0, 1].map(|c| field[c] * every[c] as f64 / self.count[c] as f64);
        let shade = |i: usize, j: usize| -> Option<u8> {
            let mut largest = f64::NEG_INFINITY;
            for y in j * every[1]..((j + 1) * every[1]).min(self.count[1]) {
                for x in i * every[0]..((i + 1) * every[0]).min(self.count[0]) {
                    let value = self.values[x + self.count[0] * y];
                    largest = if value.is_finite() { largest.max(value) } else { largest };
                }
            }
            let share = if high > low { (largest - low) / (high - low) } else { 0.5 };
            largest.is_finite().then(|| (share.clamp(0.0, 1.0) * SHADES).round() as u8)
        };
        let _ = writeln!(svg, "<g shape-rendering=\"crispEdges\">");
        for j in 0..shown[1] {
            let mut i = 0;
            while i < shown[0] {
                let color = shade(i, j);
                let first = i;
                while i < shown[0] && shade(i, j) == color {
                    i += 1;
                }
                let Some(color) = color else { continue };
                let (x, w) = (ROOM[0] + first as f64 * cell[0], (i - first) as f64 * cell[0]);
                let y = ROOM[1] + field[1] - (j + 1) as f64 * cell[1];
                let fill = hex(magnitude(f64::from(color) / SHADES));
                let (y, w) = (y.max(ROOM[1]), w.min(ROOM[0] + field[0] - x));
                let _ = writeln!(
                    svg,
                    "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{fill}\"/>",
                    w + 0.2,
                    cell[1] + 0.2
                );
            }
        }
        svg.push_str("</g>\n");
    }

    fn axes(&self, svg: &mut String, field: [f64; 2]) {
        let (left, top, bottom) = (ROOM[0], ROOM[1], ROOM[1] + field[1]);
        let _ = writeln!(
            svg,
            "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"none\" stroke=\"#8c929c\"/>",
            field[0], field[1]
        );
        for tick in ticks(self.edge(0)) {
            let x = self.at(0, tick, field);
            let _ = writeln!(
                svg,
                "<path d=\"M{x:.1} {bottom:.1}v4\" stroke=\"#8c929c\"/><text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                bottom + 15.0,
                number(tick)
            );
        }
        for tick in ticks(self.edge(1)) {
            let y = self.at(1, tick, field);
            let _ = writeln!(
                svg,
                "<path d=\"M{left:.1} {y:.1}h-4\" stroke=\"#8c929c\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                left - 6.0,
                y + 4.0,
                number(tick)
            );
        }
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\n<text transform=\"translate(12 {:.1}) rotate(-90)\" \
             text-anchor=\"middle\">{}</text>",
            left + 0.5 * field[0],
            bottom + 32.0,
            markup(self.labels[0]),
            top + 0.5 * field[1],
            markup(self.labels[1])
        );
    }

    fn overlays(&self, svg: &mut String, field: [f64; 2]) {
        for [low, high] in self.outlines {
            let (x, y) = (self.at(0, low[0], field), self.at(1, high[1], field));
            let (w, h) = (self.at(0, high[0], field) - x, self.at(1, low[1], field) - y);
            let _ = writeln!(
                svg,
                "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{w:.1}\" height=\"{h:.1}\" fill=\"none\" stroke=\"#fff\" stroke-width=\"4\"/>\
                 <rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{w:.1}\" height=\"{h:.1}\" fill=\"none\" stroke=\"#c8003c\" stroke-width=\"2\"/>"
            );
        }
        for (place, letter) in self.marks {
            let (x, y) = (self.at(0, place[0], field), self.at(1, place[1], field));
            let _ = writeln!(
                svg,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"8\" fill=\"#fff\" stroke=\"#1c2530\"/><text x=\"{x:.1}\" y=\"{:.1}\" \
                 text-anchor=\"middle\" font-weight=\"700\">{}</text>",
                y + 4.0,
                markup(letter)
            );
        }
    }
}

fn scale_bar(svg: &mut String, field: [f64; 2], low: f64, high: f64, label: &str) {
    let (left, height) = (ROOM[0] + field[0] + 14.0, field[1].max(80.0));
    let steps = 24;
    for k in 0..steps {
        let share = (f64::from(k) + 0.5) / f64::from(steps);
        let y = ROOM[1] + height * (1.0 - f64::from(k + 1) / f64::from(steps));
        let _ = writeln!(
            svg,
            "<rect x=\"{left:.1}\" y=\"{y:.1}\" width=\"12\" height=\"{:.1}\" fill=\"{}\"/>",
            height / f64::from(steps) + 0.3,
            hex(magnitude(share))
        );
    }
    for share in [0.0, 0.5, 1.0] {
        let y = ROOM[1] + height * (1.0 - share) + 4.0;
        let value = number_of_three_digits(low + share * (high - low));
        let _ = writeln!(svg, "<text x=\"{:.1}\" y=\"{y:.1}\">{value}</text>", left + 16.0);
    }
    let _ = writeln!(svg, "<text x=\"{left:.1}\" y=\"{:.1}\">{}</text>", ROOM[1] - 8.0, markup(label));
}

/// Round numbers within a range.
fn ticks([low, high]: [f64; 2]) -> Vec<f64> {
    let span = high - low;
    if !(span > 0.0 && span.is_finite()) {
        return vec![low];
    }
    let power = 10_f64.powf((span / 5.0).log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|f| f * power);
    let step = steps.into_iter().find(|step| span / step <= 6.0).unwrap_or(10.0 * power);
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    (first..=last).map(|k| k as f64 * step).collect()
}

fn number(x: f64) -> String {
    let text = format!("{x:.6}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text.is_empty() || text == "-0" { "0".to_owned() } else { text.to_owned() }
}

fn number_of_three_digits(x: f64) -> String {
    let size = x.abs();
    match size {
        _ if size == 0.0 => "0".to_owned(),
        _ if !(1e-3..1e5).contains(&size) => format!("{x:.2e}"),
        _ => format!("{x:.*}", (2 - size.log10().floor() as i64).clamp(0, 6) as usize),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(values: &[f64], count: [usize; 2]) -> FieldPlot<'_> {
        FieldPlot { ranges: [[0.0, 1.0], [0.0, 2.0]], count, values, equal: true, ..FieldPlot::default() }
    }

    #[test]
    fn equal_neighbours_are_one_rectangle_and_holes_are_none() {
        let cells = |svg: &str| svg.split("</g>").next().unwrap().matches("<rect").count();
        assert_eq!(cells(&map(&[1.0; 12], [4, 3]).svg()), 3);
        let mut values = [1.0; 12];
        values[5] = f64::NAN;
        assert_eq!(cells(&map(&values, [4, 3]).svg()), 4);
        assert_eq!(map(&[f64::NAN; 12], [4, 3]).svg(), "");
    }

    #[test]
    fn the_largest_value_has_the_lightest_colour_and_the_lowest_row_is_below() {
        let svg = map(&[0.0, 0.0, 0.0, 1.0], [2, 2]).svg();
        let lightest = hex(magnitude(1.0));
        let cells = svg.split("</g>").next().unwrap();
        let line = cells.lines().find(|line| line.contains(&lightest)).unwrap();
        // Upper right: at the top of the field.
        assert!(line.contains(&format!("y=\"{:.1}\"", ROOM[1])), "{line}");
    }

    #[test]
    fn ticks_are_round_and_within() {
        let near = |found: Vec<f64>, wanted: &[f64]| {
            assert!(
                found.len() == wanted.len() && found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-9),
                "{found:?}"
            );
        };
        near(ticks([-1.05, 1.05]), &[-1.0, -0.5, 0.0, 0.5, 1.0]);
        near(ticks([0.0, 0.3]), &[0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3]);
        assert_eq!(number(-0.0), "0");
        assert_eq!(number_of_three_digits(0.012_345), "0.0123");
    }
}
