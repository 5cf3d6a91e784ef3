//! Closed forms for the beams of `robots/test/three_beams/README.md`.

use nalgebra::{Matrix3, Matrix6, Vector3};

use crate::textbook::{Stiffness, at_lever, rectangle_torsion, turned};

const E: f64 = 70e9;
const NU: f64 = 0.33;
const RHO: f64 = 2700.0;

/// Lengths of tube, box and rectangle (m).
pub(super) const LENGTHS_M: [f64; 3] = [0.8, 0.6, 0.4];
/// Mass at the tip (kg).
pub(super) const BALL_KG: f64 = 1.0;
/// Indices of the beams in lists.
pub(super) const TUBE: usize = 0;
pub(super) const BOX: usize = 1;
#[cfg(test)]
const RECTANGLE: usize = 2;
/// Names of the beams.
pub(super) const BEAMS: [&str; 3] = ["tube", "box", "rectangle"];

/// Outer and inner radius of the tube (m).
const TUBE_M: [f64; 2] = [0.03, 0.027];
/// Width (y), height (z) and wall thickness of the box (m).
const BOX_M: [f64; 3] = [0.03, 0.05, 0.003];
/// Width (y) and height (z) of the rectangle (m).
const RECTANGLE_M: [f64; 2] = [0.03, 0.02];

/// A beam of the arm at q = 0, world axes.
pub(super) struct Member {
    pub(super) section: Stiffness,
    /// Axes of the beam (along it, y, z of the section) as columns.
    pub(super) R: Matrix3<f64>,
    /// Far end of the beam (m).
    pub(super) end: Vector3<f64>,
}

/// Position of the tip, world axes (m).
pub(super) fn tip() -> Vector3<f64> {
    let [up, forwards, sideways] = LENGTHS_M;
    Vector3::new(forwards, sideways, up)
}

/// The three beams.
pub(super) fn members() -> [Member; 3] {
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    let [up, forwards, sideways] = LENGTHS_M;
    [
        Member { section: tube(up), R: Matrix3::from_columns(&[z, x, y]), end: up * z },
        Member { section: hollow_box(forwards), R: Matrix3::identity(), end: forwards * x + up * z },
        Member { section: rectangle(sideways), R: Matrix3::from_columns(&[y, -x, z]), end: tip() },
    ]
}

impl Member {
    /// Contribution of the beam to the compliance of the tip: as a cantilever in world axes, its
    /// end moved to the tip by a lever (m/N, rad/N; m/(N m), rad/(N m)).
    pub(super) fn at_tip(&self) -> Matrix6<f64> {
        at_lever(&turned(&self.section.tip_compliance(), &self.R), &(tip() - self.end))
    }
}

/// Compliance of the tip, 6×6, in world axes (m/N, rad/N; m/(N m), rad/(N m)).
pub(super) fn tip_compliance() -> Matrix6<f64> {
    members().iter().map(Member::at_tip).sum()
}

fn section(l: f64, area: f64, I: [f64; 2], J: f64, kA: [f64; 2]) -> Stiffness {
    let shear = E / (2.0 * (1.0 + NU));
    let kGA = kA.map(|kA| shear * kA);
    Stiffness { l, EA: E * area, EI_y: E * I[0], EI_z: E * I[1], GJ: shear * J, kGA, mu: RHO * area }
}

/// Tube, with Cowper's factor of the hollow circle.
fn tube(l: f64) -> Stiffness {
    use std::f64::consts::PI;
    let [outer, inner] = TUBE_M;
    let area = PI * (outer.powi(2) - inner.powi(2));
    let I = PI * (outer.powi(4) - inner.powi(4)) / 4.0;
    let m2 = (inner / outer).powi(2);
    let s = (1.0 + m2).powi(2);
    let k = 6.0 * (1.0 + NU) * s / ((7.0 + 6.0 * NU) * s + (20.0 + 12.0 * NU) * m2);
    section(l, area, [I; 2], 2.0 * I, [k * area; 2])
}

/// Box, with Bredt's torsion on the midline and Cowper's factor of the thin-walled box.
fn hollow_box(l: f64) -> Stiffness {
    let [b, h, t] = BOX_M;
    let (bi, hi) = (b - 2.0 * t, h - 2.0 * t);
    let I = [(b * h.powi(3) - bi * hi.powi(3)) / 12.0, (h * b.powi(3) - hi * bi.powi(3)) / 12.0];
    let (bm, hm) = (b - t, h - t);
    let J = 2.0 * t * (bm * hm).powi(2) / (bm + hm);
    section(l, b * h - bi * hi, I, J, [shear_area(bm, hm, t), shear_area(hm, bm, t)])
}

/// Rectangle, with Cowper's factor.
fn rectangle(l: f64) -> Stiffness {
    let [b, h] = RECTANGLE_M;
    let kA = 10.0 * (1.0 + NU) / (12.0 + 11.0 * NU) * b * h;
    section(l, b * h, [b * h.powi(3) / 12.0, h * b.powi(3) / 12.0], rectangle_torsion(b, h), [kA; 2])
}

/// Shear area of a thin-walled box after Cowper, with walls of length `along` and `across` the
/// force.
fn shear_area(along: f64, across: f64, wall: f64) -> f64 {
    let m = across / along;
    let still = 12.0 + m * (72.0 + m * (150.0 + 90.0 * m)) + 30.0 * m.powi(3) * (1.0 + m);
    let poisson = 11.0 + m * (66.0 + m * (135.0 + 90.0 * m)) + 10.0 * m.powi(3);
    20.0 * wall * (along + across) * (1.0 + NU) * (1.0 + 3.0 * m).powi(2) / (still + NU * poisson)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth by hand: tube of 0.8 m with I = pi (30^4 - 27^4)/4 mm^4, box with I_y = (30 50^3 - 24
    /// 44^3)/12 mm^4. A torque about z twists the tube by l/GJ, and the box and the rectangle bend
    /// about z.
    #[test]
    fn the_tip_turns_by_the_sum_of_what_each_beam_turns() {
        let [tube, hollow, bar] = members().map(|member| member.section);
        assert!((tube.EI_y / (70e9 * 2.187_797_3e-7) - 1.0).abs() < 1e-6, "{}", tube.EI_y / 70e9);
        assert!((hollow.EI_y / (70e9 * 1.421_32e-7) - 1.0).abs() < 1e-9, "{}", hollow.EI_y / 70e9);
        let by_hand = 0.8 / tube.GJ + 0.6 / hollow.EI_z + 0.4 / bar.EI_z;
        assert!((tip_compliance()[(5, 5)] / by_hand - 1.0).abs() < 1e-12);
        // A force along y at the tip only stretches the rectangle; the other two bend, and the tube
        // twists because of its lever of 0.6 m.
        let stretch = 0.4 / bar.EA;
        assert!((members()[RECTANGLE].at_tip()[(1, 1)] / stretch - 1.0).abs() < 1e-12);
        let tube_alone = tube.tip_compliance()[(2, 2)] + 0.36 * 0.8 / tube.GJ;
        assert!((members()[TUBE].at_tip()[(1, 1)] / tube_alone - 1.0).abs() < 1e-12);
    }
}
