//! Closed forms from textbooks, written independently of the code under test.
//!
//! A straight beam along x, clamped at x = 0; six-vectors `u_x u_y u_z theta_x theta_y theta_z`. SI
//! units.

use nalgebra::{Matrix3, Matrix6, Vector3};

/// Stiffnesses of a uniform section.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stiffness {
    /// Length (m).
    pub(crate) l: f64,
    /// Axial stiffness (N).
    pub(crate) EA: f64,
    /// Bending stiffness about y, for deflection along z (N m²).
    pub(crate) EI_y: f64,
    /// Bending stiffness about z, for deflection along y (N m²).
    pub(crate) EI_z: f64,
    /// Torsional stiffness (N m²).
    pub(crate) GJ: f64,
    /// Shear stiffness along y and z (N); infinite for Euler-Bernoulli.
    pub(crate) kGA: [f64; 2],
    /// Mass per length (kg/m).
    pub(crate) mu: f64,
}

impl Stiffness {
    /// Returns the compliance of the end. Gere & Timoshenko, Mechanics of Materials, appendix G;
    /// Cowper for shear.
    pub(crate) fn tip_compliance(&self) -> Matrix6<f64> {
        let Self { l, EA, EI_y, EI_z, GJ, kGA, .. } = *self;
        let mut C = Matrix6::zeros();
        C[(0, 0)] = l / EA;
        C[(3, 3)] = l / GJ;
        C[(1, 1)] = l.powi(3) / (3.0 * EI_z) + l / kGA[0];
        C[(5, 5)] = l / EI_z;
        C[(1, 5)] = l.powi(2) / (2.0 * EI_z);
        C[(5, 1)] = C[(1, 5)];
        C[(2, 2)] = l.powi(3) / (3.0 * EI_y) + l / kGA[1];
        C[(4, 4)] = l / EI_y;
        C[(2, 4)] = -l.powi(2) / (2.0 * EI_y);
        C[(4, 2)] = C[(2, 4)];
        C
    }

    /// Returns the deflection along z and the slope `dw/dx` at `x` under a force along z (N) at
    /// `a`, without shear.
    pub(crate) fn under_force(&self, force: f64, a: f64, x: f64) -> [f64; 2] {
        let k = force / self.EI_y;
        if x <= a {
            [k * x * x * (3.0 * a - x) / 6.0, k * x * (2.0 * a - x) / 2.0]
        } else {
            [k * a * a * (3.0 * x - a) / 6.0, k * a * a / 2.0]
        }
    }

    /// Returns the same under a moment at `a` that bends the beam towards +z (about -y, N m).
    pub(crate) fn under_moment(&self, moment: f64, a: f64, x: f64) -> [f64; 2] {
        let k = moment / self.EI_y;
        if x <= a { [k * x * x / 2.0, k * x] } else { [k * a * (2.0 * x - a) / 2.0, k * a] }
    }

    /// Returns the sag of the end along z under the beam's own weight, without shear.
    pub(crate) fn own_weight(&self, g: f64) -> f64 {
        self.mu * g * self.l.powi(4) / (8.0 * self.EI_y)
    }

    /// Computes the first frequencies (Hz) of bending with stiffness `EI`, rotary inertia (kg m,
    /// `rho I`; zero for Euler-Bernoulli) and a point mass (kg) at the end, without shear. Uses the
    /// clamped solution `w = A (cosh ax - cos bx) + B (sinh ax - (a/b) sin bx)` with `EI w'' = 0`
    /// and `EI w''' + r omega² w' + m omega² w = 0` at the end. Blevins, tables 8-1 and 8-8, for
    /// `r = 0`.
    pub(crate) fn bending_hz(&self, EI: f64, rotary: f64, point_mass: f64, count: usize) -> Vec<f64> {
        let (l, mu) = (self.l, self.mu);
        let determinant = |omega: f64| {
            let (c, k) = (rotary * omega * omega / EI, mu * omega * omega / EI);
            let root = (0.25 * c * c + k).sqrt();
            let (a, b) = ((root - 0.5 * c).sqrt(), (root + 0.5 * c).sqrt());
            // All terms are divided by cosh(al), which is never zero.
            let (ch, sh) = (1.0, (a * l).tanh());
            let over = 1.0 / (a * l).cosh();
            let (cos, sin) = ((b * l).cos() * over, (b * l).sin() * over);
            let load = point_mass * omega * omega / EI;
            let moment = [a * a * ch + b * b * cos, a * a * sh + a * b * sin];
            let shear = [
                a * b * b * sh - b * a * a * sin + load * (ch - cos),
                a * b * b * ch + a * a * a * cos + load * (sh - a / b * sin),
            ];
            moment[0] * shear[1] - moment[1] * shear[0]
        };
        let unit = (EI / (mu * l.powi(4))).sqrt();
        let (mut found, mut omega) = (Vec::new(), 0.01 * unit);
        while found.len() < count && omega < 1e4 * unit {
            let next = omega + 0.02 * unit;
            if determinant(omega) * determinant(next) < 0.0 {
                found.push(bisect(determinant, omega, next) / std::f64::consts::TAU);
            }
            omega = next;
        }
        found
    }

