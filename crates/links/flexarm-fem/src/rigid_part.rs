//! Rigid part of a cut link: mass, centre of mass, inertia, and checks that they are possible.
//!
//! Link axes; the inertia is about the centre of mass, kg·m². Start at [`RigidPart`].
//!
//! Not here: the cut of a mesh ([`cut`](crate::cut())), spatial inertias of recursions
//! ([`flexarm_spatial::SpatialInertia`]).

use flexarm_spatial::{Pose, skew, symmetric_part};
use nalgebra::{Matrix3, Matrix6, SymmetricEigen, Vector3};

use crate::error::{FemError, positive};

/// Tolerance of the triangle inequality of principal moments, relative to the largest, for few
/// digits.
const INERTIA_SLACK: f64 = 1e-6;

/// Mass properties of one part of a link.
#[derive(Debug, Clone, PartialEq)]
pub struct RigidPart {
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass relative to the link origin, link axes, m.
    pub com: Vector3<f64>,
    /// Inertia about the centre of mass, link axes, kg·m².
    pub inertia: Matrix3<f64>,
}

impl RigidPart {
    /// Transforms the part from frame E to frame L.
    ///
    /// ```text
    /// p_LoPcm_L = X_LE p_EoPcm_E,   I_L = R_LE I_E R_LEᵀ
    /// ```
    /// * `X_LE`: pose of E in L, m; the part is given in E.
    ///
    /// Returns the part in L, its inertia exactly symmetric.
    pub fn transformed(&self, X_LE: &Pose) -> Self {
        let R_LE = X_LE.rotation.matrix();
        Self {
            mass: self.mass,
            com: X_LE.rotation * self.com + X_LE.translation.vector,
            inertia: R_LE * self.inertia * R_LE.transpose(),
        }
        .symmetrised()
    }

    /// Removes the rounding asymmetry of the inertia.
    pub(crate) fn symmetrised(&self) -> Self {
        Self { inertia: symmetric_part(&self.inertia), ..self.clone() }
    }

    /// Merges this part and another one into a single rigid body.
    ///
    /// ```text
    /// m = Σ m_i,   c = Σ m_i c_i / m,   I = Σ (I_i - m_i [c_i - c]x²)
    /// ```
    /// * `other`: in the same frame as this part.
    ///
    /// Returns the body in that frame; not finite if the total mass is zero.
    pub fn merged(&self, other: &Self) -> Self {
        let mass = self.mass + other.mass;
        let com = (self.com * self.mass + other.com * other.mass) / mass;
        let about_com = |part: &Self| {
            let c = skew(&(part.com - com));
            part.inertia - c * c * part.mass
        };
        Self { mass, com, inertia: about_com(self) + about_com(other) }
    }

    /// Removes another part that this one contains: the inverse of [`Self::merged`].
    ///
    /// * `other`: in the same frame as this part. The result is not checked; [`Self::check`]
    ///   rejects an impossible one.
    pub fn less(&self, other: &Self) -> Self {
        self.merged(&Self { mass: -other.mass, com: other.com, inertia: -other.inertia })
    }

    /// Scales the part to another mass; its centre of mass and its radii of gyration stay.
    ///
    /// * `mass`: new mass, kg.
    pub fn with_mass(&self, mass: f64) -> Self {
        let inertia = self.inertia * (mass / self.mass);
        Self { mass, com: self.com, inertia }
    }

