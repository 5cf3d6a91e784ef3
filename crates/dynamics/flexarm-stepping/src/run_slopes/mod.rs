//! How a whole run changes with parameters of the arm and of its motion: the tangent of
//! generalised-alpha, all parameters side by side.
//!
//! ```text
//! r(q, q̇, q̈; p) = 0:     M δẍ + V δẋ + K δx = -(∂r/∂p + K_a δq_a + V_a δq̇_a + M_a δq̈_a)                           (1)
//! ```
//! holds at the end of every step, with `K = ∂r/∂x`, `V = ∂r/∂ẋ` in closed form
//! ([`flexarm_kinematics::DynamicTangent`]), where loops close or links bend in modes by
//! differences of the recursions (`forces.rs`); the formulas that join x, ẋ and ẍ of two steps are
//! linear, so that a step is one linear system for all parameters: a column each. What differs from
//! a run of [`crate::GeneralizedAlpha`] is that its iterations go on to the end and that the matrix
//! of its dispersion correction is that of the start of each step: a run whose result is a smooth
//! function of the parameters, of which differences can be taken ([`GeneralizedAlpha::exactly`]).
//! An ordinary run differs from it by what its iterations leave, far less than the error of its
//! step.
//!
//! Torques under servos are held from sample to sample, and so are their derivatives (`servo.rs`);
//! ripple, hysteresis, coupling and friction by load are in `gears.rs`. Start at [`run_slopes`].
//! Not here: names and units of parameters (`flexarm-identify`), motions whose velocity jumps under
//! servos, links that stiffen under load: these are refused.

mod columns;
mod forces;
mod gears;
mod lu;
mod recurrence;
mod servo;
mod tangent;
mod tool;

use std::sync::Arc;

use flexarm_kinematics::{Frame, SpatialInertia};
use nalgebra::{DMatrix, DVector, Vector3};

use crate::arm::FlexibleArm;
use crate::drive::Friction;
use crate::error::StepError;
use crate::events::SAME_TIME;
use crate::motion::PrescribedMotion;
use crate::statics::static_equilibrium;
use crate::stepper::Start;
use crate::steppers::AlphaSettings;
use recurrence::Recurrence;
use tool::ToolError;

/// A parameter as the equations of motion see it: what changes per unit of it.
#[derive(Clone, Default)]
pub struct Direction {
    /// Stiffness of springs, by their number.
    pub springs: Vec<(usize, SpringSlope)>,
    /// Stiffness of all elastic coordinates together, where springs are coupled.
    pub stiffness: Option<DMatrix<f64>>,
    /// Damping matrix of the elastic coordinates.
    pub damping: Option<DMatrix<f64>>,
    /// The same after each change of inertia, in their order; as before without.
    pub dampings_after: Vec<DMatrix<f64>>,
    /// Inertia of bodies, about Bo, B axes; until another one is put in its place on the way.
    pub inertias: Vec<(usize, SpatialInertia)>,
    /// Inertia of bodies of the rigid robot that servos feed forward, about Bo, B axes.
    pub fed_forward: Vec<(usize, SpatialInertia)>,
    /// Friction of actuated coordinates: changes of the numbers of their law.
    pub friction: Vec<(usize, Friction)>,
    /// Controllers, by the number of the axis in [`crate::Servo::axes`].
    pub servo: Vec<(usize, AxisSlope)>,
    /// Motion of the joints; of those driven by torque their reference.
    pub motion: Option<Arc<dyn PrescribedMotion>>,
    /// Place of the tool's point, tool axes (m).
    pub tool: Vector3<f64>,
}

/// Change of the controller of an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxisSlope {
    /// Of [`crate::ServoAxis::position_gain`] (1/s).
    pub position_gain: f64,
    /// Of [`crate::ServoAxis::velocity_gain`] (N m s/rad).
    pub velocity_gain: f64,
    /// Of [`crate::ServoAxis::integral_gain`] (N m/rad).
    pub integral_gain: f64,
    /// So many times the torque that is fed forward.
    pub feed_forward: f64,
}

impl Direction {
    /// Change of the damping matrix after so many changes of inertia.
    fn damping_after(&self, changes: usize) -> Option<&DMatrix<f64>> {
        let later = changes.checked_sub(1).and_then(|k| self.dampings_after.get(k));
        later.or(self.damping.as_ref())
    }

    /// Change of inertias that is still there after so many changes of inertia.
    fn inertias_after<'a>(
        &'a self,
        arm: &'a FlexibleArm,
        changes: usize,
    ) -> impl Iterator<Item = (usize, &'a SpatialInertia)> {
        let over = &arm.inertia_changes[..changes];
        let there = move |body: usize| over.iter().all(|change| change.body != body);
        self.inertias.iter().filter(move |(body, _)| there(*body)).map(|(body, more)| (*body, more))
    }

    /// Change of the controller of an axis.
    fn axis(&self, number: usize) -> AxisSlope {
        let own = self.servo.iter().filter(|(axis, _)| *axis == number);
        own.fold(AxisSlope::default(), |sum, (_, by)| AxisSlope {
            position_gain: sum.position_gain + by.position_gain,
            velocity_gain: sum.velocity_gain + by.velocity_gain,
            integral_gain: sum.integral_gain + by.integral_gain,
            feed_forward: sum.feed_forward + by.feed_forward,
        })
    }
}

