//! Recurrence of a run and its tangent, step by step.
//!
//! With `S = 1 + c h² M^-1 K` at the start of the step ((5) of generalised-alpha) and
//! `y = M^-1 K ẍ⁺`:
//!
//! ```text
//! δx̃⁺ = S δẍ⁺ + z,    z = c h² M^-1 (δK ẍ⁺ - δM y)                          (1)
//! δx⁺ = x_h + c_K δx̃⁺,  δẋ⁺ = v_h + c_D δx̃⁺                                (2)
//! (M + (c_D V + c_K K) S) δẍ⁺ = -(V (v_h + c_D z) + K (x_h + c_K z) + δr)     (3)
//! ```
//! δM is due to the parameters and to δq at the start of the step; x_h and v_h follow from
//! quantities known there.

use std::sync::Arc;

use flexarm_kinematics::{Data, Model, State, forward_kinematics};
use flexarm_kinematics::{inverse_dynamics, mass_matrix_at_poses, world_poses};
use nalgebra::{DMatrix, DVector};

use crate::arm::FlexibleArm;
use crate::error::StepError;
use crate::events::Change;
use crate::gear::GearState;
use crate::implicit::ImplicitStep;
use crate::integrator::{Integrator, check_deflection};
use crate::iteration_matrix::MatrixForm;
use crate::reduced::ReducedArm;
use crate::run_slopes::columns::add_product;
use crate::run_slopes::lu::Lu;
use crate::run_slopes::servo::ServoSlopes;
use crate::run_slopes::tangent::{LinearisationPoint, Tangent, add_columns, put};
use crate::run_slopes::{Direction, SlopesRequest, TorqueLimited};
use crate::stepper::Start;
use crate::steppers::{Coefficients, GeneralizedAlpha};

/// Maximum number of iterations of a step; after more of them a matrix that contains the dispersion
/// correction would be renewed within the step.
const MOST_ITERATIONS: usize = 8;

/// A run with its tangent: N free coordinates (d joints driven by torque, n elastic ones), m
/// joints, p directions.
pub(super) struct Recurrence<'a> {
    system: ReducedArm,
    integrator: GeneralizedAlpha,
    directions: &'a [Direction],
    /// Whether any direction changes the motion of the joints.
    moves: bool,
    coefficients: Coefficients,
    /// Factor c of the dispersion correction; 0 without it.
    c: f64,
    /// All coordinates at the current time.
    pub(super) q: DVector<f64>,
    /// Derivatives of the free coordinates, p × N, of their rates and accelerations, and of the
    /// history of the scheme. All directions of a coordinate are contiguous, so that sums run over
    /// whole columns.
    pub(super) x: DMatrix<f64>,
    v: DMatrix<f64>,
    acceleration: DMatrix<f64>,
    a: DMatrix<f64>,
    x_tilde: DMatrix<f64>,
    /// Derivatives of the joint motion, its rates and accelerations, p × m; for joints under
    /// servos, of the reference.
    pub(super) joints: [DMatrix<f64>; 3],
    /// Prescribed or reference motion of the joints, with rates and accelerations, m.
    pub(super) reference: [Vec<f64>; 3],
    servo: Option<ServoSlopes>,
    tangent: Tangent,
    /// S (first transposed), and the factor of M at the start of the step.
    S: DMatrix<f64>,
    mass: Lu,
    matrix: Lu,
    /// `∂(M y)/∂q`, nv × nv; and its rows of free coordinates with the columns of the free
    /// coordinates and of the joints.
    of_inertia: DMatrix<f64>,
    inertia_by: [DMatrix<f64>; 2],
    /// `y = M^-1 K ẍ⁺`, over all coordinates.
    y: DVector<f64>,
    /// All coordinates at the start of the step, and the derivatives of the joint motion there.
    q_start: DVector<f64>,
    joints_start: DMatrix<f64>,
    /// `c_D V + c_K K`.
    C: DMatrix<f64>,
    /// z, x_h, v_h and the right-hand side.
    z: DMatrix<f64>,
    x_h: DMatrix<f64>,
    v_h: DMatrix<f64>,
    rhs: DMatrix<f64>,
    room: DVector<f64>,
    /// Workspace for one direction: its joint motion, its free coordinates.
    sample: [Vec<f64>; 3],
    own: Vec<f64>,
}

