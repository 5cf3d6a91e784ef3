//! Joint commands with which the TCP of a flexible arm follows the pose of the rigid one, found on
//! a model and evaluated on other plants.
//!
//! [`compensate_motion`] runs the motion, corrects the TCP error through the arm linearised along
//! the motion ([`Inversion`]), and repeats this a few times. With [`Method::Static`] each point is
//! corrected to its static equilibrium only. [`static_targets`], [`Inversion`] and [`Shaper`] work
//! on plain values.
//!
//! ```
//! use flexarm_compensate::{CompensateRequest, Method, compensate_motion};
//! use flexarm_run::{Motion, Robot};
//!
//! # std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../../.."))?;
//! let robot = Robot::load("robots/kr210")?;
//! let motion = Motion::load("trajectories/point_to_point.toml", &robot)?;
//! let request = CompensateRequest { method: Method::Static, sweep: false, ..CompensateRequest::default() };
//! let found = compensate_motion(&robot, motion, &request)?;
//! assert!(found.after.rms_m < 0.5 * found.before.rms_m);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![allow(non_snake_case, reason = "monogram notation: X_WL, K_S; see docs/references.md")]
#![cfg_attr(test, allow(clippy::unwrap_used, reason = "a failed unwrap fails the test"))]

mod caveats;
mod error;
mod files;
mod job;
mod judge;
mod limits;
mod page;
mod program;
mod recording;
mod shaped;

use std::path::PathBuf;
use std::sync::Arc;

pub use flexarm_analysis::{
    Inversion, InversionError, Node, NodeServo, OptimalShaper, ShapedMode, Shaper, ShaperError, ShaperKind,
};
use flexarm_settings::Words;
pub use flexarm_stepping::{StaticTargets, TargetError, static_targets};
use flexarm_trajectory::Trajectory;
use serde::Serialize;

pub use error::CompensateError;
use files::Files;
use flexarm_run::caveat::{Use, once_each, warnings};
use flexarm_run::{Arm, Error, Finding, Modelling, Motion, MotionViolation, Robot, RunOptions, Scenario};
use job::{Job, lowest_cutoff_hz};
use judge::{Judge, sweep};
pub use limits::LimitRule;
pub use program::{LeftTarget, ProgramFigures};
use shaped::shaped;
pub use shaped::{ShapedModeFigures, ShaperFigures, Shaping};

/// Time between two samples of the error and two knots of the commands (s).
const SAMPLE_S: f64 = 1e-3;
/// Maximum step size (s): the error is sampled with it.
const LONGEST_STEP_S: f64 = 4e-3;
/// Maximum number of iterations of a request.
const MAX_ITERATIONS: usize = 100;
/// Maximum duration of a motion (s): all of it is held in memory, with a sample per millisecond.
const LONGEST_S: f64 = 600.0;

/// Method of finding commands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Includes inertia, damping and gravity; iterates on the simulation.
    #[default]
    Dynamic,
    /// Includes gravity and constant loads only, point by point.
    Static,
}

impl Words for Method {
    const WORDS: &'static [(&'static str, Self, &'static str)] = &[
        ("dynamic", Self::Dynamic, "Inertia, damping and gravity, iterated on the simulation"),
        ("static", Self::Static, "Gravity and constant loads only, point by point"),
    ];
}

/// Input of [`compensate_motion`].
#[derive(Clone, Debug)]
pub struct CompensateRequest {
    /// Models of links and drives.
    pub modelling: Modelling,
    /// Stepping.
    pub run: RunOptions,
    /// Method of finding commands.
    pub method: Method,
    /// Selection of the TCP components x, y, z, rx, ry, rz (world axes) to correct.
    pub components: [bool; 6],
    /// Maximum number of iterations of the dynamic method.
    pub iterations: usize,
    /// Cutoff frequency of the correction (Hz); default: the limit of validity of the inverse.
    pub cutoff_hz: Option<f64>,
    /// Shaper of the modes at the end of the motion, through which the motion is run first.
    pub shaper: Option<Shaping>,
    /// Another robot as plant, with its name.
    pub plant: Option<(String, Robot)>,
    /// Whether to evaluate the commands on perturbed plants as well.
    pub sweep: bool,
    /// Acceleration limit of each joint (rad/s² or m/s²), in coordinate order; empty for no check.
    pub accelerations: Vec<f64>,
    /// Treatment of commands that violate a limit which the motion itself keeps.
    pub limits: LimitRule,
    /// Folder of the new motion, the page and the recording; `None` writes none of them.
    pub output: Option<PathBuf>,
    /// Additional files of the new motion, by extension: `.csv`, `.toml`, `.yaml` and `.json`.
    pub motions: Vec<PathBuf>,
    /// Whether to write a recording of the arm before and after (`.rrd`), if this process can write
    /// it.
    pub recording: bool,
    /// Whether to overwrite existing files.
    pub overwrite: bool,
}

