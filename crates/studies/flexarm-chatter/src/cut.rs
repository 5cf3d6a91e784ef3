//! Simulation of one cut over time: the full model of the arm, with the force of the teeth as a
//! load that depends on present and past positions of the tool.
//!
//! The arm is held at its pose, and the workpiece moves past it. Each step predicts the tip by a
//! parabola through its last three positions, adds the exact response of the tool's own modes, and
//! computes the force at the end of the next step; within a step the force is linear. The arm is
//! not linearised, and teeth lose contact with the workpiece where the tool moves out of it.

use std::f64::consts::TAU;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use crate::milling::{Cut, ForcedMotion, LimitOptions, RegenerativeCut, Simulated, leading_multiplier, limit_of_depth};
use flexarm_files::check_free;
use flexarm_kinematics::Wrench;
use flexarm_stepping::TimedWrench;
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

use super::place::CutPose;
use super::tool_file::CuttingTool;
use super::{LobesError, caveats, files};
use flexarm_run::AppliedLoad;
use flexarm_run::Caveat;
use flexarm_run::Error;
use flexarm_run::Modelling;
use flexarm_run::Motion;
use flexarm_run::Robot;
use flexarm_run::RunOptions;
use flexarm_run::Scenario;
use flexarm_run::caveat;
use flexarm_run::{Keep, RunRequest};
use flexarm_sample::Sample;

/// Number of tooth periods at the end over which figures are computed.
const LATE: usize = 60;
/// Minimum and maximum number of tooth periods of a simulation without a given duration.
const TEETH: (f64, f64) = (240.0, 4000.0);
/// The simulation lasts until the initial transient has decayed, or chatter has grown, by the
/// exponential of this.
const DECAYED: f64 = 12.0;
/// Scatter from tooth to tooth over the feed per tooth above which lasting motion is chatter.
const CHATTER: f64 = 0.01;
/// Minimum ratio of the late scatter to that of the interval before for lasting motion.
const LASTING: f64 = 0.8;

/// Maximum number of frequencies in the search for the chatter frequency, and number of steps for
/// its refinement.
const FREQUENCIES: usize = 4000;
const LONGER: usize = 60_000;
/// Maximum number of steps.
const MOST_STEPS: usize = 4_000_000;

/// Arguments of [`cut`].
#[derive(Clone, Debug)]
pub struct CutRequest {
    /// Modelling of links and drives.
    pub modelling: Modelling,
    /// Spindle speed (1/min).
    pub spindle_rpm: f64,
    /// Depth of cut (m).
    pub depth_m: f64,
    /// Duration (s); if absent, as long as chatter needs to appear or decay.
    pub seconds: Option<f64>,
    /// Number of steps per tooth period.
    pub steps: usize,
    /// Folder of the output files; none are written if absent.
    pub output: Option<PathBuf>,
    /// Whether to overwrite existing files.
    pub overwrite: bool,
}

/// Result of `flexarm lobes` for one cut over time. SI units; axes of the cut.
#[derive(Clone, Debug, Serialize)]
pub struct CutRun {
    /// Name of the robot.
    pub robot: String,
    /// Name of the tool.
    pub tool: String,
    /// Spindle speed (1/min).
    pub spindle_rpm: f64,
    /// Depth of cut (m).
    pub depth_m: f64,
    /// Limit of depth at this speed (m); null if there is none up to the maximum depth of the tool
    /// or the depth of this cut.
    pub limit_m: Option<f64>,
    /// Chatter frequency at the limit (Hz).
    pub limit_hz: Option<f64>,
    /// Magnitude of the largest multiplier over a tooth period at this depth; above 1 the
    /// linearised cut chatters.
    pub multiplier: f64,
    /// Whether the simulated cut chatters.
    pub chatters: bool,
    /// Scatter of the tip's motion from tooth to tooth at the end: standard deviation (m).
    pub scatter_m: f64,
    /// Scatter over the feed per tooth.
    pub scatter_per_feed: f64,
    /// Feed per tooth (m).
    pub feed_per_tooth_m: f64,
    /// Maximum displacement of the tip at the end, relative to its position without a cut (m).
    pub peak_m: f64,
    /// Maximum force on the tool at the end (N).
    pub peak_n: f64,
    /// Frequency of the largest component of the tip's motion at the end, apart from the tooth
    /// frequencies (Hz); null without chatter.
    pub swing_hz: Option<f64>,
    /// Duration of the simulation (s).
    pub seconds: f64,
    /// Step size (s).
    pub step_s: f64,
    /// Sentences of the caveats that are warnings.
    pub warnings: Vec<String>,
    /// Caveats about the input and the validity of the result.
    pub caveats: Vec<Caveat>,
    /// Simulated curves.
    #[serde(skip)]
    pub curves: Simulated,
    /// Path of the table; null if nothing was written.
    pub file: Option<String>,
    /// Path of the plot; null if nothing was written.
    pub plot: Option<String>,
}

