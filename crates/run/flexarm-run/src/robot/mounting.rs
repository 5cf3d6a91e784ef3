//! Elastic mounting of a robot's base: six springs, or a flexible link between ground and base.
//!
//! Springs are stored with the rigid robot and inserted under the base when the robot is modelled
//! ([`RobotMounting::Springs`]). A beam or a mesh becomes a flexible link between the ground and
//! the base, like any other ([`RobotMounting::Link`]).

use flexarm_flexlink::Mounting;
use flexarm_stepping::Damping;

/// Elastic mounting of a robot's base.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "one per robot, made once")]
pub enum RobotMounting {
    /// Six springs, possibly coupled.
    Springs {
        /// Frame and stiffness of the springs.
        springs: Mounting,
        /// Damping of the springs.
        damping: Damping,
        /// Play of each spring to each side (m, rad); empty if there is none.
        play: Vec<f64>,
    },
    /// Flexible link between ground and base.
    Link {
        /// Name of the link in [`crate::Robot::flexible_links`].
        name: String,
    },
}

impl RobotMounting {
    /// Returns the name used in results.
    pub fn name(&self) -> &str {
        match self {
            Self::Springs { springs, .. } => &springs.name,
            Self::Link { name } => name,
        }
    }
}
