//! Derivatives of the TCP error along a motion: central differences of whole runs, on all cores.
//!
//! ```text
//! de/dx = (e(x + h) - e(x - h)) / 2h,    off by h²/6 d³e/dx³ (truncation) and ε/h (rounding)
//! ```
//! ε is 2e-14 m or rad: the runs iterate to the end ([`ExactRun`]), so that only rounding separates
//! them from smooth functions of x. A stiffness, a mass and a shift of the motion change natural
//! frequencies, and so the phases of modes: until a mode with damping ratio ζ has died out, by
//! `x/4ζ` or so, which makes the third derivative `1/16ζ²` of the first. With [`OF_FREQUENCY`] both
//! errors are below 1e-6 down to ζ = 0.005. Dampers, friction and gains of servos change amplitudes:
//! their third derivative is about the first, and both are small, so that rounding requires the
//! longer step [`OF_AMPLITUDE`].
//!
//! Start at [`Repeated::slopes`]. Errors are displacement and rotation vector, world axes. Not here:
//! derivatives at a pose, which are in closed form ([`super::pose`]).

use std::sync::Arc;

use flexarm_identify::{Effect, NominalArm, Parameter};
use flexarm_kinematics::{Pose, SpatialInertia};
use flexarm_run::prepare::loaded;
use flexarm_run::robot::PAYLOAD_LINK;
use flexarm_run::{Arm, Error, RunOptions, Scenario};
use flexarm_stepping::{ExactRun, Friction, PrescribedMotion, ServoAxis, ToolErrors, TorqueLimited};
use nalgebra::Vector3;
use rayon::prelude::*;

/// Relative step of parameters that change natural frequencies or the motion.
const OF_FREQUENCY: f64 = 3e-5;
/// Relative step of parameters that change amplitudes alone.
const OF_AMPLITUDE: f64 = 5e-4;

/// Place of a number in a friction law.
pub(super) type OfFriction = fn(&mut Friction) -> &mut f64;
/// Place of a number in a controller.
pub(super) type OfAxis = fn(&mut ServoAxis) -> &mut f64;

/// Parameter with respect to which a run is differentiated.
#[derive(Clone, Debug)]
pub enum RunParameter {
    /// Parameter of the arm, per unit of its search coordinate: of the logarithm if it is
    /// logarithmic.
    Arm(Parameter),
    /// Shift of a joint's whole motion, given by its coordinate (per rad or m).
    Joint(usize),
    /// Shift of the tool's point along a vector, tool axes (per m).
    Tool(Vector3<f64>),
    /// Factor on a number of the friction law of a joint, given by its coordinate. It has an effect
    /// only on joints under servo control.
    Friction(usize, OfFriction),
    /// Factor on a number of the controller of a joint, given by the number of its axis.
    Servo(usize, OfAxis),
}

/// TCP error along a run (flexible minus rigid arm) and its derivatives, one number per parameter
/// in their order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunSlopes {
    /// Steps taken.
    pub steps: u64,
    /// Position error (m).
    pub position: ErrorSlopes,
    /// Rotation error (rad).
    pub rotation: ErrorSlopes,
    /// Servos that reached their torque limits, in order of the time of the first limited sample.
    pub limited: Vec<TorqueLimited>,
    /// Times of the start and of the end of every step (s), if kept.
    pub times_s: Vec<f64>,
    /// Errors at these times: displacement (m) and rotation vector (rad), world axes.
    pub errors: Vec<[f64; 6]>,
    /// Derivatives of the errors at these times, parameter by parameter.
    pub slopes: Vec<Vec<[f64; 6]>>,
}

/// Peak and root mean square of an error, with derivatives.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ErrorSlopes {
    /// Maximum.
    pub peak: f64,
    /// Time of the first maximum (s).
    pub t_peak_s: f64,
    /// Root mean square.
    pub rms: f64,
    /// Derivatives of `peak`, at the time of the peak.
    pub peak_slopes: Vec<f64>,
    /// Derivatives of `rms`.
    pub rms_slopes: Vec<f64>,
}

