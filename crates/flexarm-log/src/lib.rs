//! Recorders: MCAP, Rerun and CSV.
#![allow(non_snake_case, reason = "monogram notation: X_WL, pose of L in W")]

mod record;

pub use record::*;
