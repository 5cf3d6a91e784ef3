//! Identification of robot file parameters from measurements, and choice of poses to measure.
//!
//! [`identify_robot`] reads a file of measurements (`docs/identify.md`), estimates the robot file's
//! parameters and their uncertainty; [`plan_measurements`] chooses poses. The underlying functions
//! on plain values are re-exported: [`identify`], [`plan`], [`MeasuredArm`].
//!
//! ```text
//! file -> Measurements --+
//! arm -> Parameter, ... -+-> identify -> Identified -> answer, page, rewrite
//! ```
//! Not here: the model of the arm (`flexarm-run`), equilibria and modes (`flexarm-stepping`).
//!
//! ```
//! use flexarm_identify::{frequency_slopes, nominal, parameters};
//! use flexarm_run::{Modelling, Robot};
//!
//! # std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../../.."))?;
//! let arm = Robot::load("robots/kr210")?.model(&Modelling::default())?;
//! let unknown = &parameters(&arm)[..2];
//! let found = frequency_slopes(&nominal(&arm), unknown, &[0.0; 6])?;
//! println!("first frequency {} Hz", found.hz[0]);
//! for (parameter, slope) in unknown.iter().zip(found.slopes.row(0).iter()) {
//!     println!("{}: {slope} Hz per unit of its search coordinate", parameter.name);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![allow(non_snake_case, reason = "monogram notation: X_WT, J; see docs/references.md")]

mod answer;
mod caveats;
mod choose;
mod encoders;
mod error;
mod estimation;
mod file;
mod page;
pub mod parameters;
mod plan_file;
mod plan_load;
mod response_file;
pub mod rewrite;
mod uff;
mod units;

use std::path::{Path, PathBuf};

use flexarm_files::{check_apart, check_free, write_all};
use flexarm_run::caveat::{Use, warnings};
use flexarm_run::{Arm, Error, Modelling, Robot};

use self::answer::answer;
use self::caveats::{empty_caveat, encoder_caveats, frame_caveat, gear_caveat, load_caveats};
use self::choose::{check_tool, chosen};
use self::error::{of_slip, refused};
use self::file::{Cell, MeasurementInput};
use self::parameters::ParameterLocation;
use self::units::{check_modes, check_units};

pub use self::answer::{
    Compared, FoundFrame, FoundPoint, HeldOutFigures, Identification, Residual, ResponseCurves, ShapeFigures,
    Suspicious, Weight,
};
pub use self::encoders::EncoderFigures;
pub use self::error::IdentifyFileError;
pub use self::estimation::*;
pub use self::plan_file::{MeasurementPlan, PlanRequest, PlannedReading, plan_measurements};

/// Returns the arm as model for the identification: tree, springs, TCP.
pub fn nominal(arm: &Arm) -> NominalArm {
    NominalArm {
        model: arm.model.clone(),
        springs: arm.springs.clone(),
        tool: arm.tcp.clone(),
        coupling: arm.gear_coupling().cloned(),
    }
}

/// Returns the identifiable parameters of an arm, with the names that files and `--fit` use.
pub fn parameters(arm: &Arm) -> Vec<Parameter> {
    parameters_like(arm, "*")
}

/// Returns the parameters that a pattern of `fit` selects, such as `joint.*`. `*` selects those of
/// [`parameters()`]: without the parameters that a pattern must name.
pub fn parameters_like(arm: &Arm, pattern: &str) -> Vec<Parameter> {
    let all = parameters::candidates(arm.robot(), arm).into_iter().map(|c| c.parameter);
    all.filter(|parameter| parameters::asks_for(pattern, &parameter.name)).collect()
}

/// Arguments of [`identify_robot`].
#[derive(Clone, Debug, Default)]
pub struct IdentifyRequest {
    /// Modelling of links and drives.
    pub modelling: Modelling,
    /// Names of the unknown parameters, with `*` as a wildcard, in place of those in the file.
    pub fit: Vec<String>,
    /// Folder of the new robot file and the page; none are written if absent.
    pub output: Option<PathBuf>,
    /// Whether to overwrite existing files.
    pub overwrite: bool,
}

/// Identifies parameters of a robot from measurements, and writes a robot file with them.
///
/// # Errors
/// [`Error::RobotFile`] with line and column for errors in the file, [`Error::File`] for its
/// tables; [`IdentifyFileError`] if the measurements do not fit the robot: units, frames, rank;
/// [`Error::Taken`], [`Error::Write`].
pub fn identify_robot(robot: &Robot, measurements: &Path, request: &IdentifyRequest) -> Result<Identification, Error> {
    identify_robot_watched(robot, measurements, request, &|_| true)
}

