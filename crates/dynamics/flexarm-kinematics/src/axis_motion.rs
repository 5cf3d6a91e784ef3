//! Single-DoF joints: all joint-specific parts of the recursions.
//!
//! The motion subspace of such a joint is a constant column in B (and in J) axes, `V_PB_B = S q̇`
//! with `S = [l; a]`: no bias, no rate. Recursions are linear in S, so they supply the result for a
//! rotation and for a translation ([`AxisMotion::linear`]), and this file combines them by joint
//! type. A new type needs a variant here, in [`AxisMotion::linear`] and in the two poses. Not here:
//! six-DoF elastic joints and interfaces (`data.rs`).

use std::ops::Add;

use flexarm_spatial::products::{add, add3, dot, lift, lift3, mul, scaled, scaled3};
use flexarm_spatial::{Pose, Real, Twist, Wrench, skew};
use nalgebra::{Matrix3, Rotation3, Vector3, Vector6};

/// Motion of a single-DoF joint; axes are unit vectors, with the same components in J and B axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AxisMotion {
    /// Rotation about the axis (rad).
    Revolute(Vector3<f64>),
    /// Translation along the axis (m).
    Prismatic(Vector3<f64>),
    /// Rotation about the axis (rad) with a proportional translation along it, like a nut on a
    /// spindle.
    Helical {
        /// Screw axis.
        axis: Vector3<f64>,
        /// Translation per rad (m): lead of the thread over 2π, positive for right-handed threads.
        pitch: f64,
    },
}

impl AxisMotion {
    /// Unit vector of the joint axis, in axes of the joint frame J.
    #[inline(always)]
    pub fn axis(self) -> Vector3<f64> {
        match self {
            Self::Revolute(axis) | Self::Prismatic(axis) | Self::Helical { axis, .. } => axis,
        }
    }

    /// Whether the coordinate is a length (m) rather than an angle (rad).
    pub fn slides(self) -> bool {
        matches!(self, Self::Prismatic(_))
    }

    /// Magnitude of the translation along the axis per unit of the coordinate (m/rad or m/m).
    pub fn travel(self) -> f64 {
        match self {
            Self::Revolute(_) => 0.0,
            Self::Prismatic(_) => 1.0,
            Self::Helical { pitch, .. } => pitch.abs(),
        }
    }

    /// Evaluates a linear map of `S` from its values for a rotation about the axis and for a
    /// translation along it.
    #[inline(always)]
    pub(crate) fn linear<R: Add<Output = R>>(
        self,
        rotation: impl FnOnce(Vector3<f64>) -> R,
        translation: impl FnOnce(Vector3<f64>) -> R,
    ) -> R {
        match self {
            Self::Revolute(axis) => rotation(axis),
            Self::Prismatic(axis) => translation(axis),
            Self::Helical { axis, pitch } => rotation(axis) + translation(axis * pitch),
        }
    }

    /// Pose `X_JB` of the child in the joint frame at the joint value (rad or m).
    pub fn pose(self, value: f64) -> Pose {
        match self {
            Self::Revolute(axis) => {
                Pose::from_parts(Vector3::zeros().into(), Rotation3::from_scaled_axis(axis * value))
            }
            Self::Prismatic(axis) => Pose::from_parts((axis * value).into(), Rotation3::identity()),
            Self::Helical { axis, pitch } => {
                Pose::from_parts((axis * (pitch * value)).into(), Rotation3::from_scaled_axis(axis * value))
            }
        }
    }

