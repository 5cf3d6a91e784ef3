//! A robot file from a robot description: what can be found out is found out, what cannot is
//! assumed and said, or asked.
//!
//! ```no_run
//! use flexarm_new::{NewOptions, new_robot};
//!
//! let made = new_robot("ur10.urdf".as_ref(), "my_robot".as_ref(), false, &NewOptions::default())?;
//! for assumption in &made.assumptions {
//!     println!("{}: {}", assumption.about, assumption.text);
//! }
//! # Ok::<(), flexarm_run::Error>(())
//! ```
//!
//! Start at [`new_robot`]. `docs/new_robot.md` has the rules and a whole run. Not here: reading the
//! description (`flexarm-urdf`), what a robot file means ([`flexarm_run::Robot`]), the run that
//! follows ([`flexarm_run::Arm::simulate`]).
#![allow(non_snake_case, reason = "monogram notation: X_WL, K_S; see docs/references.md")]
#![cfg_attr(test, allow(clippy::unwrap_used, reason = "a failed unwrap fails the test"))]

mod beams;
mod chain;
mod draft;
mod ends;
mod gears;
mod loads;
mod place;
mod report;
mod sample;
mod text;

use flexarm_run::ExternalError;
use std::path::Path;

use flexarm_settings::Setting;
use flexarm_urdf::ReadOptions;

use flexarm_run::Error;
use flexarm_run::Motion;
use flexarm_run::Robot;
use flexarm_run::motion_report::motion_report;

pub use report::{Assumption, NewDrive, NewHeld, NewJoint, NewLink, NewPayload, NewRobot};

/// Choices of [`new_robot`]; what is not given is found out.
#[derive(Clone, Debug, Default)]
pub struct NewOptions {
    /// Link at which the arm begins; joints before it are held.
    pub base: Option<String>,
    /// Link that is the tool.
    pub tool: Option<String>,
    /// Joints that the motion moves; all others are held.
    pub joints: Option<Vec<String>>,
    /// Mass at the tool (kg); 0 for none.
    pub payload_kg: Option<f64>,
    /// For the URDF reader: packages, arguments, masses from meshes.
    pub urdf: ReadOptions,
}

/// Why no robot file can be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NewError {
    /// Another format.
    #[error("{path}: this is {what}, a URDF or xacro file is needed; {help}")]
    OtherFormat {
        /// The file.
        path: String,
        /// What it is.
        what: &'static str,
        /// What to do.
        help: String,
    },
    /// No joint with a coordinate and room to move.
    #[error(
        "robot {robot:?} has no joint that moves: {}; an arm needs at least one joint of type revolute, continuous or prismatic \
         whose lower limit is below its upper one",
        if *fixed == 0 { "it has no joints at all".to_owned() } else { format!("all its {fixed} joints are fixed, followers or without range") }
    )]
    NoMovableJoint {
        /// Name of the robot.
        robot: String,
        /// Number of its joints.
        fixed: usize,
    },
    /// No joint moves between two links.
    #[error(
        "no joint moves between base {base:?} and tool {tool:?}; choose others with {} and {}",
        Setting::Base,
        Setting::Tool
    )]
    NothingMoves {
        /// Where the arm begins.
        base: String,
        /// Where it ends.
        tool: String,
    },
    /// Nothing moves behind a link.
    #[error("no joint moves behind the base {base:?}; choose another one with {}", Setting::Base)]
    NothingBelow {
        /// Where the arm begins.
        base: String,
    },
    /// The tool is not carried by the base.
    #[error("the tool {tool:?} does not hang on the base {base:?}: no chain of joints leads from one to the other")]
    NotBelow {
        /// Where the arm begins.
        base: String,
        /// Where it ends.
        tool: String,
    },
    /// A link that is not there.
    #[error("the robot has no link {link:?}; {}", did_you_mean(closest, "links", known))]
    NoLink {
        /// What was asked for.
        link: String,
        /// The nearest name.
        closest: Option<String>,
        /// All names.
        known: Vec<String>,
    },
    /// A joint that is not there or does not move by itself.
    #[error("the robot has no joint {joint:?} that moves by itself; {}", did_you_mean(closest, "joints", known))]
    NoJoint {
        /// What was asked for.
        joint: String,
        /// The nearest name.
        closest: Option<String>,
        /// All names.
        known: Vec<String>,
    },
    /// Nothing that moves has a mass.
    #[error(
        "no link of the arm has a mass in this file ({links} links without <inertial>): nothing would weigh or bend. Give the mass \
         of the arm from its data sheet with {} KG: it is spread over the links by the volume of their meshes; or a density with \
         {} KG_PER_M3",
        Setting::InertiaFromTotalMass,
        Setting::InertiaFromDensity
    )]
    NoMass {
        /// Links without mass.
        links: usize,
    },
    /// A payload that is no mass.
    #[error("{} is {found}: expected a mass in kg, 0 for none", Setting::Payload)]
    Payload {
        /// What was given.
        found: f64,
    },
}

impl From<NewError> for flexarm_run::Error {
    fn from(error: NewError) -> Self {
        Self::External(Box::new(error))
    }
}

impl ExternalError for NewError {}

fn did_you_mean(closest: &Option<String>, what: &str, known: &[String]) -> String {
    match closest {
        Some(name) => format!("did you mean {name:?}?"),
        None => format!("its {what} are {known:?}"),
    }
}

/// Makes a folder with `robot.toml`, `motion.toml`, `README.md` and, where it does not lie beside,
/// a copy of the description; loads and checks what it wrote.
///
/// # Errors
/// [`NewError`]: no arm in it, nothing that has a mass, names that are not there; [`Error::Urdf`] for the description;
/// [`Error::Taken`] for files that are there if `overwrite` is not set, [`Error::Write`].
pub fn new_robot(urdf: &Path, folder: &Path, overwrite: bool, options: &NewOptions) -> Result<NewRobot, Error> {
    place::refuse_other_formats(urdf)?;
    let mut draft = draft::Draft::of(urdf, options)?;
    let placed = place::place(&draft, urdf, folder, options)?;
    draft.settle(&placed, options)?;
    let robot_path = folder.join("robot.toml");
    let motion_path = folder.join("motion.toml");
    let mut files = placed.files.clone();
    let motion = text::motion_file(&draft);
    files.push((motion_path.clone(), motion.into_bytes()));
    files.push((robot_path.clone(), text::robot_file(&draft, &placed, &draft.beams_with_sections()).into_bytes()));
    files.push((folder.join("README.md"), text::readme(&draft, &placed).into_bytes()));
    let paths: Vec<_> = files.iter().map(|(path, _)| path.clone()).collect();
    flexarm_files::check_free(&paths, overwrite).map_err(|error| match Error::from(error) {
        Error::Taken { path, .. } => Error::Taken { path, place: "folder", movable: true },
        other => other,
    })?;
    flexarm_files::write_all(&files)?;

    let robot = Robot::load(&robot_path)?;
    let report = motion_report(&motion_path, Some(&robot), &flexarm_run::MotionOptions::default(), &[], 500.0, false)?;
    let findings = flexarm_run::check(&robot_path, Some(&motion_path), &flexarm_run::LoadOptions::default());
    Motion::load(&motion_path, &robot)?;
    Ok(report::of(&draft, &placed, &paths, folder, report, findings))
}
