//! Forward and hybrid dynamics by the articulated body algorithm, O(n).
//!
//! Every joint is either free (force given, acceleration unknown) or prescribed (acceleration
//! given, force unknown). A free elastic joint has a square, invertible motion subspace: it
//! transmits its own wrench and no inertia. The tree therefore decouples there and each piece is
//! solved separately. A modal body accumulates the contributions of its interfaces in `H`, over its
//! frame and its n coordinates, and eliminates the latter:
//!
//! ```text
//! [ I_rr  H_rη ] [ A ]   [ p_r ]   [ F ]
//! [ H_ηr  H_ηη ] [ η̈ ] + [ p_η ] = [ τ ]        I_A = I_rr - H_rη H_ηη^-1 H_ηr,   p_A = p_r + H_rη H_ηη^-1 (τ - p_η)
//! ```
//!
//! Start at [`solve_articulated`]. Not here: closed loops (`closure`), modal mass integrals (`modal`).
//! Source: [Featherstone 2008], Table 7.1 (articulated bodies) and section 9.2 (hybrid dynamics).

use flexarm_spatial::products::{mul, mul3, tr_mul, tr_mul3};
use flexarm_spatial::{ArticulatedInertia, SpatialInertia, Twist, Wrench};
use nalgebra::{Cholesky, DMatrix, DVector, Matrix3, Vector3};

use crate::balancer::{add_joint_torques, with_lines};
use crate::closure;
use crate::data::{Data, State, add_projection, begin, joint_motion, subspace_times};
use crate::model::{Body, JointMotion, Model};
use crate::rnea::nonlinear_effects;

/// Set of prescribed joints; all others are free.
#[derive(Clone, Debug, PartialEq)]
pub struct Roles {
    prescribed_body: Vec<bool>,
    prescribed_modal: Vec<bool>,
    free_coordinates: Vec<usize>,
    /// Whether a free coordinate moves several joints (mimic joints, closed loops) or has a coupled
    /// rotor: the mass matrix is then used instead of the recursion.
    dense: bool,
}

impl Roles {
    /// All joints free.
    pub fn all_free(model: &Model) -> Self {
        Self::new(model, |_| false)
    }

    /// Actuated joints prescribed, elastic ones free.
    pub fn actuated_prescribed(model: &Model) -> Self {
        Self::new(model, |k| k < model.n_actuated())
    }

    /// Prescribes the coordinates for which `prescribed(index)` holds; an elastic group follows its
    /// first coordinate.
    pub fn new(model: &Model, prescribed: impl Fn(usize) -> bool) -> Self {
        let mut roles = Self {
            prescribed_body: vec![false; model.bodies.len()],
            prescribed_modal: model.modal.iter().map(|m| prescribed(m.coordinate)).collect(),
            free_coordinates: vec![],
            dense: false,
        };
        for (i, body) in model.bodies.iter().enumerate().skip(1) {
            // Interfaces and welded joints have no coordinate of their own.
            let own = !matches!(body.motion, JointMotion::Interface { .. } | JointMotion::Welded);
            roles.prescribed_body[i] = own && prescribed(body.coordinate);
        }
        let actuated = (0..model.n_actuated()).map(|k| (k, 1));
        for (first, size) in actuated.chain(model.elastic().iter().map(|g| (g.coordinate, g.size))) {
            if !prescribed(first) {
                roles.free_coordinates.extend(first..first + size);
                let moves = |b: &&Body| b.coordinate == first && !matches!(b.motion, JointMotion::Interface { .. });
                roles.dense |= model.bodies[1..].iter().filter(moves).count() > 1;
                // A rotor driven by two joints couples different branches of the tree.
                roles.dense |= model.rotor_couplings.iter().any(|(a, b, _)| *a == first || *b == first);
            }
        }
        roles.dense |= !model.loops.is_empty();
        roles
    }

    /// Indices of the free coordinates, ascending.
    pub fn free_coordinates(&self) -> &[usize] {
        &self.free_coordinates
    }
}

