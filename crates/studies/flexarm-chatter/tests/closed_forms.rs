//! Limits in closed form: constant forces (as in turning), the minimum limit of one mode, sums of
//! tooth forces.

use std::f64::consts::{FRAC_PI_3, PI, TAU};

use flexarm_chatter::milling::{
    Coefficients, Cutter, Engagement, Kind, LimitOptions, Mode, Structure, leading_multiplier, limit_of_depth,
    unstable_ranges,
};
use nalgebra::{Matrix3, Vector3};

const STEEL: Coefficients = Coefficients { tangential: 6e8, radial: 2e8, axial: 1e8 };

fn mode(hz: f64, zeta: f64, stiffness: f64, axis: Vector3<f64>) -> Mode {
    let omega = TAU * hz;
    Mode { angular_frequency: omega, damping_ratio: zeta, shape: axis * omega / stiffness.sqrt() }
}

fn along_x(hz: f64, zeta: f64, stiffness: f64) -> Structure {
    Structure::from_modes(&[mode(hz, zeta, stiffness, Vector3::x())]).unwrap()
}

/// Truth: the forces of four teeth engaged over the full turn sum to a constant force,
/// `F = -b N/2 K_r (x - x(t - T))`, as in turning. Its limit is `b N/2 K_r = -1 / (2 Re G(ω))` with
/// `ω T = 2 π k + 3 π + 2 arg G` [Tlusty & Poláček 1963]; here ω is chosen and T follows from the
/// phase.
#[test]
fn constant_forces_have_the_lobes_of_turning() {
    let structure = along_x(150.0, 0.03, 2e7);
    let cutter = Cutter::straight(4, STEEL, Engagement::full());
    let mut worst = 0.0_f64;
    for (ratio, lobe) in [(1.01, 0.0), (1.03, 1.0), (1.05, 2.0), (1.1, 3.0), (1.25, 4.0)] {
        let omega = TAU * 150.0 * ratio;
        let G = structure.frequency_response(omega)[(0, 0)];
        let depth = -1.0 / (2.0 * G.re) / (2.0 * STEEL.radial);
        let T = (2.0 * PI * lobe + (3.0 * PI + 2.0 * G.arg()).rem_euclid(TAU)) / omega;
        let spindle = cutter.pitch() / T;
        // Other lobes may have a lower limit: takes the minimum.
        let others = (0..60).flat_map(|k| crossings(&structure, T, k)).fold(f64::INFINITY, f64::min);
        let truth = others.min(depth);
        let found = limit_of_depth(&structure, &cutter, spindle, &LimitOptions::to(0.2)).unwrap().unwrap();
        worst = worst.max((found.depth / truth - 1.0).abs());
        assert!(found.kind == Kind::Hopf && found.chatter_hz > 150.0);
    }
    eprintln!("largest difference {worst:.1e}");
    // measured: 2e-9
    assert!(worst < 1e-6, "{worst:.1e}");
}

/// Returns the limit of turning on the lobe k at the delay T, by bisection of the phase over ω
/// above the mode.
fn crossings(structure: &Structure, T: f64, k: i32) -> Option<f64> {
    let phase = |w: f64| {
        let G = structure.frequency_response(w)[(0, 0)];
        w * T - TAU * f64::from(k) - (3.0 * PI + 2.0 * G.arg())
    };
    let (mut low, mut high) = (TAU * 150.0 * 1.0005, TAU * 150.0 * 40.0);
    if phase(low) > 0.0 || phase(high) < 0.0 {
        return None;
    }
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if phase(middle) > 0.0 { high = middle } else { low = middle }
    }
    let G = structure.frequency_response(low)[(0, 0)];
    (G.re < 0.0).then(|| -1.0 / (2.0 * G.re) / (2.0 * STEEL.radial))
}

/// Truth: the minimum limit of one mode under a constant force is `2 k ζ (1 + ζ)` over its
/// coefficient, on any lobe, at `ω = ω_0 √(1 + 2 ζ)`.
#[test]
fn the_lowest_limit_of_one_mode_is_two_k_zeta() {
    let (k, zeta) = (2e7, 0.03);
    let structure = along_x(150.0, zeta, k);
    let cutter = Cutter::straight(4, STEEL, Engagement::full());
    let omega = TAU * 150.0 * (1.0 + 2.0 * zeta).sqrt();
    let phase = (3.0 * PI + 2.0 * structure.frequency_response(omega)[(0, 0)].arg()).rem_euclid(TAU);
    let truth = 2.0 * k * zeta * (1.0 + zeta) / (2.0 * STEEL.radial);
    for lobe in [1.0, 3.0] {
        let spindle = cutter.pitch() * omega / (TAU * lobe + phase);
        let limit = |factor: f64| {
            limit_of_depth(&structure, &cutter, factor * spindle, &LimitOptions::to(0.2)).unwrap().unwrap().depth
        };
        let lowest = limit(1.0);
        eprintln!("{lowest:.9e}, closed form {truth:.9e}");
        assert!((lowest / truth - 1.0).abs() < 1e-6, "{}", lowest / truth - 1.0);
        assert!(limit(0.995) > lowest && limit(1.005) > lowest);
    }
}

