//! Modal link: shapes and mass integrals of a link that deforms in a floating frame.
//!
//! The floating frame is the link frame L, tangent at interface A: A does not deform. A point at s
//! moves to
//!
//! ```text
//! s + u,   u(s) = Σ φ_k(s) η_k
//! ```
//! Coordinates of a reduced link: six per interface other than A (displacement and rotation of that
//! interface, link axes, with their static shapes), then the amplitudes of the fixed-interface
//! modes. The equations of motion only need integrals over the undeformed body, none of which
//! depends on η:
//!
//! ```text
//! C_t,k = ∫ φ_k dm        C_r,k = ∫ s × φ_k dm      P_k = ∫ s φ_kᵀ dm
//! N_kl = ∫ φ_k φ_lᵀ dm    M_kl = ∫ φ_k·φ_l dm
//!
//! C_r,k = axial(P_k),     M_kl = tr N_kl,           N_lk = N_klᵀ
//! axial(A)_x = A_yz - A_zy, ...
//! ```
//! These three identities hold for solids and for beams with plane sections: there `φ = u + θ × r`
//! at the position r in the section, so all of them include the rotary inertia.
//!
//! | from | with |
//! | --- | --- |
//! | a mesh | [`ModalSource`]; [`reduce_mesh`](crate::reduce_mesh) calls it |
//! | a uniform beam | [`BeamLink::modal`](crate::BeamLink::modal) |
//! | a condensed stiffness and mass | [`ModalLink::from_superelement`]: first order only |
//! | Standard Input Data | `flexarm_fe_io::exchange::modal_link_from_sid` |
//!
//! Source: Shabana (2013), chapter 5; Wallrapp (1994).
//!
//! Not here: equations of motion, joints, time.

mod beam;
mod geometric;
mod source;
mod superelement;
#[cfg(test)]
mod tests;
mod transform;

pub use flexarm_spatial::GeometricStiffness;
use flexarm_spatial::{Pose, symmetric_part};
use nalgebra::{DMatrix, Matrix3, Matrix3xX, Matrix6xX, Vector3};

use crate::error::FemError;
use crate::reduction::{generalised_frequencies, spd_inverse};
use crate::rigid_part::RigidPart;

pub(crate) use geometric::Field;
pub use source::ModalSource;

/// Interface of a modal link, with its shape matrix.
#[derive(Debug, Clone, PartialEq)]
pub struct ModalInterface {
    /// Name.
    pub name: String,
    /// Undeformed pose in the link frame.
    pub X_LI: Pose,
    /// Displacement of Io, then rotation of I, link axes, per coordinate; (m; rad).
    pub Phi: Matrix6xX<f64>,
}

/// Shapes and inertia invariants of a link in its floating frame: link axes, tangent at interface
/// A. SI units.
///
/// The builders check the data; afterwards it is plain data. All integrals are over the undeformed
/// link.
#[derive(Debug, Clone, PartialEq)]
pub struct ModalLink {
    /// Name of the link.
    pub name: String,
    /// Interfaces other than A; the distal one, B, first.
    pub interfaces: Vec<ModalInterface>,
    /// Mass, kg.
    pub mass: f64,
    /// `∫ s dm` from Lo, link axes, kg·m.
    pub first_moment: Vector3<f64>,
    /// Inertia about Lo (not about the centre of mass), link axes, kg·m².
    pub inertia: Matrix3<f64>,
    /// `∫ φ_k dm`, one column per coordinate.
    pub C_t: Matrix3xX<f64>,
    /// `∫ s × φ_k dm` about Lo, one column per coordinate.
    pub C_r: Matrix3xX<f64>,
    /// `P_k[a,b] = ∫ s_a φ_k,b dm`.
    pub P: Vec<Matrix3<f64>>,
    /// `N[k n + l][a,b] = ∫ φ_k,a φ_l,b dm`, so that `N_lk = N_klᵀ`.
    pub N: Vec<Matrix3<f64>>,
    /// Mass over the coordinates, exactly symmetric.
    pub M: DMatrix<f64>,
    /// Stiffness over the coordinates, exactly symmetric.
    pub K: DMatrix<f64>,
    /// Geometric stiffness, if requested.
    pub geometric: Option<GeometricStiffness>,
    /// Description of each coordinate.
    pub labels: Vec<String>,
    /// Pose of interface A, which does not deform.
    pub X_LA: Pose,
}

/// Options for the modal link of a uniform beam.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModalOptions {
    /// Number of fixed-interface modes.
    pub modes: usize,
    /// Number of beam elements.
    pub elements: usize,
    /// Whether to compute the geometric stiffness.
    pub geometric: bool,
}

impl Default for ModalOptions {
    fn default() -> Self {
        Self { modes: 6, elements: 24, geometric: false }
    }
}

impl ModalLink {
    /// Number of coordinates.
    pub fn coordinates(&self) -> usize {
        self.K.nrows()
    }

    /// Rigid body of the undeformed link: mass (kg), centre of mass from Lo (m) and inertia about
    /// the centre of mass (kg·m²), link axes.
    pub fn rigid(&self) -> RigidPart {
        let com = self.first_moment / self.mass;
        let c = com.cross_matrix();
        RigidPart { mass: self.mass, com, inertia: self.inertia + c * c * self.mass }
    }

    /// Whether the second-order integrals are known; they do not follow from a condensed mass.
    pub fn has_second_order(&self) -> bool {
        self.coordinates() == 0 || self.N.iter().any(|N| N.amax() > 0.0)
    }

