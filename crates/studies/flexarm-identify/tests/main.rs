//! The tests of the crate, as one program: it links once.
#![allow(clippy::expect_used, reason = "a failed unwrap fails the test")]
#![allow(clippy::print_stderr, reason = "measured numbers are shown with --nocapture")]
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]
#![allow(non_snake_case, reason = "monogram notation")]

mod calibration;
mod coupled_encoders;
mod coupled_gears;
mod encoders;
mod entries_and_tool;
mod entry_files;
mod files;
mod identify;
mod least_squares;
mod levers;
mod parameters;
mod placement;
mod places;
mod recorded_encoders;
mod response;
mod rewrite;
mod scatter;
mod sensitivities;
mod shipped_robots;
mod uff;
