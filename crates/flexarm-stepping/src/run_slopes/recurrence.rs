//! A run and its tangent, step by step.
//!
//! With `S = 1 + c h² M^-1 K` at the start of the step ((5) of generalised-alpha) and `y = M^-1 K ẍ⁺`:
//!
//! ```text
//! δx̃⁺ = S δẍ⁺ + z,    z = c h² M^-1 (δK ẍ⁺ - δM y)                       δM by parameters and by δq of the start   (1)
//! δx⁺ = x_h + c_K δx̃⁺,  δẋ⁺ = v_h + c_D δx̃⁺                             x_h, v_h from what is known at the start  (2)
//! (M + (c_D V + c_K K) S) δẍ⁺ = -(V (v_h + c_D z) + K (x_h + c_K z) + δr)                                         (3)
//! ```

use std::sync::Arc;

use flexarm_kinematics::{Data, DynamicTangent, Model, PointLoad, State, StaticTangent, forward_kinematics};
use flexarm_kinematics::{inverse_dynamics, mass_matrix_at_poses, world_poses};
use nalgebra::{DMatrix, DVector};

use crate::arm::FlexibleArm;
use crate::error::StepError;
use crate::events::Change;
use crate::implicit::ImplicitStep;
use crate::integrator::{Integrator, check_deflection};
use crate::reduced::ReducedArm;
use crate::run_slopes::columns::add_product;
use crate::run_slopes::lu::Lu;
use crate::run_slopes::{Direction, SlopesRequest, SpringSlope};
use crate::steppers::{Coefficients, GeneralizedAlpha};

/// Iterations of a step that finds its way; after more the matrix would be taken anew within it.
const MOST_ITERATIONS: usize = 8;

/// A run with its tangent: n elastic coordinates, m joints, p directions.
pub(super) struct Recurrence<'a> {
    system: ReducedArm,
    integrator: GeneralizedAlpha,
    directions: &'a [Direction],
    coefficients: Coefficients,
    /// c of the dispersion correction; 0 without.
    c: f64,
    /// All coordinates at the current time.
    pub(super) q: DVector<f64>,
    /// Derivatives of the elastic coordinates, p × n, of their rates and accelerations, and of what the scheme remembers: all directions of
    /// a coordinate stand together, so that sums go over whole columns.
    pub(super) x: DMatrix<f64>,
    v: DMatrix<f64>,
    acceleration: DMatrix<f64>,
    a: DMatrix<f64>,
    x_tilde: DMatrix<f64>,
    /// Of the joints, their rates and accelerations, p × m.
    pub(super) joints: [DMatrix<f64>; 3],
    tangent: Tangent,
    /// Sᵀ, then S, and M of the start of the step.
    S: DMatrix<f64>,
    mass: Lu,
    matrix: Lu,
    /// δM y by all coordinates, nv × nv.
    of_inertia: DMatrix<f64>,
    /// `M^-1 K ẍ⁺`, all coordinates.
    y: DVector<f64>,
    /// All coordinates at the start of the step, and the derivatives of the joints there.
    q_start: DVector<f64>,
    joints_start: DMatrix<f64>,
    /// `c_D V + c_K K`.
    C: DMatrix<f64>,
    /// z, x_h and v_h, and the right-hand side.
    z: DMatrix<f64>,
    x_h: DMatrix<f64>,
    v_h: DMatrix<f64>,
    rhs: DMatrix<f64>,
    room: DVector<f64>,
    /// Room for one direction: its joints, its elastic coordinates.
    sample: [Vec<f64>; 3],
    own: Vec<f64>,
}

/// Matrices of (1) of the module above at the current state.
struct Tangent {
    dynamic: DynamicTangent,
    inertia: DynamicTangent,
    loads: StaticTangent,
    points: Vec<PointLoad>,
    /// Whether there are loads or balancers.
    loaded: bool,
    /// Of other places than the current one.
    work: Data,
    /// `∂r/∂q`, `∂r/∂q̇` and M, nv × nv.
    by_q: DMatrix<f64>,
    by_rate: DMatrix<f64>,
    M: DMatrix<f64>,
    G: DMatrix<f64>,
    /// Stiffness about the relaxed springs, n × n.
    K: DMatrix<f64>,
}

