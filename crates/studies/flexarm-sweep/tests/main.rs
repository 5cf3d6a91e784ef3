//! The tests of the crate, as one program: it links once.
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

mod chance;
mod changes;
mod direction;
mod distribution;
mod effects;
mod indices;
mod metric;
mod page;
mod path;
mod random;
mod replay;
mod run_caveats;
mod sample;
mod sobol;
mod studies;
