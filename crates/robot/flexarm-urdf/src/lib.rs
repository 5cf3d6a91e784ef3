//! Converts URDF and its meshes to a flexarm mechanism.
//!
//! Start at [`read_urdf`], which returns a [`Mechanism`](flexarm_kinematics::Mechanism) with the
//! shapes of its links, or at [`check_urdf`], which lists all errors and doubtful places. Every
//! error has file, line, value found and remedy, and all errors are reported together. Nothing is
//! printed, and the environment is read only by [`search_paths_from_environment`] and by
//! `$(env NAME)` in a xacro file.
//!
//! ```
//! use flexarm_urdf::{ReadOptions, check_urdf_text, default_tcp, parse_urdf};
//!
//! let text = r#"<robot name="pendulum">
//!   <link name="base"/>
//!   <link name="rod">
//!     <inertial>
//!       <origin xyz="0 0 -0.5"/>
//!       <mass value="2.0"/>
//!       <inertia ixx="0.17" iyy="0.17" izz="0.01" ixy="0" ixz="0" iyz="0"/>
//!     </inertial>
//!   </link>
//!   <link name="tool0"/>
//!   <joint name="hinge" type="continuous">
//!     <parent link="base"/> <child link="rod"/> <axis xyz="0 1 0"/>
//!   </joint>
//!   <joint name="tip" type="fixed">
//!     <parent link="rod"/> <child link="tool0"/> <origin xyz="0 0 -1"/>
//!   </joint>
//! </robot>"#;
//!
//! let robot = parse_urdf(text, "pendulum.urdf", &ReadOptions::default())?;
//! assert_eq!(default_tcp(&robot.mechanism), Some("tool0"));
//! assert_eq!(robot.mechanism.link("rod").and_then(|l| l.inertia).map(|i| i.mass), Some(2.0));
//!
//! let wrong = text.replace("link=\"rod\"", "link=\"rd\"");
//! let findings = check_urdf_text(&wrong, "pendulum.urdf", &ReadOptions::default());
//! assert_eq!(findings[0].location, "pendulum.urdf:11:3");
//! assert_eq!(findings[0].help, "did you mean \"rod\"?");
//! # Ok::<(), flexarm_urdf::UrdfError>(())
//! ```
//!
//! Points that URDF leaves open: inertias are rotated by the `rpy` of their origin; massless frames
//! remain links; an effort or velocity limit of 0 means unknown; a joint's `<dynamics>` is listed
//! but has no effect. Meshes ([`load_mesh`]) are in metres, z up, with the node transforms of their
//! format applied.
//!
//! Notation: `X_PJ` pose of J in P; L link, V visual, I axes of `<inertial>`. SI units.
//! Not here: SDF and MJCF, collision shapes, textures, the dynamics model (`flexarm-kinematics`).
#![allow(non_snake_case, reason = "monogram notation: X_PJ, R_LI, T_VG")]

mod error;
mod geometry;
mod inertia;
mod joints;
mod lint;
pub mod mesh;
mod raw;
mod read;
mod report;
mod resolve;
mod shapes;
mod tcp;
mod transmission;
mod tree;
mod xacro;
mod xml;

pub use error::UrdfError;
pub use flexarm_settings::closest;
pub use geometry::{Geometry, Visual};
pub use mesh::{CrossSection, MassProperties, TriangleMesh, UpAxis, cross_section, load_mesh};
pub use read::{
    InertiaEstimate, JointDynamics, ReadOptions, UrdfRobot, check_urdf, check_urdf_text, expand_xacro, parse_urdf,
    read_urdf,
};
pub use resolve::search_paths_from_environment;
pub use tcp::{default_tcp, tcp_candidates};
pub use transmission::Transmission;

/// Parts that the tests of this crate reach; not part of the interface.
#[doc(hidden)]
pub mod internals {
    pub use crate::lint::lint;
    pub use crate::mesh::{Loaded, decode, load_with_remarks};
    pub use crate::report::Report;
    pub use crate::xacro::macros::parameters;
    pub use crate::xacro::process::fits;
    pub use crate::xml::Lines;
}
