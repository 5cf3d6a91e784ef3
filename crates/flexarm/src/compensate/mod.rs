//! Joint commands with which a flexible arm's tool follows the pose of the rigid one, found on a model and judged on others.
//!
//! [`compensate_motion`]: the motion is run, the error of the tool is taken away through the arm linearised along the motion
//! ([`Inversion`]), and the new motion is run again, a few times. At rest ([`Method::Static`]) each point is corrected to its
//! equilibrium alone. [`static_targets`], [`Inversion`] and [`Shaper`] take and give values.

mod page;

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;

pub use flexarm_analysis::{Inversion, InversionError, Node, Shaper, ShaperKind};
use flexarm_files::{check_free, write_all};
use flexarm_flexlink::GearStiffness;
use flexarm_kinematics::{Data, Pose, Wrench, forward_kinematics, rotation_vector};
use flexarm_stepping::{Held, linearise};
pub use flexarm_stepping::{StaticTargets, TargetError, static_targets};
use flexarm_trajectory::{JointKnots, Trajectory};
use nalgebra::{DMatrix, DVector, Quaternion, Rotation3, Translation3, UnitQuaternion};
use rayon::prelude::*;
use serde::Serialize;

use crate::arm::Arm;
use crate::caveat::Caveat;
use crate::error::Error;
use crate::motion::Motion;
use crate::options::{DriveModel, LinkModel, Modelling, RunOptions};
use crate::robot::{Robot, tcp_frame};
use crate::scenario::Scenario;

/// Time between two nodes at which the arm is linearised (s).
const NODE_S: f64 = 0.02;
/// Time between two samples of the error and two knots of the commands (s).
const SAMPLE_S: f64 = 1e-3;
/// Part of a sample by which logged times may differ from those that are asked for.
const LOGGED_WITHIN: f64 = 1e-3;
/// Longest step (s): the error is sampled with it.
const LONGEST_STEP_S: f64 = 4e-3;
/// Most iterations that may be asked for.
const MOST_ITERATIONS: usize = 100;
/// Longest motion that is taken (s): all of it is held in memory, a sample a millisecond.
const LONGEST_S: f64 = 600.0;
/// An iteration that leaves more than this part of the one before is the last.
const SETTLED: f64 = 0.9;
/// Least part of the peak below which nothing more is asked for.
const ENOUGH: f64 = 1e-5;

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
    /// Also run the motion through a shaper of the first mode at its end.
    pub shaper: Option<ShaperKind>,
    /// Another robot that judges, with its name.
    pub plant: Option<(String, Robot)>,
    /// Judge with stiffness, damping and drives that are off as well.
    pub sweep: bool,
    /// Folder of the new motion and the page; nothing is written without it.
    pub output: Option<PathBuf>,
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
            output: None,
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
    /// Limits that the new motion passes.
    pub limits: Vec<String>,
    /// How much longer the motion takes by its shaper (s).
    pub shaper_delay_s: f64,
    /// The same commands on other plants.
    pub plants: Vec<PlantFigures>,
    /// The new motion (.csv).
    pub file: Option<String>,
    /// The page.
    pub page: Option<String>,
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

/// Why a motion cannot be compensated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CompensateError {
    /// A rigid robot.
    #[error("the robot has no flexible link and no elastic drive: its tool is where the rigid arm has it")]
    NothingYields,
    /// Corners.
    #[error("the velocity jumps at {t_s} s: no command takes that away; round the corners of the motion first")]
    Corner {
        /// When (s).
        t_s: f64,
    },
    /// Nothing is to be kept.
    #[error("no component of the tool is chosen: choose some of x, y, z, rx, ry, rz")]
    NoComponent,
    /// A number that makes no sense.
    #[error("{what} is {found}, expected {expected}")]
    Value {
        /// Which.
        what: &'static str,
        /// Found.
        found: f64,
        /// Expected.
        expected: &'static str,
    },
    /// The run is not logged at the times at which the rigid arm is looked at.
    #[error("the run has no sample at {t_s} s (off by {off_s:.1e} s): choose a step that divides 0.001 s")]
    Logged {
        /// When (s).
        t_s: f64,
        /// By how much (s).
        off_s: f64,
    },
    /// The other robot does not have the same joints.
    #[error("the plant has the joints {found:?}, the robot {expected:?}: they must be the same")]
    OtherJoints {
        /// Of the plant.
        found: Vec<String>,
        /// Of the robot.
        expected: Vec<String>,
    },
    /// The linearised arm cannot be inverted.
    #[error(transparent)]
    Inversion(#[from] InversionError),
    /// A pose without targets.
    #[error("at {t_s:.3} s: {source}")]
    Target {
        /// When (s).
        t_s: f64,
        /// Why.
        source: TargetError,
    },
}

