//! Summary of the loaded robot, with its kinematics and dynamics at one pose.
//!
//! Start at [`inspect()`]. World axes at the TCP, linear rows first, SI units. Not here: the
//! flexible arm at a pose (`posed`).

use flexarm_flexlink::{FlexibleSpan, LinkForm};
use flexarm_kinematics::{
    Coordinate, Data, Link, Mechanism, Model, State, forward_kinematics_velocity, frame_jacobian, gravity_forces,
    mass_matrix, nonlinear_effects,
};
use nalgebra::{DMatrix, Matrix6xX, UnitQuaternion};
use serde::Serialize;

use crate::arm::Arm;
use crate::arm::options::Modelling;
use crate::caveat::slip::{self, outside};
use crate::caveat::{self, Finding, UNUSUAL, Use};
use crate::error::Error;
use crate::poses::posed::{all_finite, pose_of};
use crate::robot::balancer::{self, BalancerInfo};
use crate::robot::loops::{self, LoopInfo};
use crate::robot::mounting::RobotMounting;
use crate::robot::robot_link::RobotLink;
use crate::robot::{Robot, tcp_frame};

pub use crate::arm::joint_values::joint_values;

/// Result of `flexarm inspect`. SI units; Jacobian at the TCP in world axes, linear rows first.
#[derive(Clone, Debug, Serialize)]
pub struct Inspection {
    /// Name of the robot.
    pub robot: String,
    /// Movable joints, in coordinate order.
    pub joints: Vec<JointInfo>,
    /// Links with their mass properties.
    pub links: Vec<LinkInfo>,
    /// Flexible links.
    pub flexible_links: Vec<FlexibleInfo>,
    /// Springs under the base; a beam or a mesh there is one of the flexible links.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mounting: Option<MountingInfo>,
    /// Coupling of motors that move several joints.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coupling: Option<CouplingInfo>,
    /// Tool centre point at the pose.
    pub tcp: TcpInfo,
    /// Requested pose, in the order of `joints`.
    pub q: Vec<f64>,
    /// Requested joint velocities.
    pub velocity: Vec<f64>,
    /// Jacobian: 6 rows, one column per joint.
    pub jacobian: Vec<Vec<f64>>,
    /// Mass matrix of the rigid robot with its payload.
    pub mass_matrix: Vec<Vec<f64>>,
    /// Joint torques or forces that hold the pose, against gravity and balancers.
    pub gravity_torque: Vec<f64>,
    /// Bias torques in `τ = M q̈ + bias`: gravity, centrifugal and Coriolis forces.
    pub bias: Vec<f64>,
    /// Centrifugal and Coriolis torques: `bias - gravity_torque`.
    pub coriolis: Vec<f64>,
    /// Balancers at the pose; `gravity_torque` and `bias` include them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub balancers: Vec<BalancerInfo>,
    /// Closed loops at the pose; `joints` does not contain their dependent joints.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub loops: Vec<LoopInfo>,
    /// Total mass (kg), including payload and base.
    pub mass_kg: f64,
    /// Warnings among the caveats, as sentences.
    pub warnings: Vec<String>,
    /// Probable errors in the input.
    pub caveats: Vec<Finding>,
}

/// A movable joint; limits are null where there are none.
#[derive(Clone, Debug, Serialize)]
pub struct JointInfo {
    /// Name.
    pub name: String,
    /// `revolute`, `continuous` or `prismatic`.
    #[serde(rename = "type")]
    pub kind: &'static str,
    /// Minimum position (rad or m).
    pub lower: Option<f64>,
    /// Maximum position (rad or m).
    pub upper: Option<f64>,
    /// Maximum speed (rad/s or m/s).
    pub velocity: Option<f64>,
    /// Maximum torque or force (N m or N).
    pub effort: Option<f64>,
    /// Maximum acceleration (rad/s² or m/s²).
    pub acceleration: Option<f64>,
    /// Maximum jerk (rad/s³ or m/s³).
    pub jerk: Option<f64>,
}

/// A link.
#[derive(Clone, Debug, Serialize)]
pub struct LinkInfo {
    /// Name.
    pub name: String,
    /// Mass (kg); 0 for a frame without inertia.
    pub mass_kg: f64,
    /// Centre of mass in link axes (m).
    pub com_m: [f64; 3],
    /// `ixx iyy izz ixy ixz iyz` about the centre of mass, link axes (kg m²).
    pub inertia: [f64; 6],
}