/// Computes accelerations q̈ for the generalised forces `tau`, with all joints free. Fills
/// `data.{X_PB, V, A, qddot}`.
///
/// O(n), no allocation; O(n³) via the mass matrix for mimic joints, coupled rotors and closed
/// loops. Accelerations are NaN where a mass matrix is not positive definite.
///
/// # Panics
/// If a vector is not nv long, or `data` or the roles are of another model.
///
/// # Source
/// [Featherstone 2008], Table 7.1.
pub fn forward_dynamics<'d>(
    model: &Model,
    data: &'d mut Data,
    state: &State,
    roles_all_free: &Roles,
    tau: &DVector<f64>,
) -> &'d DVector<f64> {
    state.check_sizes(model);
    model.check_size("tau", tau.len());
    check_workspaces(model, data, roles_all_free);
    data.tau.as_mut_slice().copy_from_slice(tau.as_slice());
    solve(model, data, state, roles_all_free);
    &data.qddot
}

/// Computes the accelerations of free joints and the forces of prescribed ones.
///
/// On entry `qddot` holds the accelerations of the prescribed coordinates and `tau` the forces of
/// the free ones; on return both are complete. Includes external wrenches in `data.F_ext` and
/// balancers. Fills `data.{X_PB, V, A}`. O(n), no allocation; dense if a free coordinate has mimic
/// joints or coupled rotors, or with closed loops. Accelerations are NaN where a mass matrix is not
/// positive definite.
///
/// # Panics
/// If a vector is not nv long, or `data` or the roles are of another model.
///
/// # Source
/// [Featherstone 2008], section 9.2.
pub fn hybrid_dynamics(
    model: &Model,
    data: &mut Data,
    state: &State,
    roles: &Roles,
    qddot: &mut DVector<f64>,
    tau: &mut DVector<f64>,
) {
    state.check_sizes(model);
    model.check_size("qddot", qddot.len());
    model.check_size("tau", tau.len());
    check_workspaces(model, data, roles);
    data.tau.as_mut_slice().copy_from_slice(tau.as_slice());
    data.qddot.as_mut_slice().copy_from_slice(qddot.as_slice());
    solve(model, data, state, roles);
    tau.as_mut_slice().copy_from_slice(data.tau.as_slice());
    qddot.as_mut_slice().copy_from_slice(data.qddot.as_slice());
}

/// Checks that data and roles are those of the model.
#[track_caller]
fn check_workspaces(model: &Model, data: &Data, roles: &Roles) {
    data.check_sizes(model);
    let (found, expected) = (roles.prescribed_body.len(), model.bodies.len());
    assert!(found == expected, "the roles are those of a model of {found} bodies, this one has {expected}");
}

/// Solves for the unknown entries of `data.{qddot, tau}`: along the tree, or dense.
fn solve(model: &Model, data: &mut Data, state: &State, roles: &Roles) {
    if !model.loops.is_empty() {
        closure::solve(model, data, state, &roles.free_coordinates);
    } else if roles.dense {
        solve_dense(model, data, state, roles);
    } else {
        let (q, qdot) = (state.q.as_slice(), state.qdot.as_slice());
        match model.balancers.is_empty() {
            true => solve_articulated(model, data, q, qdot, roles),
            false => solve_with_balancers(model, data, q, qdot, roles),
        }
        // In this branch both joints of a rotor coupling are prescribed.
        for &(a, b, inertia) in &model.rotor_couplings {
            data.tau[a] += inertia * data.qddot[b];
            data.tau[b] += inertia * data.qddot[a];
        }
    }
}

/// Separate function, to keep balancers out of the loops of arms without them. The force of a
/// balancer on its joint is added to the given joint forces and subtracted from the computed ones.
#[inline(never)]
fn solve_with_balancers(model: &Model, data: &mut Data, q: &[f64], qdot: &[f64], roles: &Roles) {
    with_lines(model, data, q, |data| {
        add_joint_torques(model, data, -1.0);
        solve_articulated(model, data, q, qdot, roles);
        add_joint_torques(model, data, 1.0);
    });
}

