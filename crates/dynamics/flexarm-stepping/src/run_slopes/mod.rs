//! Derivatives of a whole run with respect to parameters of the arm and of its motion: the tangent
//! of generalised-alpha, for all parameters in parallel.
//!
//! ```text
//! r(q, q̇, q̈; p) = 0
//! M δẍ + V δẋ + K δx = -(∂r/∂p + K_a δq_a + V_a δq̇_a + M_a δq̈_a)        (1)
//! ```
//! holds at the end of every step, with `K = ∂r/∂x`, `V = ∂r/∂ẋ` in closed form
//! ([`flexarm_kinematics::DynamicTangent`]), or by differences of the recursions with closed loops
//! or modal links (`forces.rs`). The formulas that relate x, ẋ and ẍ of two steps are linear, so
//! that a step is one linear system for all parameters, with one column each. In contrast to a run
//! of [`crate::GeneralizedAlpha`], iterations converge fully, and the matrix of the dispersion
//! correction is that at the start of each step: the result is a smooth function of the parameters,
//! of which differences can be taken ([`GeneralizedAlpha::exactly`]). An ordinary run differs from
//! it by its iteration error, which is far below the error of its step size.
//!
//! Torques under servos are constant between samples, and so are their derivatives (`servo.rs`);
//! transmission errors, hysteresis, coupling and load-dependent friction are in `gears.rs`. Start
//! at [`run_slopes`]. Not here: names and units of parameters (`flexarm-identify`). Refused:
//! motions with velocity jumps under servos, and links with geometric stiffness.

mod columns;
mod forces;
mod gears;
pub(crate) mod lu;
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

/// Direction in parameter space: derivatives of the terms of the equations of motion with respect
/// to one parameter.
#[derive(Clone, Default)]
pub struct Direction {
    /// Change of the stiffness of springs, by element index.
    pub springs: Vec<(usize, SpringSlope)>,
    /// Change of the stiffness of all elastic coordinates together, for coupled springs.
    pub stiffness: Option<DMatrix<f64>>,
    /// Change of the damping matrix of the elastic coordinates.
    pub damping: Option<DMatrix<f64>>,
    /// Change of the damping matrix after each change of inertia, in order; unchanged if missing.
    pub dampings_after: Vec<DMatrix<f64>>,
    /// Change of the inertia of bodies, about Bo, B axes; valid until the inertia is replaced
    /// during the run.
    pub inertias: Vec<(usize, SpatialInertia)>,
    /// Change of the inertia of bodies of the rigid robot used for the feed-forward, about Bo, B
    /// axes.
    pub fed_forward: Vec<(usize, SpatialInertia)>,
    /// Change of the friction of actuated coordinates, as changes of the friction parameters.
    pub friction: Vec<(usize, Friction)>,
    /// Change of the controllers, by index of the axis in [`crate::Servo::axes`].
    pub servo: Vec<(usize, AxisSlope)>,
    /// Change of the motion of the joints; for joints driven by torque, of their reference.
    pub motion: Option<Arc<dyn PrescribedMotion>>,
    /// Change of the position of the tool point, tool axes (m).
    pub tool: Vector3<f64>,
}

/// Change of the controller of one axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxisSlope {
    /// Change of [`crate::ServoAxis::position_gain`] (1/s).
    pub position_gain: f64,
    /// Change of [`crate::ServoAxis::velocity_gain`] (N m s/rad).
    pub velocity_gain: f64,
    /// Change of [`crate::ServoAxis::integral_gain`] (N m/rad).
    pub integral_gain: f64,
    /// Change of a factor on the feed-forward torque.
    pub feed_forward: f64,
}

impl Direction {
    /// Returns the change of the damping matrix after `changes` changes of inertia.
    fn damping_after(&self, changes: usize) -> Option<&DMatrix<f64>> {
        let later = changes.checked_sub(1).and_then(|k| self.dampings_after.get(k));
        later.or(self.damping.as_ref())
    }

    /// Returns the changes of inertias that still apply after `changes` changes of inertia.
    fn inertias_after<'a>(
        &'a self,
        arm: &'a FlexibleArm,
        changes: usize,
    ) -> impl Iterator<Item = (usize, &'a SpatialInertia)> {
        let over = &arm.inertia_changes[..changes];
        let there = move |body: usize| over.iter().all(|change| change.body != body);
        self.inertias.iter().filter(move |(body, _)| there(*body)).map(|(body, more)| (*body, more))
    }

    /// Returns the change of the controller of an axis.
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
    /// Multiple of the spring itself, matrix or curve.
    Factor(f64),
    /// Change of its stiffness matrix.
    Matrix(DMatrix<f64>),
}

/// Inputs of [`run_slopes`].
#[derive(Clone, Debug)]
pub struct SlopesRequest {
    /// Settings of generalised-alpha.
    pub settings: AlphaSettings,
    /// Step size (s).
    pub step_s: f64,
    /// Duration (s); the last step may end after it.
    pub duration_s: f64,
    /// Initial state.
    pub start: Start,
    /// Tool frame.
    pub tool: Frame,
    /// Whether to keep errors and slopes after every step.
    pub keep_samples: bool,
}

/// Tool error along a run (flexible minus rigid arm) and its derivatives, one number per direction
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
    /// Derivatives of the errors, one column per direction, time after time.
    pub slopes: Vec<[f64; 6]>,
}

/// A servo that reached its torque limit; the derivatives hold for an unchanged set of limited
/// samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueLimited {
    /// Coordinate of the joint.
    pub coordinate: usize,
    /// Number of limited samples.
    pub samples: u64,
    /// Time of the first one (s).
    pub first_s: f64,
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
    fn new(directions: usize) -> Self {
        Self { peak_slopes: vec![0.0; directions], rms_slopes: vec![0.0; directions], ..Self::default() }
    }

    /// Adds the error of one time; until [`ErrorSlopes::finish`] `rms` and its slopes are sums.
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

/// Computes the tool error along a run and its exact derivatives in the given directions; without
/// directions it only runs, with fully converged iterations.
///
/// Cost: with 18 coordinates about ten ordinary runs, whose steps often need one evaluation, plus a
/// quarter of an ordinary run per direction. Steps do not allocate except for kept samples.
///
/// # Errors
/// [`StepError::NoSlopes`] if the arm has a feature that is not differentiated;
/// [`StepError::Setup`] for a step that is not a positive time, for an element that does not exist,
/// or for a matrix of the wrong shape; otherwise as a stepper.
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

/// Returns the derivatives of the elastic coordinates at the initial equilibrium, n × p.
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
    // Controller directions have no effect on the equilibrium.
    let still = |own: &Direction| Direction { servo: Vec::new(), ..own.clone() };
    let directions: Vec<Direction> = directions.iter().map(still).collect();
    let directions = &directions[..];
    check(&arm, &request, directions)?;
    let e = static_equilibrium(&arm, 0.0)?;
    Ok(Recurrence::new(arm, &request, directions, &e)?.x.transpose())
}

/// Checks that the arm and the directions can be differentiated.
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
    if arm.has_guides() {
        return refuse("telescopic guides", "vary the guide in a sweep");
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
