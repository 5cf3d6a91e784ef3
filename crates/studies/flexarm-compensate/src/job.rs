//! A motion on the model, and the commands that bring the flexible TCP to the pose of the rigid
//! one.
//!
//! Start at [`Job::dynamic`] and [`Job::at_rest`]. Errors are 6×N, displacement and rotation vector
//! of the flexible TCP from the desired pose, world axes, one column per sample; changes are m×N,
//! one row per joint. Not here: the inverse of the linearised arm ([`Inversion`]), which plants are
//! judged ([`super::judge`]).

use std::ops::ControlFlow;
use std::sync::Arc;

use flexarm_analysis::{Inversion, Node, NodeServo};
use flexarm_kinematics::{Data, Pose, Wrench, forward_kinematics, rotation_vector};
use flexarm_run::prepare::loaded;
use flexarm_run::robot::tcp_frame;
use flexarm_run::{AppliedLoad, Arm, Error, Motion, RunOptions, RunRequest, Scenario};
use flexarm_stepping::{Friction, Held, Plant, Servo, ServoAxis, TimedWrench, linearise, static_targets};
use flexarm_trajectory::{Extreme, JointKnots, Trajectory};
use nalgebra::{DMatrix, DVector, Matrix6xX, Quaternion, Rotation3, Translation3, UnitQuaternion};
use rayon::prelude::*;

use super::{CompensateError, CompensateRequest, Stop};

/// Maximum time between two nodes at which the arm is linearised (s).
const NODE_S: f64 = 0.02;
/// Tolerance of logged times, as a fraction of the sampling interval.
const LOGGED_WITHIN: f64 = 1e-3;
/// Number of values of a load per averaging window.
const PIECES: u32 = 64;
/// Maximum number of windows over which a load at rest is sampled.
const LONGEST_REST: f64 = 500.0;
/// Ratio of errors above which the iteration has settled.
const SETTLED: f64 = 0.9;
/// Speed below which a joint is at rest (rad/s or m/s).
const REST: f64 = 1e-6;
/// Fraction of the initial error below which the iteration stops.
const ENOUGH: f64 = 1e-5;

/// Lowest cutoff (Hz) that corrects anything of a motion: one period in its duration.
pub(super) fn lowest_cutoff_hz(trajectory: &Trajectory) -> f64 {
    1.0 / trajectory.duration()
}

/// A motion on the model, with the desired TCP poses.
pub(super) struct Job<'a> {
    arm: &'a Arc<Arm>,
    request: &'a CompensateRequest,
    /// The motion with its loads and payloads.
    scenario: &'a Scenario,
    motion: &'a Motion,
    /// Sampling times (s).
    pub(super) times: Vec<f64>,
    /// Joint positions at these times, m×N.
    q: DMatrix<f64>,
    /// TCP pose of the rigid arm at these times.
    wanted: Vec<Pose>,
    pub(super) rows: Vec<usize>,
    stop: Stop<'a>,
}

/// Result of a run.
pub(super) struct RunResult {
    /// Displacement of the TCP from its desired pose, 6×N, world axes.
    pub(super) error: DMatrix<f64>,
    /// Maximum torque or force of each drive.
    pub(super) efforts: Vec<Extreme>,
}

/// Result of a method.
pub(super) struct Commands {
    pub(super) motion: Motion,
    /// Change of the joint positions, m×N.
    pub(super) change: DMatrix<f64>,
    /// Peak error without correction and after each iteration kept (m).
    pub(super) peaks: Vec<f64>,
    pub(super) kept: usize,
    pub(super) cutoff_hz: Option<f64>,
    /// Time (s) at which the joints control the fewest TCP directions, and their number.
    pub(super) fewest: Option<(f64, usize)>,
    /// Fraction of the remaining RMS error on the model above the cutoff frequency.
    pub(super) quicker: f64,
    /// Discarded iterations, which increased the error.
    pub(super) discarded: Vec<Discarded>,
}

