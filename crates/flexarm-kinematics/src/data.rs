//! State and workspaces: what changes while the model stays.
//!
//! [`State`] is small and copyable between steppers; [`Data`] holds results and scratch of every algorithm,
//! sized once by [`Data::new`], so that no algorithm allocates. Threads share a `Model`, each with its own `Data`.

use flexarm_spatial::products::{mul, mul3, tr_mul};
use flexarm_spatial::{ArticulatedInertia, ElasticAngles, Pose, SpatialInertia, Twist, Wrench};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use crate::modal::ModalData;
use crate::model::{JointMotion, Model};

/// Positions and velocities of all independent coordinates, in the model's coordinate order.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Positions (rad or m).
    pub q: DVector<f64>,
    /// Velocities (rad/s or m/s).
    pub qdot: DVector<f64>,
}

impl State {
    /// All coordinates zero, at rest.
    pub fn zeros(model: &Model) -> Self {
        Self { q: DVector::zeros(model.nv()), qdot: DVector::zeros(model.nv()) }
    }
}

/// Motion subspace of an elastic joint or an interface in B axes: `V_PB_B = [L d'; B angles']`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ElasticSubspace {
    /// `R_PBᵀ` on the translation rates.
    pub(crate) L: Matrix3<f64>,
    /// Rate map of the angles.
    pub(crate) B: Matrix3<f64>,
}

/// Results and workspaces; see the function that fills each field.
#[derive(Clone, Debug)]
pub struct Data {
    /// Pose of each body in its parent.
    pub X_PB: Vec<Pose>,
    /// Pose of each body in the world ([`crate::forward_kinematics`]).
    pub X_WB: Vec<Pose>,
    /// Twist `V_WB_B` of each body at Bo in B axes.
    pub V: Vec<Twist>,
    /// Spatial acceleration `As_WB_B`, minus gravity where the algorithm says so.
    pub A: Vec<Twist>,
    /// Wrench that the joint puts on each body, at Bo in B axes ([`crate::inverse_dynamics`]).
    pub F: Vec<Wrench>,
    /// External wrench on each body, at Bo in B axes; set by the caller, zero at the start.
    pub F_ext: Vec<Wrench>,
    /// Generalised forces.
    pub tau: DVector<f64>,
    /// Generalised accelerations.
    pub qddot: DVector<f64>,
    /// Mass matrix, both triangles ([`crate::mass_matrix`]).
    pub M: DMatrix<f64>,

    pub(crate) elastic: Vec<ElasticSubspace>,
    pub(crate) bias: Vec<Twist>,
    pub(crate) composite: Vec<SpatialInertia>,
    pub(crate) articulated: Vec<ArticulatedInertia>,
    pub(crate) pA: Vec<Wrench>,
    /// One-DoF joints: U = I S, 1/(Sᵀ U), u.
    pub(crate) U: Vec<Wrench>,
    pub(crate) inverse_d: Vec<f64>,
    pub(crate) u: Vec<f64>,
    pub(crate) scratch: Vec<f64>,
    /// One per modal body.
    pub(crate) modal: Vec<ModalData>,
    /// Kinetic energy of the rotors in the last velocity pass.
    pub(crate) rotor_energy: f64,
}

impl Data {
    /// Workspaces for a model.
    pub fn new(model: &Model) -> Self {
        let n = model.bodies.len();
        let zero = Twist::zeros();
        Self {
            X_PB: vec![Pose::identity(); n],
            X_WB: vec![Pose::identity(); n],
            V: vec![zero; n],
            A: vec![zero; n],
            F: vec![Wrench::zeros(); n],
            F_ext: vec![Wrench::zeros(); n],
            tau: DVector::zeros(model.nv()),
            qddot: DVector::zeros(model.nv()),
            M: DMatrix::zeros(model.nv(), model.nv()),
            elastic: vec![ElasticSubspace { L: Matrix3::identity(), B: Matrix3::identity() }; n],
            bias: vec![zero; n],
            composite: vec![SpatialInertia::zeros(); n],
            articulated: vec![ArticulatedInertia::from_rigid(&SpatialInertia::zeros()); n],
            pA: vec![Wrench::zeros(); n],
            U: vec![Wrench::zeros(); n],
            inverse_d: vec![0.0; n],
            u: vec![0.0; n],
            scratch: vec![0.0; model.nv()],
            modal: model.modal.iter().map(|m| ModalData::new(&m.tables)).collect(),
            rotor_energy: 0.0,
        }
    }

    /// Sets all external wrenches to zero.
    pub fn clear_external_wrenches(&mut self) {
        self.F_ext.fill(Wrench::zeros());
    }

    /// Pose of a frame in the world, from the last [`crate::forward_kinematics`].
    pub fn X_WF(&self, frame: &crate::model::Frame) -> Pose {
        self.X_WB[frame.body] * frame.X_BF
    }
}

