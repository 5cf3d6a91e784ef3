//! Report on a motion: peaks and limits, torques of the rigid robot, TCP path and curves; also
//! converts the motion to other formats.
//!
//! Start at [`motion_report`]. SI units, joints in coordinate order, TCP in world axes. Not here:
//! reading motions (`motion_formats`), the search for exceeded limits and the sentences about them
//! (`flexarm_trajectory::LimitViolation`).

use std::path::{Path, PathBuf};

use flexarm_draw::{CurveLook, LinePlot, Panel, PlotCurve};
use flexarm_files::{check_apart, check_free, write_all};
use flexarm_kinematics::{Data, Model, State, forward_kinematics, inverse_dynamics};
use flexarm_motion_io::{TextFormat, write_joint_trajectory};
use flexarm_settings::Setting;
use flexarm_trajectory::{Extreme, JointLimits, JointPeak, LimitKind, LimitViolation, Trajectory, TrajectoryError};
use nalgebra::{DVector, Vector3};
use serde::Serialize;

use crate::caveat;
use crate::error::Error;
use crate::motions::motion::{self, Motion};
use crate::motions::motion_formats::{self, MotionFile, MotionOptions, ReadMotion};
use crate::robot::{Robot, tcp_frame};

/// Number of equal time intervals at which torques and TCP positions are evaluated; even.
const TIMES: usize = 4000;
/// Number of intervals of the curves.
const CURVE_POINTS: usize = 600;
/// Relative tolerance on a torque limit.
const SLACK: f64 = 1e-9;
/// Relative tolerance on a jerk limit, to which the planner keeps it.
const JERK_SLACK: f64 = 1e-3;

/// Result of `flexarm motion`. SI units; angles in rad.
#[derive(Clone, Debug, Default, Serialize)]
pub struct MotionReport {
    /// Path of the motion file.
    pub motion: String,
    /// Description of the format.
    pub format: String,
    /// Topic, if the file is a bag.
    pub topic: Option<String>,
    /// Name of the robot, if one was given.
    pub robot: Option<String>,
    /// Joints: those of the robot in coordinate order; without a robot, those of the file.
    pub joints: Vec<String>,
    /// Joints of the robot that the file does not contain; they are held.
    pub held: Vec<String>,
    /// Joints in the file that the robot does not have; they are ignored.
    pub dropped: Vec<String>,
    /// Duration (s).
    pub duration_s: f64,
    /// Number of rows, messages or points in the file; null for waypoints.
    pub samples: Option<usize>,
    /// Extreme values of each joint.
    pub peaks: Vec<MotionPeak>,
    /// Exceeded limits, with a robot.
    pub violations: Vec<MotionViolation>,
    /// Length of the TCP path (m), with a robot.
    pub tcp_length_m: Option<f64>,
    /// Maximum TCP speed (m/s), with a robot.
    pub tcp_speed_m_s: Option<f64>,
    /// Warnings.
    pub warnings: Vec<String>,
    /// Notes on automatic choices that need no attention.
    pub notes: Vec<String>,
    /// Written files.
    pub files: MotionFiles,
    /// Positions over time, for drawing.
    #[serde(skip)]
    pub curves: Vec<MotionCurve>,
}

/// Extreme values of a joint, with their times (s); limits are null where there are none.
#[derive(Clone, Debug, Serialize)]
pub struct MotionPeak {
    /// Joint name.
    pub joint: String,
    /// `rad`, `m`, or `rad or m` without a robot.
    pub unit: &'static str,
    /// Minimum position.
    pub lower: f64,
    /// Time of the minimum (s).
    pub lower_at_s: f64,
    /// Lower limit.
    pub lower_limit: Option<f64>,
    /// Maximum position.
    pub upper: f64,
    /// Time of the maximum (s).
    pub upper_at_s: f64,
    /// Upper limit.
    pub upper_limit: Option<f64>,
    /// Velocity of largest magnitude, signed.
    pub speed: f64,
    /// Time of the peak velocity (s).
    pub speed_at_s: f64,
    /// Velocity limit.
    pub speed_limit: Option<f64>,
    /// Acceleration of largest magnitude, signed.
    pub acceleration: f64,
    /// Time of the peak acceleration (s).
    pub acceleration_at_s: f64,
    /// Acceleration limit.
    pub acceleration_limit: Option<f64>,
    /// Jerk of largest magnitude, excluding jumps of the acceleration.
    pub jerk: f64,
    /// Time of the peak jerk (s).
    pub jerk_at_s: f64,
    /// Jerk limit, of a path file or else of the robot.
    pub jerk_limit: Option<f64>,
    /// Maximum jump of the acceleration.
    pub acceleration_jump: f64,
    /// Torque or force of largest magnitude that the rigid robot with its payload needs (N m, N),
    /// with a robot.
    pub torque: Option<f64>,
    /// Time of the peak torque (s).
    pub torque_at_s: Option<f64>,
    /// Effort limit.
    pub torque_limit: Option<f64>,
}

