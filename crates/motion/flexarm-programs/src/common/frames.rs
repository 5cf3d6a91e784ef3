//! Orientation conventions of robot makers. Angles in rad unless the name states otherwise, lengths
//! in m.

use flexarm_spatial::Pose;
use nalgebra::{Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Rotation of KUKA's A, B, C: by A about z, then by B about the new y, then by C about the new x.
pub(crate) fn rotation_zyx(a: f64, b: f64, c: f64) -> Rotation3<f64> {
    Rotation3::from_euler_angles(c, b, a)
}

/// A, B, C of a rotation; if B is +-90 degrees, where A and C have the same axis, C is 0.
pub(crate) fn angles_zyx(R: &Rotation3<f64>) -> [f64; 3] {
    let m = R.matrix();
    let cos_b = m[(0, 0)].hypot(m[(1, 0)]);
    let b = (-m[(2, 0)]).atan2(cos_b);
    if cos_b < 1e-9 {
        return [(-m[(0, 1)]).atan2(m[(1, 1)]), b, 0.0];
    }
    [m[(1, 0)].atan2(m[(0, 0)]), b, m[(2, 1)].atan2(m[(2, 2)])]
}

/// Pose of a position in mm and A, B, C in degrees.
pub(crate) fn pose_zyx_mm_deg(xyzabc: [f64; 6]) -> Pose {
    let [x, y, z, a, b, c] = xyzabc;
    let R = rotation_zyx(a.to_radians(), b.to_radians(), c.to_radians());
    Pose::from_parts(Translation3::from(Vector3::new(x, y, z) * 1e-3), R)
}

/// Position in mm and A, B, C in degrees of a pose.
pub(crate) fn mm_deg_zyx(X: &Pose) -> [f64; 6] {
    let p = X.translation.vector * 1e3;
    let [a, b, c] = angles_zyx(&X.rotation).map(f64::to_degrees);
    [p.x, p.y, p.z, a, b, c]
}

/// Rotation of ABB's quaternion with real part q1; `None` if its norm differs from 1 by more than
/// 10 %.
pub(crate) fn rotation_quaternion(q: [f64; 4]) -> Option<Rotation3<f64>> {
    let quaternion = Quaternion::new(q[0], q[1], q[2], q[3]);
    let near_one = (quaternion.norm() - 1.0).abs() < 0.1;
    near_one.then(|| UnitQuaternion::from_quaternion(quaternion).to_rotation_matrix())
}

/// ABB's quaternion of a rotation, with the real part first and not negative.
pub(crate) fn quaternion(R: &Rotation3<f64>) -> [f64; 4] {
    let q = UnitQuaternion::from_rotation_matrix(R);
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    [q.w, q.i, q.j, q.k].map(|part| part * sign)
}

/// Pose of a position and a rotation vector (axis times angle).
pub(crate) fn pose_rotation_vector(p: [f64; 6]) -> Pose {
    let [x, y, z, rx, ry, rz] = p;
    Pose::from_parts(Translation3::new(x, y, z), Rotation3::new(Vector3::new(rx, ry, rz)))
}

/// Position and rotation vector of a pose.
pub(crate) fn rotation_vector_of(X: &Pose) -> [f64; 6] {
    let (p, r) = (X.translation.vector, UnitQuaternion::from_rotation_matrix(&X.rotation).scaled_axis());
    [p.x, p.y, p.z, r.x, r.y, r.z]
}

/// A circle from a start through a second to a third point.
pub(crate) struct Circle {
    /// Centre (m).
    pub(crate) centre: Vector3<f64>,
    /// Rotation axis from the start through the second point.
    axis: nalgebra::Unit<Vector3<f64>>,
    /// Angle from the start to the third point, 0 to 2 pi.
    pub(crate) angle: f64,
}

impl Circle {
    /// The circle through three points; `None` if they are on a line or two of them coincide.
    pub(crate) fn through(start: Vector3<f64>, via: Vector3<f64>, end: Vector3<f64>) -> Option<Self> {
        let (a, b) = (via - start, end - start);
        let normal = a.cross(&b);
        let size = a.norm() * b.norm();
        if !(size.is_finite() && normal.norm() > 1e-12 * size && size > 0.0) {
            return None;
        }
        // Circumcentre of a triangle, relative to its first corner.
        let to_centre = b.cross(&normal) * a.norm_squared() + normal.cross(&a) * b.norm_squared();
        let centre = start + to_centre / (2.0 * normal.norm_squared());
        let axis = nalgebra::Unit::new_normalize(normal);
        let (from, to) = (start - centre, end - centre);
        let angle = axis.cross(&from).dot(&to).atan2(from.dot(&to)).rem_euclid(std::f64::consts::TAU);
        Some(Self { centre, axis, angle })
    }

    /// Unit vector along the axis.
    pub(crate) fn normal(&self) -> Vector3<f64> {
        self.axis.into_inner()
    }

    /// Rotation about the axis by an angle.
    pub(crate) fn turn(&self, angle: f64) -> Rotation3<f64> {
        Rotation3::from_axis_angle(&self.axis, angle)
    }
}
