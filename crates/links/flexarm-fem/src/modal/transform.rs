//! Changes of coordinates of a modal link: orthogonalised, truncated, other frame, other axes.
//!
//! Start at [`ModalLink::orthogonalised`] and [`ModalLink::truncated`]. Link axes and Lo as in the
//! module above; coordinates change by `η = V η'`, matrices by `Vᵀ A V`.
//!
//! Not here: integrals over a mesh ([`super::ModalSource`]).

use flexarm_spatial::{Pose, symmetric_part};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix3xX, Matrix6xX, Rotation3, Translation3, Vector3};

use super::PRODUCTS;
use super::{GeometricStiffness, ModalInterface, ModalLink};
use crate::error::FemError;

/// Modes with `ΦᵀKΦ = diag(ω²)`, `ΦᵀMΦ = 1`.
pub(super) struct Eigenpairs {
    /// Angular frequencies, rad/s, ascending.
    pub(super) omega: Vec<f64>,
    pub(super) Phi: DMatrix<f64>,
}

/// Maximum number of sweeps over all pairs of columns; half as many have always been enough.
const MAX_SWEEPS: usize = 60;

/// All modes of a dense symmetric positive definite pencil; `None` if it is not positive definite.
///
/// One-sided Jacobi: columns that are orthonormal in K are rotated in pairs until they are
/// orthogonal in M too. Low frequencies keep their digits next to high ones, unlike eigenvalues of
/// a matrix of ω².
///
/// Source: Demmel & Veselić (1992), *SIAM J. Matrix Anal. Appl.* 13.
pub(super) fn eigenpairs(K: &DMatrix<f64>, M: &DMatrix<f64>) -> Option<Eigenpairs> {
    let n = K.nrows();
    // W: columns orthonormal in K; H = Gᵀ W with M = G Gᵀ, so that HᵀH = WᵀMW.
    let mut W = lower_factor(K)?.transpose().solve_upper_triangular(&DMatrix::identity(n, n))?;
    let G = lower_factor(M)?;
    let mut H = G.transpose() * &W;
    if H.iter().any(|x| !x.is_finite()) {
        return None;
    }
    for _ in 0..MAX_SWEEPS {
        let mut worst = 0.0_f64;
        for i in 0..n {
            for j in i + 1..n {
                let (a, b) = (H.column(i).norm_squared(), H.column(j).norm_squared());
                let c = H.column(i).dot(&H.column(j));
                let size = (a * b).sqrt();
                if !(c.abs() > 1e-16 * size) {
                    continue;
                }
                worst = worst.max(c.abs() / size);
                // Jacobi rotation that makes columns i and j of H orthogonal.
                let zeta = (b - a) / (2.0 * c);
                let t = zeta.signum() / (zeta.abs() + zeta.hypot(1.0));
                let cos = 1.0 / t.hypot(1.0);
                turn(&mut H, i, j, cos, cos * t);
                turn(&mut W, i, j, cos, cos * t);
            }
        }
        if worst < 1e-15 {
            break;
        }
    }
    // ω = 1/|h|, in ascending order; Φ = W/|h| is M-orthonormal.
    let sizes: Vec<f64> = H.column_iter().map(|h| h.norm()).collect();
    if sizes.iter().any(|size| !(*size > 0.0)) {
        return None;
    }
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|i, j| sizes[*j].total_cmp(&sizes[*i]));
    let omega = order.iter().map(|k| 1.0 / sizes[*k]).collect();
    let mut Phi = DMatrix::zeros(n, n);
    for (new, old) in order.into_iter().enumerate() {
        Phi.set_column(new, &(W.column(old) / sizes[old]));
    }
    Some(Eigenpairs { omega, Phi })
}

/// Cholesky factor of a matrix whose rows have different units, computed on a unit diagonal.
fn lower_factor(A: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = A.diagonal().map(f64::sqrt);
    if scale.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
        return None;
    }
    let scaled = DMatrix::from_fn(A.nrows(), A.ncols(), |i, j| A[(i, j)] / (scale[i] * scale[j]));
    let mut L = scaled.cholesky()?.unpack();
    for (mut row, s) in L.row_iter_mut().zip(scale.iter()) {
        row *= *s;
    }
    Some(L)
}

