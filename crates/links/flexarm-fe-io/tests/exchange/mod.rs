//! Matrices of other FE programs: samples, units, writers, and invalid bytes.
//!
//! The samples of `shared/fe` all describe one structure, case A1: a steel beam along x, interface
//! A at (0, 0, 0) and B at (1, 0, 0), SI. They are not part of the repository; without them the
//! tests that need them are ignored by default. The small texts here cover every branch.

mod abaqus_text;
mod defective;
mod dmig;
mod fuzz;
mod matrix_market;
mod op4;
mod samples;
mod shared;
mod sid;
pub(crate) mod sid_writer;
mod units;
mod words;
mod writers;