/// Articulated body algorithm in three passes. For body B with parent P, each quantity at its own
/// origin, in its own axes; S, V and A as in `rnea.rs`:
///
/// ```text
/// outward   V_WB = Ad_BP V_WP + S q̇                              (1)  [Featherstone 2008, Table 7.1]
///           c    = Ṡ q̇ + V_WB × S q̇                              (2)  prescribed: + S q̈
///           I_A  = M_BBo,   p_A = V_WB ×* M_BBo V_WB - F_ext       (3)
/// inward    U = I_A S,   d = Sᵀ U + armature,   u = τ - Sᵀ p_A    (4)
///           I_a = I_A - U Uᵀ/d,   p_a = p_A + I_a c + U u/d       (5)  prescribed: I_a = I_A, p_a = p_A + I_A c
///           I_A of P += Ad_BPᵀ I_a Ad_BP,   p_A of P += Ad_BPᵀ p_a  (6)
/// outward   A' = Ad_BP A_P + c                                   (7)  A_0 = -g
///           q̈  = (u - Uᵀ A')/d,   A_B = A' + S q̈                 (8)  prescribed: τ = Sᵀ (I_A A' + p_A), A_B = A'
/// ```
/// The S of a free elastic joint is square. The joint transmits its own wrench and no inertia:
///
/// ```text
/// inward    F = S^-T τ,   p_a = F,   I_a = 0                     (9)
/// outward   A_B = I_A^-1 (F - p_A),   q̈ = S^-1 (A_B - A')        (10)
/// ```
#[inline]
fn solve_articulated(model: &Model, data: &mut Data, q: &[f64], qdot: &[f64], roles: &Roles) {
    begin_bodies(model, data, q, qdot, roles);
    for i in (1..model.bodies.len()).rev() {
        pass_inward(model, data, i, roles);
    }
    data.A[0] = Twist::new(-model.gravity, Vector3::zeros());
    if let Some(m) = model.bodies[0].modal {
        eliminate_modal(model, data, 0, m, roles.prescribed_modal[m]);
        finish_modal(model, data, 0, m, roles.prescribed_modal[m]);
    }
    finish_bodies(model, data, roles);
}

/// Outward pass: poses, velocities and the body's own inertia and bias forces, (1) to (3).
#[inline]
fn begin_bodies(model: &Model, data: &mut Data, q: &[f64], qdot: &[f64], roles: &Roles) {
    data.V[0] = Twist::zeros();
    data.pA[0] = Wrench::zeros();
    data.articulated[0] = ArticulatedInertia::from_rigid(&SpatialInertia::zeros());
    begin(model, data, q);
    if let Some(m) = model.bodies[0].modal {
        begin_modal(model, data, 0, m, qdot);
    }
    for (i, &is_prescribed) in roles.prescribed_body.iter().enumerate().skip(1) {
        let body = &model.bodies[i];
        let (V_PB, bias) = joint_motion(model, data, i, q, qdot);
        let V = data.V[body.parent].at_child(&data.X_PB[i]) + V_PB; // (1)
        let mut c = bias + V.cross(&V_PB); // (2)
        if is_prescribed {
            c += subspace_times(model, data, i, data.qddot.as_slice());
        }
        data.V[i] = V;
        data.bias[i] = c;
        data.pA[i] = V.cross_force(&body.inertia.mul_twist(&V)) - data.F_ext[i]; // (3)
        data.articulated[i] = ArticulatedInertia::from_rigid(&body.inertia);
        if let Some(m) = body.modal {
            begin_modal(model, data, i, m, qdot);
        }
    }
}

