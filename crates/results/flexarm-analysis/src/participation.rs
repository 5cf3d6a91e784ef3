//! Participation of a mode: at the TCP, and in the strain energy of the elements.
//!
//! Shapes have unit modal mass, `φᴴ M φ = 1`. Not here: the modes (`damped_modes`).

use nalgebra::{Complex, DMatrix, DVector};

use crate::damped_modes::DampedMode;

/// Computes the motion of the outputs in a mode, `C φ`, for a shape of unit modal mass.
///
/// * `C`: p×n, output per coordinate (for the TCP its Jacobian, rows linear first).
///
/// Returns p complex numbers: amplitude and phase of each output.
///
/// # Panics
/// If `C` has not one column for each coordinate of the shape.
pub fn mode_outputs(mode: &DampedMode, C: &DMatrix<f64>) -> DVector<Complex<f64>> {
    C.map(|x| Complex::new(x, 0.0)) * &mode.shape
}

/// Computes the effective mass of a mode at an output: the point mass there with the same kinetic
/// energy at the same speed, `1 / |c φ|²` (kg, or kg m² for an angle). Infinite at a node of the
/// mode.
pub fn effective_mass(output: Complex<f64>) -> f64 {
    1.0 / output.norm_sqr()
}

/// Computes the share of a mode in the static compliance `c K^-1 cᵀ` of each output; the shares of
/// all modes add up to the compliance for any damping.
///
/// ```text
/// c K^-1 cᵀ = Σ 2 Re (c φ)² / (-λ a)        a = φᵀ (2 λ M + D) φ        (half of that for a real λ)
/// ```
/// Without damping this is `(c φ)² / ω²`. `None` for a rigid motion, which has no compliance.
///
/// * `M`, `D`: n×n, as in [`crate::damped_modes`]. `C`: p×n, output per coordinate.
///
/// Returns p numbers (m/N, rad/(N m)).
pub fn compliance_parts(
    mode: &DampedMode,
    M: &DMatrix<f64>,
    D: &DMatrix<f64>,
    C: &DMatrix<f64>,
) -> Option<DVector<f64>> {
    let lambda = mode.eigenvalue;
    if lambda.norm() == 0.0 {
        return None;
    }
    let weighted = DMatrix::from_fn(M.nrows(), M.ncols(), |i, j| 2.0 * lambda * M[(i, j)] + D[(i, j)]);
    let a = mode.shape.dot(&(weighted * &mode.shape));
    let pair = if lambda.im > 0.0 { 2.0 } else { 1.0 };
    Some(mode_outputs(mode, C).map(|output| pair * (output * output / (-lambda * a)).re))
}

/// Computes the share of each element in the strain energy of a shape, `φᴴ K_k φ` over the sum;
/// zeros if there is no strain energy.
///
/// * `blocks`: first coordinate of each element, and its stiffness, symmetric.
///
/// Returns one number per element; they add up to 1.
pub fn strain_energy_shares(shape: &DVector<Complex<f64>>, blocks: &[(usize, DMatrix<f64>)]) -> Vec<f64> {
    let energies: Vec<f64> = blocks
        .iter()
        .map(|(first, K)| {
            let part = shape.rows(*first, K.nrows());
            let (re, im) = (part.map(|x| x.re), part.map(|x| x.im));
            re.dot(&(K * &re)) + im.dot(&(K * &im))
        })
        .collect();
    let total: f64 = energies.iter().sum();
    energies.iter().map(|e| if total > 0.0 { e / total } else { 0.0 }).collect()
}
