//! The arm at the time of the maximum error, from two sides.
//!
//! Without the feature `png` there are no pictures. Not here: rendering (`flexarm-draw`).

use flexarm_log::Trace;

use crate::error::NoPicture;

/// A picture for the page, which adds caption and key.
pub(super) struct Picture {
    /// Title for the caption.
    pub(super) title: &'static str,
    /// PNG without background, and the projected directions of x, y and z (right and up); or the
    /// reason why there is none.
    pub(super) drawn: Result<(Vec<u8>, [[f64; 2]; 3]), NoPicture>,
}

/// Height of a picture with this width.
#[cfg(feature = "png")]
const fn height(width: usize) -> usize {
    width * 7 / 9
}

/// Returns both pictures; `width` in pixels.
#[cfg(feature = "png")]
pub(super) fn pictures(trace: &Trace, width: usize) -> Vec<Picture> {
    use flexarm_draw::{ArmSide, arm_pictures};
    let titles = ["From the side", "From the front and above"];
    let (sides, size) = ([ArmSide::Side, ArmSide::Oblique], [width, height(width)]);
    match arm_pictures(&trace.header, &trace.peak, &sides, size) {
        Ok(drawn) => {
            let pictures = titles.into_iter().zip(drawn);
            pictures.map(|(title, p)| Picture { title, drawn: Ok((p.png, p.axes)) }).collect()
        }
        Err(error) => titles.map(|title| Picture { title, drawn: Err(error.clone().into()) }).into(),
    }
}

/// Without the feature `png` there are no pictures; returns the reason.
#[cfg(not(feature = "png"))]
pub(super) fn pictures(_trace: &Trace, _width: usize) -> Vec<Picture> {
    vec![Picture { title: "", drawn: Err(NoPicture::NotBuilt) }]
}

/// Returns both pictures for papers, with their scales, by file name. Those that cannot be drawn
/// are left out.
#[cfg(feature = "png")]
pub(super) fn printed(trace: &Trace, width: usize) -> Vec<(&'static str, Vec<u8>)> {
    use flexarm_draw::{ArmSide, arm_png};
    let draw = |name, side| Some((name, arm_png(&trace.header, &trace.peak, side, [width, height(width)]).ok()?));
    let all = [draw("arm_side", ArmSide::Side), draw("arm_oblique", ArmSide::Oblique)];
    all.into_iter().flatten().collect()
}

/// Without the feature `png` there are no pictures.
#[cfg(not(feature = "png"))]
pub(super) fn printed(_trace: &Trace, _width: usize) -> Vec<(&'static str, Vec<u8>)> {
    Vec::new()
}

/// Colours of a deviation from 0 to the end of the scale, as drawn on the arm.
#[cfg(feature = "png")]
pub(super) fn scale_colors() -> Vec<flexarm_draw::palette::Rgb> {
    (0..=12).map(|k| flexarm_draw::arm_color(f64::from(k) / 12.0)).collect()
}

/// Empty without pictures.
#[cfg(not(feature = "png"))]
pub(super) fn scale_colors() -> Vec<flexarm_draw::palette::Rgb> {
    Vec::new()
}
