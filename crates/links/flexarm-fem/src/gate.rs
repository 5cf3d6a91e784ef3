//! Checks that every stiffness matrix passes before it becomes a link (the gate).
//!
//! All measures are dimensionless: entries are compared with `s_i s_j`, `s_i = sqrt(k_ii)`, which
//! scale with the units in the same way. A matrix in millimetres passes or fails like one in
//! metres.
//!
//! ```text
//! asymmetry            max |k_ij - k_ji| / (s_i s_j)
//! rigid_body_residual  max |(K R)_im| / (s_i Σ_k s_k |R_km|)
//! block_identity       K_AA - Adᵀ K_BB Ad and K_AB + Adᵀ K_BB, over the size of their terms
//! min_eigenvalue       smallest eigenvalue of k_ij/(s_i s_j) of K_BB
//! condition            largest over smallest eigenvalue of the same matrix
//! ```
//! R: the six rigid motions about the middle of AB.
//!
//! A positive definite `K_BB` together with the block identity implies that the 12×12 has exactly
//! six zero and six positive eigenvalues, so these are not counted separately.
//!
//! Start at [`check_matrix12`] or [`check_matrix6`]. Matrices in link axes, SI; A before B, linear
//! first.
//!
//! Not here: checks against a mesh ([`crate::mesh_gate`]).

use flexarm_spatial::{Matrix12, Pose, adjoint, symmetric_part};
use nalgebra::{Matrix6, SMatrix, SVector, SymmetricEigen, Vector3};
use serde::{Deserialize, Serialize};

use crate::error::{COMPONENTS, Direction, FemError};

/// Limits of the measures of the gate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GateLimits {
    /// Maximum relative asymmetry.
    pub asymmetry: f64,
    /// Maximum rigid-body residual, also the bound on the block identity.
    pub rigid_body_residual: f64,
    /// Rigid-body residual or block identity above which [`GateReport::warnings`] warns.
    pub rigid_body_warning: f64,
    /// Minimum eigenvalue of `K_BB` scaled to a unit diagonal.
    pub min_eigenvalue: f64,
}

impl Default for GateLimits {
    /// Limits that accept text with ten or more digits and reject a matrix with a spring to the
    /// ground.
    ///
    /// flexarm's own assembly reaches a residual of 1e-11, printed matrices 3e-10 to 7e-8.
    fn default() -> Self {
        Self { asymmetry: 1e-9, rigid_body_residual: 1e-3, rigid_body_warning: 1e-6, min_eigenvalue: 1e-10 }
    }
}

/// Measures of the gate; the module defines them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GateReport {
    /// Maximum relative asymmetry of the source matrix.
    pub asymmetry: f64,
    /// Relative force under rigid motions of both interfaces; `None` for a 6×6 source.
    pub rigid_body_residual: Option<f64>,
    /// Difference of `K_AA`, `K_AB` from the values implied by `K_BB`; `None` for a 6×6 source.
    pub block_identity: Option<f64>,
    /// Minimum eigenvalue of `K_BB` scaled to a unit diagonal.
    pub min_eigenvalue: f64,
    /// Condition number of the same scaled matrix.
    pub condition: f64,
}

impl GateReport {
    /// Returns warnings about measures that pass but are unusually large: one sentence per measure
    /// above [`GateLimits::rigid_body_warning`].
    pub fn warnings(&self, limits: &GateLimits) -> Vec<String> {
        [("rigid-body residual", self.rigid_body_residual), ("disagreement of the blocks", self.block_identity)]
            .into_iter()
            .filter_map(|(what, value)| Some((what, value?)))
            .filter(|(_, value)| *value > limits.rigid_body_warning)
            .map(|(what, value)| {
                let warn = limits.rigid_body_warning;
                format!("{what} of the stiffness is {value:.1e}, usual is below {warn:.0e}: few digits?")
            })
            .collect()
    }
}

