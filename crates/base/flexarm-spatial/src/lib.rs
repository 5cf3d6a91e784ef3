//! Spatial algebra: poses, twists, wrenches, inertias and rotations for the other crates.
//!
//! Frames are denoted by letters: `X_AB` is the pose of frame B in frame A, `p_A = X_AB p_B`.
//! Six-vectors have the linear part first; SI units. A twist or wrench refers to a point and to
//! axes: [`Twist::at_parent`] and [`Wrench::at_parent`] transform them to another frame of the same
//! body.
//!
//! ```
//! use flexarm_spatial::{Pose, Twist, Wrench, adjoint};
//! use nalgebra::{Translation3, Rotation3, vector};
//!
//! // Frame B sits 0.5 m along z of A, a quarter turn about z.
//! let R_AB = Rotation3::from_euler_angles(0.0, 0.0, std::f64::consts::FRAC_PI_2);
//! let X_AB = Pose::from_parts(Translation3::new(0.0, 0.0, 0.5), R_AB);
//!
//! // A body that turns about x of A at 2 rad/s moves Bo at -1 m/s along y of A.
//! let V_A = Twist::new(vector![0.0, 0.0, 0.0], vector![2.0, 0.0, 0.0]);
//! let V_B = V_A.at_child(&X_AB);
//! let v_Bo_A = X_AB.rotation * V_B.linear;
//! assert!((v_Bo_A - vector![0.0, -1.0, 0.0]).norm() < 1e-15);
//!
//! // The power of a wrench does not depend on the frame, and Ad_AB is the inverse of at_child.
//! let F_B = Wrench::new(vector![3.0, -1.0, 2.0], vector![0.1, 0.0, 0.4]);
//! assert!((V_B.power(&F_B) - V_A.power(&F_B.at_parent(&X_AB))).abs() < 1e-15);
//! assert!((adjoint(&X_AB) * V_B.to_vector() - V_A.to_vector()).norm() < 1e-15);
//! ```
//!
//! [`GeometricStiffness`] is what reduction of links and steppers exchange about a flexible body.
//!
//! Not here: joints, trees, elastic stiffness. Notation: `docs/references.md`.
#![allow(non_snake_case, reason = "monogram notation: X_AB, Ad_BA, R_AB; see docs/references.md")]
#![cfg_attr(test, allow(clippy::unwrap_used, reason = "a test stops at the first failure"))]

mod blocks;
mod geometric;
#[cfg(target_arch = "x86_64")]
pub mod lanes;
pub mod products;
mod real;
mod rotation;
mod vectors;

pub use blocks::{Matrix12, symmetric_part, turn6, twice};
pub use geometric::GeometricStiffness;
pub use real::{Real, sin_cos_all};
pub use rotation::{AngleKinematics, ElasticAngles, quaternion, rotation_vector};
pub use vectors::{ArticulatedInertia, Pose, SpatialInertia, Twist, Wrench, adjoint, composed, skew};