/// An exceeded limit.
#[derive(Clone, Debug, Serialize)]
pub struct MotionViolation {
    /// Joint name.
    pub joint: String,
    /// `lower`, `upper`, `velocity`, `acceleration`, `jerk` or `effort`.
    pub kind: &'static str,
    /// Time of the largest excess (s).
    pub time_s: f64,
    /// Time at which the limit is first exceeded (s).
    pub since_s: f64,
    /// Value at the largest excess.
    pub value: f64,
    /// Limit.
    pub limit: f64,
    /// The violation as a sentence.
    pub message: String,
}

/// Written files.
#[derive(Clone, Debug, Default, Serialize)]
pub struct MotionFiles {
    /// Motion files in other formats.
    pub motions: Vec<String>,
    /// Plots of the curves.
    pub plots: Vec<String>,
}

/// Position of a joint over time.
#[derive(Clone, Debug)]
pub struct MotionCurve {
    /// Joint name.
    pub joint: String,
    /// Positions (rad or m) at equal time intervals from start to end.
    pub position: Vec<f64>,
}

/// Reports on a motion, on a robot if one is given, and writes it in the formats given by the
/// extensions of `outputs`: `.csv`, `.toml`, `.yaml` (`.yml`), `.json`, and `.svg` for curves.
///
/// * `rate_hz`: rows or points per second in the written files.
///
/// # Errors
/// As [`Motion::load_with`]; [`Error::File`] for an unknown extension, [`Error::Taken`] and
/// [`Error::Write`]; [`Error::Trajectory`] for an invalid rate.
pub fn motion_report(
    path: &Path,
    robot: Option<&Robot>,
    options: &MotionOptions,
    outputs: &[PathBuf],
    rate_hz: f64,
    overwrite: bool,
) -> Result<MotionReport, Error> {
    // Refuse bad outputs before the motion is computed.
    for output in outputs {
        Target::of(output)?;
    }
    let of_robot = robot.iter().flat_map(|robot| [&*robot.path, &*robot.urdf_path]);
    check_apart(outputs, &of_robot.chain([path]).collect::<Vec<_>>())?;
    check_free(outputs, overwrite)?;
    let (mut report, trajectory, torques) = match robot {
        Some(robot) => on_robot(path, robot, options)?,
        None => alone(path, options)?,
    };
    report.curves = curves(&trajectory);
    // Texts of all outputs, then all files at once.
    let mut files = Vec::new();
    for output in outputs {
        let target = Target::of(output)?;
        files.push((output.clone(), target.text(&report, &trajectory, &torques, rate_hz)?));
        let shown = output.display().to_string();
        if target == Target::Plot { report.files.plots.push(shown) } else { report.files.motions.push(shown) }
    }
    write_all(&files)?;
    Ok(report)
}

/// Reports on a motion without a robot.
fn alone(path: &Path, options: &MotionOptions) -> Result<(MotionReport, Trajectory, Torques), Error> {
    let file = MotionFile { path, joints: None, limits: &[], options, cell: None, text: None };
    let ReadMotion { trajectory, format, topic, samples, dropped, caveats, .. } = motion_formats::read(&file)?;
    let own = motion::warnings(&trajectory, path);
    let (warnings, notes) = messages(&[caveats, own].concat());
    let peaks = trajectory.peak().iter().map(|peak| of_joint(peak, "rad or m", &JointLimits::UNLIMITED)).collect();
    let report = MotionReport {
        motion: path.display().to_string(),
        format,
        topic,
        joints: trajectory.joints().to_vec(),
        dropped,
        duration_s: trajectory.duration(),
        samples,
        peaks,
        warnings,
        notes,
        ..MotionReport::default()
    };
    Ok((report, trajectory, Torques::default()))
}

