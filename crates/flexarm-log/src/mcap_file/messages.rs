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
}

fn header(cdr: &mut Cdr, stamp: Stamp, frame_id: &str) {
    let (seconds, nanoseconds) = (stamp.0 / 1_000_000_000, stamp.0 % 1_000_000_000);
    cdr.i32(i32::try_from(seconds).expect("a stamp is at most Stamp::MAX"));
    cdr.u32(nanoseconds as u32).string(frame_id);
}

/// Translation, then quaternion x, y, z, w: the order of both `Pose` and `Transform`.
fn pose(cdr: &mut Cdr, X: &Pose) {
    let rotation = UnitQuaternion::from_rotation_matrix(&X.rotation);
    cdr.f64s(X.translation.vector.as_slice()).f64s(rotation.coords.as_slice());
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
        pose(cdr, &transform.X_PC);
    }
}

/// `sensor_msgs/JointState`.
pub(crate) fn joint_state(cdr: &mut Cdr, stamp: Stamp, names: &[String], twin: &crate::TwinSample) {
    header(cdr.start(), stamp, "");
    cdr.string_sequence(names).f64_sequence(&twin.q).f64_sequence(&twin.qdot).f64_sequence(&twin.effort);
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
