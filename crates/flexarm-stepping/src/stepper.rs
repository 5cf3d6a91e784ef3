//! One face for all steppers: step, observe, count. A fourth stepper implements [`Stepper`] in a file of its own and
//! gets a line in [`StepperKind`] and [`new_stepper`]; nothing else changes.

use flexarm_kinematics::{Pose, kinetic_energy_of, potential_energy_of};
use nalgebra::{DVector, Vector6};

use crate::arm::FlexibleArm;
use crate::error::StepError;
use crate::generalized_alpha::{AlphaSettings, GeneralizedAlpha};
use crate::reduced::ReducedArm;
use crate::rk4::{Rk4, STABILITY_LIMIT};
use crate::spook::{Spook, SpookSettings};
use crate::statics::static_equilibrium;

/// Which time stepper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StepperKind {
    /// Implicit, reduced coordinates.
    GeneralizedAlpha(AlphaSettings),
    /// Compliant constraints in maximal coordinates.
    Spook(SpookSettings),
    /// Explicit, reduced coordinates.
    Rk4,
}

impl StepperKind {
    /// The word of the command line.
    pub fn name(&self) -> &'static str {
        match self {
            Self::GeneralizedAlpha(_) => "generalized-alpha",
            Self::Spook(_) => "spook",
            Self::Rk4 => "rk4",
        }
    }
}

/// Where a run starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Start {
    /// Springs carry the weight: no ringing.
    #[default]
    Equilibrium,
    /// Springs relaxed.
    Undeformed,
}

/// What a run can see of a stepper at its current time.
#[derive(Clone, Debug)]
pub struct Observation {
    /// Time (s).
    pub t: f64,
    /// All coordinates, actuated then elastic.
    pub q: DVector<f64>,
    /// Their velocities.
    pub qdot: DVector<f64>,
    /// Poses of all bodies in the world.
    pub X_WB: Vec<Pose>,
    /// Forces that the drives must supply, per actuated coordinate.
    pub drive: DVector<f64>,
    /// Generalised elastic load per element: what the spring and damper put on the distal part.
    pub load: Vec<Vector6<f64>>,
    /// Kinetic, gravitational and elastic energy (J).
    pub energy: [f64; 3],
}

impl Observation {
    /// Space for the arm's figures.
    pub fn new(arm: &FlexibleArm) -> Self {
        let model = &arm.model;
        Self {
            t: 0.0,
            q: DVector::zeros(model.nv()),
            qdot: DVector::zeros(model.nv()),
            X_WB: vec![Pose::identity(); model.bodies().len()],
            drive: DVector::zeros(model.n_actuated()),
            load: vec![Vector6::zeros(); arm.elements.len()],
            energy: [0.0; 3],
        }
    }
}

/// Work done by a stepper.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Steps taken.
    pub steps: u64,
    /// Newton iterations or evaluations of the equations of motion.
    pub evaluations: u64,
    /// Matrix factorisations.
    pub factorisations: u64,
}

/// A running simulation.
pub trait Stepper: Send {
    /// Current time (s).
    fn time(&self) -> f64;

    /// Advances by one step without allocation; on error the state stays at the last good time.
    ///
    /// # Errors
    /// [`StepError`] with time, step and cause.
    fn step(&mut self) -> Result<(), StepError>;

    /// Writes the current state into `out`.
    fn observe(&mut self, out: &mut Observation);

    /// Work so far.
    fn counts(&self) -> Counts;

    /// Iterations of the last step and the relative correction it ended with (0 where there are none).
    fn last_iteration(&self) -> (usize, f64) {
        (0, 0.0)
    }
}

/// Makes a stepper of the kind, started at `t = 0`.
///
/// # Errors
/// [`StepError`] if the start cannot be found or an explicit step is too large.
pub fn new_stepper(kind: StepperKind, arm: FlexibleArm, h: f64, start: Start) -> Result<Box<dyn Stepper>, StepError> {
    if !(h.is_finite() && h > 0.0) {
        return Err(StepError::Setup(format!("the step must be a positive time in seconds, found {h}")));
    }
    let n = arm.n_elastic_coordinates();
    let e = match start {
        Start::Equilibrium => static_equilibrium(&arm, 0.0)?,
        Start::Undeformed => DVector::zeros(n),
    };
    let v = DVector::zeros(n);
    Ok(match kind {
        StepperKind::GeneralizedAlpha(settings) => {
            let rho = settings.rho;
            if !(0.0..=1.0).contains(&rho) {
                return Err(StepError::Setup(format!("the spectral radius must lie between 0 and 1, found {rho}")));
            }
            let mut system = ReducedArm::new(arm);
            let integrator = GeneralizedAlpha::new(&mut system, 0.0, h, settings, e, v)?;
            Box::new(ImplicitStepper { system, integrator })
        }
        StepperKind::Rk4 => {
            check_explicit_step(&arm, h)?;
            let mut system = ReducedArm::new(arm);
            let integrator = Rk4::new(&mut system, 0.0, h, e, v)?;
            Box::new(ExplicitStepper { system, integrator, steps: 0 })
        }
        StepperKind::Spook(settings) => Box::new(Spook::new(arm, h, settings, &e)?),
    })
}

