//! Motions programmed by a tool path: a program of moves, the geometry between its targets, the
//! joints along it, and the time law.
//!
//! * [`program`]: the request of a robot program or a motion file as values: moves, targets,
//!   frames, speeds, blends.
//!
//! Not here: parsing of programs and files, link deflection.
#![allow(non_snake_case, reason = "monogram notation: X_WT, R_AB; see docs/references.md")]

mod arm;
mod averaged;
mod branch;
mod curve;
mod error;
mod follow;
mod jerk_bounded;
mod legs;
mod limits;
mod plan;
mod planned;
pub mod program;
mod range;
mod route;
mod schedule;
mod targets;

pub use flexarm_trajectory::{jerk_law, time_law};

pub use arm::{ControllerAxis, JointBounds, PathOptions, ProgramArm};
pub use curve::{ArcError, TURN_LENGTH, ToolCurve, ToolJet};
pub use error::PathError;
pub use follow::{Blocked, Follower, FrameCurve, GuidedJoint, JointJet, coordinates_of};
pub use plan::plan;
pub use planned::{Planned, PlannedMove, Slowed, SlowedBy};
pub use range::{OutOfRange, check_axes, check_rate};
pub use targets::{base_of, target_at, target_joints, tool_of};
