//! The tests of the crate, as one program: it links once.
#![allow(clippy::print_stderr, reason = "a test says what it skipped")]
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]
#![allow(non_snake_case, reason = "monogram notation: X_LI, pose of the interface in the link")]

#[cfg(feature = "png")]
mod arm_picture;
mod bend;
mod charts;
mod field_plot;
#[cfg(feature = "png")]
mod mesh_parts;
#[cfg(feature = "png")]
mod mesh_picture;
mod palette;
mod plot;
