//! Response of a pole to a force interpolated between nodes, in closed form or by quadrature to
//! rounding.
//!
//! ```text
//! I_j(c) = ∫_0^c e^{z (c - σ)} ℓ_j(σ) dσ
//! ```
//! with the Lagrange polynomials ℓ_j of the Gauss nodes of (0, 1). For small `z` by Gauss
//! quadrature; for large `z` by integration by parts, a finite sum because ℓ_j is a polynomial.

use std::sync::LazyLock;

use nalgebra::{Complex, SMatrix, SVector};

/// Number of nodes of an element.
pub const NODES: usize = 6;
/// Number of quadrature points.
const POINTS: usize = 14;
/// Magnitude of `z` up to which the quadrature is exact to rounding; above, the sum by parts is.
const SMALL: f64 = 7.0;

/// Nodes, and the data that depend only on them. Targets are the nodes and, last, the end of the
/// element.
pub struct Rule {
    /// Gauss nodes in (0, 1).
    pub nodes: [f64; NODES],
    /// Weights of the nodes.
    pub weights: [f64; NODES],
    /// `1 - x_q` at the quadrature points on (0, 1).
    backward: [f64; POINTS],
    /// Weight times ℓ_j at a quadrature point on (0, c), by target, point and node.
    table: Vec<[[f64; NODES]; POINTS]>,
    /// Derivatives of ℓ_j, by order and node: at 0, and at the targets.
    at_start: [[f64; NODES]; NODES],
    at_target: Vec<[[f64; NODES]; NODES]>,
}

/// Moments of one pole over one element.
#[derive(Clone, Debug)]
pub struct Moments {
    /// `e^{z c}`, by target.
    pub decay: [Complex<f64>; NODES + 1],
    /// `I_j(c)`, by target and node.
    pub integrals: [[Complex<f64>; NODES]; NODES + 1],
}

/// The rule of all elements.
pub static RULE: LazyLock<Rule> = LazyLock::new(Rule::new);

impl Rule {
    fn new() -> Self {
        let (nodes, weights) = gauss::<NODES>();
        let (points, point_weights) = gauss::<POINTS>();
        let coefficients = lagrange_coefficients(&nodes);
        let targets: Vec<f64> = nodes.iter().copied().chain([1.0]).collect();
        let value = |j: usize, order: usize, x: f64| derivative(&coefficients, j, order, x);
        let row = |c: f64, q: usize| std::array::from_fn(|j| c * point_weights[q] * value(j, 0, c * points[q]));
        let derivatives = |x: f64| std::array::from_fn(|order| std::array::from_fn(|j| value(j, order, x)));
        Self {
            nodes,
            weights,
            backward: points.map(|x| 1.0 - x),
            table: targets.iter().map(|c| std::array::from_fn(|q| row(*c, q))).collect(),
            at_start: derivatives(0.0),
            at_target: targets.iter().map(|c| derivatives(*c)).collect(),
        }
    }

    /// Computes all moments for `z`, the pole times the length of the element; lengths are relative
    /// to that of the element.
    pub fn moments(&self, z: Complex<f64>) -> Moments {
        let targets: [f64; NODES + 1] = std::array::from_fn(|i| *self.nodes.get(i).unwrap_or(&1.0));
        let decay = targets.map(|c| (z * c).exp());
        let zero = [Complex::new(0.0, 0.0); NODES];
        let mut integrals = [zero; NODES + 1];
        for (i, c) in targets.iter().enumerate() {
            integrals[i] = if z.norm() <= SMALL { self.by_quadrature(z, *c, i) } else { self.by_parts(z, decay[i], i) };
        }
        Moments { decay, integrals }
    }

    /// Returns the integrals `I_j(c)` up to a target by Gauss quadrature on (0, c).
    ///
    /// * `z`: pole times the length of the element; exact to rounding up to a magnitude of 7, above
    ///   which the exponential is not resolved.
    /// * `c`: position of the target, in element lengths; `target`: its number.
    pub fn by_quadrature(&self, z: Complex<f64>, c: f64, target: usize) -> [Complex<f64>; NODES] {
        let mut sum = [Complex::new(0.0, 0.0); NODES];
        for (back, row) in self.backward.iter().zip(&self.table[target]) {
            let e = (z * (c * back)).exp();
            for (s, weight) in sum.iter_mut().zip(row) {
                *s += e * *weight;
            }
        }
        sum
    }

    /// Returns the integrals `I_j(c)` up to a target by repeated integration by parts,
    ///
    /// ```text
    /// I_j(c) = Σ_n (e^{z c} ℓ_j⁽ⁿ⁾(0) - ℓ_j⁽ⁿ⁾(c)) / z^{n+1},
    /// ```
    /// a finite sum since ℓ_j is a polynomial; small `z` cancel.
    ///
    /// * `decay`: `e^{z c}`; `target`: number of the target.
    pub fn by_parts(&self, z: Complex<f64>, decay: Complex<f64>, target: usize) -> [Complex<f64>; NODES] {
        let mut sum = [Complex::new(0.0, 0.0); NODES];
        let mut factor = z.inv();
        for order in 0..NODES {
            for (j, s) in sum.iter_mut().enumerate() {
                *s += factor * (decay * self.at_start[order][j] - self.at_target[target][order][j]);
            }
            factor /= z;
        }
        sum
    }
}

/// Computes Gauss-Legendre nodes and weights on (0, 1), by Newton's method on the Legendre polynomial.
fn gauss<const N: usize>() -> ([f64; N], [f64; N]) {
    let (mut nodes, mut weights) = ([0.0; N], [0.0; N]);
    for k in 0..N {
        let mut x = -(std::f64::consts::PI * (k as f64 + 0.75) / (N as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..50 {
            // P_N and its derivative by the three-term recurrence.
            let (mut before, mut value) = (1.0, x);
            for n in 2..=N {
                let n = n as f64;
                (before, value) = (value, ((2.0 * n - 1.0) * x * value - (n - 1.0) * before) / n);
            }
            slope = N as f64 * (x * value - before) / (x * x - 1.0);
            x -= value / slope;
            if (value / slope).abs() < 1e-16 {
                break;
            }
        }
        nodes[k] = 0.5 + 0.5 * x;
        weights[k] = 1.0 / ((1.0 - x * x) * slope * slope);
    }
    (nodes, weights)
}

/// Computes the monomial coefficients of ℓ_j in column j.
fn lagrange_coefficients(nodes: &[f64; NODES]) -> SMatrix<f64, NODES, NODES> {
    let mut coefficients = SMatrix::<f64, NODES, NODES>::zeros();
    for j in 0..NODES {
        // Multiplies out Π (x - x_k) / (x_j - x_k).
        let mut polynomial = SVector::<f64, NODES>::zeros();
        polynomial[0] = 1.0;
        for k in (0..NODES).filter(|k| *k != j) {
            let mut shifted = SVector::<f64, NODES>::zeros();
            for n in 1..NODES {
                shifted[n] = polynomial[n - 1];
            }
            polynomial = (shifted - polynomial * nodes[k]) / (nodes[j] - nodes[k]);
        }
        coefficients.set_column(j, &polynomial);
    }
    coefficients
}

/// Evaluates a derivative of ℓ_j at x.
fn derivative(coefficients: &SMatrix<f64, NODES, NODES>, j: usize, order: usize, x: f64) -> f64 {
    let mut sum = 0.0;
    for n in (order..NODES).rev() {
        let falling: f64 = (0..order).map(|k| (n - k) as f64).product();
        sum = sum * x + falling * coefficients[(n, j)];
    }
    sum
}