/// Splits caveats into the messages of warnings and of notes.
fn messages(caveats: &[caveat::Finding]) -> (Vec<String>, Vec<String>) {
    let (notes, warnings): (Vec<_>, Vec<_>) =
        caveats.iter().partition(|caveat| caveat.severity == caveat::Severity::Note);
    let text = |caveats: Vec<&caveat::Finding>| caveats.into_iter().map(|c| c.message.clone()).collect::<Vec<_>>();
    (text(warnings), text(notes))
}

/// Reports on a motion of a robot.
fn on_robot(path: &Path, robot: &Robot, options: &MotionOptions) -> Result<(MotionReport, Trajectory, Torques), Error> {
    let motion = Motion::load_with(path, robot, options)?;
    let model = robot.rigid_model()?;
    let trajectory = (*motion.trajectory).clone();
    let actuated = &model.coordinates()[..model.n_actuated()];
    crate::robot::loops::along_motion(&model, &trajectory)?;
    let torques = torques(&trajectory, &model);
    let mut caveats = caveat::of_use::of_robot(robot)?;
    let violations = |caveat: &caveat::Finding| caveat.code == "joint-limit"; // in `violations`
    caveats.extend(caveat::of_use::of_motion(&motion, &model).into_iter().filter(|caveat| !violations(caveat)));
    let (warnings, notes) = messages(&caveats);

    // Peaks beside their limits. A path file may give jerk limits of its own.
    let limits = crate::motions::motion::limits(&model);
    let mut peaks = Vec::new();
    let mut violations = motion.violations.clone();
    for (k, (peak, c)) in trajectory.peak().iter().zip(actuated).enumerate() {
        let worst = torques.peak(k);
        let (torque, torque_at_s) = (Some(worst.value), Some(worst.time_s));
        let unit = c.unit();
        let own = of_joint(peak, unit, &limits[k]);
        let planned = motion.tool_path.as_ref().and_then(|path| path.jerk_of(&c.joint));
        violations.extend(planned.and_then(|limit| of_jerk(peak, limit)));
        let jerk_limit = planned.or(own.jerk_limit);
        peaks.push(MotionPeak { torque, torque_at_s, torque_limit: finite(c.limits.effort), jerk_limit, ..own });
        violations.extend(torques.violation(k, &c.joint, c.limits.effort));
    }
    let violations = violations.iter().map(MotionViolation::from).collect();
    let (length, speed) = length_and_speed_of_tcp(&trajectory, &model);
    let report = MotionReport {
        motion: path.display().to_string(),
        format: motion.format.clone(),
        topic: motion.topic.clone(),
        robot: Some(robot.name.clone()),
        joints: trajectory.joints().to_vec(),
        held: motion.held.iter().map(|held| held.joint.clone()).collect(),
        dropped: motion.dropped.clone(),
        duration_s: trajectory.duration(),
        samples: motion.samples,
        peaks,
        violations,
        tcp_length_m: Some(length),
        tcp_speed_m_s: Some(speed),
        warnings,
        notes,
        ..MotionReport::default()
    };
    Ok((report, trajectory, torques))
}

/// Returns a limit, if there is one.
fn finite(limit: f64) -> Option<f64> {
    limit.is_finite().then_some(limit)
}

/// Returns the peaks of a joint beside its limits, without torques.
fn of_joint(peak: &JointPeak, unit: &'static str, limits: &JointLimits) -> MotionPeak {
    MotionPeak {
        joint: peak.joint.clone(),
        unit,
        lower: peak.lower.value,
        lower_at_s: peak.lower.time_s,
        lower_limit: finite(limits.lower),
        upper: peak.upper.value,
        upper_at_s: peak.upper.time_s,
        upper_limit: finite(limits.upper),
        speed: peak.velocity.value,
        speed_at_s: peak.velocity.time_s,
        speed_limit: finite(limits.velocity),
        acceleration: peak.acceleration.value,
        acceleration_at_s: peak.acceleration.time_s,
        acceleration_limit: finite(limits.acceleration),
        jerk: peak.jerk.value,
        jerk_at_s: peak.jerk.time_s,
        jerk_limit: finite(limits.jerk),
        acceleration_jump: peak.acceleration_jump.value,
        torque: None,
        torque_at_s: None,
        torque_limit: None,
    }
}

