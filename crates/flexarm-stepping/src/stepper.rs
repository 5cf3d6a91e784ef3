//! One face for all steppers: step, observe, count. A fourth stepper implements [`Stepper`] in a file of its own and
//! gets a line in [`StepperKind`] and [`new_stepper`]; nothing else changes.

use std::sync::Arc;

use flexarm_kinematics::{Data, Model, Pose, State, kinetic_energy_of, mass_matrix, potential_energy_of};
use nalgebra::{DMatrix, DVector, Vector6};

use crate::arm::FlexibleArm;
use crate::error::StepError;
use crate::events::Change;
use crate::generalized_alpha::{AlphaSettings, GeneralizedAlpha};
use crate::reduced::ReducedArm;
use crate::reference::{Reference, ReferenceSettings};
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
    /// Steps of its own choice under error control, reduced coordinates.
    Reference(ReferenceSettings),
}

impl StepperKind {
    /// The word of the command line.
    pub fn name(&self) -> &'static str {
        match self {
            Self::GeneralizedAlpha(_) => "generalized-alpha",
            Self::Spook(_) => "spook",
            Self::Rk4 => "rk4",
            Self::Reference(_) => "reference",
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
    /// The tree, with what it carries at this time.
    pub model: Arc<Model>,
    /// All coordinates, actuated then elastic.
    pub q: DVector<f64>,
    /// Their velocities.
    pub qdot: DVector<f64>,
    /// Poses of all bodies in the world.
    pub X_WB: Vec<Pose>,
    /// Forces that the drives must supply, per actuated coordinate.
    pub drive: DVector<f64>,
    /// Generalised elastic load per element: what the spring and damper put on the distal part; of modal bodies the
    /// forces of the first six coordinates, of single springs the first component.
    pub load: Vec<Vector6<f64>>,
    /// Kinetic, gravitational and elastic energy (J).
    pub energy: [f64; 3],
    /// Power of the drives, of the external loads, and what dampers and friction take away (W).
    pub power: [f64; 3],
    /// Work of the drives so far where velocities of the motion jumped (J); not in their power, which has no impulses.
    pub impulse_work: f64,
}

impl Observation {
    /// Space for the arm's figures.
    pub fn new(arm: &FlexibleArm) -> Self {
        let model = &arm.model;
        Self {
            t: 0.0,
            model: model.clone(),
            q: DVector::zeros(model.nv()),
            qdot: DVector::zeros(model.nv()),
            X_WB: vec![Pose::identity(); model.bodies().len()],
            drive: DVector::zeros(model.n_actuated()),
            load: vec![Vector6::zeros(); arm.elements.len()],
            energy: [0.0; 3],
            power: [0.0; 3],
            impulse_work: 0.0,
        }
    }
}

/// Work done by a stepper.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Steps taken; those of the solver where it chooses them.
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