impl ErrorSlopes {
    /// Returns peak and RMS of the errors, whose components begin at `first`.
    fn of(found: &ToolErrors, first: usize) -> Self {
        let sizes = || found.errors.iter().map(|error| part(error, first).norm());
        let (at, peak) = sizes().enumerate().fold((0, 0.0), |most, own| if own.1 > most.1 { own } else { most });
        let rms = (sizes().map(|size| size * size).sum::<f64>() / found.errors.len() as f64).sqrt();
        Self { peak, t_peak_s: found.times_s[at], rms, ..Self::default() }
    }

    /// Adds a parameter with the derivatives `slopes` of the errors of `found`.
    fn include(&mut self, found: &ToolErrors, slopes: &[[f64; 6]], first: usize) {
        let along = |(error, slope): (&[f64; 6], &[f64; 6])| part(error, first).dot(&part(slope, first));
        let over = |x: f64, size: f64| if size > 0.0 { x / size } else { 0.0 };
        let pairs = || found.errors.iter().zip(slopes);
        let peak = pairs().zip(&found.times_s).find(|(_, t)| **t == self.t_peak_s).map_or(0.0, |(pair, _)| along(pair));
        self.peak_slopes.push(over(peak, self.peak));
        self.rms_slopes.push(over(pairs().map(along).sum(), self.rms * slopes.len() as f64));
    }
}

/// Returns the displacement (`first` 0) or the rotation (3) of an error.
fn part(of: &[f64; 6], first: usize) -> Vector3<f64> {
    Vector3::new(of[first], of[first + 1], of[first + 2])
}

/// A motion with one joint shifted.
struct Shifted {
    motion: Arc<dyn PrescribedMotion>,
    joint: usize,
    by: f64,
}

impl PrescribedMotion for Shifted {
    fn sample(&self, t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]) {
        self.motion.sample(t, q, qdot, qddot);
        q[self.joint] += self.by;
    }

    fn velocity_jumps(&self) -> Vec<f64> {
        self.motion.velocity_jumps()
    }

    fn added_torque(&self, t: f64, coordinate: usize) -> f64 {
        self.motion.added_torque(t, coordinate)
    }
}

/// A run of an arm along a scenario, to be repeated with changed parameters.
pub(super) struct Repeated<'a> {
    pub(super) arm: &'a Arm,
    pub(super) scenario: &'a Scenario,
    pub(super) options: &'a RunOptions,
    pub(super) run: ExactRun,
    pub(super) nominal: NominalArm,
}

