//! Trajectories of a robot: joints in coordinate order, checked against its limits.
//!
//! Start at [`Motion::load`]; `Motion::of` fits a trajectory to a robot. SI units. Not here:
//! formats of files (`motion_formats`), TCP paths (`tool_path`), mathematics of trajectories
//! (`flexarm_trajectory`).

use std::path::{Path, PathBuf};
use std::sync::Arc;

use flexarm_kinematics::{Coordinate, Model};
use flexarm_stepping::PrescribedMotion;
use flexarm_trajectory::{JointLimits, JointSamples, KnownJoint, LimitViolation, Samples, Trajectory, foreign_joints};

use crate::caveat::{self, Finding};
use crate::error::Error;
use crate::motions::motion_formats::{self, MotionFile, MotionOptions, ReadMotion, refuse_dependent};
use crate::motions::tool_path::{Cell, ToolPath, held_at};
use crate::robot::Robot;

/// Trajectory whose joints are the model's actuated coordinates.
#[derive(Clone, Debug)]
pub struct Motion {
    /// Name for logs.
    pub name: String,
    /// Path of the file.
    pub path: PathBuf,
    /// Trajectory, in coordinate order.
    pub trajectory: Arc<Trajectory>,
    /// Exceeded limits.
    pub violations: Vec<LimitViolation>,
    /// Unit error that would explain positions beyond their limits; empty if there is none.
    pub likely: &'static str,
    /// Warnings about the trajectory; their messages start with the place in the file.
    pub warnings: Vec<Finding>,
    /// Joints that the file does not contain.
    pub held: Vec<HeldJoint>,
    /// Planned moves, if the motion is given as a TCP path.
    pub tool_path: Option<Arc<ToolPath>>,
    /// Description of the file's format; empty for a computed motion.
    pub format: String,
    /// Topic, if the file is a bag.
    pub topic: Option<String>,
    /// Number of rows, messages or points in the file; None for waypoints.
    pub samples: Option<usize>,
    /// Joints in the file that the robot does not have; they are ignored.
    pub dropped: Vec<String>,
    /// Choices, assumptions and omissions made when reading the file.
    pub notes: Vec<Finding>,
}

/// Joint that the motion does not contain.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldJoint {
    /// Joint name.
    pub joint: String,
    /// Position at which it is held (rad or m).
    pub at: f64,
    /// Whether the position is given in the robot file.
    pub given: bool,
}

/// A trajectory as steppers see it.
struct AlongTrajectory(Arc<Trajectory>);

impl PrescribedMotion for AlongTrajectory {
    fn sample(&self, t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]) {
        self.0.sample(t, q, qdot, qddot);
    }

    fn velocity_jumps(&self) -> Vec<f64> {
        let mut times: Vec<f64> = self.0.velocity_jumps().iter().map(|jump| jump.time_s).collect();
        times.dedup();
        times
    }
}

/// Returns the limits of the joints that a motion can violate.
pub fn limits(model: &Model) -> Vec<JointLimits> {
    let actuated = &model.coordinates()[..model.n_actuated()];
    let limits = actuated.iter().map(|c| JointLimits {
        lower: c.limits.lower,
        upper: c.limits.upper,
        velocity: c.limits.velocity,
        acceleration: c.limits.acceleration,
        jerk: c.limits.jerk,
    });
    limits.collect()
}

impl Motion {
    /// Reads a motion file for a robot, in any format of `docs/motions.md`. Joints it does not
    /// contain are held at the position in the robot file, or else at zero or the limit closest to
    /// zero.
    ///
    /// # Errors
    /// [`Error::File`], [`Error::Trajectory`] or [`Error::Motion`] for an invalid format, units,
    /// times, or joints that the robot does not have; [`Error::Model`].
    pub fn load(path: impl AsRef<Path>, robot: &Robot) -> Result<Self, Error> {
        Self::load_with(path, robot, &MotionOptions::default())
    }

    /// As [`Motion::load`], with a given topic of a bag or given columns of a table.
    ///
    /// # Errors
    /// As [`Motion::load`], and if the topic or the columns do not exist.
    pub fn load_with(path: impl AsRef<Path>, robot: &Robot, options: &MotionOptions) -> Result<Self, Error> {
        Self::load_text(path.as_ref(), None, robot, options)
    }

    /// As [`Motion::load_with`], with a text instead of the file's content, for waypoints and TCP
    /// paths.
    ///
    /// # Errors
    /// As [`Motion::load_with`].
    pub fn load_text(path: &Path, text: Option<&str>, robot: &Robot, options: &MotionOptions) -> Result<Self, Error> {
        let model = robot.rigid_model()?;
        let Robot { hold, controller, .. } = robot;
        Self::read(path, &Cell { model: &model, tcp_link: Some(&robot.tcp.0), hold, controller }, options, text)
    }

