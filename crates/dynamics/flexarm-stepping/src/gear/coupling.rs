//! Gears through which motors move several joints.

use nalgebra::{DMatrix, DVector};

/// Gears through which motors move several joints, equation (5) of the module.
#[derive(Clone, Debug, PartialEq)]
pub struct GearCoupling {
    /// Element indices of the gearbox springs in the order of the motors; empty if the gears are
    /// rigid.
    pub elements: Vec<usize>,
    /// Coordinates of the joints, in the same order.
    pub coordinates: Vec<usize>,
    /// C: joint coordinates from motor coordinates (after the gears).
    pub C: DMatrix<f64>,
    /// Its inverse.
    pub C_inverse: DMatrix<f64>,
}

impl GearCoupling {
    /// Returns `C^-T diag(values) C^-1`: stiffness, damping or inertia of the motors on the joints.
    pub fn on_joints(C_inverse: &DMatrix<f64>, values: &[f64]) -> DMatrix<f64> {
        C_inverse.transpose() * DMatrix::from_diagonal(&DVector::from_column_slice(values)) * C_inverse
    }

    /// Returns the motor torques after the gears, `Cᵀ τ` (N m), from joint torques `tau` over all
    /// coordinates.
    pub fn motor_torques(&self, tau: &[f64]) -> Vec<f64> {
        let joints = DVector::from_iterator(self.coordinates.len(), self.coordinates.iter().map(|k| tau[*k]));
        self.C.tr_mul(&joints).as_slice().to_vec()
    }

    /// Returns whether C is the identity, so that each motor moves only its own joint.
    pub(crate) fn is_none(&self) -> bool {
        self.C.is_identity(0.0)
    }

    /// Returns the index of a coordinate among the coupled ones.
    pub(crate) fn place(&self, coordinate: usize) -> Option<usize> {
        self.coordinates.iter().position(|k| *k == coordinate)
    }

    /// Returns the rate of motor `number` after its gear.
    pub(crate) fn motor_rate(&self, number: usize, rates: &[f64]) -> f64 {
        self.coordinates.iter().enumerate().map(|(j, k)| self.C_inverse[(number, j)] * rates[*k]).sum()
    }
}