/// State of the simulation's load: forces at both ends of the next step, and the vector from the
/// TCP to the tip, in world axes.
#[derive(Clone, Copy, Debug)]
struct Next {
    from: f64,
    step: f64,
    start: Vector3<f64>,
    end: Vector3<f64>,
    tip: Vector3<f64>,
}

/// Simulates one cut.
///
/// # Errors
/// As [`super::lobes`]; [`Error::Step`] if the simulation fails.
pub fn cut(robot: &Robot, tool: &CuttingTool, at: Option<&[f64]>, request: &CutRequest) -> Result<CutRun, Error> {
    if tool.measured.is_some() {
        return Err(LobesError::MeasuredTool.into());
    }
    super::check_speeds(&[request.spindle_rpm])?;
    super::check_deepest(request.depth_m)?;
    if let Some(found) = request.seconds.filter(|seconds| !(seconds.is_finite() && *seconds > 0.0)) {
        return Err(LobesError::Seconds { found }.into());
    }
    let paths = request.output.as_ref().map(|folder| files::CUT_NAMES.map(|name| folder.join(name)));
    check_free(paths.as_ref().map_or(&[], |paths| paths.as_slice()), request.overwrite)?;

    let place = CutPose::at(robot, &request.modelling, tool, at)?;
    let chatter = |source| Error::from(LobesError::Chatter { place: place.words(), source });
    let spindle = TAU * request.spindle_rpm / 60.0;
    let limit =
        limit_of_depth(&place.structure, &tool.cutter, spindle, &LimitOptions::to(tool.deepest.max(request.depth_m)));
    let limit = limit.map_err(chatter)?;
    let multiplier =
        leading_multiplier(&place.structure, &tool.cutter, spindle, request.depth_m).map_err(chatter)?.norm();

    let period = tool.cutter.tooth_period(spindle);
    let needed = (DECAYED / multiplier.ln().abs().max(1e-12)).clamp(TEETH.0, TEETH.1);
    let teeth = request.seconds.map_or(needed, |seconds| seconds / period).ceil().max(2.0) as usize;
    if teeth.saturating_mul(request.steps) > MOST_STEPS {
        return Err(LobesError::Long { steps: teeth.saturating_mul(request.steps), most: MOST_STEPS }.into());
    }
    let cut = Cut { spindle, depth: request.depth_m, feed: tool.feed_per_tooth, steps: request.steps, teeth };
    let work = RegenerativeCut::new(&tool.cutter, &cut).map_err(chatter)?;
    let curves = run(robot, tool, &place, request, work, &cut)?;
    let mut answer = figures(robot, tool, &curves, &cut, multiplier);
    answer.limit_m = limit.as_ref().map(|limit| limit.depth);
    answer.limit_hz = limit.map(|limit| limit.chatter_hz);
    answer.curves = curves;
    answer.caveats = place.caveats(robot);
    answer.caveats.extend(caveats::tool_caveats(tool));
    answer.warnings = caveat::warnings(&answer.caveats);
    if let Some(paths) = paths {
        files::save_cut(&mut answer, paths)?;
    }
    Ok(answer)
}

