//! Tests across the crates; see the folders beside this file.