impl<'a> Recurrence<'a> {
    /// Creates the run at its start, with elastic coordinates `e`.
    pub(super) fn new(
        arm: FlexibleArm,
        request: &SlopesRequest,
        directions: &'a [Direction],
        e: &DVector<f64>,
    ) -> Result<Self, StepError> {
        let (m, n, p) = (arm.model.n_actuated(), arm.n_free(), directions.len());
        let nv = arm.model.nv();
        let tangent = Tangent::new(&arm, p);
        let mut system = ReducedArm::new(arm);
        let (x, v) = system.start(e)?;
        let blow = (system.events.jumps_over() > 0).then(|| system.tau.clone());
        let servo = system.servo.as_ref().map(|servo| ServoSlopes::new(servo, directions));
        let h = request.step_s;
        let integrator = GeneralizedAlpha::new(&mut system, 0.0, h, request.settings, x, v)?.exactly();
        let coefficients = Coefficients::new(request.settings.rho);
        let c = if request.settings.dispersion_correction { coefficients.dispersion().max(0.0) } else { 0.0 };
        let zeros = || DMatrix::zeros(p, n);
        let mut run = Self {
            integrator,
            moves: directions.iter().any(|direction| direction.motion.is_some()),
            directions,
            coefficients,
            c,
            q: DVector::zeros(nv),
            x: zeros(),
            v: zeros(),
            acceleration: zeros(),
            a: zeros(),
            x_tilde: zeros(),
            joints: std::array::from_fn(|_| DMatrix::zeros(p, m)),
            reference: std::array::from_fn(|_| vec![0.0; m]),
            servo,
            sample: std::array::from_fn(|_| vec![0.0; m]),
            own: vec![0.0; n],
            tangent,
            S: DMatrix::zeros(n, n),
            mass: Lu::new(n),
            matrix: Lu::new(n),
            of_inertia: DMatrix::zeros(nv, nv),
            inertia_by: [DMatrix::zeros(n, n), DMatrix::zeros(n, m)],
            y: DVector::zeros(nv),
            q_start: DVector::zeros(nv),
            joints_start: DMatrix::zeros(p, m),
            C: DMatrix::zeros(n, n),
            z: zeros(),
            x_h: zeros(),
            v_h: zeros(),
            rhs: zeros(),
            room: DVector::zeros(nv),
            system,
        };
        run.start(e, request.start == Start::Equilibrium, blow.as_ref())?;
        Ok(run)
    }

    /// Evaluates the start of the run and the derivatives there.
    ///
    /// * `jumps`: velocity jumps of all coordinates at the start.
    fn start(&mut self, e: &DVector<f64>, at_rest: bool, jumps: Option<&DVector<f64>>) -> Result<(), StepError> {
        let side = self.system.events.side(0.0);
        self.sample_joints(side);
        if !self.directions.is_empty() {
            self.begin(e, at_rest)?;
        }
        self.look();
        if let Some(jumps) = jumps {
            // The run starts from rest.
            self.strike(0.0, jumps, None)?;
        }
        self.accelerate()
    }

    /// Computes the derivatives of the initial state and of the torques initially held by the
    /// controllers.
    fn begin(&mut self, e: &DVector<f64>, at_rest: bool) -> Result<(), StepError> {
        for (i, &k) in self.system.arm.torque_driven.iter().enumerate() {
            self.x.column_mut(i).copy_from(&self.joints[0].column(k));
            self.v.column_mut(i).copy_from(&self.joints[1].column(k));
        }
        if at_rest {
            self.rest(e)?;
        }
        if let Some(gears) = &self.system.gears
            && let Some(slopes) = &mut self.tangent.gears
        {
            slopes.settle(&self.system.arm, gears, &self.x, &self.joints[0]);
        }
        if self.servo.is_some() {
            self.hold();
            self.sample_servo(0.0);
        }
        Ok(())
    }

    /// Returns the servos that reached their torque limits.
    pub(super) fn limited(&self) -> Vec<TorqueLimited> {
        self.servo.as_ref().map_or(Vec::new(), |servo| servo.limited.clone())
    }

    /// Returns the current time (s).
    pub(super) fn time(&self) -> f64 {
        self.integrator.time()
    }

    /// Returns the indices of the free coordinates.
    pub(super) fn free(&self) -> &[usize] {
        &self.system.free
    }

    /// Returns model and poses of the current state.
    pub(super) fn poses(&self) -> (&Arc<Model>, &Data) {
        (&self.system.arm.model, &self.system.data)
    }

