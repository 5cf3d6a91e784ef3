//! Meshes of other programs: Gmsh 2.2 and 4.1 (text, binary, compressed), CalculiX and Abaqus
//! decks.
//!
//! A reader fills a draft (`draft.rs`) with the numbers and units of its file; the draft is checked
//! and converted to the [`Mesh`](flexarm_fem::Mesh) in SI, with the node order of
//! [`ElementKind`](flexarm_fem::ElementKind).

mod draft;
pub(crate) mod gmsh;
pub(crate) mod ids;
pub(crate) mod inp;
mod read;
pub(crate) mod source;

pub use read::{MeshFile, ReadOptions, parse_mesh, read_mesh};