/// Every mode must lie inside the stability region: on the imaginary axis up to 2.78, 2.61 where damping turns it
/// inwards, on the negative real axis up to 2.78 again.
fn check_explicit_step(arm: &FlexibleArm, h: f64) -> Result<(), StepError> {
    let mut rate = 0.0f64;
    for (j, omega) in arm.modes.omega.iter().enumerate() {
        let phi = arm.modes.shapes.column(j);
        let decay = phi.dot(&(&arm.D * phi)); // 2 ζ ω
        rate = rate.max(omega * STABILITY_LIMIT / 2.61).max(decay);
    }
    if h * rate <= STABILITY_LIMIT {
        return Ok(());
    }
    Err(StepError::UnstableStep {
        stepper: "rk4",
        h,
        highest_hz: arm.modes.omega.last().map_or(0.0, |w| w / std::f64::consts::TAU),
        largest_s: STABILITY_LIMIT / rate,
    })
}

/// Fills an observation from the reduced arm after [`ReducedArm::evaluate`].
fn observe_reduced(
    system: &mut ReducedArm,
    t: f64,
    x: &DVector<f64>,
    v: &DVector<f64>,
    a: &DVector<f64>,
    out: &mut Observation,
) {
    system.evaluate(t, x, v, a);
    let (model, n) = (&system.arm.model, system.arm.model.n_actuated());
    out.t = t;
    out.q.copy_from(&system.state.q);
    out.qdot.copy_from(&system.state.qdot);
    out.X_WB.copy_from_slice(&system.data.X_WB);
    out.drive.copy_from(&system.data.tau.rows(0, n));
    for (k, element) in system.arm.elements.iter().enumerate() {
        // What the joint supplies is what inverse dynamics asks for.
        out.load[k] = system.data.tau.fixed_rows::<6>(element.coordinate).into();
    }
    out.energy = [
        kinetic_energy_of(model, &system.data),
        potential_energy_of(model, &system.data),
        system.arm.elastic_energy(x.as_slice()),
    ];
}

/// Elastic coordinates beyond this are no deflection of a link any more (m, rad).
pub(crate) const LARGEST_DEFLECTION: f64 = 3.0;

/// Stops a run whose links have come apart.
fn check_deflection(arm: &FlexibleArm, x: &DVector<f64>, t: f64, h: f64) -> Result<(), StepError> {
    for (k, element) in arm.elements.iter().enumerate() {
        let largest = x.as_slice()[6 * k..6 * k + 6].iter().fold(0.0f64, |m, e| m.max(e.abs()));
        if largest > LARGEST_DEFLECTION {
            let what = format!("the deflection of link {:?} reached {largest:.1e} m or rad", element.name);
            return Err(StepError::Diverged { t, h, what });
        }
    }
    Ok(())
}

struct ImplicitStepper {
    system: ReducedArm,
    integrator: GeneralizedAlpha,
}

impl Stepper for ImplicitStepper {
    fn time(&self) -> f64 {
        self.integrator.time()
    }
    fn step(&mut self) -> Result<(), StepError> {
        self.integrator.step(&mut self.system)?;
        check_deflection(&self.system.arm, &self.integrator.x, self.integrator.time(), self.integrator.step_size())
    }
    fn observe(&mut self, out: &mut Observation) {
        let g = &self.integrator;
        observe_reduced(&mut self.system, g.time(), &g.x, &g.v, &g.acceleration, out);
    }
    fn counts(&self) -> Counts {
        let g = &self.integrator;
        Counts { steps: g.steps(), evaluations: g.iterations, factorisations: g.factorisations }
    }
    fn last_iteration(&self) -> (usize, f64) {
        (self.integrator.last_iterations, self.integrator.last_correction)
    }
}

struct ExplicitStepper {
    system: ReducedArm,
    integrator: Rk4,
    steps: u64,
}

impl Stepper for ExplicitStepper {
    fn time(&self) -> f64 {
        self.integrator.time()
    }
    fn step(&mut self) -> Result<(), StepError> {
        self.integrator.step(&mut self.system)?;
        self.steps += 1;
        check_deflection(&self.system.arm, &self.integrator.x, self.integrator.time(), self.integrator.step_size())
    }
    fn observe(&mut self, out: &mut Observation) {
        let g = &self.integrator;
        observe_reduced(&mut self.system, g.time(), &g.x, &g.v, &g.acceleration, out);
    }
    fn counts(&self) -> Counts {
        Counts { steps: self.steps, evaluations: 4 * self.steps, factorisations: 0 }
    }
}
