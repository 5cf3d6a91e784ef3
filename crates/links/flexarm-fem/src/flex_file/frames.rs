//! Frames of a reduced-link file, written and read: `[interface.A]`, `[interface.B]`, `[split]`.
//!
//! `X_LA`, `X_LB`, `X_LS`: translation in the unit of length, `rpy` in rad or a rotation matrix by
//! rows. Not here: stiffness and masses (`read.rs`, `write.rs`).

use flexarm_spatial::Pose;
use nalgebra::{Matrix3, Rotation3, Translation3};

use super::document::{Node, Table};
use super::error::{FlexErrorKind, FlexFileError};
use super::text::numbers;
use super::units::Units;
use crate::frames::LinkFrames;

/// Writes a pose: `xyz` in m, and `rpy` in rad if that gives the rotation bit for bit, else the
/// matrix.
pub(super) fn pose_lines(X: &Pose) -> String {
    let mut text = format!("xyz = {}\n", numbers(X.translation.vector.iter()));
    let R = X.rotation.matrix();
    let (roll, pitch, yaw) = X.rotation.euler_angles();
    if *Rotation3::from_euler_angles(roll, pitch, yaw).matrix() == *R {
        text += &format!("rpy = {}\n", numbers([roll, pitch, yaw].iter()));
    } else {
        text += &format!("rotation = {}\n", rows(R));
    }
    text
}

/// Writes a 3×3 as nested rows.
fn rows(R: &Matrix3<f64>) -> String {
    let rows: Vec<_> = R.row_iter().map(|row| numbers(row.iter())).collect();
    format!("[{}]", rows.join(", "))
}

/// Reads interfaces and split, in SI; without `[split]` the split is in the middle.
pub(super) fn read_frames(root: &Table<'_, '_>, units: &Units) -> Result<LinkFrames, FlexFileError> {
    let node = root.require("interface", "give [interface.A] and [interface.B]")?;
    let interface = node.table()?;
    interface.only(&["A", "B"])?;
    let help = "a link has a proximal interface A and a distal one B";
    let X_LA = read_pose(&interface.require("A", help)?.table()?, units, &[])?;
    let X_LB = read_pose(&interface.require("B", help)?.table()?, units, &[])?;
    let frames = LinkFrames::new(X_LA, X_LB);
    frames.check().map_err(|cause| node.refused(cause, "frames in reach of each other"))?;

    let Some(node) = root.get("split") else { return Ok(frames) };
    let frames = frames.with_split(read_pose(&node.table()?, units, &[])?);
    frames.check().map_err(|cause| node.refused(cause, "a frame on or near the link"))?;
    Ok(frames)
}

/// Reads a pose from `xyz` and either `rpy`, `rotation` or nothing; `others` are further keys that
/// the table may have.
pub(super) fn read_pose(table: &Table<'_, '_>, units: &Units, others: &[&str]) -> Result<Pose, FlexFileError> {
    table.only(&[&["xyz", "rpy", "rotation"], others].concat())?;
    let p = table.require("xyz", "three numbers, link axes")?.vector()? * units.length;
    let rotation = match (table.get("rpy"), table.get("rotation")) {
        (None, None) => Rotation3::identity(),
        (Some(rpy), None) => {
            let [roll, pitch, yaw] = rpy.numbers("angles: roll, pitch, yaw")?;
            Rotation3::from_euler_angles(roll, pitch, yaw)
        }
        (None, Some(rotation)) => read_rotation(&rotation)?,
        (Some(_), Some(rotation)) => {
            let kind = FlexErrorKind::UnknownKey;
            return Err(rotation.fail(kind, "rpy and rotation", "one of them", "remove one"));
        }
    };
    Ok(Pose::from_parts(Translation3::from(p), rotation))
}

/// Reads a rotation matrix by rows; rejects one that is not orthonormal to 1e-9.
fn read_rotation(node: &Node<'_, '_>) -> Result<Rotation3<f64>, FlexFileError> {
    let mut R = Matrix3::zeros();
    for (i, row) in node.items(3, "rows")?.iter().enumerate() {
        let row: [f64; 3] = row.numbers("numbers in each row")?;
        R.row_mut(i).copy_from_slice(&row);
    }
    let error = (R.transpose() * R - Matrix3::identity()).amax();
    if error <= 1e-9 && R.determinant() > 0.0 {
        return Ok(Rotation3::from_matrix_unchecked(R));
    }
    Err(node.fail(
        FlexErrorKind::Rotation,
        format!("a matrix with |RᵀR - 1| = {error:.1e}, determinant {:.6}", R.determinant()),
        "orthonormal columns to 1e-9 and determinant +1",
        "print more digits, or give rpy",
    ))
}
