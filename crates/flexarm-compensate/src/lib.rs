//! Joint commands with which the tool of a flexible arm follows the pose of the rigid one.
//!
//! [`static_targets`] at rest, to the nonlinear equilibrium; [`Inversion`] in motion: the change of the commands that takes away
//! an error of the tool over time, by inversion of the arm linearised along its motion; [`Shaper`] against vibration that is left
//! after a motion. Whoever calls runs the arm again with the new commands and asks again: that iteration, its files and limits are
//! the facade's.
#![allow(non_snake_case, reason = "monogram notation: J_a, X_WT; see docs/references.md")]
#![cfg_attr(test, allow(clippy::unwrap_used, reason = "a failed unwrap fails the test"))]

mod inversion;
mod shaping;
mod static_targets;

pub use inversion::{Inversion, InversionError, Node};
pub use shaping::{Shaper, ShaperKind};
pub use static_targets::{StaticTargets, TargetError, static_targets};
