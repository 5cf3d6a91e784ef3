//! The frames of a link: where it is held, where it is loaded, where it is split.
//!
//! All in the link frame L: A proximal interface, B distal interface, S split.

use flexarm_spatial::Pose;
use nalgebra::Vector3;

use crate::error::FemError;

/// No link is longer than this, m: a larger distance is a mistake in the units.
const LONGEST_LINK: f64 = 100.0;

/// The three frames of a link, in its own frame L.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkFrames {
    /// Proximal interface.
    pub X_LA: Pose,
    /// Distal interface.
    pub X_LB: Pose,
    /// Split: where the elastic joint sits, and in whose axes `K_S` is given.
    pub X_LS: Pose,
}

impl LinkFrames {
    /// Frames with S midway between A and B, in link axes.
    pub fn new(X_LA: Pose, X_LB: Pose) -> Self {
        Self { X_LA, X_LB, X_LS: Pose::identity() }.with_split_fraction(0.5)
    }

    /// S on the straight line from A to B, in link axes.
    pub fn with_split_fraction(self, fraction: f64) -> Self {
        let p_LA = self.X_LA.translation.vector;
        let p_LS = p_LA + self.p_AB() * fraction;
        self.with_split(Pose::translation(p_LS.x, p_LS.y, p_LS.z))
    }

    /// S anywhere.
    pub fn with_split(self, X_LS: Pose) -> Self {
        Self { X_LS, ..self }
    }

    /// From A to B, link axes, m.
    pub fn p_AB(&self) -> Vector3<f64> {
        self.X_LB.translation.vector - self.X_LA.translation.vector
    }

    /// S in the frame with origin Bo and link axes, in which `K_BB` lives.
    pub(crate) fn X_BS(&self) -> Pose {
        let p = self.X_LB.translation.vector;
        Pose::translation(-p.x, -p.y, -p.z) * self.X_LS
    }

    /// Refuses frames further from the link origin than any link is long.
    pub(crate) fn check(&self) -> Result<(), FemError> {
        for (what, X) in [
            ("position of interface A (m)", &self.X_LA),
            ("position of interface B (m)", &self.X_LB),
            ("position of the split S (m)", &self.X_LS),
        ] {
            let far = X.translation.vector.amax();
            if !(far <= LONGEST_LINK) {
                return Err(FemError::OutOfRange {
                    what: what.into(),
                    found: far,
                    allowed: format!("up to {LONGEST_LINK} from the link origin; is it in millimetres?"),
                });
            }
        }
        Ok(())
    }
}