/// Finds commands for a motion, and judges them.
///
/// # Errors
/// [`Error::Compensate`], and as [`crate::simulate`].
pub fn compensate_motion(robot: &Robot, motion: &Motion, request: &CompensateRequest) -> Result<Compensation, Error> {
    compensate_motion_until(robot, motion, request, &|| false)
}

/// As [`compensate_motion`]; as soon as `stop` says so, it ends with [`Error::Interrupted`], and nothing is written.
///
/// # Errors
/// As [`compensate_motion`]; [`Error::Interrupted`].
pub fn compensate_motion_until(
    robot: &Robot,
    motion: &Motion,
    request: &CompensateRequest,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Compensation, Error> {
    check(motion, request)?;
    let targets =
        request.output.as_ref().map(|folder| [folder.join("compensated.csv"), folder.join("compensation.html")]);
    if let Some(targets) = &targets {
        check_free(targets, request.overwrite)?;
    }
    let arm = robot.flexible(request.run.modelling)?;
    if arm.flexible().springs.is_empty() {
        return Err(CompensateError::NothingYields.into());
    }
    let (motion, shaper_delay_s) = match request.shaper {
        Some(kind) => shaped(&arm, motion, kind)?,
        None => (motion.clone(), 0.0),
    };
    let job = Job::new(&arm, &motion, request, stop)?;
    let found = match request.method {
        Method::Dynamic => job.dynamic()?,
        Method::Static => job.at_rest()?,
    };
    let judge = match &request.plant {
        Some((_, plant)) => Judge::of(plant, request, &arm)?,
        None => Judge { arm: arm.clone(), run: request.run.clone() },
    };
    let as_it_is = job.as_it_is()?;
    let (before, wander) = judge.figures(&job, &as_it_is)?;
    let (after, left) = judge.figures(&job, &found.motion)?;
    let plants = if request.sweep { sweep(robot, request, &job, &arm, &found.motion)? } else { Vec::new() };
    let names: Vec<String> = arm.joints().map(str::to_owned).collect();
    let largest = |k: usize| found.change.row(k).amax();
    let changes = names.iter().enumerate().map(|(k, joint)| JointChange { joint: joint.clone(), largest: largest(k) });
    let mut answer = Compensation {
        robot: robot.name.clone(),
        motion: motion.path.display().to_string(),
        method: if request.method == Method::Dynamic { "dynamic" } else { "static" },
        before,
        after,
        model_peaks_m: found.peaks.clone(),
        iterations: found.kept,
        cutoff_hz: found.cutoff_hz,
        changes: changes.collect(),
        limits: found.motion.violations.iter().map(ToString::to_string).collect(),
        shaper_delay_s,
        plants,
        file: None,
        page: None,
        caveats: Vec::new(),
        trajectory: found.motion.trajectory.clone(),
        curves: job.times.iter().zip(wander.iter().zip(&left)).map(|(t, (a, b))| [*t, *a, *b]).collect(),
    };
    answer.caveats = caveats(&answer, &motion, robot);
    answer.caveats.extend(found.fewest.and_then(|fewest| singular_caveat(fewest, job.rows.len())));
    if let Some([file, page]) = targets {
        let mut csv = Vec::new();
        found.motion.trajectory.to_csv(1.0 / SAMPLE_S, &mut csv)?;
        (answer.file, answer.page) = (Some(file.display().to_string()), Some(page.display().to_string()));
        let html = page::html(&answer).into_bytes();
        write_all(&[(file, csv), (page, html)])?;
    }
    Ok(answer)
}

fn check(motion: &Motion, request: &CompensateRequest) -> Result<(), CompensateError> {
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
    match motion.trajectory.velocity_jumps().first() {
        Some(jump) => Err(CompensateError::Corner { t_s: jump.time_s }),
        None => Ok(()),
    }
}

/// A motion on the model, with the poses that its tool should have.
struct Job<'a> {
    arm: &'a Arm,
    request: &'a CompensateRequest,
    motion: &'a Motion,
    /// Times of samples (s).
    times: Vec<f64>,
    /// Joints at these times, m×N.
    q: DMatrix<f64>,
    /// The rigid arm's tool at these times.
    wanted: Vec<Pose>,
    rows: Vec<usize>,
    stop: &'a (dyn Fn() -> bool + Sync),
}

