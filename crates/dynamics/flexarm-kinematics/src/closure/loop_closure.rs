//! Loop closure of a mechanism, with links and joints by name.

use nalgebra::{Unit, Vector3};

/// Pin joint that closes a chain of links in a plane: the eye on one link stays on the axis of the
/// pin on another.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopClosure {
    /// Unique name.
    pub name: String,
    /// Name of the link whose origin is on the pin axis.
    pub pin: String,
    /// Axis of the pin, in the frame of the `pin` link.
    pub axis: Unit<Vector3<f64>>,
    /// Name of the link whose origin is the eye.
    pub eye: String,
    /// The two joints of the loop that are determined by the others.
    pub dependent: [String; 2],
    /// Joint values near which the loop is assembled (rad or m); joints not listed are at zero.
    pub at: Vec<(String, f64)>,
}
