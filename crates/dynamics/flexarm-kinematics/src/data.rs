//! State and workspaces: everything that changes while the model stays fixed.
//!
//! [`State`] is small and is copied between steppers; [`Data`] holds results and scratch of all
//! algorithms, allocated once by [`Data::new`], so that no algorithm allocates. Threads share a
//! `Model`, each with its own `Data`.
//!
//! Below them is what all recursions need of one joint, for any type of joint and scalar: its pose,
//! twist and bias ([`joint_motion`]), and its motion subspace S times rates and its transpose times a
//! wrench. P parent, B body behind the joint; everything is at Bo in B axes. Not here: single-DoF
//! joints ([`AxisMotion`]), mode shapes (`modal`).

use flexarm_spatial::products::{add, cross, lift, lift3, mul, mul3, tr_mul, transposed};
use flexarm_spatial::{ArticulatedInertia, ElasticAngles, Pose, Real, SpatialInertia, Twist, Wrench, sin_cos_all};
use nalgebra::{DMatrix, DVector, Matrix3, Scalar, Vector3};

use crate::axis_motion::AxisMotion;
use crate::closure::LoopData;
use crate::crba::{RotatedBody, SixWrenches};
use crate::modal::ModalData;
use crate::model::{Body, Frame, JointMotion, Model};
use crate::pose::{identity, pose};

/// Positions and velocities of all independent coordinates, in the model's coordinate order.
#[derive(Clone, Debug, PartialEq)]
pub struct State<T: Scalar = f64> {
    /// Positions (rad or m).
    pub q: DVector<T>,
    /// Velocities (rad/s or m/s).
    pub qdot: DVector<T>,
}

impl<T: Real> State<T> {
    /// Checks that there is one position and one velocity per coordinate.
    #[track_caller]
    #[inline]
    pub(crate) fn check_sizes(&self, model: &Model) {
        model.check_size("q", self.q.len());
        model.check_size("qdot", self.qdot.len());
    }

    /// Zero positions and velocities.
    pub fn zeros(model: &Model) -> Self {
        Self { q: DVector::zeros(model.nv()), qdot: DVector::zeros(model.nv()) }
    }
}

/// Motion subspace of an elastic joint or an interface in B axes: `V_PB_B = [L d'; B angles']`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ElasticSubspace<T: Scalar = f64> {
    /// `R_PBᵀ`, map of the translation rates.
    pub(crate) L: Matrix3<T>,
    /// Rate map of the angles.
    pub(crate) B: Matrix3<T>,
}

/// Results and workspaces; the documentation of each function lists the fields it fills.
#[derive(Clone, Debug)]
pub struct Data<T: Scalar = f64> {
    /// Pose of each body in its parent.
    pub X_PB: Vec<Pose<T>>,
    /// Pose of each body in the world ([`crate::forward_kinematics`]).
    pub X_WB: Vec<Pose<T>>,
    /// Twist `V_WB_B` of each body at Bo in B axes.
    pub V: Vec<Twist<T>>,
    /// Spatial acceleration `As_WB_B` minus gravity, of the last inverse or forward dynamics.
    pub A: Vec<Twist<T>>,
    /// Wrench exerted by the joint on each body, at Bo in B axes ([`crate::inverse_dynamics`]).
    pub F: Vec<Wrench<T>>,
    /// External wrench on each body, at Bo in B axes; set by the caller, initially zero.
    pub F_ext: Vec<Wrench<T>>,
    /// Generalised forces.
    pub tau: DVector<T>,
    /// Generalised accelerations.
    pub qddot: DVector<T>,
    /// Mass matrix, both triangles ([`crate::mass_matrix`]).
    pub M: DMatrix<T>,

    pub(crate) elastic: Vec<ElasticSubspace<T>>,
    pub(crate) bias: Vec<Twist<T>>,
    pub(crate) composite: Vec<SpatialInertia<T>>,
    /// Bodies in the axes of the mass matrix recursion, and the wrenches of its columns.
    pub(crate) turned: Vec<RotatedBody<T>>,
    pub(crate) single: Vec<Wrench<T>>,
    pub(crate) six: Vec<SixWrenches<T>>,
    pub(crate) articulated: Vec<ArticulatedInertia>,
    pub(crate) pA: Vec<Wrench>,
    /// Single-DoF joints: U = I S, 1/(Sᵀ U), u.
    pub(crate) U: Vec<Wrench>,
    pub(crate) inverse_d: Vec<f64>,
    pub(crate) u: Vec<f64>,
    /// Caller's external wrenches while those of the balancers are added; empty without balancers.
    pub(crate) F_ext_saved: Vec<Wrench<T>>,
    /// Length or joint value of each balancer at the last poses.
    pub(crate) balanced: Vec<f64>,
    /// One per modal body.
    pub(crate) modal: Vec<ModalData<T>>,
    /// Angles of the rotating joints (rad), with sines and cosines.
    pub(crate) angles: Vec<T>,
    pub(crate) sines: Vec<T>,
    pub(crate) cosines: Vec<T>,
    /// Kinetic energy of the rotors from the last velocity pass.
    pub(crate) rotor_energy: T,
    /// Loop data, for models with closed loops.
    pub(crate) loops: Option<Box<LoopData>>,
}

