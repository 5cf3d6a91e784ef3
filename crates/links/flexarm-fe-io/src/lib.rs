//! Reads files of other finite element programs: meshes ([`mesh`]) and condensed or full matrices
//! ([`exchange`]).
//!
//! ```
//! use flexarm_fe_io::{ReadOptions, parse_mesh};
//!
//! // One tetrahedron in millimetres, as CalculiX and Abaqus write it.
//! let deck = "*NODE\n1,0,0,0\n2,100,0,0\n3,0,100,0\n4,0,0,100\n*ELEMENT,TYPE=C3D4,ELSET=body\n1,1,2,3,4\n";
//! let options = ReadOptions { units: "mm-t-s".parse()?, ..Default::default() };
//! let mesh = parse_mesh(deck.as_bytes(), "one.inp", &options)?.mesh;
//! assert_eq!((mesh.nodes[1].x, mesh.blocks[0].kind.name()), (0.1, "TET4"));
//!
//! // Errors give their position in the file.
//! let error = parse_mesh(deck.replace(",4\n", ",9\n").as_bytes(), "one.inp", &options).unwrap_err();
//! assert!(error.to_string().contains("one.inp"), "{error}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! All results are types of [`flexarm_fem`]: a [`Mesh`](flexarm_fem::Mesh) in SI, matrices over
//! interfaces, a [`ModalLink`](flexarm_fem::ModalLink) from Standard Input Data. Compressed files
//! are unpacked only up to the size that a real file would have.
//!
//! Not here: elements, reduction, the checks of a stiffness, the `.flex` file.
#![allow(non_snake_case, reason = "monogram notation: X_LB is the pose of B in L, K_BB a stiffness block")]
#![allow(
    clippy::neg_cmp_op_on_partial_ord,
    reason = "a NaN must fail a check: !(x <= bound) refuses it, x > bound lets it pass"
)]

mod error;
pub mod exchange;
pub mod mesh;
mod number;
mod unpack;

pub use unpack::{UnpackError, unpack_gzip};

pub use error::{FeFileError, FilePosition};
pub use mesh::{MeshFile, ReadOptions, parse_mesh, read_mesh};

/// Parts of the readers that the tests of this crate reach; not part of the interface.
#[doc(hidden)]
pub mod internals {
    pub use crate::exchange::abaqus_text::{parse_dof_list, parse_labelled};
    pub use crate::exchange::dmig::parse as parse_dmig;
    pub use crate::exchange::fortran::{Format, parse_format};
    pub use crate::exchange::matrix_market::parse as parse_matrix_market;
    pub use crate::exchange::position::ErrorPosition;
    pub use crate::exchange::read::other_names;
    pub use crate::exchange::text::Text;
    pub use crate::mesh::gmsh::collector::Collector;
    pub use crate::mesh::gmsh::shapes::shape;
    pub use crate::mesh::ids::IdIndex;
    pub use crate::mesh::inp::types::class;
    pub use crate::mesh::source::Source;
    pub use crate::number::real;
    pub use crate::unpack::{allowed_unpacked, unpacked};
}
