//! Yardsticks of stiffness, mass and interfaces.

use flexarm_linkmaker::internals::of_interface;
use flexarm_linkmaker::yardsticks::{SOUND, least_density, sound_speed};
use nalgebra::{Matrix3, Matrix6};

/// Truth: a steel bar with `EA/l` along it and `12 EI/l³` across it: `√(E/rho)`.
#[test]
fn sound_runs_along_a_bar_as_in_its_material() {
    let (E, rho, l, a) = (210e9f64, 7850.0f64, 0.8f64, 0.05f64);
    let (EA, EI) = (E * a * a, E * a.powi(4) / 12.0);
    let across = 12.0 * EI / l.powi(3);
    let K = Matrix6::from_diagonal(&[EA / l, across, across, EI / l, EI / l, EI / l].into());
    let found = sound_speed(&K, l, rho * a * a * l).unwrap();
    let truth = f64::sqrt(E / rho);
    assert!((found / truth - 1.0).abs() < 1e-12, "{found} {truth}");
    assert!(SOUND.contains(&found));
    let thousandth = sound_speed(&(K * 1e-3), l, rho * a * a * l).unwrap();
    assert!(!SOUND.contains(&thousandth), "{thousandth}");
}

/// Truth: a ball of steel, and a rod of the same mass, for which the bound is lower.
#[test]
fn no_body_is_lighter_than_the_ball_of_its_inertia() {
    let (density, radius) = (7850.0, 0.1f64);
    let mass = density * 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
    let found = least_density(mass, &(Matrix3::identity() * (0.4 * mass * radius * radius)));
    assert!((found / density - 1.0).abs() < 1e-12, "{found}");
    let rod = mass / 12.0;
    let rod = Matrix3::from_diagonal(&[0.01 * rod, rod, rod].into());
    assert!(least_density(mass, &rod) < 0.1 * density);
}

#[test]
fn an_interface_that_takes_half_of_the_link_is_told() {
    // A bore, and the end face of a bar of two bricks.
    assert!(of_interface("A", 0.43, 0.02).is_none());
    assert!(of_interface("A", 0.0, 0.33).is_none());
    assert_eq!(of_interface("A", 0.5, 0.5).unwrap().value, Some(0.5));
}
