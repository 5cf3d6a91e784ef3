//! The tests of the crate, as one program: it links once.
#![allow(
    clippy::print_stderr,
    reason = "a test stops at the first failure; tables of measured errors are shown with --nocapture"
)]
#![allow(clippy::unwrap_used, reason = "a test stops at the first failure")]
#![allow(non_snake_case, reason = "monogram notation, as in the crate")]

use flexarm_fem::{element, mesh}; // of the meshes that unit tests use too

mod closed_forms;
mod common;
mod flex_file;
mod gate;
mod mesh_select;
mod modal;
mod open_sections;
mod reduction;
mod split;