/// Inward pass: inertia and force transmitted by body i to its parent, (4) to (6) and (9).
#[inline]
fn pass_inward(model: &Model, data: &mut Data, i: usize, roles: &Roles) {
    let body = &model.bodies[i];
    if let Some(m) = body.modal {
        eliminate_modal(model, data, i, m, roles.prescribed_modal[m]);
    }
    // An interface has no coordinate of its own: its body joins the H of the modal body.
    if let JointMotion::Interface { modal, interface } = body.motion {
        gather_interface(model, data, i, modal, interface);
        return;
    }
    let (pA, c) = (data.pA[i], data.bias[i]);
    let (passed_inertia, passed_force) = match body.motion {
        // Acceleration given: the joint passes the whole inertia on.
        _ if roles.prescribed_body[i] || body.motion == JointMotion::Welded => {
            let I = data.articulated[i];
            (Some(I), pA + I.mul_twist(&c))
        }
        JointMotion::Elastic(_) => {
            let F = elastic_wrench(data, i, body.coordinate); // (9)
            data.F[i] = F;
            (None, F)
        }
        JointMotion::Axis(motion) => {
            let I = &data.articulated[i];
            let U = motion.linear(
                |axis| Wrench::new(mul(&I.coupling, &axis), mul(&I.angular, &axis)),
                |axis| Wrench::new(mul(&I.linear, &axis), tr_mul(&I.coupling, &axis)),
            );
            let d = motion.project(&U) + body.armature; // (4)
            let u = data.tau[body.coordinate] * body.ratio - motion.project(&pA);
            one_dof_inward(data, i, U, d, u, &c, pA) // (5)
        }
        JointMotion::Interface { .. } | JointMotion::Welded => return,
    };
    // (6); the ground takes any wrench.
    if body.parent > 0 {
        let X_PB = data.X_PB[i];
        if let Some(I) = passed_inertia {
            let I_P = I.at_parent(&X_PB); // (6)
            data.articulated[body.parent] += I_P;
        }
        data.pA[body.parent] += passed_force.at_parent(&X_PB);
    }
}

/// Outward pass: accelerations of free joints and forces of prescribed ones, (7), (8) and (10).
#[inline]
fn finish_bodies(model: &Model, data: &mut Data, roles: &Roles) {
    // A coordinate may move several joints, so forces are summed from zero.
    for (i, &is_prescribed) in roles.prescribed_body.iter().enumerate().skip(1) {
        if is_prescribed {
            data.tau[model.bodies[i].coordinate] = 0.0;
            if let JointMotion::Elastic(_) = model.bodies[i].motion {
                data.tau.as_mut_slice()[model.bodies[i].coordinate..][..6].fill(0.0);
            }
        }
    }
    for (i, &is_prescribed) in roles.prescribed_body.iter().enumerate().skip(1) {
        let body = &model.bodies[i];
        let k = body.coordinate;
        let A = data.A[body.parent].at_child(&data.X_PB[i]) + data.bias[i]; // (7)
        // Free joints: q̈ by (8) and (10). Prescribed ones: τ = Sᵀ (I_A A' + p_A).
        data.A[i] = match body.motion {
            JointMotion::Interface { .. } => A + subspace_times(model, data, i, data.qddot.as_slice()),
            JointMotion::Welded => A,
            _ if is_prescribed => {
                let F = data.articulated[i].mul_twist(&A) + data.pA[i];
                let S = data.elastic[i];
                add_projection(model, &S, i, &F, data.tau.as_mut_slice());
                data.tau[k] += body.ratio * body.ratio * body.armature * data.qddot[k];
                A
            }
            JointMotion::Axis(motion) => {
                let qddot = data.inverse_d[i] * (data.u[i] - A.power(&data.U[i])); // (8)
                data.qddot[k] = qddot / body.ratio;
                A + motion.twist(qddot)
            }
            JointMotion::Elastic(_) => free_elastic(data, i, k, &A),
        };
        if let Some(m) = body.modal {
            finish_modal(model, data, i, m, roles.prescribed_modal[m]);
        }
    }
}

/// Outward step over a free elastic joint: accelerations of its six coordinates and of body i,
/// (10).
#[inline]
fn free_elastic(data: &mut Data, i: usize, k: usize, A: &Twist) -> Twist {
    let A_B = solve_inertia(&data.articulated[i], &(data.F[i] - data.pA[i]));
    let relative = A_B - *A;
    let S = &data.elastic[i];
    let linear = tr_mul(&S.L, &relative.linear);
    let angular = mul(&inverse_3x3(&S.B), &relative.angular);
    data.qddot.as_mut_slice()[k..k + 3].copy_from_slice(linear.as_slice());
    data.qddot.as_mut_slice()[k + 3..k + 6].copy_from_slice(angular.as_slice());
    A_B
}

