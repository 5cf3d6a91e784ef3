//! Colours: a scale for magnitudes, a palette for interfaces.

use super::image::Rgb;
use crate::palette::{self, Ground};

pub use crate::palette::mix;

/// Viridis (van der Walt and Smith, public domain) at nine places; between them linear.
const SCALE: [Rgb; 9] = [
    [68, 1, 84],
    [71, 44, 122],
    [59, 81, 139],
    [44, 113, 142],
    [33, 144, 141],
    [39, 173, 129],
    [92, 200, 99],
    [170, 220, 50],
    [253, 231, 37],
];

/// Where on that scale zero lies.
const DARKEST: f64 = 0.08;

/// Colours of interfaces in their order: blue, orange, green, and so on, which colour-blind people tell apart.
pub const INTERFACES: [Rgb; 6] =
    [[0, 101, 204], [240, 120, 0], [0, 158, 96], [204, 90, 170], [120, 80, 30], [0, 170, 200]];

/// Colour of the cut plane and of the split frame.
pub const CUT: Rgb = [200, 0, 60];
/// The part on the side of A.
pub const PROXIMAL: Rgb = [205, 207, 212];
/// The part on the side of B.
pub const DISTAL: Rgb = [163, 168, 178];
/// Text.
pub const INK: Rgb = [30, 34, 42];
/// Text of less weight.
pub const FAINT: Rgb = [105, 110, 122];
/// What is wrong.
pub const ALERT: Rgb = [190, 20, 20];
/// Paper.
pub const PAPER: Rgb = [255, 255, 255];
/// Lines between panels.
pub const RULE: Rgb = [214, 217, 223];

/// Colour of a magnitude from 0 to 1; perceptually even, dark to light.
///
/// The first part of the scale is left out: shade and edges are not seen on it.
pub fn magnitude(value: f64) -> Rgb {
    let place = (DARKEST + (1.0 - DARKEST) * value.clamp(0.0, 1.0)) * (SCALE.len() - 1) as f64;
    let lower = (place.floor() as usize).min(SCALE.len() - 2);
    mix(SCALE[lower], SCALE[lower + 1], place - lower as f64)
}

/// Axis x, y or z of a frame.
pub fn axis(number: usize) -> Rgb {
    palette::axis(number, Ground::Paper)
}

/// Colour of the interface with this number.
pub fn interface(number: usize) -> Rgb {
    INTERFACES[number % INTERFACES.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_colour_scale_grows_lighter_all_the_way() {
        let light = |k: u32| {
            let [r, g, b] = magnitude(f64::from(k) / 64.0).map(f64::from);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        assert!((1..=64).all(|k| light(k) > light(k - 1)));
        assert_eq!([magnitude(-1.0), magnitude(2.0)], [magnitude(0.0), SCALE[8]]);
    }
}