    /// Samples the joint motion at `t` and its derivatives.
    fn sample_joints(&mut self, t: f64) {
        let [q, qdot, qddot] = &mut self.reference;
        self.system.arm.motion.sample(t, q, qdot, qddot);
        for (k, direction) in self.directions.iter().enumerate() {
            if let Some(motion) = &direction.motion {
                let [q, qdot, qddot] = &mut self.sample;
                motion.sample(t, q, qdot, qddot);
                for (to, from) in self.joints.iter_mut().zip(&self.sample) {
                    from.iter().enumerate().for_each(|(i, x)| to[(k, i)] = *x);
                }
            }
        }
    }

    /// Computes δx of the equilibrium at the start.
    fn rest(&mut self, e: &DVector<f64>) -> Result<(), StepError> {
        let Self { system, tangent, directions, joints, x, room, .. } = self;
        let arm = &system.arm;
        let (m, n, p, driven) = (arm.model.n_actuated(), e.len(), directions.len(), arm.torque_driven.len());
        let mut state = State::zeros(&arm.model);
        let mut qddot = DVector::zeros(arm.model.nv());
        arm.prescribed_state(0.0, &mut state, &mut qddot);
        state.qdot.fill(0.0);
        qddot.fill(0.0);
        state.q.rows_mut(m, n).copy_from(e);
        let mut data = Data::new(&arm.model);
        inverse_dynamics(&arm.model, &mut data, &state, &qddot);
        world_poses(&arm.model, &mut data);
        let mut gears = GearState::of(arm);
        if let Some(gears) = &mut gears {
            gears.begin(arm, state.q.as_slice(), e.as_slice());
            gears.update(arm, state.q.as_slice(), state.qdot.as_slice(), e.as_slice(), &state.qdot.as_slice()[m..]);
        }
        tangent.compute(arm, 0.0, &data, &state, &qddot, gears.as_deref());
        let mut rhs = DMatrix::zeros(p, n);
        let mut own = vec![0.0; driven + n];
        let place: Vec<f64> = vec![0.0; driven].into_iter().chain(e.iter().copied()).collect();
        let at = LinearisationPoint {
            arm,
            data: &data,
            x: &place,
            v: &vec![0.0; driven + n],
            free: &system.free,
            rates: state.qdot.as_slice(),
            gears: gears.as_deref(),
            changes: 0,
        };
        for (k, direction) in directions.iter().enumerate() {
            own.fill(0.0);
            tangent.add_explicit(&at, (k, direction), room, &mut own);
            put(&own[driven..], &mut rhs, k);
        }
        add_product(&tangent.by_q, (m, 0), &joints[0], &mut rhs);
        let mut matrix = Lu::new(n);
        matrix.A.copy_from(&tangent.by_q.view((m, m), (n, n)));
        matrix.factor("static stiffness (with the effect of weight)", 0.0)?;
        rhs.neg_mut();
        matrix.solve_transposed(&mut rhs);
        x.columns_mut(driven, n).copy_from(&rhs);
        Ok(())
    }

    /// Computes the derivatives of the torques that hold the joints on their reference at the
    /// start, with the springs as they are.
    fn hold(&mut self) {
        let Self { system, integrator, tangent, directions, joints, x, room, own, servo: Some(servo), .. } = self
        else {
            return;
        };
        let now = Integrator::current(integrator);
        let m = system.arm.model.n_actuated();
        own.fill(0.0);
        for (to, &k) in own.iter_mut().zip(&system.arm.torque_driven) {
            *to = self.reference[2][k];
        }
        let at_rest = DVector::from_column_slice(own);
        system.evaluate(0.0, &now.x, &now.v, &at_rest);
        tangent.compute(&system.arm, 0.0, &system.data, &system.state, &system.qddot, system.gears.as_deref());
        mass_matrix_at_poses(&system.arm.model, &mut system.data);
        let at = LinearisationPoint::at(system, now);
        for (p, direction) in directions.iter().enumerate() {
            own.fill(0.0);
            tangent.add_explicit(&at, (p, direction), room, own);
            for (i, &k) in at.arm.torque_driven.iter().enumerate() {
                let given = (0..m).map(|j| {
                    tangent.by_q[(k, j)] * joints[0][(p, j)]
                        + tangent.by_rate[(k, j)] * joints[1][(p, j)]
                        + at.data.M[(k, j)] * joints[2][(p, j)]
                });
                let driven = at.arm.torque_driven.len();
                let bent = (driven..x.ncols()).map(|j| tangent.by_q[(k, at.free[j])] * x[(p, j)]);
                servo.torque[(p, i)] = own[i] + given.chain(bent).sum::<f64>();
            }
        }
    }