/// Joint pose, joint twist and its bias in B axes; fills `X_PB`, `elastic` for one body.
///
/// `V_PB_B = S q̇` and `bias = dS/dt q̇` (zero for one-DoF joints).
#[inline(always)]
pub(crate) fn joint_motion(model: &Model, data: &mut Data, i: usize, q: &[f64], qdot: &[f64]) -> (Twist, Twist) {
    let body = &model.bodies[i];
    let k = body.coordinate;
    match body.motion {
        JointMotion::Axis(motion) => {
            motion.place(&body.X_PJ, &body.turn, body.ratio * q[k] + body.offset, &mut data.X_PB[i]);
            (motion.twist(body.ratio * qdot[k]), Twist::zeros())
        }
        JointMotion::Welded => {
            data.X_PB[i] = body.X_PJ;
            (Twist::zeros(), Twist::zeros())
        }
        JointMotion::Elastic(angles) => {
            let (q, qdot) = (&q[k..k + 6], &qdot[k..k + 6]);
            let ddot = Vector3::new(qdot[0], qdot[1], qdot[2]);
            let rates = Vector3::new(qdot[3], qdot[4], qdot[5]);
            let kin = angles.kinematics(&Vector3::new(q[3], q[4], q[5]), &rates);
            place_elastic(&mut data.X_PB[i], &body.X_PJ, &kin.R, &Vector3::new(q[0], q[1], q[2]));
            let L = kin.R.transpose();
            data.elastic[i] = ElasticSubspace { L, B: kin.B };
            let V = Twist::new(mul(&L, &ddot), mul(&kin.B, &rates));
            // d(R_PBᵀ)/dt d' = -w × (R_PBᵀ d')
            (V, Twist::new(V.linear.cross(&V.angular), kin.bias))
        }
        JointMotion::Interface { modal, interface } => {
            let modal = &model.modal[modal];
            let shape = &modal.tables.shapes.interfaces[interface];
            let (d, phi) = shape.times(&q[k..k + modal.n]);
            let (ddot, rates) = shape.times(&qdot[k..k + modal.n]);
            let kin = ElasticAngles::RotationVector.kinematics(&phi, &rates);
            place_elastic(&mut data.X_PB[i], &body.X_PJ, &kin.R, &d);
            let L = kin.R.transpose();
            data.elastic[i] = ElasticSubspace { L, B: kin.B };
            let V = Twist::new(mul(&L, &ddot), mul(&kin.B, &rates));
            (V, Twist::new(V.linear.cross(&V.angular), kin.bias))
        }
    }
}

/// Joint pose alone; fills `X_PB` and `elastic` for one body.
#[inline(always)]
pub(crate) fn joint_position(model: &Model, data: &mut Data, i: usize, q: &[f64]) {
    let body = &model.bodies[i];
    let k = body.coordinate;
    match body.motion {
        JointMotion::Axis(motion) => {
            motion.place(&body.X_PJ, &body.turn, body.ratio * q[k] + body.offset, &mut data.X_PB[i]);
        }
        JointMotion::Welded => data.X_PB[i] = body.X_PJ,
        JointMotion::Elastic(angles) => {
            let (R, B) = angles.pose(&Vector3::new(q[k + 3], q[k + 4], q[k + 5]));
            place_elastic(&mut data.X_PB[i], &body.X_PJ, &R, &Vector3::new(q[k], q[k + 1], q[k + 2]));
            data.elastic[i] = ElasticSubspace { L: R.transpose(), B };
        }
        JointMotion::Interface { modal, interface } => {
            let modal = &model.modal[modal];
            let (d, phi) = modal.tables.shapes.interfaces[interface].times(&q[k..k + modal.n]);
            let (R, B) = ElasticAngles::RotationVector.pose(&phi);
            place_elastic(&mut data.X_PB[i], &body.X_PJ, &R, &d);
            data.elastic[i] = ElasticSubspace { L: R.transpose(), B };
        }
    }
}

/// `Σ ½ a q̇²` of the rotors.
#[inline(always)]
pub(crate) fn rotor_energy(model: &Model, qdot: &[f64]) -> f64 {
    model.rotors.iter().map(|&(k, a)| 0.5 * a * qdot[k] * qdot[k]).sum()
}

/// Mass integrals of all modal bodies at the coordinates; fills `modal`.
#[inline(always)]
pub(crate) fn place_modal(model: &Model, data: &mut Data, q: &[f64]) {
    for (modal, entry) in data.modal.iter_mut().zip(&model.modal) {
        modal.place(&entry.tables, &q[entry.coordinate..entry.coordinate + entry.n]);
    }
}

#[inline(always)]
fn place_elastic(X_PB: &mut Pose, X_PJ: &Pose, R: &Matrix3<f64>, d: &Vector3<f64>) {
    *X_PB.rotation.matrix_mut_unchecked() = mul3(X_PJ.rotation.matrix(), R);
    X_PB.translation.vector = X_PJ.translation.vector + mul(X_PJ.rotation.matrix(), d);
}

/// `S q̈` in B axes.
#[inline(always)]
pub(crate) fn subspace_times(model: &Model, data: &Data, i: usize, qddot: &[f64]) -> Twist {
    let body = &model.bodies[i];
    let k = body.coordinate;
    match body.motion {
        JointMotion::Axis(motion) => motion.twist(body.ratio * qddot[k]),
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
            let (d, phi) = modal.tables.shapes.interfaces[interface].times(&qddot[k..k + modal.n]);
            Twist::new(mul(&S.L, &d), mul(&S.B, &phi))
        }
    }
}

/// `tau += Sᵀ F`.
#[inline(always)]
pub(crate) fn add_projection(model: &Model, data_elastic: &ElasticSubspace, i: usize, F: &Wrench, tau: &mut [f64]) {
    let body = &model.bodies[i];
    let k = body.coordinate;
    match body.motion {
        JointMotion::Axis(motion) => tau[k] += body.ratio * motion.project(F),
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
            shape.project(&data_elastic.L, &data_elastic.B, F, &mut tau[k..k + modal.n]);
        }
    }
}
