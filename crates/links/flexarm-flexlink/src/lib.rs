//! Substitution of rigid links by flexible ones on the tree.
//!
//! A link with a [`ReducedLink`] becomes two or more links, proximal to distal, connected by
//! six-DoF elastic joints, or a modal body ([`LinkForm`]). Children of the link beyond the split
//! move to the distal part. A joint with an elastic gearbox becomes two, motor joint and spring
//! ([`insert_gearboxes`]); a base may be mounted on springs ([`insert_mounting`]). The result is
//! again a [`flexarm_kinematics::Mechanism`], so the tree model and all its algorithms are
//! unchanged. Start at [`substitute`].
//!
//! Frames: L link, A proximal and B distal interface, S split. Not here: computation of the
//! stiffness (`flexarm-fem`), damping and time integration (`flexarm-stepping`).
//!
//! ```
//! use flexarm_fem::{BeamLink, Material, Section};
//! use flexarm_flexlink::{FlexibleLink, Parts, substitute};
//! use flexarm_kinematics::*;
//! use nalgebra::{Matrix3, Vector3};
//!
//! let mut arm = Mechanism::new("arm");
//! arm.links.push(Link { name: "base".into(), inertia: None });
//! let inertia = LinkInertia { mass: 20.0, com: Vector3::x() * 0.5, inertia_com: Matrix3::from_diagonal_element(2.0) };
//! arm.links.push(Link { name: "boom".into(), inertia: Some(inertia) });
//! arm.links.push(Link { name: "tool".into(), inertia: None });
//! arm.joints.push(Joint::new("slew", JointKind::Continuous(Vector3::z_axis()), "base", "boom", Pose::identity()));
//! arm.joints.push(Joint::new("weld", JointKind::Fixed, "boom", "tool", Pose::translation(1.0, 0.0, 0.0)));
//!
//! let section = Section::Tube { outer_diameter: 0.1, wall: 0.005 };
//! let reduced = BeamLink::new("boom", section, Material::STEEL, 1.0).reduce()?;
//! let flexible = substitute(&arm, &[FlexibleLink::new("boom", reduced)])?;
//! assert_eq!(flexible.spans[0].joints[0].joint, "boom__elastic");
//! assert_eq!(Model::new(&flexible.mechanism)?.nv(), 1 + 6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![allow(non_snake_case, reason = "monogram notation: X_LS, K_S, p_AB; see docs/references.md")]

mod cut;
mod gearbox;
mod interfaces;
mod modal;
mod mounting;
mod stiffness;
mod substitute;

pub use cut::{CutError, SharedInertia, cut_chain, cut_inertia, share_inertia};
pub use flexarm_fem::ReducedLink;
pub use gearbox::{GearSpring, GearStiffness, Gearbox, GearboxError, GearboxFault, GuideTubes, SEAT, insert_gearboxes};
pub use interfaces::{BranchJoint, branch_joints};
pub use modal::modal_body;
pub use mounting::{Mounting, MountingError, base_link, insert_mounting};
pub use stiffness::{StiffnessError, spring_stiffness};
pub use substitute::{
    ElasticJoint, FlexibleLink, FlexibleSpan, LinkForm, Parts, Substituted, SubstitutionError, distal_joint, substitute,
};