/// Commands as they were found.
struct Commands {
    motion: Motion,
    /// Change of the joints, m×N.
    change: DMatrix<f64>,
    peaks: Vec<f64>,
    kept: usize,
    cutoff_hz: Option<f64>,
    /// When the joints move the tool in fewest directions (s), and in how many.
    fewest: Option<(f64, usize)>,
}

impl<'a> Job<'a> {
    fn new(
        arm: &'a Arm,
        motion: &'a Motion,
        request: &'a CompensateRequest,
        stop: &'a (dyn Fn() -> bool + Sync),
    ) -> Result<Self, Error> {
        let model = arm.robot().rigid_model()?;
        // Whole numbers of steps, so that the run is logged at just these times; the last lies at the end or a little beyond, where
        // the joints are held.
        let step = request.run.step_s;
        let spacing = step * (SAMPLE_S / step).round().max(1.0);
        let n = ((motion.trajectory.duration() / spacing - 1e-6).ceil() as usize).max(8);
        let times: Vec<f64> = (0..=n).map(|k| spacing * k as f64).collect();
        let m = model.n_actuated();
        let (frame, mut data) = (tcp_frame(&model), Data::new(&model));
        let mut q = DMatrix::zeros(m, times.len());
        let mut wanted = Vec::with_capacity(times.len());
        let (mut at, mut v, mut a) = (DVector::zeros(m), vec![0.0; m], vec![0.0; m]);
        for (k, t) in times.iter().enumerate() {
            motion.trajectory.sample(*t, at.as_mut_slice(), &mut v, &mut a);
            forward_kinematics(&model, &mut data, &at);
            wanted.push(data.X_WF(&frame));
            q.set_column(k, &at);
        }
        let rows = (0..6).filter(|k| request.components[*k]).collect();
        Ok(Self { arm, request, motion, times, q, wanted, rows, stop })
    }

    /// Goes on unless somebody wants it to stop; `t_s`: how far it is.
    fn go_on(&self, t_s: f64) -> Result<(), Error> {
        match (self.stop)() {
            true => Err(Error::Interrupted { t: t_s, partial: false }),
            false => Ok(()),
        }
    }

    fn step_s(&self) -> f64 {
        self.times[1]
    }

    /// The motion with changed joints.
    fn moved(&self, change: &DMatrix<f64>) -> Result<Motion, Error> {
        let (m, h, last) = (self.q.nrows(), self.step_s(), self.times.len() - 1);
        let of = |k: usize, i: i64| change[(k, i.clamp(0, last as i64) as usize)];
        let mut reference = vec![Vec::with_capacity(last + 1); m];
        let (mut q, mut v, mut a) = (vec![0.0; m], vec![0.0; m], vec![0.0; m]);
        for t in &self.times {
            self.motion.trajectory.sample(*t, &mut q, &mut v, &mut a);
            (0..m).for_each(|k| reference[k].push([q[k], v[k], a[k]]));
        }
        let joint = |k: usize| {
            let mut knots = JointKnots { name: self.motion.trajectory.joints()[k].clone(), ..JointKnots::default() };
            for (i, [q, v, a]) in reference[k].iter().enumerate() {
                let i = i as i64;
                // At rest at both ends.
                let inner = i > 0 && i < last as i64;
                let rate = (8.0 * (of(k, i + 1) - of(k, i - 1)) - (of(k, i + 2) - of(k, i - 2))) / (12.0 * h);
                let acceleration =
                    (16.0 * (of(k, i + 1) + of(k, i - 1)) - (of(k, i + 2) + of(k, i - 2)) - 30.0 * of(k, i))
                        / (12.0 * h * h);
                let (rate, acceleration) = if inner { (rate, acceleration) } else { (0.0, 0.0) };
                knots.position.push(q + of(k, i));
                knots.velocity.push(v + rate);
                knots.acceleration.push([a + acceleration; 2]);
            }
            knots
        };
        let joints: Vec<JointKnots> = (0..m).map(joint).collect();
        let trajectory = Trajectory::through_knots(&self.times, &joints)?;
        Motion::along(trajectory, &format!("{}_compensated", self.motion.name), self.arm.robot())
    }

