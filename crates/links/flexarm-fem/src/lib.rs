//! Beam elements, reduced link matrices with their checks, and the reduced-link file.
//!
//! This crate describes a flexible robot link statically and completely: by the 6×6 stiffness
//! `K_BB` of its distal interface with the proximal one held, by the frames of the two interfaces,
//! and by the two rigid parts into which the split frame S cuts it. Every source leads to the same
//! [`ReducedLink`]: a beam in closed form ([`BeamLink`]), a 12×12 or 6×6 matrix from an FE program
//! ([`ReducedLink::from_matrix12`], [`ReducedLink::from_matrix6`]), or a `.flex` file
//! ([`read_flex`]).
//!
//! ```
//! use flexarm_fem::{BeamLink, Material, Section, parse_flex, write_flex};
//!
//! // A hollow aluminium arm of 1.095 m; joint frames at its two ends, x along the arm.
//! let section = Section::Box { width: 0.160, height: 0.120, wall: 0.010 };
//! let arm = BeamLink::new("lower_arm", section, Material::ALUMINIUM, 1.095).reduce()?;
//! assert!((arm.mass() - 2700.0 * 5.2e-3 * 1.095).abs() < 1e-9);
//!
//! // 1 kN across the tip, along link y, deflects it by 0.36 mm.
//! let u_B = arm.tip_compliance()? * nalgebra::Vector6::new(0.0, 1000.0, 0.0, 0.0, 0.0, 0.0);
//! assert!((u_B[1] - 0.361e-3).abs() < 1e-6);
//!
//! // The link as a file, and back, unchanged.
//! let text = write_flex(&arm);
//! assert_eq!(parse_flex(&text, "lower_arm.flex")?, arm);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Frames: L link, A proximal and B distal interface, S split, E the axes of a beam. Order: linear
//! first, angular second (`u_x u_y u_z theta_x theta_y theta_z`). SI units: m, kg, N, rad.
//!
//! Not here: joints, robots, time. Units other than SI exist only inside [`flex_file`].
#![allow(
    non_snake_case,
    reason = "monogram notation: X_LB is the pose of B in L, K_BB a stiffness block, EI_y a product"
)]
#![allow(
    clippy::neg_cmp_op_on_partial_ord,
    reason = "a NaN must fail a check: !(x <= bound) refuses it, x > bound lets it pass"
)]
#![cfg_attr(test, allow(clippy::unwrap_used, reason = "a test stops at the first failure"))]

pub mod beam;
mod beam_chain;
pub mod beam_link;
pub mod chain;
pub mod cut;
pub mod element;
pub mod error;
pub mod flex_file;
pub mod frames;
pub mod gate;
pub mod input;
pub mod material;
pub mod matrix_link;
pub mod mesh;
pub mod mesh_gate;
pub mod mesh_link;
pub mod modal;
pub mod model;
mod open_section;
pub mod order_check;
pub mod reduced;
pub mod reduction;
mod rigid_part;
pub mod section;
mod section_outline;
pub mod sparse;
pub mod stress;
#[cfg(test)]
#[path = "../tests/test_mesh.rs"]
pub(crate) mod test_mesh;
pub mod units;

pub use beam::{Beam, BeamTheory};
pub use beam_link::BeamLink;
pub use cut::{CutError, CutPlane, cut, mass_properties, volume_fractions};
pub use error::{Direction, FemError};
pub use flex_file::{FlexErrorKind, FlexFileError, parse_flex, read_flex, write_flex};
pub use flexarm_spatial::{Matrix12, Pose};
pub use frames::LinkFrames;
pub use gate::{GateLimits, GateReport};
pub use material::Material;
pub use mesh::{ElementBlock, ElementKind, Mesh, NodeSelector, SelectError};
pub use mesh_gate::MeshGate;
pub use mesh_link::{LinkPlan, MeshReduction, SplitAt, reduce_mesh};
pub use modal::{GeometricStiffness, ModalInterface, ModalLink, ModalOptions};
pub use reduced::{ElasticSplit, LinkDetails, Provenance, ReducedLink, drop_coupling, stiffness_at_split};
pub use rigid_part::RigidPart;
pub use section::{Bar, Section, SectionProperties};
pub use units::UnitSystem;
