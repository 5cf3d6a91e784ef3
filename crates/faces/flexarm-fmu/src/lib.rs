//! An arm as a plant for other programs: FMI 2.0 and 3.0 for co-simulation and model exchange, and
//! a C interface.
//!
//! [`FmuModel`] is an arm with named parameters, inputs and outputs. [`export_fmu`] writes one as an
//! FMU: a zip file with the robot, the description of its variables, and this crate as a library.
//! The library exports the functions of FMI 2.0, those of FMI 3.0 and those of
//! `include/flexarm.h`; the same plant stands behind all three.
//!
//! ```
//! use std::path::Path;
//! use flexarm_fmu::{FmuModel, FmuSettings};
//!
//! # std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../../.."))?;
//! let mut arm = FmuModel::new(Path::new("robots/kr210"), &FmuSettings::default())?;
//! let height = arm.find("tcp.position.z").ok_or("no such variable")?;
//! arm.start(0.0)?;
//! for k in 0..100 {
//!     arm.step(0.01 * f64::from(k), 0.01)?;
//! }
//! println!("{} m", arm.get(height)?);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![allow(non_snake_case, reason = "monogram notation: X_WL, K_S; see docs/references.md")]

mod archive;
mod description;
mod error;
mod exchange;
#[allow(unsafe_code, reason = "functions called from C take pointers")]
mod ffi;
mod instance;
mod model;
mod variables;

pub use archive::{FmuJob, FmuSummary, export_fmu, open_resources};
pub use description::{About, Fmi, MODEL_IDENTIFIER, description};
pub use error::FmuError;
pub use model::{FmuModel, FmuSettings, FmuState};
pub use variables::{Causality, Kind, UNITS, Variable};

/// Parts that the tests of this crate reach; not part of the interface.
#[doc(hidden)]
pub mod internals {
    pub use crate::ffi::fmi2::folder;
    pub use crate::variables::part;
}