    /// The motion as it is, at the times of this job.
    fn as_it_is(&self) -> Result<Motion, Error> {
        self.moved(&DMatrix::zeros(self.q.nrows(), self.q.ncols()))
    }

    /// Run of a motion on an arm: displacement of the tool from where it should be, 6×N, world axes.
    fn error(&self, arm: &Arm, run: &RunOptions, motion: &Motion) -> Result<DMatrix<f64>, Error> {
        let options =
            RunOptions { log_rate_hz: 1.0 / self.step_s(), with_twin: false, ignore_limits: true, ..run.clone() };
        let mut progress = |_, _| if (self.stop)() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
        let run = arm.simulate_watched(Scenario::from(motion), &options, None, None, &mut progress)?;
        let (t, p, r) = (run.time_s(), run.values("tcp_position"), run.values("tcp_quaternion_wxyz"));
        let mut error = DMatrix::zeros(6, self.times.len());
        for (k, time) in self.times.iter().enumerate() {
            let row = t.partition_point(|x| *x < time - 0.5 * self.step_s()).min(t.len() - 1);
            let off = (t[row] - time).abs();
            if off > LOGGED_WITHIN * self.step_s() {
                return Err(CompensateError::Logged { t_s: *time, off_s: off }.into());
            }
            let place = Translation3::new(p[3 * row], p[3 * row + 1], p[3 * row + 2]);
            let turn = Quaternion::new(r[4 * row], r[4 * row + 1], r[4 * row + 2], r[4 * row + 3]);
            let turn: Rotation3<f64> = UnitQuaternion::from_quaternion(turn).to_rotation_matrix();
            let wanted = &self.wanted[k];
            let moved = place.vector - wanted.translation.vector;
            let turned = rotation_vector((turn * wanted.rotation.inverse()).matrix());
            error.fixed_view_mut::<3, 1>(0, k).copy_from(&moved);
            error.fixed_view_mut::<3, 1>(3, k).copy_from(&turned);
        }
        Ok(error)
    }

    /// The arm linearised along the motion.
    fn inversion(&self) -> Result<(Inversion, f64), Error> {
        let duration = self.motion.trajectory.duration();
        let count = ((duration / NODE_S).ceil() as usize).max(1);
        let spacing = duration / count as f64;
        let flexible = self.arm.flexible();
        let m = self.q.nrows();
        let node = |k: usize| -> Result<Node, Error> {
            self.go_on(spacing * k as f64)?;
            let (mut q, mut v, mut a) = (vec![0.0; m], vec![0.0; m], vec![0.0; m]);
            self.motion.trajectory.sample(spacing * k as f64, &mut q, &mut v, &mut a);
            let arm = flexible.arm(Arc::new(Held(q))).map_err(|error| flexible.explained(error))?;
            let at =
                linearise(&arm, &flexible.tcp, &Wrench::zeros(), 0.0).map_err(|error| flexible.explained(error))?;
            let rows = |M: &nalgebra::Matrix6xX<f64>| {
                DMatrix::from_fn(self.rows.len(), M.ncols(), |i, j| M[(self.rows[i], j)])
            };
            let (J, J_a) = (rows(&at.J), rows(&at.J_a));
            Ok(Node { M: at.M, D: at.D, K: at.K, M_a: at.M_a, D_a: at.D_a, K_a: at.K_a, J, J_a })
        };
        let nodes = (0..=count).into_par_iter().map(node).collect::<Result<Vec<Node>, Error>>()?;
        let inversion = Inversion::new(&nodes, spacing).map_err(CompensateError::from)?;
        let inversion = match self.request.cutoff_hz {
            Some(hz) => inversion.below(hz),
            None => inversion,
        };
        let cutoff = inversion.cutoff_hz();
        Ok((inversion, cutoff))
    }

