//! Reduced model: a small dense stiffness and mass over interfaces and modes.
//!
//! Order: six DoF per interface, proximal first, linear before angular, then the modes; link axes,
//! SI. Not here: how it is computed (`condensation`), its integrals for motion (`modal`).

use flexarm_spatial::{Matrix12, Pose};
use nalgebra::{DMatrix, SymmetricEigen};

use super::boundary::Tie;
use super::condensation::spd_inverse;

/// One interface of a superelement.
#[derive(Debug, Clone, PartialEq)]
pub struct InterfaceFrame {
    /// Name.
    pub name: String,
    /// Frame in the link frame; the six DoF are those of its origin, in link axes.
    pub X_LI: Pose,
    /// Kind of tie, if known.
    pub tie: Option<Tie>,
}

/// Stiffness and mass over the boundary DoF, six per interface, followed by mass-normalised modes.
#[derive(Debug, Clone, PartialEq)]
pub struct Superelement {
    /// Interfaces, proximal first.
    pub interfaces: Vec<InterfaceFrame>,
    /// Stiffness, link axes, SI; modal block diagonal with ω².
    pub K: DMatrix<f64>,
    /// Mass, link axes, SI; identity in the modal block.
    pub M: DMatrix<f64>,
}

impl Superelement {
    /// Number of boundary DoF.
    pub fn boundary(&self) -> usize {
        6 * self.interfaces.len()
    }

    /// Number of modal coordinates.
    pub fn modes(&self) -> usize {
        self.K.nrows() - self.boundary()
    }

    /// Frequencies of the fixed-interface modes, Hz: roots of the modal diagonal of K.
    pub fn fixed_frequencies_hz(&self) -> Vec<f64> {
        (self.boundary()..self.K.nrows()).map(|k| self.K[(k, k)].max(0.0).sqrt() / std::f64::consts::TAU).collect()
    }

    /// Natural frequencies with some interfaces clamped.
    ///
    /// * `held`: indices of the clamped interfaces, from 0; none for the free link.
    ///
    /// Returns one frequency per remaining coordinate, Hz, ascending; those of rigid motions are
    /// near zero. Empty if the mass is not positive definite.
    pub fn frequencies_hz(&self, held: &[usize]) -> Vec<f64> {
        let keep: Vec<usize> =
            (0..self.K.nrows()).filter(|k| *k >= self.boundary() || !held.contains(&(k / 6))).collect();
        let K = self.K.select_rows(&keep).select_columns(&keep);
        let M = self.M.select_rows(&keep).select_columns(&keep);
        generalised_frequencies(&K, &M)
    }

    /// Returns the superelement without its modes: `K_g` and `M_g` of Guyan reduction [Guyan 1965].
    pub fn guyan(&self) -> Self {
        let n = self.boundary();
        let top = |A: &DMatrix<f64>| A.view((0, 0), (n, n)).into_owned();
        Self { interfaces: self.interfaces.clone(), K: top(&self.K), M: top(&self.M) }
    }
}

/// Stiffness of the first two interfaces with all other interfaces and modes free.
///
/// ```text
/// K12 = K_bb - K_cbᵀ K_cc⁻¹ K_cb      b: the two interfaces,  c: all other coordinates
/// ```
/// Returns a 12×12 matrix (N/m, N/rad; N·m/m, N·m/rad), link axes; `None` if `K_cc` is singular.
///
/// # Panics
/// If the superelement has fewer than two interfaces.
pub fn stiffness12(element: &Superelement) -> Option<Matrix12> {
    let n = element.K.nrows();
    let K = &element.K;
    let mut K12 = K.view((0, 0), (12, 12)).into_owned();
    let K_cb = K.view((12, 0), (n - 12, 12)).into_owned();
    // Craig-Bampton modes have no stiffness coupling with the interfaces.
    if K_cb.iter().any(|k| *k != 0.0) {
        let K_cc = K.view((12, 12), (n - 12, n - 12)).into_owned();
        K12 -= K_cb.transpose() * spd_inverse(&K_cc)? * K_cb;
    }
    Some(Matrix12::from_column_slice(K12.as_slice()))
}

/// Frequencies `sqrt(λ)/2π` of a small dense pencil `K φ = λ M φ`, SI: Hz, ascending; negative λ
/// count as zero. Empty if the mass is not positive definite.
pub(crate) fn generalised_frequencies(K: &DMatrix<f64>, M: &DMatrix<f64>) -> Vec<f64> {
    // Rows have different units, so both matrices are scaled by the mass first.
    let scale = M.diagonal().map(|m| 1.0 / m.sqrt());
    let scaled = |A: &DMatrix<f64>| DMatrix::from_fn(A.nrows(), A.ncols(), |i, j| A[(i, j)] * scale[i] * scale[j]);
    let (K, M) = (scaled(K), scaled(M));
    if K.iter().chain(M.iter()).any(|x| !x.is_finite()) {
        return Vec::new();
    }
    let Some(factor) = M.cholesky() else { return Vec::new() };
    let Some(inverse) = factor.l().try_inverse() else { return Vec::new() };
    let A = &inverse * K * inverse.transpose();
    let eigenvalues = SymmetricEigen::new((&A + A.transpose()) * 0.5).eigenvalues;
    let mut frequencies: Vec<f64> = eigenvalues.iter().map(|e| e.max(0.0).sqrt() / std::f64::consts::TAU).collect();
    frequencies.sort_by(f64::total_cmp);
    frequencies
}