    /// Computes the height and the shortening of the end, over the length, under a force (N) of
    /// constant direction, for any deflection, without stretch or shear. Integrates the elastica
    /// `EI theta'' = -F cos theta` by RK4, with bisection on the curvature at the clamp.
    pub(crate) fn elastica(&self, force: f64) -> [f64; 2] {
        let load = force * self.l.powi(2) / self.EI_y;
        let end = |curvature: f64| -> [f64; 4] {
            const STEPS: usize = 2000;
            let h = 1.0 / STEPS as f64;
            let rate = |[theta, kappa, _, _]: [f64; 4]| [kappa, -load * theta.cos(), theta.cos(), theta.sin()];
            let mut y = [0.0, curvature, 0.0, 0.0];
            for _ in 0..STEPS {
                let along = |k: [f64; 4], by: f64| std::array::from_fn(|i| y[i] + by * k[i]);
                let k1 = rate(y);
                let k2 = rate(along(k1, 0.5 * h));
                let k3 = rate(along(k2, 0.5 * h));
                let k4 = rate(along(k3, h));
                y = std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
            }
            y
        };
        let curvature = bisect(|kappa| end(kappa)[1], 0.0, load);
        let [_, _, x, z] = end(curvature);
        [z, 1.0 - x]
    }
}

/// Torsion constant (m⁴) of a rectangle: St. Venant's series, Timoshenko & Goodier, Theory of
/// Elasticity, article 109.
pub(crate) fn rectangle_torsion(long: f64, short: f64) -> f64 {
    use std::f64::consts::PI;
    let term = |n: f64| (n * PI * long / (2.0 * short)).tanh() / n.powi(5);
    let series: f64 = (0..200).map(|k| term(f64::from(2 * k + 1))).sum();
    long * short.powi(3) * (1.0 / 3.0 - 64.0 / PI.powi(5) * short / long * series)
}

