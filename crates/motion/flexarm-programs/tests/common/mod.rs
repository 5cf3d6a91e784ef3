//! Fixtures and comparisons.
#![allow(non_snake_case, reason = "X_BT: a pose")]
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

use std::path::{Path, PathBuf};

use flexarm_path::program::{Item, Move, Program, Target};
use flexarm_programs::{ReadOptions, read_program};
use flexarm_spatial::Pose;
use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Vector3};

pub(crate) fn fixture(name: &str) -> (PathBuf, Vec<u8>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name);
    let bytes = std::fs::read(&path).unwrap();
    (path, bytes)
}

pub(crate) fn read(name: &str, options: &ReadOptions<'_>) -> Program {
    let (path, bytes) = fixture(name);
    read_program(&path, &bytes, options).unwrap()
}

/// Reads a program from a text without a file.
pub(crate) fn read_text(name: &str, text: &str, options: &ReadOptions<'_>) -> Result<Program, String> {
    let path = Path::new("/nowhere").join(name);
    read_program(&path, text.as_bytes(), options).map_err(|error| error.to_string().replace("/nowhere/", ""))
}

pub(crate) fn moves(program: &Program) -> Vec<&Move> {
    program.items.iter().filter_map(|item| if let Item::Move(step) = item { Some(step) } else { None }).collect()
}

pub(crate) fn pose(step: &Move) -> Pose {
    match &step.to {
        Target::Pose { X_BT, .. } => *X_BT,
        Target::Joints(joints) => panic!("{} goes to joint values {joints:?}", step.statement),
    }
}

pub(crate) fn joints_deg(step: &Move) -> Vec<f64> {
    match &step.to {
        Target::Joints(joints) => joints.iter().map(|joint| joint.to_degrees()).collect(),
        Target::Pose { .. } => panic!("{} goes to a pose", step.statement),
    }
}

/// Rotation as an explicit product of matrices: Rz(a) Ry(b) Rx(c), degrees.
pub(crate) fn euler_product(a: f64, b: f64, c: f64) -> Rotation3<f64> {
    let [(sa, ca), (sb, cb), (sc, cc)] = [a, b, c].map(|angle| angle.to_radians().sin_cos());
    let z = Matrix3::new(ca, -sa, 0.0, sa, ca, 0.0, 0.0, 0.0, 1.0);
    let y = Matrix3::new(cb, 0.0, sb, 0.0, 1.0, 0.0, -sb, 0.0, cb);
    let x = Matrix3::new(1.0, 0.0, 0.0, 0.0, cc, -sc, 0.0, sc, cc);
    Rotation3::from_matrix_unchecked(z * y * x)
}

/// Rodrigues' formula, written out.
pub(crate) fn rodrigues(r: Vector3<f64>) -> Rotation3<f64> {
    let angle = r.norm();
    if angle == 0.0 {
        return Rotation3::identity();
    }
    let k = (r / angle).cross_matrix();
    Rotation3::from_matrix_unchecked(Matrix3::identity() + k * angle.sin() + k * k * (1.0 - angle.cos()))
}

/// A pose with its position in mm.
pub(crate) fn at_mm(x: f64, y: f64, z: f64, R: Rotation3<f64>) -> Pose {
    IsometryMatrix3::from_parts((Vector3::new(x, y, z) * 1e-3).into(), R)
}

/// Maximum difference of the entries of two poses (m and 1).
pub(crate) fn distance(a: &Pose, b: &Pose) -> f64 {
    (a.to_homogeneous() - b.to_homogeneous()).amax()
}

#[track_caller]
pub(crate) fn assert_pose(found: &Pose, expected: &Pose) {
    let error = distance(found, expected);
    // measured up to 4e-9 where a fixture writes 8 digits of a quaternion, else 4e-16
    assert!(error < 1e-8, "poses differ by {error:e}: {found} and {expected}");
}
