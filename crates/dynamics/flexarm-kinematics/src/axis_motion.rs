//! Joints of one coordinate: everything that the recursions need to know of each.
//!
//! The motion subspace of such a joint is a constant column in B (and in J) axes, `V_PB_B = S q̇`
//! with `S = [l; a]`: no bias, no rate. What a recursion does with it is linear in S, so it says
//! what a rotation and what a translation do ([`AxisMotion::linear`]), and this file says which of
//! them a joint has. A new kind is a variant here, in [`AxisMotion::linear`] and in the two poses.
//! Not here: elastic joints of six coordinates and interfaces (`data.rs`).

use std::ops::Add;

use flexarm_spatial::products::{add, add3, dot, lift, lift3, mul, scaled, scaled3};
use flexarm_spatial::{Pose, Real, Twist, Wrench, skew};
use nalgebra::{Matrix3, Rotation3, Vector3, Vector6};

/// Motion of a joint with one coordinate; axes are unit vectors, with the same components in J and
/// B axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AxisMotion {
    /// Rotation about the axis, rad.
    Revolute(Vector3<f64>),
    /// Translation along the axis, m.
    Prismatic(Vector3<f64>),
    /// Rotation about the axis, rad, which moves along it as a nut on a spindle does.
    Helical {
        /// The axis.
        axis: Vector3<f64>,
        /// Translation per rad, m; the lead of the thread over 2π, positive for right-handed
        /// threads.
        pitch: f64,
    },
}

impl AxisMotion {
    /// Unit vector of the joint.
    #[inline(always)]
    pub fn axis(self) -> Vector3<f64> {
        match self {
            Self::Revolute(axis) | Self::Prismatic(axis) | Self::Helical { axis, .. } => axis,
        }
    }

    /// Whether its coordinate is a length (m) and not an angle (rad).
    pub fn slides(self) -> bool {
        matches!(self, Self::Prismatic(_))
    }

    /// Translation along the axis per unit of the coordinate (m/rad or m/m).
    pub fn travel(self) -> f64 {
        match self {
            Self::Revolute(_) => 0.0,
            Self::Prismatic(_) => 1.0,
            Self::Helical { pitch, .. } => pitch.abs(),
        }
    }

    /// A linear map of `S`, from what it makes of a rotation about the axis and of a translation
    /// along it.
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

    /// Pose of the child in the joint frame at the joint value (rad or m).
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

    /// `X_PB` at the joint value: the same as [`Self::pose`] behind `X_PJ`, from the table of the
    /// rotation and the sine and cosine of the value (of joints that turn).
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

    /// `S q̇` in B axes, at Bo.
    #[inline(always)]
    pub fn twist<T: Real>(self, rate: T) -> Twist<T> {
        self.linear(
            #[inline(always)]
            |axis| Twist::new(Vector3::zeros(), scaled(&lift(&axis), rate)),
            #[inline(always)]
            |axis| Twist::new(scaled(&lift(&axis), rate), Vector3::zeros()),
        )
    }

    /// `Sᵀ F` (N m or N) of a wrench at Bo in B axes.
    #[inline(always)]
    pub fn project<T: Real>(self, F: &Wrench<T>) -> T {
        self.linear(
            #[inline(always)]
            |axis| dot(&lift(&axis), &F.torque),
            #[inline(always)]
            |axis| dot(&lift(&axis), &F.force),
        )
    }

    /// `S` as six numbers, linear first.
    pub fn column(self) -> Vector6<f64> {
        self.linear(
            |axis| Vector6::new(0.0, 0.0, 0.0, axis.x, axis.y, axis.z),
            |axis| Vector6::new(axis.x, axis.y, axis.z, 0.0, 0.0, 0.0),
        )
    }

    /// The coordinate of a small displacement `S q` (linear first): the inverse of [`Self::column`]
    /// on its line.
    pub fn coordinate_of(self, displacement: &Vector6<f64>) -> f64 {
        let along = self.linear(
            |axis| axis.dot(&displacement.fixed_rows::<3>(3)),
            |axis| axis.dot(&displacement.fixed_rows::<3>(0)),
        );
        match self {
            Self::Revolute(_) | Self::Prismatic(_) => along,
            Self::Helical { pitch, .. } => along / (1.0 + pitch * pitch),
        }
    }
}

/// `R_PJ travel value`: where a translation leads, in P axes.
#[inline(always)]
fn shifted<T: Real>(X_PJ: &Pose, travel: &Vector3<f64>, value: T) -> Vector3<T> {
    scaled(&lift(&mul(X_PJ.rotation.matrix(), travel)), value)
}

/// `R_PB(q) = K0 + sin q K1 + cos q K2`: Rodrigues' formula with the placement multiplied in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RevoluteTable {
    K0: Matrix3<f64>,
    K1: Matrix3<f64>,
    K2: Matrix3<f64>,
}

impl RevoluteTable {
    pub(crate) fn new(X_PJ: &Pose, axis: &Vector3<f64>) -> Self {
        let (R, A) = (X_PJ.rotation.matrix(), skew(axis));
        let A2 = axis * axis.transpose() - Matrix3::identity();
        Self { K0: R + R * A2, K1: R * A, K2: -(R * A2) }
    }

    /// `R_PB` at the sine and cosine of the joint's angle.
    #[inline(always)]
    pub(crate) fn at<T: Real>(&self, sine: T, cosine: T) -> Matrix3<T> {
        add3(&add3(&lift3(&self.K0), &scaled3(&lift3(&self.K1), sine)), &scaled3(&lift3(&self.K2), cosine))
    }
}
