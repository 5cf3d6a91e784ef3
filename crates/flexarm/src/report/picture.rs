//! The arm at the instant of the largest error, from two sides.

use flexarm_log::Trace;

/// A picture with what it shows.
pub(super) struct Picture {
    /// For file names.
    pub(super) name: &'static str,
    /// For the caption.
    pub(super) title: &'static str,
    /// The PNG file, or why there is none.
    pub(super) png: Result<Vec<u8>, String>,
}

/// Both pictures; `width` in pixels.
#[cfg(feature = "png")]
pub(super) fn pictures(trace: &Trace, width: usize) -> Vec<Picture> {
    use flexarm_log::{ArmSide, arm_png};
    let draw = |name, title, side| {
        let png = arm_png(&trace.header, &trace.peak, side, [width, width * 7 / 9]);
        Picture { name, title, png: png.map_err(|error| error.to_string()) }
    };
    vec![
        draw("arm_side", "From the side", ArmSide::Side),
        draw("arm_oblique", "From the front and above", ArmSide::Oblique),
    ]
}

/// Without the feature `png` there are none, and the reason is said.
#[cfg(not(feature = "png"))]
pub(super) fn pictures(_trace: &Trace, _width: usize) -> Vec<Picture> {
    let png = Err("this build has no pictures: it was made without the feature png".to_owned());
    vec![Picture { name: "arm", title: "", png }]
}