/// Finds a zero of `f` between two points at which its signs differ, by bisection.
fn bisect(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let below = f(low) < 0.0;
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if (f(middle) < 0.0) == below { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Moves the reference point of a compliance over a rigid lever: `Ad C Adᵀ`, from B to T with
/// `p_BT` (same axes).
pub(crate) fn at_lever(C: &Matrix6<f64>, p_BT: &Vector3<f64>) -> Matrix6<f64> {
    let mut Ad = Matrix6::identity();
    Ad.fixed_view_mut::<3, 3>(0, 3).copy_from(&-p_BT.cross_matrix());
    Ad * C * Ad.transpose()
}

/// Rotates a compliance to other axes: `R C Rᵀ`, with `R` on both halves.
pub(crate) fn turned(C: &Matrix6<f64>, R: &Matrix3<f64>) -> Matrix6<f64> {
    let mut B = Matrix6::zeros();
    B.fixed_view_mut::<3, 3>(0, 0).copy_from(R);
    B.fixed_view_mut::<3, 3>(3, 3).copy_from(R);
    B * C * B.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    const BAR: Stiffness =
        Stiffness { l: 0.8, EA: 5.6e7, EI_y: 7466.7, EI_z: 1866.7, GJ: 1928.0, kGA: [f64::INFINITY; 2], mu: 2.16 };

    /// Truth: the roots 1.8751 and 4.6941 of the clamped beam, and robots/test/one_beam/README.md with a
    /// point mass.
    #[test]
    fn frequencies_are_those_of_the_tables() {
        let f = BAR.bending_hz(BAR.EI_y, 0.0, 0.0, 2);
        let root = |b: f64| b * b * (BAR.EI_y / BAR.mu).sqrt() / (0.64 * std::f64::consts::TAU);
        assert!((f[0] / root(1.875_104_069) - 1.0).abs() < 1e-9, "{f:?}");
        assert!((f[1] / root(4.694_091_133) - 1.0).abs() < 1e-9, "{f:?}");
        let loaded = BAR.bending_hz(BAR.EI_z, 0.0, 0.5, 1)[0];
        assert!((loaded / 17.4228 - 1.0).abs() < 1e-4, "{loaded}");
        // Rayleigh: rotary inertia adds r/mu times the ratio of squared slope to squared deflection
        // of the mode, 4.6479/l².
        let rotary = BAR.bending_hz(BAR.EI_y, 1e-3, 0.0, 1)[0];
        let expected = (1.0 + 1e-3 / BAR.mu * 4.6479 / 0.64).sqrt().recip();
        assert!((rotary / f[0] - expected).abs() < 2e-6, "{} {expected}", rotary / f[0]);
    }

    /// Truth: Bisshopp & Drucker (1945) as tabulated by Mattiasson (1981): F l²/EI = 1: w/l =
    /// 0.30172, u/l = 0.05643; = 10: 0.81061, 0.55500.
    #[test]
    fn the_elastica_is_the_published_one() {
        for (load, w, u) in [(1.0, 0.30172, 0.05643), (10.0, 0.81061, 0.55500)] {
            let [z, shortening] = BAR.elastica(load * BAR.EI_y / 0.64);
            assert!((z - w).abs() < 1e-5 && (shortening - u).abs() < 1e-5, "{load}: {z} {shortening}");
        }
    }

    /// Truth: 0.1406 a⁴ of a square, 0.2287 a b³ of 2 : 1, Timoshenko & Goodier's table.
    #[test]
    fn torsion_of_rectangles_is_that_of_the_table() {
        assert!((rectangle_torsion(1.0, 1.0) - 0.1406).abs() < 5e-5);
        assert!((rectangle_torsion(2.0, 1.0) / 2.0 - 0.2287).abs() < 5e-5);
    }

    /// Truth: a force and a moment at the end agree with the compliance of the end; curves are
    /// continuous at the load.
    #[test]
    fn curves_along_the_beam_end_where_the_compliance_says() {
        let C = BAR.tip_compliance();
        let [w, slope] = BAR.under_force(3.0, 0.8, 0.8);
        assert!((w - 3.0 * C[(2, 2)]).abs() < 1e-15 && (slope + 3.0 * C[(4, 2)]).abs() < 1e-15);
        let [w, slope] = BAR.under_moment(2.0, 0.8, 0.8);
        assert!((w + 2.0 * C[(2, 4)]).abs() < 1e-15 && (slope - 2.0 * C[(4, 4)]).abs() < 1e-15);
        for curve in [Stiffness::under_force, Stiffness::under_moment] {
            let ([a, da], [b, db]) = (curve(&BAR, 1.0, 0.3, 0.3), curve(&BAR, 1.0, 0.3, 0.3 + 1e-12));
            assert!((a - b).abs() < 1e-12 && (da - db).abs() < 1e-12);
        }
    }

    /// Truth: the weight of each slice deflects the end like a separate force; the sum over 1000
    /// slices by the midpoint rule.
    #[test]
    fn own_weight_is_the_sum_of_the_weights_of_its_slices() {
        let slices = 1000;
        let length = BAR.l / f64::from(slices);
        let by_slice = |k: i32| BAR.under_force(BAR.mu * 9.81 * length, (f64::from(k) + 0.5) * length, BAR.l)[0];
        let sum: f64 = (0..slices).map(by_slice).sum();
        assert!((sum / BAR.own_weight(9.81) - 1.0).abs() < 1e-6, "{sum}");
    }

    /// Truth by hand: under F_z at T, 0.5 m along x beyond B, B sees a moment of -0.5 about y; T
    /// moves by C_zz + 2 (-0.5) C_zy + 0.25 C_yy.
    #[test]
    fn a_lever_makes_a_force_a_moment_and_a_turn_a_shift() {
        let C = BAR.tip_compliance();
        let at_T = at_lever(&C, &Vector3::new(0.5, 0.0, 0.0));
        assert!((at_T[(2, 2)] - (C[(2, 2)] - C[(2, 4)] + 0.25 * C[(4, 4)])).abs() < 1e-18);
        assert!((at_T[(4, 4)] - C[(4, 4)]).abs() < 1e-18 && (at_T - at_T.transpose()).amax() < 1e-18);
        // A bar 0.5 m longer whose extension is rigid.
        assert!(at_T[(2, 2)] > C[(2, 2)] && at_T[(2, 2)] < C[(2, 2)] * (1.3f64 / 0.8).powi(3));
    }

    /// Truth by hand: with the beam's x along the world's z, its bending along z is along the
    /// world's x.
    #[test]
    fn a_beam_that_stands_bends_sideways() {
        let (C, R) = (BAR.tip_compliance(), Matrix3::from_columns(&[Vector3::z(), Vector3::y(), -Vector3::x()]));
        let standing = turned(&C, &R);
        assert!((standing[(0, 0)] - C[(2, 2)]).abs() < 1e-18 && (standing[(2, 2)] - C[(0, 0)]).abs() < 1e-18);
        assert!((standing[(5, 5)] - C[(3, 3)]).abs() < 1e-18);
    }

    #[test]
    fn bisection_finds_a_root_whichever_way_the_function_goes() {
        for sign in [1.0, -1.0] {
            assert!((bisect(|x| sign * (x * x - 2.0), 0.0, 2.0) - 2f64.sqrt()).abs() < 1e-15);
        }
    }
}
