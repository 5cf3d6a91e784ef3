//! Product-of-exponentials form of the arm: six rotations about lines fixed in the world.
//!
//! ```text
//! X_WT(q) = E_1(q_1) ... E_6(q_6) X_WT(0),      E_i(q) x = o_i + R(h_i, q) (x - o_i)
//! ```
//!
//! Not here: closed forms, which use these lines (`wrist`, `parallel`).

use flexarm_spatial::{Pose, rotation_vector, sin_cos_all};
use nalgebra::{Matrix3, Matrix6, Rotation3, Vector3, Vector6};

/// World line of a joint axis at zero joint values: direction `h` (unit) and a point `o` (m).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Screw {
    pub(crate) h: Vector3<f64>,
    pub(crate) o: Vector3<f64>,
}

/// Rotation about a line, given by sine and cosine.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turn<'a> {
    screw: &'a Screw,
    sine: f64,
    cosine: f64,
}

impl Screw {
    pub(crate) fn at(&self, angle: f64) -> Turn<'_> {
        let (sine, cosine) = angle.sin_cos();
        Turn { screw: self, sine, cosine }
    }

    /// Same line with the opposite direction.
    pub(crate) fn reversed(&self) -> Self {
        Self { h: -self.h, o: self.o }
    }

    /// Distance of a point from the line (m).
    pub(crate) fn distance(&self, p_W: &Vector3<f64>) -> f64 {
        self.h.cross(&(p_W - self.o)).norm()
    }
}

impl Turn<'_> {
    pub(crate) fn inverse(self) -> Self {
        Self { sine: -self.sine, ..self }
    }

    /// Turned direction `R v`, in world axes.
    pub(crate) fn vector(&self, v_W: &Vector3<f64>) -> Vector3<f64> {
        let h = &self.screw.h;
        v_W * self.cosine + h.cross(v_W) * self.sine + h * (h.dot(v_W) * (1.0 - self.cosine))
    }

    /// Moved point `o + R (p - o)`, in world axes.
    pub(crate) fn point(&self, p_W: &Vector3<f64>) -> Vector3<f64> {
        self.screw.o + self.vector(&(p_W - self.screw.o))
    }
}

/// Six screws and the tool pose at zero joint values.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chain {
    pub(crate) axes: [Screw; 6],
    pub(crate) X_0: Pose,
    /// Length scale: sum of the distances between successive axis points, and to the tool (m).
    pub(crate) reach: f64,
}

/// Residual of a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Miss {
    /// Position error (m).
    pub position_m: f64,
    /// Rotation error (rad).
    pub rotation_rad: f64,
}

impl Miss {
    pub(crate) fn norm(&self) -> f64 {
        self.position_m.hypot(self.rotation_rad)
    }
}

impl Chain {
    /// `X_WT` at joint values (rad).
    pub(crate) fn pose(&self, q: &[f64; 6]) -> Pose {
        let (mut sines, mut cosines) = ([0.0; 6], [0.0; 6]);
        sin_cos_all(q, &mut sines, &mut cosines);
        let mut p = self.X_0.translation.vector;
        let R = self.X_0.rotation.matrix();
        let (mut x, mut y): (Vector3<f64>, Vector3<f64>) = (R.column(0).into(), R.column(1).into());
        for i in (0..6).rev() {
            let turn = Turn { screw: &self.axes[i], sine: sines[i], cosine: cosines[i] };
            (p, x, y) = (turn.point(&p), turn.vector(&x), turn.vector(&y));
        }
        let R = Matrix3::from_columns(&[x, y, x.cross(&y)]);
        Pose::from_parts(p.into(), Rotation3::from_matrix_unchecked(R))
    }

