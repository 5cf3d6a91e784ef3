//! Static equilibria along a motion: each one starts from the previous one and reuses its inverse
//! tangent stiffness.
//!
//! Start at [`StaticPath::at`]. Not here: a single equilibrium (`statics.rs`), equilibria at many
//! unrelated poses (`operating_point`).

use std::sync::Arc;

use flexarm_kinematics::products::{add, mul};
use flexarm_kinematics::{Data, Frame, JointMotion, State, forward_kinematics, gravity_forces};
use nalgebra::{DMatrix, DVector, Vector3};

use crate::dense::product;
use crate::error::StepError;
use crate::events::EventQueue;
use crate::geometric::add_geometric_forces;
use crate::plant::{InertiaChange, Plant};
use crate::statics::{add_spring_forces, static_equilibrium, tangent_stiffness, with_curves};

/// Relative correction that ends the search: the next correction would be at least ten times
/// smaller.
const SMALL: f64 = 1e-7;
/// Corrections below this count as zero (m, rad).
const NOTHING: f64 = 1e-15;
/// Maximum number of corrections with one inverse; a current inverse needs three or four.
const MAX_CORRECTIONS: usize = 8;

/// Returns a time just before `t` (s), closer than the separation of events.
pub(crate) fn before(t: f64) -> f64 {
    t - 1e-12 * t.max(1.0)
}

/// Static equilibria of an arm at the positions of its motion, for times in ascending order.
///
/// The results are those of [`static_equilibrium`] at the cost of a few evaluations of weight each:
/// the tangent stiffness changes little along a motion, so that its inverse at one position serves
/// many times.
pub struct StaticPath {
    plant: Arc<Plant>,
    events: EventQueue,
    data: Data,
    /// Drives at the last time, springs at `e`.
    state: State,
    qddot: DVector<f64>,
    e: DVector<f64>,
    unbalanced: DVector<f64>,
    correction: DVector<f64>,
    /// Inverse of the tangent stiffness.
    inverse: Option<DMatrix<f64>>,
    /// Time (s) of the last full solution, if the inverse has not been computed since.
    sought_at: Option<f64>,
}

impl StaticPath {
    /// Creates the path of an arm with its loads and changes of inertia.
    pub fn new(plant: impl Into<Arc<Plant>>) -> Self {
        let plant = plant.into();
        let (nv, n) = (plant.model.nv(), plant.model.n_elastic());
        Self {
            events: EventQueue::of_changes(&plant),
            data: Data::new(&plant.model),
            state: State::zeros(&plant.model),
            qddot: DVector::zeros(nv),
            e: if plant.modes.equilibrium.len() == n { plant.modes.equilibrium.clone() } else { DVector::zeros(n) },
            unbalanced: DVector::zeros(n),
            correction: DVector::zeros(n),
            inverse: None,
            sought_at: None,
            plant,
        }
    }

    /// Returns all coordinates at time `t` (s), which must not be before the last requested time:
    /// drives at the motion, springs in balance with weight and loads. A change of inertia at `t`
    /// is included.
    ///
    /// # Errors
    /// As [`static_equilibrium`].
    pub fn at(&mut self, t: f64) -> Result<&DVector<f64>, StepError> {
        self.take_inverse();
        while let Some((_, change)) = self.events.due_change(t) {
            carry(&mut self.plant, change);
        }
        self.balanced(t)
    }

    /// Returns the coordinates just before `t` (s), in m and rad: events at that time are still
    /// pending.
    ///
    /// # Errors
    /// As [`static_equilibrium`].
    pub fn just_before(&mut self, t: f64) -> Result<&DVector<f64>, StepError> {
        self.take_inverse();
        while let Some((_, change)) = self.events.change_before(t) {
            carry(&mut self.plant, change);
        }
        self.balanced(before(t))
    }

    fn balanced(&mut self, t: f64) -> Result<&DVector<f64>, StepError> {
        self.plant.prescribed_state(t, &mut self.state, &mut self.qddot);
        if !(self.e.is_empty() || self.correct(t)) {
            self.e = static_equilibrium(&self.plant, t)?;
            self.bend();
            self.sought_at = Some(t);
        }
        Ok(&self.state.q)
    }

