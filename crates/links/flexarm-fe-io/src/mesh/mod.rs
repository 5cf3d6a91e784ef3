//! Meshes of other programs: Gmsh 2.2 and 4.1 (text, binary, packed), CalculiX and Abaqus decks.
//!
//! A reader fills a draft (`draft.rs`) in the numbers and units of its file; the draft checks it
//! and makes the [`Mesh`](flexarm_fem::Mesh) in SI, node order as
//! [`ElementKind`](flexarm_fem::ElementKind) has it.

mod draft;
mod error;
mod gmsh;
mod ids;
mod inp;
mod read;
mod source;

pub use error::{MeshError, MeshErrorKind, Place};
pub use read::{MeshFile, ReadOptions, parse_mesh, read_mesh};
