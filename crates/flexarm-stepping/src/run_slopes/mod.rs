//! How a whole run changes with parameters of the arm and of its motion: the tangent of generalised-alpha, all parameters side by side.
//!
//! ```text
//! r(q, q̇, q̈; p) = 0:     M δẍ + V δẋ + K δx = -(∂r/∂p + K_a δq_a + V_a δq̇_a + M_a δq̈_a)                           (1)
//! ```
//! holds at the end of every step, with `K = ∂r/∂x`, `V = ∂r/∂ẋ` in closed form ([`DynamicTangent`]); the formulas that join x, ẋ and ẍ
//! of two steps are linear, so that a step is one linear system for all parameters: a column each. What differs from a run of
//! [`crate::GeneralizedAlpha`] is that its iterations go on to the end and that the matrix of its dispersion correction is that of the
//! start of each step: a run whose result is a smooth function of the parameters, of which differences can be taken
//! ([`GeneralizedAlpha::exactly`]). An ordinary run differs from it by what its iterations leave, far less than the error of its step.
//!
//! Start at [`run_slopes`]. Not here: names and units of parameters (`flexarm-identify`), drives under torque, gears with laws of their own,
//! links in modes, closed loops, payloads that change: these are refused.

mod columns;
mod lu;
mod recurrence;
mod tool;

use std::sync::Arc;

use flexarm_kinematics::{DynamicTangent, Frame, SpatialInertia};
use nalgebra::{DMatrix, DVector, Vector3};

use crate::arm::FlexibleArm;
use crate::error::StepError;
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
    /// Damping matrix of the elastic coordinates.
    pub damping: Option<DMatrix<f64>>,
    /// Inertia of bodies, about Bo, B axes.
    pub inertias: Vec<(usize, SpatialInertia)>,
    /// Motion of the joints.
    pub motion: Option<Arc<dyn PrescribedMotion>>,
    /// Place of the tool's point, tool axes (m).
    pub tool: Vector3<f64>,
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

/// Error of the tool along a run, flexible less rigid, and its derivatives: a number per direction, in their order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunSlopes {
    /// Steps taken.
    pub steps: u64,
    /// Distance (m).
    pub position: ErrorSlopes,
    /// Angle (rad).
    pub rotation: ErrorSlopes,
    /// Times of the start and after every step (s), if kept.
    pub times_s: Vec<f64>,
    /// Error then: displacement (m) and rotation vector (rad), world axes.
    pub errors: Vec<[f64; 6]>,
    /// Its derivatives, a column per direction: those of one time after those of the time before.
    pub slopes: Vec<[f64; 6]>,
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

/// Error of the tool along a run and its exact derivatives in some directions; without any the run alone, to the end of each iteration.
///
/// Cost: with 18 coordinates about ten ordinary runs, of which a step is often one evaluation, and a quarter of one for each direction. No
/// allocation in the steps but for what is kept of them.
///
/// # Errors
/// [`StepError::NoSlopes`] where the arm has what is not differentiated; [`StepError::Setup`] for a step that is no time or a spring
/// that is not there; else as a stepper.
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
    let mut arm = arm.clone();
    arm.carry_from_start()?;
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
    if !arm.torque_driven.is_empty() {
        return refuse("drives under torque", "prescribe the joints' motion");
    }
    if arm.has_gear_laws() || !arm.cross_stiffness.is_empty() || !arm.cross_damping.is_empty() {
        return refuse("gears with hysteresis, friction by load, ripple or coupling", "leave these laws out");
    }
    if !arm.inertia_changes.is_empty() {
        return refuse("a payload that changes on the way", "carry it from the start");
    }
    let jumps = |motion: &dyn PrescribedMotion| !motion.velocity_jumps().is_empty();
    let moved = directions.iter().filter_map(|direction| direction.motion.as_deref());
    if jumps(&*arm.motion) || moved.into_iter().any(jumps) {
        return refuse("a motion whose velocity jumps", "round its corners");
    }
    if arm.elements.iter().any(|element| element.geometric.is_some()) {
        return refuse("links that stiffen under load", "leave geometric stiffening out");
    }
    if !arm.model.loops().is_empty() {
        return refuse("closed loops", "take differences of runs");
    }
    if DynamicTangent::new(&arm.model).is_none() {
        return refuse("links that bend in modes", "model them as lumped");
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
        if direction.damping.as_ref().is_some_and(|dD| dD.shape() != (n, n)) {
            return Err(StepError::Setup(format!("the change of the damping must have {n} rows and columns")));
        }
    }
    Ok(())
}