    fn dynamic(&self) -> Result<Commands, Error> {
        let (inversion, cutoff) = self.inversion()?;
        let (m, N) = self.q.shape();
        let run = &self.request.run;
        let mut change = DMatrix::zeros(m, N);
        let mut best = Commands {
            motion: self.motion.clone(),
            change: change.clone(),
            peaks: Vec::new(),
            kept: 0,
            cutoff_hz: Some(cutoff),
            fewest: inversion.fewest_directions(),
        };
        let mut error = self.error(self.arm, run, &self.as_it_is()?)?;
        let size = |error: &DMatrix<f64>| error.select_rows(&self.rows).norm();
        let (first, mut least) = (size(&error), size(&error));
        best.peaks.push(peak(&error));
        for iteration in 1..=self.request.iterations {
            let y = -error.select_rows(&self.rows);
            change += inversion.commands(&y, self.step_s());
            let motion = self.moved(&change)?;
            error = self.error(self.arm, run, &motion)?;
            let left = size(&error);
            best.peaks.push(peak(&error));
            if left.is_nan() || left >= least {
                break;
            }
            let settled = left > SETTLED * least || left < ENOUGH * first;
            (least, best.motion, best.change, best.kept) = (left, motion, change.clone(), iteration);
            if settled {
                break;
            }
        }
        Ok(best)
    }

    /// Each node at rest, a spline between them.
    fn at_rest(&self) -> Result<Commands, Error> {
        let flexible = self.arm.flexible();
        let (m, N) = self.q.shape();
        let arm = flexible
            .arm(Arc::new(Held(self.q.column(0).iter().copied().collect())))
            .map_err(|e| flexible.explained(e))?;
        let every = ((NODE_S / self.step_s()).round() as usize).max(1);
        let nodes: Vec<usize> = (0..N - 1).step_by(every).chain([N - 1]).collect();
        let one = |k: &usize| {
            self.go_on(self.times[*k])?;
            let q: Vec<f64> = self.q.column(*k).iter().copied().collect();
            let found = static_targets(&arm, &flexible.tcp, &q, &Wrench::zeros(), &self.request.components);
            let found = found.map_err(|source| CompensateError::Target { t_s: self.times[*k], source })?;
            Ok::<_, Error>(DVector::from_iterator(m, found.q.iter().zip(&q).map(|(new, old)| new - old)))
        };
        let found: Vec<DVector<f64>> = nodes.par_iter().map(one).collect::<Result<_, Error>>()?;
        let mut change = DMatrix::zeros(m, N);
        for k in 0..N {
            let i = nodes.partition_point(|node| *node <= k).clamp(1, nodes.len() - 1);
            let (a, b) = (nodes[i - 1], nodes[i]);
            let s = (k - a) as f64 / (b - a) as f64;
            let slope = |i: usize| match i {
                0 => DVector::zeros(m),
                i if i + 1 >= nodes.len() => DVector::zeros(m),
                i => (&found[i + 1] - &found[i - 1]) / (nodes[i + 1] - nodes[i - 1]) as f64,
            };
            let (m0, m1) = (slope(i - 1) * (b - a) as f64, slope(i) * (b - a) as f64);
            let (p0, p1) = (&found[i - 1], &found[i]);
            let (s2, s3) = (s * s, s * s * s);
            let value = p0 * (2.0 * s3 - 3.0 * s2 + 1.0)
                + m0 * (s3 - 2.0 * s2 + s)
                + p1 * (3.0 * s2 - 2.0 * s3)
                + m1 * (s3 - s2);
            change.set_column(k, &value);
        }
        let motion = self.moved(&change)?;
        let run = &self.request.run;
        let peaks =
            vec![peak(&self.error(self.arm, run, &self.as_it_is()?)?), peak(&self.error(self.arm, run, &motion)?)];
        Ok(Commands { motion, change, peaks, kept: 1, cutoff_hz: None, fewest: None })
    }
}

