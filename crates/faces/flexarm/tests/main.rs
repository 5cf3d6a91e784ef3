//! The tests of the facade: its surface, errors and caveats over several crates. Each crate has its own.
#![allow(clippy::print_stderr, reason = "measured numbers are shown with --nocapture")]
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]
#![allow(non_snake_case, reason = "the letters of the matrices")]

mod caveats_everywhere;
mod errors;
mod library;