/// A flexible link.
#[derive(Clone, Debug, Serialize)]
pub struct FlexibleInfo {
    /// Name.
    pub name: String,
    /// Method by which its stiffness was obtained.
    pub method: String,
    /// Distance between the interfaces (m).
    pub length_m: f64,
    /// Masses of the rigid parts (kg).
    pub parts_kg: Vec<f64>,
    /// Stiffness at the split, 6×6, linear first.
    pub stiffness: Vec<Vec<f64>>,
    /// `lumped` or `modal`.
    pub model: &'static str,
    /// Number of elastic coordinates.
    pub coordinates: usize,
    /// Natural frequencies of a modal link with interface A held, all of them (Hz).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub modal_frequencies_hz: Option<Vec<f64>>,
}

/// Coupling of motors that move several joints.
#[derive(Clone, Debug, Serialize)]
pub struct CouplingInfo {
    /// Coupled joints.
    pub joints: Vec<String>,
    /// Matrix C of `q_joints = C q_motors`, with motor angles after their gears.
    pub matrix: Vec<Vec<f64>>,
}

/// Springs under the base.
#[derive(Clone, Debug, Serialize)]
pub struct MountingInfo {
    /// Name.
    pub name: String,
    /// Position in the base link (m).
    pub position_m: [f64; 3],
    /// Orientation in the base link, w first.
    pub quaternion_wxyz: [f64; 4],
    /// Stiffness in the axes of the springs, 6×6, linear first.
    pub stiffness: Vec<Vec<f64>>,
    /// Play of each spring to each side (m, rad); empty if there is none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub backlash: Vec<f64>,
    /// Mass carried in addition to the base (kg).
    pub mass_kg: f64,
}

impl MountingInfo {
    fn of(mounting: &RobotMounting) -> Option<Self> {
        let RobotMounting::Springs { springs, play, .. } = mounting else { return None };
        let attitude = UnitQuaternion::from_rotation_matrix(&springs.X_BS.rotation);
        Some(Self {
            name: springs.name.clone(),
            position_m: springs.X_BS.translation.vector.into(),
            quaternion_wxyz: [attitude.w, attitude.i, attitude.j, attitude.k],
            stiffness: springs.K_S.row_iter().map(|row| row.iter().copied().collect()).collect(),
            backlash: play.clone(),
            mass_kg: springs.inertia.map_or(0.0, |inertia| inertia.mass),
        })
    }
}

/// Pose of the tool centre point in the world.
#[derive(Clone, Debug, Serialize)]
pub struct TcpInfo {
    /// Link that carries it.
    pub link: String,
    /// Position (m).
    pub position_m: [f64; 3],
    /// Orientation, w first.
    pub quaternion_wxyz: [f64; 4],
}

/// Returns a limit, if there is one.
fn finite(x: f64) -> Option<f64> {
    x.is_finite().then_some(x)
}

/// Returns a matrix row by row.
fn rows(M: &DMatrix<f64>) -> Vec<Vec<f64>> {
    M.row_iter().map(|r| r.iter().copied().collect()).collect()
}

