//! Drawing on an image: lines, text, boxes. Edges are smooth by their share of each pixel.

use super::font;
use super::image::{Image, Rgb};

/// Height of a capital over the size of the text.
const CAPITAL: f64 = 0.72;
/// Glyphs are narrower than their square grid.
const NARROW: f64 = 0.9;

/// Calls with every pixel that a line of round ends covers: `(x, y, place along the line from 0 to 1, share)`.
pub(super) fn cover_line(
    size: [usize; 2],
    from: [f64; 2],
    to: [f64; 2],
    width: f64,
    mut call: impl FnMut(usize, usize, f64, f64),
) {
    let radius = width / 2.0;
    let reach = radius + 1.0;
    let range = |k: usize| {
        let low = (from[k].min(to[k]) - reach).floor().max(0.0) as usize;
        let high = (from[k].max(to[k]) + reach).ceil().min(size[k] as f64).max(0.0) as usize;
        low..high
    };
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let length2 = dx * dx + dy * dy;
    // Thinner than a pixel: full width, less colour.
    let strength = width.min(1.0);
    let solid = radius.max(0.5);
    for y in range(1) {
        // Of a long line only the stretch near this row.
        let (mut low, mut high) = (range(0).start, range(0).end);
        if dy.abs() > 1e-9 {
            let row = y as f64 + 0.5 - from[1];
            let slack = reach * (1.0 + length2.sqrt() / dy.abs());
            let middle = from[0] + dx * row / dy;
            low = low.max((middle - slack).floor().max(0.0) as usize);
            high = high.min((middle + slack).ceil().max(0.0) as usize);
        }
        for x in low..high {
            let (px, py) = (x as f64 + 0.5 - from[0], y as f64 + 0.5 - from[1]);
            let along = if length2 > 0.0 { ((px * dx + py * dy) / length2).clamp(0.0, 1.0) } else { 0.0 };
            let distance = (px - along * dx).hypot(py - along * dy);
            let share = (solid + 0.5 - distance).clamp(0.0, 1.0) * strength;
            if share > 0.0 {
                call(x, y, along, share);
            }
        }
    }
}

/// Where text stands against its anchor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Align {
    Left,
    Middle,
    Right,
}

/// Size and colour of text.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Style {
    /// Pixels from one line of text to the next, about.
    pub(crate) size: f64,
    pub(crate) color: Rgb,
    pub(crate) bold: bool,
    /// A rim of this colour, for text on pictures.
    pub(crate) halo: Option<Rgb>,
}

impl Style {
    pub(crate) fn new(size: f64, color: Rgb) -> Self {
        Self { size, color, bold: false, halo: None }
    }

    pub(crate) fn bold(self) -> Self {
        Self { bold: true, ..self }
    }

    pub(crate) fn halo(self, color: Rgb) -> Self {
        Self { halo: Some(color), ..self }
    }

    fn unit(self) -> f64 {
        self.size * CAPITAL / font::CAPITAL
    }
}

/// Width of a line of text, pixels.
pub(crate) fn text_width(text: &str, style: Style) -> f64 {
    let units: f64 = text.chars().map(font::advance).sum();
    (units - font::GAP).max(0.0) * style.unit() * NARROW
}

/// Text in lines of at most `width` pixels, broken at spaces.
pub(super) fn wrap(text: &str, width: f64, style: Style) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if text_width(&format!("{line} {word}"), style) <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

impl Image {
    /// A straight line with round ends.
    pub(crate) fn line(&mut self, from: [f64; 2], to: [f64; 2], width: f64, color: Rgb, alpha: f64) {
        cover_line([self.width, self.height], from, to, width, |x, y, _, share| {
            self.blend(x, y, color, (alpha * share) as f32);
        });
    }

    /// A filled box.
    pub(crate) fn fill(&mut self, left: f64, top: f64, width: f64, height: f64, color: Rgb) {
        for y in top.max(0.0) as usize..((top + height).max(0.0) as usize).min(self.height) {
            for x in left.max(0.0) as usize..((left + width).max(0.0) as usize).min(self.width) {
                self.blend(x, y, color, 1.0);
            }
        }
    }

    /// One line of text; (`x`, `y`) is on its base line.
    pub(crate) fn text(&mut self, text: &str, [x, y]: [f64; 2], align: Align, style: Style) {
        let start = match align {
            Align::Left => x,
            Align::Middle => x - text_width(text, style) / 2.0,
            Align::Right => x - text_width(text, style),
        };
        let unit = style.unit();
        let width = style.size * if style.bold { 0.125 } else { 0.082 };
        if let Some(halo) = style.halo {
            self.strokes(text, [start, y], unit, width + 0.28 * style.size, halo);
        }
        self.strokes(text, [start, y], unit, width, style.color);
    }

    fn strokes(&mut self, text: &str, [mut x, y]: [f64; 2], unit: f64, width: f64, color: Rgb) {
        for glyph in text.chars() {
            let place = |(u, v): (f64, f64)| [x + u * unit * NARROW, y - (v - font::BASE) * unit];
            for line in font::polylines(glyph).filter(|_| glyph != ' ') {
                let points: Vec<_> = line.into_iter().map(place).collect();
                if let [point] = points[..] {
                    self.line(point, point, width * 1.2, color, 1.0);
                }
                for pair in points.windows(2) {
                    self.line(pair[0], pair[1], width, color, 1.0);
                }
            }
            x += font::advance(glyph) * unit * NARROW;
        }
    }

    /// An arrow on the picture: a line with a head of two strokes.
    pub(crate) fn arrow(&mut self, from: [f64; 2], to: [f64; 2], width: f64, color: Rgb) {
        self.line(from, to, width, color, 1.0);
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let length = dx.hypot(dy);
        if length < 2.0 * width {
            return;
        }
        let head = (3.5 * width).min(length);
        let (ex, ey) = (dx / length * head, dy / length * head);
        for side in [-0.45, 0.45] {
            self.line(to, [to[0] - ex - side * ey, to[1] - ey + side * ex], width, color, 1.0);
        }
    }
}
