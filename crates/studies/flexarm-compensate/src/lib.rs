//! Joint commands with which a flexible arm's tool follows the pose of the rigid one, found on a
//! model and judged on others.
//!
//! [`compensate_motion`]: the motion is run, the error of the tool is taken away through the arm linearised along the motion
//! ([`Inversion`]), and the new motion is run again, a few times. At rest ([`Method::Static`]) each
//! point is corrected to its equilibrium alone. [`static_targets`], [`Inversion`] and [`Shaper`]
//! take and give values.
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
#[cfg(feature = "rerun")]
mod recording;
mod shaped;

use std::path::PathBuf;
use std::sync::Arc;

pub use flexarm_analysis::{
    Inversion, InversionError, Node, NodeServo, OptimalShaper, ShapedMode, Shaper, ShaperError, ShaperKind,
};
pub use flexarm_stepping::{StaticTargets, TargetError, static_targets};
use flexarm_trajectory::Trajectory;
use serde::Serialize;

pub use error::CompensateError;
use files::Files;
use flexarm_run::Arm;
use flexarm_run::Caveat;
use flexarm_run::Error;
use flexarm_run::Motion;
use flexarm_run::MotionViolation;
use flexarm_run::Robot;
use flexarm_run::RunOptions;
use flexarm_run::Scenario;
use flexarm_run::caveat::Use;
use flexarm_run::caveat::once_each;
use flexarm_run::caveat::warnings;
use job::Job;
use judge::{Judge, sweep};
pub use limits::LimitRule;
pub use program::{LeftTarget, ProgramFigures};
use shaped::shaped;
pub use shaped::{ShapedModeFigures, ShaperFigures, Shaping};

/// Time between two samples of the error and two knots of the commands (s).
const SAMPLE_S: f64 = 1e-3;
/// Longest step (s): the error is sampled with it.
const LONGEST_STEP_S: f64 = 4e-3;
/// Most iterations that may be asked for.
const MOST_ITERATIONS: usize = 100;
/// Longest motion that is taken (s): all of it is held in memory, a sample a millisecond.
const LONGEST_S: f64 = 600.0;

/// How commands are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Inertia, damping and weight, iterated on the simulation.
    #[default]
    Dynamic,
    /// Weight and constant loads alone, point by point.
    Static,
}

/// What is asked of [`compensate_motion`].
#[derive(Clone, Debug)]
pub struct CompensateRequest {
    /// How it is stepped, and how links and drives are modelled.
    pub run: RunOptions,
    /// How commands are found.
    pub method: Method,
    /// Which of x, y, z, rx, ry, rz of the tool (world axes) count.
    pub components: [bool; 6],
    /// Most iterations of the dynamic method.
    pub iterations: usize,
    /// Highest frequency that is corrected (Hz); as far as the inverse holds without it.
    pub cutoff_hz: Option<f64>,
    /// Also run the motion through a shaper of the modes at its end.
    pub shaper: Option<Shaping>,
    /// Another robot that judges, with its name.
    pub plant: Option<(String, Robot)>,
    /// Judge with stiffness, damping and drives that are off as well.
    pub sweep: bool,
    /// Greatest acceleration of each joint (rad/s² or m/s²), in coordinate order; not looked at
    /// where it is empty.
    pub accelerations: Vec<f64>,
    /// What becomes of commands that pass a limit which the motion itself keeps.
    pub limits: LimitRule,
    /// Folder of the new motion, the page and the recording; nothing is written without it.
    pub output: Option<PathBuf>,
    /// Further files of the new motion, by their endings: `.csv`, `.toml`, `.yaml` and `.json`.
    pub motions: Vec<PathBuf>,
    /// Write a recording of the arm before and after (`.rrd`), if this build can.
    pub recording: bool,
    /// Overwrite what is there.
    pub overwrite: bool,
}

