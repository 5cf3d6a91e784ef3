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

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector3};

    use super::*;

    const GROUNDS: [Ground; 2] = [Ground::Paper, Ground::Dark];

    /// Colour perception without red cones (protanopia) and without green cones (deuteranopia), on
    /// linear light [Machado, Oliveira and Fernandes 2009, table 1, severity 1].
    fn eyes() -> [Matrix3<f64>; 3] {
        [
            Matrix3::identity(),
            Matrix3::new(0.152286, 1.052583, -0.204868, 0.114503, 0.786281, 0.099216, -0.003882, -0.048116, 1.051998),
            Matrix3::new(0.367322, 0.860646, -0.227968, 0.280085, 0.672501, 0.047413, -0.011820, 0.042940, 0.968881),
        ]
    }

    /// Coordinates of a colour in the perceptually uniform space OKLab [Ottosson 2020], times 100;
    /// a distance of 2 is just visible side by side.
    fn oklab(color: Rgb, eye: &Matrix3<f64>) -> Vector3<f64> {
        let linear = |c: u8| {
            let c = f64::from(c) / 255.0;
            if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        };
        let light = (eye * Vector3::from(color.map(linear))).map(|x| x.clamp(0.0, 1.0));
        let cones = Matrix3::new(
            0.4122214708,
            0.5363325363,
            0.0514459929,
            0.2119034982,
            0.6806995451,
            0.1073969566,
            0.0883024619,
            0.2817188376,
            0.6299787005,
        ) * light;
        100.0
            * (Matrix3::new(
                0.2104542553,
                0.7936177850,
                -0.0040720468,
                1.9779984951,
                -2.4285922050,
                0.4505937099,
                0.0259040371,
                0.7827717662,
                -0.8086757660,
            ) * cones.map(f64::cbrt))
    }

    fn closest(colors: &[Rgb], eye: &Matrix3<f64>) -> f64 {
        let pairs = (0..colors.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
        pairs.map(|(a, b)| (oklab(colors[a], eye) - oklab(colors[b], eye)).norm()).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn x_is_red_y_is_green_and_z_is_blue_and_every_eye_tells_them_apart() {
        for ground in GROUNDS {
            let axes = [0, 1, 2].map(|k| axis(k, ground));
            for (k, color) in axes.iter().enumerate() {
                assert!((0..3).all(|c| c == k || color[c] < color[k]), "{color:?}");
            }
            for eye in eyes() {
                // Measured: 12.2 on paper and 15.8 on a dark background without green cones; the
                // common red, green and blue (210,40,40), (30,150,50), (40,70,220) have 2.4.
                assert!(closest(&axes, &eye) > 12.0, "{ground:?}: {}", closest(&axes, &eye));
            }
        }
    }

    #[test]
    fn runs_and_parts_differ_from_each_other_and_from_the_rigid_twin() {
        let whole = &eyes()[0];
        for ground in GROUNDS {
            let all: Vec<Rgb> = (0..SERIES_LENGTH).map(|k| series(k, ground)).collect();
            assert!(closest(&all, whole) > 3.0, "{ground:?}: {}", closest(&all, whole));
            assert_eq!(series(SERIES_LENGTH, ground), series(0, ground));
            // A study rarely has more runs than these.
            let runs = [&all[..3], &[rigid(ground), total(ground)]].concat();
            for eye in eyes() {
                assert!(closest(&runs, &eye) > 6.0, "{ground:?}: {}", closest(&runs, &eye));
            }
            let [low, high] = [rigid(ground).into_iter().min(), rigid(ground).into_iter().max()];
            assert!(high.zip(low).is_some_and(|(high, low)| high - low < 20), "the twin is grey");
        }
    }

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