/// Checks the stiffness of both interfaces.
///
/// * `K`: `F = K [u_A; u_B]`, 12×12 (N/m, N/rad; N·m/m, N·m/rad), at Ao and Bo, link axes.
/// * `p_AB`: vector from A to B, link axes, m.
///
/// Returns the block `K_BB`, made exactly symmetric, and the measures of the module.
///
/// # Errors
/// In this order: [`FemError::NotFinite`], [`FemError::NotPositiveDefinite`] (a diagonal entry that
/// is not positive), [`FemError::NotSymmetric`], [`FemError::MovesUnderRigidMotion`],
/// [`FemError::NotPositiveDefinite`] (of `K_BB`), [`FemError::BlocksDisagree`].
pub fn check_matrix12(
    K: &Matrix12,
    p_AB: &Vector3<f64>,
    limits: &GateLimits,
) -> Result<(Matrix6<f64>, GateReport), FemError> {
    const WHAT: &str = "the 12x12 stiffness";
    check_finite(WHAT, K)?;
    let s = diagonal_scale(WHAT, K, limits)?;
    let asymmetry = check_symmetry(WHAT, K, &s, limits)?;

    // A rigid motion of both ends must cost no force.
    let residual = rigid_body_residual(K, &s, p_AB);
    if !(residual.value <= limits.rigid_body_residual) {
        return Err(FemError::MovesUnderRigidMotion {
            residual: residual.value,
            allowed: limits.rigid_body_residual,
            motion: residual.motion,
            row: residual.row,
            p_AB: *p_AB,
            implied_p_AB: implied_lever(K),
        });
    }

    // K_BB is definite, and the other blocks follow from it by that motion.
    let K_BB = symmetric_part(&K.fixed_view::<6, 6>(6, 6).into_owned());
    let (min_eigenvalue, condition) = check_definite("K_BB", &K_BB, limits)?;
    let block_identity = block_identity(K, &K_BB, &s, p_AB);
    if !(block_identity <= limits.rigid_body_residual) {
        let (residual, allowed) = (block_identity, limits.rigid_body_residual);
        return Err(FemError::BlocksDisagree { residual, allowed });
    }
    let report = GateReport {
        asymmetry,
        rigid_body_residual: Some(residual.value),
        block_identity: Some(block_identity),
        min_eigenvalue,
        condition,
    };
    Ok((K_BB, report))
}

/// Checks the stiffness of one interface with the other clamped, or of an elastic joint.
///
/// * `what`: name of the matrix in messages.
/// * `K`: 6×6 (N/m, N/rad; N·m/m, N·m/rad), at any point, in any axes.
///
/// Returns K, made exactly symmetric, and the measures that do not need a second interface.
///
/// # Errors
/// [`FemError::NotFinite`], [`FemError::NotSymmetric`], [`FemError::NotPositiveDefinite`].
pub fn check_matrix6(
    what: &'static str,
    K: &Matrix6<f64>,
    limits: &GateLimits,
) -> Result<(Matrix6<f64>, GateReport), FemError> {
    check_finite(what, K)?;
    let s = diagonal_scale(what, K, limits)?;
    let asymmetry = check_symmetry(what, K, &s, limits)?;
    let K = symmetric_part(K);
    let (min_eigenvalue, condition) = check_definite(what, &K, limits)?;
    let report = GateReport { asymmetry, rigid_body_residual: None, block_identity: None, min_eigenvalue, condition };
    Ok((K, report))
}

/// Rejects the first entry that is not finite.
fn check_finite<const N: usize>(what: &'static str, K: &SMatrix<f64, N, N>) -> Result<(), FemError> {
    for row in 0..N {
        for column in 0..N {
            if !K[(row, column)].is_finite() {
                return Err(FemError::NotFinite { what, row, column });
            }
        }
    }
    Ok(())
}

/// `s_i = sqrt(k_ii)`; an error if a diagonal entry is not positive.
fn diagonal_scale<const N: usize>(
    what: &'static str,
    K: &SMatrix<f64, N, N>,
    limits: &GateLimits,
) -> Result<SVector<f64, N>, FemError> {
    let diagonal = K.diagonal();
    if let Some(i) = (0..N).find(|&i| diagonal[i] <= 0.0) {
        return Err(FemError::NotPositiveDefinite {
            what,
            min_eigenvalue: diagonal[i],
            allowed: limits.min_eigenvalue,
            direction: Direction::new((0..N).map(|j| f64::from(j == i))),
        });
    }
    Ok(diagonal.map(f64::sqrt))
}

/// Maximum of `|k_ij - k_ji|/(s_i s_j)`; an error if it is above the limit or NaN.
fn check_symmetry<const N: usize>(
    what: &'static str,
    K: &SMatrix<f64, N, N>,
    s: &SVector<f64, N>,
    limits: &GateLimits,
) -> Result<f64, FemError> {
    let mut worst = (0.0, 0, 0);
    for row in 0..N {
        for column in row + 1..N {
            let difference = (K[(row, column)] - K[(column, row)]).abs();
            let relative = difference / (s[row] * s[column]);
            if !(relative <= worst.0) {
                worst = (relative, row, column);
            }
        }
    }
    let (asymmetry, row, column) = worst;
    if asymmetry <= limits.asymmetry {
        return Ok(asymmetry);
    }
    let allowed = limits.asymmetry;
    Err(FemError::NotSymmetric { what, asymmetry, allowed, row, column })
}

