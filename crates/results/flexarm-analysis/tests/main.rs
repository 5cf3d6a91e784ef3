//! The tests of the crate, as one program: it links once.
#![allow(clippy::expect_used, reason = "a failed unwrap fails the test")]
#![allow(clippy::print_stderr, reason = "measured numbers are shown with --nocapture")]
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]
#![allow(non_snake_case, reason = "monogram notation")]

mod closed_forms;
mod contributions;
mod error_parts;
mod fatigue;
mod inversion;
mod linear;
mod long_record;
mod optimal_shaper;
mod path_frame;
mod pose_error;
mod repeated_pose;
mod servo;
mod shaping;
mod signal;
mod spectrum;
mod vibration;
