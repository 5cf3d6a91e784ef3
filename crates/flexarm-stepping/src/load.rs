//! External loads on bodies as functions of time. Not here: files and expressions that describe them.

use std::fmt;
use std::sync::Arc;

use flexarm_kinematics::{Pose, Wrench};
use nalgebra::Vector3;

/// Axes in which a load keeps its direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum LoadAxes {
    /// World axes.
    #[default]
    World,
    /// Axes of the frame in which it acts: it turns with the body.
    Frame,
}

/// A wrench that acts on a body.
#[derive(Clone)]
pub struct Load {
    /// The body.
    pub body: usize,
    /// Frame on the body at whose origin it acts.
    pub X_BF: Pose,
    /// Axes of the wrench.
    pub axes: LoadAxes,
    /// Force (N) and moment (N m) at time t.
    pub wrench: Arc<dyn Fn(f64) -> Wrench + Send + Sync>,
    /// Times at which it begins, ends, jumps or bends (s); the reference stepper steps over none of them.
    pub jumps: Vec<f64>,
    /// Shortest period in it (s), infinite without one: the steps of the reference stepper stay well below.
    pub period: f64,
}

impl fmt::Debug for Load {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Load").field("body", &self.body).field("X_BF", &self.X_BF).field("axes", &self.axes).finish()
    }
}

impl Load {
    /// A constant wrench at the body's origin, world axes.
    pub fn constant(body: usize, F_W: Wrench) -> Self {
        Self {
            body,
            X_BF: Pose::identity(),
            axes: LoadAxes::World,
            wrench: Arc::new(move |_| F_W),
            jumps: Vec::new(),
            period: f64::INFINITY,
        }
    }

    /// At Bo in body axes.
    pub(crate) fn on_body(&self, t: f64, X_WB: &Pose) -> Wrench {
        let F = (self.wrench)(t);
        match self.axes {
            LoadAxes::Frame => F.at_parent(&self.X_BF),
            LoadAxes::World => {
                let turned = Wrench::new(X_WB.rotation.inverse() * F.force, X_WB.rotation.inverse() * F.torque);
                let arm: &Vector3<f64> = &self.X_BF.translation.vector;
                Wrench::new(turned.force, turned.torque + arm.cross(&turned.force))
            }
        }
    }
}