impl<T: Real> Data<T> {
    /// Checks that the workspaces are those of a model of this size.
    #[track_caller]
    #[inline]
    pub(crate) fn check_sizes(&self, model: &Model) {
        let (bodies, nv) = (model.bodies.len(), model.nv());
        assert!(
            self.V.len() == bodies && self.tau.len() == nv,
            "data has {} bodies and {} coordinates, the model {bodies} and {nv}: each model needs its own Data",
            self.V.len(),
            self.tau.len()
        );
    }

    /// Allocates the workspaces for a model; poses are identities, all else is zero.
    pub fn new(model: &Model) -> Self {
        let (n, zero) = (model.bodies.len(), Twist::zeros());
        Self {
            // One entry per body.
            X_PB: vec![identity(); n],
            X_WB: vec![identity(); n],
            V: vec![zero; n],
            A: vec![zero; n],
            F: vec![Wrench::zeros(); n],
            F_ext: vec![Wrench::zeros(); n],
            // One per independent coordinate.
            tau: DVector::zeros(model.nv()),
            qddot: DVector::zeros(model.nv()),
            M: DMatrix::zeros(model.nv(), model.nv()),
            // Scratch of the recursions; `single`, `six` and `modal` have one entry per joint of that type.
            elastic: vec![ElasticSubspace { L: Matrix3::identity(), B: Matrix3::identity() }; n],
            bias: vec![zero; n],
            composite: vec![SpatialInertia::lift(&SpatialInertia::zeros()); n],
            turned: vec![RotatedBody::identity(); n],
            single: vec![Wrench::zeros(); model.single.len()],
            six: vec![SixWrenches::zeros(); model.six.len()],
            articulated: vec![ArticulatedInertia::from_rigid(&SpatialInertia::zeros()); n],
            pA: vec![Wrench::zeros(); n],
            U: vec![Wrench::zeros(); n],
            inverse_d: vec![0.0; n],
            u: vec![0.0; n],
            F_ext_saved: vec![Wrench::zeros(); if model.balancers.is_empty() { 0 } else { n }],
            balanced: vec![0.0; model.balancers.len()],
            modal: model.modal.iter().map(|m| ModalData::new(&m.tables)).collect(),
            angles: vec![T::zero(); model.turning.len()],
            sines: vec![T::zero(); model.turning.len()],
            cosines: vec![T::zero(); model.turning.len()],
            rotor_energy: T::zero(),
            loops: (!model.loops.is_empty()).then(|| Box::new(LoopData::new(model))),
        }
    }

    /// Sets all external wrenches to zero.
    pub fn clear_external_wrenches(&mut self) {
        self.F_ext.fill(Wrench::zeros());
    }

    /// Returns `X_WF`, the pose of a frame in the world, from the last
    /// [`crate::forward_kinematics`].
    #[inline(always)]
    pub fn X_WF(&self, frame: &Frame) -> Pose<T> {
        let (X_WB, X_BF) = (&self.X_WB[frame.body], &frame.X_BF);
        let R_WB = X_WB.rotation.matrix();
        let p = add(&X_WB.translation.vector, &mul(R_WB, &lift(&X_BF.translation.vector)));
        pose(mul3(R_WB, &lift3(X_BF.rotation.matrix())), p)
    }
}