    /// Mass matrix of the undeformed link over the acceleration of the link frame (linear, then
    /// angular, at Lo, link axes) and of the coordinates.
    ///
    /// ```text
    /// [ m 1     -[mc]x   C_t ]
    /// [ [mc]x    J       C_r ]
    /// [ C_tᵀ     C_rᵀ    M   ]
    /// ```
    /// Returns a symmetric matrix with 6 + n rows for n coordinates.
    ///
    /// # Source
    /// [Shabana 2013], chapter 5.
    pub fn mass_matrix(&self) -> DMatrix<f64> {
        let n = self.coordinates();
        let mut M = DMatrix::zeros(6 + n, 6 + n);
        let mc = self.first_moment.cross_matrix();
        M.view_mut((0, 0), (3, 3)).copy_from(&(Matrix3::identity() * self.mass));
        M.view_mut((0, 3), (3, 3)).copy_from(&-mc);
        M.view_mut((3, 0), (3, 3)).copy_from(&mc);
        M.view_mut((3, 3), (3, 3)).copy_from(&self.inertia);
        M.view_mut((0, 6), (3, n)).copy_from(&self.C_t);
        M.view_mut((3, 6), (3, n)).copy_from(&self.C_r);
        M.view_mut((6, 0), (n, 3)).copy_from(&self.C_t.transpose());
        M.view_mut((6, 3), (n, 3)).copy_from(&self.C_r.transpose());
        M.view_mut((6, 6), (n, n)).copy_from(&self.M);
        M
    }

    /// Natural frequencies with A clamped, Hz, ascending, one per coordinate.
    ///
    /// Empty if stiffness or mass is not positive definite.
    pub fn held_frequencies_hz(&self) -> Vec<f64> {
        transform::eigenpairs(&self.K, &self.M)
            .map_or_else(Vec::new, |pairs| pairs.omega.iter().map(|omega| omega / std::f64::consts::TAU).collect())
    }

    /// Natural frequencies of the free link: of `blkdiag(0, K)` and [`Self::mass_matrix`].
    ///
    /// Returns 6 + n frequencies, Hz, ascending; the first six belong to rigid motions and are near
    /// zero. Empty if the mass is not positive definite.
    pub fn free_frequencies_hz(&self) -> Vec<f64> {
        let n = self.coordinates();
        let mut K = DMatrix::zeros(6 + n, 6 + n);
        K.view_mut((6, 6), (n, n)).copy_from(&self.K);
        generalised_frequencies(&K, &self.mass_matrix())
    }

    /// Compliance of an interface with A clamped, `u_I = C_II F_I`.
    ///
    /// ```text
    /// C_II = Φ_I K⁻¹ Φ_Iᵀ
    /// ```
    /// * `interface`: index into [`Self::interfaces`], from 0.
    ///
    /// Returns `C_II`, 6×6 (m/N, m/(N·m); rad/N, rad/(N·m)), at Io, link axes, exactly symmetric.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] if the interface does not exist, [`FemError::Missing`] for a
    /// singular stiffness.
    pub fn compliance(&self, interface: usize) -> Result<nalgebra::Matrix6<f64>, FemError> {
        let Some(at) = self.interfaces.get(interface) else {
            return Err(FemError::OutOfRange {
                what: "number of the interface, from 0".into(),
                found: interface as f64,
                allowed: format!("below {}", self.interfaces.len()),
            });
        };
        let loose = FemError::Missing { what: "stiffness of a coordinate", help: "it holds nothing" };
        let C = spd_inverse(&self.K).ok_or(loose)?;
        let Phi = DMatrix::from_column_slice(6, self.coordinates(), at.Phi.as_slice());
        let C_II = &Phi * C * Phi.transpose();
        Ok(symmetric_part(&nalgebra::Matrix6::from_column_slice(C_II.as_slice())))
    }

    /// Whether mass and stiffness are positive definite, so that all frequencies with A clamped are
    /// real and positive.
    pub fn is_positive_definite(&self) -> bool {
        transform::eigenpairs(&self.K, &self.M).is_some()
    }

    /// Whether the coordinates are of Craig-Bampton type: six per interface, then modes that do not
    /// move any interface.
    pub fn is_craig_bampton(&self) -> bool {
        let unit = |(i, interface): (usize, &ModalInterface)| {
            let expected = |r: usize, c: usize| if c == 6 * i + r { 1.0 } else { 0.0 };
            interface.Phi == Matrix6xX::from_fn(self.coordinates(), expected)
        };
        self.interfaces.iter().enumerate().all(unit)
    }
}

/// Products of ω in the order of the second-order loads: xx yy zz xy xz yz.
pub const PRODUCTS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

/// Cross product of the two factors of an outer product: `axial(s φᵀ) = s × φ`, so that
/// `∫ s × φ dm = axial(∫ s φᵀ dm)`.
///
/// ```text
/// axial(A) = [A_yz - A_zy, A_zx - A_xz, A_xy - A_yx]
/// ```
/// Returns a vector in the axes and unit of A.
pub fn axial(A: &Matrix3<f64>) -> Vector3<f64> {
    Vector3::new(A[(1, 2)] - A[(2, 1)], A[(2, 0)] - A[(0, 2)], A[(0, 1)] - A[(1, 0)])
}

/// Inertia `tr(S) 1 - S` about the origin for second moments `S = ∫ s sᵀ dm`, kg·m², same axes.
pub(crate) fn inertia_of(S: &Matrix3<f64>) -> Matrix3<f64> {
    symmetric_part(&(Matrix3::identity() * S.trace() - S))
}
