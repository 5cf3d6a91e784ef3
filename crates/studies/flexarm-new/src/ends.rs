//! End points of a link's body between its two joints, for files whose frames are elsewhere.
//!
//! A frame may be anywhere on the axis of its joint, and in many descriptions it is at the far end
//! of the link. The body lies along the mesh's longest principal axis or, if a joint axis is nearly
//! parallel to that, along the joint axis. A joint whose axis crosses the body is at the point of
//! the body nearest to the axis; a joint that turns about the body is at the end of the mesh.

use flexarm_kinematics::{Joint, JointKind};
use flexarm_urdf::TriangleMesh;
use nalgebra::{Matrix3, Vector3};

use super::beams::Candidate;

/// Cosine between a joint axis and the body above which the joint turns about the body: 45 degrees.
/// Housings of the next joint tilt the principal axis by 30.
const ALONG: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Returns both ends of the body, the proximal one first, link axes; `None` if shape and joints do
/// not determine them.
pub(crate) fn of(link: &Candidate<'_>) -> Option<[Vector3<f64>; 2]> {
    let (middle, along) = principal_axis(link.meshes)?;
    let X_LB = &link.distal.X_PJ;
    let own = link.proximal.and_then(axis);
    let next = axis(link.distal).map(|axis| X_LB.rotation * axis);
    let joints = [(Vector3::zeros(), own), (X_LB.translation.vector, next)];
    let rolls = joints.iter().find_map(|(at, axis)| Some((*at, axis.filter(|axis| axis.dot(&along).abs() > ALONG)?)));
    let (middle, along) = rolls.map_or((middle, along), |(at, axis)| (at + axis * axis.dot(&(middle - at)), axis));
    let places = || link.meshes.iter().flat_map(|m| &m.positions).map(|p| (vector(p) - middle).dot(&along));
    let (low, high) = (places().fold(f64::INFINITY, f64::min), places().fold(f64::NEG_INFINITY, f64::max));
    let [a, b] = joints.map(|(at, axis)| AxisPosition::of(at - middle, axis, &along));
    let nearer = |s: f64| if s - low < high - s { low } else { high };
    let farther = |s: f64| if s - low < high - s { high } else { low };
    let [a, b] = match (a, b) {
        (AxisPosition::Across(a), AxisPosition::Across(b)) => [a, b],
        (AxisPosition::Across(a), AxisPosition::Along(_)) => [a, farther(a)],
        (AxisPosition::Along(_), AxisPosition::Across(b)) => [farther(b), b],
        // A straight tube between two roll joints: the frames determine the order of the ends.
        (AxisPosition::Along(a), AxisPosition::Along(b)) if a < b => [low, high],
        (AxisPosition::Along(a), AxisPosition::Along(b)) if a > b => [high, low],
        (AxisPosition::Along(a), AxisPosition::Along(_)) => [farther(a), nearer(a)],
    };
    Some([a, b].map(|s| middle + along * s.clamp(low, high)))
}

/// Position of a joint along the body (m).
enum AxisPosition {
    /// Point where its axis crosses the body.
    Across(f64),
    /// Position of its frame; its axis is parallel to the body.
    Along(f64),
}

impl AxisPosition {
    /// Position of a joint axis along a body.
    ///
    /// * `point`: a point on the joint axis, relative to the middle of the body.
    fn of(point: Vector3<f64>, axis: Option<Vector3<f64>>, along: &Vector3<f64>) -> Self {
        let s = point.dot(along);
        let Some(axis) = axis else { return Self::Across(s) };
        let cosine = axis.dot(along);
        if cosine.abs() > ALONG {
            return Self::Along(s);
        }
        // Point of the body nearest to the axis.
        Self::Across((s - point.dot(&axis) * cosine) / (1.0 - cosine * cosine))
    }
}

/// Axis of a joint, in the joint frame.
fn axis(joint: &Joint) -> Option<Vector3<f64>> {
    match joint.kind {
        JointKind::Revolute(axis) | JointKind::Continuous(axis) | JointKind::Prismatic(axis) => Some(axis.into_inner()),
        _ => None,
    }
}

fn vector(p: &[f32; 3]) -> Vector3<f64> {
    Vector3::from(p.map(f64::from))
}

/// Returns the centroid and the longest principal axis of the surfaces.
fn principal_axis(meshes: &[TriangleMesh]) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let (mut area, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
    for mesh in meshes {
        for corners in &mesh.triangles {
            let corner = |k: usize| mesh.positions.get(corners[k] as usize).map(vector);
            let (Some(a), Some(b), Some(c)) = (corner(0), corner(1), corner(2)) else { continue };
            let own = 0.5 * (b - a).cross(&(c - a)).norm();
            let sum = a + b + c;
            area += own;
            first += sum * (own / 3.0);
            // Integral of r rᵀ over a triangle.
            let corners = a * a.transpose() + b * b.transpose() + c * c.transpose();
            second += (corners + sum * sum.transpose()) * (own / 12.0);
        }
    }
    if !(area > 0.0 && area.is_finite()) {
        return None;
    }
    // Second moment about the centroid.
    let middle = first / area;
    let spread = (second / area - middle * middle.transpose()).symmetric_eigen();
    let along = spread.eigenvectors.column(spread.eigenvalues.imax()).into_owned();
    Some((middle, along.normalize()))
}
