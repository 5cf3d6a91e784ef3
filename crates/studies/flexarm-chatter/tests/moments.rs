//! Integrals of products of exponentials and polynomials.

use flexarm_chatter::internals::RULE;
use nalgebra::Complex;

/// Truth: the sum of ℓ_j over all nodes is 1, with the integral (e^{z c} - 1) / z; weighted
/// with x_j it is σ, with ∫ e^{z(c-σ)} σ dσ.
#[test]
fn moments_of_one_and_of_the_first_power_are_those_of_the_closed_form() {
    let mut worst: f64 = 0.0;
    for z in [
        Complex::new(-0.01, 0.3),
        Complex::new(-0.2, 4.0),
        Complex::new(-6.9, 0.0),
        Complex::new(-7.1, 1.0),
        Complex::new(-0.3, 40.0),
        Complex::new(-3e4, 0.0),
    ] {
        let moments = RULE.moments(z);
        for (i, c) in RULE.nodes.iter().copied().chain([1.0]).enumerate() {
            let e = (z * c).exp();
            let one: Complex<f64> = moments.integrals[i].iter().sum();
            let first: Complex<f64> = moments.integrals[i].iter().zip(&RULE.nodes).map(|(m, x)| m * *x).sum();
            worst = worst.max((one - (e - 1.0) / z).norm() / c);
            worst = worst.max((first - (e - 1.0 - z * c) / (z * z)).norm() / c);
        }
    }
    eprintln!("worst {worst:e}");
    assert!(worst < 1e-11, "{worst:e}");
}

/// Truth: both methods for the same integral, where both are accurate.
#[test]
fn quadrature_and_parts_meet() {
    let z = Complex::from_polar(7.0, 1.8);
    let mut worst: f64 = 0.0;
    for (i, c) in RULE.nodes.iter().copied().chain([1.0]).enumerate() {
        let (a, b) = (RULE.by_quadrature(z, c, i), RULE.by_parts(z, (z * c).exp(), i));
        worst = a.iter().zip(&b).fold(worst, |w, (a, b)| w.max((a - b).norm()));
    }
    eprintln!("worst {worst:e}");
    assert!(worst < 1e-9, "{worst:e}");
}
