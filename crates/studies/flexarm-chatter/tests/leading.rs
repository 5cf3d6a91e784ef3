//! The leading multiplier of a tooth period, by few directions.

use std::f64::consts::TAU;

use flexarm_chatter::internals::{LARGEST_MATRIX, Period, largest, leading};
use flexarm_chatter::milling::{Coefficients, Cutter, Engagement, Mode, Structure};
use nalgebra::Vector3;

/// Truth: all eigenvalues of the matrix, for slow modes of an arm that hardly decay within a
/// period, and fast modes of a tool.
#[test]
fn few_directions_hold_the_largest_multiplier() {
    let mode = |k: u32| Mode {
        angular_frequency: TAU * 12.0 * 1.5_f64.powi(k as i32),
        damping_ratio: 0.02,
        shape: Vector3::new(f64::from(k).cos(), f64::from(2 * k).sin(), 0.3)
            / (200.0_f64 / f64::from(1 + k * k)).sqrt(),
    };
    let structure = Structure::from_modes(&(0..13).map(mode).collect::<Vec<_>>()).unwrap();
    let coefficients = Coefficients { tangential: 8e8, radial: 3e8, axial: 1e8 };
    let straight = Cutter::straight(3, coefficients, Engagement::down(0.3));
    let mut worst: f64 = 0.0;
    for cutter in [straight, Cutter { diameter: 0.02, helix: 0.5, ..straight }] {
        for (rpm, depth) in [(800.0, 1e-4), (800.0, 2e-3), (1500.0, 5e-4), (1500.0, 8e-3)] {
            let map = Period::new(&structure, &cutter, rpm * TAU / 60.0, 4e-4).at(depth);
            assert!(map.size() > 2 * LARGEST_MATRIX, "{}", map.size());
            let (few, all) = (leading(&map), largest(&map.matrix()));
            worst = worst.max((few.norm() / all.norm() - 1.0).abs());
        }
    }
    eprintln!("worst {worst:.1e}");
    // measured: 1e-12
    assert!(worst < 1e-9, "{worst:.1e}");
}