/// Jacobi rotation of columns i and j: `[a_i, a_j] ← [cos a_i - sin a_j, sin a_i + cos a_j]`.
fn turn(A: &mut DMatrix<f64>, i: usize, j: usize, cos: f64, sin: f64) {
    for row in 0..A.nrows() {
        let (x, y) = (A[(row, i)], A[(row, j)]);
        A[(row, i)] = cos * x - sin * y;
        A[(row, j)] = sin * x + cos * y;
    }
}

impl ModalLink {
    /// Transforms the link to its modes with A clamped: `K = diag(ω²)`, `M = 1`, ascending.
    ///
    /// Returns the link in coordinates `η = V η'` with the mass-normalised modes V as columns.
    /// Stiffness and mass decouple, and the highest modes, which are not physical, can be dropped;
    /// dropping modes makes the interfaces stiffer under static loads.
    ///
    /// * `keep`: number of modes; all if not given.
    ///
    /// # Errors
    /// [`FemError::Missing`] if stiffness or mass is not positive definite,
    /// [`FemError::OutOfRange`] for more modes than coordinates.
    ///
    /// # Source
    /// Craig & Chang (1977): orthogonalisation of the Craig-Bampton shapes.
    pub fn orthogonalised(&self, keep: Option<usize>) -> Result<Self, FemError> {
        let n = self.coordinates();
        let kept = keep.unwrap_or(n);
        if kept > n {
            let what = "number of modes to keep".to_owned();
            return Err(FemError::OutOfRange { what, found: kept as f64, allowed: format!("up to {n}") });
        }
        let help = "they must be positive definite with A held";
        let pairs = eigenpairs(&self.K, &self.M)
            .ok_or(FemError::Missing { what: "a usable stiffness and mass of the modal link", help })?;
        let V = pairs.Phi.columns(0, kept).into_owned();
        let omega2 = DVector::from_iterator(kept, pairs.omega[..kept].iter().map(|omega| omega * omega));
        let hz = pairs.omega[..kept].iter().map(|omega| omega / std::f64::consts::TAU);
        Ok(Self {
            M: DMatrix::identity(kept, kept),
            K: DMatrix::from_diagonal(&omega2),
            labels: hz.enumerate().map(|(k, hz)| format!("mode {} with A held: {hz:.3} Hz", k + 1)).collect(),
            ..self.in_coordinates(&V)
        })
    }

    /// Keeps only the first fixed-interface modes of the link.
    ///
    /// * `modes`: number of modes to keep, after the six coordinates of each interface.
    ///
    /// The static stiffness over the interfaces is unchanged.
    ///
    /// # Errors
    /// [`FemError::Missing`] if the coordinates are not of Craig-Bampton type,
    /// [`FemError::OutOfRange`] for more modes than the link has.
    pub fn truncated(&self, modes: usize) -> Result<Self, FemError> {
        if !self.is_craig_bampton() {
            let help = "the coordinates are not those of Craig and Bampton; orthogonalised links take `keep`";
            return Err(FemError::Missing { what: "the fixed-interface modes", help });
        }
        // Static coordinates come first, modes by frequency after them.
        let statics = 6 * self.interfaces.len();
        let (n, kept) = (self.coordinates(), statics + modes);
        if kept > n {
            let what = "number of fixed-interface modes".to_owned();
            let allowed = format!("up to {}", n - statics);
            return Err(FemError::OutOfRange { what, found: modes as f64, allowed });
        }
        // All matrices lose the same rows and columns.
        let top = |A: &DMatrix<f64>| A.view((0, 0), (kept, kept)).into_owned();
        let pairs = (0..kept).flat_map(|k| (0..kept).map(move |l| k * n + l));
        Ok(Self {
            interfaces: self
                .interfaces
                .iter()
                .map(|i| ModalInterface { Phi: i.Phi.columns(0, kept).into_owned(), ..i.clone() })
                .collect(),
            C_t: self.C_t.columns(0, kept).into_owned(),
            C_r: self.C_r.columns(0, kept).into_owned(),
            P: self.P[..kept].to_vec(),
            N: pairs.map(|at| self.N[at]).collect(),
            M: top(&self.M),
            K: top(&self.K),
            geometric: self.geometric.as_ref().map(|G| G.mapped(&top)),
            labels: self.labels[..kept].to_vec(),
            name: self.name.clone(),
            ..*self
        })
    }

