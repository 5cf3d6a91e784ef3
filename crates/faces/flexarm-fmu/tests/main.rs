//! The tests of the crate, as one program: it links once.
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]
#![allow(non_snake_case, reason = "monogram notation: M, J; see docs/references.md")]
#![allow(clippy::print_stdout, reason = "measured errors beside their bounds")]

mod exchange;
mod helpers;
mod model;
mod names;
