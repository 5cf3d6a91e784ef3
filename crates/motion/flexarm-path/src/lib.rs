//! Motions programmed by a tool path: a program of moves, the geometry between its targets, the
//! joints along it, and the time law.
//!
//! * [`program`]: the request of a robot program or a motion file as values: moves, targets,
//!   frames, speeds, blends.
//!
//! ```
//! use flexarm_kinematics::{Joint, JointKind, Link, Mechanism, Model, Pose};
//! use flexarm_path::program::{Blend, Item, Move, MoveKind, Program, Speed, Target};
//! use flexarm_path::{JointBounds, PathOptions, ProgramArm, plan};
//! use flexarm_settings::Place;
//! use nalgebra::{DVector, Vector3};
//!
//! // A slide that carries a tool.
//! let mut slide = Mechanism::new("slide");
//! slide.links.extend(["rail", "tool"].map(|name| Link { name: name.into(), inertia: None }));
//! slide.joints.push(Joint::new("x", JointKind::Prismatic(Vector3::x_axis()), "rail", "tool", Pose::identity()));
//! let model = Model::new(&slide)?;
//! let arm = ProgramArm {
//!     flange: model.frame("tool").ok_or("no tool")?.clone(),
//!     X_FT: Pose::identity(),
//!     X_MW: Pose::identity(),
//!     axes: vec![0],
//!     controller: Vec::new(),
//!     bounds: vec![JointBounds { velocity: 1.0, acceleration: 2.0, torque: None, jerk: None }],
//!     rest: DVector::zeros(1),
//!     starts_at_rest: false,
//!     model: &model,
//! };
//!
//! // From 0 to 0.8 m: v/a + L/v, and the rise time of the acceleration.
//! let to = |x: f64| {
//!     Item::Move(Move {
//!         place: Place::of_file("slide").line(1),
//!         statement: "move".into(),
//!         kind: MoveKind::Joint,
//!         to: Target::Joints(vec![x]),
//!         X_WB: Pose::identity(),
//!         X_FT: None,
//!         speed: Speed::default(),
//!         blend: Blend::Stop,
//!     })
//! };
//! let program = Program { name: "slide".into(), items: vec![to(0.0), to(0.8)], ..Program::default() };
//! let options = PathOptions::default();
//! let planned = plan(&program, &arm, &options)?;
//! let expected = 1.0 / 2.0 + 0.8 / 1.0 + options.rise_s;
//! assert!((planned.trajectory.duration() / expected - 1.0).abs() < 1e-2);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
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

pub use arm::{ControllerAxis, JointBounds, PathOptions, ProgramArm, base_of, tool_of};
pub use curve::{ArcError, ToolCurve, ToolJet};
pub use error::BLOCKED;
pub use follow::coordinates_of;
pub use plan::plan;
pub use planned::{Planned, PlannedMove, Slowed, SlowedBy};
pub use range::{OutOfRange, check_axes, check_rate};
pub use targets::{target_at, target_joints};

/// Parts that the tests of this crate reach; not part of the interface.
#[doc(hidden)]
pub mod internals {
    pub use crate::curve::TURN_LENGTH;
    pub use crate::follow::{Blocked, Follower, FrameCurve, GuidedJoint, JointJet};
}
