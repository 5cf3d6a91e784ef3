//! A robot file from a robot description: facts are taken from it, and what is missing is assumed
//! and reported, or asked for.
//!
//! ```
//! use flexarm_new::{NewOptions, new_robot};
//!
//! # std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../../.."))?;
//! let folder = std::env::temp_dir().join(format!("new_robot_{}", std::process::id()));
//! let made = new_robot("robots/kr210/kr210.urdf".as_ref(), &folder, false, &NewOptions::default())?;
//! for assumption in &made.assumptions {
//!     println!("{}: {}", assumption.about, assumption.text);
//! }
//! # std::fs::remove_dir_all(folder)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Start at [`new_robot`]. `docs/new_robot.md` has the rules and a complete example. Not here:
//! reading the description (`flexarm-urdf`), the meaning of a robot file ([`flexarm_run::Robot`]),
//! the simulation that follows ([`flexarm_run::Arm::simulate`]).
#![allow(non_snake_case, reason = "monogram notation: X_WL, K_S; see docs/references.md")]

mod beams;
mod chain;
mod draft;
mod ends;
mod gears;
mod loads;
mod place;
mod report;
mod sample;
mod settle;
mod text;

use std::path::Path;

use flexarm_run::motion_report::motion_report;
use flexarm_run::{Error, ExternalError, Motion, Robot};
use flexarm_urdf::ReadOptions;

pub use gears::Reducer;
pub use report::{Assumption, NewDrive, NewHeld, NewJoint, NewLink, NewPayload, NewRobot};

/// Parts that the tests of this crate reach; not part of the interface.
#[doc(hidden)]
pub mod internals {
    pub use crate::beams::{BeamSection, Candidate, NoSection, propose};
    pub use crate::chain::{Chain, find};
    pub use crate::gears::{PEAK_OVER_RATED, class};
    pub use crate::loads::guessed_payload;
    pub use crate::place::relative;
}

/// Options of [`new_robot`]; missing ones are determined from the description.
#[derive(Clone, Debug, Default)]
pub struct NewOptions {
    /// Base link of the arm; joints before it are held.
    pub base: Option<String>,
    /// Tool link.
    pub tool: Option<String>,
    /// Joints moved by the motion; all others are held.
    pub joints: Option<Vec<String>>,
    /// Payload mass (kg); 0 for none.
    pub payload_kg: Option<f64>,
    /// Kind of all reducers; by their rated torque if missing.
    pub reducers: Option<Reducer>,
    /// Options of the URDF reader: packages, arguments, masses from meshes.
    pub urdf: ReadOptions,
}

/// An error of making a robot file: what was found, what was expected and the remedy.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct NewError(String);

impl From<NewError> for flexarm_run::Error {
    fn from(error: NewError) -> Self {
        Self::External(Box::new(error))
    }
}

impl ExternalError for NewError {}

/// Writes a folder with `robot.toml`, `motion.toml`, `README.md` and, if it is not in the same
/// place, a copy of the description; then loads and checks the written files.
///
/// # Errors
/// [`NewError`] if there is no arm, no mass, or an unknown name; [`Error::Urdf`] for an invalid
/// description; [`Error::Taken`] for existing files if `overwrite` is not set, [`Error::Write`].
pub fn new_robot(urdf: &Path, folder: &Path, overwrite: bool, options: &NewOptions) -> Result<NewRobot, Error> {
    // Facts and assumptions, the place of the description, beams that can be loaded.
    place::refuse_other_formats(urdf)?;
    let mut draft = draft::Draft::of(urdf, options)?;
    let placed = place::place(&draft, urdf, folder, options)?;
    settle::settle(&mut draft, &placed)?;
    // All files or none.
    let robot_path = folder.join("robot.toml");
    let motion_path = folder.join("motion.toml");
    let mut files = placed.files.clone();
    let motion = text::motion_file(&draft);
    files.push((motion_path.clone(), motion.into_bytes()));
    files.push((robot_path.clone(), text::robot_file(&draft, &placed, &draft.beams_with_sections()).into_bytes()));
    files.push((folder.join("README.md"), text::readme(&draft, &placed).into_bytes()));
    let paths: Vec<_> = files.iter().map(|(path, _)| path.clone()).collect();
    flexarm_files::check_apart(&paths, &[urdf])?;
    flexarm_files::check_free(&paths, overwrite).map_err(|error| match Error::from(error) {
        Error::Taken { path, .. } => Error::Taken { path, place: "folder", movable: true },
        other => other,
    })?;
    flexarm_files::write_all(&files)?;

    // The written files are read and checked as a user's would be.
    let robot = Robot::load(&robot_path)?;
    let report = motion_report(&motion_path, Some(&robot), &flexarm_run::MotionOptions::default(), &[], 500.0, false)?;
    let findings = flexarm_run::check(&robot_path, Some(&motion_path), &flexarm_run::LoadOptions::default());
    Motion::load(&motion_path, &robot)?;
    Ok(report::of(&draft, &placed, &paths, folder, report, findings))
}
