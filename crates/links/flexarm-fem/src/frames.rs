//! Frames of a link: A proximal interface (clamped), B distal interface (loaded), S split.
//!
//! All poses are in the link frame L.

use flexarm_spatial::Pose;
use nalgebra::Vector3;

use crate::error::FemError;

/// Maximum distance of a frame from the link origin, m; a larger one is an error in the units.
const LONGEST_LINK: f64 = 100.0;

/// The three frames of a link, in link frame L.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkFrames {
    /// Proximal interface.
    pub X_LA: Pose,
    /// Distal interface.
    pub X_LB: Pose,
    /// Split frame: place of the elastic joint, and axes of `K_S`.
    pub X_LS: Pose,
}

impl LinkFrames {
    /// Creates frames with S midway between A and B, with link axes.
    ///
    /// * `X_LA`, `X_LB`: poses of the interfaces in the link frame, m.
    pub fn new(X_LA: Pose, X_LB: Pose) -> Self {
        Self { X_LA, X_LB, X_LS: Pose::identity() }.with_split_fraction(0.5)
    }

    /// Places S on the straight line from A to B, in link axes.
    pub(crate) fn with_split_fraction(self, fraction: f64) -> Self {
        let p_LA = self.X_LA.translation.vector;
        let p_LS = p_LA + self.p_AB() * fraction;
        self.with_split(Pose::translation(p_LS.x, p_LS.y, p_LS.z))
    }

    /// Places S at any pose.
    ///
    /// * `X_LS`: pose of S in the link frame, m.
    pub fn with_split(self, X_LS: Pose) -> Self {
        Self { X_LS, ..self }
    }

    /// Vector `p_AoBo_L` from A to B, link axes, m.
    pub fn p_AB(&self) -> Vector3<f64> {
        self.X_LB.translation.vector - self.X_LA.translation.vector
    }

    /// Pose of S in the frame with origin Bo and link axes, the frame of `K_BB`.
    pub(crate) fn X_BS(&self) -> Pose {
        let p_LB = self.X_LB.translation.vector;
        Pose::translation(-p_LB.x, -p_LB.y, -p_LB.z) * self.X_LS
    }

    /// Rejects frames farther from the link origin than [`LONGEST_LINK`].
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
