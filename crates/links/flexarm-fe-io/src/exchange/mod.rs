//! Import and export of reduced (and full) matrices of other FE programs.
//!
//! Reading has three steps, each with its own function: [`recognise`] detects the format by
//! content, [`read_matrices`] returns the matrices as they are in the files ([`ImportedMatrices`]),
//! and [`assemble_interfaces`] extracts the rows of the interfaces and converts to SI. The result
//! passes through the gate ([`flexarm_fem::ReducedLink::from_matrix12`]) like every other
//! stiffness.
//!
//! ```
//! use flexarm_fe_io::exchange::{InputFile, MatrixNames, parse_matrices, propose_map, assemble_interfaces};
//! use flexarm_fem::UnitSystem;
//!
//! # let text: String = (1..=12).map(|i| format!("{0},{1},{0},{1},2.0\n", 1001 + (i - 1) / 6, (i - 1) % 6 + 1))
//! #     .collect::<String>() + "1002,1,1001,1,-2.\n1002,2,1001,2,-2.\n1002,3,1001,3,-2.\n";
//! let file = InputFile::new("job_STIF1.mtx", text); // Abaqus: node,dof,node,dof,value
//! let imported = parse_matrices(&[file], &MatrixNames::default())?;
//!
//! // Without a map of the interfaces, the error proposes one.
//! let question = assemble_interfaces(&imported, None, Some(&UnitSystem::SI)).unwrap_err();
//! assert!(question.help.contains("A=1001,B=1002"));
//! let map = propose_map(&imported.stiffness.rows).unwrap();
//! let link = assemble_interfaces(&imported, Some(&map), Some(&UnitSystem::SI))?;
//! assert_eq!((link.K[(0, 6)], link.modes), (-2.0, 0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Units: those of the files everywhere except in [`assemble_interfaces`], the only place that
//! converts. Full models (`.sti`/`.mas`) stay sparse triplets with labels; they are reduced
//! elsewhere. Writers are in the same module as the parser of their format. The modal format SID is
//! separate: [`parse_sid`].
//!
//! Not here: meshes, reduction, the checks of a stiffness.

pub(crate) mod abaqus_text;
mod assemble;
mod cards;
mod diagnose;
pub(crate) mod dmig;
pub(crate) mod fortran;
mod harwell_boeing;
mod interface;
mod matrix;
pub(crate) mod matrix_market;
mod op4_binary;
mod op4_text;
pub(crate) mod position;
pub(crate) mod read;
mod recognise;
mod sid;
mod sidecar;
mod simscape;
pub(crate) mod text;
mod user_element;

pub use assemble::{InterfaceMatrices, assemble_interfaces};
pub use diagnose::diagnose_substructure;
pub use interface::{Interface, InterfaceMap, RowPick, propose_map, propose_map_of};
pub use matrix::{DofLabel, Entries, LabelledMatrix, MatrixRole, SparseSymmetric};
pub use matrix_market::write_matrix_market;
pub use read::{ImportedMatrices, InputFile, MatrixNames, parse_matrices, read_matrices};
pub use recognise::{MatrixFormat, recognise};
pub use sid::{
    GyroLayout, OeOrder, Sid, SidConventions, SidMatrix, SidNode, modal_link_from_sid, modal_link_held_at, parse_sid,
    read_sid,
};
pub use sidecar::{Sidecar, SidecarInterface, write_sidecar};
pub use simscape::{SimscapeFiles, write_simscape};
pub use user_element::write_user_element;
