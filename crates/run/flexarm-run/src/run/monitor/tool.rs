//! TCP error relative to the rigid twin, at every sample and as figures.
//!
//! Frames: W world, T the TCP; the error is flexible minus rigid. Not here: figures of the path
//! (`tool_path.rs`), settling (`settling.rs`).

use flexarm_analysis::{ErrorSample, LongRecord, PathFrame, tcp_error};
use flexarm_kinematics::{Frame, Pose};
use flexarm_stepping::Observation;
use nalgebra::Vector3;

use crate::run::static_part::StaticPart;
use crate::run::twin::RigidTwin;

/// The TCP at one sample.
pub struct ToolError {
    /// TCP pose of the rigid twin.
    pub X_rigid: Pose,
    /// TCP pose of the flexible arm.
    pub X_flexible: Pose,
    /// Translation (m) and rotation vector (rad), world axes.
    pub error: [f64; 6],
    /// The same along the axes of the path.
    pub path_error: [f64; 6],
    /// Static part of the translation (m, world axes); NaN where it is not known.
    pub static_m: [f64; 3],
}

/// Monitors the TCP.
pub struct ToolMonitor {
    path: PathFrame,
    /// `None` if the static part is not needed.
    static_part: Option<StaticPart>,
    record: LongRecord,
}

impl ToolMonitor {
    /// Creates the monitor; `path`: axes of the path before the first motion.
    pub fn new(path: PathFrame, static_part: Option<StaticPart>, record: LongRecord) -> Self {
        Self { path, static_part, record }
    }

    /// Adds a sample of the arm and its twin; returns its error.
    pub(crate) fn update(&mut self, observed: &Observation, twin: &RigidTwin, tcp: &Frame) -> ToolError {
        let X_rigid = twin.data.X_WF(tcp);
        let X_flexible = observed.X_WB[tcp.body] * tcp.X_BF;
        self.add(observed.t, X_rigid, X_flexible, &twin.velocity)
    }

    /// Adds a sample; returns its error.
    ///
    /// * `velocity`: of the rigid TCP (m/s, world axes), which gives the direction of the path.
    pub fn add(&mut self, t: f64, X_rigid: Pose, X_flexible: Pose, velocity: &Vector3<f64>) -> ToolError {
        let error = tcp_error(&X_rigid, &X_flexible);
        self.path = self.path.next(velocity);
        let [x, y, z, rx, ry, rz] = error;
        let [along, normal, binormal] = self.path.components(&Vector3::new(x, y, z));
        let [r_along, r_normal, r_binormal] = self.path.components(&Vector3::new(rx, ry, rz));
        let static_m = self.static_part.as_mut().and_then(|part| part.at(t)).unwrap_or([f64::NAN; 3]);
        self.record.push(&ErrorSample {
            time_s: t,
            error,
            path_error: [along, normal, binormal],
            rigid_position: X_rigid.translation.vector.into(),
            static_m,
        });
        let path_error = [along, normal, binormal, r_along, r_normal, r_binormal];
        ToolError { X_rigid, X_flexible, error, path_error, static_m }
    }

    /// Returns the recorded errors of all samples so far.
    pub fn result(&self) -> &LongRecord {
        &self.record
    }
}
