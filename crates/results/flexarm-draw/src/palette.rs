//! Colours of everything that flexarm draws: recordings, reports, plots, pictures. One table
//! ensures that a colour has the same meaning everywhere.
//!
//! * [`axis`]: x is red, y green, z blue, as in the triads of viewers; in shades that are
//!   distinguishable with red-green colour blindness.
//! * [`series`]: numbered items (runs, links, drives, joints), in one order.
//! * [`rigid`]: the rigid twin, a grey that no run uses.
//!
//! Each colour has a shade for paper and one for a dark background.
//! * [`magnitude`]: scale of magnitudes.

/// Red, green, blue.
pub type Rgb = [u8; 3];

/// Background of a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ground {
    /// White or nearly white.
    Paper,
    /// Black or nearly black.
    Dark,
}

/// x, y, z on paper and on a dark background.
const AXES: [[Rgb; 3]; 2] =
    [[[184, 32, 42], [31, 163, 107], [42, 111, 219]], [[242, 85, 74], [87, 224, 168], [91, 141, 239]]];

/// After Okabe and Ito (2008), without their yellow and black, and with additional colours.
const SERIES: [[Rgb; 12]; 2] = [
    [
        [0, 114, 178],
        [213, 94, 0],
        [0, 158, 115],
        [181, 80, 143],
        [201, 133, 0],
        [58, 160, 220],
        [122, 90, 46],
        [124, 135, 148],
        [91, 63, 160],
        [111, 143, 0],
        [216, 96, 127],
        [15, 110, 120],
    ],
    [
        [78, 169, 230],
        [255, 138, 71],
        [44, 199, 154],
        [229, 143, 196],
        [240, 179, 46],
        [154, 211, 247],
        [201, 162, 107],
        [163, 173, 186],
        [179, 157, 219],
        [195, 217, 78],
        [255, 154, 168],
        [95, 212, 221],
    ],
];

/// Viridis (van der Walt and Smith, public domain) at nine points, with linear interpolation.
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

/// Position of zero on that scale.
const DARKEST: f64 = 0.08;

/// Number of different colours of [`series`] before they repeat.
pub const SERIES_LENGTH: usize = 24;

/// Returns the colour of axis x (0), y (1) or z (2).
#[must_use]
pub fn axis(number: usize, ground: Ground) -> Rgb {
    AXES[ground as usize][number % 3]
}

/// Returns the colour of the item with this index, from 0.
#[must_use]
pub fn series(number: usize, ground: Ground) -> Rgb {
    let table = &SERIES[ground as usize];
    let color = table[number % table.len()];
    // The second cycle is darker, but still visible on a dark background.
    match (number / table.len() % 2, ground) {
        (0, _) => color,
        (_, Ground::Paper) => mix(color, [0; 3], 0.45),
        (_, Ground::Dark) => mix(color, [0; 3], 0.35),
    }
}

/// Returns the shade of [`series`] for one of the six components of the item with this index:
/// translations, then rotations, successively darker.
#[must_use]
pub fn component(number: usize, component: usize, ground: Ground) -> Rgb {
    mix(series(number, ground), [0; 3], 0.11 * (component % 6) as f64)
}

/// Returns the colour of the rigid twin and of its curves.
#[must_use]
pub fn rigid(ground: Ground) -> Rgb {
    match ground {
        Ground::Paper => [110, 116, 126],
        Ground::Dark => [206, 210, 216],
    }
}

/// Returns the colour of totals, such as the magnitude of an error.
#[must_use]
pub fn total(ground: Ground) -> Rgb {
    match ground {
        Ground::Paper => [28, 33, 40],
        Ground::Dark => [240, 242, 245],
    }
}

/// Formats as `#rrggbb`.
#[must_use]
pub fn hex([red, green, blue]: Rgb) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// Returns the colour of a magnitude from 0 to 1; perceptually uniform, dark to light.
///
/// The darkest part of the scale is left out: shading and edges are not visible on it.
#[must_use]
#[inline]
pub fn magnitude(value: f64) -> Rgb {
    let place = (DARKEST + (1.0 - DARKEST) * value.clamp(0.0, 1.0)) * (SCALE.len() - 1) as f64;
    let lower = (place as usize).min(SCALE.len() - 2);
    mix(SCALE[lower], SCALE[lower + 1], place - lower as f64)
}

/// Interpolates between `a` at 0 and `b` at 1.
#[must_use]
#[inline]
pub fn mix(a: Rgb, b: Rgb, at: f64) -> Rgb {
    // Rounds without a function call; negative values saturate to zero.
    let part = |k: usize| (f64::from(a[k]) + (f64::from(b[k]) - f64::from(a[k])) * at + 0.5) as u8;
    [part(0), part(1), part(2)]
}
