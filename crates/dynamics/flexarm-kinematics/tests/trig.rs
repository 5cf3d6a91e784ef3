//! Equations in one angle: all roots, also near the ends of the range.

use flexarm_kinematics::internals::{CirclePlane, TrigPolynomial};
use nalgebra::Vector3;

/// Truth: product of factors with known roots.
#[test]
fn all_roots_of_a_trigonometric_polynomial_of_degree_four_are_found() {
    // sin((t - r)/2) sin((t - s)/2) = (cos((r - s)/2) - cos(t - (r + s)/2)) / 2.
    let factor = |r: f64, s: f64| {
        let mean = 0.5 * (r + s);
        TrigPolynomial::affine((0.5 * (r - s)).cos(), -mean.cos(), -mean.sin())
    };
    let known = [-3.0, -2.2, -1.1, -0.3, 0.4, 0.9, 2.0, 2.9];
    let p = factor(known[0], known[4]).times(&factor(known[1], known[5]));
    let p = p.times(&factor(known[2], known[7]).times(&factor(known[3], known[6])));
    let found = p.roots(1e-3);
    let mut found = found.as_slice().to_vec();
    found.sort_by(f64::total_cmp);
    assert_eq!(found.len(), 8);
    for (f, k) in found.iter().zip(known) {
        assert!((f - k).abs() < 1e-12, "{f} for {k}"); // measured 1.7e-16
    }
}

/// Truth: a double root and a pair off the circle.
#[test]
fn a_double_root_is_found_and_complex_ones_are_not() {
    let double = TrigPolynomial::affine(1.0, -(0.7_f64.cos()), -(0.7_f64.sin()));
    let none = TrigPolynomial::affine(1.5, 1.0, 0.0);
    let roots = double.times(&none).roots(1e-3);
    assert!(!roots.as_slice().is_empty());
    assert!(roots.as_slice().iter().all(|r| (r - 0.7).abs() < 1e-6)); // measured 1.2e-9
}

#[test]
fn a_vector_is_turned_to_a_cosine_without_loss_near_its_axis() {
    let (u, h) = (Vector3::z(), Vector3::y());
    let equation = CirclePlane::new(&u, &h, &u);
    for d in [1e-12, 1e-7, 0.3, 2.0, std::f64::consts::PI - 1e-9] {
        let v = Vector3::new(d.sin() * 0.6, d.sin() * 0.8, d.cos());
        let found = equation.angles(&u, &v).angles()[0];
        assert!((found - d).abs() < 1e-15 + 4e-16 * d, "{found} for {d}"); // measured 1.3e-23
    }
}