/// Change of a spring.
#[derive(Clone, Debug, PartialEq)]
pub enum SpringSlope {
    /// So many times the spring itself, matrix or curve.
    Factor(f64),
    /// Of its matrix.
    Matrix(DMatrix<f64>),
}

/// What is asked of [`run_slopes`].
#[derive(Clone, Debug)]
pub struct SlopesRequest {
    /// Settings of generalised-alpha.
    pub settings: AlphaSettings,
    /// Step (s).
    pub step_s: f64,
    /// How long (s); the last step may pass that.
    pub duration_s: f64,
    /// Where it starts.
    pub start: Start,
    /// The tool.
    pub tool: Frame,
    /// Whether to keep the errors and slopes after every step.
    pub keep_samples: bool,
}

/// Error of the tool along a run, flexible less rigid, and its derivatives: a number per direction,
/// in their order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunSlopes {
    /// Steps taken.
    pub steps: u64,
    /// Distance (m).
    pub position: ErrorSlopes,
    /// Angle (rad).
    pub rotation: ErrorSlopes,
    /// Servos that were at their torque limits, by the time when they first were.
    pub limited: Vec<TorqueLimited>,
    /// Times of the start and after every step (s), if kept.
    pub times_s: Vec<f64>,
    /// Error then: displacement (m) and rotation vector (rad), world axes.
    pub errors: Vec<[f64; 6]>,
    /// Its derivatives, a column per direction: those of one time after those of the time before.
    pub slopes: Vec<[f64; 6]>,
}

/// A servo that was at its torque limit: the derivatives are those with these very samples at the
/// limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueLimited {
    /// Coordinate of the joint.
    pub coordinate: usize,
    /// In how many samples.
    pub samples: u64,
    /// When first (s).
    pub first_s: f64,
}

/// Largest and mean size of an error, with derivatives.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ErrorSlopes {
    /// Largest.
    pub peak: f64,
    /// When, for the first time (s).
    pub t_peak_s: f64,
    /// Root of the mean square.
    pub rms: f64,
    /// Of `peak`, at the time where it is.
    pub peak_slopes: Vec<f64>,
    /// Of `rms`.
    pub rms_slopes: Vec<f64>,
}

impl ErrorSlopes {
    fn new(directions: usize) -> Self {
        Self { peak_slopes: vec![0.0; directions], rms_slopes: vec![0.0; directions], ..Self::default() }
    }

    /// Takes in the error of a time; until the end `rms` and its slopes are sums.
    fn include<'a>(&mut self, t: f64, error: Vector3<f64>, slopes: impl Iterator<Item = Vector3<f64>> + Clone + 'a) {
        let size = error.norm();
        self.rms += error.norm_squared();
        for (sum, slope) in self.rms_slopes.iter_mut().zip(slopes.clone()) {
            *sum += error.dot(&slope);
        }
        if size > self.peak {
            (self.peak, self.t_peak_s) = (size, t);
            for (to, slope) in self.peak_slopes.iter_mut().zip(slopes) {
                *to = error.dot(&slope) / size;
            }
        }
    }

    fn finish(&mut self, samples: f64) {
        self.rms = (self.rms / samples).sqrt();
        let scale = if self.rms > 0.0 { 1.0 / (samples * self.rms) } else { 0.0 };
        self.rms_slopes.iter_mut().for_each(|slope| *slope *= scale);
    }
}

/// Error of the tool along a run and its exact derivatives in some directions; without any the run
/// alone, to the end of each iteration.
///
/// Cost: with 18 coordinates about ten ordinary runs, of which a step is often one evaluation, and
/// a quarter of one for each direction. No allocation in the steps but for what is kept of them.
///
/// # Errors
/// [`StepError::NoSlopes`] where the arm has what is not differentiated; [`StepError::Setup`] for a
/// step that is no time or a spring that is not there; else as a stepper.
pub fn run_slopes(
    arm: &FlexibleArm,
    request: &SlopesRequest,
    directions: &[Direction],
) -> Result<RunSlopes, StepError> {
    let mut arm = arm.clone();
    arm.carry_from_start()?;
    check(&arm, request, directions)?;
    let e = match request.start {
        Start::Equilibrium => static_equilibrium(&arm, 0.0)?,
        Start::Undeformed => DVector::zeros(arm.n_elastic_coordinates()),
    };
    let mut tool = ToolError::new(&arm, &request.tool, directions);
    let mut run = Recurrence::new(arm, request, directions, &e)?;
    let count = directions.len();
    let mut found =
        RunSlopes { position: ErrorSlopes::new(count), rotation: ErrorSlopes::new(count), ..RunSlopes::default() };
    let steps = (request.duration_s / request.step_s - 1e-9).ceil().max(0.0) as u64;
    for step in 0..=steps {
        if step > 0 {
            run.step()?;
        }
        let error = tool.look(&run);
        let parts = |k: usize| error.fixed_rows::<3>(k).into_owned();
        let t = run.time();
        let slopes = &tool.slopes;
        found.position.include(t, parts(0), slopes.iter().map(|s| Vector3::new(s[0], s[1], s[2])));
        found.rotation.include(t, parts(3), slopes.iter().map(|s| Vector3::new(s[3], s[4], s[5])));
        if request.keep_samples {
            found.times_s.push(t);
            found.errors.push(error.into());
            found.slopes.extend_from_slice(slopes);
        }
    }
    found.steps = steps;
    found.limited = run.limited();
    found.position.finish((steps + 1) as f64);
    found.rotation.finish((steps + 1) as f64);
    Ok(found)
}