/// Truth: numerical integration over slices and angles.
#[test]
fn forces_of_helical_teeth_are_the_sum_of_their_slices() {
    let straight = Cutter { lead: FRAC_PI_3, ..Cutter::straight(3, STEEL, Engagement { entry: 0.7, exit: 2.9 }) };
    let helical = Cutter { diameter: 0.012, helix: 0.6, ..straight };
    let (depth, slices) = (0.011, 20_000);
    let mut worst: f64 = 0.0;
    for alpha in [0.0, 0.4, 1.0, 1.7, 2.05] {
        let slice = |k: i32| {
            let z = (f64::from(k) + 0.5) / f64::from(slices) * depth;
            straight.force_matrix(alpha - 2.0 * helical.helix.tan() * z / helical.diameter, depth / f64::from(slices))
        };
        let sum: Matrix3<f64> = (0..slices).map(slice).sum();
        worst = worst.max((helical.force_matrix(alpha, depth) - sum).norm() / sum.norm());
    }
    let turn = 50_000;
    let at = |k: i32| straight.force_matrix(TAU * (f64::from(k) + 0.5) / f64::from(turn), 1.0) / f64::from(turn);
    let mean: Matrix3<f64> = (0..turn).map(at).sum();
    let averaged = (straight.mean_force_matrix() - mean).norm() / mean.norm();
    eprintln!("slices {worst:.1e}, mean {averaged:.1e}");
    // measured: 2e-5 (slices at the edge of the cut) and 1e-5
    assert!(worst < 5e-4 && averaged < 1e-4, "{worst:.1e} {averaged:.1e}");
    let same = (helical.mean_force_matrix() - straight.mean_force_matrix()).norm();
    assert!(same == 0.0);
}

/// Truth: a helix that lags by a whole pitch over the depth b has a constant force `-b H`, for which
/// the limit is `det(1 + b (1 - e^{-i ω T}) G(i ω) H) = 0`.
#[test]
fn at_a_depth_of_one_axial_pitch_a_helix_cuts_with_constant_force() {
    let modes =
        [mode(300.0, 0.02, 1.5e7, Vector3::new(0.8, 0.6, 0.0)), mode(380.0, 0.03, 2e7, Vector3::new(-0.5, 0.8, 0.1))];
    let structure = Structure::from_modes(&modes).unwrap();
    let cutter = Cutter { diameter: 0.01, helix: 0.5, ..Cutter::straight(4, STEEL, Engagement::down(0.3)) };
    let pitch = cutter.pitch() * cutter.diameter / (2.0 * cutter.helix.tan());
    let spread = |depth: f64| {
        let all: Vec<_> = (0..20).map(|k| cutter.force_matrix(cutter.pitch() * f64::from(k) / 20.0, depth)).collect();
        all.iter().map(|H| (H - all[0]).norm()).fold(0.0, f64::max) / all[0].norm()
    };
    assert!(spread(pitch) < 1e-12 && spread(0.5 * pitch) > 0.1);

    // Scales the coefficients until this depth is a limit.
    let spindle = 4321.0 * TAU / 60.0;
    let scaled = |factor: f64| {
        let k = STEEL;
        let coefficients =
            Coefficients { tangential: k.tangential * factor, radial: k.radial * factor, axial: k.axial * factor };
        Cutter { coefficients, ..cutter }
    };
    let multiplier = |factor: f64| leading_multiplier(&structure, &scaled(factor), spindle, pitch).unwrap();
    let (mut low, mut high) = (1e-4_f64, 1e2_f64);
    for _ in 0..50 {
        let middle = (low * high).sqrt();
        if multiplier(middle).norm() < 1.0 { low = middle } else { high = middle }
    }
    let (found, tooth) = (multiplier(low), cutter.tooth_period(spindle));
    let H = scaled(low).mean_force_matrix().map(|x| nalgebra::Complex::new(x, 0.0));
    let size = |w: f64| {
        let delay = nalgebra::Complex::new(1.0, 0.0) - nalgebra::Complex::cis(-w * tooth);
        let loop_ = structure.frequency_response(w) * H * (delay * pitch);
        (nalgebra::Matrix3::identity() + loop_).determinant().norm()
    };
    // The multiplier gives ω up to whole turns in a tooth period.
    let sizes = (0..40).flat_map(|k| [1.0, -1.0].map(|sign| size((TAU * f64::from(k) + sign * found.arg()) / tooth)));
    let least = sizes.fold(f64::INFINITY, f64::min);
    eprintln!("multiplier {:.3e} off the circle, determinant {least:.1e}", found.norm() - 1.0);
    assert!((found.norm() - 1.0).abs() < 1e-8 && least < 1e-6);
}