/// Runs the simulation.
fn run(
    robot: &Robot,
    tool: &CuttingTool,
    place: &CutPose,
    request: &CutRequest,
    work: RegenerativeCut,
    cut: &Cut,
) -> Result<Simulated, Error> {
    let h = work.step_s();
    let zero = Vector3::zeros();
    let next = Arc::new(Mutex::new(Next { from: 0.0, step: h, start: zero, end: zero, tip: zero }));
    let shown = next.clone();
    let wrench = move |t: f64| {
        let n = *shown.lock().unwrap_or_else(PoisonError::into_inner);
        let s = ((t - n.from) / n.step).clamp(0.0, 1.0);
        let F = n.start * (1.0 - s) + n.end * s;
        Wrench::new(F, n.tip.cross(&F))
    };
    let duration = h * (cut.steps * cut.teeth) as f64;
    let pose = [place.pose(), place.pose()].concat();
    let motion = Motion::from_samples(&[0.0, duration], &pose, robot)?;
    let scenario = Scenario::new(motion).with_load(AppliedLoad::new("tcp", TimedWrench::new(wrench)));
    let options = RunOptions {
        step_s: h,
        log_rate_hz: 1.0 / h,
        modelling: request.modelling,
        with_twin: false,
        ignore_limits: true,
        ..RunOptions::default()
    };
    let mut follower = Follower::new(tool, place, work, next, h);
    let arm = robot.flexible(request.modelling)?;
    let mut observer = |sample: &Sample| {
        let X_WT = &sample.flexible.X_WT;
        follower.see(sample.time_s, X_WT.translation.vector, X_WT.rotation * tool.tip);
        ControlFlow::Continue(())
    };
    let request = RunRequest { observer: Some(&mut observer), ..RunRequest::keeping(Keep::Figures) };
    arm.simulate_with(&scenario, &options, request)?;
    Ok(follower.curves)
}

/// State kept from step to step.
struct Follower {
    work: RegenerativeCut,
    tool: ForcedMotion,
    /// Rotation from world axes to the axes of the cut.
    R_CW: Matrix3<f64>,
    next: Arc<Mutex<Next>>,
    step_s: f64,
    step: usize,
    /// Position of the tip without a cut, world axes.
    rest: Option<Vector3<f64>>,
    /// Displacement of the tip due to the arm in the last three steps, axes of the cut.
    past: [Vector3<f64>; 3],
    force: Vector3<f64>,
    curves: Simulated,
}

impl Follower {
    fn new(tool: &CuttingTool, place: &CutPose, work: RegenerativeCut, next: Arc<Mutex<Next>>, step_s: f64) -> Self {
        let zero = Vector3::zeros();
        Self {
            work,
            tool: ForcedMotion::new(&place.tool_structure(tool), step_s),
            R_CW: place.axes_of_cut().transpose(),
            next,
            step_s,
            step: 0,
            rest: None,
            past: [zero; 3],
            force: zero,
            curves: Simulated::default(),
        }
    }

    /// Processes the state of the arm at the end of a step; `tip`: from the TCP to the tip, world
    /// axes.
    fn see(&mut self, t: f64, p_W: Vector3<f64>, tip: Vector3<f64>) {
        let rest = *self.rest.get_or_insert(p_W + tip);
        let arm = self.R_CW * (p_W + tip - rest);
        self.past = [arm, self.past[0], self.past[1]];
        // Force at the end of the step.
        let before = self.force;
        if self.step > 0 {
            let ended = self.next.lock().unwrap_or_else(PoisonError::into_inner).end;
            self.force = self.R_CW * ended;
            self.tool.advance(&before, &self.force);
            let u = arm + self.tool.displacement();
            let chip = self.work.leave(self.step - 1, &u);
            self.curves.time.push(t);
            self.curves.displacement.push(u);
            self.curves.force.push(self.force);
            self.curves.chip.push(chip);
        }
        // Predicted position of the tip at the end of the next step, and the force there.
        let going = self.past[0] * 3.0 - self.past[1] * 3.0 + self.past[2];
        let free = going + self.tool.predicted(&self.force);
        let mut end = self.force;
        for _ in 0..3 {
            end = self.work.force(self.step, &(free + self.tool.end_gain() * end));
        }
        let R_WC = self.R_CW.transpose();
        let next = Next { from: t, step: self.step_s, start: R_WC * self.force, end: R_WC * end, tip };
        *self.next.lock().unwrap_or_else(PoisonError::into_inner) = next;
        self.step += 1;
    }
}