    /// Spatial inertia about the link origin, linear part first.
    ///
    /// ```text
    /// M = [  m 1       -m [c]x    ]      c = p_LoPcm_L
    ///     [ m [c]x   I - m [c]x²  ]
    /// ```
    /// Returns M, 6×6 (kg, kg·m; kg·m, kg·m²), about Lo, link axes.
    pub fn spatial_inertia(&self) -> Matrix6<f64> {
        let mc = skew(&self.com) * self.mass;
        let mut M = Matrix6::zeros();
        M.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Matrix3::identity() * self.mass));
        M.fixed_view_mut::<3, 3>(0, 3).copy_from(&-mc);
        M.fixed_view_mut::<3, 3>(3, 0).copy_from(&mc);
        M.fixed_view_mut::<3, 3>(3, 3).copy_from(&(self.inertia - mc * skew(&self.com)));
        M
    }

    /// Checks that these values are possible for a body.
    ///
    /// * `part`: name of the part in messages.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] for mass and centre of mass; [`FemError::ImpossibleInertia`] for an
    /// inertia that is not positive definite or violates the triangle inequality
    /// `I_1 + I_2 >= I_3`.
    pub fn check(&self, part: &str) -> Result<(), FemError> {
        positive(format!("mass of {part} (kg)"), self.mass)?;
        if let Some(found) = self.com.iter().find(|x| !x.is_finite()) {
            return Err(FemError::OutOfRange {
                what: format!("centre of mass of {part} (m)"),
                found: *found,
                allowed: "finite numbers".into(),
            });
        }
        self.check_inertia(part)
    }

    /// Checks symmetry, sign and triangle inequality of the principal moments.
    fn check_inertia(&self, part: &str) -> Result<(), FemError> {
        let refuse = |principal: [f64; 3], rule| {
            let part = part.to_owned();
            Err(FemError::ImpossibleInertia { part, principal, rule })
        };
        let symmetric = symmetric_part(&self.inertia);
        let size = symmetric.amax();
        if !self.inertia.iter().all(|x| x.is_finite()) || !size.is_finite() {
            return refuse([f64::NAN; 3], "every moment must be finite");
        }
        if !((self.inertia - symmetric).amax() <= 1e-9 * size) {
            return refuse([f64::NAN; 3], "the tensor must be symmetric");
        }
        // Scaled first, so that the eigensolver works with numbers of order one in any unit.
        if size == 0.0 {
            return refuse([0.0; 3], "all must be positive");
        }
        let Some(eigen) = SymmetricEigen::try_new(symmetric / size, f64::EPSILON, 1000) else {
            return refuse([f64::NAN; 3], "its principal moments cannot be computed");
        };
        let mut principal = [eigen.eigenvalues[0], eigen.eigenvalues[1], eigen.eigenvalues[2]];
        principal.sort_by(f64::total_cmp);
        // Each principal moment is a sum of two second moments, none of which is negative.
        let [low, middle, high] = principal;
        let principal = principal.map(|x| x * size);
        if low <= 0.0 {
            return refuse(principal, "all must be positive (a sign of ixy, ixz, iyz, or an order?)");
        }
        if low + middle < high * (1.0 - INERTIA_SLACK) {
            return refuse(
                principal,
                "the two smaller must add up to at least the largest (is it about the centre of mass?)",
            );
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, Translation3};

    fn bar(length: f64) -> RigidPart {
        let I = 3.0 * length * length / 12.0;
        RigidPart {
            mass: 3.0,
            com: Vector3::new(0.5 * length, 0.0, 0.0),
            inertia: Matrix3::from_diagonal(&Vector3::new(1e-4, I, I)),
        }
    }

    /// Truth: parallel axis theorem; two half bars make one bar.
    #[test]
    fn two_half_bars_make_one_bar() {
        let half = bar(0.5).with_mass(1.5);
        let shift = Pose::translation(0.5, 0.0, 0.0);
        let whole = half.merged(&half.transformed(&shift));
        assert!((whole.mass - 3.0).abs() < 1e-15 && (whole.com - bar(1.0).com).norm() < 1e-15);
        assert!((whole.inertia - bar(1.0).inertia).amax() < 1e-15); // measured 0
    }

    /// Identity: kinetic energy does not depend on the frame, `Adᵀ M_L Ad = M_E`.
    #[test]
    fn spatial_inertia_follows_the_frame() {
        let X_LE = Pose::from_parts(Translation3::new(0.3, -0.1, 0.8), Rotation3::from_euler_angles(0.4, 0.7, -1.1));
        let Ad_LE = flexarm_spatial::adjoint(&X_LE);
        let M_L = bar(1.0).transformed(&X_LE).spatial_inertia();
        let back = Ad_LE.transpose() * M_L * Ad_LE;
        assert!((back - bar(1.0).spatial_inertia()).amax() < 1e-14); // measured 4e-16
    }

    #[test]
    fn impossible_bodies_are_named() {
        let no_mass = RigidPart { mass: 0.0, ..bar(1.0) };
        assert!(no_mass.check("proximal").unwrap_err().to_string().contains("mass of proximal"));

        let negative = RigidPart { inertia: -bar(1.0).inertia, ..bar(1.0) };
        assert!(negative.check("distal").unwrap_err().to_string().contains("positive"));

        let inertia = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 2.1));
        let triangle = RigidPart { inertia, ..bar(1.0) };
        assert!(triangle.check("distal").unwrap_err().to_string().contains("add up"));

        let nan = RigidPart { com: Vector3::new(f64::NAN, 0.0, 0.0), ..bar(1.0) };
        assert!(nan.check("distal").unwrap_err().to_string().contains("centre of mass"));
    }
}
