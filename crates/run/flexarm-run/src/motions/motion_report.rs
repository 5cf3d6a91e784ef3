//! Report on a motion: peaks and limits, torques of the rigid robot, TCP path and curves; also
//! converts the motion to other formats.

use std::path::{Path, PathBuf};

use flexarm_draw::{CurveLook, LinePlot, Panel, PlotCurve};
use flexarm_files::{check_apart, check_free, write_all};
use flexarm_kinematics::{Data, Model, State, forward_kinematics, inverse_dynamics};
use flexarm_motion_io::{TextFormat, write_joint_trajectory};
use flexarm_settings::Setting;
use flexarm_trajectory::{Extreme, JointLimits, JointPeak, LimitKind, Trajectory, TrajectoryError};
use nalgebra::{DVector, Vector3};
use serde::Serialize;

use crate::caveat;
use crate::error::Error;
use crate::motions::motion::Motion;
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
#[derive(Clone, Debug, Serialize)]
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
    let own = trajectory.warnings().iter().map(|warning| format!("{}: {warning}", path.display())).collect();
    let (warnings, notes) = messages(&caveats, own);
    let peaks = trajectory.peak().iter().map(|peak| of_joint(peak, "rad or m", &JointLimits::UNLIMITED)).collect();
    let report = MotionReport {
        motion: path.display().to_string(),
        format,
        topic,
        robot: None,
        joints: trajectory.joints().to_vec(),
        held: Vec::new(),
        dropped,
        duration_s: trajectory.duration(),
        samples,
        peaks,
        violations: Vec::new(),
        tcp_length_m: None,
        tcp_speed_m_s: None,
        warnings,
        notes,
        files: MotionFiles::default(),
        curves: Vec::new(),
    };
    Ok((report, trajectory, Torques::default()))
}

/// Splits caveats into the messages of warnings and of notes.
fn messages(caveats: &[caveat::Finding], own: Vec<String>) -> (Vec<String>, Vec<String>) {
    let (notes, warnings): (Vec<_>, Vec<_>) =
        caveats.iter().partition(|caveat| caveat.severity == caveat::Severity::Note);
    let text = |caveats: Vec<&caveat::Finding>| caveats.into_iter().map(|c| c.message.clone()).collect::<Vec<_>>();
    let mut warnings = text(warnings);
    warnings.extend(own.into_iter().filter(|text| !warnings.contains(text)).collect::<Vec<_>>());
    (warnings, text(notes))
}

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
    let (warnings, notes) = messages(&caveats, Vec::new());

    let limit = |x: f64| x.is_finite().then_some(x);
    let limits = crate::motions::motion::limits(&model);
    let mut peaks = Vec::new();
    let mut violations: Vec<MotionViolation> = motion.violations.iter().map(of_limit).collect();
    for (k, (peak, c)) in trajectory.peak().iter().zip(actuated).enumerate() {
        let worst = torques.peak(k);
        let (torque, torque_at_s) = (Some(worst.value), Some(worst.time_s));
        let unit = c.unit();
        let own = of_joint(peak, unit, &limits[k]);
        let planned = motion.tool_path.as_ref().and_then(|path| path.jerk_of(&c.joint));
        violations.extend(planned.and_then(|limit| of_jerk(peak, limit)));
        let jerk_limit = planned.or(own.jerk_limit);
        peaks.push(MotionPeak { torque, torque_at_s, torque_limit: limit(c.limits.effort), jerk_limit, ..own });
        violations.extend(torques.violation(k, &c.joint, c.limits.effort));
    }
    let (length, speed) = way_of_tool(&trajectory, &model);
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
        files: MotionFiles::default(),
        curves: Vec::new(),
    };
    Ok((report, trajectory, torques))
}

fn of_joint(peak: &JointPeak, unit: &'static str, limits: &JointLimits) -> MotionPeak {
    let limit = |x: f64| x.is_finite().then_some(x);
    MotionPeak {
        joint: peak.joint.clone(),
        unit,
        lower: peak.lower.value,
        lower_at_s: peak.lower.time_s,
        lower_limit: limit(limits.lower),
        upper: peak.upper.value,
        upper_at_s: peak.upper.time_s,
        upper_limit: limit(limits.upper),
        speed: peak.velocity.value,
        speed_at_s: peak.velocity.time_s,
        speed_limit: limit(limits.velocity),
        acceleration: peak.acceleration.value,
        acceleration_at_s: peak.acceleration.time_s,
        acceleration_limit: limit(limits.acceleration),
        jerk: peak.jerk.value,
        jerk_at_s: peak.jerk.time_s,
        jerk_limit: limit(limits.jerk),
        acceleration_jump: peak.acceleration_jump.value,
        torque: None,
        torque_at_s: None,
        torque_limit: None,
    }
}

/// Converts a violated limit of a trajectory.
pub fn of_limit(violation: &flexarm_trajectory::LimitViolation) -> MotionViolation {
    let kind = match violation.kind {
        LimitKind::Lower => "lower",
        LimitKind::Upper => "upper",
        LimitKind::Velocity => "velocity",
        LimitKind::Acceleration => "acceleration",
        LimitKind::Jerk => "jerk",
    };
    MotionViolation {
        joint: violation.joint.clone(),
        kind,
        time_s: violation.time_s,
        since_s: violation.since_s,
        value: violation.value,
        limit: violation.limit,
        message: violation.to_string(),
    }
}