    /// Differentiates the sample of the controllers at `t`, if one was just taken.
    fn sample_servo(&mut self, t: f64) {
        let Self { system, servo: Some(slopes), directions, x, v, joints, .. } = self else { return };
        if let Some(servo) = &system.servo {
            slopes.sample(t, &system.arm, servo, directions, (x, v), joints);
        }
    }

    /// Evaluates the motion and the tangent matrices at the current state.
    fn look(&mut self) {
        let Self { system, integrator, tangent, directions, .. } = self;
        let now = Integrator::current(integrator);
        let t = now.grid.time();
        system.evaluate(t, &now.x, &now.v, &now.acceleration);
        self.q.copy_from(&system.state.q);
        if !directions.is_empty() {
            let (side, gears) = (system.events.side(t), system.gears.as_deref());
            tangent.compute(&system.arm, side, &system.data, &system.state, &system.qddot, gears);
            mass_matrix_at_poses(&system.arm.model, &mut system.data);
            tangent.M.copy_from(&system.data.M);
            tangent.gather(&system.arm, &system.free, self.moves);
        }
    }

    /// Computes δr of (3), including the contributions of the joint motion and of the controllers,
    /// in `rhs`.
    fn explicit(&mut self) {
        let Self { system, integrator, tangent, directions, joints, rhs, room, own, servo, .. } = self;
        let now = Integrator::current(integrator);
        rhs.fill(0.0);
        let at = LinearisationPoint::at(system, now);
        for (k, direction) in directions.iter().enumerate() {
            own.fill(0.0);
            tangent.add_explicit(&at, (k, direction), room, own);
            put(own, rhs, k);
        }
        if let Some(servo) = servo {
            let mut driven = rhs.columns_mut(0, servo.torque.ncols());
            driven -= &servo.torque;
        }
        if self.moves {
            for (matrix, joints) in tangent.by_joints.iter().zip(joints) {
                add_product(matrix, (0, 0), joints, rhs);
            }
        }
    }

    /// Computes δẍ from the equations of motion at the current state and resets the history of the
    /// scheme to it.
    fn accelerate(&mut self) -> Result<(), StepError> {
        if self.directions.is_empty() {
            return Ok(());
        }
        self.explicit();
        let Self { tangent: Tangent { own: [K, V, M], .. }, rhs, x, v, matrix, .. } = self;
        add_product(K, (0, 0), x, rhs);
        add_product(V, (0, 0), v, rhs);
        matrix.A.copy_from(M);
        matrix.factor("mass matrix", self.integrator.time())?;
        rhs.neg_mut();
        matrix.solve_transposed(rhs);
        for to in [&mut self.acceleration, &mut self.a, &mut self.x_tilde] {
            to.copy_from(&self.rhs);
        }
        Ok(())
    }

    /// Advances to the next grid time.
    pub(super) fn step(&mut self) -> Result<(), StepError> {
        let end = self.integrator.next_time();
        loop {
            let t = self.integrator.time();
            let event = self.system.next_event(t, end);
            let stop = event.filter(|event| *event < end).unwrap_or(end);
            let stop = self.system.resolved(t, stop, <GeneralizedAlpha as Integrator>::MOTION_RULE);
            self.advance(stop)?;
            let h = self.integrator.step_size();
            let now = Integrator::current_mut(&mut self.integrator);
            check_deflection(&self.system.arm, &now.x, stop, h)?;
            let jumps = self.system.events.jumps_over();
            let change = self.system.at_time(stop, &now.x, &mut now.v)?;
            if change != Change::Nothing {
                let blow = (self.system.events.jumps_over() > jumps).then(|| self.system.tau.clone());
                if change == Change::Matrices {
                    self.integrator.renew(&mut self.system)?;
                } else {
                    self.integrator.restart(&mut self.system)?;
                }
                self.sample_servo(stop);
                self.look();
                if let Some(blow) = &blow {
                    let before = self.joints[1].clone();
                    self.sample_joints(self.system.events.side(stop));
                    self.strike(stop, blow, Some(&before))?;
                }
                self.accelerate()?;
            }
            if stop == end {
                return Ok(());
            }
        }
    }