impl Default for CompensateRequest {
    fn default() -> Self {
        Self {
            modelling: Modelling::default(),
            run: RunOptions { log_rate_hz: 1.0 / SAMPLE_S, ..RunOptions::default() },
            method: Method::default(),
            components: [true; 6],
            iterations: 5,
            cutoff_hz: None,
            shaper: None,
            plant: None,
            sweep: true,
            accelerations: Vec::new(),
            limits: LimitRule::default(),
            output: None,
            motions: Vec::new(),
            recording: true,
            overwrite: false,
        }
    }
}

/// Error of the TCP over a run.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ErrorFigures {
    /// Maximum distance from the rigid arm's TCP (m).
    pub peak_m: f64,
    /// RMS distance (m).
    pub rms_m: f64,
    /// Maximum rotation relative to the rigid arm's TCP (rad).
    pub peak_rad: f64,
    /// Distance at the end (m).
    pub end_m: f64,
}

impl ErrorFigures {
    /// Returns the reduction of the RMS error as text, such as `97.3 %`, or the factor by which it
    /// increased.
    pub fn reduction_to(&self, after: &Self) -> String {
        let left = after.rms_m / self.rms_m.max(f64::MIN_POSITIVE);
        if left <= 1.0 { format!("{:.2} %", 100.0 * (1.0 - left)) } else { format!("{left:.1} times as large") }
    }
}

/// Result of `flexarm compensate`.
#[derive(Clone, Debug, Serialize)]
pub struct Compensation {
    /// Robot whose model was used to find the commands.
    pub robot: String,
    /// File of the motion.
    pub motion: String,
    /// `dynamic` or `static`.
    pub method: &'static str,
    /// Error of the unchanged motion, on the plant.
    pub before: ErrorFigures,
    /// Error with the new commands, on the plant.
    pub after: ErrorFigures,
    /// Peak error on the model without correction and after each iteration kept (m).
    pub model_peaks_m: Vec<f64>,
    /// Number of iterations kept.
    pub iterations: usize,
    /// Cutoff frequency of the correction (Hz); null for the static method.
    pub cutoff_hz: Option<f64>,
    /// Maximum change of each joint (rad or m).
    pub changes: Vec<JointChange>,
    /// Limits that the new motion violates: positions, speeds and accelerations of the commands,
    /// torques of the run on the plant.
    pub limits: Vec<MotionViolation>,
    /// Factor by which the motion is slowed down to keep limits; 1 if unchanged.
    pub slowed: f64,
    /// Time by which the shaper lengthens the motion (s).
    pub shaper_delay_s: f64,
    /// Shaper, if there is one.
    pub shaper: Option<ShaperFigures>,
    /// Results of the same commands on other plants.
    pub plants: Vec<PlantFigures>,
    /// New motion (.csv).
    pub file: Option<String>,
    /// Additional files of the new motion.
    pub files: Vec<String>,
    /// Recording of the arm before and after (.rrd).
    pub recording: Option<String>,
    /// Robot program with corrected targets, for motions read from a program (KRL, RAPID).
    pub program: Option<ProgramFigures>,
    /// Page.
    pub page: Option<String>,
    /// Messages of the caveats.
    pub warnings: Vec<String>,
    /// Caveats.
    pub caveats: Vec<Finding>,
    /// The commands, for callers in the same process.
    #[serde(skip)]
    pub trajectory: Arc<Trajectory>,
    /// Distance between flexible and rigid TCP over time on the plant: time (s), before (m), after
    /// (m).
    #[serde(skip)]
    pub curves: Vec<[f64; 3]>,
}

