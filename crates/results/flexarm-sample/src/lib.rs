//! Output of a run: a [`RunHeader`] once, a [`Sample`] per logged instant, a [`RunResult`] at the
//! end; [`Columns`] hold all of it as arrays.
//!
//! Recorders, reports, pictures and other programs read the same types. Poses are in the world, SI
//! units, six-vectors linear first; "flexible" is the simulated robot, "rigid" its twin with every
//! elastic coordinate held at zero.
//!
//! ```
//! use flexarm_sample::{Columns, RunHeader, Sample, TwinSample};
//!
//! let header = RunHeader { joints: vec!["joint_1".into()], ..RunHeader::default() };
//! let mut columns = Columns::new(&header);
//! for step in 0..3_u64 {
//!     let flexible = TwinSample { q: vec![0.1 * step as f64], qdot: vec![2.0], effort: vec![0.5], ..Default::default() };
//!     columns.push(&Sample { time_s: step as f64 * 1e-3, step, flexible, ..Sample::default() });
//! }
//! let position = columns.column("position").unwrap();
//! assert_eq!((position.width, position.values.as_slice()), (1, &[0.0, 0.1, 0.2][..]));
//! ```
//!
//! Not here: files, the simulation itself, the interpretation of its numbers.
#![allow(non_snake_case, reason = "monogram notation: X_WL, pose of L in W")]

mod columns;
mod run;
mod surface;

pub use columns::{Column, Columns};
pub use run::*;
pub use surface::mesh_media_type;