    /// Computes the derivatives of the free velocities at a velocity jump of the motion,
    /// `M_ff Δv_f + M_fp Δv_p = 0`; w, the argument `blow`, contains the jumps of all coordinates:
    ///
    /// ```text
    /// M_ff δΔv_f = -(∂(M w)/∂q δq + δM w + M_fp δΔv_p)
    /// ```
    /// * `before`: derivatives of the motion's velocities before the jump; `None` for a start from
    ///   rest.
    fn strike(&mut self, t: f64, blow: &DVector<f64>, before: Option<&DMatrix<f64>>) -> Result<(), StepError> {
        if self.directions.is_empty() {
            return Ok(());
        }
        let Self { system, tangent, directions, joints, x, v, room, own, rhs, matrix, of_inertia, .. } = self;
        let (arm, free) = (&system.arm, &system.free);
        rhs.fill(0.0);
        let Tangent { inertia, work, by_joints, own: [_, _, M], .. } = tangent;
        forward_kinematics(&arm.model, work, &self.q);
        inertia.of_inertia(&arm.model, work, &self.q, blow, of_inertia);
        let [of_free, of_joints] = &mut self.inertia_by;
        select(of_inertia, free, |j| Some(free[j]), of_free);
        add_product(of_free, (0, 0), x, rhs);
        if self.moves {
            select(of_inertia, free, Some, of_joints);
            add_product(of_joints, (0, 0), &joints[0], rhs);
            add_product(&by_joints[2], (0, 0), &joints[1], rhs);
            if let Some(before) = before {
                let back = -before;
                add_product(&by_joints[2], (0, 0), &back, rhs);
            }
        }
        for (k, direction) in directions.iter().enumerate() {
            room.fill(0.0);
            for (body, more) in direction.inertias_after(arm, system.events.changes_over()) {
                inertia.add_inertia_forces(&arm.model, work, body, more, room.as_mut_slice());
            }
            own.iter_mut().zip(free).enumerate().for_each(|(i, (own, f))| *own = rhs[(k, i)] + room[*f]);
            put(own, rhs, k);
        }
        matrix.A.copy_from(M);
        matrix.factor("mass matrix", t)?;
        rhs.neg_mut();
        matrix.solve_transposed(rhs);
        *v += &*rhs;
        Ok(())
    }

    /// Advances run and tangent to `stop`.
    fn advance(&mut self, stop: f64) -> Result<(), StepError> {
        let (dt, fresh) = self.next_length(stop);
        let differentiated = !self.directions.is_empty();
        if differentiated {
            self.q_start.copy_from(&self.q);
            self.joints_start.copy_from(&self.joints[0]);
            self.mass.A.copy_from(&self.tangent.own[2]);
            self.mass.factor("mass matrix", self.integrator.time())?;
        }
        self.integrator.advance_to(&mut self.system, stop)?;
        let newton = ImplicitStep::newton(&self.integrator);
        let dense = matches!(newton.matrix.way, MatrixForm::Dense(_));
        if newton.dt != dt || (newton.last().0 > MOST_ITERATIONS && !dense) {
            let what = "a step that does not converge at once";
            return Err(StepError::NoSlopes { what, mend: "take a smaller step" });
        }
        self.look();
        self.sample_joints(self.system.events.side(stop));
        if differentiated {
            if fresh {
                self.a.copy_from(&self.acceleration);
                self.x_tilde.copy_from(&self.acceleration);
            }
            self.correct(dt);
            self.solve(dt, stop)?;
            if let (Some(slopes), Some(gears)) = (&mut self.tangent.gears, &self.system.gears) {
                slopes.settle(&self.system.arm, gears, &self.x, &self.joints[0]);
            }
        }
        Ok(())
    }

    /// Returns the size of the step to `stop`, and whether the scheme resets its history before it.
    fn next_length(&self, stop: f64) -> (f64, bool) {
        let grid = &Integrator::current(&self.integrator).grid;
        let whole = stop == grid.next_time() && grid.is_on_step();
        let dt = if whole { grid.step_size() } else { stop - grid.time() };
        let newton = ImplicitStep::newton(&self.integrator);
        (dt, newton.fresh || newton.dt != dt)
    }