/// An iteration that increased the error.
#[derive(Clone, Copy, Debug)]
pub(super) struct Discarded {
    /// Number of the iteration, from 1.
    pub(super) iteration: usize,
    /// Cutoff frequency of its correction (Hz).
    pub(super) cutoff_hz: f64,
    /// Ratio of the RMS error after the iteration to that before; NaN if the run diverged.
    pub(super) growth: f64,
}

impl<'a> Job<'a> {
    /// Samples the motion, and the desired poses along it.
    pub(super) fn new(
        arm: &'a Arc<Arm>,
        scenario: &'a Scenario,
        request: &'a CompensateRequest,
        stop: Stop<'a>,
    ) -> Result<Self, Error> {
        let motion = &scenario.motion;
        let model = arm.robot().rigid_model()?;
        // Whole numbers of steps, so that the run is logged at exactly these times; the last one is
        // at the end or slightly beyond, where the joints are held.
        let step = request.run.step_s;
        let spacing = step * (super::SAMPLE_S / step).round().max(1.0);
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
        Ok(Self { arm, request, scenario, motion, times, q, wanted, rows, stop })
    }

    /// Returns an error if an interruption is requested; `t_s`: progress.
    fn go_on(&self, t_s: f64) -> Result<(), Error> {
        match (self.stop)() {
            true => Err(Error::Interrupted { t: t_s, partial: false }),
            false => Ok(()),
        }
    }

    /// Returns the sampling interval (s).
    pub(super) fn step_s(&self) -> f64 {
        self.times[1]
    }

    /// Returns the motion with changed joint positions.
    fn moved(&self, change: &DMatrix<f64>) -> Result<Motion, Error> {
        self.moved_and_held(change, 0)
    }

    /// Returns the changed motion, held at its end for `beyond` more samples.
    fn moved_and_held(&self, change: &DMatrix<f64>, beyond: usize) -> Result<Motion, Error> {
        let (m, h, last) = (self.q.nrows(), self.step_s(), self.times.len() - 1);
        let correction = |k: usize, i: i64| change[(k, i.clamp(0, last as i64) as usize)];
        let mut reference = vec![Vec::with_capacity(last + 1); m];
        let (mut q, mut v, mut a) = (vec![0.0; m], vec![0.0; m], vec![0.0; m]);
        let times = self.times_and(beyond);
        for t in &times {
            self.motion.trajectory.sample(*t, &mut q, &mut v, &mut a);
            (0..m).for_each(|k| reference[k].push([q[k], v[k], a[k]]));
        }
        let joint = |k: usize| {
            let mut knots = JointKnots { name: self.motion.trajectory.joints()[k].clone(), ..JointKnots::default() };
            for (i, [q, v, a]) in reference[k].iter().enumerate() {
                let i = i as i64;
                // Fourth-order central differences; the change is at rest at both ends.
                let inner = i > 0 && i < last as i64;
                let rate = (8.0 * (correction(k, i + 1) - correction(k, i - 1))
                    - (correction(k, i + 2) - correction(k, i - 2)))
                    / (12.0 * h);
                let acceleration = (16.0 * (correction(k, i + 1) + correction(k, i - 1))
                    - (correction(k, i + 2) + correction(k, i - 2))
                    - 30.0 * correction(k, i))
                    / (12.0 * h * h);
                let (rate, acceleration) = if inner { (rate, acceleration) } else { (0.0, 0.0) };
                knots.position.push(q + correction(k, i));
                knots.velocity.push(v + rate);
                knots.acceleration.push([a + acceleration; 2]);
            }
            knots
        };
        let joints: Vec<JointKnots> = (0..m).map(joint).collect();
        let trajectory = Trajectory::through_knots(&times, &joints)?;
        Motion::along(trajectory, &format!("{}_compensated", self.motion.name), self.arm.robot())
    }