    /// Returns the displacement of a frame from its position with all springs undeformed (m, world
    /// axes), at the coordinates of the last requested time.
    pub fn displacement(&mut self, frame: &Frame) -> Vector3<f64> {
        forward_kinematics(&self.plant.model, &mut self.data, &self.state.q);
        let yielding = self.data.X_WF(frame).translation.vector;
        yielding - self.undeformed(frame)
    }

    /// Returns the undeformed position of a frame, for the poses in `data`; with closed loops these
    /// poses are overwritten.
    fn undeformed(&mut self, frame: &Frame) -> Vector3<f64> {
        let Self { plant, data, state, .. } = self;
        if !plant.model.loops().is_empty() {
            state.q.as_mut_slice()[plant.model.n_actuated()..].fill(0.0);
            forward_kinematics(&plant.model, data, &state.q);
            self.bend();
            return self.data.X_WF(frame).translation.vector;
        }
        let (mut p, mut i) = (frame.X_BF.translation.vector, frame.body);
        while i > 0 {
            let body = &plant.model.bodies()[i];
            let bends = body.elastic || matches!(body.motion, JointMotion::Interface { .. });
            let X = if bends { &body.X_PJ } else { &data.X_PB[i] };
            p = add(&mul(X.rotation.matrix(), &p), &X.translation.vector);
            i = body.parent;
        }
        p
    }

    /// Returns the arm with its current inertias.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// Computes the inverse at the last full solution; delayed until a second time is requested.
    fn take_inverse(&mut self) {
        let Some(t) = self.sought_at.take().filter(|_| !self.e.is_empty()) else { return };
        let K = with_curves(&self.plant, &self.plant.stiffness(), self.state.q.as_slice(), &self.e);
        let factor = tangent_stiffness(&self.plant, &mut self.data, t, &self.e, &K).cholesky();
        self.inverse = factor.map(|factor| factor.inverse());
    }

    /// Writes the elastic coordinates into the state.
    fn bend(&mut self) {
        self.state.q.as_mut_slice()[self.plant.model.n_actuated()..].copy_from_slice(self.e.as_slice());
    }

    /// Runs Newton's method with the existing inverse; returns false if it does not converge.
    fn correct(&mut self, t: f64) -> bool {
        let Some(inverse) = self.inverse.take() else { return false };
        let (mut found, mut last) = (false, f64::INFINITY);
        for _ in 0..MAX_CORRECTIONS {
            self.balance(t);
            product(inverse.as_slice(), self.unbalanced.as_slice(), self.correction.as_mut_slice());
            let size = self.correction.amax();
            // An inverse of another position also makes small steps; require a fast decrease.
            if !size.is_finite() || size > 0.1 * last {
                break;
            }
            self.e -= &self.correction;
            self.bend();
            last = size;
            if size <= (SMALL * self.e.amax()).max(NOTHING) {
                found = true;
                break;
            }
        }
        if found {
            self.inverse = Some(inverse);
        }
        found
    }

    /// Computes the unbalanced forces of springs, weight and loads at the state.
    fn balance(&mut self, t: f64) {
        let Self { plant, data, state, e, unbalanced, .. } = self;
        if !plant.loads.is_empty() {
            forward_kinematics(&plant.model, data, &state.q);
            plant.apply_loads(data, t);
        }
        let forces = gravity_forces(&plant.model, data, &state.q);
        unbalanced.copy_from(&forces.rows(plant.model.n_actuated(), e.len()));
        add_geometric_forces(plant, data, e.as_slice(), unbalanced.as_mut_slice());
        add_spring_forces(plant, state.q.as_slice(), e.as_slice(), unbalanced.as_mut_slice());
    }
}

/// Applies a change of inertia to the arm.
fn carry(plant: &mut Arc<Plant>, change: &InertiaChange) {
    let plant = Arc::make_mut(plant);
    plant.model = Arc::new(plant.model.with_inertia(change.body, change.inertia));
}