impl From<&LimitViolation> for MotionViolation {
    fn from(violation: &LimitViolation) -> Self {
        let LimitViolation { joint, kind, time_s, since_s, value, limit } = violation.clone();
        let kind = match kind {
            LimitKind::Lower => "lower",
            LimitKind::Upper => "upper",
            LimitKind::Velocity => "velocity",
            LimitKind::Acceleration => "acceleration",
            LimitKind::Jerk => "jerk",
            LimitKind::Effort => "effort",
        };
        Self { joint, kind, time_s, since_s, value, limit, message: violation.warning().message }
    }
}

/// Returns a violation if the peak jerk exceeds its limit.
fn of_jerk(peak: &JointPeak, limit: f64) -> Option<LimitViolation> {
    let Extreme { time_s, value } = peak.jerk;
    let (joint, kind, since_s) = (peak.joint.clone(), LimitKind::Jerk, time_s);
    let is_over = value.abs() > limit * (1.0 + JERK_SLACK);
    is_over.then_some(LimitViolation { joint, kind, time_s, since_s, value, limit })
}

/// Torques of the rigid robot over time.
#[derive(Default)]
struct Torques {
    times: Vec<f64>,
    /// One list per joint (N m, N).
    values: Vec<Vec<f64>>,
}

/// Computes τ = M(q) q̈ + bias(q, q̇) at equal time intervals along the motion, and at each kink
/// where the acceleration jumps.
fn torques(trajectory: &Trajectory, model: &Model) -> Torques {
    let n = model.nv();
    let (mut data, mut state, mut a) = (Data::new(model), State::zeros(model), DVector::zeros(n));
    let duration = trajectory.duration();
    let mut times: Vec<f64> = (0..=TIMES).map(|i| duration * i as f64 / TIMES as f64).collect();
    times.extend(trajectory.kinks().into_iter().take(10 * TIMES));
    times.sort_unstable_by(f64::total_cmp);
    let mut values = vec![Vec::with_capacity(times.len()); model.n_actuated()];
    for &t in &times {
        trajectory.sample(t, state.q.as_mut_slice(), state.qdot.as_mut_slice(), a.as_mut_slice());
        inverse_dynamics(model, &mut data, &state, &a);
        values.iter_mut().enumerate().for_each(|(k, values)| values.push(data.tau[k]));
    }
    Torques { times, values }
}

impl Torques {
    /// Returns the torque of largest magnitude of joint `k`.
    fn peak(&self, k: usize) -> Extreme {
        let zero = Extreme { time_s: 0.0, value: 0.0 };
        self.times.iter().zip(&self.values[k]).fold(zero, |worst, (&time_s, &value)| {
            if value.abs() > worst.value.abs() { Extreme { time_s, value } } else { worst }
        })
    }

    /// Returns a violation if joint `k` exceeds its limit.
    fn violation(&self, k: usize, joint: &str, limit: f64) -> Option<LimitViolation> {
        let worst = self.peak(k);
        let over = |value: f64| value.abs() > limit * (1.0 + SLACK);
        let since = self.times.iter().zip(&self.values[k]).find(|(_, value)| over(**value)).map(|(t, _)| *t);
        of_effort(joint, &worst, since.unwrap_or(worst.time_s), limit)
    }
}

/// Returns a violation if a torque or force exceeds its limit (N m or N).
///
/// * `worst`: torque of largest magnitude. `since_s`: time at which the limit is first exceeded
///   (s).
/// * `limit`: no limit if infinite or NaN.
pub fn of_effort(joint: &str, worst: &Extreme, since_s: f64, limit: f64) -> Option<LimitViolation> {
    let Extreme { time_s, value } = *worst;
    let (joint, kind) = (joint.to_owned(), LimitKind::Effort);
    let is_over = value.abs() > limit * (1.0 + SLACK);
    is_over.then_some(LimitViolation { joint, kind, time_s, since_s, value, limit })
}

