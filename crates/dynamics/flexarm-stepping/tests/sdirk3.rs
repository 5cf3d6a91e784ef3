//! The SDIRK method: order, stability, and vibration in closed form.

use flexarm_stepping::internals::{GAMMA, NODES, WEIGHTS};
use flexarm_stepping::*;
use nalgebra::{Complex, DMatrix, DVector};

/// `ẍ + 2 ζ ω ẋ + ω² x = f sin 3t`.
struct Oscillator {
    omega: f64,
    zeta: f64,
    f: f64,
}

impl SecondOrderSystem for Oscillator {
    fn dimension(&self) -> usize {
        1
    }
    fn residual(&mut self, t: f64, x: &DVector<f64>, v: &DVector<f64>, a: &DVector<f64>, r: &mut DVector<f64>) {
        let Self { omega, zeta, f } = *self;
        r[0] = a[0] + 2.0 * zeta * omega * v[0] + omega * omega * x[0] - f * (3.0 * t).sin();
    }
    fn acceleration(
        &mut self,
        t: f64,
        x: &DVector<f64>,
        v: &DVector<f64>,
        a: &mut DVector<f64>,
    ) -> Result<(), StepError> {
        let Self { omega, zeta, f } = *self;
        a[0] = f * (3.0 * t).sin() - 2.0 * zeta * omega * v[0] - omega * omega * x[0];
        Ok(())
    }
    fn mass(&mut self, M: &mut DMatrix<f64>) {
        M.fill(1.0);
    }
    fn damping_and_stiffness(&mut self, c_D: f64, c_K: f64, C: &mut DMatrix<f64>) {
        C.fill(c_D * 2.0 * self.zeta * self.omega + c_K * self.omega * self.omega);
    }
    fn stiffness(&mut self, K: &mut DMatrix<f64>) {
        K.fill(self.omega * self.omega);
    }
}

fn after(system: &mut Oscillator, h: f64, steps: usize) -> [f64; 2] {
    let mut g = Sdirk3::new(system, 0.0, h, DVector::from_element(1, 1.0), DVector::zeros(1)).unwrap();
    (0..steps).for_each(|_| g.step(system).unwrap());
    [g.now.x[0], g.now.v[0]]
}

/// Returns the stability function (6).
fn R(z: Complex<f64>) -> Complex<f64> {
    let (g, one) = (GAMMA, Complex::from(1.0));
    (one + z * (1.0 - 3.0 * g) + z * z * (0.5 - 3.0 * g + 3.0 * g * g)) / (one - z * g).powi(3)
}

/// Truth: the conditions of orders 1 to 3, `Σ b = 1`, `Σ b c = 1/2`, `Σ b c² = 1/3`,
/// `Σ b_i a_ij c_j = 1/6`, and `Σ_j a_ij = c_i`.
#[test]
fn coefficients_fulfil_the_conditions_of_third_order() {
    let (g, b) = (GAMMA, WEIGHTS[2]);
    let sum = |f: &dyn Fn(usize) -> f64| (0..3).map(f).sum::<f64>();
    let defects = [
        g.powi(3) - 3.0 * g * g + 1.5 * g - 1.0 / 6.0,
        sum(&|i| b[i]) - 1.0,
        sum(&|i| b[i] * NODES[i]) - 1.0 / 2.0,
        sum(&|i| b[i] * NODES[i] * NODES[i]) - 1.0 / 3.0,
        sum(&|i| b[i] * sum(&|j| WEIGHTS[i][j] * NODES[j])) - 1.0 / 6.0,
    ];
    assert!(defects.iter().all(|d| d.abs() < 1e-15), "{defects:?}"); // measured 2e-16
    assert!((0..3).all(|i| (sum(&|j| WEIGHTS[i][j]) - NODES[i]).abs() < 1e-15));
}

/// Truth: (6) with `h λ = h ω (-ζ ± i sqrt(1 - ζ²))`; a mode far too fast for the step keeps
/// `2.9/(hω)` of its amplitude after one step. Measured 4e-10 at hω = 1e6, 1e-12 below.
#[test]
fn a_stiff_mode_is_gone_after_one_step() {
    let h = 1e-2;
    for zeta in [0.0f64, 0.03, 0.6] {
        for hw in [0.1, 1.0, 10.0, 1e3, 1e6] {
            let omega = hw / h;
            let lambda = Complex::new(-zeta, (1.0 - zeta * zeta).sqrt()) * omega;
            // x = Re(c u), v = Re(c λ u) with x = 1, v = 0 at u = 1.
            let c = Complex::new(1.0, lambda.re / lambda.im);
            let u = R(lambda * h);
            let truth = [(c * u).re, (c * lambda * u).re];
            let found = after(&mut Oscillator { omega, zeta, f: 0.0 }, h, 1);
            let error = (found[0] - truth[0]).abs().max((found[1] - truth[1]).abs() / omega);
            assert!(error < 1e-8, "{hw} {zeta}: {found:?} {truth:?}");
            assert!(found[0].abs() <= 4.0 / hw, "{hw} {zeta}: {}", found[0]);
        }
    }
}

/// Truth: no mode grows, `|R(iy)| ≤ 1`, and a slow one loses `0.026 (hω)⁴` per step.
#[test]
fn no_undamped_mode_grows_and_slow_ones_lose_little() {
    let size = |y: f64| R(Complex::new(0.0, y)).norm();
    assert!((0..4000).all(|k| size(10f64.powf(-2.0 + 0.002 * f64::from(k))) <= 1.0));
    let lost = (1.0 - size(0.01)) / 0.01f64.powi(4);
    assert!((lost - 0.026).abs() < 1e-3, "{lost}"); // measured 0.0259
}

/// Truth: free and forced vibration in closed form.
#[test]
fn the_error_falls_with_the_third_power_of_the_step() {
    let (omega, zeta, f, t) = (20.0f64, 0.03f64, 100.0, 1.0f64);
    let p = 3.0f64;
    // Forced part B sin pt + C cos pt, free part that starts at x = 1, v = 0.
    let (k, d) = (omega * omega - p * p, 2.0 * zeta * omega * p);
    let (B, C) = (f * k / (k * k + d * d), -f * d / (k * k + d * d));
    let w = omega * (1.0 - zeta * zeta).sqrt();
    let (x0, v0) = (1.0 - C, -B * p);
    let free = (-zeta * omega * t).exp() * (x0 * (w * t).cos() + (v0 + zeta * omega * x0) / w * (w * t).sin());
    let truth = free + B * (p * t).sin() + C * (p * t).cos();
    let errors = [5e-4, 2.5e-4]
        .map(|h| (after(&mut Oscillator { omega, zeta, f }, h, (t / h).round() as usize)[0] - truth).abs());
    let order = (errors[0] / errors[1]).log2();
    assert!((order - 3.0).abs() < 0.05, "{order}"); // measured 2.986
}