/// Inspects the rigid robot (with payload) at a pose. `at` (rad or m, by default
/// [`Robot::start_pose`]) and `velocity` (by default zero) are for all actuated joints.
///
/// # Errors
/// [`Error::Pose`] for joint values that do not fit.
pub fn inspect(robot: &Robot, at: Option<&[f64]>, velocity: Option<&[f64]>) -> Result<Inspection, Error> {
    let model = robot.rigid_model()?;
    let names: Vec<&str> = model.coordinates().iter().map(|c| c.joint.as_str()).collect();
    let (q, v) = (pose_of(robot, at)?, joint_values(velocity, &names)?);
    let mut state = State::zeros(&model);
    state.q.copy_from_slice(&q);
    state.qdot.copy_from_slice(&v);

    // Dynamics, kinematics of the TCP.
    let mut data = Data::new(&model);
    loops::check_pose(&model, &mut data, &state.q)?;
    balancer::check_pose(&model, &mut data, &state.q)?;
    let M = mass_matrix(&model, &mut data, &state.q).clone();
    let gravity = gravity_forces(&model, &mut data, &state.q).clone();
    let bias = nonlinear_effects(&model, &mut data, &state).clone();
    forward_kinematics_velocity(&model, &mut data, &state);
    let tcp = tcp_frame(&model);
    let mut J = Matrix6xX::zeros(model.nv());
    frame_jacobian(&model, &data, &tcp, &mut J);
    let X = data.X_WF(&tcp);
    let attitude = UnitQuaternion::from_rotation_matrix(&X.rotation);
    all_finite("the place of the TCP and its Jacobian", X.translation.vector.iter().chain(&J))?;
    all_finite("the mass matrix and the torques", M.iter().chain(&gravity).chain(&bias))?;

    let arm = robot.model(&Modelling::default())?;
    // Only the rigid robot is inspected, so the caveat about missing elasticity does not apply.
    let mut caveats = arm.caveats(Use::Held(&q, &[0.0; 6]));
    caveats.retain(|caveat| caveat.code != "nothing-yields");
    caveats.extend(model.coordinates().iter().zip(&v).filter_map(|(c, v)| {
        let kind = UNUSUAL.with_unit(if c.slides() { "m/s" } else { "rad/s" });
        let name = format!("the speed of joint {:?} (by its limit)", c.joint);
        outside(&kind, name, v.abs(), &(0.0..=c.limits.velocity), &slip::ANGLE[..1], 1.0)
    }));
    Ok(Inspection {
        robot: robot.name.clone(),
        joints: joint_infos(&model),
        links: link_infos(&robot.urdf.mechanism),
        flexible_links: flexible_infos(robot, &arm)?,
        coupling: robot.coupling.as_ref().map(|c| CouplingInfo { joints: c.joints.clone(), matrix: rows(&c.C) }),
        mounting: robot.mounting.as_ref().and_then(MountingInfo::of),
        tcp: TcpInfo {
            link: robot.tcp.0.clone(),
            position_m: X.translation.vector.into(),
            quaternion_wxyz: [attitude.w, attitude.i, attitude.j, attitude.k],
        },
        q,
        velocity: v,
        jacobian: J.row_iter().map(|r| r.iter().copied().collect()).collect(),
        mass_matrix: rows(&M),
        coriolis: (&bias - &gravity).as_slice().to_vec(),
        gravity_torque: gravity.as_slice().to_vec(),
        bias: bias.as_slice().to_vec(),
        balancers: balancer::at_pose(&model, &state.q),
        loops: loops::at_pose(&model, &state.q),
        mass_kg: robot.rigid.links.iter().filter_map(|l| l.inertia).map(|i| i.mass).fold(0.0, |sum, mass| sum + mass),
        warnings: caveat::warnings(&caveats),
        caveats,
    })
}

fn joint_infos(model: &Model) -> Vec<JointInfo> {
    let joint = |c: &Coordinate| JointInfo {
        name: c.joint.clone(),
        kind: c.kind,
        lower: finite(c.limits.lower),
        upper: finite(c.limits.upper),
        velocity: finite(c.limits.velocity),
        effort: finite(c.limits.effort),
        acceleration: finite(c.limits.acceleration),
        jerk: finite(c.limits.jerk),
    };
    model.coordinates().iter().map(joint).collect()
}

fn link_infos(mechanism: &Mechanism) -> Vec<LinkInfo> {
    let link = |l: &Link| {
        let zero = ([0.0; 3], [0.0; 6], 0.0);
        let (com_m, inertia, mass_kg) = l.inertia.map_or(zero, |i| {
            let I = i.inertia_com;
            (i.com.into(), [I[(0, 0)], I[(1, 1)], I[(2, 2)], I[(0, 1)], I[(0, 2)], I[(1, 2)]], i.mass)
        });
        LinkInfo { name: l.name.clone(), mass_kg, com_m, inertia }
    };
    mechanism.links.iter().map(link).collect()
}

/// Describes the flexible links with the models that the robot file asks for.
fn flexible_infos(robot: &Robot, arm: &Arm) -> Result<Vec<FlexibleInfo>, Error> {
    let forms =
        robot.flexible_links.iter().map(|link| robot.form_of(link, &Modelling::default()).map(|(form, _)| form));
    let forms = forms.collect::<Result<Vec<_>, _>>()?;
    let info = |((span, link), form): ((&FlexibleSpan, &RobotLink), &LinkForm)| {
        let K = link.flexible.reduced.split.K_S;
        let (coordinates, modal_frequencies_hz) = match form {
            LinkForm::TwoParts => (6, None),
            LinkForm::Chain(chain) => (6 * chain.joints.len(), None),
            LinkForm::Modal(modal) => (modal.coordinates(), Some(modal.held_frequencies_hz())),
        };
        FlexibleInfo {
            model: form.name(),
            coordinates,
            modal_frequencies_hz,
            name: span.link.clone(),
            method: link.flexible.reduced.provenance.method.clone(),
            length_m: span.length,
            parts_kg: span.part_masses.clone(),
            stiffness: rows(&DMatrix::from_iterator(6, 6, K.iter().copied())),
        }
    };
    Ok(arm.spans.iter().zip(&robot.flexible_links).zip(&forms).map(info).collect())
}
