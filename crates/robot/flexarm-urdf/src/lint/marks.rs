//! Text for `urdf_rs` with the places of its elements in the file.

use nalgebra::UnitQuaternion;

use crate::transmission::Transmission;
use flexarm_settings::Place;

/// Text for `urdf_rs`, and a mark for each of its links and joints, in the same order.
pub struct PlainUrdf {
    pub text: String,
    pub(crate) place: Place,
    pub(crate) links: Vec<LinkMarks>,
    pub(crate) joints: Vec<JointMarks>,
    pub(crate) transmissions: Vec<Transmission>,
}

/// Marks of an element that may have an `<origin>`.
pub(crate) struct OriginMark {
    pub(crate) place: Place,
    /// Rotation of `<origin>` if it is not given by `rpy`: from a quaternion, or the identity if
    /// there is no origin.
    pub(crate) quaternion: Option<UnitQuaternion<f64>>,
    /// Whether some part could not be read; disables further checks.
    pub(crate) faulty: bool,
}

/// Elements of a link in the tree; `None` if an element does not exist.
pub(crate) struct LinkMarks {
    pub(crate) place: Place,
    pub(crate) inertial: Option<OriginMark>,
    pub(crate) visuals: Vec<OriginMark>,
    pub(crate) collisions: Vec<OriginMark>,
}

/// Elements of a joint in the tree; `None` if an element does not exist.
pub(crate) struct JointMarks {
    pub(crate) joint: OriginMark,
    pub(crate) axis: Option<Place>,
    pub(crate) limit: Option<Place>,
    /// Acceleration, deceleration and jerk of `<limit>`; infinite if not given.
    pub(crate) rates: [f64; 3],
    pub(crate) mimic: Option<Place>,
}
