//! The ROS 2 messages of a recording, written field by field.

use flexarm_kinematics::Pose;
use nalgebra::UnitQuaternion;

use super::cdr::Cdr;

/// Time of a message since the epoch of the recording's clock (ns); at most [`Stamp::MAX`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Stamp(pub(crate) u64);

impl Stamp {
    /// Largest time of `builtin_interfaces/Time`, whose seconds are an `int32`.
    pub(crate) const MAX: u64 = i32::MAX as u64 * 1_000_000_000;
}

/// A coordinate frame and the one it is given in.
pub(crate) struct Transform<'a> {
    pub(crate) parent: &'a str,
    pub(crate) child: &'a str,
    pub(crate) X_PC: Pose,
    /// Made for the eye: seven digits do, and compress well.
    pub(crate) coarse: bool,
}

/// `builtin_interfaces/Time`.
fn time(cdr: &mut Cdr, stamp: Stamp) {
    let (seconds, nanoseconds) = (stamp.0 / 1_000_000_000, stamp.0 % 1_000_000_000);
    cdr.i32(i32::try_from(seconds).expect("a stamp is at most Stamp::MAX"));
    cdr.u32(nanoseconds as u32);
}

fn header(cdr: &mut Cdr, stamp: Stamp, frame_id: &str) {
    time(cdr, stamp);
    cdr.string(frame_id);
}

/// Translation, then quaternion x, y, z, w: the order of both `Pose` and `Transform`.
fn pose(cdr: &mut Cdr, X: &Pose) {
    let rotation = UnitQuaternion::from_rotation_matrix(&X.rotation);
    cdr.f64s(X.translation.vector.as_slice()).f64s(rotation.coords.as_slice());
}

/// The same with the precision of `f32`.
fn coarse_pose(cdr: &mut Cdr, X: &Pose) {
    let rotation = UnitQuaternion::from_rotation_matrix(&X.rotation);
    for value in X.translation.vector.iter().chain(rotation.coords.iter()) {
        cdr.f64(f64::from(*value as f32));
    }
}

/// `std_msgs/String`.
pub(crate) fn string(cdr: &mut Cdr, text: &str) {
    cdr.start().string(text);
}

/// `tf2_msgs/TFMessage`.
pub(crate) fn transforms(cdr: &mut Cdr, stamp: Stamp, transforms: &[Transform<'_>]) {
    cdr.start().length(transforms.len());
    for transform in transforms {
        header(cdr, stamp, transform.parent);
        cdr.string(transform.child);
        match transform.coarse {
            false => pose(cdr, &transform.X_PC),
            true => coarse_pose(cdr, &transform.X_PC),
        }
    }
}

/// What is the same in all messages of some joints: frame and names, as they follow the time.
pub(crate) struct JointNames(Vec<u8>);

impl JointNames {
    pub(crate) fn new(names: &[String]) -> Self {
        let mut cdr = Cdr::default();
        time(cdr.start(), Stamp(0));
        let before = cdr.bytes().len();
        cdr.string("").string_sequence(names);
        Self(cdr.bytes()[before..].to_vec())
    }
}

/// `sensor_msgs/JointState` with positions, velocities and efforts.
pub(crate) fn joint_state(cdr: &mut Cdr, stamp: Stamp, names: &JointNames, values: [&[f64]; 3]) {
    time(cdr.start(), stamp);
    cdr.made(&names.0);
    for values in values {
        cdr.f64_sequence(values);
    }
}

/// `geometry_msgs/PoseStamped`.
pub(crate) fn pose_stamped(cdr: &mut Cdr, stamp: Stamp, frame_id: &str, X: &Pose) {
    header(cdr.start(), stamp, frame_id);
    pose(cdr, X);
}

/// `geometry_msgs/TwistStamped` or `WrenchStamped`: two vectors, linear first.
pub(crate) fn six_vector_stamped(cdr: &mut Cdr, stamp: Stamp, frame_id: &str, values: &[f64; 6]) {
    header(cdr.start(), stamp, frame_id);
    cdr.f64s(values);
}

/// `std_msgs/Float64MultiArray` with one dimension, labelled with the names of the entries.
pub(crate) fn labelled_array(cdr: &mut Cdr, labels: &str, values: &[f64]) {
    cdr.start().length(1).string(labels).length(values.len()).length(values.len());
    cdr.u32(0).f64_sequence(values);
}

/// How bad an event is, in the words of `rcl_interfaces/Log`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Level {
    Info = 20,
    Warn = 30,
    Error = 40,
}

/// `rcl_interfaces/Log`.
pub(crate) fn log(cdr: &mut Cdr, stamp: Stamp, level: Level, name: &str, text: &str) {
    time(cdr.start(), stamp);
    cdr.u8(level as u8).string(name).string(text);
    cdr.string("").string("").u32(0); // file, function, line
}

/// Kinds of `visualization_msgs/Marker` in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i32)]
pub(crate) enum MarkerKind {
    Arrow = 0,
    LineStrip = 4,
    Text = 9,
    TriangleList = 11,
}

/// What is set of a `visualization_msgs/Marker`; it stays until another of its namespace and number comes.
#[derive(Clone, Debug)]
pub(crate) struct Marker<'a> {
    pub(crate) frame: &'a str,
    pub(crate) namespace: &'a str,
    pub(crate) id: usize,
    pub(crate) kind: MarkerKind,
    /// Place of a text (m).
    pub(crate) place: [f64; 3],
    /// Sizes: of a line its width, of an arrow shaft, head width and head length, of a text its height as the third (m).
    pub(crate) scale: [f64; 3],
    /// Red, green, blue, alpha, 0 to 1.
    pub(crate) color: [f32; 4],
    /// Corners or ends (m), as `f32`: the zeros behind compress to nothing.
    pub(crate) points: Vec<[f32; 3]>,
    pub(crate) text: String,
}

/// `visualization_msgs/MarkerArray`: all markers move with their frames.
pub(crate) fn markers(cdr: &mut Cdr, stamp: Stamp, markers: &[Marker<'_>]) {
    const ADD: i32 = 0;
    cdr.start().length(markers.len());
    for marker in markers {
        header(cdr, stamp, marker.frame);
        cdr.string(marker.namespace).i32(i32::try_from(marker.id).expect("a robot has fewer than 2^31 meshes"));
        cdr.i32(marker.kind as i32).i32(ADD);
        cdr.f64s(&marker.place).f64s(&[0.0, 0.0, 0.0, 1.0]).f64s(&marker.scale);
        for part in marker.color {
            cdr.f32(part);
        }
        cdr.i32(0).u32(0); // lifetime: for ever
        cdr.u8(1); // locked to its frame
        cdr.length(marker.points.len());
        for point in &marker.points {
            cdr.f64s(&point.map(f64::from));
        }
        cdr.length(0).string(""); // colours of points, texture
        cdr.i32(0).u32(0).string("").string("").length(0); // image of the texture: header, format, data
        cdr.length(0).string(&marker.text); // coordinates on the texture
        cdr.string("").string("").length(0).u8(0); // mesh resource, mesh file, its materials
    }
}