fn distances(error: &DMatrix<f64>) -> Vec<f64> {
    error.column_iter().map(|e| e.rows(0, 3).norm()).collect()
}

fn peak(error: &DMatrix<f64>) -> f64 {
    distances(error).into_iter().fold(0.0, f64::max)
}

/// A plant on which commands are judged.
struct Judge {
    arm: Arm,
    run: RunOptions,
}

impl Judge {
    /// Another robot with the same joints.
    fn of(plant: &Robot, request: &CompensateRequest, arm: &Arm) -> Result<Self, Error> {
        let judge = Self { arm: plant.flexible(Modelling::default())?, run: request.run.clone() };
        let names = |arm: &Arm| arm.joints().map(str::to_owned).collect::<Vec<_>>();
        let (found, expected) = (names(&judge.arm), names(arm));
        if found != expected {
            return Err(CompensateError::OtherJoints { found, expected }.into());
        }
        Ok(judge)
    }

    fn figures(&self, job: &Job<'_>, motion: &Motion) -> Result<(ErrorFigures, Vec<f64>), Error> {
        let error = job.error(&self.arm, &self.run, motion)?;
        let distance = distances(&error);
        let turns = error.column_iter().map(|e| e.rows(3, 3).norm()).fold(0.0, f64::max);
        let figures = ErrorFigures {
            peak_m: distance.iter().copied().fold(0.0, f64::max),
            rms_m: (distance.iter().map(|d| d * d).sum::<f64>() / distance.len() as f64).sqrt(),
            peak_rad: turns,
            end_m: distance.last().copied().unwrap_or(0.0),
        };
        Ok((figures, distance))
    }
}

/// The robot with all stiffness and damping so many times as large.
fn changed(robot: &Robot, stiffness: f64, damping: f64) -> Robot {
    let mut changed = robot.clone();
    for drive in &mut changed.drives {
        if let Some((gearbox, gear)) = &mut drive.gearbox {
            gearbox.stiffness = match &gearbox.stiffness {
                GearStiffness::Axis(k) => GearStiffness::Axis(stiffness * k),
                GearStiffness::Tilting(k) => GearStiffness::Tilting(k.map(|k| stiffness * k)),
                GearStiffness::Full(K) => GearStiffness::Full(K * stiffness),
            };
            gear.curve = gear.curve.as_ref().map(|curve| curve.scaled(stiffness));
            gear.dampers = gear.dampers.as_ref().map(|d| d.iter().map(|d| damping * d).collect());
        }
    }
    for link in &mut changed.flexible {
        link.stiffness_factor *= stiffness;
        link.damping = link.damping.scaled(damping);
    }
    changed
}

/// The commands on plants that are off.
fn sweep(
    robot: &Robot,
    request: &CompensateRequest,
    job: &Job<'_>,
    arm: &Arm,
    found: &Motion,
) -> Result<Vec<PlantFigures>, Error> {
    let modelling = request.run.modelling;
    let mut plants: Vec<(String, Robot, Modelling)> = vec![
        ("stiffness 30 % lower".into(), changed(robot, 0.7, 1.0), modelling),
        ("stiffness 30 % higher".into(), changed(robot, 1.3, 1.0), modelling),
        ("damping halved".into(), changed(robot, 1.0, 0.5), modelling),
    ];
    let links = !arm.flexible().spans.is_empty();
    if links && arm.flexible().springs.len() > arm.flexible().spans.len() {
        plants.push((
            "drives alone give way".into(),
            robot.clone(),
            Modelling { links: LinkModel::Rigid, ..modelling },
        ));
        plants.push((
            "links alone give way".into(),
            robot.clone(),
            Modelling { drives: DriveModel::Rigid, ..modelling },
        ));
    }
    let as_it_is = job.as_it_is()?;
    let judged = plants.into_par_iter().map(|(plant, robot, modelling)| {
        let judge = Judge { arm: robot.flexible(modelling)?, run: RunOptions { modelling, ..request.run.clone() } };
        let (before, after) = (judge.figures(job, &as_it_is)?.0, judge.figures(job, found)?.0);
        Ok(PlantFigures { plant, before, after })
    });
    judged.collect()
}

