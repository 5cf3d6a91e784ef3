//! The tests of the crate, as one program: it links once.
#![allow(clippy::expect_used, reason = "a failed unwrap fails the test")]
#![allow(clippy::print_stderr, reason = "measured numbers are shown with --nocapture")]
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]
#![allow(non_snake_case, reason = "monogram notation")]

mod calibration;
mod coupled_gears;
mod encoders;
mod entries_and_tool;
mod identify;
mod least_squares;
mod parameters;
mod placement;
mod rewrite;
mod scatter;
mod sensitivities;
mod uff;