/// As [`identify_robot`]; calls `watch` after each iteration and ends the search with the best
/// values so far where it returns false.
///
/// # Errors
/// As [`identify_robot`].
pub fn identify_robot_watched(
    robot: &Robot,
    measurements: &Path,
    request: &IdentifyRequest,
    watch: &dyn Fn(&Progress) -> bool,
) -> Result<Identification, Error> {
    let arm = robot.model(&request.modelling)?;
    let joints = joints_of(&arm);
    // Readings and parameters; encoders give readings of their own.
    let mut input = file::read(measurements, &Cell { joints: &joints, arm: &arm })?;
    let chosen = chosen(&arm, &input, &request.fit)?;
    let encoders = encoders::encoder_figures(&arm, &input, &chosen)?;
    input.measurements.readings.extend(encoders.iter().filter_map(EncoderFigures::reading));
    if input.measurements.readings.is_empty() {
        let joints: Vec<&String> = encoders.iter().map(|gear| &gear.joint).collect();
        return Err(refused(format!(
            "the recordings of {joints:?} do not determine a stiffness: deflection and torque are not correlated"
        )));
    }
    let targets = match &request.output {
        Some(folder) => Some(Targets::in_folder(folder, robot, measurements, request.overwrite)?),
        None => None,
    };
    // Mistakes in the readings are refused before a fit hides them.
    check_tool(robot, &chosen, &input)?;
    let nominal = nominal(&arm);
    check_modes(&nominal, &input)?;
    check_units(&nominal, &input)?;
    let parameters: Vec<Parameter> = chosen.iter().map(|c| c.parameter.clone()).collect();
    let slides: Vec<bool> = joints.iter().map(|(_, slides)| *slides).collect();
    if let Some(slip) = likely_slip(&nominal, &parameters, &input.measurements, &slides) {
        return Err(of_slip(slip, &joints));
    }
    // The fit, and what limits its validity.
    let options =
        IdentifyOptions { search: Search { loss: input.loss, ..Search::default() }, ..IdentifyOptions::default() };
    let found = identify(&nominal, &parameters, &input.measurements, &options, watch)?;
    let mut answer = answer(robot, measurements, &nominal, &parameters, &input, &found)?;
    answer.caveats.extend(frame_caveat(&answer));
    answer.caveats.extend(gear_caveat(robot));
    answer.caveats.extend(encoder_caveats(&encoders));
    answer.caveats.extend(load_caveats(&nominal, &input));
    answer.caveats.extend(empty_caveat(&input));
    // Stiffnesses are first guesses here.
    answer.caveats.extend(arm.caveats(Use::Any).into_iter().filter(|caveat| caveat.code != "gear-stiffness"));
    answer.warnings = warnings(&answer.caveats);
    answer.encoders = encoders;
    if let Some(targets) = targets {
        targets.write(robot, &chosen, &found, &mut answer)?;
    }
    Ok(answer)
}

/// Returns the actuated joints in coordinate order, and whether they slide.
fn joints_of(arm: &Arm) -> Vec<(String, bool)> {
    let model = &arm.model;
    let actuated = &model.coordinates()[..model.n_actuated()];
    actuated.iter().map(|c| (c.joint.clone(), c.slides())).collect()
}

/// Output files.
struct Targets {
    robot: PathBuf,
    page: PathBuf,
}

impl Targets {
    /// Returns the files in a folder, none of which may be an input or exist already.
    fn in_folder(folder: &Path, robot: &Robot, measurements: &Path, overwrite: bool) -> Result<Self, Error> {
        let targets = Self { robot: folder.join("robot.toml"), page: folder.join("identification.html") };
        let all = [targets.robot.clone(), targets.page.clone()];
        check_apart(&all, &[&robot.path, &robot.urdf_path, measurements])?;
        check_free(&all, overwrite)?;
        Ok(targets)
    }

    /// Writes the robot file with the identified values, and the page; names both in the answer.
    fn write(
        self,
        robot: &Robot,
        chosen: &[parameters::Candidate],
        found: &Identified,
        answer: &mut Identification,
    ) -> Result<(), Error> {
        let identified = found.parameters.iter().zip(chosen);
        let places = |c: &parameters::Candidate| std::iter::once(c.written.clone()).chain(c.tied.clone());
        let identified: Vec<(FittedParameter, ParameterLocation)> =
            identified.flat_map(|(p, c)| places(c).map(|place| (p.clone(), place))).collect();
        let text = flexarm_files::read_text(&robot.path)?;
        let home = robot.path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let folder = self.robot.parent().unwrap_or(Path::new("."));
        // Relative paths from the new file need its folder to exist.
        std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.to_owned(), source })?;
        let new = rewrite::rewritten(&text, &identified, robot.tcp(), &robot.calibration, home, folder)
            .map_err(|what| Error::File { path: robot.path.clone(), what })?;
        (answer.file, answer.page) = (Some(self.robot.display().to_string()), Some(self.page.display().to_string()));
        let page = page::html(answer);
        write_all(&[(self.robot, new), (self.page, page)])?;
        Ok(())
    }
}

/// Kernels, for the tests of this crate.
#[doc(hidden)]
pub mod internals {
    pub use crate::estimation::bounded::bounded_minimum;
    pub use crate::estimation::least_squares::{chi_square_bounds, scale};
    pub use crate::estimation::parameter::displacement;
    pub use crate::estimation::placement::rigid_fit;
    pub use crate::parameters::ParameterLocation;
    pub use crate::rewrite::rewritten;
    pub use crate::uff::{UffFunction, read_functions};
}