    /// Jacobian of [`Self::pose`]: velocity of To and angular velocity in world axes, linear rows
    /// first.
    pub(crate) fn jacobian(&self, q: &[f64; 6]) -> Matrix6<f64> {
        let p = self.pose(q).translation.vector;
        let mut J = Matrix6::zeros();
        let mut before = Pose::identity();
        for (i, axis) in self.axes.iter().enumerate() {
            let (h, o) = (before.rotation * axis.h, before * nalgebra::Point3::from(axis.o));
            J.fixed_view_mut::<3, 1>(0, i).copy_from(&h.cross(&(p - o.coords)));
            J.fixed_view_mut::<3, 1>(3, i).copy_from(&h);
            let R = Rotation3::from_scaled_axis(axis.h * q[i]);
            before *= Pose::from_parts((axis.o - R * axis.o).into(), R);
        }
        J
    }

    /// `[p_target - p; log(R_target Rᵀ)]`, in world axes.
    fn error(&self, q: &[f64; 6], X_WT: &Pose) -> Vector6<f64> {
        let X = self.pose(q);
        let dp = X_WT.translation.vector - X.translation.vector;
        let (R, Rt) = (X.rotation.matrix(), X_WT.rotation.matrix());
        // Axis times the sine of the angle, equal to the rotation vector for small angles.
        let sine = (0..3).fold(Vector3::zeros(), |s, k| s + R.column(k).cross(&Rt.column(k))) * 0.5;
        let small = R.component_mul(Rt).sum() > 2.0 && sine.norm_squared() < 1e-10;
        let r = if small { sine } else { rotation_vector((X_WT.rotation * X.rotation.inverse()).matrix()) };
        Vector6::new(dp.x, dp.y, dp.z, r.x, r.y, r.z)
    }

    /// Refines joint values until the pose is met to rounding or no step improves it; returns the
    /// residual.
    ///
    /// Newton's method with the Jacobian, or with its pseudo-inverse near singular poses. Stops at
    /// once if the residual exceeds `capture`, since the start is then not near a solution.
    pub(crate) fn polish(&self, q: &mut [f64; 6], X_WT: &Pose, capture: f64) -> Miss {
        const ENOUGH: f64 = 2e-14;
        let mut error = self.error(q, X_WT);
        let weighed = |e: &Vector6<f64>| e.fixed_rows::<3>(0).norm() / self.reach + e.fixed_rows::<3>(3).norm();
        for _ in 0..8 {
            let size = weighed(&error);
            if size <= ENOUGH || size > capture {
                break;
            }
            let J = self.jacobian(q);
            // First step that at least halves the weighted residual.
            let Some((trial, next)) = self
                .newton_step(&J, &error)
                .into_iter()
                .chain(self.singular_step(&J, &error))
                .map(|step| std::array::from_fn(|k| q[k] + step[k]))
                .map(|trial: [f64; 6]| (trial, self.error(&trial, X_WT)))
                .find(|(_, next)| weighed(next) < 0.5 * size)
            else {
                break;
            };
            (*q, error) = (trial, next);
        }
        Miss { position_m: error.fixed_rows::<3>(0).norm(), rotation_rad: error.fixed_rows::<3>(3).norm() }
    }

    fn newton_step(&self, J: &Matrix6<f64>, error: &Vector6<f64>) -> Option<Vector6<f64>> {
        J.lu().solve(error).filter(|step| step.amax() < 0.3)
    }

    fn singular_step(&self, J: &Matrix6<f64>, error: &Vector6<f64>) -> Option<Vector6<f64>> {
        let weight = |r: usize| if r < 3 { 1.0 / self.reach } else { 1.0 };
        let Jw = Matrix6::from_fn(|r, c| J[(r, c)] * weight(r));
        let e = Vector6::from_fn(|r, _| error[r] * weight(r));
        let svd = Jw.svd(true, true);
        let cutoff = 1e-6 * svd.singular_values.max();
        svd.solve(&e, cutoff).ok().filter(|step| step.amax() < 0.3)
    }
}

/// Wraps an angle to (-π, π].
pub(crate) fn wrapped(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    let turned = angle - TAU * (angle / TAU).round();
    if turned <= -PI { turned + TAU } else { turned }
}