impl Repeated<'_> {
    /// Computes the error and its derivatives; `keep_samples`: also over time.
    pub(super) fn slopes(&self, parameters: &[RunParameter], keep_samples: bool) -> Result<RunSlopes, Error> {
        // The run itself, then two runs per parameter, a step to each side.
        let found = self.errors(None)?;
        let (mut position, mut rotation) = (ErrorSlopes::of(&found, 0), ErrorSlopes::of(&found, 3));
        let mut kept = Vec::new();
        // Some at a time: the errors of all of them would fill the memory.
        for few in parameters.chunks(2 * rayon::current_num_threads()) {
            let steps: Vec<f64> = few.iter().map(|parameter| self.step(parameter)).collect();
            let run = |k: usize| {
                let x = if k.is_multiple_of(2) { steps[k / 2] } else { -steps[k / 2] };
                self.errors(Some((&few[k / 2], x))).map(|found| found.errors)
            };
            let runs = (0..2 * few.len()).into_par_iter().map(run).collect::<Result<Vec<_>, Error>>()?;
            for (pair, h) in runs.chunks_exact(2).zip(&steps) {
                let both = pair[0].iter().zip(&pair[1]);
                let difference = |(a, b): (&[f64; 6], &[f64; 6])| std::array::from_fn(|i| (a[i] - b[i]) / (2.0 * h));
                let own: Vec<[f64; 6]> = both.map(difference).collect();
                position.include(&found, &own, 0);
                rotation.include(&found, &own, 3);
                kept.extend(keep_samples.then_some(own));
            }
        }
        let (steps, limited) = (found.errors.len() as u64 - 1, found.limited);
        let (times_s, errors) = if keep_samples { (found.times_s, found.errors) } else { Default::default() };
        Ok(RunSlopes { steps, position, rotation, limited, times_s, errors, slopes: kept })
    }

    /// Returns the step of the differences, in the unit of the parameter.
    fn step(&self, parameter: &RunParameter) -> f64 {
        match parameter {
            RunParameter::Arm(own) => match &own.effect {
                Effect::Damping(_) | Effect::Damper { .. } => OF_AMPLITUDE,
                Effect::Mass(on) => {
                    let bodies = self.nominal.model.bodies();
                    let all: f64 = bodies.iter().skip(1).map(|body| body.inertia.mass).sum();
                    let own: f64 = on.iter().map(|(body, _)| bodies[*body].inertia.mass).sum();
                    OF_FREQUENCY * own.max(1e-3 * all)
                }
                Effect::Entry { size, .. } => OF_FREQUENCY * size,
                Effect::Guide { size, .. } if !own.is_logarithmic() => OF_FREQUENCY * size,
                _ => OF_FREQUENCY,
            },
            RunParameter::Joint(_) => OF_FREQUENCY,
            RunParameter::Tool(_) | RunParameter::Friction(..) | RunParameter::Servo(..) => OF_AMPLITUDE,
        }
    }

    /// Runs the arm with one parameter changed; its controllers know the change.
    fn errors(&self, change: Option<(&RunParameter, f64)>) -> Result<ToolErrors, Error> {
        // Changes of the arm, the motion and the tool come before the plant is built from them.
        let mut arm = self.arm.clone();
        let (mut robot, mut springs) = (self.arm.robot().clone(), arm.springs.clone());
        let (mut motion, mut run) = (self.scenario.motion.prescribed(), self.run.clone());
        match change {
            Some((RunParameter::Arm(own), x)) => {
                let changed = self.nominal.with(std::slice::from_ref(own), &[x]);
                (arm.model, springs, run.tool) = (changed.model, changed.springs, changed.tool);
                if let (Effect::Mass(_), Some(frame)) = (&own.effect, arm.rigid.frame(PAYLOAD_LINK)) {
                    let mut inertia = arm.rigid.bodies()[frame.body].inertia;
                    inertia += SpatialInertia { mass: x, ..SpatialInertia::zeros() }.at_parent(&frame.X_BF);
                    arm.rigid = Arc::new(arm.rigid.with_inertia(frame.body, inertia));
                    // Another payload takes the place of all of it.
                    let links = robot.rigid.links.iter_mut().filter(|link| link.name == PAYLOAD_LINK);
                    links.filter_map(|link| link.inertia.as_mut()).for_each(|inertia| inertia.mass += x);
                }
            }
            Some((RunParameter::Joint(joint), by)) => motion = Arc::new(Shifted { motion, joint: *joint, by }),
            Some((RunParameter::Tool(along), x)) => run.tool.X_BF *= Pose::from(along * x),
            _ => {}
        }
        // Friction and gains are changed in the plant.
        let explained = |error| self.arm.explained(error);
        let mut plant = arm.plant_with(springs, motion).map_err(explained)?;
        match change {
            Some((RunParameter::Friction(coordinate, of), x)) => *of(&mut plant.friction[*coordinate]) *= 1.0 + x,
            Some((RunParameter::Servo(number, of), x)) => {
                if let Some(servo) = &mut plant.servo {
                    *of(&mut Arc::make_mut(servo).axes[*number]) *= 1.0 + x;
                }
            }
            _ => {}
        }
        let (plant, _) = loaded(&robot, self.scenario, self.options, plant)?;
        run.errors(&plant).map_err(explained)
    }
}
