//! Derivatives of the generalised forces of a motion: in closed form, or by differences of the
//! recursions with closed loops or modal links.
//!
//! ```text
//! ∂τ/∂q̇: τ is quadratic in q̇, so central differences of any step size are exact
//! ∂τ/∂q: central differences of sixth order
//! additional inertia I of a body: Jᵀ (I A + V × I V), J at its origin
//! ```
//! Differences take eight passes of the recursions per coordinate, twenty with the dispersion
//! correction.

use flexarm_kinematics::{
    Data, DynamicTangent, Frame, Model, Pose, SpatialInertia, State, Twist, forward_kinematics, frame_jacobian,
    inverse_dynamics,
};
use nalgebra::{DMatrix, DVector, Matrix6xX, Vector6};

use crate::arm::FlexibleArm;

/// Step size of the differences with respect to coordinates (rad, m; modal coordinates in their own
/// units).
const STEP: f64 = 1e-2;
/// Weights of sixth-order differences at 1, 2 and 3 steps.
const WEIGHTS: [f64; 3] = [0.75, -0.15, 1.0 / 60.0];

/// `∂τ/∂q` and `∂τ/∂q̇` of a model, with workspace.
pub(super) enum ForceTangent {
    /// Closed form, for trees of rigid bodies.
    Closed(Box<DynamicTangent>),
    /// Differences, for other models.
    Differences(Box<Differences>),
}

/// Workspace of the differences.
pub(super) struct Differences {
    data: Data,
    state: State,
    still: DVector<f64>,
    J: Matrix6xX<f64>,
    origin: Frame,
    /// Accelerations of the last [`ForceTangent::of_inertia`], at rest and without gravity; `None`
    /// if the last call was `compute`.
    at_rest: Option<DVector<f64>>,
}

impl ForceTangent {
    pub(super) fn new(model: &Model) -> Self {
        if let Some(closed) = DynamicTangent::new(model) {
            return Self::Closed(Box::new(closed));
        }
        Self::Differences(Box::new(Differences {
            data: Data::new(model),
            state: State::zeros(model),
            still: DVector::zeros(model.nv()),
            J: Matrix6xX::zeros(model.nv()),
            origin: Frame { name: String::new(), body: 0, X_BF: Pose::identity() },
            at_rest: None,
        }))
    }

    /// Returns whether [`ForceTangent::compute`] includes loads and balancers.
    pub(super) fn has_loads(&self) -> bool {
        matches!(self, Self::Differences(_))
    }

    /// Computes the derivatives as [`DynamicTangent::compute`] does; `loads`: the arm and the time
    /// of its loads.
    pub(super) fn compute(
        &mut self,
        model: &Model,
        (data, state, qddot): (&Data, &State, &DVector<f64>),
        loads: Option<(&FlexibleArm, f64)>,
        by_q: &mut DMatrix<f64>,
        by_rate: &mut DMatrix<f64>,
    ) {
        match self {
            Self::Closed(tangent) => tangent.compute(model, data, state, qddot, by_q, by_rate),
            Self::Differences(own) => own.compute(model, state, qddot, loads, by_q, by_rate),
        }
    }

    /// Computes the derivative of inertia forces as [`DynamicTangent::of_inertia`] does.
    pub(super) fn of_inertia(
        &mut self,
        model: &Model,
        data: &Data,
        q: &DVector<f64>,
        a: &DVector<f64>,
        G: &mut DMatrix<f64>,
    ) {
        match self {
            Self::Closed(tangent) => tangent.of_inertia(model, data, q, a, G),
            Self::Differences(own) => own.of_inertia(model, q, a, G),
        }
    }

    /// Adds inertia forces as [`DynamicTangent::add_inertia_forces`] does.
    pub(super) fn add_inertia_forces(
        &mut self,
        model: &Model,
        data: &Data,
        body: usize,
        more: &SpatialInertia,
        tau: &mut [f64],
    ) {
        match self {
            Self::Closed(tangent) => tangent.add_inertia_forces(model, data, body, more, 1.0, tau),
            Self::Differences(own) => own.add_inertia_forces(model, data, body, more, tau),
        }
    }
}