    /// As [`Motion::load`], for a model without a robot.
    ///
    /// # Errors
    /// As [`Motion::load`].
    pub fn load_for(path: &Path, model: &Model) -> Result<Self, Error> {
        Self::read(path, &Cell { model, tcp_link: None, hold: &[], controller: &[] }, &MotionOptions::default(), None)
    }

    /// Interpolates sampled positions by a spline, as for the rows of a CSV file.
    ///
    /// * `t`: n times (s), increasing; shifted so that the first is 0.
    /// * `q`: n rows of all actuated joints in coordinate order, row by row (rad or m).
    ///
    /// # Errors
    /// [`Error::Pose`] for a wrong number of values, [`Error::Trajectory`] for values that are not
    /// finite or times that do not increase; [`Error::Model`].
    pub fn from_samples(t: &[f64], q: &[f64], robot: &Robot) -> Result<Self, Error> {
        let model = robot.rigid_model()?;
        let actuated = &model.coordinates()[..model.n_actuated()];
        let n = actuated.len();
        if q.len() != n * t.len() {
            let (found, times) = (q.len(), t.len());
            return Err(Error::samples(found, times, n));
        }
        let column = |k: usize| q.iter().skip(k).step_by(n.max(1)).copied().collect();
        let joint = |(k, c): (usize, &Coordinate)| JointSamples {
            name: c.joint.clone(),
            position: column(k),
            ..JointSamples::default()
        };
        let samples = Samples { times: t.to_vec(), joints: actuated.iter().enumerate().map(joint).collect() };
        Self::along(samples.interpolate()?, "samples", robot)
    }

    /// Returns the motion along a computed trajectory, such as a spline or a plan of moves.
    ///
    /// * `name`: name for logs and messages.
    ///
    /// # Errors
    /// [`Error::File`] for joints that the robot does not have; [`Error::Model`].
    pub fn along(trajectory: Trajectory, name: &str, robot: &Robot) -> Result<Self, Error> {
        Self::of(trajectory, Path::new(name), &*robot.rigid_model()?, &robot.hold)
    }

    /// Reads a motion file for a robot, from `text` if it is given.
    fn read(path: &Path, cell: &Cell<'_>, options: &MotionOptions, text: Option<&str>) -> Result<Self, Error> {
        let Cell { model, hold, .. } = *cell;
        let actuated = &model.coordinates()[..model.n_actuated()];
        let named: Vec<(&str, JointLimits)> = actuated.iter().map(|c| c.joint.as_str()).zip(limits(model)).collect();
        let joints: Vec<KnownJoint<'_>> =
            actuated.iter().map(|c| KnownJoint { name: &c.joint, is_prismatic: c.slides() }).collect();
        let file = MotionFile { path, joints: Some(&joints), limits: &named, options, cell: Some(cell), text };
        let read = motion_formats::read(&file)?;
        let ReadMotion { trajectory, format, topic, samples, dropped, caveats, tool_path } = read;
        trajectory.check_units(&path.display().to_string(), &joints)?;
        let mut motion = Self::of(trajectory, path, model, hold)?;
        motion.dropped.extend(dropped);
        Ok(Self { format, topic, samples, notes: caveats, tool_path: tool_path.map(Arc::new), ..motion })
    }

    /// Fits a trajectory to a robot: joints in coordinate order, those that it does not name held.
    fn of(trajectory: Trajectory, path: &Path, model: &Model, hold: &[(String, f64)]) -> Result<Self, Error> {
        let actuated = &model.coordinates()[..model.n_actuated()];
        let names: Vec<&str> = actuated.iter().map(|c| c.joint.as_str()).collect();

        // Joints of closed loops cannot be commanded; those of a gripper are left out.
        let dependent: Vec<&str> = model.dependent().iter().map(|c| c.joint.as_str()).collect();
        let moved: Vec<String> = trajectory.joints().iter().chain(trajectory.dropped_columns()).cloned().collect();
        refuse_dependent(path, &moved, &names, &dependent)?;
        let dropped = foreign_joints(trajectory.joints(), &names).map_err(|e| Error::motion(path, e.to_string()))?;
        let trajectory = trajectory.without_joints(&dropped);

        // The other joints stay where the robot file says, or at the position closest to zero.
        let still = actuated.iter().filter(|c| !trajectory.joints().contains(&c.joint));
        let place = |c: &Coordinate| {
            let (at, given) = held_at(hold, c);
            HeldJoint { joint: c.joint.clone(), at, given }
        };
        let held: Vec<HeldJoint> = still.map(place).collect();
        let warnings = warnings(&trajectory, path);
        let named_held: Vec<(&str, f64)> = held.iter().map(|held| (held.joint.as_str(), held.at)).collect();
        let trajectory = trajectory.with_held_joints(&named_held)?;
        let trajectory = trajectory.with_joint_order(&names).map_err(|e| Error::motion(path, e.to_string()))?;
        let violations = trajectory.check_limits(&limits(model));
        Ok(Self {
            name: path.file_stem().map_or_else(|| "trajectory".into(), |s| s.to_string_lossy().into_owned()),
            path: path.to_owned(),
            trajectory: Arc::new(trajectory),
            likely: caveat::motion::degrees(&violations, model),
            violations,
            warnings,
            held,
            format: String::new(),
            topic: None,
            samples: None,
            dropped,
            notes: Vec::new(),
            tool_path: None,
        })
    }

