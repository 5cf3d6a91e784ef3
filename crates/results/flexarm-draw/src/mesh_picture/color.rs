//! Colours of meshes and their pictures.

use super::image::Rgb;
use crate::palette::{self, Ground};

pub use crate::palette::{magnitude, mix};

/// Colours of interfaces in order: blue, orange, green, and so on, distinguishable with colour
/// blindness.
pub const INTERFACES: [Rgb; 6] =
    [[0, 101, 204], [240, 120, 0], [0, 158, 96], [204, 90, 170], [120, 80, 30], [0, 170, 200]];

/// Colour of the cut plane and of the split frame.
pub const CUT: Rgb = [200, 0, 60];
/// Part on the side of A.
pub const PROXIMAL: Rgb = [205, 207, 212];
/// Part on the side of B.
pub const DISTAL: Rgb = [163, 168, 178];
/// Text.
pub const INK: Rgb = [30, 34, 42];
/// Secondary text.
pub const FAINT: Rgb = [105, 110, 122];
/// Errors.
pub const ALERT: Rgb = [190, 20, 20];
/// Paper.
pub const PAPER: Rgb = [255, 255, 255];
/// Lines between panels.
pub const RULE: Rgb = [214, 217, 223];

/// Returns the colour of axis x, y or z of a frame.
pub fn axis(number: usize) -> Rgb {
    palette::axis(number, Ground::Paper)
}

/// Returns the colour of the interface with this index.
pub fn interface(number: usize) -> Rgb {
    INTERFACES[number % INTERFACES.len()]
}
