//! The tests of the crate, as one program: it links once.
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]
#![allow(non_snake_case, reason = "X_WB: a pose")]

mod any_text;
mod common;
mod gcode;
mod krl;
mod rapid;
mod rewrite;
mod urscript;