/// Change of a joint's commands.
#[derive(Clone, Debug, Serialize)]
pub struct JointChange {
    /// Name of the joint.
    pub joint: String,
    /// Maximum change (rad or m).
    pub largest: f64,
}

/// Result of the commands on a plant other than the model.
#[derive(Clone, Debug, Serialize)]
pub struct PlantFigures {
    /// Description of the plant.
    pub plant: String,
    /// Error of the unchanged motion.
    pub before: ErrorFigures,
    /// Error with the new commands.
    pub after: ErrorFigures,
}

/// Finds commands for a motion and evaluates them. Loads and payloads of the scenario act in all
/// runs.
///
/// # Errors
/// [`CompensateError`]; otherwise as [`flexarm_run::Arm::simulate`].
pub fn compensate_motion(
    robot: &Robot,
    scenario: impl Into<Scenario>,
    request: &CompensateRequest,
) -> Result<Compensation, Error> {
    compensate_motion_until(robot, scenario, request, &|| false)
}

/// Callback that returns whether to stop.
type Stop<'a> = &'a (dyn Fn() -> bool + Sync);

/// Same as [`compensate_motion`]; as soon as `stop` returns true, it ends with
/// [`Error::Interrupted`], and nothing is written.
///
/// # Errors
/// As [`compensate_motion`]; [`Error::Interrupted`] if stopped.
pub fn compensate_motion_until(
    robot: &Robot,
    scenario: impl Into<Scenario>,
    request: &CompensateRequest,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Compensation, Error> {
    let scenario = scenario.into();
    let files = Files::of(&scenario.motion, request)?;
    let arm = robot.model(&request.modelling)?;
    check(&scenario, request, &arm)?;
    let (mut answer, found) = limits::kept(robot, &arm, &scenario, request, stop)?;
    answer.caveats.extend(arm.caveats(Use::Along(&scenario)));
    answer.caveats = once_each(std::mem::take(&mut answer.caveats));
    let program = files.program(robot, &arm, &scenario, request, &mut answer);
    answer.warnings = warnings(&answer.caveats);
    files.write(&mut answer, &arm, &found, program, request)?;
    Ok(answer)
}

/// The motions before and after, for files.
struct MotionPair {
    /// Requested scenario, slowed and shaped.
    scenario: Scenario,
    /// New motion.
    motion: Motion,
}

/// Finds commands for a motion without slowing it.
fn attempt(
    robot: &Robot,
    arm: &Arc<Arm>,
    scenario: &Scenario,
    request: &CompensateRequest,
    stop: Stop<'_>,
) -> Result<(Compensation, MotionPair, Vec<MotionViolation>), Error> {
    let (motion, shaper) = match request.shaper {
        Some(shaping) => shaped(arm, scenario, shaping).map(|(motion, figures)| (motion, Some(figures)))?,
        None => (scenario.motion.clone(), None),
    };
    let scenario = Scenario { motion, ..scenario.clone() };
    let job = Job::new(arm, &scenario, request, stop)?;
    let found = match request.method {
        Method::Dynamic => job.dynamic()?,
        Method::Static => job.at_rest()?,
    };
    // Errors on the plant, before and after, and the limits that each of them violates.
    let judge = Judge::of(request, arm)?;
    let as_it_is = job.as_it_is()?;
    let before = judge.figures(&job, &as_it_is)?;
    let after = judge.figures(&job, &found.motion)?;
    let limits = limits::passed(robot, &found.motion, &after.efforts, request)?;
    let own = limits::passed(robot, &scenario.motion, &before.efforts, request)?;
    // Results that will be refused or computed again are not evaluated on other plants.
    let kept = request.limits == LimitRule::Tell || limits::worse(&limits, &own).next().is_none();
    let plants = if request.sweep && kept { sweep(robot, request, &job, arm, &found.motion)? } else { Vec::new() };
    // The result.
    let change = |(k, joint): (usize, &str)| JointChange { joint: joint.into(), largest: found.change.row(k).amax() };
    let curves = job.times.iter().zip(before.distance.iter().zip(&after.distance)).map(|(t, (a, b))| [*t, *a, *b]);
    let mut answer = Compensation {
        robot: robot.name.clone(),
        motion: flexarm_run::record::straight(&scenario.motion.path),
        method: if request.method == Method::Dynamic { "dynamic" } else { "static" },
        before: before.figures,
        after: after.figures,
        model_peaks_m: found.peaks.clone(),
        iterations: found.kept,
        cutoff_hz: found.cutoff_hz,
        changes: arm.joints().enumerate().map(change).collect(),
        limits,
        slowed: 1.0,
        shaper_delay_s: shaper.iter().flat_map(|shaper| &shaper.copies).map(|copy| copy[0]).fold(0.0, f64::max),
        shaper,
        plants,
        file: None,
        files: Vec::new(),
        recording: None,
        program: None,
        page: None,
        warnings: Vec::new(),
        caveats: Vec::new(),
        trajectory: found.motion.trajectory.clone(),
        curves: curves.collect(),
    };
    answer.caveats = caveats::of(&answer, &own, robot, &found, request);
    answer.caveats.extend(caveats::of_servos(&judge.arm, &after.efforts));
    let motion = found.motion;
    Ok((answer, MotionPair { scenario, motion }, own))
}

/// Checks the request against motion and arm: numbers in their ranges, joints, something that yields.
fn check(scenario: &Scenario, request: &CompensateRequest, arm: &Arc<Arm>) -> Result<(), CompensateError> {
    let value = |what: &str, found: f64, expected: &str| {
        CompensateError::Input(format!("{what} is {found}, expected {expected}"))
    };
    // Components, cutoff, step and duration.
    let motion = &scenario.motion;
    if !request.components.contains(&true) {
        return Err(CompensateError::Input(
            "no TCP component is selected: select at least one of x, y, z, rx, ry, rz".into(),
        ));
    }
    if let Some(hz) = request.cutoff_hz.filter(|hz| !(hz.is_finite() && *hz > 0.0)) {
        return Err(value("the cutoff", hz, "a positive frequency (Hz)"));
    }
    let found = request.run.step_s;
    if !(found > 0.0 && found <= LONGEST_STEP_S) {
        return Err(value("the step", found, "a time of at most 0.004 s"));
    }
    if let Some(hz) = request.cutoff_hz.filter(|hz| *hz > 0.5 / found) {
        let expected = "at most half the number of steps per second (Hz)";
        return Err(value("the cutoff", hz, expected));
    }
    if let Some(hz) = request.cutoff_hz.filter(|hz| *hz < lowest_cutoff_hz(&motion.trajectory)) {
        let expected = "at least one period in the duration of the motion (Hz)";
        return Err(value("the cutoff", hz, expected));
    }
    let found = motion.trajectory.duration();
    if found > LONGEST_S {
        return Err(value("the duration of the motion", found, "at most 600 s"));
    }
    if request.iterations > MAX_ITERATIONS {
        let found = request.iterations as f64;
        return Err(value("the number of iterations", found, "at most 100"));
    }
    // Limits and payloads, and whether anything in the arm is elastic.
    let (found, expected) = (request.accelerations.len(), arm.joints().count());
    if found != 0 && found != expected {
        return Err(CompensateError::Input(format!(
            "{found} acceleration limits for a robot of {expected} joints: expected one per joint"
        )));
    }
    if let Some(found) = request.accelerations.iter().copied().find(|limit| limit.is_nan() || *limit <= 0.0) {
        let expected = "a positive number (rad/s2 or m/s2)";
        return Err(value("an acceleration limit", found, expected));
    }
    if let Some(change) = scenario.payloads.iter().find(|change| request.method == Method::Static && change.at_s > 0.0)
    {
        let message = format!(
            "the payload changes at {at_s} s, but the static method supports only one payload: use the dynamic \
             method, or compensate each part of the motion separately",
            at_s = change.at_s
        );
        return Err(CompensateError::Input(message));
    }
    if arm.springs.is_empty() && !arm.has_servo() {
        return Err(CompensateError::nothing_yields());
    }
    // Static equilibria do not depend on velocities, so the static method accepts velocity jumps.
    match motion.trajectory.velocity_jumps().first() {
        Some(jump) if request.method == Method::Dynamic => Err(CompensateError::Input(format!(
            "the velocity jumps at {t_s} s, which the dynamic method cannot correct: start and end the motion at \
             rest and blend its corners, or use the static method",
            t_s = jump.time_s
        ))),
        _ => Ok(()),
    }
}