/// Computes the length of the TCP path (m) and the maximum TCP speed (m/s) from chords. The length
/// is extrapolated from chords of one and two steps (error of fourth order in the step).
fn length_and_speed_of_tcp(trajectory: &Trajectory, model: &Model) -> (f64, f64) {
    let (mut data, tcp) = (Data::new(model), tcp_frame(model));
    let n = model.nv();
    let (mut q, mut v, mut a) = (DVector::zeros(n), vec![0.0; n], vec![0.0; n]);
    let step = trajectory.duration() / TIMES as f64;
    let p_WT: Vec<Vector3<f64>> = (0..=TIMES)
        .map(|i| {
            trajectory.sample(step * i as f64, q.as_mut_slice(), &mut v, &mut a);
            forward_kinematics(model, &mut data, &q);
            data.X_WF(&tcp).translation.vector
        })
        .collect();
    let chords: Vec<f64> = p_WT.windows(2).map(|pair| (pair[1] - pair[0]).norm()).collect();
    let fine: f64 = chords.iter().sum();
    let coarse: f64 = p_WT.iter().step_by(2).zip(p_WT.iter().skip(2).step_by(2)).map(|(p, q)| (q - p).norm()).sum();
    let speed = chords.iter().fold(0.0, |most: f64, chord| most.max(chord / step));
    (fine + (fine - coarse) / 3.0, speed)
}

/// Returns the positions of the joints at equal time intervals.
fn curves(trajectory: &Trajectory) -> Vec<MotionCurve> {
    let sampled = sampled(trajectory, CURVE_POINTS);
    let curve = |(k, joint): (usize, &String)| MotionCurve {
        joint: joint.clone(),
        position: sampled.iter().map(|(_, q, _)| q[k]).collect(),
    };
    trajectory.joints().iter().enumerate().map(curve).collect()
}

/// Returns times, positions and velocities at equal time intervals.
fn sampled(trajectory: &Trajectory, points: usize) -> Vec<(f64, Vec<f64>, Vec<f64>)> {
    let n = trajectory.joints().len();
    let mut a = vec![0.0; n];
    let at = |i: usize| {
        let t = trajectory.duration() * i as f64 / points as f64;
        let (mut q, mut v) = (vec![0.0; n], vec![0.0; n]);
        trajectory.sample(t, &mut q, &mut v, &mut a);
        (t, q, v)
    };
    (0..=points).map(at).collect()
}

/// Converts a motion to the formats given by the file extensions: `.csv`, `.toml`, `.yaml`
/// (`.yml`), `.json`.
///
/// * `rate_hz`: rows or points per second.
///
/// Returns each path with its text.
///
/// # Errors
/// [`Error::Value`] for another extension, [`Error::Trajectory`] for an invalid rate.
pub fn motion_texts(
    outputs: &[PathBuf],
    trajectory: &Trajectory,
    rate_hz: f64,
) -> Result<Vec<(PathBuf, Vec<u8>)>, Error> {
    let written =
        |output: &PathBuf| Ok((output.clone(), Target::of_motion(output)?.motion(trajectory, rate_hz)?.into_bytes()));
    outputs.iter().map(written).collect()
}

/// Rejects files whose extension is not a motion format.
///
/// # Errors
/// [`Error::Value`] for the first of them.
pub fn check_motion_outputs(outputs: &[PathBuf]) -> Result<(), Error> {
    outputs.iter().try_for_each(|output| Target::of_motion(output).map(|_| ()))
}

/// Format of a written file.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Target {
    Csv,
    Toml,
    Message(TextFormat),
    Plot,
}

