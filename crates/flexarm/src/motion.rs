//! Trajectories for a robot: joints in coordinate order, checked against its limits.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use flexarm_kinematics::Model;
use flexarm_stepping::PrescribedMotion;
use flexarm_trajectory::{JointLimits, LimitViolation, Trajectory};

use crate::caveat::{self, Caveat};
use crate::error::Error;

/// A trajectory whose joints are the model's actuated coordinates.
#[derive(Clone, Debug)]
pub struct Motion {
    /// Name for logs.
    pub name: String,
    /// The file.
    pub path: PathBuf,
    /// The curves, in coordinate order.
    pub trajectory: Arc<Trajectory>,
    /// Limits that it passes.
    pub violations: Vec<LimitViolation>,
    /// The slip that would explain positions beyond their limits; empty if none would.
    pub likely: &'static str,
    /// Things worth telling.
    pub warnings: Vec<String>,
}

struct Along(Arc<Trajectory>);

impl PrescribedMotion for Along {
    fn sample(&self, t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]) {
        self.0.sample(t, q, qdot, qddot);
    }

    fn velocity_jumps(&self) -> Vec<f64> {
        let mut times: Vec<f64> = self.0.velocity_jumps().iter().map(|jump| jump.time_s).collect();
        times.dedup();
        times
    }
}

fn limits(model: &Model) -> Vec<JointLimits> {
    let actuated = &model.coordinates()[..model.n_actuated()];
    let limits = actuated.iter().map(|c| JointLimits {
        lower: c.limits.lower,
        upper: c.limits.upper,
        velocity: c.limits.velocity,
        acceleration: None,
    });
    limits.collect()
}

impl Motion {
    /// Reads a trajectory file for a model.
    ///
    /// # Errors
    /// [`Error::File`] or [`Error::Trajectory`]: format, units, times, joints that are missing or unknown.
    pub fn load(path: &Path, model: &Model) -> Result<Self, Error> {
        if !path.is_file() {
            let what = "there is no such trajectory file; give a .csv or .toml file".into();
            return Err(Error::File { path: path.to_owned(), what });
        }
        let actuated = &model.coordinates()[..model.n_actuated()];
        let limits = limits(model);
        let names: Vec<&str> = actuated.iter().map(|c| c.joint.as_str()).collect();
        let named: Vec<(&str, JointLimits)> = names.iter().copied().zip(limits.iter().copied()).collect();
        let trajectory = Trajectory::from_path(path, &named)?;
        let warnings = warnings(&trajectory, path);
        let trajectory = trajectory
            .with_joint_order(&names)
            .map_err(|e| Error::File { path: path.to_owned(), what: e.to_string() })?;
        let violations = trajectory.check_limits(&limits);
        let likely = caveat::motion::degrees(&violations, model);
        let name = path.file_stem().map_or_else(|| "trajectory".into(), |s| s.to_string_lossy().into_owned());
        Ok(Self { name, path: path.to_owned(), trajectory: Arc::new(trajectory), violations, likely, warnings })
    }

    /// The same motion with each corner, where a velocity jumps, replaced by a blend that lasts `seconds`.
    ///
    /// # Errors
    /// [`Error::Usage`] unless `seconds` is positive, [`Error::Trajectory`] if numbers become too extreme.
    pub fn with_rounded_corners(self, seconds: f64, model: &Model) -> Result<Self, Error> {
        if !(seconds > 0.0 && seconds.is_finite()) {
            let message = format!("corners are rounded within a positive time, found {seconds} s: try 0.02");
            return Err(Error::Usage(message));
        }
        let trajectory = self.trajectory.with_rounded_corners(seconds)?;
        let warnings = warnings(&trajectory, &self.path);
        let violations = trajectory.check_limits(&limits(model));
        Ok(Self { trajectory: Arc::new(trajectory), violations, warnings, ..self })
    }

    /// What is worth knowing about it.
    pub fn caveats(&self) -> Vec<Caveat> {
        let file = self.path.display().to_string();
        self.warnings.iter().map(|text| Caveat::said("trajectory", &file, text, "")).collect()
    }

    /// For steppers.
    pub fn prescribed(&self) -> Arc<dyn PrescribedMotion> {
        Arc::new(Along(self.trajectory.clone()))
    }
}

fn warnings(trajectory: &Trajectory, path: &Path) -> Vec<String> {
    trajectory.warnings().iter().map(|w| format!("{}: {w}", path.display())).collect()
}