/// Change of the elastic coordinates at rest at the start, n × p.
///
/// # Errors
/// As [`run_slopes`].
pub fn equilibrium_slopes(arm: &FlexibleArm, directions: &[Direction]) -> Result<DMatrix<f64>, StepError> {
    let request = SlopesRequest {
        settings: AlphaSettings::default(),
        step_s: 1e-3,
        duration_s: 0.0,
        start: Start::Equilibrium,
        tool: arm.model.frames()[0].clone(),
        keep_samples: false,
    };
    let mut arm = arm.with_motors_held();
    arm.carry_from_start()?;
    // Nothing of a motion or of a controller counts here.
    let still = |own: &Direction| Direction { servo: Vec::new(), ..own.clone() };
    let directions: Vec<Direction> = directions.iter().map(still).collect();
    let directions = &directions[..];
    check(&arm, &request, directions)?;
    let e = static_equilibrium(&arm, 0.0)?;
    Ok(Recurrence::new(arm, &request, directions, &e)?.x.transpose())
}

/// What of the arm and of the directions is not differentiated.
fn check(arm: &FlexibleArm, request: &SlopesRequest, directions: &[Direction]) -> Result<(), StepError> {
    let SlopesRequest { settings, step_s, .. } = request;
    if !(step_s.is_finite() && *step_s > 0.0) {
        return Err(StepError::Setup(format!("the step must be a positive time in seconds, found {step_s}")));
    }
    if !(0.0..=1.0).contains(&settings.rho) {
        return Err(StepError::Setup(format!("the spectral radius must lie between 0 and 1, found {}", settings.rho)));
    }
    let refuse = |what, mend| Err(StepError::NoSlopes { what, mend });
    let jumps = arm.motion.velocity_jumps();
    if !jumps.is_empty() && !arm.torque_driven.is_empty() {
        return refuse("a motion whose velocity jumps, under servos", "round its corners");
    }
    let moved = directions.iter().filter_map(|direction| direction.motion.as_deref());
    let known = |t: f64| jumps.iter().any(|jump| (jump - t).abs() <= SAME_TIME);
    if !moved.flat_map(PrescribedMotion::velocity_jumps).all(known) {
        return refuse("a change of the motion whose velocity jumps elsewhere", "round its corners");
    }
    if arm.elements.iter().any(|element| element.geometric.is_some()) {
        return refuse("links that stiffen under load", "leave geometric stiffening out");
    }
    for direction in directions {
        for (spring, slope) in &direction.springs {
            let Some(element) = arm.elements.get(*spring) else {
                return Err(StepError::Setup(format!("a direction changes spring {spring}, which is not there")));
            };
            if let SpringSlope::Matrix(dK) = slope
                && (dK.shape() != element.K.shape() || element.curve.is_some())
            {
                let name = &element.name;
                return Err(StepError::Setup(format!("the change of the stiffness of {name:?} has another form")));
            }
        }
        let n = arm.n_elastic_coordinates();
        let matrices = [&direction.damping, &direction.stiffness].into_iter().flatten();
        if matrices.chain(&direction.dampings_after).any(|own| own.shape() != (n, n)) {
            return Err(StepError::Setup(format!(
                "the change of the damping or of the stiffness of all springs must have {n} rows and columns"
            )));
        }
        let rigid = arm.servo.as_ref().map_or(0, |servo| servo.rigid.bodies().len());
        let beyond =
            |own: &[(usize, SpatialInertia)], count: usize| own.iter().map(|own| own.0).find(|body| *body >= count);
        let inertias = beyond(&direction.inertias, arm.model.bodies().len());
        let fed_forward = if arm.servo.is_some() { beyond(&direction.fed_forward, rigid) } else { None };
        if let Some(body) = inertias.or(fed_forward) {
            return Err(StepError::Setup(format!(
                "a direction changes the inertia of body {body}, which is not there"
            )));
        }
        let axes = arm.torque_driven.len();
        if let Some((axis, _)) = direction.servo.iter().find(|(axis, _)| *axis >= axes) {
            return Err(StepError::Setup(format!("a direction changes servo {axis}, the arm has {axes}")));
        }
    }
    Ok(())
}
