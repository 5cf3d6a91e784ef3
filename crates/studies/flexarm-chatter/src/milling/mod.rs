//! Stability of milling with a flexible structure.
//!
//! A tooth cuts the surface left by the previous one. Where the structure vibrates between them,
//! the chip thickness varies, the force follows, and above a certain depth of cut the vibration
//! grows: chatter. [`Structure`] describes the compliance at the tool's tip, [`Cutter`] the teeth.
//! At a spindle speed, [`limit_of_depth`] computes the limit of depth from the Floquet multipliers
//! of a tooth period.
//!
//! ```
//! use flexarm_chatter::milling::{Coefficients, Cutter, Engagement, LimitOptions, Mode, Structure, limit_of_depth};
//! use nalgebra::Vector3;
//! use std::f64::consts::TAU;
//!
//! let mode = Mode { angular_frequency: TAU * 922.0, damping_ratio: 0.011, shape: Vector3::x() / 0.03993_f64.sqrt() };
//! let structure = Structure::from_modes(&[mode])?;
//! let aluminium = Coefficients { tangential: 6e8, radial: 2e8, axial: 0.0 };
//! let cutter = Cutter::straight(2, aluminium, Engagement::slot());
//! let limit = limit_of_depth(&structure, &cutter, TAU * 5000.0 / 60.0, &LimitOptions::to(0.012))?.expect("it chatters");
//! assert!((1e3 * limit.depth - 0.4086).abs() < 5e-4); // mm
//! # Ok::<(), flexarm_chatter::milling::ChatterError>(())
//! ```
//!
//! Not here: robots, poses, tools by name, files and units (the crate root).
#![allow(non_snake_case, reason = "letters of the equations: M, D, K, G, H; see docs/references.md")]

mod cutter;
mod error;
pub(crate) mod leading;
mod limit;
mod matrices;
pub(crate) mod moments;
pub(crate) mod period;
mod structure;

pub use cutter::{Coefficients, Cutter, Engagement};
pub use error::ChatterError;
pub use limit::{Kind, Limit, LimitOptions, leading_multiplier, limit_of_depth, unstable_ranges};
pub use structure::{Mode, Pole, Structure};