    /// Returns the sampling times and `beyond` further ones.
    fn times_and(&self, beyond: usize) -> Vec<f64> {
        let further = (0..beyond).map(|k| self.step_s() * (self.times.len() + k) as f64);
        self.times.iter().copied().chain(further).collect()
    }

    /// Returns the unchanged motion, at the times of this job.
    pub(super) fn as_it_is(&self) -> Result<Motion, Error> {
        self.moved(&DMatrix::zeros(self.q.nrows(), self.q.ncols()))
    }

    /// Runs a motion on an arm, with the loads of the scenario.
    pub(super) fn simulated(&self, arm: &Arc<Arm>, run: &RunOptions, motion: &Motion) -> Result<RunResult, Error> {
        self.simulated_until(arm, run, motion, 0)
    }

    /// Runs a motion that is held at its end for `beyond` more samples.
    fn simulated_until(
        &self,
        arm: &Arc<Arm>,
        run: &RunOptions,
        motion: &Motion,
        beyond: usize,
    ) -> Result<RunResult, Error> {
        let options =
            RunOptions { log_rate_hz: 1.0 / self.step_s(), with_twin: false, ignore_limits: true, ..run.clone() };
        let mut progress = |_, _| if (self.stop)() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
        let request = RunRequest { progress: Some(&mut progress), ..RunRequest::default() };
        let run = arm.simulate_with(self.along(motion), &options, request)?;
        // Displacement and rotation of the TCP from the desired pose, at the samples of this job.
        let (t, p, r) = (run.time_s(), run.values("tcp_position"), run.values("tcp_quaternion_wxyz"));
        let times = self.times_and(beyond);
        let mut error = DMatrix::zeros(6, times.len());
        for (k, time) in times.iter().enumerate() {
            let row = t.partition_point(|x| *x < time - 0.5 * self.step_s()).min(t.len() - 1);
            let off = (t[row] - time).abs();
            if off > LOGGED_WITHIN * self.step_s() {
                let message = format!(
                    "the run has no sample at {t_s} s (off by {off:.1e} s): choose a step that divides 0.001 s",
                    t_s = *time
                );
                return Err(CompensateError::Input(message).into());
            }
            let place = Translation3::new(p[3 * row], p[3 * row + 1], p[3 * row + 2]);
            let turn = Quaternion::new(r[4 * row], r[4 * row + 1], r[4 * row + 2], r[4 * row + 3]);
            let turn: Rotation3<f64> = UnitQuaternion::from_quaternion(turn).to_rotation_matrix();
            let wanted = &self.wanted[k.min(self.wanted.len() - 1)];
            let moved = place.vector - wanted.translation.vector;
            let turned = rotation_vector((turn * wanted.rotation.inverse()).matrix());
            error.fixed_view_mut::<3, 1>(0, k).copy_from(&moved);
            error.fixed_view_mut::<3, 1>(3, k).copy_from(&turned);
        }
        // Maximum effort of each drive.
        let (m, effort) = (self.q.nrows(), run.values("effort"));
        let worst = |k: usize| {
            let zero = Extreme { time_s: 0.0, value: 0.0 };
            t.iter().zip(effort.iter().skip(k).step_by(m)).fold(zero, |worst, (&time_s, &value)| {
                if value.abs() > worst.value.abs() { Extreme { time_s, value } } else { worst }
            })
        };
        Ok(RunResult { error, efforts: (0..m).map(worst).collect() })
    }

    /// Returns the TCP error on the model with changed joint positions, including `beyond` samples
    /// held at the end.
    fn error(&self, change: &DMatrix<f64>, beyond: usize) -> Result<DMatrix<f64>, Error> {
        let motion = self.moved_and_held(change, beyond)?;
        Ok(self.simulated_until(self.arm, &self.request.run, &motion, beyond)?.error)
    }

    /// Returns a motion with the loads, payloads and start of the scenario.
    pub(super) fn along(&self, motion: &Motion) -> Scenario {
        Scenario { motion: motion.clone(), ..self.scenario.clone() }
    }