/// Identity: no helix angle, and one so small that it changes nothing.
#[test]
fn a_helix_that_goes_to_nothing_is_a_straight_tooth() {
    let structure = along_x(922.0, 0.011, 2e7);
    let straight = Cutter { diameter: 0.02, ..Cutter::straight(2, STEEL, Engagement::down(0.5)) };
    let spindle = 11_000.0 * TAU / 60.0;
    let limit = |helix: f64| {
        let cutter = Cutter { helix, ..straight };
        limit_of_depth(&structure, &cutter, spindle, &LimitOptions::to(0.1)).unwrap().unwrap().depth
    };
    let (a, b, c) = (limit(0.0), limit(1e-4), limit(0.5));
    eprintln!("straight {a:.6e}, helix 1e-4 {b:.6e}, helix 0.5 {c:.6e}");
    assert!((a / b - 1.0).abs() < 1e-4);
    assert!((a / c - 1.0).abs() > 1e-3);
}

/// Identity: rotating structure and engagement about the tool changes no limit.
#[test]
fn limits_do_not_depend_on_the_direction_of_the_feed() {
    let modes =
        [mode(300.0, 0.02, 1.5e7, Vector3::new(0.8, 0.6, 0.0)), mode(380.0, 0.03, 2e7, Vector3::new(-0.5, 0.8, 0.2))];
    let structure = Structure::from_modes(&modes).unwrap();
    let cutter = Cutter { lead: 1.0, ..Cutter::straight(3, STEEL, Engagement { entry: 0.4, exit: 2.0 }) };
    let spindle = 3000.0 * TAU / 60.0;
    let options = LimitOptions { tolerance: 1e-6, ..LimitOptions::to(0.1) };
    let first = limit_of_depth(&structure, &cutter, spindle, &options).unwrap().unwrap();
    // A tooth at φ + a in axes rotated by a, clockwise about z.
    let a = 0.9;
    let R = nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), -a).into_inner();
    let turned = Cutter { engagement: Engagement { entry: 0.4 + a, exit: 2.0 + a }, ..cutter };
    let second = limit_of_depth(&structure.rotated(&R), &turned, spindle, &options).unwrap().unwrap();
    let change = (first.depth / second.depth - 1.0).abs();
    eprintln!("{:.6e} m, {change:.1e}", first.depth);
    // measured: 4e-13
    assert!(change < 1e-9, "{change:.1e}");
}

/// Inside each range the magnitude of the largest multiplier is above 1, outside it is below 1.
#[test]
fn unstable_ranges_hold_what_multipliers_say() {
    let structure = along_x(922.0, 0.011, 1.34e6);
    // Period doubling of helical teeth has islands: with increasing depth the teeth overlap, and
    // the forces vary less.
    let cutter = Cutter { diameter: 0.008, helix: PI / 6.0, ..Cutter::straight(2, STEEL, Engagement::down(0.05)) };
    let mut several = 0;
    for rpm in [14_400.0, 16_200.0, 17_000.0, 17_800.0, 18_200.0] {
        let (spindle, deepest) = (rpm * TAU / 60.0, 0.05);
        let ranges = unstable_ranges(&structure, &cutter, spindle, &LimitOptions::to(deepest)).unwrap();
        eprintln!("{rpm} rpm: {ranges:?}");
        several += usize::from(ranges.len() > 1 || ranges.first().is_some_and(|r| r.1 < deepest));
        for (low, high) in &ranges {
            let growth = |depth: f64| leading_multiplier(&structure, &cutter, spindle, depth).unwrap().norm();
            assert!(growth(low * 0.99) < 1.0 && growth(low * 1.01) > 1.0, "{rpm}: {ranges:?}");
            assert!(*high == deepest || (growth(high * 0.99) > 1.0 && growth(high * 1.01) < 1.0), "{rpm}: {ranges:?}");
        }
    }
    eprintln!("{several} speeds with a stable depth above an unstable one");
    assert!(several == 5, "{several}: the test is to meet islands");
}