    /// Computes S and z of (1), at the end of the step.
    fn correct(&mut self, dt: f64) {
        self.S.fill_with_identity();
        self.z.fill(0.0);
        let c_h2 = self.c * dt * dt;
        if c_h2 == 0.0 {
            return;
        }
        let Self { system, integrator, tangent, directions, S, z, mass, of_inertia, y, room, own, x, .. } = self;
        let (arm, free) = (&system.arm, &system.free);
        let driven = arm.torque_driven.len();
        let acceleration = &Integrator::current(integrator).acceleration;
        // K is symmetric, so this is the transpose of M^-1 K.
        S.copy_from(&tangent.K);
        mass.solve_transposed(S);
        // y = M^-1 K ẍ⁺, using the workspace of one direction.
        own.fill(0.0);
        for (own, column) in own.iter_mut().zip(S.column_iter()) {
            *own = column.dot(acceleration);
        }
        y.fill(0.0);
        own.iter().zip(free).for_each(|(own, k)| y[*k] = *own);
        let Tangent { inertia, work, .. } = tangent;
        forward_kinematics(&arm.model, work, &self.q_start);
        inertia.of_inertia(&arm.model, work, &self.q_start, y, of_inertia);
        let [by_free, by_joints] = &mut self.inertia_by;
        select(of_inertia, free, |j| Some(free[j]), by_free);
        if self.moves {
            select(of_inertia, free, |j| (!arm.torque_driven.contains(&j)).then_some(j), by_joints);
            add_product(by_joints, (0, 0), &self.joints_start, z);
        }
        add_product(by_free, (0, 0), x, z);
        for (k, direction) in directions.iter().enumerate() {
            room.fill(0.0);
            for (body, more) in direction.inertias_after(arm, system.events.changes_over()) {
                inertia.add_inertia_forces(&arm.model, work, body, more, room.as_mut_slice());
            }
            own.iter_mut().zip(free).enumerate().for_each(|(i, (own, f))| *own = -room[*f] - z[(k, i)]);
            let (elastic, bent) = (&mut own[driven..], &acceleration.as_slice()[driven..]);
            for (number, slope) in &direction.springs {
                let element = &arm.elements[*number];
                let range = arm.offset(element)..arm.offset(element) + element.size;
                slope.add_linear(&element.K, &bent[range.clone()], &mut elastic[range]);
            }
            if let Some(dK) = &direction.stiffness {
                add_columns(dK, bent, elastic);
            }
            own.iter_mut().for_each(|own| *own *= c_h2);
            put(own, z, k);
        }
        mass.solve_transposed(z);
        S.scale_mut(c_h2);
        (0..S.nrows()).for_each(|k| S[(k, k)] += 1.0);
    }

    /// Solves (3) and updates all derivatives.
    fn solve(&mut self, dt: f64, t: f64) -> Result<(), StepError> {
        let (c_D, c_K) = self.coefficients.derivatives(dt);
        for k in 0..self.x.len() {
            let (x, v, a, x_tilde) = (self.x[k], self.v[k], self.a[k], self.x_tilde[k]);
            let (x, v) = self.coefficients.advance(dt, x, v, a, x_tilde, self.z[k]);
            (self.x_h[k], self.v_h[k]) = (x, v);
        }
        self.explicit();
        let Self { tangent: Tangent { own: [K, V, M], .. }, S, matrix, rhs, x_h, v_h, C, .. } = self;
        add_product(K, (0, 0), x_h, rhs);
        add_product(V, (0, 0), v_h, rhs);
        rhs.neg_mut();
        C.copy_from(V);
        C.zip_apply(K, |c, k| *c = c_D * *c + c_K * k);
        matrix.A.copy_from(M);
        add_product(S, (0, 0), C, &mut matrix.A);
        S.transpose_mut();
        matrix.factor("matrix of a step's tangent", t)?;
        matrix.solve_transposed(rhs);

        self.acceleration.copy_from(&self.rhs);
        // Overwrite the right-hand side by S δẍ⁺.
        self.rhs.fill(0.0);
        add_product(&self.S, (0, 0), &self.acceleration, &mut self.rhs);
        for k in 0..self.x.len() {
            let moved = self.rhs[k];
            self.x[k] = self.x_h[k] + c_K * moved;
            self.v[k] = self.v_h[k] + c_D * moved;
            let x_tilde = moved + self.z[k];
            self.a[k] = self.coefficients.remembered(self.a[k], self.x_tilde[k], x_tilde);
            self.x_tilde[k] = x_tilde;
        }
        Ok(())
    }
}

/// Copies the rows of free coordinates; `column` returns the source of each column, or `None` for
/// zeros.
fn select(from: &DMatrix<f64>, free: &[usize], column: impl Fn(usize) -> Option<usize>, to: &mut DMatrix<f64>) {
    for j in 0..to.ncols() {
        match column(j) {
            Some(own) => free.iter().enumerate().for_each(|(i, &row)| to[(i, j)] = from[(row, own)]),
            None => to.column_mut(j).fill(0.0),
        }
    }
}