/// Joint twist and its bias in B axes; fills `X_PB` and `elastic` for one body.
///
/// `V_PB_B = S q̇` and `bias = dS/dt q̇` (zero for single-DoF joints).
#[inline(always)]
pub(crate) fn joint_motion<T: Real>(
    model: &Model,
    data: &mut Data<T>,
    i: usize,
    q: &[T],
    qdot: &[T],
) -> (Twist<T>, Twist<T>) {
    let body = &model.bodies[i];
    let k = body.coordinate;
    match body.motion {
        JointMotion::Axis(motion) => {
            place_axis(body, motion, data, i, q);
            (motion.twist(T::splat(body.ratio) * qdot[k]), Twist::zeros())
        }
        JointMotion::Welded => {
            data.X_PB[i] = pose(lift3(body.X_PJ.rotation.matrix()), lift(&body.X_PJ.translation.vector));
            (Twist::zeros(), Twist::zeros())
        }
        JointMotion::Elastic(angles) => {
            let (q, qdot) = (&q[k..k + 6], &qdot[k..k + 6]);
            let ddot = Vector3::new(qdot[0], qdot[1], qdot[2]);
            let rates = Vector3::new(qdot[3], qdot[4], qdot[5]);
            // R_PB, and B with w_PB_B = B φ̇, at the angles φ.
            let kin = angles.kinematics(&Vector3::new(q[3], q[4], q[5]), &rates);
            place_elastic(&mut data.X_PB[i], body, &kin.R, &Vector3::new(q[0], q[1], q[2]));
            let L = transposed(&kin.R);
            data.elastic[i] = ElasticSubspace { L, B: kin.B };
            let V = Twist::new(mul(&L, &ddot), mul(&kin.B, &rates));
            // d(R_PBᵀ)/dt d' = -w × (R_PBᵀ d')
            (V, Twist::new(cross(&V.linear, &V.angular), kin.bias))
        }
        JointMotion::Interface { modal, interface } => {
            let modal = &model.modal[modal];
            let shape = &modal.tables.shapes.interfaces[interface];
            let moving = k..k + modal.tables.moving[interface];
            let (d, phi) = shape.times(&q[moving.clone()]);
            let (ddot, rates) = shape.times(&qdot[moving]);
            // The interface moves by d and turns by φ, both from the shapes: d = Φ_t η, φ = Φ_r η.
            let kin = ElasticAngles::RotationVector.kinematics(&phi, &rates);
            place_elastic(&mut data.X_PB[i], body, &kin.R, &d);
            let L = transposed(&kin.R);
            data.elastic[i] = ElasticSubspace { L, B: kin.B };
            let V = Twist::new(mul(&L, &ddot), mul(&kin.B, &rates));
            (V, Twist::new(cross(&V.linear, &V.angular), kin.bias))
        }
    }
}

/// Fills `X_PB` and `elastic` for one body, without velocities.
#[inline(always)]
pub(crate) fn joint_position<T: Real>(model: &Model, data: &mut Data<T>, i: usize, q: &[T]) {
    let body = &model.bodies[i];
    let k = body.coordinate;
    match body.motion {
        JointMotion::Axis(motion) => {
            place_axis(body, motion, data, i, q);
        }
        JointMotion::Welded => {
            data.X_PB[i] = pose(lift3(body.X_PJ.rotation.matrix()), lift(&body.X_PJ.translation.vector))
        }
        JointMotion::Elastic(angles) => {
            // X_PB = X_PJ (R, d), with the rates of d in P axes: L = Rᵀ in B axes.
            let (R, B) = angles.pose(&Vector3::new(q[k + 3], q[k + 4], q[k + 5]));
            place_elastic(&mut data.X_PB[i], body, &R, &Vector3::new(q[k], q[k + 1], q[k + 2]));
            data.elastic[i] = ElasticSubspace { L: transposed(&R), B };
        }
        JointMotion::Interface { modal, interface } => {
            let modal = &model.modal[modal];
            // Displacement d and small rotation φ of the interface from the modal coordinates.
            let moving = k..k + modal.tables.moving[interface];
            let (d, phi) = modal.tables.shapes.interfaces[interface].times(&q[moving]);
            let (R, B) = ElasticAngles::RotationVector.pose(&phi);
            place_elastic(&mut data.X_PB[i], body, &R, &d);
            data.elastic[i] = ElasticSubspace { L: transposed(&R), B };
        }
    }
}

/// Value of a single-DoF joint (rad or m).
#[inline(always)]
fn joint_value<T: Real>(body: &Body, q: &[T]) -> T {
    T::splat(body.ratio) * q[body.coordinate] + T::splat(body.offset)
}

#[inline(always)]
fn place_axis<T: Real>(body: &Body, motion: AxisMotion, data: &mut Data<T>, i: usize, q: &[T]) {
    // The sines and cosines may be empty if no joint rotates.
    let (sine, cosine) = match motion.slides() {
        true => (T::zero(), T::one()),
        false => (data.sines[body.turning], data.cosines[body.turning]),
    };
    motion.place(&body.X_PJ, &body.turn, joint_value(body, q), (sine, cosine), &mut data.X_PB[i]);
}

