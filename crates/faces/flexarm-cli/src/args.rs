//! Command-line arguments, defaults and help texts.
//!
//! Start at [`RunArgs`]: what `run` and `compare` take. [`RobotArgs`] and [`ModellingArgs`] are
//! shared by the commands that load a robot. Units are those that a user types; conversions stand
//! beside the parsers. Not here: arguments of one command (beside it, or in its `*_args.rs`), what
//! is done with them.

use std::path::{Path, PathBuf};

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use flexarm::robots::{InertiaEstimate, ReadOptions};
use flexarm::settings::Words;
use flexarm::steppers::{ConstraintForm, ReferenceMethod, STEPPERS, SpookPreset, Start, StepperEntry};
use flexarm::{DriveModel, LinkModel, LoadOptions, Modelling, Robot, RobotSource, sweep::Change};

use crate::failure::Failure;
use crate::formats;
use crate::motion::MotionInputArgs;
use crate::shipped;

const EXAMPLES: &str = "\
Examples:
  The shipped arm with a lighter payload, as an additional run beside the first:
      flexarm compare kr210 pick_and_place --with set=payload.mass=75,name=75kg
  Your arm on your motion, under the loads of a file, in a folder of your own:
      flexarm compare my_arm my_motion.csv --loads cut.toml -o results
  Links as modal bodies, motors under servos, the figures alone:
      flexarm compare kr210 --links modal --drives servo --no-files";

#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Robot")]
pub(crate) struct RobotArgs {
    /// Frame to use as TCP instead of the robot file's
    #[arg(long, value_name = "FRAME")]
    pub(crate) tcp: Option<String>,
    /// Folder of package://NAME/ (may be repeated)
    #[arg(long = "package", hide_short_help = true, value_name = "NAME=FOLDER")]
    pub(crate) packages: Vec<String>,
    /// Argument of a xacro file, overrides those of the robot file (may be repeated)
    #[arg(long = "arg", value_name = "NAME=VALUE")]
    pub(crate) arguments: Vec<String>,
    /// Link whose inertia may be physically impossible (may be repeated)
    #[arg(long, value_name = "LINK")]
    pub(crate) waive_inertia: Vec<String>,
    /// Estimate missing inertias from the meshes with this density (kg/m^3)
    #[arg(
        long,
        hide_short_help = true,
        value_name = "KG_PER_M3",
        conflicts_with = "inertia_from_total_mass",
        allow_hyphen_values = true
    )]
    pub(crate) inertia_from_density: Option<f64>,
    /// Estimate missing inertias from the meshes, scaled to this total mass (kg)
    #[arg(long, hide_short_help = true, value_name = "KG", allow_hyphen_values = true)]
    pub(crate) inertia_from_total_mass: Option<f64>,
}

impl RobotArgs {
    /// Loads a robot by its path or the name of a shipped one.
    pub(crate) fn load(&self, given: &Path) -> Result<Robot, Failure> {
        let path = shipped::robot(Some(given))?;
        Ok(RobotSource::new(&path, &self.options()?).load()?.robot().clone())
    }

    /// Returns the options for loading a robot.
    pub(crate) fn options(&self) -> Result<LoadOptions, Failure> {
        let mut urdf =
            ReadOptions { search_paths: flexarm::robots::search_paths_from_environment(), ..ReadOptions::default() };
        for package in &self.packages {
            let (name, folder) = package
                .split_once('=')
                .ok_or_else(|| Failure::Usage(format!("--package {package:?}: expected NAME=FOLDER")))?;
            urdf.packages.push((name.to_owned(), folder.into()));
        }
        for argument in &self.arguments {
            // ROS writes NAME:=VALUE.
            let (name, value) = argument
                .split_once(":=")
                .or_else(|| argument.split_once('='))
                .filter(|(name, _)| !name.trim().is_empty())
                .ok_or_else(|| Failure::Usage(format!("--arg {argument:?}: expected NAME=VALUE")))?;
            urdf.arguments.push((name.trim().to_owned(), value.to_owned()));
        }
        let positive = |x: f64, what: &str| {
            if x.is_finite() && x > 0.0 {
                Ok(x)
            } else {
                Err(Failure::Usage(format!("{what} must be positive, found {x}")))
            }
        };
        if let Some(density) = self.inertia_from_density {
            urdf.inertia_from_mesh = Some(InertiaEstimate::Density(positive(density, "--inertia-from-density")?));
        }
        if let Some(mass) = self.inertia_from_total_mass {
            urdf.inertia_from_mesh = Some(InertiaEstimate::TotalMass(positive(mass, "--inertia-from-total-mass")?));
        }
        urdf.waive.extend(self.waive_inertia.iter().cloned());
        Ok(LoadOptions { tcp: self.tcp.clone(), urdf })
    }
}