/// Returns a violation if the peak jerk exceeds its limit.
fn of_jerk(peak: &JointPeak, limit: f64) -> Option<MotionViolation> {
    let Extreme { time_s, value } = peak.jerk;
    let message = format!(
        "joint {:?}: jerk exceeds its limit {limit:.4}: {value:.4} at t = {time_s:.4} s; allow the move more time",
        peak.joint
    );
    let (joint, since_s) = (peak.joint.clone(), time_s);
    (value.abs() > limit * (1.0 + JERK_SLACK)).then_some(MotionViolation {
        joint,
        kind: "jerk",
        time_s,
        since_s,
        value,
        limit,
        message,
    })
}

/// Torques of the rigid robot over time.
#[derive(Default)]
struct Torques {
    times: Vec<f64>,
    /// One list per joint (N m, N).
    values: Vec<Vec<f64>>,
}

/// τ = M(q) q̈ + bias(q, q̇) at equal time intervals along the motion, and at each kink where the
/// acceleration jumps.
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
    fn peak(&self, k: usize) -> Extreme {
        let zero = Extreme { time_s: 0.0, value: 0.0 };
        self.times.iter().zip(&self.values[k]).fold(zero, |worst, (&time_s, &value)| {
            if value.abs() > worst.value.abs() { Extreme { time_s, value } } else { worst }
        })
    }

    fn violation(&self, k: usize, joint: &str, limit: f64) -> Option<MotionViolation> {
        let worst = self.peak(k);
        let over = |value: f64| value.abs() > limit * (1.0 + SLACK);
        let since = self.times.iter().zip(&self.values[k]).find(|(_, value)| over(**value)).map(|(t, _)| *t);
        of_effort(joint, &worst, since.unwrap_or(worst.time_s), limit, "rigid robot with payload, no friction")
    }
}

/// Returns a violation if a torque or force exceeds its limit; `of` names its source.
pub fn of_effort(joint: &str, worst: &Extreme, since_s: f64, limit: f64, of: &str) -> Option<MotionViolation> {
    let Extreme { time_s, value } = *worst;
    if value.abs() <= limit * (1.0 + SLACK) || limit.is_nan() {
        return None;
    }
    let message = format!(
        "joint {joint:?}: effort exceeds its limit {limit:.4}: {value:.4} at t = {time_s:.4} s, first passed at \
         {since_s:.4} s (N m or N, {of}); allow the move more time"
    );
    Some(MotionViolation { joint: joint.to_owned(), kind: "effort", time_s, since_s, value, limit, message })
}

/// Length of the TCP path (m) and maximum TCP speed (m/s), from chords. The length is extrapolated
/// from chords of one and two steps (error of fourth order in the step).
fn way_of_tool(trajectory: &Trajectory, model: &Model) -> (f64, f64) {
    let (mut data, tcp) = (Data::new(model), tcp_frame(model));
    let n = model.nv();
    let (mut q, mut v, mut a) = (DVector::zeros(n), vec![0.0; n], vec![0.0; n]);
    let step = trajectory.duration() / TIMES as f64;
    let places: Vec<Vector3<f64>> = (0..=TIMES)
        .map(|i| {
            trajectory.sample(step * i as f64, q.as_mut_slice(), &mut v, &mut a);
            forward_kinematics(model, &mut data, &q);
            data.X_WF(&tcp).translation.vector
        })
        .collect();
    let chords: Vec<f64> = places.windows(2).map(|pair| (pair[1] - pair[0]).norm()).collect();
    let fine: f64 = chords.iter().sum();
    let coarse: f64 = places.iter().step_by(2).zip(places.iter().skip(2).step_by(2)).map(|(p, q)| (q - p).norm()).sum();
    let speed = chords.iter().fold(0.0, |most: f64, chord| most.max(chord / step));
    (fine + (fine - coarse) / 3.0, speed)
}

fn curves(trajectory: &Trajectory) -> Vec<MotionCurve> {
    let sampled = sampled(trajectory, CURVE_POINTS);
    let curve = |(k, joint): (usize, &String)| MotionCurve {
        joint: joint.clone(),
        position: sampled.iter().map(|(_, q, _)| q[k]).collect(),
    };
    trajectory.joints().iter().enumerate().map(curve).collect()
}

/// Times, positions and velocities at equal time intervals.
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
    let mut put = |label: String, name: &str, x: Vec<f64>, y: Vec<f64>| {
        let curve = PlotCurve { name: name.to_owned(), look: CurveLook::Plain, x, y };
        match panels.iter_mut().find(|panel| panel.label == label) {
            Some(panel) => panel.curves.push(curve),
            None => panels.push(Panel { label, logarithmic: false, legend: true, curves: vec![curve] }),
        }
    };
    for (k, peak) in report.peaks.iter().enumerate() {
        let (unit, factor) = if peak.unit == "rad" { ("deg", 1f64.to_degrees()) } else { (peak.unit, 1.0) };
        put(
            format!("position [{unit}]"),
            &peak.joint,
            x.clone(),
            sampled.iter().map(|(_, q, _)| factor * q[k]).collect(),
        );
    }
    for (k, peak) in report.peaks.iter().enumerate() {
        let (unit, factor) = if peak.unit == "rad" { ("deg", 1f64.to_degrees()) } else { (peak.unit, 1.0) };
        let per_s = if unit == "rad or m" { "(rad or m)" } else { unit };
        put(
            format!("speed [{per_s}/s]"),
            &peak.joint,
            x.clone(),
            sampled.iter().map(|(.., v)| factor * v[k]).collect(),
        );
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
