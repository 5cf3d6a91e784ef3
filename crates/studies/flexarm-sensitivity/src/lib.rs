//! Sensitivity of the TCP error along a motion to all parameters of the robot: derivatives of whole
//! runs, by differences on all cores.
//!
//! Start at [`sensitivity`], or at [`error_slopes`] for numbers only; [`pose_sensitivity`] is the
//! analysis at a pose. Not here: the parameters and their effects on the arm (`flexarm-identify`).
//!
//! ```
//! use flexarm_run::{Modelling, Robot};
//! use flexarm_sensitivity::pose_sensitivity;
//!
//! # std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../../.."))?;
//! let robot = Robot::load("robots/kr210")?;
//! let found = pose_sensitivity(&robot, Modelling::default(), None, &["link.*.stiffness_factor".into()])?;
//! for own in &found.parameters {
//!     println!("{} per {}: the TCP rises by {} m", own.name, own.per, own.tcp_m[2]);
//! }
//! # assert!(!found.parameters.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![allow(non_snake_case, reason = "monogram notation: X_WL, K_S; see docs/references.md")]
#![cfg_attr(test, allow(clippy::unwrap_used, reason = "a failed unwrap fails the test"))]

mod controllers;
mod pose;
mod slopes;

use std::path::PathBuf;
use std::sync::Arc;

use flexarm_files::{check_apart, check_free, write_all};
use flexarm_identify::parameters::{asks_for, fits};
use flexarm_identify::{Effect, Parameter, nominal, parameters, parameters_like};
use flexarm_run::caveat::{Use, once_each, warnings};
use flexarm_run::prepare::{loaded, runnable};
use flexarm_run::run::BeforeRun;
use flexarm_run::{Arm, Error, Finding, Modelling, Robot, RunOptions, Scenario};
use flexarm_stepping::{ExactRun, StepError, StepperKind};
use nalgebra::Vector3;
use serde::Serialize;

use controllers::{add_controllers, limited};
use slopes::Repeated;

pub use pose::{PoseParameter, PoseSensitivity, pose_sensitivity};
pub use slopes::{ErrorSlopes, RunParameter, RunSlopes};

/// Time below which an event counts as at the start (s).
const SAME_TIME: f64 = 1e-9;

/// Input of [`sensitivity`].
#[derive(Clone, Debug, Default)]
pub struct SensitivityRequest {
    /// Models of links and drives.
    pub modelling: Modelling,
    /// Run options: generalised-alpha and its step, limits. Rates and recordings are ignored.
    pub run: RunOptions,
    /// Names of the parameters, with * as wildcard; empty for all.
    pub parameters: Vec<String>,
    /// Output table of the error and its derivatives over time (CSV).
    pub table: Option<PathBuf>,
    /// Whether to overwrite existing files.
    pub overwrite: bool,
}

/// Result of `flexarm sensitivity`.
#[derive(Clone, Debug, Serialize)]
pub struct Sensitivity {
    /// Name of the robot.
    pub robot: String,
    /// File of the motion.
    pub motion: String,
    /// Step size (s).
    pub step_s: f64,
    /// Number of steps.
    pub steps: u64,
    /// Maximum distance of the TCP from that of the rigid arm (m).
    pub peak_m: f64,
    /// Time of the maximum distance (s).
    pub t_peak_s: f64,
    /// RMS distance (m).
    pub rms_m: f64,
    /// Maximum angle (rad).
    pub peak_rad: f64,
    /// RMS angle (rad).
    pub rms_rad: f64,
    /// Sensitivities to the parameters of robot, tool and motion, in order of decreasing effect on
    /// the RMS distance.
    pub parameters: Vec<ParameterSensitivity>,
    /// File with error and derivatives over time.
    pub table: Option<String>,
    /// Messages of the caveats.
    pub warnings: Vec<String>,
    /// Caveats.
    pub caveats: Vec<Finding>,
}

/// Effect of a change of one parameter on the error.
#[derive(Clone, Debug, Serialize)]
pub struct ParameterSensitivity {
    /// Name as in the robot file; for servo-controlled joints also `drive.JOINT.servo.` with the
    /// gains and `drive.JOINT.friction.`; `motion.JOINT` for a shift of a joint, `tcp.x`, `.y` and
    /// `.z` for the position of the TCP in its own axes.
    pub name: String,
    /// Unit of the parameter.
    pub unit: String,
    /// Value; 0 for a shift, 1 for an active feed-forward.
    pub value: f64,
    /// Change to which the following effects refer: `1 %`, `1 % of the root of K_ii K_jj`, `1 kg`,
    /// `1 mrad` or `1 mm`. They are derivatives times that change.
    pub per: &'static str,
    /// Effect on the maximum distance, at its time (m).
    pub peak_m: f64,
    /// Effect on the RMS distance (m).
    pub rms_m: f64,
    /// Effect on the maximum angle (rad).
    pub peak_rad: f64,
    /// Effect on the RMS angle (rad).
    pub rms_rad: f64,
}

