//! Closed forms for the bar of `robots/test/one_beam/README.md`: aluminium, width along y, height along
//! z.

use crate::textbook::{Stiffness, rectangle_torsion};

pub(super) const LENGTH_M: f64 = 0.8;
pub(super) const WIDTH_M: f64 = 0.02;
pub(super) const HEIGHT_M: f64 = 0.04;
/// Ball at the end of the bar (kg).
pub(super) const BALL_KG: f64 = 0.5;
const E: f64 = 70e9;
const NU: f64 = 0.33;
const RHO: f64 = 2700.0;

/// Rotary inertia of the section per length, `rho I`, for sideways and upward bending (kg m).
const ROTARY: [f64; 2] =
    [RHO * HEIGHT_M * WIDTH_M * WIDTH_M * WIDTH_M / 12.0, RHO * WIDTH_M * HEIGHT_M * HEIGHT_M * HEIGHT_M / 12.0];

/// Section stiffness and mass by Euler-Bernoulli theory.
pub(super) fn bar() -> Stiffness {
    let (l, b, h) = (LENGTH_M, WIDTH_M, HEIGHT_M);
    let area = b * h;
    let GJ = E / (2.0 * (1.0 + NU)) * rectangle_torsion(h, b);
    let bending = |along: f64, across: f64| E * across * along.powi(3) / 12.0;
    Stiffness { l, EA: E * area, EI_y: bending(h, b), EI_z: bending(b, h), GJ, kGA: [f64::INFINITY; 2], mu: RHO * area }
}

/// The same with shear (Timoshenko), Cowper's factor of a rectangle, 10(1 + nu)/(12 + 11 nu).
pub(super) fn bar_with_shear() -> Stiffness {
    let bar = bar();
    let kGA = 10.0 * (1.0 + NU) / (12.0 + 11.0 * NU) * bar.EA / (2.0 * (1.0 + NU));
    Stiffness { kGA: [kGA; 2], ..bar }
}

/// First frequencies with the rotary inertia of the section and a point mass (kg) at the end:
/// sideways, upwards (Hz).
pub(super) fn bending_hz(point_mass: f64, count: usize) -> [Vec<f64>; 2] {
    let bar = bar();
    [(bar.EI_z, ROTARY[0]), (bar.EI_y, ROTARY[1])].map(|(EI, rotary)| bar.bending_hz(EI, rotary, point_mass, count))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth by hand: 70e9 * 20 * 40^3/12 mm^4 = 7466.7 N m², 0.8 mm² * 70e9, 2.16 kg/m; l³/(3 EI)
    /// = 22.857 µm/N, q l^4/(8 EI) = 0.1453 mm.
    #[test]
    fn the_bar_is_the_one_of_its_readme() {
        let bar = bar();
        assert!(
            (bar.EI_y - 7466.667).abs() < 1e-3 && (bar.EI_z - 1866.667).abs() < 1e-3 && (bar.EA - 5.6e7).abs() < 1e-3
        );
        assert!((bar.mu - 2.16).abs() < 1e-12);
        assert!((1e6 * bar.tip_compliance()[(2, 2)] - 22.857_143).abs() < 1e-6);
        assert!((1e3 * bar.own_weight(9.81) - 0.145_300).abs() < 1e-6, "{}", bar.own_weight(9.81));
    }

    /// Truth by hand: l/(k G A) = 0.8/(0.850928 * 26.3158e9 * 8e-4) = 0.04466 µm/N at the end in
    /// addition to bending, the same along y and z.
    #[test]
    fn shear_adds_the_same_deflection_in_both_directions() {
        let (with, without) = (bar_with_shear().tip_compliance(), bar().tip_compliance());
        for k in [1, 2] {
            assert!((1e6 * (with[(k, k)] - without[(k, k)]) - 0.044_657).abs() < 1e-6, "{k}");
        }
        assert_eq!(with[(4, 4)], without[(4, 4)]);
    }

    /// Truths: a ball and rotary inertia lower a frequency; a bar twice as high has twice the
    /// frequency, except for the effect of rotary inertia.
    #[test]
    fn a_ball_and_rotary_inertia_lower_the_frequencies() {
        let ([bare_side, bare_up], [side, up]) = (bending_hz(0.0, 2), bending_hz(BALL_KG, 2));
        assert!(side[0] < bare_side[0] && up[1] < bare_up[1]);
        let ratio = bare_up[0] / bare_side[0];
        assert!(ratio < 2.0 && ratio > 1.999, "{ratio}");
    }
}
