//! Spatial algebra, the immutable tree model, and the kinematics and dynamics recursions of
//! flexarm.
//!
//! A [`Mechanism`] (links and joints by name) is checked and becomes a [`Model`]; [`Data`] holds
//! workspaces and results, [`State`] positions and velocities. The algorithms are free functions
//! named after the quantity they compute, and they do not allocate. Joint types: fixed, revolute,
//! continuous, prismatic, helical, and the six-DoF elastic joint of a flexible link.
//!
//! Inverse kinematics: [`AnalyticArm`] returns all solutions of arms whose geometry allows a closed
//! form, [`inverse_kinematics`] one solution from an initial guess,
//! [`inverse_kinematics_from_many_starts`] the solutions of any arm found by a multi-start search,
//! and [`inverse_kinematics_with_rule`] the best solution of a redundant arm.
//!
//! Notation: `X_AB` is the pose of B in A; `V` are twists, `F` wrenches, **linear part first**;
//! sources are listed in `docs/references.md`. Balancers ([`Balancer`]) are conservative forces on
//! the tree, like gravity; closed planar loops ([`LoopClosure`]) make some joints dependent on
//! others. Not here: file formats, stiffness of flexible links, time integration.
//!
//! ```
//! use flexarm_kinematics::*;
//! use nalgebra::{DVector, Matrix3, Vector3};
//!
//! // A pendulum: 2 kg at 0.5 m below a hinge about y.
//! let mut pendulum = Mechanism::new("pendulum");
//! pendulum.links.push(Link { name: "base".into(), inertia: None });
//! pendulum.links.push(Link {
//!     name: "bob".into(),
//!     inertia: Some(LinkInertia { mass: 2.0, com: Vector3::new(0.0, 0.0, -0.5), inertia_com: Matrix3::zeros() }),
//! });
//! let hinge = JointKind::Continuous(Vector3::y_axis());
//! pendulum.joints.push(Joint::new("hinge", hinge, "base", "bob", Pose::identity()));
//!
//! let model = Model::new(&pendulum)?;
//! let (mut data, mut state) = (Data::new(&model), State::zeros(&model));
//! state.q[0] = std::f64::consts::FRAC_PI_2;
//! // Horizontal: the hinge carries m g l = 2 * 9.81 * 0.5 N m.
//! let torque = inverse_dynamics(&model, &mut data, &state, &DVector::zeros(1))[0];
//! assert!((torque.abs() - 9.81).abs() < 1e-12);
//! # Ok::<(), ModelError>(())
//! ```
#![allow(non_snake_case, reason = "monogram notation: X_WB, p_AoBo_W, M_BBo; see docs/references.md")]

mod aba;
mod analytic_ik;
mod axis_motion;
mod balancer;
mod closure;
mod crba;
mod data;
mod energy;
mod inverse_kinematics;
mod kinematics;
pub mod lanes;
mod many_starts;
mod mechanism;
mod modal;
mod model;
mod pose;
mod redundancy;
mod rnea;
mod static_tangent;

pub use flexarm_spatial::{
    AngleKinematics, ArticulatedInertia, ElasticAngles, Pose, Real, SpatialInertia, Twist, Wrench, adjoint,
    rotation_vector, skew,
};

#[cfg(target_arch = "x86_64")]
pub use flexarm_spatial::lanes::{OverLanes, with_lanes};
pub use flexarm_spatial::products;

pub use aba::{Roles, forward_dynamics, hybrid_dynamics};
pub use analytic_ik::{
    AXIS_TOLERANCE, AXIS_TOLERANCE_RAD, AnalyticArm, ArmClass, Branch, ControllerAxes, Miss, NoAnalyticIk,
    POSE_TOLERANCE, PositionForm, Selection, Solution, Solutions, kuka_turn,
};
pub use axis_motion::AxisMotion;
pub use balancer::{
    Balancer, BalancerCurve, BalancerCurveError, BalancerLaw, BalancerLine, BalancerPlace, BalancerSpan, GasLaw,
    PlacedBalancer,
};
pub use closure::{LoopClosure, PlacedLoop};
pub use crba::{mass_matrix, mass_matrix_at_poses};
pub use data::{Data, State};
pub use energy::{
    center_of_mass, kinetic_energy, kinetic_energy_of, momentum_of, potential_energy, potential_energy_of,
};
pub use inverse_kinematics::{IkError, IkOptions, inverse_kinematics};
pub use kinematics::{
    forward_kinematics, forward_kinematics_velocity, frame_jacobian, frame_jacobian_derivative, frame_twist,
    world_poses,
};
pub use many_starts::{FoundSolution, inverse_kinematics_from_many_starts};
pub use mechanism::{Joint, JointKind, Limits, Link, LinkInertia, Mechanism, Mimic, RotorCoupling};
pub use modal::{InterfaceShape, ModalBody};
pub use model::{Body, Coordinate, ElasticGroup, Frame, JointMotion, MAX_COORDINATES, Model, ModelError, moment_floor};
pub use redundancy::{NullSpaceRule, RuledSolution, inverse_kinematics_with_rule};
pub use rnea::{gravity_forces, gravity_forces_at_poses, inverse_dynamics, nonlinear_effects};
pub use static_tangent::{PointLoad, StaticTangent};

/// Kernels, for the tests of this crate.
#[doc(hidden)]
pub mod internals {
    pub use crate::analytic_ik::trig::{CirclePlane, List, Roots, TrigPolynomial};
}