/// A parameter with its name, and the change for which results are reported.
struct NamedParameter {
    name: String,
    unit: String,
    value: f64,
    per: &'static str,
    scale: f64,
    parameter: RunParameter,
}

/// Computes the TCP error along a run and its derivatives by parameters. Only generalised-alpha is
/// supported; its iterations are fully converged, so that the run is a smooth function of all
/// inputs.
///
/// * `parameters`: the derivatives are in their order.
/// * `keep_samples`: whether to return errors and derivatives over time as well.
///
/// Cost: two runs for each parameter, each about ten ordinary ones, on all cores of the thread pool
/// of `rayon`.
///
/// # Errors
/// As [`Arm::simulate`]; [`Error::Step`] for other steppers than generalised-alpha.
pub fn error_slopes(
    arm: &Arc<Arm>,
    scenario: impl Into<Scenario>,
    options: &RunOptions,
    parameters: &[RunParameter],
    keep_samples: bool,
) -> Result<RunSlopes, Error> {
    slopes_and_caveats(arm, &scenario.into(), options, parameters, keep_samples).map(|(found, _)| found)
}

/// As [`error_slopes`], with the caveats of the run.
fn slopes_and_caveats(
    arm: &Arc<Arm>,
    scenario: &Scenario,
    options: &RunOptions,
    parameters: &[RunParameter],
    keep_samples: bool,
) -> Result<(RunSlopes, Vec<Finding>), Error> {
    let StepperKind::GeneralizedAlpha(settings) = options.stepper else {
        let name = options.stepper.name();
        let text = format!("derivatives of a run need the stepper generalised-alpha, found {name}: use the default");
        return Err(Error::Step { source: StepError::Setup(text), partial: false });
    };
    // The run must be possible, and something in the arm elastic.
    runnable(&scenario.motion, options)?;
    if arm.springs.is_empty() && !arm.has_servo() {
        return Err(Error::nothing_yields());
    }
    flexarm_run::loops::along_motion(&arm.rigid, &scenario.motion.trajectory)?;
    // The plant with its loads, and caveats about the set-up.
    let unloaded = arm.plant(scenario.motion.prescribed()).map_err(|error| arm.explained(error))?;
    let (ready, mut caveats) = loaded(arm.robot(), scenario, options, unloaded)?;
    caveats.extend(BeforeRun { arm, plant: &ready, motion: &scenario.motion, options }.of_steps());
    // The nominal run, and its derivatives.
    let run = ExactRun {
        settings,
        step_s: options.step_s,
        duration_s: scenario.duration_s(),
        start: scenario.start,
        tool: arm.tcp.clone(),
    };
    let found = Repeated { arm, scenario, options, run, nominal: nominal(arm) }.slopes(parameters, keep_samples)?;
    caveats.extend(limited(arm, &found));
    Ok((found, caveats))
}

/// Returns the differentiable parameters of the arm; matrix entries, which are many, only if
/// requested by name.
fn numbers(arm: &Arc<Arm>, asked: &[String]) -> Vec<Parameter> {
    let entries = parameters_like(arm, "link.*.stiffness[*][*]").into_iter();
    let entries = entries.filter(|own| asked.iter().any(|pattern| asks_for(pattern, &own.name)));
    parameters(arm).into_iter().chain(parameters_like(arm, "link.*.stiffness_factors[*]")).chain(entries).collect()
}

/// Returns all parameters by which the error along a motion is differentiated.
fn run_parameters(arm: &Arc<Arm>, scenario: &Scenario, asked: &[String]) -> Result<Vec<NamedParameter>, Error> {
    let of_arm = |parameter: Parameter| {
        let (per, scale) = change_of(&parameter);
        let Parameter { name, unit, initial: value, .. } = parameter.clone();
        NamedParameter { name, unit, value, per, scale, parameter: RunParameter::Arm(parameter) }
    };
    // A payload replaced at the start has no effect.
    let gone = scenario.payloads.iter().any(|payload| payload.at_s <= SAME_TIME);
    let there = |own: &Parameter| !(gone && matches!(own.effect, Effect::Mass(_)));
    let mut all: Vec<NamedParameter> = numbers(arm, asked).into_iter().filter(there).map(of_arm).collect();
    let model = &arm.model;
    for (k, coordinate) in model.coordinates()[..model.n_actuated()].iter().enumerate() {
        let slides = coordinate.slides();
        let (unit, per) = if slides { ("m", "1 mm") } else { ("rad", "1 mrad") };
        let name = format!("motion.{}", coordinate.joint);
        let parameter = RunParameter::Joint(k);
        all.push(NamedParameter { name, unit: unit.into(), value: 0.0, per, scale: 1e-3, parameter });
    }
    for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
        let (name, unit) = (format!("tcp.{axis}"), "m".into());
        let parameter = RunParameter::Tool(Vector3::ith(k, 1.0));
        all.push(NamedParameter { name, unit, value: 0.0, per: "1 mm", scale: 1e-3, parameter });
    }
    add_controllers(arm, scenario, &mut all)?;
    Ok(all)
}