    /// Replaces the trajectory by one of the same joints.
    fn with_trajectory(self, trajectory: Trajectory, model: &Model) -> Self {
        let violations = trajectory.check_limits(&limits(model));
        Self {
            warnings: warnings(&trajectory, &self.path),
            likely: caveat::motion::degrees(&violations, model),
            violations,
            trajectory: Arc::new(trajectory),
            ..self
        }
    }

    /// Scales the duration of the motion by `factor`, including pauses.
    ///
    /// # Errors
    /// [`Error::Trajectory`] unless `factor` is positive, and if values overflow.
    pub fn scaled(self, factor: f64, model: &Model) -> Result<Self, Error> {
        let trajectory = self.trajectory.scaled(factor)?;
        // The planned moves are valid only at their own speed.
        Ok(Self { tool_path: None, ..self.with_trajectory(trajectory, model) })
    }

    /// Replaces each corner, where a velocity jumps, by a blend of duration `seconds`; a note says
    /// where there is no corner.
    ///
    /// # Errors
    /// [`Error::Value`] unless `seconds` is positive and shorter than the motion,
    /// [`Error::Trajectory`] if values overflow.
    pub fn with_rounded_corners(self, seconds: f64, model: &Model) -> Result<Self, Error> {
        let duration = self.trajectory.duration();
        if !(seconds > 0.0 && seconds < duration) {
            return Err(Error::Value(format!(
                "corners are rounded within a time between 0 and that of the motion ({duration} s), found {seconds} s: \
                 try 0.02"
            )));
        }
        let sharp = self.trajectory.velocity_jumps().iter().any(|jump| jump.time_s > 0.0 && jump.time_s < duration);
        let trajectory = self.trajectory.with_rounded_corners(seconds)?;
        let mut motion = self.with_trajectory(trajectory, model);
        if !sharp {
            let file = motion.path.display().to_string();
            let message = format!("{file}: no velocity jumps along the motion, so there is no corner to round");
            motion.notes.push(Finding::warning("no-corners", file, message, "").as_note());
        }
        Ok(motion)
    }

    /// Returns the caveats about the motion.
    pub fn caveats(&self) -> Vec<Finding> {
        let read = self.notes.iter().cloned().chain(self.dropped_caveat());
        read.chain(self.warnings.iter().cloned()).chain(self.held_caveats()).collect()
    }

    /// Warns about joints that the robot does not have.
    fn dropped_caveat(&self) -> Option<Finding> {
        let file = self.path.display().to_string();
        let names: Vec<String> = self.dropped.iter().map(|name| format!("{name:?}")).collect();
        let message = format!("{file}: joints that the robot does not have are left out: {}", names.join(", "));
        let help = "a gripper is one; a joint of the arm is not";
        (!names.is_empty()).then(|| Finding::warning("motion-dropped-joints", &file, message, help))
    }

    /// Caveats about held joints: a note for positions given in the robot file, a warning for
    /// assumed ones.
    fn held_caveats(&self) -> Vec<Finding> {
        let (given, assumed): (Vec<&HeldJoint>, Vec<&HeldJoint>) = self.held.iter().partition(|held| held.given);
        let file = self.path.display().to_string();
        let note = |held: &[&HeldJoint], end: &str| {
            let places: Vec<String> = held.iter().map(|held| format!("{:?} at {}", held.joint, held.at)).collect();
            let places = places.join(", ");
            let message = format!("{file}: joints that the motion does not name are held: {places}{end}");
            Finding::warning("held-joints", &file, message, "name them in the motion to move them")
        };
        let assumed =
            (!assumed.is_empty()).then(|| note(&assumed, " ([hold] in the robot file says where, in rad or m)"));
        let given = (!given.is_empty()).then(|| note(&given, "").as_note());
        assumed.into_iter().chain(given).collect()
    }

    /// Returns the motion in the form that steppers use.
    pub fn prescribed(&self) -> Arc<dyn PrescribedMotion> {
        Arc::new(AlongTrajectory(self.trajectory.clone()))
    }
}

/// Returns the warnings about a trajectory with messages that start with the place in its file, or
/// with the file.
pub(crate) fn warnings(trajectory: &Trajectory, path: &Path) -> Vec<Finding> {
    let file = path.display().to_string();
    let placed = |found: Finding| {
        let location = if found.location.is_empty() { file.clone() } else { found.location };
        let place = if location.starts_with(&file) { &location } else { &file };
        Finding { message: format!("{place}: {}", found.message), location, ..found }
    };
    trajectory.warnings().into_iter().map(placed).collect()
}