impl Target {
    /// Chooses the format by the file extension.
    fn of(path: &Path) -> Result<Self, Error> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
        match ending.as_str() {
            "csv" => Ok(Self::Csv),
            "toml" => Ok(Self::Toml),
            "yaml" | "yml" => Ok(Self::Message(TextFormat::Yaml)),
            "json" => Ok(Self::Message(TextFormat::Json)),
            "svg" => Ok(Self::Plot),
            _ => {
                let what = format!(
                    "{} writes by the ending of the name: .csv (samples), .toml (waypoints), .yaml or .json \
                     (trajectory_msgs/JointTrajectory), .svg (curves); found {ending:?}",
                    Setting::Output
                );
                Err(Error::Value(format!("{}: {what}", path.display())))
            }
        }
    }

    /// As [`Self::of`], for motion formats only.
    fn of_motion(path: &Path) -> Result<Self, Error> {
        match Self::of(path)? {
            Self::Plot => {
                let what = "a motion is written as .csv, .toml, .yaml or .json; found .svg";
                Err(Error::Value(format!("{}: {what}", path.display())))
            }
            target => Ok(target),
        }
    }

    /// Returns the content of the file.
    fn text(
        self,
        report: &MotionReport,
        trajectory: &Trajectory,
        torques: &Torques,
        rate_hz: f64,
    ) -> Result<String, Error> {
        match self {
            Self::Plot => plot(report, trajectory, torques),
            target => target.motion(trajectory, rate_hz),
        }
    }

    /// Returns the text of a motion; empty for a plot.
    fn motion(self, trajectory: &Trajectory, rate_hz: f64) -> Result<String, Error> {
        match self {
            Self::Csv => {
                let mut bytes = Vec::new();
                trajectory.to_csv(rate_hz, &mut bytes)?;
                Ok(String::from_utf8_lossy(&bytes).into_owned())
            }
            Self::Toml => match trajectory.to_waypoints_toml() {
                Err(TrajectoryError::NotWaypoints { .. }) => Ok(trajectory.to_samples_toml(rate_hz)?),
                written => Ok(written?),
            },
            Self::Message(format) => Ok(write_joint_trajectory(trajectory, rate_hz, format)?),
            Self::Plot => Ok(String::new()),
        }
    }
}

/// Plots positions, velocities and torques over time, one panel per unit.
fn plot(report: &MotionReport, trajectory: &Trajectory, torques: &Torques) -> Result<String, Error> {
    let sampled = sampled(trajectory, 2 * CURVE_POINTS);
    let x: Vec<f64> = sampled.iter().map(|(t, ..)| *t).collect();
    let mut panels: Vec<Panel> = Vec::new();
    // Curves with the same label share a panel.
    let mut put = |label: String, name: &str, x: Vec<f64>, y: Vec<f64>| {
        let curve = PlotCurve { name: name.to_owned(), look: CurveLook::Plain, x, y };
        match panels.iter_mut().find(|panel| panel.label == label) {
            Some(panel) => panel.curves.push(curve),
            None => panels.push(Panel { label, logarithmic: false, legend: true, curves: vec![curve] }),
        }
    };
    // Positions of all joints, then their speeds, then their torques: panels in this order.
    let shown = |unit: &'static str| if unit == "rad" { ("deg", 1f64.to_degrees()) } else { (unit, 1.0) };
    for (k, peak) in report.peaks.iter().enumerate() {
        let (unit, factor) = shown(peak.unit);
        let y = sampled.iter().map(|(_, q, _)| factor * q[k]).collect();
        put(format!("position [{unit}]"), &peak.joint, x.clone(), y);
    }
    for (k, peak) in report.peaks.iter().enumerate() {
        let (unit, factor) = shown(peak.unit);
        let unit = if unit == "rad or m" { "(rad or m)" } else { unit };
        let y = sampled.iter().map(|(.., v)| factor * v[k]).collect();
        put(format!("speed [{unit}/s]"), &peak.joint, x.clone(), y);
    }
    for (k, values) in torques.values.iter().enumerate() {
        let unit = if report.peaks[k].unit == "m" { "force [N]" } else { "torque [N m]" };
        put(unit.to_owned(), &report.peaks[k].joint, torques.times.clone(), values.clone());
    }
    let title = match &report.robot {
        Some(robot) => format!("{} on {robot}", report.motion),
        None => report.motion.clone(),
    };
    let mut notes = vec![format!("{}, {:.4} s", report.format, report.duration_s)];
    notes.extend(report.tcp_length_m.map(|length| format!("path of the tool {length:.4} m")));
    let plot = LinePlot { title: &title, notes: &notes, x_label: "time [s]", panels: &panels, ..LinePlot::default() };
    plot.svg().map_err(|error| Error::motion(report.motion.as_ref(), error.to_string()))
}
