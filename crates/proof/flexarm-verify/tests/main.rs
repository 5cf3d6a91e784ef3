//! The case studies, and the program that runs them.
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

mod program;
mod quick;
