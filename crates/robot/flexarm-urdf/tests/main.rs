//! The tests of the crate, as one program: it links once.
#![allow(clippy::unwrap_used, reason = "a test stops at what it did not expect")]
#![allow(non_snake_case, reason = "monogram notation: X_PJ, R_LI")]

mod common;
mod errors;
mod lint;
mod meshes;
mod robots;
mod robustness;
mod section;
mod tcp;
mod xacro;
mod xacro_parts;