    /// Linearises the arm along the motion.
    fn inversion(&self) -> Result<Inversion, Error> {
        let duration = self.motion.trajectory.duration();
        let count = ((duration / NODE_S).ceil() as usize).max(1);
        let spacing = duration / count as f64;
        let start = self.at_start()?;
        let node = |k: usize| {
            self.go_on(spacing * k as f64)?;
            self.node(&start, spacing * k as f64)
        };
        let nodes = (0..=count).into_par_iter().map(node).collect::<Result<Vec<Node>, Error>>()?;
        let inversion = Inversion::new(&nodes, spacing).map_err(CompensateError::from)?;
        Ok(match self.request.cutoff_hz {
            Some(hz) => inversion.below(hz),
            None => inversion,
        })
    }

    /// Returns the arm held at the start of the motion: servo gains and damping of a run are those
    /// of its start.
    fn at_start(&self) -> Result<Plant, Error> {
        let fixed = Held(self.q.column(0).iter().copied().collect());
        let plant = self.arm.plant(Arc::new(fixed)).map_err(|error| self.arm.explained(error))?;
        let mut axes = plant.servo.iter().flat_map(|servo| &servo.axes);
        match axes.find(|axis| axis.position_gain * axis.velocity_gain <= 0.0) {
            Some(axis) => {
                let joint = self.motion.trajectory.joints()[axis.coordinate].clone();
                Err(CompensateError::Input(format!(
                    "the servo of joint {joint:?} does not control position, so that no targets can be computed for \
                     it: set its position_gain and velocity_gain, or use motors that follow their commands exactly \
                     (drives = elastic)"
                ))
                .into())
            }
            None => Ok(plant),
        }
    }

    /// Linearises the arm at a time of the motion, with the motors of servos free.
    fn node(&self, start: &Plant, t: f64) -> Result<Node, Error> {
        let (arm, m) = (self.arm, self.q.nrows());
        let (mut q, mut v, mut a) = (vec![0.0; m], vec![0.0; m], vec![0.0; m]);
        self.motion.trajectory.sample(t, &mut q, &mut v, &mut a);
        let servo = start.servo.as_ref().map(|servo| controllers(servo, &q, &start.friction));
        let plant = start.along(Arc::new(Held(q))).with_servo_opened();
        let at = linearise(&plant, &arm.tcp, &Wrench::zeros(), 0.0).map_err(|error| arm.explained(error))?;
        let rows = |M: &Matrix6xX<f64>| DMatrix::from_fn(self.rows.len(), M.ncols(), |i, j| M[(self.rows[i], j)]);
        let (J, J_a) = (rows(&at.J), rows(&at.J_a));
        Ok(Node { M: at.M, D: at.D, K: at.K, M_a: at.M_a, D_a: at.D_a, K_a: at.K_a, J, J_a, servo })
    }

    /// Whether all joints are at rest at the end of the motion.
    fn ends_at_rest(&self) -> bool {
        let m = self.q.nrows();
        let (mut q, mut v, mut a) = (vec![0.0; m], vec![0.0; m], vec![0.0; m]);
        self.motion.trajectory.sample(self.motion.trajectory.duration(), &mut q, &mut v, &mut a);
        v.iter().all(|v| v.abs() < REST)
    }

    /// Returns the number of samples for which the motion is held at its end, so that the inverse
    /// includes the residual vibration of the TCP. Zero with loads, which are known up to the end
    /// only, and if the joints do not come to rest.
    fn samples_beyond(&self, inversion: &Inversion) -> usize {
        match self.scenario.loads.is_empty() && self.ends_at_rest() {
            true => (inversion.edge_s() / self.step_s()).ceil() as usize,
            false => 0,
        }
    }

