//! Legend of a picture: axes, colour scale and caption.
//!
//! Sizes are multiples of `unit` (pixels); shares are of the maximum deviation. Not here: the arm
//! itself (`skin.rs`), colour maps (`mesh_picture/color.rs`).

use crate::mesh_picture::draw::{Align, Style, text_width};
use crate::mesh_picture::{Image, Rgb, View, color};
use flexarm_sample::RunHeader;

/// Colour of the rigid twin.
pub(super) const GHOST: Rgb = [196, 202, 212];
/// Transparency of the rigid twin.
pub(super) const GHOST_FADE: f64 = 0.35;
/// Colour of the arrow at the TCP: vermilion, which is not on the colour scale.
pub const ARROW: Rgb = [213, 60, 0];
/// Position of zero on the scale of [`color::magnitude`]: shading is not visible on its darkest
/// colours.
const LOWEST: f64 = 0.16;

/// Returns the colour on the arm for a share of the maximum deviation on the scale.
#[must_use]
pub fn arm_color(share: f64) -> Rgb {
    color::magnitude(on_scale(share.clamp(0.0, 1.0)))
}

/// Position on the colour scale for a share of the maximum deviation.
pub fn on_scale(share: f64) -> f64 {
    LOWEST + (1.0 - LOWEST) * share
}

/// Draws axes, colour scale and caption at the bottom of the picture.
pub(super) fn legend(image: &mut Image, view: &View, unit: f64, header: &RunHeader, factor: f64) {
    let (width, height) = (image.width as f64, image.height as f64);
    let text = |size: f64| Style::new(size * unit, color::INK);
    // Axes of the world; nearer ones cover those farther from the viewer.
    let origin = [44.0 * unit, height - 40.0 * unit];
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| view.toward[*a].total_cmp(&view.toward[*b]));
    for k in order {
        let direction = [view.right[k], -view.up[k]];
        // Skip an axis that points at the viewer.
        if direction[0].hypot(direction[1]) < 0.15 {
            continue;
        }
        let place = |length: f64| [0, 1].map(|i| origin[i] + length * unit * direction[i]);
        image.arrow(origin, place(26.0), 1.8 * unit, color::axis(k));
        let [x, y] = place(36.0);
        let style = Style::new(14.0 * unit, color::axis(k)).bold();
        image.text(["x", "y", "z"][k], [x, y + 5.0 * unit], Align::Middle, style);
    }

    // Colour scale with three numbers.
    let (bar, left, top) = (240.0 * unit, width - 286.0 * unit, height - 42.0 * unit);
    let thick = 11.0 * unit;
    for x in 0..bar as usize {
        image.fill(left + x as f64, top, 1.0, thick, arm_color(x as f64 / (bar - 1.0)));
    }
    let scale = 1e3 * if header.color_scale_m > 0.0 { header.color_scale_m } else { 1.0 };
    for place in [0.0, 0.5, 1.0] {
        let x = left + place * (bar - 1.0);
        image.line([x, top + thick], [x, top + thick + 4.0 * unit], unit, color::INK, 1.0);
        image.text(&short(place * scale), [x, top + thick + 18.0 * unit], Align::Middle, text(15.0).bold());
    }
    image.text("deviation from the rigid arm, mm", [left, top - 7.0 * unit], Align::Left, text(13.0));

    // Caption: magnification, rigid twin, arrow of the error.
    let (x, y) = (104.0 * unit, height - 24.0 * unit);
    let bold = text(14.0).bold();
    let first = format!("deflections magnified {} times", short(factor));
    image.text(&first, [x, y - 20.0 * unit], Align::Left, bold);
    let swatch = 12.0 * unit;
    image.fill(x, y - swatch + unit, swatch, swatch, color::mix(GHOST, color::PAPER, GHOST_FADE));
    image.text("rigid arm", [x + 1.5 * swatch, y], Align::Left, text(13.0));
    let next = x + 1.5 * swatch + text_width("rigid arm", text(13.0)) + 1.6 * swatch;
    image.arrow([next, y - 4.0 * unit], [next + 24.0 * unit, y - 4.0 * unit], 3.0 * unit, ARROW);
    image.text("TCP error", [next + 32.0 * unit, y], Align::Left, text(13.0));
}

/// Formats a number without trailing zeros.
pub(super) fn short(x: f64) -> String {
    let digits = if x == 0.0 { 0 } else { (2.0 - x.abs().log10().floor()).clamp(0.0, 9.0) as usize };
    let text = format!("{x:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}
