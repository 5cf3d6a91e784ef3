//! Static equilibria along a motion: each is sought from the one before, with the stiffness that was factored there.

use std::sync::Arc;

use flexarm_kinematics::{Data, Frame, State, forward_kinematics, gravity_forces};
use nalgebra::{Cholesky, DVector, Dyn, Vector3};

use crate::arm::FlexibleArm;
use crate::error::StepError;
use crate::events::EventQueue;
use crate::reduced::add_geometric_forces;
use crate::statics::{add_spring_forces, static_equilibrium, tangent_stiffness, with_curves};

/// A correction below this part of the deflection ends the search: the next one would be ten times smaller at least.
const SMALL: f64 = 1e-7;
/// Deflections below this are none (m, rad).
const NOTHING: f64 = 1e-15;
/// Corrections with one factor; a factor of the right place needs three or four.
const MOST_CORRECTIONS: usize = 8;

/// An instant before t (s), nearer than anything happens.
pub(crate) fn before(t: f64) -> f64 {
    t - 1e-12 * t.max(1.0)
}

/// The elastic coordinates of an arm that stands still wherever its motion is, for times in ascending order.
///
/// The same equilibria as [`static_equilibrium`], at the price of a few evaluations of weight each: the tangent stiffness
/// changes little along a motion, so that one factor serves many instants.
pub struct StaticPath {
    arm: FlexibleArm,
    events: EventQueue,
    data: Data,
    state: State,
    qddot: DVector<f64>,
    e: DVector<f64>,
    unbalanced: DVector<f64>,
    factor: Option<Cholesky<f64, Dyn>>,
}

impl StaticPath {
    /// For an arm with its loads and its changes of inertia.
    pub fn new(arm: FlexibleArm) -> Self {
        let (nv, n) = (arm.model.nv(), arm.n_elastic_coordinates());
        let (data, state) = (Data::new(&arm.model), State::zeros(&arm.model));
        let e = if arm.modes.equilibrium.len() == n { arm.modes.equilibrium.clone() } else { DVector::zeros(n) };
        let (qddot, unbalanced) = (DVector::zeros(nv), DVector::zeros(n));
        Self { events: EventQueue::of(&arm), data, state, qddot, unbalanced, e, factor: None, arm }
    }

    /// All coordinates at time `t` (s), not before the last one asked for: drives where the motion is, springs in balance
    /// with weight and loads. What the arm carries is what it carries from `t` on.
    ///
    /// # Errors
    /// As [`static_equilibrium`].
    pub fn at(&mut self, t: f64) -> Result<&DVector<f64>, StepError> {
        while let Some((_, change)) = self.events.due_change(t) {
            self.arm.model = Arc::new(self.arm.model.with_inertia(change.body, change.inertia));
        }
        self.balanced(t)
    }

    /// As [`StaticPath::at`], just before `t`: what happens at that time is still to come.
    ///
    /// # Errors
    /// As [`static_equilibrium`].
    pub fn just_before(&mut self, t: f64) -> Result<&DVector<f64>, StepError> {
        while let Some((_, change)) = self.events.change_before(t) {
            self.arm.model = Arc::new(self.arm.model.with_inertia(change.body, change.inertia));
        }
        self.balanced(before(t))
    }

    fn balanced(&mut self, t: f64) -> Result<&DVector<f64>, StepError> {
        if self.e.is_empty() || self.correct(t) {
            self.place(t);
            return Ok(&self.state.q);
        }
        self.e = static_equilibrium(&self.arm, t)?;
        self.place(t);
        let K = with_curves(&self.arm, &self.arm.stiffness(), self.state.q.as_slice(), &self.e);
        self.factor = tangent_stiffness(&self.arm, &mut self.data, t, &self.e, &K).cholesky();
        self.place(t);
        Ok(&self.state.q)
    }

    /// How far a frame is from where it would be with all springs undeformed (m, world axes), at the coordinates of the last
    /// time asked for.
    pub fn displacement(&mut self, frame: &Frame) -> Vector3<f64> {
        let Self { arm, data, state, e, .. } = self;
        let (model, n) = (&arm.model, arm.model.n_actuated());
        forward_kinematics(model, data, &state.q);
        let yielding = data.X_WF(frame).translation.vector;
        state.q.as_mut_slice()[n..].fill(0.0);
        forward_kinematics(model, data, &state.q);
        state.q.as_mut_slice()[n..].copy_from_slice(e.as_slice());
        yielding - data.X_WF(frame).translation.vector
    }

    /// The arm that stands still, with what it carries now.
    pub fn arm(&self) -> &FlexibleArm {
        &self.arm
    }

    fn place(&mut self, t: f64) {
        self.arm.prescribed_state(t, &mut self.state, &mut self.qddot);
        self.state.q.rows_mut(self.arm.model.n_actuated(), self.e.len()).copy_from(&self.e);
    }

    /// Newton with the factor at hand; false if it does not lead to the equilibrium.
    fn correct(&mut self, t: f64) -> bool {
        let Some(factor) = self.factor.take() else { return false };
        let (mut found, mut last) = (false, f64::INFINITY);
        for _ in 0..MOST_CORRECTIONS {
            self.balance(t);
            factor.solve_mut(&mut self.unbalanced);
            let size = self.unbalanced.amax();
            // A factor of another place makes small steps too; it must make them quickly smaller.
            if !size.is_finite() || size > 0.1 * last {
                break;
            }
            self.e -= &self.unbalanced;
            last = size;
            if size <= (SMALL * self.e.amax()).max(NOTHING) {
                found = true;
                break;
            }
        }
        if found {
            self.factor = Some(factor);
        }
        found
    }

    /// Forces of springs, weight and loads at the elastic coordinates.
    fn balance(&mut self, t: f64) {
        self.place(t);
        let Self { arm, data, state, e, unbalanced, .. } = self;
        if !arm.loads.is_empty() {
            forward_kinematics(&arm.model, data, &state.q);
            arm.apply_loads(data, t);
        }
        unbalanced.copy_from(&gravity_forces(&arm.model, data, &state.q).rows(arm.model.n_actuated(), e.len()));
        add_geometric_forces(arm, data, e.as_slice(), unbalanced.as_mut_slice());
        add_spring_forces(arm, state.q.as_slice(), e.as_slice(), unbalanced.as_mut_slice());
    }
}
