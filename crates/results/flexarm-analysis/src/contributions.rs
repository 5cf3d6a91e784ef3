//! Contribution of a flexible element to the TCP error, and strain of a link.
//!
//! To first order the TCP error is the sum over the elastic elements of `J_e d_e`: the deflection
//! of the element, mapped to the TCP by its columns of the Jacobian. Not here: the Jacobian
//! (`flexarm-kinematics`).

use nalgebra::Vector6;

/// Peak TCP displacement due to one element.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ContributionPeak {
    /// Maximum TCP translation, m.
    pub peak_m: f64,
    /// Time of `peak_m`, s.
    pub t_peak_s: f64,
    /// Maximum TCP rotation, rad.
    pub peak_rad: f64,
}

impl ContributionPeak {
    /// Adds the TCP displacement that the element causes at time `t` (s).
    ///
    /// * `u_T_W`: translation (m), rotation (rad), world axes.
    pub fn update(&mut self, t: f64, u_T_W: &Vector6<f64>) {
        let distance = u_T_W.fixed_rows::<3>(0).norm();
        if distance > self.peak_m {
            (self.peak_m, self.t_peak_s) = (distance, t);
        }
        self.peak_rad = self.peak_rad.max(u_T_W.fixed_rows::<3>(3).norm());
    }
}

/// Returns the change of the distance between the two interfaces of a link over its undeformed
/// length.
///
/// It indicates how far a link is from the small deformations that the model assumes.
///
/// * `interface_distance_change`: m, positive when the link gets longer. `length`: m.
///
/// Returns a dimensionless number with the sign of the change; `None` when the interfaces coincide
/// (`length` is not positive).
pub fn engineering_strain(interface_distance_change: f64, length: f64) -> Option<f64> {
    (length > 0.0).then(|| interface_distance_change / length)
}
