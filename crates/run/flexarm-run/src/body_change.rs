//! Difference between the body that a link has in its URDF and that of its flexible model.

use flexarm_fem::RigidPart;
use flexarm_kinematics::LinkInertia;

/// Maximum relative difference of numbers that are equal up to rounding.
const ROUNDING: f64 = 1e-9;

/// Change from the URDF's body of a link to that of its flexible model.
pub(crate) struct BodyChange {
    /// Change of the mass, relative to the URDF's.
    pub(crate) mass: f64,
    /// Distance between the centres of mass (m).
    pub(crate) shift: f64,
    /// Maximum change of an entry of the inertia about the centre of mass, relative to the largest
    /// of both.
    pub(crate) inertia: f64,
}

impl BodyChange {
    pub(crate) fn of(own: &LinkInertia, body: &RigidPart) -> Self {
        let largest = own.inertia_com.amax().max(body.inertia.amax());
        Self {
            mass: (body.mass / own.mass - 1.0).abs(),
            shift: (body.com - own.com).norm(),
            inertia: (body.inertia - own.inertia_com).amax() / largest,
        }
    }

    /// Whether both bodies are equal up to rounding.
    pub(crate) fn is_rounding(&self) -> bool {
        self.mass < ROUNDING && self.shift < ROUNDING && self.inertia < ROUNDING
    }
}