    /// Advances by one step; on error the state stays at the last good time. No stepper allocates here but
    /// [`StepperKind::Reference`], whose solver is another library's.
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
pub fn new_stepper(
    kind: StepperKind,
    mut arm: FlexibleArm,
    h: f64,
    start: Start,
) -> Result<Box<dyn Stepper>, StepError> {
    if !(h.is_finite() && h > 0.0) {
        return Err(StepError::Setup(format!("the step must be a positive time in seconds, found {h}")));
    }
    arm.carry_from_start()?;
    let e = match start {
        Start::Equilibrium => static_equilibrium(&arm, 0.0)?,
        Start::Undeformed => DVector::zeros(arm.n_elastic_coordinates()),
    };
    Ok(match kind {
        StepperKind::GeneralizedAlpha(settings) => {
            let rho = settings.rho;
            if !(0.0..=1.0).contains(&rho) {
                return Err(StepError::Setup(format!("the spectral radius must lie between 0 and 1, found {rho}")));
            }
            let mut system = ReducedArm::new(arm);
            let (x, v) = system.start(&e)?;
            let integrator = GeneralizedAlpha::new(&mut system, 0.0, h, settings, x, v)?;
            Box::new(ReducedStepper { system, integrator })
        }
        StepperKind::Rk4 => {
            check_explicit_step(&arm, h)?;
            let mut changed = arm.clone();
            for change in &arm.inertia_changes {
                changed.model = Arc::new(changed.model.with_inertia(change.body, change.inertia));
                // An arm that cannot stand with this payload may be able to move with it.
                if changed.update_modes_and_damping().is_ok() {
                    check_explicit_step(&changed, h)?;
                }
            }
            let mut system = ReducedArm::new(arm);
            let (x, v) = system.start(&e)?;
            let integrator = Rk4::new(&mut system, 0.0, h, x, v)?;
            Box::new(ReducedStepper { system, integrator })
        }
        StepperKind::Reference(settings) => {
            let mut system = ReducedArm::new(arm);
            let (x, v) = system.start(&e)?;
            let mut integrator = Reference::new(&mut system, 0.0, h, settings, x, v)?;
            // Else a solver that takes long steps may not see a short load at all.
            for t in system.arm.load_jumps().filter(|t| *t > 0.0) {
                integrator.restart_at(t);
            }
            // No whole part of a period, or a sine would look like nothing at all.
            let period = system.arm.loads.iter().map(|load| load.wrench.period).fold(f64::INFINITY, f64::min);
            integrator.limit_steps(0.137 * period);
            Box::new(ReducedStepper { system, integrator })
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
        rate = rate.max(omega * STABILITY_LIMIT / 2.61).max(fastest_decay(phi.dot(&(&arm.D * phi)), *omega));
    }
    let mut highest = arm.modes.omega.last().copied().unwrap_or(0.0);
    if !arm.torque_driven.is_empty() {
        // Motors that are free swing against their springs.
        let (omega, decay) = free_rates(arm)?;
        rate = rate.max(omega * STABILITY_LIMIT / 2.61).max(decay);
        highest = highest.max(omega);
    }
    if h * rate <= STABILITY_LIMIT {
        return Ok(());
    }
    Err(StepError::UnstableStep {
        stepper: "rk4",
        h,
        highest_hz: highest / std::f64::consts::TAU,
        largest_s: STABILITY_LIMIT / rate,
    })
}

/// Decay (1/s) of a mode with damping `2 ζ ω`; an oscillating one is bounded by its frequency alone.
fn fastest_decay(damping: f64, omega: f64) -> f64 {
    let squared = damping * damping - 4.0 * omega * omega;
    if squared > 0.0 { 0.5 * (damping + squared.sqrt()) } else { 0.0 }
}

/// Highest angular frequency and decay (1/s) with the joints driven by torque free, friction near standstill left out.
fn free_rates(arm: &FlexibleArm) -> Result<(f64, f64), StepError> {
    let (model, na) = (&arm.model, arm.model.n_actuated());
    let (mut state, mut qddot) = (State::zeros(model), DVector::zeros(model.nv()));
    arm.prescribed_state(0.0, &mut state, &mut qddot);
    state.q.rows_mut(na, arm.modes.equilibrium.len()).copy_from(&arm.modes.equilibrium);
    let mut data = Data::new(model);
    let M = mass_matrix(model, &mut data, &state.q);
    let free: Vec<usize> = arm.torque_driven.iter().copied().chain(na..model.nv()).collect();
    let (n, driven) = (free.len(), arm.torque_driven.len());
    let M = DMatrix::from_fn(n, n, |i, j| M[(free[i], free[j])]);
    let (mut K, mut D) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
    K.view_mut((driven, driven), (n - driven, n - driven)).copy_from(&arm.stiffness());
    D.view_mut((driven, driven), (n - driven, n - driven)).copy_from(&arm.D);
    for (i, k) in arm.torque_driven.iter().enumerate() {
        D[(i, i)] = arm.friction.get(*k).map_or(0.0, |f| f.viscous);
    }
    let singular = StepError::Singular { matrix: "mass matrix", t: 0.0 };
    let L = M.cholesky().ok_or(singular.clone())?.l();
    let largest = |A: &DMatrix<f64>| {
        let half = L.solve_lower_triangular(A)?;
        let whole = L.solve_lower_triangular(&half.transpose())?;
        Some((&whole + whole.transpose()).symmetric_eigenvalues().max() * 0.5)
    };
    let (stiff, damped) = (largest(&K).ok_or(singular.clone())?, largest(&D).ok_or(singular)?);
    Ok((stiff.max(0.0).sqrt(), damped.max(0.0)))
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
    let driven = &system.arm.torque_driven;
    let (e, rates) = (&x.as_slice()[driven.len()..], &v.as_slice()[driven.len()..]);
    out.t = t;
    out.model.clone_from(model);
    out.q.copy_from(&system.state.q);
    out.qdot.copy_from(&system.state.qdot);
    out.X_WB.copy_from_slice(&system.data.X_WB);
    out.drive.copy_from(&system.data.tau.rows(0, n));
    for (&k, torque) in driven.iter().zip(system.held_torques()) {
        out.drive[k] = *torque;
    }
    let mut damping = 0.0;
    for (k, element) in system.arm.elements.iter().enumerate() {
        let first = system.arm.offset(element);
        let mut force = [0.0; 6];
        for c in 0..element.size {
            let row: f64 = rates.iter().enumerate().map(|(j, rate)| system.arm.D[(first + c, j)] * rate).sum();
            damping += row * rates[first + c];
            if c < 6 {
                let own = &e[first..first + element.size];
                let spring: f64 = match &element.curve {
                    Some(curve) => curve.torque(own[0]),
                    None => own.iter().enumerate().map(|(j, e)| element.K[(c, j)] * e).sum(),
                };
                force[c] = -(spring + row);
            }
        }
        out.load[k] = Vector6::from(force);
    }
    for k in 0..n {
        let rate = system.state.qdot[k];
        damping += system.arm.friction_torque(k, rate) * rate;
    }
    let loads = system.arm.loads.iter().map(|load| {
        let F = load.on_body(system.events.side(t), &system.data.X_WB[load.body]);
        system.data.V[load.body].power(&F)
    });
    out.power = [out.drive.dot(&out.qdot.rows(0, n)), loads.sum(), damping];
    out.impulse_work = system.struck;
    out.energy = [
        kinetic_energy_of(model, &system.data),
        potential_energy_of(model, &system.data),
        system.arm.elastic_energy(e),
    ];
}

/// Elastic coordinates beyond this are no deflection of a link any more (m, rad).
pub(crate) const LARGEST_DEFLECTION: f64 = 3.0;

/// Stops a run whose links have come apart.
fn check_deflection(arm: &FlexibleArm, x: &DVector<f64>, t: f64, h: f64) -> Result<(), StepError> {
    for element in arm.elements.iter().filter(|e| !e.modal || e.size >= 6) {
        let first = arm.torque_driven.len() + arm.offset(element);
        let largest = x.as_slice()[first..first + element.size.min(6)].iter().fold(0.0f64, |m, e| m.max(e.abs()));
        if largest > LARGEST_DEFLECTION {
            let what = format!("the deflection of link {:?} reached {largest:.1e} m or rad", element.name);
            return Err(StepError::Diverged { t, h, what });
        }
    }
    Ok(())
}

/// What the steppers of reduced coordinates need of their integrators.
trait Integrator: Send {
    /// Whether it asks for prescribed accelerations at the ends of its steps alone.
    const ENDS_ALONE: bool = false;
    fn time(&self) -> f64;
    /// Next multiple of the step.
    fn next_time(&self) -> f64;
    fn step_size(&self) -> f64;
    /// Advances to an event or to [`Integrator::next_time`]; beyond `event` nothing is known yet.
    fn advance_to(&mut self, system: &mut ReducedArm, t: f64, event: Option<f64>) -> Result<(), StepError>;
    /// Takes up what an event has changed at the current time.
    fn take_up(&mut self, system: &mut ReducedArm, change: Change) -> Result<(), StepError>;
    fn state(&mut self) -> (&DVector<f64>, &mut DVector<f64>);
    fn all(&self) -> [&DVector<f64>; 3];
    fn counts(&self) -> Counts;
    fn last_iteration(&self) -> (usize, f64) {
        (0, 0.0)
    }
}

impl Integrator for GeneralizedAlpha {
    const ENDS_ALONE: bool = true;
    fn time(&self) -> f64 {
        self.time()
    }
    fn next_time(&self) -> f64 {
        self.next_time()
    }
    fn step_size(&self) -> f64 {
        self.step_size()
    }
    fn advance_to(&mut self, system: &mut ReducedArm, t: f64, _event: Option<f64>) -> Result<(), StepError> {
        self.advance_to(system, t)
    }
    fn take_up(&mut self, system: &mut ReducedArm, change: Change) -> Result<(), StepError> {
        match change {
            Change::Nothing => Ok(()),
            Change::Motion => self.restart(system),
            Change::Matrices => self.renew(system),
        }
    }
    fn state(&mut self) -> (&DVector<f64>, &mut DVector<f64>) {
        (&self.x, &mut self.v)
    }
    fn all(&self) -> [&DVector<f64>; 3] {
        [&self.x, &self.v, &self.acceleration]
    }
    fn counts(&self) -> Counts {
        Counts { steps: self.steps(), evaluations: self.iterations, factorisations: self.factorisations }
    }
    fn last_iteration(&self) -> (usize, f64) {
        (self.last_iterations, self.last_correction)
    }
}

impl Integrator for Rk4 {
    fn time(&self) -> f64 {
        self.time()
    }
    fn next_time(&self) -> f64 {
        self.next_time()
    }
    fn step_size(&self) -> f64 {
        self.step_size()
    }
    fn advance_to(&mut self, system: &mut ReducedArm, t: f64, _event: Option<f64>) -> Result<(), StepError> {
        self.advance_to(system, t)
    }
    fn take_up(&mut self, system: &mut ReducedArm, change: Change) -> Result<(), StepError> {
        if change == Change::Nothing { Ok(()) } else { self.restart(system) }
    }
    fn state(&mut self) -> (&DVector<f64>, &mut DVector<f64>) {
        (&self.x, &mut self.v)
    }
    fn all(&self) -> [&DVector<f64>; 3] {
        [&self.x, &self.v, &self.acceleration]
    }
    fn counts(&self) -> Counts {
        Counts { steps: self.steps(), evaluations: 4 * self.steps(), factorisations: 0 }
    }
}

impl Integrator for Reference {
    fn time(&self) -> f64 {
        self.time()
    }
    fn next_time(&self) -> f64 {
        self.next_time()
    }
    fn step_size(&self) -> f64 {
        self.step_size()
    }
    fn advance_to(&mut self, system: &mut ReducedArm, t: f64, event: Option<f64>) -> Result<(), StepError> {
        // The solver must not look past an event.
        if let Some(event) = event {
            self.restart_at(event);
        }
        if t == self.next_time() { self.step(system) } else { self.step_to_restart(system, t) }
    }
    fn take_up(&mut self, system: &mut ReducedArm, change: Change) -> Result<(), StepError> {
        if change == Change::Nothing { Ok(()) } else { self.restart(system) }
    }
    fn state(&mut self) -> (&DVector<f64>, &mut DVector<f64>) {
        (&self.x, &mut self.v)
    }
    fn all(&self) -> [&DVector<f64>; 3] {
        [&self.x, &self.v, &self.acceleration]
    }
    fn counts(&self) -> Counts {
        Counts { steps: self.solver_steps, evaluations: self.evaluations, factorisations: self.factorisations }
    }
}

/// A stepper of reduced coordinates; its steps end at events too.
struct ReducedStepper<I> {
    system: ReducedArm,
    integrator: I,
}

impl<I: Integrator> Stepper for ReducedStepper<I> {
    fn time(&self) -> f64 {
        self.integrator.time()
    }
    fn step(&mut self) -> Result<(), StepError> {
        let Self { system, integrator } = self;
        let end = integrator.next_time();
        loop {
            let event = system.next_event(integrator.time(), end);
            let stop = event.filter(|t| *t < end).unwrap_or(end);
            let stop = if I::ENDS_ALONE { system.resolved(integrator.time(), stop) } else { stop };
            integrator.advance_to(system, stop, event)?;
            let h = integrator.step_size();
            let (x, v) = integrator.state();
            check_deflection(&system.arm, x, stop, h)?;
            let change = system.at_time(stop, x, v)?;
            integrator.take_up(system, change)?;
            if stop == end {
                return Ok(());
            }
        }
    }
    fn observe(&mut self, out: &mut Observation) {
        let [x, v, a] = self.integrator.all();
        observe_reduced(&mut self.system, self.integrator.time(), x, v, a, out);
    }
    fn counts(&self) -> Counts {
        self.integrator.counts()
    }
    fn last_iteration(&self) -> (usize, f64) {
        self.integrator.last_iteration()
    }
}