    /// Returns the commands of the unchanged motion, whose error is given.
    fn unchanged(&self, inversion: &Inversion, error: &DMatrix<f64>) -> Commands {
        Commands {
            motion: self.motion.clone(),
            change: DMatrix::zeros(self.q.nrows(), self.q.ncols()),
            peaks: vec![peak(error)],
            kept: 0,
            cutoff_hz: Some(inversion.cutoff_hz()),
            fewest: inversion.fewest_directions(),
            quicker: 0.0,
            discarded: Vec::new(),
        }
    }

    /// Corrects the commands by the inverse of the arm until the error settles. An iteration that
    /// increases the RMS or the largest error by more than a factor of 1/[`SETTLED`] is discarded,
    /// and the next one corrects up to half the frequency.
    pub(super) fn dynamic(&self) -> Result<Commands, Error> {
        // Error of the unchanged motion, held at its end as long as the inverse looks ahead.
        let mut inversion = self.inversion()?;
        let (m, N) = self.q.shape();
        let within = |error: &DMatrix<f64>| error.columns(0, N).into_owned();
        let size = |error: &DMatrix<f64>| {
            let rows = error.select_rows(&self.rows);
            [rows.norm(), rows.amax()]
        };
        let mut beyond = self.samples_beyond(&inversion);
        let mut whole = self.error(&DMatrix::zeros(m, N), beyond)?;
        let mut error = within(&whole);
        let mut best = self.unchanged(&inversion, &error);
        let first = size(&error);
        let mut least = first;
        let most = if first[0] > 0.0 { self.request.iterations } else { 0 };
        // Each iteration adds the commands that cancel the present error on the linearised arm.
        for iteration in 1..=most {
            let y = -whole.select_rows(&self.rows);
            let change = &best.change + inversion.commands(&y, self.step_s()).columns(0, N);
            let next = self.error(&change, beyond)?;
            let left = size(&within(&next));
            let [rms, largest] = [left[0] / least[0], left[1] / least[1]];
            let growth = if rms.is_nan() { rms } else { rms.max(largest) };
            // Diverged or larger: back to the best change, corrected up to half the frequency.
            if growth.is_nan() || growth > 1.0 / SETTLED {
                let cutoff_hz = inversion.cutoff_hz();
                best.discarded.push(Discarded { iteration, cutoff_hz, growth });
                if 0.5 * cutoff_hz < lowest_cutoff_hz(&self.motion.trajectory) {
                    break;
                }
                inversion = inversion.below(0.5 * cutoff_hz);
                beyond = self.samples_beyond(&inversion);
                whole = self.error(&best.change, beyond)?;
                continue;
            }
            if rms >= 1.0 {
                break;
            }
            let settled = rms.min(largest) > SETTLED || left[0] < ENOUGH * first[0];
            (least, best.motion, best.change) = (left, self.moved(&change)?, change);
            best.kept += 1;
            best.peaks.push(peak(&within(&next)));
            best.cutoff_hz = Some(inversion.cutoff_hz());
            error = within(&next);
            whole = next;
            if settled {
                break;
            }
        }
        // Share of what is left that lies above the cutoff.
        let left_over = error.select_rows(&self.rows);
        best.quicker =
            inversion.quicker_than_cutoff(&left_over, self.step_s()).norm() / left_over.norm().max(f64::MIN_POSITIVE);
        Ok(best)
    }