/// Outward step: own inertia and velocity terms of modal body m, which is body i.
#[inline]
fn begin_modal(model: &Model, data: &mut Data, i: usize, m: usize, qdot: &[f64]) {
    let entry = &model.modal[m];
    let (modal, shapes) = (&mut data.modal[m], &entry.tables.shapes);
    data.pA[i] += modal.bias(&entry.tables, &data.V[i], &qdot[entry.coordinate..entry.coordinate + entry.n]);
    data.articulated[i] += ArticulatedInertia::from_rigid(&modal.inertia);
    modal.H.copy_from(&shapes.M);
    for (k, column) in modal.columns.iter_mut().enumerate() {
        *column = Wrench::new(shapes.C_t[k], modal.C_r[k]);
    }
}

/// Inward step: adds articulated inertia and bias of interface body i to the frame and coordinates
/// of its modal body.
#[inline]
fn gather_interface(model: &Model, data: &mut Data, i: usize, m: usize, interface: usize) {
    let (entry, S, X_PB) = (&model.modal[m], data.elastic[i], data.X_PB[i]);
    let parent = model.bodies[i].parent;
    let I = data.articulated[i];
    let p = data.pA[i] + I.mul_twist(&data.bias[i]);
    let shape = &entry.tables.shapes.interfaces[interface];
    let modal = &mut data.modal[m];
    let n = entry.n;
    for k in 0..n {
        let F = I.mul_twist(&shape.twist(k, &S.L, &S.B));
        shape.project(&S.L, &S.B, &F, &mut modal.H.as_mut_slice()[k * n..(k + 1) * n]);
        modal.columns[k] += F.at_parent(&X_PB);
    }
    shape.project(&S.L, &S.B, &p, &mut modal.f);
    data.articulated[parent] += I.at_parent(&X_PB);
    data.pA[parent] += p.at_parent(&X_PB);
}

/// Inward step: eliminates the modal coordinates from the articulated inertia of body i.
#[inline]
fn eliminate_modal(model: &Model, data: &mut Data, i: usize, m: usize, prescribed: bool) {
    let (entry, modal) = (&model.modal[m], &mut data.modal[m]);
    let range = entry.coordinate..entry.coordinate + entry.n;
    if prescribed {
        for (F, a) in modal.columns.iter().zip(&data.qddot.as_slice()[range]) {
            data.pA[i] += *F * *a;
        }
        return;
    }
    // Factor of H_ηη, in the memory of the last one.
    let mut H = modal.factor.take().map_or_else(|| DMatrix::zeros(entry.n, entry.n), Cholesky::unpack_dirty);
    H.copy_from(&modal.H);
    let Some(factor) = Cholesky::new(H) else {
        modal.solved.fill(f64::NAN);
        data.pA[i] = data.pA[i] * f64::NAN;
        return;
    };
    // H_ηη^-1 [H_ηr, τ - p_η].
    for (k, F) in modal.columns.iter().enumerate() {
        let (f, t) = (&F.force, &F.torque);
        for (c, value) in [f.x, f.y, f.z, t.x, t.y, t.z].into_iter().enumerate() {
            modal.solved[(k, c)] = value;
        }
        modal.solved[(k, 6)] = data.tau[entry.coordinate + k] - modal.f[k];
    }
    factor.solve_mut(&mut modal.solved);
    // I_A = I_rr - H_rη H_ηη^-1 H_ηr,  p_A = p_r + H_rη H_ηη^-1 (τ - p_η).
    let I = &mut data.articulated[i];
    for (k, F) in modal.columns.iter().enumerate() {
        let s = |c: usize| modal.solved[(k, c)];
        let (f, t) = (Vector3::new(s(0), s(1), s(2)), Vector3::new(s(3), s(4), s(5)));
        I.linear -= F.force * f.transpose();
        I.coupling -= F.force * t.transpose();
        I.angular -= F.torque * t.transpose();
        data.pA[i] += *F * s(6);
    }
    modal.factor = Some(factor);
}