impl Default for CompensateRequest {
    fn default() -> Self {
        Self {
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

/// Error of the tool over a run.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ErrorFigures {
    /// Largest distance from the rigid arm's place (m).
    pub peak_m: f64,
    /// RMS of it (m).
    pub rms_m: f64,
    /// Largest rotation from the rigid arm's (rad).
    pub peak_rad: f64,
    /// Distance at the end (m).
    pub end_m: f64,
}

impl ErrorFigures {
    /// Returns the part of the RMS error that commands take away, in words: `97.3 %`, or how many
    /// times as large they make it.
    pub fn reduction_to(&self, after: &Self) -> String {
        let left = after.rms_m / self.rms_m.max(f64::MIN_POSITIVE);
        if left <= 1.0 { format!("{:.2} %", 100.0 * (1.0 - left)) } else { format!("{left:.1} times as large") }
    }
}

/// Answer of `flexarm compensate`.
#[derive(Clone, Debug, Serialize)]
pub struct Compensation {
    /// The robot whose model found the commands.
    pub robot: String,
    /// The motion.
    pub motion: String,
    /// `dynamic` or `static`.
    pub method: &'static str,
    /// Error with the motion as it is, on the plant.
    pub before: ErrorFigures,
    /// Error with the new commands, on the plant.
    pub after: ErrorFigures,
    /// Peak after each iteration on the model itself, the first without any (m).
    pub model_peaks_m: Vec<f64>,
    /// Iterations that were kept.
    pub iterations: usize,
    /// Highest frequency that was corrected (Hz); null at rest.
    pub cutoff_hz: Option<f64>,
    /// Largest change of each joint (rad or m).
    pub changes: Vec<JointChange>,
    /// Limits that the new motion passes: positions, speeds and accelerations of the commands,
    /// torques of the run on the plant.
    pub limits: Vec<MotionViolation>,
    /// How many times as long the motion takes so that limits are kept; 1 if it is as it was.
    pub slowed: f64,
    /// How much longer the motion takes by its shaper (s).
    pub shaper_delay_s: f64,
    /// The shaper, if there is one.
    pub shaper: Option<ShaperFigures>,
    /// The same commands on other plants.
    pub plants: Vec<PlantFigures>,
    /// The new motion (.csv).
    pub file: Option<String>,
    /// Further files of the new motion.
    pub files: Vec<String>,
    /// The arm before and after (.rrd).
    pub recording: Option<String>,
    /// The robot program with corrected targets, of motions that were read from one (KRL, RAPID).
    pub program: Option<ProgramFigures>,
    /// The page.
    pub page: Option<String>,
    /// What the caveats warn of, as sentences.
    pub warnings: Vec<String>,
    /// What is doubtful.
    pub caveats: Vec<Caveat>,
    /// The commands, for programs in the process.
    #[serde(skip)]
    pub trajectory: Arc<Trajectory>,
    /// Distance of the tool over time, before and after, on the plant: time (s), m, m.
    #[serde(skip)]
    pub curves: Vec<[f64; 3]>,
}

/// How far a joint is commanded away.
#[derive(Clone, Debug, Serialize)]
pub struct JointChange {
    /// Its name.
    pub joint: String,
    /// Largest change (rad or m).
    pub largest: f64,
}

/// The commands on a plant that is not the model.
#[derive(Clone, Debug, Serialize)]
pub struct PlantFigures {
    /// What is different.
    pub plant: String,
    /// With the motion as it is.
    pub before: ErrorFigures,
    /// With the new commands.
    pub after: ErrorFigures,
}

/// Finds commands for a motion, and judges them. Loads and payloads of the scenario act in all
/// runs.
///
/// # Errors
/// [`CompensateError`], and as [`flexarm_run::Arm::simulate`].
pub fn compensate_motion(
    robot: &Robot,
    scenario: impl Into<Scenario>,
    request: &CompensateRequest,
) -> Result<Compensation, Error> {
    compensate_motion_until(robot, scenario, request, &|| false)
}

/// Whether somebody wants a computation to stop.
type Stop<'a> = &'a (dyn Fn() -> bool + Sync);

/// As [`compensate_motion`]; as soon as `stop` says so, it ends with [`Error::Interrupted`], and
/// nothing is written.
///
/// # Errors
/// As [`compensate_motion`]; [`Error::Interrupted`].
pub fn compensate_motion_until(
    robot: &Robot,
    scenario: impl Into<Scenario>,
    request: &CompensateRequest,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Compensation, Error> {
    let scenario = scenario.into();
    let files = Files::of(&scenario.motion, request)?;
    let arm = robot.flexible(request.run.modelling)?;
    check(&scenario, request, &arm)?;
    let (mut answer, found) = limits::kept(robot, &arm, &scenario, request, stop)?;
    answer.caveats.extend(arm.caveats(Use::Along(&scenario)));
    answer.caveats = once_each(std::mem::take(&mut answer.caveats));
    let program = files.program(robot, &arm, &scenario, request, &mut answer);
    answer.warnings = warnings(&answer.caveats);
    files.write(&mut answer, &arm, &found, program, request)?;
    Ok(answer)
}

/// What was found and for what, for files.
#[cfg_attr(not(feature = "rerun"), expect(dead_code, reason = "for recordings alone"))]
struct Found {
    /// What was asked for, slowed and shaped.
    scenario: Scenario,
    /// The new motion.
    motion: Motion,
}

/// Commands for a motion as it is.
fn attempt(
    robot: &Robot,
    arm: &Arm,
    scenario: &Scenario,
    request: &CompensateRequest,
    stop: Stop<'_>,
) -> Result<(Compensation, Found, Vec<MotionViolation>), Error> {
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
    let judge = Judge::of(request, arm)?;
    let as_it_is = job.as_it_is()?;
    let before = judge.figures(&job, &as_it_is)?;
    let after = judge.figures(&job, &found.motion)?;
    let limits = limits::passed(robot, &found.motion, &after.efforts, request)?;
    let own = limits::passed(robot, &scenario.motion, &before.efforts, request)?;
    // What will be refused or run again is not judged elsewhere.
    let kept = request.limits == LimitRule::Tell || limits::worse(&limits, &own).next().is_none();
    let plants = match request.sweep && kept {
        true => sweep(robot, request, &job, arm, &found.motion)?,
        false => Vec::new(),
    };
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
    answer.caveats = caveats::of(&answer, &own, robot, &found, job.rows.len());
    answer.caveats.extend(caveats::of_servos(&judge.arm, &after.efforts));
    let motion = found.motion;
    Ok((answer, Found { scenario, motion }, own))
}

fn check(scenario: &Scenario, request: &CompensateRequest, arm: &Arm) -> Result<(), CompensateError> {
    let motion = &scenario.motion;
    if !request.components.contains(&true) {
        return Err(CompensateError::NoComponent);
    }
    if let Some(hz) = request.cutoff_hz.filter(|hz| !(hz.is_finite() && *hz > 0.0)) {
        return Err(CompensateError::Value { what: "the cutoff", found: hz, expected: "a positive frequency (Hz)" });
    }
    let found = request.run.step_s;
    if !(found > 0.0 && found <= LONGEST_STEP_S) {
        return Err(CompensateError::Value { what: "the step", found, expected: "a time of at most 0.004 s" });
    }
    let found = motion.trajectory.duration();
    if found > LONGEST_S {
        return Err(CompensateError::Value { what: "the duration of the motion", found, expected: "at most 600 s" });
    }
    if request.iterations > MOST_ITERATIONS {
        let found = request.iterations as f64;
        return Err(CompensateError::Value { what: "the number of iterations", found, expected: "at most 100" });
    }
    let (found, expected) = (request.accelerations.len(), arm.joints().count());
    if found != 0 && found != expected {
        return Err(CompensateError::Accelerations { found, expected });
    }
    if let Some(found) = request.accelerations.iter().copied().find(|limit| limit.is_nan() || *limit <= 0.0) {
        let expected = "a positive number (rad/s2 or m/s2)";
        return Err(CompensateError::Value { what: "a limit of the acceleration", found, expected });
    }
    if let Some(change) = scenario.payloads.iter().find(|change| request.method == Method::Static && change.at_s > 0.0)
    {
        return Err(CompensateError::StaticPayload { at_s: change.at_s });
    }
    if arm.flexible().springs.is_empty() && !arm.flexible().has_servo() {
        return Err(CompensateError::NothingYields);
    }
    // Equilibria do not depend on speeds.
    match motion.trajectory.velocity_jumps().first() {
        Some(jump) if request.method == Method::Dynamic => Err(CompensateError::Corner { t_s: jump.time_s }),
        _ => Ok(()),
    }
}