/// The motion through a shaper of the first mode at its end.
fn shaped(arm: &Arm, motion: &Motion, kind: ShaperKind) -> Result<(Motion, f64), Error> {
    let flexible = arm.flexible();
    let m = motion.trajectory.joints().len();
    let (mut q, mut v, mut a) = (vec![0.0; m], vec![0.0; m], vec![0.0; m]);
    let duration = motion.trajectory.duration();
    motion.trajectory.sample(duration, &mut q, &mut v, &mut a);
    let held = flexible.arm(Arc::new(Held(q.clone()))).map_err(|e| flexible.explained(e))?;
    let (Some(hz), Some(phi)) = (held.modes.frequencies_hz().first().copied(), held.modes.shapes.column_iter().next())
    else {
        return Err(CompensateError::NothingYields.into());
    };
    let ratio = (phi.dot(&(&held.D * phi)) / (2.0 * std::f64::consts::TAU * hz)).clamp(0.0, 0.9);
    let shaper = Shaper::new(kind, hz, ratio);
    let total = duration + shaper.delay_s();
    let n = (total / SAMPLE_S).ceil() as usize;
    let times: Vec<f64> = (0..=n).map(|k| total * k as f64 / n as f64).collect();
    let mut joints: Vec<JointKnots> = motion
        .trajectory
        .joints()
        .iter()
        .map(|name| JointKnots { name: name.clone(), ..JointKnots::default() })
        .collect();
    for t in &times {
        let mut sum = vec![[0.0; 3]; m];
        for (delay, part) in &shaper.copies {
            motion.trajectory.sample(t - delay, &mut q, &mut v, &mut a);
            for k in 0..m {
                sum[k][0] += part * q[k];
                sum[k][1] += part * v[k];
                sum[k][2] += part * a[k];
            }
        }
        for (joint, [q, v, a]) in joints.iter_mut().zip(sum) {
            joint.position.push(q);
            joint.velocity.push(v);
            joint.acceleration.push([a; 2]);
        }
    }
    let trajectory = Trajectory::through_knots(&times, &joints)?;
    let shaped = Motion::along(trajectory, &format!("{}_shaped", motion.name), arm.robot())?;
    Ok((shaped, shaper.delay_s()))
}

/// Where the joints cannot correct everything that is asked for.
fn singular_caveat((t_s, directions): (f64, usize), asked: usize) -> Option<Caveat> {
    (directions < asked).then(|| {
        let text = format!(
            "at {t_s:.2} s the joints move the tool in {directions} of the {asked} directions asked for (a singular pose, or too few joints): \
             the others are corrected little or not at all there"
        );
        Caveat::said("singular", "compensation", text, "ask for fewer components, or begin and pass elsewhere")
    })
}

fn caveats(answer: &Compensation, motion: &Motion, robot: &Robot) -> Vec<Caveat> {
    let mut caveats = Vec::new();
    if answer.limits.len() > motion.violations.len() {
        let text = format!("the new commands pass limits that the motion keeps: {}", answer.limits.join("; "));
        caveats.push(Caveat::said("limits", "compensation", text, "slow the motion down a little"));
    }
    let untold: Vec<&str> = robot
        .drives
        .iter()
        .filter(|d| d.backlash > 0.0 || d.friction != flexarm_stepping::Friction::NONE)
        .map(|d| d.joint.as_str())
        .collect();
    if !untold.is_empty() {
        let text = format!(
            "play and friction of {} are not taken away: what they leave depends on the way the joint came",
            untold.join(", ")
        );
        caveats.push(Caveat::said("play", "compensation", text, "come to every point from the same side").as_note());
    }
    if answer.after.peak_m > 0.5 * answer.before.peak_m {
        let text = format!(
            "less than half of the error is taken away on the plant ({:.3} of {:.3} mm left)",
            1e3 * answer.after.peak_m,
            1e3 * answer.before.peak_m
        );
        caveats.push(Caveat::said(
            "little-gained",
            "compensation",
            text,
            "the model is not that of the plant, or the motion is too quick for it",
        ));
    }
    caveats
}
