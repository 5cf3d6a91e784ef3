//! Joint motions from other programs: ROS messages as text and in bags, converted to a
//! [`flexarm_trajectory::Trajectory`].
//!
//! ```
//! use flexarm_motion_io::{Request, read_text};
//!
//! let text = "\
//! joint_names: [shoulder, gripper]
//! points:
//! - {positions: [0.0, 0.0], velocities: [0.0, 0.0], time_from_start: {sec: 0, nanosec: 0}}
//! - {positions: [0.8, 0.1], velocities: [0.0, 0.0], time_from_start: {sec: 1, nanosec: 500000000}}
//! ";
//! let motion = read_text(text, "plan.yaml", &Request { joints: Some(&["shoulder", "elbow"]), topic: None })?;
//! assert_eq!(motion.trajectory.joints(), ["shoulder"]);
//! assert_eq!(motion.trajectory.duration(), 1.5);
//! assert_eq!(motion.dropped, ["gripper"]); // also reported in `motion.caveats`
//! # Ok::<(), flexarm_motion_io::MotionError>(())
//! ```
//!
//! | what | read by | messages |
//! | --- | --- | --- |
//! | YAML, JSON, output of `ros2 topic echo` and `rostopic echo` | [`read_text`] | the types below, at any depth |
//! | MCAP, chunks plain or compressed by zstd or lz4 | [`read_bag`] | the types below (CDR of either byte order, ROS 1) |
//! | SQLite bags (`.db3`) | [`read_bag`] | the same in CDR |
//! | folders of rosbag2 with `metadata.yaml` | [`read_bag`] | the same; also files compressed as a whole (`.zstd`) |
//!
//! Types: `trajectory_msgs/JointTrajectory`, `sensor_msgs/JointState`,
//! `control_msgs/JointTrajectoryControllerState`, and messages that contain a `JointTrajectory`.
//!
//! All formats are converted to one tree of values ([`value`]): [`yaml`] builds it from text,
//! [`cdr`] from bytes by the definition of the message ([`definition`]); [`message`] finds motions
//! in it, [`collect`] groups them by topic and joint, [`assemble`] builds curves. Joints are
//! matched by name in each message. [`write_joint_trajectory`] is the inverse.
//!
//! Units: rad, rad/s, rad/s², m, s, as in ROS. Not here: robots; the caller gives the robot's
//! joints ([`Request`]).
#![allow(rustdoc::private_intra_doc_links, reason = "the page describes how the modules work together")]

mod assemble;
mod bag;
mod cdr;
mod collect;
mod definition;
mod error;
mod mcap;
mod message;
#[cfg_attr(not(feature = "sqlite"), path = "no_sqlite.rs")]
mod sqlite;
mod text;
mod unpack;
mod value;
mod write;
mod yaml;

pub use bag::{SQLITE_MAGIC, read_bag};
pub use error::MotionError;
pub use mcap::MCAP_MAGIC;
pub use text::{is_message_text, read_text};
pub use unpack::ZSTD_MAGIC;
pub use write::{TextFormat, write_joint_trajectory};

/// Parts that the tests of this crate reach; not part of the interface.
#[doc(hidden)]
pub mod internals {
    pub use crate::definition::{Definitions, Kind, Many};
}

use flexarm_settings::Finding;
use flexarm_trajectory::Trajectory;

/// Selection of the joints and the topic of a file.
#[derive(Clone, Copy, Debug, Default)]
pub struct Request<'a> {
    /// Joints of the robot; others are dropped and listed. Without it all joints are read.
    pub joints: Option<&'a [&'a str]>,
    /// Topic of a bag; without it one is selected, with a caveat.
    pub topic: Option<&'a str>,
}

/// A motion with information about its origin.
#[derive(Clone, Debug)]
pub struct MessageMotion {
    /// Curves of the requested joints, in the order of the file.
    pub trajectory: Trajectory,
    /// Kind of file, such as `MCAP bag`.
    pub format: &'static str,
    /// Topic of a bag.
    pub topic: Option<String>,
    /// Type of the messages, such as `sensor_msgs/msg/JointState`, as given in the file or
    /// recognised from the keys.
    pub message: String,
    /// Maximum number of samples of a joint.
    pub samples: usize,
    /// Joints of the messages that were not requested.
    pub dropped: Vec<String>,
    /// Choices, assumptions and dropped content.
    pub caveats: Vec<Finding>,
}