/// Computes the sensitivity of the TCP error along a motion to all parameters of the robot:
/// stiffness and damping of gearboxes and links, masses, the TCP position, the joints of the
/// motion; friction and gains of servo-controlled joints.
///
/// # Errors
/// As [`error_slopes`]; [`Error::Value`] for a name that matches nothing, [`Error::File`] and
/// [`Error::Write`] for the table.
pub fn sensitivity(
    robot: &Robot,
    scenario: impl Into<Scenario>,
    request: &SensitivityRequest,
) -> Result<Sensitivity, Error> {
    // Derivatives of the run by the parameters that the request names.
    let scenario = scenario.into();
    check_apart(request.table.as_slice(), &[&robot.path, &robot.urdf_path, &scenario.motion.path])?;
    check_free(request.table.as_slice(), request.overwrite)?;
    let arm = robot.model(&request.modelling)?;
    let named = chosen(run_parameters(&arm, &scenario, &request.parameters)?, &request.parameters, |own| &own.name)?;
    let parameters: Vec<RunParameter> = named.iter().map(|own| own.parameter.clone()).collect();
    let (found, mut caveats) = slopes_and_caveats(&arm, &scenario, &request.run, &parameters, request.table.is_some())?;
    caveats.extend(arm.caveats(Use::Along(&scenario)));
    let caveats = once_each(caveats);
    if let Some(path) = &request.table {
        write_all(&[(path.clone(), table(&named, &found))])?;
    }
    // Effects of the reported changes, strongest first.
    let (position, rotation) = (&found.position, &found.rotation);
    let parameter_figures = |(k, own): (usize, NamedParameter)| ParameterSensitivity {
        name: own.name,
        unit: own.unit,
        value: own.value,
        per: own.per,
        peak_m: position.peak_slopes[k] * own.scale,
        rms_m: position.rms_slopes[k] * own.scale,
        peak_rad: rotation.peak_slopes[k] * own.scale,
        rms_rad: rotation.rms_slopes[k] * own.scale,
    };
    let mut parameters: Vec<ParameterSensitivity> = named.into_iter().enumerate().map(parameter_figures).collect();
    parameters.sort_by(|a, b| b.rms_m.abs().total_cmp(&a.rms_m.abs()));
    Ok(Sensitivity {
        robot: robot.name.clone(),
        motion: scenario.motion.path.display().to_string(),
        step_s: request.run.step_s,
        steps: found.steps,
        peak_m: position.peak,
        t_peak_s: position.t_peak_s,
        rms_m: position.rms,
        peak_rad: rotation.peak,
        rms_rad: rotation.rms,
        parameters,
        table: request.table.as_ref().map(|path| path.display().to_string()),
        warnings: warnings(&caveats),
        caveats,
    })
}

/// Returns the entries whose names match a pattern, all without patterns.
fn chosen<T>(mut all: Vec<T>, patterns: &[String], name: impl Fn(&T) -> &str) -> Result<Vec<T>, Error> {
    for pattern in patterns {
        if !all.iter().any(|own| fits(pattern, name(own))) {
            let names: Vec<_> = all.iter().map(&name).collect();
            let message = format!(
                "no parameter is called {pattern:?}: expected some of {}, * for anything; an entry of a lumped \
                 link's 6x6 is link.LINK.stiffness[i][j], i and j from 0 to 5",
                names.join(", ")
            );
            return Err(Error::Value(message));
        }
    }
    all.retain(|own| patterns.is_empty() || patterns.iter().any(|pattern| fits(pattern, name(own))));
    Ok(all)
}

/// Returns the change for which results of a parameter of the arm are reported, as text and in its
/// estimation coordinate.
fn change_of(parameter: &Parameter) -> (&'static str, f64) {
    match parameter.effect {
        Effect::Entry { size, .. } => ("1 % of the root of K_ii K_jj", 0.01 * size),
        _ if parameter.is_logarithmic() => ("1 %", 0.01),
        _ => ("1 kg", 1.0),
    }
}

/// Returns the table of error and derivatives after every step: six columns each, world axes, m and
/// rad, for the reported changes of the parameters.
fn table(named: &[NamedParameter], found: &RunSlopes) -> String {
    const AXES: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];
    let mut text = String::from("time_s");
    let names = std::iter::once("error").chain(named.iter().map(|own| own.name.as_str()));
    for name in names {
        AXES.iter().for_each(|axis| text += &format!(",{name}.{axis}"));
    }
    text.push('\n');
    for (k, (t, error)) in found.times_s.iter().zip(&found.errors).enumerate() {
        text += &format!("{t}");
        error.iter().for_each(|x| text += &format!(",{x:e}"));
        for (own, slopes) in named.iter().zip(&found.slopes) {
            slopes[k].iter().for_each(|x| text += &format!(",{:e}", x * own.scale));
        }
        text.push('\n');
    }
    text
}
