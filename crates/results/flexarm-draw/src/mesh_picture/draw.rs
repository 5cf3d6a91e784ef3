//! Drawing on an image: lines, text, boxes. Edges are antialiased by pixel coverage.
//!
//! Start at [`Image::line`] and [`Image::text`]. Coordinates are pixels from the top left; the
//! centre of the first pixel is at (0.5, 0.5). Not here: triangles in space ([`super::scene`]).

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, RasterizedChar, get_raster, get_raster_width};

use super::image::{Image, Rgb};

/// Raster from which text of any size is scaled. Below: its height over the text size, and the row
/// of its baseline.
const RASTER: RasterHeight = RasterHeight::Size32;
const RASTER_HEIGHT: f64 = 1.2;
const BASE: f64 = 25.0;

/// Calls with every pixel that a line with round ends covers:
/// `(x, y, position along the line from 0 to 1, coverage)`.
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
    // Lines thinner than a pixel: full width, less opacity.
    let strength = width.min(1.0);
    let solid = radius.max(0.5);
    for y in range(1) {
        // For a long line only the stretch near this row.
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

/// Alignment of text relative to its anchor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Align {
    Left,
    Middle,
    Right,
}

/// Size and colour of text.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Style {
    /// Approximate line spacing (pixels).
    pub(crate) size: f64,
    pub(crate) color: Rgb,
    pub(crate) bold: bool,
    /// Colour of a rim, for text on pictures.
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

    fn weight(self) -> FontWeight {
        if self.bold { FontWeight::Bold } else { FontWeight::Regular }
    }

    /// Pixels of the image per pixel of the raster.
    fn scale(self) -> f64 {
        self.size * RASTER_HEIGHT / RASTER.val() as f64
    }
}

/// Returns the width of a line of text, pixels.
pub(crate) fn text_width(text: &str, style: Style) -> f64 {
    (text.chars().count() * get_raster_width(style.weight(), RASTER)) as f64 * style.scale()
}

/// Returns the coverage at a point of a glyph, from 0 to 1, interpolated between pixel centres.
fn ink(glyph: &RasterizedChar, x: f64, y: f64) -> f64 {
    let (x, y) = (x - 0.5, y - 0.5);
    let part = |dx: f64, dy: f64| {
        let (column, row) = (x.floor() + dx, y.floor() + dy);
        let weight = (1.0 - (x - column).abs()) * (1.0 - (y - row).abs());
        let is_inside = column >= 0.0 && row >= 0.0;
        let pixel = is_inside.then(|| glyph.pixel(column as usize, row as usize)).flatten();
        weight * f64::from(pixel.unwrap_or(0)) / 255.0
    };
    part(0.0, 0.0) + part(1.0, 0.0) + part(0.0, 1.0) + part(1.0, 1.0)
}

/// Splits text at spaces into lines of at most `width` pixels.
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
    /// Draws a straight line with round ends.
    pub(crate) fn line(&mut self, from: [f64; 2], to: [f64; 2], width: f64, color: Rgb, alpha: f64) {
        cover_line([self.width, self.height], from, to, width, |x, y, _, share| {
            self.blend(x, y, color, (alpha * share) as f32);
        });
    }

    /// Fills a box.
    pub(crate) fn fill(&mut self, left: f64, top: f64, width: f64, height: f64, color: Rgb) {
        for y in top.max(0.0) as usize..((top + height).max(0.0) as usize).min(self.height) {
            for x in left.max(0.0) as usize..((left + width).max(0.0) as usize).min(self.width) {
                self.blend(x, y, color, 1.0);
            }
        }
    }

    /// Draws one line of text; (`x`, `y`) is on its baseline.
    pub(crate) fn text(&mut self, text: &str, [x, y]: [f64; 2], align: Align, style: Style) {
        let start = match align {
            Align::Left => x,
            Align::Middle => x - text_width(text, style) / 2.0,
            Align::Right => x - text_width(text, style),
        };
        if let Some(halo) = style.halo {
            self.each_inked(text, [start, y], style, |image, [x, y], ink| {
                let at = [x as f64 + 0.5, y as f64 + 0.5];
                image.line(at, at, 0.28 * style.size, halo, ink);
            });
        }
        self.each_inked(text, [start, y], style, |image, [x, y], ink| image.blend(x, y, style.color, ink as f32));
    }

    /// Calls with each pixel that text covers, and its coverage.
    fn each_inked(
        &mut self,
        text: &str,
        [x, y]: [f64; 2],
        style: Style,
        mut call: impl FnMut(&mut Self, [usize; 2], f64),
    ) {
        let scale = style.scale();
        let step = get_raster_width(style.weight(), RASTER) as f64 * scale;
        let (first, top) = (x.round(), (y - BASE * scale).round());
        for (k, letter) in text.chars().enumerate() {
            let raster = |letter| get_raster(letter, style.weight(), RASTER);
            let Some(glyph) = raster(letter).or_else(|| raster('?')) else { continue };
            let left = first + k as f64 * step;
            for y in top.max(0.0) as usize..(top + scale * glyph.height() as f64).max(0.0).ceil() as usize {
                for x in left.max(0.0) as usize..(left + step).max(0.0).ceil() as usize {
                    let place = [(x as f64 + 0.5 - left) / scale, (y as f64 + 0.5 - top) / scale];
                    let ink = ink(&glyph, place[0], place[1]);
                    if ink > 0.0 {
                        call(self, [x, y], ink);
                    }
                }
            }
        }
    }

    /// Draws an arrow on the picture: a line with a head of two lines.
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
