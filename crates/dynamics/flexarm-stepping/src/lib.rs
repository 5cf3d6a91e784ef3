//! Time steppers for flexible arms: generalised-alpha, SPOOK, explicit RK4, a reference with error
//! control; static equilibrium and modes.
//!
//! [`new_stepper`] turns a [`Plant`] (tree, springs, damping, motion) into a [`Stepper`],
//! which the caller advances and observes. The integrators for reduced coordinates know only
//! [`SecondOrderSystem`]; SPOOK works in the maximal coordinates of the bodies. Not here: files,
//! metrics, the replacement of links by flexible ones.
//!
//! Without a stepper: [`static_equilibrium`] and [`OperatingPoint`] for poses at rest, [`linearise`]
//! for small motions about them, [`EquationsOfMotion`] for solvers of other programs.
//!
//! ```
//! use std::sync::Arc;
//! use flexarm_kinematics::*;
//! use flexarm_stepping::*;
//! use nalgebra::{Matrix3, Matrix6, Translation3, Vector3};
//!
//! // A clamped beam of two halves with 10 kg at its end, as one 6x6 spring.
//! let mut beam = Mechanism::new("beam");
//! beam.links.push(Link { name: "clamp".into(), inertia: None });
//! let inertia = LinkInertia { mass: 10.0, com: Vector3::x() * 0.5, inertia_com: Matrix3::identity() * 0.1 };
//! beam.links.push(Link { name: "tip".into(), inertia: Some(inertia) });
//! let elastic = JointKind::Elastic(ElasticAngles::RotationVector);
//! beam.joints.push(Joint::new("spring", elastic, "clamp", "tip", Pose::identity()));
//!
//! let spring = ("spring".to_owned(), Matrix6::identity() * 1e5, Damping::Modal(0.03));
//! let plant = Plant::new(Arc::new(Model::new(&beam)?), vec![spring], Arc::new(Held(vec![])))?;
//! let mut observed = Observation::new(&plant);
//! let kind = StepperKind::GeneralizedAlpha(AlphaSettings::default());
//! let mut stepper = new_stepper(kind, plant, 1e-3, Start::Equilibrium)?;
//! stepper.step()?;
//! stepper.observe(&mut observed);
//! assert!((observed.q[2] + 10.0 * 9.81 / 1e5).abs() < 1e-6); // sag = m g / k
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![allow(non_snake_case, reason = "monogram notation: X_WB, K_S, C_S, M; see docs/references.md")]
#![cfg_attr(not(target_arch = "x86_64"), allow(dead_code, reason = "lanes are used with AVX2 alone"))]

mod assembly;
mod dense;
mod drive;
mod eigenvalues;
mod elastic_tree;
mod equations;
mod equilibrium;
mod error;
mod events;
mod exact_run;
mod gear;
mod geometric;
mod guide;
mod implicit;
mod integrator;
mod iteration_matrix;
mod linear;
mod load;
mod modes;
mod motion;
mod observation;
mod operating_point;
mod plant;
mod reduced;
mod servo;
mod static_path;
mod static_targets;
mod statics;
mod steady;
mod stepper;
pub mod steppers;
mod system;
mod tool_run;
mod tree_matrix;

pub use drive::{CurveError, Friction, ServoAxis, SpringCurve, TorqueCurve};
pub use equations::EquationsOfMotion;
pub use error::StepError;
pub use exact_run::{ExactRun, ToolErrors};
pub use flexarm_spatial::GeometricStiffness;
pub use gear::{GearCoupling, Harmonic, Hysteresis, LoadFriction, Slider, TransmissionError};
pub use guide::{Guide, GuideTerm, Play};
pub use integrator::{Current, Integrator, TimeGrid};
pub use linear::{Linear, Tangents, linearise};
pub use load::{Load, LoadAxes, TimedWrench};
pub use modes::modes_of;
pub use motion::{Held, MotionFn, PrescribedMotion};
pub use observation::Observation;
pub use operating_point::{OperatingPoint, PoseAnswer, PoseOutputs};
pub use plant::{Damping, ElasticElement, InertiaChange, Modes, Plant, Servo, Spring};
pub use reduced::ReducedArm;
pub use servo::TorqueLimited;
pub use static_path::StaticPath;
pub use static_targets::{StaticTargets, TargetError, static_targets};
pub use statics::static_equilibrium;
pub use steady::{SteadyRotation, linearise_rotation};
pub use stepper::{Counts, Start, Stepper};
pub use steppers::*;
pub use system::SecondOrderSystem;
pub use tool_run::{ToolDeflection, ToolRun};
pub use tree_matrix::{TreeMatrices, TreeNode};

/// Kernels, for the tests of this crate.
#[doc(hidden)]
pub mod internals {
    pub use crate::dense::{
        Factor, cholesky, congruence, dot, largest, largest_of_numbers, product, solve_transposed, transpose,
    };
    pub use crate::eigenvalues::symmetric_eigenvalues;
    pub use crate::events::EventQueue;
    pub use crate::gear::hysteresis::SliderState;
    pub use crate::steppers::sdirk3::{GAMMA, NODES, WEIGHTS};
    pub use crate::steppers::spook::constraint::Rows;
    pub use crate::steppers::spook::solve::{Jacobian, Sigma, Symmetric, TreeSolver, Triangle};
    pub use crate::tree_matrix::TreeInverse;
}
