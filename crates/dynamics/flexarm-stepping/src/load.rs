//! External loads on bodies as functions of time. Not here: files and expressions that describe
//! them.

use std::fmt;
use std::sync::Arc;

use flexarm_kinematics::{PointLoad, Pose, Wrench};
use nalgebra::{Rotation3, Vector3};

/// Axes in which the components of a load are constant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum LoadAxes {
    /// World axes.
    #[default]
    World,
    /// Axes of the frame on which it acts: the load rotates with the body.
    Frame,
}

/// A wrench as a function of time, with its discontinuities and time scale for the steppers.
#[derive(Clone)]
pub struct TimedWrench {
    /// Axes in which force and moment are given.
    pub axes: LoadAxes,
    /// Force (N) and moment (N m) at time t (s).
    pub value: Arc<dyn Fn(f64) -> Wrench + Send + Sync>,
    /// Times at which it begins, ends, jumps or has a kink (s); steps of the reference stepper end
    /// there.
    pub jumps: Vec<f64>,
    /// Additional times at which steps of fixed size end (s): a load pulse shorter than a step
    /// would otherwise fall between two step ends.
    pub stops: Vec<f64>,
    /// Shortest period in the load (s), infinite if not periodic: an upper scale for the steps of
    /// the reference stepper.
    pub period: f64,
}

impl TimedWrench {
    /// Creates a wrench in world axes (N, N m) over the time (s), without jumps and without a
    /// period.
    pub fn new(value: impl Fn(f64) -> Wrench + Send + Sync + 'static) -> Self {
        let value = Arc::new(value);
        Self { axes: LoadAxes::World, value, jumps: Vec::new(), stops: Vec::new(), period: f64::INFINITY }
    }

    /// Returns the wrench in these axes.
    #[must_use]
    pub fn in_axes(self, axes: LoadAxes) -> Self {
        Self { axes, ..self }
    }

    /// Returns the wrench with these times at which it begins, ends, jumps or has a kink (s).
    #[must_use]
    pub fn with_jumps(self, jumps: Vec<f64>) -> Self {
        Self { jumps, ..self }
    }

    /// Returns the wrench with this shortest period (s).
    #[must_use]
    pub fn with_period(self, period: f64) -> Self {
        Self { period, ..self }
    }

    /// Returns force (N) and moment (N m) at time `t` (s).
    pub fn at(&self, t: f64) -> Wrench {
        (self.value)(t)
    }
}

impl fmt::Debug for TimedWrench {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut shown = f.debug_struct("TimedWrench");
        shown.field("axes", &self.axes).field("jumps", &self.jumps).field("stops", &self.stops);
        shown.field("period", &self.period);
        shown.finish_non_exhaustive()
    }
}

/// A wrench that acts on a body.
#[derive(Clone, Debug)]
pub struct Load {
    /// The body.
    pub body: usize,
    /// Frame on the body at whose origin it acts.
    pub X_BF: Pose,
    /// The wrench.
    pub wrench: TimedWrench,
}

impl Load {
    /// Creates a load at the body's origin.
    pub fn at_origin(body: usize, wrench: TimedWrench) -> Self {
        Self { body, X_BF: Pose::identity(), wrench }
    }

    /// Creates a constant load at the body's origin, in world axes (N, N m).
    pub fn constant(body: usize, F_W: Wrench) -> Self {
        Self::at_origin(body, TimedWrench::new(move |_| F_W))
    }

    /// Returns the load at time `t` (s) as a point load, for the tangent of the static forces.
    pub(crate) fn point_load(&self, t: f64, X_WB: &Pose) -> PointLoad {
        let (F, turns) = (self.wrench.at(t), self.wrench.axes == LoadAxes::Frame);
        let R = if turns { X_WB.rotation * self.X_BF.rotation } else { Rotation3::identity() };
        let F_W = Wrench::new(R * F.force, R * F.torque);
        PointLoad { body: self.body, p_B: self.X_BF.translation.vector, F_W, turns }
    }

    /// Returns the wrench at time `t` (s) at Bo, in body axes.
    pub(crate) fn on_body(&self, t: f64, X_WB: &Pose) -> Wrench {
        let F = self.wrench.at(t);
        match self.wrench.axes {
            LoadAxes::Frame => F.at_parent(&self.X_BF),
            LoadAxes::World => {
                let turned = Wrench::new(X_WB.rotation.inverse() * F.force, X_WB.rotation.inverse() * F.torque);
                let lever: &Vector3<f64> = &self.X_BF.translation.vector;
                Wrench::new(turned.force, turned.torque + lever.cross(&turned.force))
            }
        }
    }
}
