//! Inverse dynamics: generalised forces of a given motion by recursive Newton-Euler, O(n).
//!
//! ```text
//! Outward pass for body B with parent P; each quantity at its own origin, in its own axes:
//!   V_WB  = Ad_BP V_WP  + S_B q̇                          (1)  [Featherstone 2008, Table 5.1]
//!   As_WB = Ad_BP As_WP + S_B q̈ + Ṡ_B q̇ + V_WB × S_B q̇   (2)  (As_W0 = -g: gravity as an upward acceleration)
//!   F_B   = M_BBo_B As_WB + V_WB ×* M_BBo_B V_WB - F_ext   (3)
//! Inward pass:
//!   τ_B   = S_Bᵀ F_B,   F_P += Ad_BPᵀ F_B                  (4)
//! ```
//! All functions include balancers and closed loops; the recursion itself, [`newton_euler`], knows
//! only the tree. `Ṡ_B` is the time derivative of S in B axes: zero for single-DoF joints, but not for elastic
//! ones. A modal body adds its inertia forces to (3) and to the forces of its coordinates, see
//! [`crate::ModalBody`].
//!
//! Not here: the mass matrix (`crba.rs`), accelerations (`aba.rs`), stiffness of elastic joints.

use flexarm_spatial::products::{cross, lift, scaled, tr_mul};
use flexarm_spatial::{Real, SpatialInertia, Twist, Wrench};
use nalgebra::{DVector, Vector3};

use crate::balancer::{add_joint_torques, with_lines};
use crate::closure;
use crate::data::{Data, State, add_projection, begin, joint_motion, joint_position, rotor_energy, subspace_times};
use crate::model::Model;

/// Computes generalised forces `τ = M(q) q̈ + bias(q, q̇)` (N m or N) for the accelerations
/// `qddot`.
///
/// Elastic coordinates are treated like any other: their entries of τ are the forces that the
/// elastic joint must supply. External wrenches in `data.F_ext` and balancers are subtracted. Fills
/// `data.{X_PB, V, A, F, tau}`; `A` has gravity subtracted. O(n), no allocation.
///
/// # Panics
/// If a vector is not nv long, or `data` is of another model.
///
/// # Source
/// [Featherstone 2008], Table 5.1.
pub fn inverse_dynamics<'d>(
    model: &Model,
    data: &'d mut Data,
    state: &State,
    qddot: &DVector<f64>,
) -> &'d DVector<f64> {
    state.check_sizes(model);
    model.check_size("qddot", qddot.len());
    data.check_sizes(model);
    let (q, qdot, qddot) = (state.q.as_slice(), state.qdot.as_slice(), qddot.as_slice());
    match model.loops.is_empty() {
        true => balanced(model, data, q, qdot, Some(qddot)),
        false => closure::inverse_dynamics(model, data, q, Some(qdot), Some(qddot)),
    }
    &data.tau
}

/// Computes the generalised forces `bias(q, q̇)` (N m or N), nv, at zero acceleration: Coriolis,
/// centrifugal, gravity, balancers and external loads. Fills the same fields as
/// [`inverse_dynamics`], at the same cost.
///
/// # Panics
/// If a vector is not nv long, or `data` is of another model.
pub fn nonlinear_effects<'d>(model: &Model, data: &'d mut Data, state: &State) -> &'d DVector<f64> {
    state.check_sizes(model);
    data.check_sizes(model);
    let (q, qdot) = (state.q.as_slice(), state.qdot.as_slice());
    match model.loops.is_empty() {
        true => balanced(model, data, q, qdot, None),
        false => closure::inverse_dynamics(model, data, q, Some(qdot), None),
    }
    &data.tau
}

/// Computes the generalised forces (N m or N), nv, that keep the mechanism static at `q`, against
/// gravity, balancers and external loads. Fills `data.{X_PB, F, tau}`; O(n), no allocation.
///
/// # Panics
/// If `q` is not nv long, or `data` is of another model.
pub fn gravity_forces<'d>(model: &Model, data: &'d mut Data, q: &DVector<f64>) -> &'d DVector<f64> {
    model.check_size("q", q.len());
    data.check_sizes(model);
    if model.loops.is_empty() {
        begin(model, data, q.as_slice());
        for i in 1..model.bodies.len() {
            joint_position(model, data, i, q.as_slice());
        }
    }
    gravity_forces_at_poses(model, data, q)
}

/// As [`gravity_forces`], with the joint poses left in `data` by [`crate::forward_kinematics`] at
/// `q`.
///
/// # Panics
/// If `q` is not nv long, or `data` is of another model.
pub fn gravity_forces_at_poses<'d>(model: &Model, data: &'d mut Data, q: &DVector<f64>) -> &'d DVector<f64> {
    model.check_size("q", q.len());
    data.check_sizes(model);
    match (model.loops.is_empty(), model.balancers.is_empty()) {
        (true, true) => at_rest(model, data),
        (true, false) => {
            with_lines(model, data, q.as_slice(), |data| at_rest(model, data));
            add_joint_torques(model, data, 1.0);
        }
        (false, _) => closure::inverse_dynamics(model, data, q.as_slice(), None, None),
    }
    &data.tau
}