    /// `X_PB` at the joint value: [`Self::pose`] outward of `X_PJ`, from the rotation table and the
    /// sine and cosine of the value (for rotating joints).
    #[inline(always)]
    pub(crate) fn place<T: Real>(
        self,
        X_PJ: &Pose,
        turn: &RevoluteTable,
        value: T,
        (sine, cosine): (T, T),
        X_PB: &mut Pose<T>,
    ) {
        let p_PJ = lift(&X_PJ.translation.vector);
        match self {
            Self::Revolute(_) => {
                *X_PB.rotation.matrix_mut_unchecked() = turn.at(sine, cosine);
                X_PB.translation.vector = p_PJ;
            }
            Self::Prismatic(axis) => {
                *X_PB.rotation.matrix_mut_unchecked() = lift3(X_PJ.rotation.matrix());
                X_PB.translation.vector = add(&p_PJ, &shifted(X_PJ, &axis, value));
            }
            Self::Helical { axis, pitch } => {
                *X_PB.rotation.matrix_mut_unchecked() = turn.at(sine, cosine);
                X_PB.translation.vector = add(&p_PJ, &shifted(X_PJ, &(axis * pitch), value));
            }
        }
    }

    /// `V_PB_B = S q̇` at Bo, for the rate q̇ (rad/s or m/s).
    #[inline(always)]
    pub fn twist<T: Real>(self, rate: T) -> Twist<T> {
        self.linear(
            #[inline(always)]
            |axis| Twist::new(Vector3::zeros(), scaled(&lift(&axis), rate)),
            #[inline(always)]
            |axis| Twist::new(scaled(&lift(&axis), rate), Vector3::zeros()),
        )
    }

    /// `Sᵀ F`: generalised force (N m or N) of the wrench `F_Bo_B`.
    #[inline(always)]
    pub fn project<T: Real>(self, F: &Wrench<T>) -> T {
        self.linear(
            #[inline(always)]
            |axis| dot(&lift(&axis), &F.torque),
            #[inline(always)]
            |axis| dot(&lift(&axis), &F.force),
        )
    }

    /// `S = [l; a]` as a 6-vector in the axes J of the joint, linear part first (m/rad or 1; 1 or 0).
    pub fn column(self) -> Vector6<f64> {
        self.linear(
            |axis| Vector6::new(0.0, 0.0, 0.0, axis.x, axis.y, axis.z),
            |axis| Vector6::new(axis.x, axis.y, axis.z, 0.0, 0.0, 0.0),
        )
    }

    /// Coordinate of a small displacement `S q`: left inverse of [`Self::column`].
    ///
    /// * `d_J`: displacement (m) and rotation (rad) at the joint, in its axes J.
    pub fn coordinate_of(self, d_J: &Vector6<f64>) -> f64 {
        let along = self.linear(|axis| axis.dot(&d_J.fixed_rows::<3>(3)), |axis| axis.dot(&d_J.fixed_rows::<3>(0)));
        match self {
            Self::Revolute(_) | Self::Prismatic(_) => along,
            Self::Helical { pitch, .. } => along / (1.0 + pitch * pitch),
        }
    }
}

/// Translation `R_PJ travel value` in P axes.
#[inline(always)]
fn shifted<T: Real>(X_PJ: &Pose, travel: &Vector3<f64>, value: T) -> Vector3<T> {
    scaled(&lift(&mul(X_PJ.rotation.matrix(), travel)), value)
}

/// `R_PB(q) = R_0 + sin q R_1 + cos q R_2`: Rodrigues' formula including the joint placement.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RevoluteTable {
    R_0: Matrix3<f64>,
    R_1: Matrix3<f64>,
    R_2: Matrix3<f64>,
}

impl RevoluteTable {
    /// Creates the table of a joint with the unit axis `axis_J`.
    pub(crate) fn new(X_PJ: &Pose, axis_J: &Vector3<f64>) -> Self {
        let (R, A) = (X_PJ.rotation.matrix(), skew(axis_J));
        let A2 = axis_J * axis_J.transpose() - Matrix3::identity();
        Self { R_0: R + R * A2, R_1: R * A, R_2: -(R * A2) }
    }

    /// `R_PB` for sine and cosine of the joint angle.
    #[inline(always)]
    pub(crate) fn at<T: Real>(&self, sine: T, cosine: T) -> Matrix3<T> {
        add3(&add3(&lift3(&self.R_0), &scaled3(&lift3(&self.R_1), sine)), &scaled3(&lift3(&self.R_2), cosine))
    }
}