/// Model choices for links and drives.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Models")]
pub(crate) struct ModellingArgs {
    /// Model of the links [default: as the robot file says]
    #[arg(long, value_parser = word_of::<LinkModel>())]
    pub(crate) links: Option<LinkModel>,
    /// Model of the drives [default: as the robot file says]
    #[arg(long, value_parser = word_of::<DriveModel>())]
    pub(crate) drives: Option<DriveModel>,
    /// Rigid parts of every lumped link, instead of the robot file's
    #[arg(long, value_name = "N", hide_short_help = true, value_parser = clap::value_parser!(u32).range(2..))]
    pub(crate) segments: Option<u32>,
    /// Fixed-interface modes of every modal link, instead of the robot file's
    #[arg(long, value_name = "N", hide_short_help = true)]
    pub(crate) modes: Option<u32>,
}

/// Parser for the words of a choice, each with its help text.
pub(crate) fn word_of<T: Words + Send + Sync>() -> impl TypedValueParser<Value = T> {
    let known = T::WORDS.iter().map(|(word, _, means)| PossibleValue::new(*word).help(*means));
    PossibleValuesParser::new(known)
        .try_map(|given| T::from_word(&given).ok_or_else(|| format!("{given:?} is not known")))
}

impl ModellingArgs {
    pub(crate) fn modelling(&self) -> Modelling {
        Modelling {
            links: self.links.unwrap_or_default(),
            drives: self.drives.unwrap_or_default(),
            segments: self.segments.map(|n| n as usize),
            modes: self.modes.map(|n| n as usize),
        }
    }
}

