//! Elements shared by the sheets: size, compass, colour bar and labels.
//!
//! Points and directions in link axes (m), sizes on the picture in pixels. Not here: the contents of
//! the sheets (`interface_sheet`, `deflection_sheet`, `stress_sheet`).

use nalgebra::Vector3;

use super::color;
use super::draw::{Align, Style};
use super::image::{Image, Rgb};
use super::scene::Mark;
use super::view::View;

/// Width of a sheet, pixels.
pub(super) const WIDTH: usize = 1600;
/// Height of a sheet, pixels.
pub(super) const HEIGHT: usize = 900;
/// Height of the heading, pixels.
pub(super) const HEAD: usize = 54;

/// Creates an empty sheet with its heading.
pub(super) fn sheet(title: &str, remark: &str) -> Image {
    let mut sheet = Image::new(WIDTH, HEIGHT, color::PAPER);
    let bold = Style::new(24.0, color::INK).bold();
    sheet.text(title, [24.0, 36.0], Align::Left, bold);
    sheet.text(remark, [WIDTH as f64 - 24.0, 35.0], Align::Right, Style::new(15.0, color::FAINT));
    sheet.fill(0.0, HEAD as f64 - 1.0, WIDTH as f64, 1.0, color::RULE);
    sheet
}

/// Draws the axes of the link frame in the lower left corner.
pub(super) fn compass(image: &mut Image, view: &View) {
    let length = 30.0;
    let origin = [46.0, image.height as f64 - 46.0];
    // Axes farther from the viewer are drawn first, so that nearer ones cover them.
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| view.toward[*a].total_cmp(&view.toward[*b]));
    for k in order {
        let direction = [view.right[k], -view.up[k]];
        let tip = [0, 1].map(|i| origin[i] + length * direction[i]);
        image.arrow(origin, tip, 2.0, color::axis(k));
        let label = [0, 1].map(|i| origin[i] + (length + 11.0) * direction[i] + [0.0, 5.0][i]);
        image.text(["x", "y", "z"][k], label, Align::Middle, Style::new(15.0, color::axis(k)).bold());
    }
}

/// Draws a name at a point of the link.
pub(super) fn label(image: &mut Image, view: &View, at: &Vector3<f64>, text: &str, size: f64, color: Rgb) {
    let [x, y, _] = view.project(at);
    let style = Style::new(size, color).bold().halo(color::PAPER);
    image.text(text, [x + 0.45 * size, y - 0.5 * size], Align::Left, style);
}

/// Draws the colour scale of magnitudes with labels at its ends and middle.
pub(super) fn color_bar(image: &mut Image, [left, top]: [f64; 2], width: f64, names: [&str; 3]) {
    let height = 11.0;
    for x in 0..width as usize {
        let value = x as f64 / (width - 1.0);
        image.fill(left + x as f64, top, 1.0, height, color::magnitude(value));
    }
    for (name, place) in names.into_iter().zip([0.0, 0.5, 1.0]) {
        let x = left + place * (width - 1.0);
        image.line([x, top + height], [x, top + height + 4.0], 1.0, color::INK, 1.0);
        image.text(name, [x, top + height + 17.0], Align::Middle, Style::new(13.0, color::INK));
    }
}

/// Draws a colour swatch in front of a line of text.
pub(super) fn swatch(image: &mut Image, [left, base]: [f64; 2], color: Rgb) {
    image.fill(left, base - 13.0, 15.0, 15.0, color);
}

/// Returns marks for edges.
pub(super) fn edges(
    positions: &[Vector3<f64>],
    edges: &[[u32; 2]],
    width: f64,
    color: Rgb,
    alpha: [f64; 2],
) -> impl Iterator<Item = Mark> {
    edges.iter().map(move |[a, b]| {
        let (from, to) = (positions[*a as usize], positions[*b as usize]);
        Mark::Line { from, to, width, color, alpha }
    })
}

/// Returns the marks of an arrow in space: a shaft and a head of four lines.
pub(super) fn arrow(from: Vector3<f64>, to: Vector3<f64>, width: f64, color: Rgb, alpha: [f64; 2]) -> Vec<Mark> {
    let line = |from, to| Mark::Line { from, to, width, color, alpha };
    let along = to - from;
    let side = along.cross(&Vector3::ith(along.iamin(), 1.0)).normalize() * (0.13 * along.norm());
    let other = along.cross(&side).normalize() * side.norm();
    let neck = to - along * 0.28;
    let strokes = [side, -side, other, -other].map(|s| line(to, neck + s));
    std::iter::once(line(from, to)).chain(strokes).collect()
}
