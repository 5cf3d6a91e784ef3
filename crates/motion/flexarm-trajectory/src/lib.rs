//! Joint trajectories `q(t), q̇(t), q̈(t)`: files, splines, point-to-point profiles, limits.
//!
//! A [`Trajectory`] is a set of named joints, each a piecewise polynomial of degree five or less.
//! It is built once, from a file or a [`Plan`], and then only read: [`Trajectory::sample`]
//! allocates nothing.
//!
//! ```
//! use flexarm_trajectory::{JointLimits, Trajectory};
//!
//! let text = r#"
//!     format = 1
//!     unit = "deg"
//!     joints = ["shoulder", "elbow"]
//!     start = [0.0, 0.0]
//!
//!     [[move]]
//!     to = [90.0, -45.0]
//!     duration = 2.0      # s
//!     hold = 0.5          # s
//! "#;
//! let trajectory = Trajectory::parse_toml(text, "lift.toml", &[])?;
//! assert_eq!(trajectory.duration(), 2.5);
//!
//! // Halfway in time a quintic move has half its travel, 15/8 of its mean speed and no acceleration.
//! let (mut q, mut qdot, mut qddot) = ([0.0; 2], [0.0; 2], [0.0; 2]);
//! trajectory.sample(1.0, &mut q, &mut qdot, &mut qddot);
//! let half_turn = std::f64::consts::FRAC_PI_2;
//! assert!((q[0] - half_turn / 2.0).abs() < 1e-15);
//! assert!((qdot[0] - 15.0 / 8.0 * half_turn / 2.0).abs() < 1e-15);
//! assert!(qddot[0].abs() < 1e-14);
//!
//! // All violated limits are listed, not only the first one.
//! let limits = JointLimits { upper: 1.0, velocity: 1.4, ..JointLimits::UNLIMITED };
//! let violations = trajectory.check_limits(&[limits; 2]);
//! assert_eq!(violations.len(), 2); // the shoulder's position and speed
//! # Ok::<(), flexarm_trajectory::TrajectoryError>(())
//! ```
//!
//! Where to look:
//!
//! * time-optimal laws: [`time_law`], and [`jerk_law`] with jerk bounds;
//! * mathematics: [`Trajectory`] (sampling, time scaling, moves and holds), [`Plan`] (quintic,
//!   trapezoid and S-curve moves, via points), [`Samples`] (splines through sampled joint values),
//!   [`JointPeak`], [`LimitViolation`];
//! * files: [`Trajectory::from_path`], [`Trajectory::parse_table`], [`Trajectory::parse_toml`],
//!   [`Trajectory::to_csv`], [`Trajectory::to_waypoints_toml`]. The module pages [`waypoints`] and
//!   [`table`] describe the formats; [`foreign_joints`] is the rule for names of joints.
//!
//! Units: s, rad, rad/s, rad/s² (m, m/s, m/s² for a prismatic joint) everywhere except inside the
//! files. Not here: robots, links and inverse kinematics; a trajectory knows only the names of its
//! joints.

mod barrier;
mod column_map;
mod corner;
mod csv_write;
mod curve;
mod error;
mod file;
mod findings;
mod gap;
pub mod jerk_law;
mod joint_names;
mod leg;
mod limits;
mod noise;
mod optimal;
mod peak;
mod plan;
mod polynomial;
mod rounding;
mod samples_toml;
mod shape;
mod spline;
pub mod table;
pub mod time_law;
mod trajectory;
mod via;
pub mod waypoints;
mod waypoints_check;
mod waypoints_toml;
mod waypoints_write;

pub use column_map::{ColumnMap, ColumnMapError};
pub use curve::LONGEST;
pub use error::{MISSING_LIMIT, PlanError, SampleError, TrajectoryError};
pub use file::{bytes_of_file, text_of_bytes, text_of_file};
pub use gap::Gap;
pub use joint_names::foreign_joints;
pub use limits::{JointLimits, LimitKind, LimitViolation};
pub use peak::{Extreme, JointPeak};
pub use plan::{MotionLimits, Plan, PlannedMove, Profile};
pub use spline::{JointKnots, JointSamples, Samples, velocity_mismatch};
pub use table::{KnownJoint, TableInfo, TableRequest};
pub use trajectory::{Move, Trajectory, VelocityJump};

/// Kernels, for the tests of this crate.
#[doc(hidden)]
pub mod internals {
    pub use crate::corner::{Corner, corners};
    pub use crate::noise::{Noise, noise};
    pub use crate::polynomial::{Few, Piece, roots_in_unit_interval};
    pub use crate::via::{passing_times, rest_to_rest_spline};
}