#[derive(Clone, Debug, Args)]
#[command(after_long_help = EXAMPLES, after_help = "All options, with examples: --help")]
pub(crate) struct RunArgs {
    /// robot.toml, a folder with one, a .urdf or .xacro file, or the name of a shipped robot
    /// [default: fanuc_r2000_210f]
    pub(crate) robot: Option<PathBuf>,
    /// Motion of any format (flexarm format motion), or the name of a shipped one [default: the
    /// robot's own]
    pub(crate) trajectory: Option<PathBuf>,
    /// Time stepper
    #[arg(long, help_heading = "Stepper", value_name = "NAME", value_parser = stepper_words(), default_value = STEPPERS[0].name)]
    pub(crate) stepper: &'static StepperEntry,
    /// Step size of the stepper (s) [default: the stepper's own]
    #[arg(long, help_heading = "Stepper", value_name = "SECONDS", allow_hyphen_values = true)]
    pub(crate) step: Option<f64>,
    #[command(flatten)]
    pub(crate) modelling: ModellingArgs,
    #[command(flatten)]
    pub(crate) load: RobotArgs,
    #[command(flatten)]
    pub(crate) motion: MotionInputArgs,
    /// Round corners of the trajectory, where the velocity jumps, by blends of this duration (s)
    #[arg(long, help_heading = "Models", hide_short_help = true, value_name = "SECONDS", allow_hyphen_values = true)]
    pub(crate) round_corners: Option<f64>,
    /// File with loads and payload changes during the run (.toml; flexarm format loads)
    #[arg(long, help_heading = "Models", value_name = "FILE")]
    pub(crate) loads: Option<PathBuf>,
    /// Change an entry of the robot file for this run, payload.mass=150 or
    /// 'drive.*.gearbox.stiffness*=0.5' (a factor), or the speed of the motion, motion.speed=0.8;
    /// paths as in studies (may be repeated)
    #[arg(long, help_heading = "Models", value_name = "PATH=VALUE")]
    pub(crate) set: Vec<Change>,
    /// Logged samples per second
    #[arg(
        long,
        help_heading = "Results",
        hide_short_help = true,
        value_name = "HZ",
        default_value_t = 500.0,
        allow_hyphen_values = true
    )]
    pub(crate) log_rate: f64,
    /// Initial state of the run
    #[arg(long, help_heading = "Models", hide_short_help = true, value_parser = word_of::<Start>(), default_value = "equilibrium")]
    pub(crate) from_rest: Start,
    /// Spectral radius of generalized-alpha: 1 for no numerical damping, 0 to annihilate the
    /// highest modes
    #[arg(
        long,
        help_heading = "Stepper",
        hide_short_help = true,
        value_name = "RHO",
        default_value_t = 0.9,
        allow_hyphen_values = true
    )]
    pub(crate) rho_inf: f64,
    /// Plain generalized-alpha, without the correction of its leading frequency error
    #[arg(long, help_heading = "Stepper", hide_short_help = true)]
    pub(crate) no_dispersion_correction: bool,
    /// Constraint form of spook
    #[arg(long, help_heading = "Stepper", hide_short_help = true, value_parser = word_of::<ConstraintForm>(), default_value = "local")]
    pub(crate) spook_form: ConstraintForm,
    /// Preset of spook: exact formulas, or those of the method's source
    #[arg(long, help_heading = "Stepper", hide_short_help = true, value_parser = word_of::<SpookPreset>(), default_value = "exact")]
    pub(crate) spook_preset: SpookPreset,
    /// Relative tolerance of reference, which chooses its step size by error control; --step is
    /// then the interval of the output points
    #[arg(
        long,
        help_heading = "Stepper",
        hide_short_help = true,
        value_name = "RTOL",
        default_value_t = 1e-9,
        allow_hyphen_values = true
    )]
    pub(crate) rtol: f64,
    /// Integration method of reference
    #[arg(long, help_heading = "Stepper", hide_short_help = true, value_parser = word_of::<ReferenceMethod>(), default_value = "bdf")]
    pub(crate) reference_method: ReferenceMethod,
    /// Band around the final TCP error for the settling time (m)
    #[arg(
        long,
        help_heading = "Results",
        hide_short_help = true,
        value_name = "METRES",
        default_value_t = 1e-4,
        allow_hyphen_values = true
    )]
    pub(crate) settling_band: f64,
    /// An additional run with some options changed: links=modal, or
    /// stepper=spook,step=5e-4,name=spook, or robot=..., trajectory=... (may be repeated; compare
    /// only)
    #[arg(long, help_heading = "Results", value_name = "KEY=VALUE,...")]
    pub(crate) with: Vec<String>,
    /// Magnification of deflections in recordings and pictures [default: so that they are visible]
    #[arg(long, help_heading = "Results", hide_short_help = true, value_name = "FACTOR", allow_hyphen_values = true)]
    pub(crate) magnify: Option<f64>,
    /// Start time of the run in recordings with absolute times (MCAP), in seconds since 1970
    /// [default: 946684800, 1 January 2000, so that equal runs give equal files]
    #[arg(long, help_heading = "Files", value_name = "now|SECONDS", value_parser = parse_start_time, allow_hyphen_values = true)]
    pub(crate) start_time: Option<u64>,
    /// Embed the mesh files in the robot description of the MCAP, so that it shows on any machine
    /// (Foxglove draws them; Rerun and RViz need files)
    #[arg(long, help_heading = "Files")]
    pub(crate) embed_meshes: bool,
    /// Output folder [default: a new one in out/]
    #[arg(short, long, help_heading = "Files", value_name = "FOLDER")]
    pub(crate) output: Option<PathBuf>,
    /// Overwrite files in the output folder
    #[arg(long, help_heading = "Files")]
    pub(crate) force: bool,
    /// Also write a folder "figures" for papers: plots as SVG with their data as CSV, pictures of
    /// the arm as PNG
    #[arg(long, help_heading = "Files", hide_short_help = true)]
    pub(crate) figures: bool,
    /// Also write the table as Parquet (run.parquet); not readable before the run ends
    #[arg(long, help_heading = "Files", hide_short_help = true, conflicts_with = "no_files")]
    pub(crate) parquet: bool,
    /// Write no files, only print the figures
    #[arg(long, help_heading = "Files", conflicts_with_all = ["output", "force", "figures"])]
    pub(crate) no_files: bool,
    /// Run even if the trajectory exceeds joint limits
    #[arg(long, help_heading = "Models", hide_short_help = true)]
    pub(crate) ignore_limits: bool,
}