impl Differences {
    /// Returns the forces of the motion in `state`, under the loads of an arm at a time.
    fn forces(&mut self, model: &Model, qddot: &DVector<f64>, loads: Option<(&FlexibleArm, f64)>) -> &DVector<f64> {
        let Self { data, state, .. } = self;
        if let Some((arm, t)) = loads.filter(|(arm, _)| !arm.loads.is_empty()) {
            forward_kinematics(model, data, &state.q);
            arm.apply_loads(data, t);
        }
        inverse_dynamics(model, data, state, qddot)
    }

    fn compute(
        &mut self,
        model: &Model,
        state: &State,
        qddot: &DVector<f64>,
        loads: Option<(&FlexibleArm, f64)>,
        by_q: &mut DMatrix<f64>,
        by_rate: &mut DMatrix<f64>,
    ) {
        self.at_rest = None;
        self.state.q.copy_from(&state.q);
        self.state.qdot.copy_from(&state.qdot);
        // Step size of the order of the speeds, to keep round-off small.
        let speed = state.qdot.amax().max(1.0);
        for k in 0..state.q.len() {
            let mut column = by_rate.column_mut(k);
            column.fill(0.0);
            for side in [1.0, -1.0] {
                self.state.qdot[k] = state.qdot[k] + side * speed;
                column.axpy(0.5 * side / speed, self.forces(model, qddot, loads), 1.0);
            }
            self.state.qdot[k] = state.qdot[k];
            self.column(model, k, qddot, loads, by_q);
        }
    }

    /// Computes the differences with respect to coordinate k.
    fn column(
        &mut self,
        model: &Model,
        k: usize,
        qddot: &DVector<f64>,
        loads: Option<(&FlexibleArm, f64)>,
        to: &mut DMatrix<f64>,
    ) {
        let here = self.state.q[k];
        let mut column = to.column_mut(k);
        column.fill(0.0);
        for (number, weight) in WEIGHTS.into_iter().enumerate() {
            for side in [1.0, -1.0] {
                self.state.q[k] = here + side * (number + 1) as f64 * STEP;
                column.axpy(side * weight / STEP, self.forces(model, qddot, loads), 1.0);
            }
        }
        self.state.q[k] = here;
    }

    fn of_inertia(&mut self, model: &Model, q: &DVector<f64>, a: &DVector<f64>, G: &mut DMatrix<f64>) {
        self.data.clear_external_wrenches();
        self.state.q.copy_from(q);
        self.state.qdot.fill(0.0);
        let still = std::mem::replace(&mut self.still, DVector::zeros(0));
        for k in 0..q.len() {
            let here = q[k];
            let mut column = G.column_mut(k);
            column.fill(0.0);
            for (number, weight) in WEIGHTS.into_iter().enumerate() {
                for side in [1.0, -1.0] {
                    self.state.q[k] = here + side * (number + 1) as f64 * STEP;
                    // Subtract gravity and the forces that balance it.
                    column.axpy(side * weight / STEP, self.forces(model, a, None), 1.0);
                    column.axpy(-side * weight / STEP, self.forces(model, &still, None), 1.0);
                }
            }
            self.state.q[k] = here;
        }
        self.still = still;
        match &mut self.at_rest {
            Some(own) => own.copy_from(a),
            none => *none = Some(a.clone()),
        }
    }

    fn add_inertia_forces(&mut self, model: &Model, data: &Data, body: usize, more: &SpatialInertia, tau: &mut [f64]) {
        let Self { J, origin, at_rest, .. } = self;
        origin.body = body;
        frame_jacobian(model, data, origin, J);
        let R = data.X_WB[body].rotation;
        let (V, A) = match at_rest {
            None => (data.V[body], data.A[body]),
            Some(a) => {
                let mut twist = Vector6::zeros();
                J.column_iter().zip(a.iter()).for_each(|(column, a)| twist += column * *a);
                let part = |k: usize| R.inverse() * twist.fixed_rows::<3>(k).into_owned();
                (Twist::zeros(), Twist::new(part(0), part(3)))
            }
        };
        let F = more.mul_twist(&A) + V.cross_force(&more.mul_twist(&V));
        let (f, n) = (R * F.force, R * F.torque);
        let W = Vector6::new(f.x, f.y, f.z, n.x, n.y, n.z);
        tau.iter_mut().zip(J.column_iter()).for_each(|(tau, column)| *tau += column.dot(&W));
    }
}
