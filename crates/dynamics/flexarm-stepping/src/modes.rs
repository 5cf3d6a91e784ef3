//! Natural frequencies and mode shapes of the arm about its static equilibrium, drives locked.
//!
//! `K_t φ = ω² M φ` over the elastic coordinates; K_t is the stiffness of the springs plus that of
//! weight and loads. Not here: damped modes and frequency response (`flexarm-analysis`).

use flexarm_kinematics::{Data, mass_matrix};
use nalgebra::{Cholesky, DMatrix, SymmetricEigen};

use crate::error::StepError;
use crate::plant::{Modes, Plant};
use crate::statics::{for_vibration, static_equilibrium, tangent_stiffness};

/// Computes the undamped modes at time `t` of the motion about static equilibrium, including the
/// geometric stiffness due to weight.
///
/// # Errors
/// [`StepError::NoEquilibrium`] or [`StepError::Singular`].
pub(crate) fn modes_at(plant: &Plant, t: f64) -> Result<Modes, StepError> {
    let n = plant.model.n_elastic();
    if n == 0 {
        return Ok(Modes::default());
    }
    let model = &plant.model;
    let equilibrium = static_equilibrium(plant, t)?;
    let mut data = Data::new(&plant.model);
    // K_t = K + ∂g/∂e and M at the equilibrium.
    let q = plant.coordinates_at(t, &equilibrium);
    let K = for_vibration(plant, &plant.stiffness(), q.as_slice(), &equilibrium);
    let Kt = tangent_stiffness(plant, &mut data, t, &equilibrium, &K);
    let na = model.n_actuated();
    let M = mass_matrix(model, &mut data, &q).view((na, na), (n, n)).clone_owned();
    modes_of(&Kt, &M, t).map(|modes| Modes { equilibrium, ..modes })
}

/// Computes the undamped modes of a stiffness `Kt` and a mass matrix `M`, n×n, symmetric, without
/// equilibrium: ω (rad/s) ascending, shapes with `Φᵀ M Φ = 1`, and the residual of the eigensolver.
///
/// * `t`: time (s) for messages.
///
/// # Errors
/// [`StepError::Singular`] if a matrix is not positive definite.
pub fn modes_of(Kt: &DMatrix<f64>, M: &DMatrix<f64>, t: f64) -> Result<Modes, StepError> {
    let n = Kt.nrows();
    // K φ = ω² M φ with K = L Lᵀ: the eigenvalues of L^-1 M L^-T are 1/ω², so the low modes are the
    // largest and most accurate.
    let factor = Cholesky::new(Kt.clone())
        .ok_or(StepError::Singular { matrix: "static stiffness (with the effect of weight)", t })?;
    let L = factor.l();
    let singular = StepError::Singular { matrix: "stiffness factor", t };
    let half = L.solve_lower_triangular(M).ok_or(singular.clone())?;
    let A = L.solve_lower_triangular(&half.transpose()).ok_or(singular.clone())?;
    let eigen = SymmetricEigen::new((&A + A.transpose()) * 0.5);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));

    let mut modes = Modes { omega: Vec::with_capacity(n), shapes: DMatrix::zeros(n, n), ..Modes::default() };
    // φ = L^-T y, scaled to φᵀ M φ = 1; the residual checks the eigensolver.
    for (column, &k) in order.iter().enumerate() {
        let value = eigen.eigenvalues[k];
        if value.is_nan() || value <= 0.0 {
            return Err(StepError::Singular { matrix: "mass matrix of the elastic coordinates", t });
        }
        let y = eigen.eigenvectors.column(k).clone_owned();
        let mut phi = L.tr_solve_lower_triangular(&y).ok_or(singular.clone())?;
        let mut Mphi = M * &phi;
        let norm = phi.dot(&Mphi).sqrt();
        phi /= norm;
        Mphi /= norm;
        let Kphi = Kt * &phi;
        modes.residual = modes.residual.max((&Kphi - Mphi / value).norm() / Kphi.norm());
        modes.omega.push(1.0 / value.sqrt());
        modes.shapes.set_column(column, &phi);
    }
    Ok(modes)
}
