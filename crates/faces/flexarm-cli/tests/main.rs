//! The tests of the crate, as one program: it links once.
#![allow(clippy::print_stderr, reason = "measured numbers are shown with --nocapture")]
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
#![allow(non_snake_case, reason = "C for compliance")]

mod bad_input;
#[cfg(all(unix, feature = "mcap"))]
mod broken_runs;
mod common;
mod convert;
mod events;
#[cfg(feature = "parquet")]
mod every_verb;
mod exchange;
#[cfg(unix)]
mod faults;
mod help;
mod hostile_names;
mod inspect_check;
#[cfg(feature = "parquet")]
mod layout;
mod limits;
mod linear;
mod mesh_caveats;
mod messages;
mod models;
mod motion;
mod new;
mod places;
mod reduce;
mod report_again;
mod robots;
mod runs;
mod serve;
mod study;
mod summary_table;
#[cfg(feature = "parquet")]
mod sweep;
#[cfg(unix)]
mod view;
mod words;