    /// Corrects each node to its static equilibrium, with a cubic spline between the nodes.
    pub(super) fn at_rest(&self) -> Result<Commands, Error> {
        // Static targets at the nodes, under the mean loads there.
        let (m, N) = self.q.shape();
        let plant = self.at_start()?;
        let end = self.scenario.duration_s();
        let loads = self.scenario.loads.iter().map(|load| averaged(load, end, |_| None)).collect();
        let scenario = Scenario { loads, ..self.scenario.clone() };
        let (plant, _) = loaded(self.arm.robot(), &scenario, &self.request.run, plant)?;
        let every = ((NODE_S / self.step_s()).round() as usize).max(1);
        let nodes: Vec<usize> = (0..N - 1).step_by(every).chain([N - 1]).collect();
        let one = |k: &usize| {
            self.go_on(self.times[*k])?;
            let q: Vec<f64> = self.q.column(*k).iter().copied().collect();
            let found =
                static_targets(&plant, &self.arm.tcp, &q, &Wrench::zeros(), self.times[*k], &self.request.components);
            let t = self.times[*k];
            let found = found.map_err(|source| CompensateError::Input(format!("at {t:.3} s: {source}")))?;
            Ok::<_, Error>(DVector::from_iterator(m, found.q.iter().zip(&q).map(|(new, old)| new - old)))
        };
        let found: Vec<DVector<f64>> = nodes.par_iter().map(one).collect::<Result<_, Error>>()?;
        let mut change = DMatrix::zeros(m, N);
        for k in 0..N {
            let i = nodes.partition_point(|node| *node <= k).clamp(1, nodes.len() - 1);
            let (a, b) = (nodes[i - 1], nodes[i]);
            let s = (k - a) as f64 / (b - a) as f64;
            // Cubic Hermite interpolation; slopes by central differences, zero at both ends.
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
        let peaks = vec![peak(&self.error(&DMatrix::zeros(m, N), 0)?), peak(&self.error(&change, 0)?)];
        Ok(Commands {
            motion,
            change,
            peaks,
            kept: 1,
            cutoff_hz: None,
            fewest: None,
            quicker: 0.0,
            discarded: Vec::new(),
        })
    }
}

/// Linearises the servos about a pose.
fn controllers(servo: &Servo, q: &[f64], friction: &[Friction]) -> NodeServo {
    let gains = |value: fn(&ServoAxis) -> f64| DVector::from_iterator(servo.axes.len(), servo.axes.iter().map(value));
    NodeServo {
        axes: servo.axes.iter().map(|axis| axis.coordinate).collect(),
        stiffness: gains(|axis| axis.velocity_gain * axis.position_gain + axis.integral_gain),
        damping: gains(|axis| axis.velocity_gain),
        integral: gains(|axis| axis.integral_gain * axis.position_gain),
        ahead: servo.fed_forward(q, friction),
    }
}

/// Averages a load about each time, over a node or whole periods, since faster changes do not move
/// an arm at rest. Where the arm rests longer than that, the mean is over its rest; times before
/// the motion and after its end (s) are left out.
pub(super) fn averaged(
    load: &AppliedLoad,
    end: f64,
    rest: impl Fn(f64) -> Option<[f64; 2]> + Send + Sync + 'static,
) -> AppliedLoad {
    let wrench = load.wrench.clone();
    let period = wrench.period;
    let window = if period > 0.0 && period < NODE_S { period * (NODE_S / period).ceil() } else { NODE_S };
    let mean = TimedWrench::new({
        let wrench = wrench.clone();
        move |t| {
            let [from, to] = rest(t).filter(|[from, to]| to - from > window).unwrap_or_else(|| {
                let from = (t - 0.5 * window).min(end - window).max(0.0);
                [from, from + window]
            });
            let pieces = PIECES * ((to - from) / window).ceil().clamp(1.0, LONGEST_REST) as u32;
            let at = |k: u32| from + (to - from) * (f64::from(k) + 0.5) / f64::from(pieces);
            (0..pieces).fold(Wrench::zeros(), |sum, k| sum + wrench.at(at(k)) * (1.0 / f64::from(pieces)))
        }
    });
    let mut averaged = load.clone();
    averaged.wrench = mean.in_axes(wrench.axes);
    averaged
}

/// Returns the distance of the TCP from its desired position at each sample (m).
///
/// * `error`: 6×N, linear part first.
pub(super) fn distances(error: &DMatrix<f64>) -> Vec<f64> {
    error.column_iter().map(|e| e.rows(0, 3).norm()).collect()
}

/// Returns the largest distance (m).
fn peak(error: &DMatrix<f64>) -> f64 {
    distances(error).into_iter().fold(0.0, f64::max)
}