impl<'a> Recurrence<'a> {
    /// The run at its start, with elastic coordinates `e`.
    pub(super) fn new(
        arm: FlexibleArm,
        request: &SlopesRequest,
        directions: &'a [Direction],
        e: &DVector<f64>,
    ) -> Result<Self, StepError> {
        let (m, n, p) = (arm.model.n_actuated(), arm.n_elastic_coordinates(), directions.len());
        let tangent = Tangent::new(&arm)?;
        let mut system = ReducedArm::new(arm);
        let (x, v) = system.start(e)?;
        let h = request.step_s;
        let integrator = GeneralizedAlpha::new(&mut system, 0.0, h, request.settings, x, v)?.exactly();
        let coefficients = Coefficients::new(request.settings.rho);
        let c = if request.settings.dispersion_correction { coefficients.dispersion().max(0.0) } else { 0.0 };
        let zeros = || DMatrix::zeros(p, n);
        let mut run = Self {
            integrator,
            directions,
            coefficients,
            c,
            q: DVector::zeros(m + n),
            x: zeros(),
            v: zeros(),
            acceleration: zeros(),
            a: zeros(),
            x_tilde: zeros(),
            joints: std::array::from_fn(|_| DMatrix::zeros(p, m)),
            sample: std::array::from_fn(|_| vec![0.0; m]),
            own: vec![0.0; n],
            tangent,
            S: DMatrix::zeros(n, n),
            mass: Lu::new(n),
            matrix: Lu::new(n),
            of_inertia: DMatrix::zeros(m + n, m + n),
            y: DVector::zeros(m + n),
            q_start: DVector::zeros(m + n),
            joints_start: DMatrix::zeros(p, m),
            C: DMatrix::zeros(n, n),
            z: zeros(),
            x_h: zeros(),
            v_h: zeros(),
            rhs: zeros(),
            room: DVector::zeros(m + n),
            system,
        };
        run.sample_joints(0.0);
        if p > 0 && request.start == crate::stepper::Start::Equilibrium {
            run.rest(e)?;
        }
        run.look();
        run.accelerate()?;
        Ok(run)
    }

    /// Current time (s).
    pub(super) fn time(&self) -> f64 {
        self.integrator.time()
    }

    /// Poses of the current state.
    pub(super) fn poses(&self) -> (&Arc<Model>, &Data) {
        (&self.system.arm.model, &self.system.data)
    }

