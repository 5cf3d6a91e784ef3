//! The tests of the crate, as one program: it links once.
#![allow(clippy::print_stdout, reason = "measured numbers are shown with --nocapture")]
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]
#![allow(non_snake_case, reason = "monogram notation")]

mod corner;
mod csv;
mod gap;
mod jerk_law;
mod motion;
mod noise;
mod polynomial;
mod table;
mod time_law;
mod via;
mod waypoints;