#[derive(Debug, Args)]
pub(crate) struct InspectArgs {
    /// robot.toml, a folder with one, a .urdf or .xacro file, or the name of a shipped robot
    pub(crate) robot: PathBuf,
    /// Joint values in coordinate order, or name=value pairs (rad or m; 30deg for degrees)
    /// [default: where the robot's own motion begins, else all zero]
    #[arg(long, value_name = "Q1,Q2,...", allow_hyphen_values = true)]
    pub(crate) at: Option<String>,
    /// Joint velocities, in the same form (rad/s, m/s)
    #[arg(long, value_name = "V1,V2,...", allow_hyphen_values = true)]
    pub(crate) velocity: Option<String>,
    #[command(flatten)]
    pub(crate) load: RobotArgs,
}

#[derive(Debug, Args)]
pub(crate) struct CheckArgs {
    /// robot.toml, a folder with one, a .urdf or .xacro file, or the name of a shipped robot
    pub(crate) robot: PathBuf,
    /// Trajectory to check against the robot's limits
    pub(crate) trajectory: Option<PathBuf>,
    /// File of loads during the trajectory, also checked
    #[arg(long, value_name = "FILE")]
    pub(crate) loads: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) motion: MotionInputArgs,
    #[command(flatten)]
    pub(crate) load: RobotArgs,
}

/// Parser for the names of the registered steppers, with their help.
pub(crate) fn stepper_words() -> impl TypedValueParser<Value = &'static StepperEntry> {
    let help = |entry: &StepperEntry| format!("{}; step {} ms", entry.help, 1e3 * entry.default_step_s);
    let words = STEPPERS.map(|entry| PossibleValue::new(entry.name).help(help(entry)).aliases(entry.aliases));
    PossibleValuesParser::new(words).map(|word| StepperEntry::named(&word).expect("the parser lets no other word pass"))
}

/// Pages on file formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum PageName {
    /// robot.toml: tool, payload, flexible links, drives
    Robot,
    /// Motions: waypoints, samples and tables, messages and bags of ROS
    Motion,
    /// Motions given by the TCP path, standard motions (.toml)
    Path,
    /// Robot programs: KUKA KRL, ABB RAPID, URScript, G-code
    Program,
    /// Loads on the arm during a run (.toml)
    Loads,
    /// Measurements of a robot, for flexarm identify (.toml)
    Measurements,
    /// Cutting tools, for flexarm lobes (.toml)
    Tool,
    /// Lists of poses, for flexarm map (.toml)
    Map,
    /// Studies of many runs, for flexarm sweep (.toml)
    Study,
    #[value(help = formats::help_page())]
    Recordings,
    /// Reduced links (.flex)
    Flex,
}

impl PageName {
    pub(crate) fn text(self) -> &'static str {
        match self {
            Self::Robot => include_str!("../../../../docs/robot-file.md"),
            Self::Motion => include_str!("../../../../docs/motions.md"),
            Self::Path => include_str!("../../../../docs/paths.md"),
            Self::Program => include_str!("../../../../docs/programs.md"),
            Self::Loads => include_str!("../../../../docs/loads.md"),
            Self::Measurements => include_str!("../../../../docs/identify.md"),
            Self::Tool => include_str!("../../../../docs/lobes.md"),
            Self::Map => include_str!("../../../../docs/map.md"),
            Self::Study => include_str!("../../../../docs/sweep.md"),
            Self::Recordings => include_str!("../../../../docs/recordings.md"),
            Self::Flex => include_str!("../../../links/flexarm-fem/src/flex_file/format.md"),
        }
    }
}

/// Parses a time as nanoseconds since 1970; ROS times end in 2038.
fn parse_start_time(text: &str) -> Result<u64, String> {
    const LATEST_S: f64 = i32::MAX as f64;
    if text == "now" {
        let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
        return Ok(u64::try_from(since.as_nanos()).unwrap_or(u64::MAX));
    }
    let seconds: f64 = text.parse().map_err(|_| format!("expected now or seconds since 1970, found {text:?}"))?;
    if !(0.0..=LATEST_S).contains(&seconds) {
        return Err(format!("expected seconds from 0 (1970) to {LATEST_S} (2038), found {seconds}"));
    }
    Ok((seconds * 1e9).round() as u64)
}
