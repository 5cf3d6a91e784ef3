//! Balancers: forces that depend only on the configuration, like gravity.
//!
//! A balancer acts along the line between two points of the arm, or about one joint. It has a
//! single length x, and its law has the energy U(x):
//!
//! ```text
//! line:   x = |d|,  d = p_WTo - p_WFrom,  u = d/x      force on From  +T u,  on To  -T u      T = dU/dx: tension     (1)
//!         ∂(T u)/∂d = k u uᵀ + (T/x) (1 - u uᵀ)                                               k = dT/dx              (2)
//! joint:  x = Σ c_i q_i + x_0                           generalised force  -c_i T                                    (3)
//! ```
//! Force laws: [`BalancerLaw`]; element of the mechanism: [`Balancer`]. All `f64` recursions
//! include balancers, those of [`crate::lanes`] do not. Not here: files, friction in a cylinder,
//! heat transfer.

mod curve;
mod forces;
mod law;
mod lengths;
mod place;
mod placed;

pub use curve::{BalancerCurve, BalancerCurveError};
pub use law::{BalancerLaw, GasLaw};
pub use placed::{BalancerLine, BalancerPlace, PlacedBalancer};

pub(crate) use forces::{add_joint_torques, with_lines};
pub(crate) use lengths::{energy, measure};
pub(crate) use place::place_balancers;

/// Balancer of a mechanism; links and joints are given by name.
#[derive(Clone, Debug, PartialEq)]
pub struct Balancer {
    /// Unique name.
    pub name: String,
    /// Points or joint on which it acts.
    pub span: BalancerSpan,
    /// Force law.
    pub law: BalancerLaw,
}

/// Points or joint between which a balancer acts.
#[derive(Clone, Debug, PartialEq)]
pub enum BalancerSpan {
    /// Along the line between the origins of two links. Frames on fixed joints move with the part
    /// of a flexible link that carries them.
    Points {
        /// Name of the first link.
        from: String,
        /// Name of the second link.
        to: String,
    },
    /// About a single-DoF joint, between its two links; the value includes the deflection of drive
    /// springs inside the joint.
    Joint {
        /// Name of the joint.
        joint: String,
        /// Name of the child link.
        child: String,
    },
}
