//! Colours that are distinguishable with any colour vision.

use flexarm_draw::palette::{Ground, Rgb, SERIES_LENGTH, axis, magnitude, rigid, series, total};
use nalgebra::{Matrix3, Vector3};

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
    assert_eq!([magnitude(-1.0), magnitude(2.0)], [magnitude(0.0), [253, 231, 37]]);
}