/// Outward step: accelerations of the modal coordinates, or their forces if prescribed.
#[inline]
fn finish_modal(model: &Model, data: &mut Data, i: usize, m: usize, prescribed: bool) {
    let (entry, modal, A) = (&model.modal[m], &data.modal[m], data.A[i]);
    for k in 0..entry.n {
        if prescribed {
            let range = entry.coordinate..entry.coordinate + entry.n;
            let own: f64 = modal.H.row(k).iter().zip(&data.qddot.as_slice()[range]).map(|(h, a)| h * a).sum();
            data.tau[entry.coordinate + k] = own + A.power(&modal.columns[k]) + modal.f[k];
        } else {
            let s = |c: usize| modal.solved[(k, c)];
            let rest = Wrench::new(Vector3::new(s(0), s(1), s(2)), Vector3::new(s(3), s(4), s(5)));
            data.qddot[entry.coordinate + k] = s(6) - A.power(&rest);
        }
    }
}

/// Inward step over a free single-DoF joint: inertia and force transmitted to the parent, in B
/// axes.
#[inline]
fn one_dof_inward(
    data: &mut Data,
    i: usize,
    U: Wrench,
    d: f64,
    u: f64,
    c: &Twist,
    pA: Wrench,
) -> (Option<ArticulatedInertia>, Wrench) {
    let inverse_d = 1.0 / d;
    data.U[i] = U;
    data.inverse_d[i] = inverse_d;
    data.u[i] = u;
    let mut I = data.articulated[i];
    I.rank_one_update(&U, inverse_d);
    (Some(I), pA + I.mul_twist(c) + U * (u * inverse_d))
}

/// `F_B = S^-T τ`: wrench exerted on B by a free elastic joint, in B axes.
#[inline]
fn elastic_wrench(data: &Data, i: usize, k: usize) -> Wrench {
    let S = &data.elastic[i];
    let tau = data.tau.as_slice();
    // L is a rotation, so L^-T = L.
    let force = mul(&S.L, &Vector3::new(tau[k], tau[k + 1], tau[k + 2]));
    let torque = tr_mul(&inverse_3x3(&S.B), &Vector3::new(tau[k + 3], tau[k + 4], tau[k + 5]));
    Wrench::new(force, torque)
}

/// Inverse of a 3×3 matrix by cofactors.
#[inline]
fn inverse_3x3(B: &Matrix3<f64>) -> Matrix3<f64> {
    let (a, b, c) = (B.column(0).into_owned(), B.column(1).into_owned(), B.column(2).into_owned());
    let (r0, r1, r2) = (b.cross(&c), c.cross(&a), a.cross(&b));
    let s = 1.0 / a.dot(&r0);
    Matrix3::from_columns(&[r0 * s, r1 * s, r2 * s]).transpose()
}

/// `I^-1 F` by block elimination of the linear part.
#[inline]
fn solve_inertia(I: &ArticulatedInertia, F: &Wrench) -> Twist {
    let linear_inverse = inverse_3x3(&I.linear);
    let G = mul3(&linear_inverse, &I.coupling);
    let complement = I.angular - tr_mul3(&I.coupling, &G);
    let angular = mul(&inverse_3x3(&complement), &(F.torque - tr_mul(&G, &F.force)));
    Twist::new(mul(&linear_inverse, &F.force) - mul(&G, &angular), angular)
}

/// Solves `M_ff q̈_f = τ_f - bias_f - M_fp q̈_p` by Cholesky factorisation, then gets the
/// prescribed forces from RNEA.
fn solve_dense(model: &Model, data: &mut Data, state: &State, roles: &Roles) {
    let tau = data.tau.clone();
    let mut qddot = data.qddot.clone();
    let free = &roles.free_coordinates;
    for &k in free {
        qddot[k] = 0.0;
    }
    // Right-hand side: τ - bias - M_fp q̈_p, with q̈ zero at the free coordinates.
    nonlinear_effects(model, data, state);
    let bias = data.tau.clone();
    crate::crba::mass_matrix_at_poses(model, data);
    let right = &tau - bias - &data.M * &qddot;
    let M_ff = data.M.select_rows(free).select_columns(free);
    let mut solved = right.select_rows(free);
    match Cholesky::new(M_ff) {
        Some(factor) => factor.solve_mut(&mut solved),
        None => solved.fill(f64::NAN),
    }
    // Complete accelerations give all forces.
    for (&k, a) in free.iter().zip(solved.iter()) {
        qddot[k] = *a;
    }
    crate::rnea::inverse_dynamics(model, data, state, &qddot);
    data.qddot.copy_from(&qddot);
}