fn figures(robot: &Robot, tool: &CuttingTool, curves: &Simulated, cut: &Cut, multiplier: f64) -> CutRun {
    let periods = curves.time.len() / cut.steps;
    let late = LATE.min(periods / 2).max(1);
    let scatter_m = curves.scatter(cut.steps, late);
    let earlier = Simulated {
        displacement: curves.displacement[..curves.displacement.len().saturating_sub(late * cut.steps)].to_vec(),
        ..Simulated::default()
    };
    let before = earlier.scatter(cut.steps, late);
    let scatter_per_feed = scatter_m / tool.feed_per_tooth;
    let chatters = scatter_per_feed > CHATTER && scatter_m > LASTING * before;
    let from = curves.displacement.len().saturating_sub(late * cut.steps);
    let largest = |values: &[Vector3<f64>]| values.iter().map(|v| v.norm()).fold(0.0, f64::max);
    CutRun {
        robot: robot.name.clone(),
        tool: tool.name.clone(),
        spindle_rpm: cut.spindle * 60.0 / TAU,
        depth_m: cut.depth,
        limit_m: None,
        limit_hz: None,
        multiplier,
        chatters,
        scatter_m,
        scatter_per_feed,
        feed_per_tooth_m: tool.feed_per_tooth,
        peak_m: largest(&curves.displacement[from..]),
        peak_n: largest(&curves.force[from..]),
        swing_hz: chatters.then(|| swing_hz(curves, cut, from)),
        seconds: curves.time.last().copied().unwrap_or(0.0),
        step_s: tool.cutter.tooth_period(cut.spindle) / cut.steps as f64,
        warnings: Vec::new(),
        caveats: Vec::new(),
        curves: Simulated::default(),
        file: None,
        plot: None,
    }
}

/// Returns the frequency of the largest component of the motion that differs from tooth to tooth:
/// coarse over the late part, then refined over a longer one.
fn swing_hz(curves: &Simulated, cut: &Cut, from: usize) -> f64 {
    let h = curves.time[1] - curves.time[0];
    let late = swing(&curves.displacement[from..], cut.steps);
    let duration = h * late.len() as f64;
    let largest = |candidates: &mut dyn Iterator<Item = f64>, of: &[Vector3<f64>]| {
        candidates.map(|hz| (hz, size_at(of, h, hz))).max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0.0, |best| best.0)
    };
    let bins = (late.len() / 4).min(FREQUENCIES);
    let rough = largest(&mut (1..bins).map(|k| k as f64 / duration), &late);
    let whole = curves.displacement.len() / cut.steps;
    let longer = (whole / 4).min(LONGER / cut.steps).max(late.len() / cut.steps) * cut.steps;
    let longer = swing(&curves.displacement[curves.displacement.len() - longer..], cut.steps);
    let near = (-100..=100).map(|k| rough + f64::from(k) / 100.0 / duration).filter(|hz| *hz > 0.0);
    largest(&mut { near }, &longer)
}

/// Subtracts the part that repeats with the teeth from a motion of whole tooth periods.
fn swing(motion: &[Vector3<f64>], steps: usize) -> Vec<Vector3<f64>> {
    let periods = (motion.len() / steps).max(1) as f64;
    let mean = |moment: usize| motion.iter().skip(moment).step_by(steps).sum::<Vector3<f64>>() / periods;
    let means: Vec<Vector3<f64>> = (0..steps).map(mean).collect();
    motion.iter().enumerate().map(|(k, u)| u - means[k % steps]).collect()
}

/// Returns the squared magnitude of a motion's component at a frequency (Hz).
fn size_at(motion: &[Vector3<f64>], h: f64, hz: f64) -> f64 {
    let (mut s, mut c) = (Vector3::zeros(), Vector3::zeros());
    for (k, u) in motion.iter().enumerate() {
        let (sin, cos) = (TAU * hz * h * k as f64).sin_cos();
        s += u * sin;
        c += u * cos;
    }
    s.norm_squared() + c.norm_squared()
}