    /// Moves the link to another floating frame by removing a rigid motion from each shape,
    /// `φ_k - c_k - θ_k × s`.
    ///
    /// The stiffness is unchanged. The geometric stiffness belongs to the previous support and is
    /// dropped. Unknown second-order terms stay unknown.
    ///
    /// * `motion`: `c_k` (m, at Lo) over `θ_k` (rad), link axes, per unit of each coordinate: 6×n.
    ///
    /// # Panics
    /// If `motion` has fewer columns than the link has coordinates.
    pub fn without_rigid_motion(self, motion: &Matrix6xX<f64>) -> Self {
        let n = self.coordinates();
        let (m, mc) = (self.mass, self.first_moment);
        // ∫ s sᵀ dm
        let S = Matrix3::identity() * (0.5 * self.inertia.trace()) - self.inertia;
        let c: Vec<Vector3<f64>> = motion.column_iter().map(|q| q.fixed_rows::<3>(0).into_owned()).collect();
        let theta: Vec<Vector3<f64>> = motion.column_iter().map(|q| q.fixed_rows::<3>(3).into_owned()).collect();
        let turn: Vec<Matrix3<f64>> = theta.iter().map(Vector3::cross_matrix).collect();

        // First order: ∫ φ_k' dm and ∫ s φ_k'ᵀ dm.
        let (mut C_t, mut P, mut N, mut M) = (self.C_t.clone(), self.P.clone(), self.N.clone(), self.M.clone());
        for k in 0..n {
            C_t.column_mut(k).axpy(-1.0, &(c[k] * m + turn[k] * mc), 1.0);
            P[k] -= mc * c[k].transpose() + S * turn[k].transpose();
        }
        // ∫ φ_k ρ_lᵀ and ∫ ρ_k ρ_lᵀ with the rigid motions ρ.
        let mixed =
            |k: usize, l: usize| self.C_t.column(k) * c[l].transpose() + self.P[k].transpose() * turn[l].transpose();
        let rigid = |k: usize, l: usize| {
            c[k] * (c[l] * m + turn[l] * mc).transpose()
                + turn[k] * mc * c[l].transpose()
                + turn[k] * S * turn[l].transpose()
        };
        // Second order: N' = N - ∫ φ_k ρ_lᵀ - ∫ ρ_k φ_lᵀ + ∫ ρ_k ρ_lᵀ, and M_kl' = tr N_kl'.
        for (k, l) in (0..n).flat_map(|k| (k..n).map(move |l| (k, l))) {
            let change = rigid(k, l) - mixed(k, l) - mixed(l, k).transpose();
            M[(k, l)] += change.trace();
            M[(l, k)] = M[(k, l)];
            if self.has_second_order() {
                N[k * n + l] += change;
                N[l * n + k] = N[k * n + l].transpose();
            }
        }
        // Interfaces lose the rigid motion at Io.
        let interface = |i: &ModalInterface| {
            let mut Phi = i.Phi.clone();
            for (k, mut column) in Phi.column_iter_mut().enumerate() {
                let at = c[k] + theta[k].cross(&i.X_LI.translation.vector);
                let mut linear = column.fixed_rows_mut::<3>(0);
                linear -= at;
                let mut angular = column.fixed_rows_mut::<3>(3);
                angular -= theta[k];
            }
            ModalInterface { Phi, ..i.clone() }
        };
        let C_r: Vec<_> = P.iter().map(super::axial).collect();
        Self {
            interfaces: self.interfaces.iter().map(interface).collect(),
            C_t,
            C_r: Matrix3xX::from_columns(&C_r),
            P,
            N,
            M,
            geometric: None,
            ..self
        }
    }

    /// Expresses the link in other axes N at the same origin Lo; the coordinates are unchanged.
    ///
    /// * `R_NL`: rotation from the present link axes L to the new axes N.
    ///
    /// Returns the link with vectors `R_NL v`, tensors `R_NL A R_NLᵀ`, and unit loads along N.
    pub fn turned(&self, R_NL: &Rotation3<f64>) -> Self {
        let R = R_NL.matrix();
        let both = |A: &Matrix3<f64>| R * A * R.transpose();
        let pose = |X: &Pose| Pose::from_parts(Translation3::from(R * X.translation.vector), R_NL * X.rotation);
        let interface = |i: &ModalInterface| {
            let mut Phi = i.Phi.clone();
            for mut column in Phi.column_iter_mut() {
                for at in [0, 3] {
                    let turned = R * column.fixed_rows::<3>(at);
                    column.fixed_rows_mut::<3>(at).copy_from(&turned);
                }
            }
            ModalInterface { name: i.name.clone(), X_LI: pose(&i.X_LI), Phi }
        };
        let inertia = both(&self.inertia);
        Self {
            interfaces: self.interfaces.iter().map(interface).collect(),
            first_moment: R * self.first_moment,
            inertia: symmetric_part(&inertia),
            C_t: R * &self.C_t,
            C_r: R * &self.C_r,
            P: self.P.iter().map(both).collect(),
            N: self.N.iter().map(both).collect(),
            geometric: self.geometric.as_ref().map(|G| turned(G, R)),
            X_LA: pose(&self.X_LA),
            ..self.clone()
        }
    }

