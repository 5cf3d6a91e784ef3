//! The tests of the crate, as one program: it links once.
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]
#![allow(clippy::print_stdout, reason = "measured errors, with --nocapture")]

mod definition;
mod formats;
