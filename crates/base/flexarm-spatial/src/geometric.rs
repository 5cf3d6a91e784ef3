//! Geometric stiffness of a flexible body.

use nalgebra::DMatrix;

/// Geometric stiffness of a flexible body with n deformation coordinates: n×n per unit of the load
/// that causes the stress.
///
/// ```text
/// K_eff = K + Σ load_i G_i
/// ```
/// The stress is the static stress of the body with A clamped under that load only. Loads are dead
/// loads: forces keep their direction in the axes of the body.
#[derive(Debug, Clone, PartialEq)]
pub struct GeometricStiffness {
    /// Per m/s² of the acceleration of the origin Lo minus gravity, along x, y, z of the body: load
    /// `-a dm`.
    pub acceleration: [DMatrix<f64>; 3],
    /// Per rad/s² of angular acceleration about x, y, z: load `-α × s dm`.
    pub angular: [DMatrix<f64>; 3],
    /// Per rad²/s² of `ω_i ω_j` in the order xx yy zz xy xz yz: load `-ω × (ω × s) dm`. `ω_x ω_y`
    /// is counted once.
    pub centrifugal: [DMatrix<f64>; 6],
    /// Per unit wrench on each interface, forces (1/N) before torques (1/(N·m)), at Io, axes of the
    /// body.
    pub interface: Vec<[DMatrix<f64>; 6]>,
}

impl GeometricStiffness {
    /// Returns all matrices, in the order of the fields.
    pub fn matrices(&self) -> impl Iterator<Item = &DMatrix<f64>> {
        self.acceleration.iter().chain(&self.angular).chain(&self.centrifugal).chain(self.interface.iter().flatten())
    }

    /// Applies `f` to each n×n matrix: a change of coordinates `Vᵀ G V` gives m×m matrices per the
    /// same unit loads.
    #[must_use]
    pub fn mapped(&self, f: &dyn Fn(&DMatrix<f64>) -> DMatrix<f64>) -> Self {
        Self {
            acceleration: self.acceleration.each_ref().map(f),
            angular: self.angular.each_ref().map(f),
            centrifugal: self.centrifugal.each_ref().map(f),
            interface: self.interface.iter().map(|six| six.each_ref().map(f)).collect(),
        }
    }
}