/// Kinetic energy of the rotors, `Σ ½ a q̇² + Σ a_12 q̇_1 q̇_2`.
pub(crate) fn rotor_energy<T: Real>(model: &Model, qdot: &[T]) -> T {
    let mut energy = T::zero();
    for &(k, a) in &model.rotors {
        energy += T::splat(0.5 * a) * qdot[k] * qdot[k];
    }
    for &(j, k, a) in &model.rotor_couplings {
        energy += T::splat(a) * qdot[j] * qdot[k];
    }
    energy
}

/// First step of every algorithm at new coordinates: mass integrals of all modal bodies, and sines
/// and cosines of all joints at once; fills `modal`, `angles`, `sines` and `cosines`.
#[inline(always)]
pub(crate) fn begin<T: Real>(model: &Model, data: &mut Data<T>, q: &[T]) {
    for (angle, &i) in data.angles.iter_mut().zip(&model.turning) {
        let body = &model.bodies[i];
        *angle = joint_value(body, q);
    }
    sin_cos_all(&data.angles, &mut data.sines, &mut data.cosines);
    for (modal, entry) in data.modal.iter_mut().zip(&model.modal) {
        modal.place(&entry.tables, &q[entry.coordinate..entry.coordinate + entry.n]);
    }
}

/// Pose of a body outward of a joint with rotation R and translation d (m), both in joint axes.
#[inline(always)]
fn place_elastic<T: Real>(X_PB: &mut Pose<T>, body: &Body, R: &Matrix3<T>, d: &Vector3<T>) {
    let p_PJ = lift(&body.X_PJ.translation.vector);
    if body.is_parallel {
        *X_PB.rotation.matrix_mut_unchecked() = *R;
        X_PB.translation.vector = add(&p_PJ, d);
    } else {
        let R_PJ = lift3(body.X_PJ.rotation.matrix());
        *X_PB.rotation.matrix_mut_unchecked() = mul3(&R_PJ, R);
        X_PB.translation.vector = add(&p_PJ, &mul(&R_PJ, d));
    }
}

/// `S q̈` in B axes.
#[inline(always)]
pub(crate) fn subspace_times<T: Real>(model: &Model, data: &Data<T>, i: usize, qddot: &[T]) -> Twist<T> {
    let body = &model.bodies[i];
    let k = body.coordinate;
    match body.motion {
        JointMotion::Axis(motion) => motion.twist(T::splat(body.ratio) * qddot[k]),
        JointMotion::Welded => Twist::zeros(),
        JointMotion::Elastic(_) => {
            let S = &data.elastic[i];
            Twist::new(
                mul(&S.L, &Vector3::new(qddot[k], qddot[k + 1], qddot[k + 2])),
                mul(&S.B, &Vector3::new(qddot[k + 3], qddot[k + 4], qddot[k + 5])),
            )
        }
        JointMotion::Interface { modal, interface } => {
            let (S, modal) = (&data.elastic[i], &model.modal[modal]);
            let moving = k..k + modal.tables.moving[interface];
            let (d, phi) = modal.tables.shapes.interfaces[interface].times(&qddot[moving]);
            Twist::new(mul(&S.L, &d), mul(&S.B, &phi))
        }
    }
}

/// `tau += Sᵀ F`, with the wrench F on body B at Bo, in B axes.
#[inline(always)]
pub(crate) fn add_projection<T: Real>(
    model: &Model,
    data_elastic: &ElasticSubspace<T>,
    i: usize,
    F: &Wrench<T>,
    tau: &mut [T],
) {
    let body = &model.bodies[i];
    let k = body.coordinate;
    match body.motion {
        JointMotion::Axis(motion) => tau[k] += T::splat(body.ratio) * motion.project(F),
        JointMotion::Welded => {}
        JointMotion::Elastic(_) => {
            let f = tr_mul(&data_elastic.L, &F.force);
            let t = tr_mul(&data_elastic.B, &F.torque);
            for c in 0..3 {
                tau[k + c] += f[c];
                tau[k + 3 + c] += t[c];
            }
        }
        JointMotion::Interface { modal, interface } => {
            let modal = &model.modal[modal];
            let shape = &modal.tables.shapes.interfaces[interface];
            shape.project(&data_elastic.L, &data_elastic.B, F, &mut tau[k..k + modal.tables.moving[interface]]);
        }
    }
}
