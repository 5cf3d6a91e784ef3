//! The tests of the crate, as one program: it links once.
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]
#![allow(non_snake_case, reason = "monogram notation")]

mod caveats;
mod errors;
mod gears;
mod guides;
mod headline;
mod load_jumps;
mod magnification;
mod monitors;
mod recordings;
mod report;
mod settling;
mod small_robots;
mod standard_motions;
mod stepper_settings;
