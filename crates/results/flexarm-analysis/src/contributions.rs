//! Contribution of each flexible element to the TCP error, and strain of a link.
//!
//! To first order the TCP error is the sum over the elastic elements of `J_e d_e`: the deflection
//! of the element, mapped to the TCP by its columns of the Jacobian.

use nalgebra::{Matrix6, Vector6};

/// Computes the TCP displacement caused by the deflection of one element, with the rest of the arm
/// rigid.
///
/// ```text
/// u_T_W = J_WT_e d_e
/// ```
/// Exact to first order in `d_e`; the contributions of all elements add up to the TCP error to
/// first order.
///
/// * `map`: 6×6, from rates of the element's deflection to the TCP twist, in world axes at the TCP.
/// * `deflection`: elastic coordinates of the element, three translations in m and three rotations
///   in rad.
///
/// Returns the TCP displacement in world axes, m and rad, linear first.
pub fn tcp_displacement(map: &Matrix6<f64>, deflection: &Vector6<f64>) -> Vector6<f64> {
    map * deflection
}

/// Peak TCP displacement due to one element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContributionPeak {
    /// Maximum TCP translation, m.
    pub peak_m: f64,
    /// Time of `peak_m`, s.
    pub t_peak_s: f64,
    /// Maximum TCP rotation, rad.
    pub peak_rad: f64,
}

/// Collects the peak contribution of each element, sample by sample, so that no 6×6 maps need to be
/// stored.
#[derive(Debug, Clone, PartialEq)]
pub struct ContributionPeaks {
    peaks: Vec<ContributionPeak>,
}

impl ContributionPeaks {
    /// Creates peaks for this many elements, all zero.
    pub fn new(elements: usize) -> Self {
        Self { peaks: vec![ContributionPeak { peak_m: 0.0, t_peak_s: 0.0, peak_rad: 0.0 }; elements] }
    }

    /// Adds a sample of one element at time `t` (s); returns the TCP displacement that it causes, in
    /// world axes. `map` and `deflection` as in [`tcp_displacement`].
    ///
    /// # Panics
    /// If there is no such element.
    pub fn update(&mut self, element: usize, t: f64, map: &Matrix6<f64>, deflection: &Vector6<f64>) -> Vector6<f64> {
        let displacement = tcp_displacement(map, deflection);
        self.add(element, t, &displacement);
        displacement
    }

    /// Adds the TCP displacement (m, rad, world axes) that one element causes at time `t` (s).
    ///
    /// # Panics
    /// If there is no such element.
    pub fn add(&mut self, element: usize, t: f64, displacement: &Vector6<f64>) {
        assert!(element < self.peaks.len(), "element {element} of {}", self.peaks.len());
        let peak = &mut self.peaks[element];
        let distance = displacement.fixed_rows::<3>(0).norm();
        if distance > peak.peak_m {
            (peak.peak_m, peak.t_peak_s) = (distance, t);
        }
        peak.peak_rad = peak.peak_rad.max(displacement.fixed_rows::<3>(3).norm());
    }

    /// One entry per element.
    pub fn peaks(&self) -> &[ContributionPeak] {
        &self.peaks
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
