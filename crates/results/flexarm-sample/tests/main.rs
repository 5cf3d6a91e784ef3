//! The tests of the crate, as one program: it links once.
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

mod columns;
mod surface;
