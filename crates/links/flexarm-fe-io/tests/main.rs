//! The tests of the crate, as one program: it links once.
#![allow(clippy::print_stderr, reason = "measured errors, shown with --nocapture")]
#![allow(clippy::unwrap_used, reason = "a test stops at the first failure")]
#![allow(non_snake_case, reason = "monogram notation, as in the crate")]

#[path = "../../flexarm-fem/tests/common/mod.rs"]
mod common;
mod exchange;
mod mesh_fixtures;
mod mesh_gmsh;
mod mesh_inp;
mod mesh_parts;
mod mesh_reference;
mod modal_sid;
mod reference_cases;
mod stress_reference;
mod unpack;
