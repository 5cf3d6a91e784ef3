//! ROS 2 messages of a recording and their encoding: plain CDR, little endian [OMG DDSI-RTPS 2.5,
//! section 10].
//!
//! CDR has values without names, so a message is a tuple of its fields in the order of its
//! definition.

use std::io;

use flexarm_kinematics::Pose;
use nalgebra::UnitQuaternion;
use re_cdr::{CdrSerializer, LittleEndian};
use serde::{Deserialize, Serialize};

/// Encapsulation header: CDR, little endian, no options.
const ENCAPSULATION: [u8; 4] = [0x00, 0x01, 0x00, 0x00];

/// Replaces `bytes` by the encoded message.
pub fn encode(message: impl Serialize, bytes: &mut Vec<u8>) -> io::Result<()> {
    bytes.clear();
    bytes.extend(ENCAPSULATION);
    message.serialize(&mut CdrSerializer::<LittleEndian>::new(bytes)).map_err(io::Error::other)
}

/// Returns the fields at the start of a message; `None` if the bytes do not match them.
pub fn decode<'m, T: Deserialize<'m>>(bytes: &'m [u8]) -> Option<T> {
    let (fields, _) = re_cdr::from_bytes::<T, LittleEndian>(bytes.strip_prefix(&ENCAPSULATION)?).ok()?;
    Some(fields)
}

/// `builtin_interfaces/Time`: seconds, nanoseconds.
pub(crate) type Time = (u32, u32);
/// `std_msgs/Header`: time, frame.
pub(crate) type Header<'a> = (Time, &'a str);
/// `tf2_msgs/TFMessage`: header, frame, translation and quaternion x, y, z, w.
pub(crate) type Transforms<'a> = Vec<(Header<'a>, &'a str, [f64; 7])>;
/// `sensor_msgs/JointState`: header, names, positions, velocities, efforts.
pub(crate) type JointState<'a> = (Header<'a>, Vec<&'a str>, Vec<f64>, Vec<f64>, Vec<f64>);
/// `std_msgs/Float64MultiArray`, of older files: dimensions (label, size, stride), offset, values.
pub(crate) type LabelledArray<'a> = (Vec<(&'a str, u32, u32)>, u32, Vec<f64>);

/// Time of a message since the epoch of the recording's clock (ns); at most [`Stamp::MAX`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Stamp(pub(crate) u64);

impl Stamp {
    /// Maximum of `builtin_interfaces/Time` (ns), whose seconds are an `int32`.
    pub(crate) const MAX: u64 = i32::MAX as u64 * 1_000_000_000;

    fn time(self) -> Time {
        let seconds = u32::try_from(self.0 / 1_000_000_000).expect("a stamp is at most Stamp::MAX");
        (seconds, (self.0 % 1_000_000_000) as u32)
    }
}

/// Pose of a coordinate frame in its parent frame.
pub(crate) struct Transform<'a> {
    pub(crate) parent: &'a str,
    pub(crate) child: &'a str,
    pub(crate) X_PC: Pose,
    /// Whether single precision suffices (for drawing only); it compresses well.
    pub(crate) coarse: bool,
}

/// Translation, then quaternion x, y, z, w; the layout of both `Pose` and `Transform`.
fn pose(X: &Pose) -> [f64; 7] {
    let [x, y, z] = X.translation.vector.into();
    let [qx, qy, qz, qw] = UnitQuaternion::from_rotation_matrix(&X.rotation).coords.into();
    [x, y, z, qx, qy, qz, qw]
}

/// `tf2_msgs/TFMessage`.
pub(crate) fn transforms<'a>(stamp: Stamp, transforms: &[Transform<'a>]) -> Transforms<'a> {
    let message = |transform: &Transform<'a>| {
        let fine = pose(&transform.X_PC);
        let pose = if transform.coarse { fine.map(|value| f64::from(value as f32)) } else { fine };
        ((stamp.time(), transform.parent), transform.child, pose)
    };
    transforms.iter().map(message).collect()
}

/// `sensor_msgs/JointState` with positions, velocities and efforts, each of every name or empty.
pub(crate) fn joint_state(stamp: Stamp, names: &[impl Serialize], [q, qdot, effort]: [&[f64]; 3]) -> impl Serialize {
    ((stamp.time(), ""), names, q, qdot, effort)
}

/// `geometry_msgs/PoseStamped`.
pub(crate) fn pose_stamped(stamp: Stamp, frame: &str, X: &Pose) -> impl Serialize {
    ((stamp.time(), frame), pose(X))
}

/// `geometry_msgs/WrenchStamped`: force, torque.
pub(crate) fn wrench_stamped(stamp: Stamp, frame: &str, values: &[f64; 6]) -> impl Serialize {
    ((stamp.time(), frame), values)
}

/// Severity of an event, as in `rcl_interfaces/Log`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Level {
    Info = 20,
    Warn = 30,
    Error = 40,
}

/// `rcl_interfaces/Log`; the fields file, function and line of a program are empty.
pub(crate) fn log(stamp: Stamp, level: Level, name: &str, text: &str) -> impl Serialize {
    (stamp.time(), level as u8, name, text, "", "", 0_u32)
}

/// Kinds of `visualization_msgs/Marker` used here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i32)]
pub(crate) enum MarkerKind {
    Arrow = 0,
    LineStrip = 4,
    Text = 9,
    TriangleList = 11,
}

/// The fields in use of a `visualization_msgs/Marker`. A marker is shown until one with the same
/// namespace and number replaces it.
#[derive(Clone, Debug)]
pub(crate) struct Marker<'a> {
    pub(crate) frame: &'a str,
    pub(crate) namespace: &'a str,
    pub(crate) id: usize,
    pub(crate) kind: MarkerKind,
    /// Position of a text (m).
    pub(crate) place: [f64; 3],
    /// Sizes (m): line width; shaft diameter, head diameter and head length of an arrow; height of
    /// a text, as the third entry.
    pub(crate) scale: [f64; 3],
    /// Red, green, blue, alpha, 0 to 1.
    pub(crate) color: [f32; 4],
    /// Corners or end points (m), as `f32`: widened to `f64`, their trailing zeros compress well.
    pub(crate) points: Vec<[f32; 3]>,
    pub(crate) text: String,
}

/// `visualization_msgs/MarkerArray`: all markers move with their frames and never expire.
pub(crate) fn markers<'a>(stamp: Stamp, markers: &'a [Marker<'a>]) -> impl Serialize {
    const ADD: i32 = 0;
    const NO_LIST: u32 = 0;
    const NO_TIME: Time = (0, 0);
    let message = |marker: &'a Marker<'a>| {
        let id = i32::try_from(marker.id).expect("a robot has fewer than 2^31 meshes");
        let what = ((stamp.time(), marker.frame), marker.namespace, id, marker.kind as i32, ADD);
        let pose = (marker.place, [0.0, 0.0, 0.0, 1.0]);
        let is_locked_to_frame = true;
        let points: Vec<[f64; 3]> = marker.points.iter().map(|point| point.map(f64::from)).collect();
        // Colours of points; resource and image of the texture; coordinates on it.
        let texture = (NO_LIST, "", (NO_TIME, "", "", NO_LIST), NO_LIST);
        // Resource; name and content of the file; whether its materials are used.
        let mesh = ("", ("", NO_LIST), false);
        (
            what,
            pose,
            marker.scale,
            marker.color,
            NO_TIME,
            is_locked_to_frame,
            points,
            texture,
            marker.text.as_str(),
            mesh,
        )
    };
    markers.iter().map(message).collect::<Vec<_>>()
}
