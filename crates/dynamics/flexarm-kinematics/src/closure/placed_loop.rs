//! Loop on the bodies of the tree: indices of bodies and coordinates, and the frames of pin and eye.

use flexarm_spatial::Pose;
use nalgebra::Vector3;

use crate::closure::triangle::Shape;

/// Loop closure placed on the tree.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedLoop {
    /// Name of the loop.
    pub name: String,
    /// Bodies moved by its dependent joints.
    pub dependent: [usize; 2],
    /// Bodies that carry the pin and the eye.
    pub ends: [usize; 2],
    /// Values of the dependent joints in the assembly configuration (rad or m).
    pub start: [f64; 2],
    /// Difference between `start` and the requested values (rad or m).
    pub start_miss: [f64; 2],
    /// First dependent coordinate in the tree; the second one follows it.
    pub(super) first: usize,
    pub(super) common: usize,
    /// Bodies outward of the common body, to the pin and to the eye.
    pub(super) chains: [Vec<usize>; 2],
    pub(super) X_pin: Pose,
    pub(super) p_eye: Vector3<f64>,
    /// Tree coordinates that move the loop, without its own dependent ones.
    pub(super) moved_by: Vec<usize>,
    /// Selected solution of (1), 1 or -1.
    pub(super) root: f64,
    pub(super) shape: Shape,
    /// Corner of the transmission angle, opposite the side with the driving joints; `None` for the
    /// minimum over all corners.
    pub(super) corner: Option<usize>,
}

impl PlacedLoop {
    /// Pose `X_AP` of the pin in the body that carries it, pin axis along z. Translation in m.
    pub fn pin(&self) -> &Pose {
        &self.X_pin
    }

    /// Position `p_BE_B` of the eye in the body that carries it (m).
    pub fn eye(&self) -> &Vector3<f64> {
        &self.p_eye
    }
}
