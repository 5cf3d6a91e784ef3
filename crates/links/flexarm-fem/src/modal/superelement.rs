//! First-order terms of a modal link from a condensed stiffness and mass.
//!
//! A rigid motion moves every interface and has no modal part, so with `R` its columns over the
//! superelement
//!
//! ```text
//! [C_t; C_r] = Rᵀ M      mass, first moment, inertia = Rᵀ M R
//! ```
//! are exact. The distribution of mass inside is lost: only the skew part of `P_k` follows, from
//! `C_r`; its symmetric part and all `N_kl`, the second-order terms, are unknown and set to zero.

use flexarm_spatial::symmetric_part;
use nalgebra::{DMatrix, Matrix3, Matrix3xX, Vector3};

use super::source::{labels, unit_shapes};
use super::{ModalInterface, ModalLink};
use crate::error::FemError;
use crate::mesh_link::{condensed_body, rigid_motions_about};
use crate::reduction::Superelement;

impl ModalLink {
    /// Modal link of a superelement without a mesh; second-order terms are unknown and zero.
    ///
    /// * `name`: of the link.
    /// * `element`: stiffness and mass, link axes, SI, proximal interface first.
    ///
    /// Returns the link with A clamped: the rows of `element` after the first six are its
    /// coordinates.
    ///
    /// # Errors
    /// [`FemError::Missing`] for a single interface or an unusable stiffness or mass; errors of
    /// [`RigidPart::check`](crate::RigidPart::check) for a mass that is impossible for a body.
    pub fn from_superelement(name: impl Into<String>, element: &Superelement) -> Result<Self, FemError> {
        if element.interfaces.len() < 2 {
            return Err(FemError::Missing { what: "a second interface", help: "A is held, something must move" });
        }
        condensed_body(element).check("the link")?;
        let (all, n) = (element.K.nrows(), element.K.nrows() - 6);
        let block = |A: &DMatrix<f64>| symmetric_part(&A.view((6, 6), (n, n)).into_owned());
        let (K, M) = (block(&element.K), block(&element.M));
        if super::transform::eigenpairs(&K, &M).is_none() {
            let help = "they must be positive definite with the proximal interface held";
            return Err(FemError::Missing { what: "a usable stiffness and mass", help });
        }

        // Momentum of the coordinates and of the whole body under rigid motions about Lo.
        let mut R = DMatrix::zeros(all, 6);
        R.rows_mut(0, element.boundary()).copy_from(&rigid_motions_about(element, &Vector3::zeros()));
        let momentum = R.transpose() * &element.M;
        let body = &momentum * &R;
        let C_t = Matrix3xX::from_fn(n, |a, k| momentum[(a, 6 + k)]);
        let C_r = Matrix3xX::from_fn(n, |a, k| momentum[(3 + a, 6 + k)]);
        let J = body.fixed_view::<3, 3>(3, 3).into_owned();
        let interface = |(i, frame): (usize, &crate::reduction::InterfaceFrame)| ModalInterface {
            name: frame.name.clone(),
            X_LI: frame.X_LI,
            Phi: unit_shapes(i, n),
        };
        // The coupling block is -[mc]x.
        let mc = |i: usize, j: usize| (body[(j, 3 + i)] - body[(i, 3 + j)]) * 0.5;
        Ok(Self {
            name: name.into(),
            interfaces: element.interfaces[1..].iter().enumerate().map(interface).collect(),
            mass: (body[(0, 0)] + body[(1, 1)] + body[(2, 2)]) / 3.0,
            first_moment: Vector3::new(mc(2, 1), mc(0, 2), mc(1, 0)),
            inertia: (J + J.transpose()) * 0.5,
            P: C_r.column_iter().map(|c| c.into_owned().cross_matrix() * -0.5).collect(),
            N: vec![Matrix3::zeros(); n * n],
            C_t,
            C_r,
            M,
            K,
            geometric: None,
            labels: labels(&element.interfaces[1..].iter().map(|i| &*i.name).collect::<Vec<_>>(), element),
            X_LA: element.interfaces[0].X_LI,
        })
    }
}