/// [`newton_euler`] for a tree at rest, with the joint poses in `data`: bitwise the same result,
/// without the velocity terms.
#[inline(always)]
pub(crate) fn at_rest<T: Real>(model: &Model, data: &mut Data<T>) {
    let n = model.bodies.len();
    data.rotor_energy = T::zero();
    data.V.fill(Twist::zeros());
    data.A[0] = Twist::new(lift(&-model.gravity), Vector3::zeros());
    data.F[0] = Wrench::zeros();
    for i in 0..n {
        let body = &model.bodies[i];
        if i > 0 {
            // (2) and (3) without velocities: A = R_PBᵀ a_P, F = [m A; h × A] - F_ext.
            let a = tr_mul(data.X_PB[i].rotation.matrix(), &data.A[body.parent].linear);
            let inertia = SpatialInertia::lift(&model.bodies[i].inertia);
            data.A[i] = Twist::new(a, Vector3::zeros());
            data.F[i] = Wrench::new(scaled(&a, inertia.mass), cross(&inertia.first_moment, &a)) - data.F_ext[i];
        }
        if let Some(m) = body.modal {
            let modal = &mut data.modal[m];
            modal.rates.fill(T::zero());
            modal.f.fill(T::zero());
            data.F[i] += modal.inertia_forces(&model.modal[m].tables, &data.A[i], None);
        }
    }
    carry_inward(model, data);
}

/// [`newton_euler`] with the balancers of the model, for the tree; closed loops are handled in
/// `closure`.
pub(crate) fn balanced(model: &Model, data: &mut Data, q: &[f64], qdot: &[f64], qddot: Option<&[f64]>) {
    match model.balancers.is_empty() {
        true => newton_euler(model, data, q, qdot, qddot),
        false => with_balancers(model, data, q, qdot, qddot),
    }
}

/// Separate function, to keep balancers out of the loops of arms without them.
#[inline(never)]
fn with_balancers(model: &Model, data: &mut Data, q: &[f64], qdot: &[f64], qddot: Option<&[f64]>) {
    with_lines(model, data, q, |data| newton_euler(model, data, q, qdot, qddot));
    add_joint_torques(model, data, 1.0);
}

/// Newton-Euler recursion for any scalar type, without balancers; the result is in `data.tau`.
#[inline(always)]
pub(crate) fn newton_euler<T: Real>(model: &Model, data: &mut Data<T>, q: &[T], qdot: &[T], qddot: Option<&[T]>) {
    let n = model.bodies.len();
    // Ground: at rest, its acceleration -g stands for gravity.
    data.V[0] = Twist::zeros();
    data.A[0] = Twist::new(lift(&-model.gravity), Vector3::zeros());
    data.F[0] = Wrench::zeros();
    data.rotor_energy = rotor_energy(model, qdot);
    begin(model, data, q);
    if let Some(m) = model.bodies[0].modal {
        add_modal_forces(model, data, 0, m, qdot, qddot);
    }
    // Outward pass; q̈ = 0 if there is none.
    for i in 1..n {
        let body = &model.bodies[i];
        let (V_PB, bias) = joint_motion(model, data, i, q, qdot);
        let X_PB = &data.X_PB[i];
        let V = data.V[body.parent].at_child(X_PB) + V_PB; // (1)
        let mut A = data.A[body.parent].at_child(X_PB) + bias + V.cross(&V_PB); // (2)
        if let Some(qddot) = qddot {
            A += subspace_times(model, data, i, qddot);
        }
        let inertia = SpatialInertia::lift(&model.bodies[i].inertia);
        let momentum = inertia.mul_twist(&V);
        data.F[i] = inertia.mul_twist(&A) + V.cross_force(&momentum) - data.F_ext[i]; // (3)
        data.V[i] = V;
        data.A[i] = A;
        if let Some(m) = body.modal {
            add_modal_forces(model, data, i, m, qdot, qddot);
        }
    }
    // Inward pass; then the rotors, whose inertia acts on their own joints only.
    carry_inward(model, data);
    if let Some(qddot) = qddot {
        add_rotors(model, data, qddot);
    }
}

/// Adds the rotor terms to `tau`.
#[inline(always)]
fn add_rotors<T: Real>(model: &Model, data: &mut Data<T>, qddot: &[T]) {
    for &(k, armature) in &model.rotors {
        data.tau[k] += T::splat(armature) * qddot[k];
    }
    for &(a, b, inertia) in &model.rotor_couplings {
        data.tau[a] += T::splat(inertia) * qddot[b];
        data.tau[b] += T::splat(inertia) * qddot[a];
    }
}

/// Inward pass (4): projects wrenches to `data.tau` and adds them to the parent bodies.
#[inline(always)]
fn carry_inward<T: Real>(model: &Model, data: &mut Data<T>) {
    data.tau.as_mut_slice().fill(T::zero());
    for i in (1..model.bodies.len()).rev() {
        let F = data.F[i];
        add_projection(model, &data.elastic[i], i, &F, data.tau.as_mut_slice()); // (4)
        let parent = model.bodies[i].parent;
        if parent > 0 {
            let F_P = F.at_parent(&data.X_PB[i]);
            data.F[parent] += F_P;
        }
    }
    for (entry, modal) in model.modal.iter().zip(&data.modal) {
        for (tau, f) in data.tau.as_mut_slice()[entry.coordinate..].iter_mut().zip(&modal.f) {
            *tau += *f;
        }
    }
}

/// Inertia forces of modal body m, which is body i: adds to `F`, sets the forces of its
/// coordinates.
#[inline(always)]
fn add_modal_forces<T: Real>(model: &Model, data: &mut Data<T>, i: usize, m: usize, qdot: &[T], qddot: Option<&[T]>) {
    let entry = &model.modal[m];
    let (modal, range) = (&mut data.modal[m], entry.coordinate..entry.coordinate + entry.n);
    let bias = modal.bias(&entry.tables, &data.V[i], &qdot[range.clone()]);
    let inertia = modal.inertia_forces(&entry.tables, &data.A[i], qddot.map(|a| &a[range]));
    data.F[i] += bias + inertia;
}
