//! Request to read a table: meaning of its columns, and the joints of the robot.

use crate::column_map::ColumnMap;

/// A joint of the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownJoint<'a> {
    /// Joint name.
    pub name: &'a str,
    /// Whether the joint is prismatic (in m).
    pub is_prismatic: bool,
}

/// Information in addition to the table.
#[derive(Clone, Copy, Debug, Default)]
pub struct TableRequest<'a> {
    /// Assignment of columns to the time and the joints.
    pub columns: Option<&'a ColumnMap>,
    /// Joints of the robot; without them every column of numbers may be a joint.
    pub joints: Option<&'a [KnownJoint<'a>]>,
}
