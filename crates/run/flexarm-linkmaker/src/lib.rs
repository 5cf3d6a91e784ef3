//! Flexible links with their files, from a mesh or from matrices of another FE program, and their
//! export.
//!
//! | module | from | to |
//! | --- | --- | --- |
//! | [`reduce`] | a mesh with materials and interfaces | a `.flex` file, figures, a report, pictures |
//! | [`import`] | condensed or full matrices, Standard Input Data | the same |
//! | [`export`] | a `.flex` file | matrices for other FE programs |
//!
//! ```
//! use flexarm_linkmaker::reduce::{At, InterfaceEntry, ReduceJob, Reduction};
//!
//! // A bar of 1 m and 1 cm² along x, four bricks, as CalculiX and Abaqus write it.
//! let mut deck = String::from("*NODE\n");
//! for k in 0..=4 {
//!     for (j, (y, z)) in [(0.0, 0.0), (0.01, 0.0), (0.01, 0.01), (0.0, 0.01)].into_iter().enumerate() {
//!         deck += &format!("{},{},{y},{z}\n", 4 * k + j + 1, 0.25 * k as f64);
//!     }
//! }
//! deck += "*ELEMENT,TYPE=C3D8I,ELSET=bar\n";
//! for k in 0..4 {
//!     let n: Vec<String> = (4 * k + 1..=4 * k + 8).map(|n| n.to_string()).collect();
//!     deck += &format!("{},{}\n", k + 1, n.join(","));
//! }
//! let mesh = std::env::temp_dir().join(format!("flexarm-linkmaker-{}.inp", std::process::id()));
//! std::fs::write(&mesh, deck)?;
//!
//! let end = |name: &str, place: &str| InterfaceEntry {
//!     name: Some(name.into()),
//!     select: Some(place.parse().unwrap()),
//!     at: Some(At::Centroid),
//!     ..InterfaceEntry::default()
//! };
//! let job = ReduceJob {
//!     units: Some("m-kg-s".parse()?),
//!     material: Some("200e9,0,7850".parse()?), // Pa, -, kg/m³
//!     modes: Some(0),
//!     interface: vec![end("A", "plane(0,0,0; 1,0,0)"), end("B", "plane(1,0,0; 1,0,0)")],
//!     ..ReduceJob::for_mesh(&mesh)
//! };
//! let link = Reduction::open(&job, None, &mut |_| {})?.finish(None, &mut |_| {})?;
//! # std::fs::remove_file(&mesh)?;
//!
//! // Along its axis a bar without lateral contraction is exact in any mesh: E A / l.
//! assert!((link.statics.stiffness[0][0] / (200e9 * 1e-4 / 1.0) - 1.0).abs() < 1e-9);
//! assert!((link.statics.mass_kg - 0.785).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Every link is checked before a file is written; errors are a [`LinkError`] by cause. Units: SI,
//! except where a job specifies others. Links are independent of robots here: data of a robot's
//! link are given as numbers ([`reduce::UrdfLink`]).
//!
//! Not here: formats of other programs (`flexarm-fe-io`), elements and reduction (`flexarm-fem`),
//! robots, motion.
#![allow(non_snake_case, reason = "monogram notation: X_LB is the pose of B in L, K_BB a stiffness block")]

mod error;
pub mod export;
mod figures;
pub mod import;
mod material_entry;
pub mod reduce;
mod robot_entry;
mod stamp;
mod stopwatch;
pub mod yardsticks;

pub use error::{LinkError, WordError};
pub use material_entry::{MaterialConstants, MaterialEntry};
pub use stopwatch::Stopwatch;

/// Parts that the tests of this crate reach; not part of the interface.
#[doc(hidden)]
pub mod internals {
    pub use crate::reduce::files::from_folder;
    pub use crate::reduce::job::{is_job, parse_job};
    pub use crate::stamp::date;
    pub use crate::yardsticks::of_interface;
}
