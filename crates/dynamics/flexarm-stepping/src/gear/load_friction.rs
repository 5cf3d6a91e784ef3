//! Friction that grows with the torque transmitted by a gear.

/// Friction that grows with the torque transmitted by a gear: `coefficient |τ| tanh(q̇ / v_0)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadFriction {
    /// Coordinate of the joint.
    pub coordinate: usize,
    /// Element index of the gearbox spring (single coordinate) whose torque is transmitted; without
    /// one, the torque that drives the joint counts.
    pub element: Option<usize>,
    /// Ratio of friction to transmitted torque.
    pub coefficient: f64,
    /// Speed `v_0` over which the sign changes (rad/s).
    pub regularisation: f64,
}

impl LoadFriction {
    pub(crate) fn torque(&self, transmitted: f64, rate: f64) -> f64 {
        self.coefficient * transmitted.abs() * (rate / self.regularisation).tanh()
    }

    pub(crate) fn slope(&self, transmitted: f64, rate: f64) -> f64 {
        let t = (rate / self.regularisation).tanh();
        self.coefficient * transmitted.abs() * (1.0 - t * t) / self.regularisation
    }
}