/// Minimum eigenvalue and condition number of the matrix scaled to a unit diagonal.
fn check_definite(what: &'static str, K: &Matrix6<f64>, limits: &GateLimits) -> Result<(f64, f64), FemError> {
    let s = diagonal_scale(what, K, limits)?;
    let refuse = |min_eigenvalue, direction| {
        let allowed = limits.min_eigenvalue;
        Err(FemError::NotPositiveDefinite { what, min_eigenvalue, allowed, direction })
    };
    let scaled = Matrix6::from_fn(|i, j| K[(i, j)] / s[i] / s[j]);

    // A pair with |k_ij| >= s_i s_j is indefinite by itself, and may be too large to decompose.
    for i in 0..6 {
        for j in i + 1..6 {
            if !(scaled[(i, j)].abs() < 1.0) {
                let mut x = [0.0; 6];
                (x[i], x[j]) = (1.0 / s[i], -scaled[(i, j)].signum() / s[j]);
                return refuse(1.0 - scaled[(i, j)].abs(), Direction::new(x));
            }
        }
    }
    let Some(eigen) = SymmetricEigen::try_new(scaled, f64::EPSILON, 1000) else {
        return refuse(f64::NAN, Direction::new([0.0; 6]));
    };
    let (lowest, min) = eigen.eigenvalues.argmin();
    if !(min >= limits.min_eigenvalue) {
        let v = eigen.eigenvectors.column(lowest);
        return refuse(min, Direction::new((0..6).map(|i| v[i] / s[i])));
    }
    Ok((min, eigen.eigenvalues.max() / min))
}

/// Maximum relative force under rigid motions, with its motion and row.
struct RigidResidual {
    value: f64,
    motion: &'static str,
    row: String,
}

/// Maximum force `|(K R)_im|/(s_i Σ_k s_k |R_km|)` over rows i and rigid motions m, as in the
/// module.
fn rigid_body_residual(K: &Matrix12, s: &SVector<f64, 12>, p_AB: &Vector3<f64>) -> RigidResidual {
    const MOTIONS: [&str; 6] = [
        "translation along x",
        "translation along y",
        "translation along z",
        "rotation about x",
        "rotation about y",
        "rotation about z",
    ];
    // Rigid motions about the midpoint C of AB, so that neither interface is preferred:
    // R = [Ad_AC; Ad_BC] with p_AC = p_AB/2 = -p_BC.
    let X_AC = Pose::translation(0.5 * p_AB.x, 0.5 * p_AB.y, 0.5 * p_AB.z);
    let mut R = SMatrix::<f64, 12, 6>::zeros();
    R.fixed_view_mut::<6, 6>(0, 0).copy_from(&adjoint(&X_AC));
    R.fixed_view_mut::<6, 6>(6, 0).copy_from(&adjoint(&X_AC.inverse()));

    let force = K * R;
    let size = R.abs().transpose() * s;
    let mut worst = RigidResidual { value: 0.0, motion: MOTIONS[0], row: String::new() };
    for (m, motion) in MOTIONS.into_iter().enumerate() {
        for i in 0..12 {
            let value = force[(i, m)].abs() / (s[i] * size[m]);
            if !(value <= worst.value) {
                let side = if i < 6 { "A" } else { "B" };
                worst = RigidResidual { value, motion, row: format!("{side} {}", COMPONENTS[i % 6]) };
            }
        }
    }
    worst
}

/// Maximum deviation from `K_AA = Adᵀ K_BB Ad` and `K_AB = -Adᵀ K_BB`, `Ad = Ad_BA`.
fn block_identity(K: &Matrix12, K_BB: &Matrix6<f64>, s: &SVector<f64, 12>, p_AB: &Vector3<f64>) -> f64 {
    let Ad_BA = lever(p_AB);
    let K_AB = -Ad_BA.transpose() * K_BB;
    let K_AA = -K_AB * Ad_BA;
    let s_B = s.fixed_rows::<6>(6).into_owned();
    let s_A = Ad_BA.abs().transpose() * s_B;
    let mut worst: f64 = 0.0;
    for i in 0..6 {
        for j in 0..6 {
            let in_AA = (K[(i, j)] - K_AA[(i, j)]).abs() / (s_A[i] * s_A[j]);
            let in_AB = (K[(i, j + 6)] - K_AB[(i, j)]).abs() / (s_A[i] * s_B[j]);
            worst = worst.max(in_AA).max(in_AB);
        }
    }
    worst
}

/// `Ad_BA` of two frames with parallel axes at the distance `p_AB`.
pub(crate) fn lever(p_AB: &Vector3<f64>) -> Matrix6<f64> {
    adjoint(&Pose::translation(-p_AB.x, -p_AB.y, -p_AB.z))
}

/// Vector from A to B that the matrix itself implies through `Ad_BA = -K_BB⁻¹ K_BA`.
///
/// `None` if the matrix implies none (its blocks are not related by a lever arm).
fn implied_lever(K: &Matrix12) -> Option<Vector3<f64>> {
    let K_BB = K.fixed_view::<6, 6>(6, 6).into_owned();
    let Ad_BA = -K_BB.try_inverse()? * K.fixed_view::<6, 6>(6, 0);
    // The coupling block of Ad_BA is [p_BA]x; p_BA is the axial vector of its skew part.
    let p_BA =
        Vector3::new(Ad_BA[(1, 5)] - Ad_BA[(2, 4)], Ad_BA[(2, 3)] - Ad_BA[(0, 5)], Ad_BA[(0, 4)] - Ad_BA[(1, 3)])
            * -0.5;
    let p_AB = -p_BA;
    let difference = Ad_BA - lever(&p_AB);
    let size = 1.0 + p_AB.norm();
    (difference.amax() <= 1e-3 * size).then_some(p_AB)
}