    /// Changes coordinates by `η = V η'`, V n×m: shapes become `Φ V`, quadratic forms `Vᵀ A V`.
    pub(super) fn in_coordinates(&self, V: &DMatrix<f64>) -> Self {
        let (n, m) = V.shape();
        let form = |A: &DMatrix<f64>| symmetric_part(&(V.transpose() * A * V));
        // N_ij' = Σ V_ki V_lj N_kl, for each entry of the 3×3.
        let mut N = vec![Matrix3::zeros(); m * m];
        for (a, b) in (0..9).map(|e| (e / 3, e % 3)) {
            let entries = DMatrix::from_fn(n, n, |k, l| self.N[k * n + l][(a, b)]);
            let turned = V.transpose() * entries * V;
            for (i, j) in (0..m).flat_map(|i| (i..m).map(move |j| (i, j))) {
                N[i * m + j][(a, b)] = turned[(i, j)];
            }
        }
        // Copying the transposed half makes N_ji = N_ijᵀ hold bit for bit.
        for i in 0..m {
            N[i * m + i] = (N[i * m + i] + N[i * m + i].transpose()) * 0.5;
            for j in 0..i {
                N[i * m + j] = N[j * m + i].transpose();
            }
        }
        let sum = |j: usize| (0..n).fold(Matrix3::zeros(), |sum, k| sum + self.P[k] * V[(k, j)]);
        let interface = |i: &ModalInterface| ModalInterface { Phi: Matrix6xX::from(&i.Phi * V), ..i.clone() };
        Self {
            name: self.name.clone(),
            interfaces: self.interfaces.iter().map(interface).collect(),
            C_t: Matrix3xX::from(&self.C_t * V),
            C_r: Matrix3xX::from(&self.C_r * V),
            P: (0..m).map(sum).collect(),
            N,
            M: form(&self.M),
            K: form(&self.K),
            geometric: self.geometric.as_ref().map(|G| G.mapped(&form)),
            labels: vec![String::new(); m],
            ..*self
        }
    }
}

/// Converts to unit loads along new axes N.
///
/// * `R`: `R_NL`, from the present axes L to the new ones.
fn turned(stiffness: &GeometricStiffness, R: &Matrix3<f64>) -> GeometricStiffness {
    // A load a along the new axes has the components Rᵀ a along the present ones.
    let three = |G: &[DMatrix<f64>]| -> [DMatrix<f64>; 3] {
        std::array::from_fn(|i| &G[0] * R[(i, 0)] + &G[1] * R[(i, 1)] + &G[2] * R[(i, 2)])
    };
    let six = |G: &[DMatrix<f64>; 6]| -> [DMatrix<f64>; 6] {
        // Forces and torques turn alike.
        let [x, y, z] = three(&G[..3]);
        let [rx, ry, rz] = three(&G[3..]);
        [x, y, z, rx, ry, rz]
    };
    let centrifugal = PRODUCTS.map(|(i, j)| {
        let mut sum = stiffness.centrifugal[0].map(|_| 0.0);
        for ((a, b), G) in PRODUCTS.into_iter().zip(&stiffness.centrifugal) {
            // ω_a ω_b in products of the new components; each mixed product is counted once.
            let once = R[(i, a)] * R[(j, b)];
            sum += G * if i == j { once } else { once + R[(j, a)] * R[(i, b)] };
        }
        sum
    });
    GeometricStiffness {
        acceleration: three(&stiffness.acceleration),
        angular: three(&stiffness.angular),
        centrifugal,
        interface: stiffness.interface.iter().map(six).collect(),
    }
}
