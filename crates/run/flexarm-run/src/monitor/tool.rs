//! TCP error relative to the rigid twin, at every sample and as figures.

use flexarm_analysis::{ErrorSample, LongRecord, PathFrame, tcp_error};
use flexarm_kinematics::{Frame, Pose};
use flexarm_stepping::Observation;
use nalgebra::Vector3;

use crate::static_part::StaticPart;
use crate::twin::RigidTwin;

/// The TCP at one sample.
pub(crate) struct ToolError {
    /// TCP pose of the rigid twin.
    pub(crate) X_rigid: Pose,
    /// TCP pose of the flexible arm.
    pub(crate) X_flexible: Pose,
    /// Translation (m) and rotation vector (rad), world axes.
    pub(crate) error: [f64; 6],
    /// The same along the axes of the path.
    pub(crate) path_error: [f64; 6],
    /// Static part of the translation (m, world axes); NaN where it is not known.
    pub(crate) static_m: [f64; 3],
}

/// Monitors the TCP.
pub(crate) struct ToolMonitor {
    path: PathFrame,
    /// `None` if the static part is not needed.
    static_part: Option<StaticPart>,
    record: LongRecord,
}

impl ToolMonitor {
    /// * `path`: axes of the path before the first motion.
    pub(crate) fn new(path: PathFrame, static_part: Option<StaticPart>, record: LongRecord) -> Self {
        Self { path, static_part, record }
    }

    pub(crate) fn update(&mut self, seen: &Observation, twin: &RigidTwin, tcp: &Frame) -> ToolError {
        let X_rigid = twin.data.X_WF(tcp);
        let X_flexible = seen.X_WB[tcp.body] * tcp.X_BF;
        self.add(seen.t, X_rigid, X_flexible, &twin.velocity)
    }

    /// * `velocity`: of the rigid TCP (m/s, world axes), which gives the direction of the path.
    fn add(&mut self, t: f64, X_rigid: Pose, X_flexible: Pose, velocity: &Vector3<f64>) -> ToolError {
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
    pub(crate) fn result(&self) -> &LongRecord {
        &self.record
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flexarm_analysis::MetricSettings;

    /// Truth: a TCP that moves along y at 1 m/s, one millimetre ahead of its twin and two
    /// millimetres beside it.
    #[test]
    fn what_is_ahead_and_what_is_beside_the_path_are_told_apart() {
        let speed = Vector3::y();
        let path = PathFrame::before((0..3).map(|_| [speed, Vector3::zeros()]));
        let record = LongRecord::new(vec![(0.0, 1.0)], false, MetricSettings::default());
        let mut tool = ToolMonitor::new(path, None, record);
        for k in 0..=100 {
            let t = 0.01 * f64::from(k);
            let X_rigid = Pose::translation(0.5, t, 0.0);
            let seen = tool.add(t, X_rigid, X_rigid * Pose::translation(2e-3, 1e-3, 0.0), &speed);
            let [along, normal, binormal] = [0, 1, 2].map(|c| seen.path_error[c]);
            assert!((along - 1e-3).abs() < 1e-15 && (normal.hypot(binormal) - 2e-3).abs() < 1e-15);
            assert!(seen.static_m.iter().all(|x| x.is_nan()), "nobody asked");
        }
        let metrics = tool.result().metrics().unwrap();
        assert!((metrics.peak_m - 5f64.sqrt() * 1e-3).abs() < 1e-15 && (metrics.path_accuracy_m - 2e-3).abs() < 1e-15);
        assert!((metrics.tangential_peak_m - 1e-3).abs() < 1e-15);
    }
}