    /// Derivatives of the motion of the joints.
    fn sample_joints(&mut self, t: f64) {
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

    /// δx of the equilibrium at the start.
    fn rest(&mut self, e: &DVector<f64>) -> Result<(), StepError> {
        let Self { system, tangent, directions, joints, x, rhs, room, own, matrix, .. } = self;
        let arm = &system.arm;
        let (m, n) = (arm.model.n_actuated(), e.len());
        let mut state = State::zeros(&arm.model);
        let mut qddot = DVector::zeros(m + n);
        arm.prescribed_state(0.0, &mut state, &mut qddot);
        state.qdot.fill(0.0);
        qddot.fill(0.0);
        state.q.rows_mut(m, n).copy_from(e);
        let mut data = Data::new(&arm.model);
        inverse_dynamics(&arm.model, &mut data, &state, &qddot);
        world_poses(&arm.model, &mut data);
        tangent.compute(arm, 0.0, &data, &state, &qddot);
        rhs.fill(0.0);
        let still = DVector::zeros(n);
        for (k, direction) in directions.iter().enumerate() {
            own.fill(0.0);
            tangent.add_explicit(arm, &data, direction, e.as_slice(), still.as_slice(), room, own);
            put(own, rhs, k);
        }
        add_product(&tangent.by_q, (m, 0), &joints[0], rhs);
        matrix.A.copy_from(&tangent.by_q.view((m, m), (n, n)));
        matrix.factor("static stiffness (with the effect of weight)", 0.0)?;
        x.copy_from(rhs);
        x.neg_mut();
        matrix.solve_transposed(x);
        Ok(())
    }

    /// Motion and matrices of the current state.
    fn look(&mut self) {
        let Self { system, integrator, tangent, directions, .. } = self;
        let now = Integrator::current(integrator);
        let t = now.grid.time();
        system.evaluate(t, &now.x, &now.v, &now.acceleration);
        self.q.copy_from(&system.state.q);
        if !directions.is_empty() {
            tangent.compute(&system.arm, system.events.side(t), &system.data, &system.state, &system.qddot);
            mass_matrix_at_poses(&system.arm.model, &mut system.data);
            tangent.M.copy_from(&system.data.M);
        }
    }

    /// δr of (3), with what the joints' motion does, into `rhs`.
    fn explicit(&mut self) {
        let Self { system, integrator, tangent, directions, joints, rhs, room, own, .. } = self;
        let now = Integrator::current(integrator);
        let m = system.arm.model.n_actuated();
        rhs.fill(0.0);
        for (k, direction) in directions.iter().enumerate() {
            let (x, v) = (now.x.as_slice(), now.v.as_slice());
            own.fill(0.0);
            tangent.add_explicit(&system.arm, &system.data, direction, x, v, room, own);
            put(own, rhs, k);
        }
        if directions.iter().any(|direction| direction.motion.is_some()) {
            for (matrix, joints) in [&tangent.by_q, &tangent.by_rate, &tangent.M].into_iter().zip(joints) {
                add_product(matrix, (m, 0), joints, rhs);
            }
        }
    }

    /// δẍ of the equations of motion at the current state, which is all that the scheme then remembers.
    fn accelerate(&mut self) -> Result<(), StepError> {
        if self.directions.is_empty() {
            return Ok(());
        }
        self.explicit();
        let Self { system, tangent, rhs, x, v, matrix, .. } = self;
        let m = system.arm.model.n_actuated();
        let n = x.ncols();
        add_product(&tangent.by_q, (m, m), x, rhs);
        add_product(&tangent.by_rate, (m, m), v, rhs);
        matrix.A.copy_from(&tangent.M.view((m, m), (n, n)));
        matrix.factor("mass matrix", self.integrator.time())?;
        rhs.neg_mut();
        matrix.solve_transposed(rhs);
        for to in [&mut self.acceleration, &mut self.a, &mut self.x_tilde] {
            to.copy_from(&self.rhs);
        }
        Ok(())
    }

    /// To the next multiple of the step.
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
            if self.system.at_time(stop, &now.x, &mut now.v)? != Change::Nothing {
                self.integrator.restart(&mut self.system)?;
                self.look();
                self.accelerate()?;
            }
            if stop == end {
                return Ok(());
            }
        }
    }

    /// Run and tangent to `stop`.
    fn advance(&mut self, stop: f64) -> Result<(), StepError> {
        let (dt, fresh) = self.next_length(stop);
        let differentiated = !self.directions.is_empty();
        if differentiated {
            let (m, n) = (self.system.arm.model.n_actuated(), self.x.ncols());
            self.q_start.copy_from(&self.q);
            self.joints_start.copy_from(&self.joints[0]);
            self.mass.A.copy_from(&self.tangent.M.view((m, m), (n, n)));
            self.mass.factor("mass matrix", self.integrator.time())?;
        }
        self.integrator.advance_to(&mut self.system, stop)?;
        let newton = ImplicitStep::newton(&self.integrator);
        if newton.dt != dt || newton.last().0 > MOST_ITERATIONS {
            let what = "a step that does not converge at once";
            return Err(StepError::NoSlopes { what, mend: "take a smaller step" });
        }
        self.look();
        if differentiated {
            self.sample_joints(self.system.events.side(stop));
            if fresh {
                self.a.copy_from(&self.acceleration);
                self.x_tilde.copy_from(&self.acceleration);
            }
            self.correct(dt);
            self.solve(dt, stop)?;
        }
        Ok(())
    }

    /// Length of the step to `stop`, and whether the scheme forgets what was before it.
    fn next_length(&self, stop: f64) -> (f64, bool) {
        let grid = &Integrator::current(&self.integrator).grid;
        let whole = stop == grid.next_time() && grid.is_on_step();
        let dt = if whole { grid.step_size() } else { stop - grid.time() };
        let newton = ImplicitStep::newton(&self.integrator);
        (dt, newton.fresh || newton.dt != dt)
    }

    /// S and z of (1), at the end of the step.
    fn correct(&mut self, dt: f64) {
        self.S.fill_with_identity();
        self.z.fill(0.0);
        let c_h2 = self.c * dt * dt;
        if c_h2 == 0.0 {
            return;
        }
        let Self { system, integrator, tangent, directions, S, z, mass, of_inertia, y, room, own, x, .. } = self;
        let arm = &system.arm;
        let (m, n) = (arm.model.n_actuated(), z.ncols());
        let acceleration = &Integrator::current(integrator).acceleration;
        // K is symmetric: the transposed of M^-1 K.
        S.copy_from(&tangent.K);
        mass.solve_transposed(S);
        y.fill(0.0);
        y.rows_mut(m, n).gemv_tr(1.0, S, acceleration, 0.0);
        let Tangent { inertia, work, .. } = tangent;
        forward_kinematics(&arm.model, work, &self.q_start);
        inertia.of_inertia(&arm.model, work, &self.q_start, y, of_inertia);
        add_product(of_inertia, (m, 0), &self.joints_start, z);
        add_product(of_inertia, (m, m), x, z);
        for (k, direction) in directions.iter().enumerate() {
            room.fill(0.0);
            for (body, more) in &direction.inertias {
                inertia.add_inertia_forces(&arm.model, work, *body, more, 1.0, room.as_mut_slice());
            }
            own.iter_mut().zip(&room.as_slice()[m..]).enumerate().for_each(|(i, (own, x))| *own = -x - z[(k, i)]);
            for (number, slope) in &direction.springs {
                let element = &arm.elements[*number];
                let range = arm.offset(element)..arm.offset(element) + element.size;
                let to = &mut own[range.clone()];
                slope.add_linear(&element.K, &acceleration.as_slice()[range], to);
            }
            own.iter_mut().for_each(|own| *own *= c_h2);
            put(own, z, k);
        }
        mass.solve_transposed(z);
        S.scale_mut(c_h2);
        (0..n).for_each(|k| S[(k, k)] += 1.0);
    }

    /// (3), and what follows from it.
    fn solve(&mut self, dt: f64, t: f64) -> Result<(), StepError> {
        let (c_D, c_K) = self.coefficients.derivatives(dt);
        for k in 0..self.x.len() {
            let (x, v, a, x_tilde) = (self.x[k], self.v[k], self.a[k], self.x_tilde[k]);
            let (x, v) = self.coefficients.advance(dt, x, v, a, x_tilde, self.z[k]);
            (self.x_h[k], self.v_h[k]) = (x, v);
        }
        self.explicit();
        let Self { system, tangent, S, matrix, rhs, x_h, v_h, C, .. } = self;
        let (m, n) = (system.arm.model.n_actuated(), x_h.ncols());
        add_product(&tangent.by_q, (m, m), x_h, rhs);
        add_product(&tangent.by_rate, (m, m), v_h, rhs);
        rhs.neg_mut();
        C.copy_from(&tangent.by_rate.view((m, m), (n, n)));
        C.zip_apply(&tangent.by_q.view((m, m), (n, n)), |c, k| *c = c_D * *c + c_K * k);
        matrix.A.copy_from(&tangent.M.view((m, m), (n, n)));
        add_product(S, (0, 0), C, &mut matrix.A);
        S.transpose_mut();
        matrix.factor("matrix of a step's tangent", t)?;
        matrix.solve_transposed(rhs);

        self.acceleration.copy_from(&self.rhs);
        // S δẍ⁺ in the place of the right-hand side.
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

impl Tangent {
    fn new(arm: &FlexibleArm) -> Result<Self, StepError> {
        let model = &arm.model;
        let nv = model.nv();
        let dynamic = DynamicTangent::new(model);
        let Some(dynamic) = dynamic else {
            return Err(StepError::NoSlopes { what: "links that bend in modes", mend: "model them as lumped" });
        };
        let square = || DMatrix::zeros(nv, nv);
        Ok(Self {
            inertia: dynamic.clone(),
            dynamic,
            loads: StaticTangent::new(model, 0),
            points: Vec::with_capacity(arm.loads.len()),
            loaded: !arm.loads.is_empty() || !model.balancers().is_empty(),
            work: Data::new(model),
            by_q: square(),
            by_rate: square(),
            M: square(),
            G: square(),
            K: arm.stiffness(),
        })
    }

    /// `∂r/∂q` and `∂r/∂q̇` of the motion that was last given to `data`, loads of time t.
    fn compute(&mut self, arm: &FlexibleArm, t: f64, data: &Data, state: &State, qddot: &DVector<f64>) {
        let model = &arm.model;
        let (m, n) = (model.n_actuated(), arm.n_elastic_coordinates());
        self.dynamic.compute(model, data, state, qddot, &mut self.by_q, &mut self.by_rate);
        if self.loaded {
            self.points.clear();
            self.points.extend(arm.loads.iter().map(|load| load.point_load(t, &data.X_WB[load.body])));
            self.loads.of_loads(model, data, &state.q, &self.points, &mut self.G);
            self.by_q += &self.G;
        }
        for element in &arm.elements {
            let first = element.coordinate;
            match &element.curve {
                Some(curve) => self.by_q[(first, first)] += curve.slope(state.q[first]),
                None => {
                    let mut block = self.by_q.view_mut((first, first), (element.size, element.size));
                    block += &element.K;
                }
            }
        }
        let mut block = self.by_rate.view_mut((m, m), (n, n));
        block += &arm.D;
    }

    /// Adds `∂r/∂p` of a direction without the joints' motion to `to`, in the motion of [`Tangent::compute`].
    #[allow(clippy::too_many_arguments, reason = "the state of a run and a room for it")]
    fn add_explicit(
        &self,
        arm: &FlexibleArm,
        data: &Data,
        direction: &Direction,
        x: &[f64],
        v: &[f64],
        room: &mut DVector<f64>,
        to: &mut [f64],
    ) {
        for (number, slope) in &direction.springs {
            let element = &arm.elements[*number];
            let range = arm.offset(element)..arm.offset(element) + element.size;
            match (&element.curve, slope) {
                (Some(curve), SpringSlope::Factor(factor)) => to[range.start] += factor * curve.torque(x[range.start]),
                _ => slope.add_linear(&element.K, &x[range.clone()], &mut to[range]),
            }
        }
        if let Some(dD) = &direction.damping {
            add_columns(dD, (0, 0), v, to);
        }
        if !direction.inertias.is_empty() {
            room.fill(0.0);
            for (body, more) in &direction.inertias {
                self.dynamic.add_inertia_forces(&arm.model, data, *body, more, 1.0, room.as_mut_slice());
            }
            let m = arm.model.n_actuated();
            to.iter_mut().zip(&room.as_slice()[m..]).for_each(|(to, force)| *to += force);
        }
    }
}

impl SpringSlope {
    /// Adds its part of `δK x`.
    fn add_linear(&self, K: &DMatrix<f64>, x: &[f64], to: &mut [f64]) {
        let (matrix, factor) = match self {
            Self::Factor(factor) => (K, *factor),
            Self::Matrix(dK) => (dK, 1.0),
        };
        for (column, x) in matrix.as_slice().chunks_exact(matrix.nrows()).zip(x) {
            to.iter_mut().zip(column).for_each(|(to, k)| *to += factor * k * x);
        }
    }
}

/// Puts the numbers of a direction into its row.
fn put(from: &[f64], to: &mut DMatrix<f64>, row: usize) {
    from.iter().enumerate().for_each(|(i, x)| to[(row, i)] = *x);
}

/// `to += A x`, likewise.
fn add_columns(A: &DMatrix<f64>, (row, column): (usize, usize), x: &[f64], to: &mut [f64]) {
    let (rows, all) = (A.nrows(), A.as_slice());
    for (k, x) in x.iter().enumerate().filter(|(_, x)| **x != 0.0) {
        let from = &all[(column + k) * rows + row..][..to.len()];
        to.iter_mut().zip(from).for_each(|(to, a)| *to += a * x);
    }
}
