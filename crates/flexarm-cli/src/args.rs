//! The command line: words, defaults and help texts.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use flexarm::{DriveModel, LinkModel, Modelling};

use crate::convert::ConvertArgs;
use crate::exchange_args::{ExportArgs, ImportArgs};
use crate::posed_args::{ModesArgs, ResponseArgs, StaticsArgs};
use crate::reduce_args::ReduceArgs;
use crate::report::ReportArgs;
use crate::verify::VerifyArgs;
use crate::view::ViewArgs;

/// How far is a robot's tool from where the rigid model puts it, because its links bend?
#[derive(Debug, Parser)]
#[command(name = "flexarm", version, arg_required_else_help = true)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Print one JSON object on standard output and nothing else
    #[arg(long, global = true)]
    pub(crate) json: bool,
    /// No progress bar and no messages but errors
    #[arg(long, short, global = true)]
    pub(crate) quiet: bool,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Run the flexible robot beside its rigid twin, log both, measure the TCP error
    ///
    /// Without arguments: the shipped industrial arm on its pick-and-place cycle.
    Compare(Box<RunArgs>),
    /// Run one model along a trajectory and log it
    Run(Box<RunArgs>),
    /// Show what was loaded, and kinematics and dynamics at a pose
    Inspect(InspectArgs),
    /// Look for everything that is wrong with a robot and a trajectory
    Check(CheckArgs),
    /// Equilibrium under weight and load at a pose, and the compliance of the TCP
    Statics(StaticsArgs),
    /// Natural frequencies, damping and shapes at a pose, drives locked
    Modes(ModesArgs),
    /// Frequency response of the TCP to forces on it and to motions of joints
    Response(ResponseArgs),
    /// Make the HTML report of recorded runs
    Report(ReportArgs),
    /// Write a recording as MCAP, Rerun, CSV or Parquet, from any of them
    Convert(ConvertArgs),
    /// Make a flexible link of a finite element mesh, with its checks
    Reduce(Box<ReduceArgs>),
    /// Make a flexible link of matrices from another FE program
    Import(Box<ImportArgs>),
    /// Write the matrices of a flexible link for another FE program
    Export(ExportArgs),
    /// Run the case studies against their truths and write the page of the results
    Verify(VerifyArgs),
    /// Open a recording in the Rerun viewer
    View(ViewArgs),
    /// Print a shell completion script
    Completions {
        /// Shell to complete for
        shell: clap_complete::Shell,
    },
    /// Print the manual page (roff)
    Man,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct RobotArgs {
    /// Frame to use as TCP instead of the robot file's
    #[arg(long, value_name = "FRAME")]
    pub(crate) tcp: Option<String>,
    /// Where package://NAME/ leads (may be repeated)
    #[arg(long = "package", value_name = "NAME=FOLDER")]
    pub(crate) packages: Vec<String>,
    /// Estimate missing inertias from the meshes with this density (kg/m^3)
    #[arg(long, value_name = "KG_PER_M3", conflicts_with = "inertia_from_total_mass", allow_hyphen_values = true)]
    pub(crate) inertia_from_density: Option<f64>,
    /// Estimate missing inertias from the meshes, all together of this mass (kg)
    #[arg(long, value_name = "KG", allow_hyphen_values = true)]
    pub(crate) inertia_from_total_mass: Option<f64>,
}

/// How links and drives are modelled.
#[derive(Clone, Debug, Args)]
pub(crate) struct ModellingArgs {
    /// Model of the links [default: as the robot file says]
    #[arg(long, value_enum)]
    pub(crate) links: Option<LinksName>,
    /// Model of the drives [default: as the robot file says]
    #[arg(long, value_enum)]
    pub(crate) drives: Option<DrivesName>,
    /// Rigid parts of every lumped link, instead of the robot file's
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(2..))]
    pub(crate) segments: Option<u16>,
    /// Fixed-interface modes of every modal link, instead of the robot file's
    #[arg(long, value_name = "N")]
    pub(crate) modes: Option<u16>,
}

impl ModellingArgs {
    pub(crate) fn modelling(&self) -> Modelling {
        Modelling {
            links: match self.links {
                None => LinkModel::AsFiled,
                Some(LinksName::Rigid) => LinkModel::Rigid,
                Some(LinksName::Lumped) => LinkModel::Lumped,
                Some(LinksName::Modal) => LinkModel::Modal,
            },
            drives: match self.drives {
                None => DriveModel::AsFiled,
                Some(DrivesName::Rigid) => DriveModel::Rigid,
                Some(DrivesName::Elastic) => DriveModel::Elastic,
                Some(DrivesName::Servo) => DriveModel::Servo,
            },
            segments: self.segments.map(usize::from),
            modes: self.modes.map(usize::from),
        }
    }
}

#[derive(Clone, Debug, Args)]
pub(crate) struct RunArgs {
    /// robot.toml, a folder with one, a .urdf or .xacro file, or the name of a shipped robot [default: kr210]
    pub(crate) robot: Option<PathBuf>,
    /// .csv or .toml trajectory, or the name of a shipped one [default: the robot's own]
    pub(crate) trajectory: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) load: RobotArgs,
    /// Time stepper
    #[arg(long, value_name = "NAME", default_value = "generalized-alpha", value_parser = parse_stepper)]
    pub(crate) stepper: StepperName,
    /// Step of the stepper (s)
    #[arg(long, value_name = "SECONDS", default_value_t = 1e-3, allow_hyphen_values = true)]
    pub(crate) step: f64,
    #[command(flatten)]
    pub(crate) modelling: ModellingArgs,
    /// Round corners of the trajectory, where a velocity jumps, by blends that last this long (s)
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true)]
    pub(crate) round_corners: Option<f64>,
    /// File with loads and changes of payload during the run (.toml)
    #[arg(long, value_name = "FILE")]
    pub(crate) loads: Option<PathBuf>,
    /// Logged samples per second
    #[arg(long, value_name = "HZ", default_value_t = 500.0, allow_hyphen_values = true)]
    pub(crate) log_rate: f64,
    /// How the run starts
    #[arg(long, value_enum, default_value_t = StartName::Equilibrium)]
    pub(crate) from_rest: StartName,
    /// Spectral radius of generalized-alpha: 1 damps nothing, 0 damps the highest modes at once
    #[arg(long, value_name = "RHO", default_value_t = 0.9, allow_hyphen_values = true)]
    pub(crate) rho_inf: f64,
    /// Plain generalized-alpha, without the correction of its leading frequency error
    #[arg(long)]
    pub(crate) no_dispersion_correction: bool,
    /// Constraint form of spook
    #[arg(long, value_enum, default_value_t = FormName::Local)]
    pub(crate) spook_form: FormName,
    /// Preset of spook: exact formulas, or those of the method's source
    #[arg(long, value_enum, default_value_t = PresetName::Exact)]
    pub(crate) spook_preset: PresetName,
    /// Relative tolerance of reference, which chooses its steps by error control; --step is then the distance of the points
    #[arg(long, value_name = "RTOL", default_value_t = 1e-9, allow_hyphen_values = true)]
    pub(crate) rtol: f64,
    /// Method of reference
    #[arg(long, value_enum, default_value_t = MethodName::Bdf)]
    pub(crate) reference_method: MethodName,
    /// Band around the final TCP error for the settling time (m)
    #[arg(long, value_name = "METRES", default_value_t = 1e-4, allow_hyphen_values = true)]
    pub(crate) settling_band: f64,
    /// One more run beside this one, with some options changed: links=modal, or stepper=spook,step=5e-4,name=spook, or
    /// robot=..., trajectory=... (may be repeated; compare only)
    #[arg(long, value_name = "KEY=VALUE,...")]
    pub(crate) with: Vec<String>,
    /// Factor by which recordings and pictures show deflections [default: so that they are seen]
    #[arg(long, value_name = "FACTOR", allow_hyphen_values = true)]
    pub(crate) magnify: Option<f64>,
    /// Output folder [default: a new one in out/]
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) output: Option<PathBuf>,
    /// Overwrite what is in the output folder
    #[arg(long)]
    pub(crate) force: bool,
    /// Write a folder "figures" for papers too: plots as SVG with their data as CSV, pictures of the arm as PNG
    #[arg(long)]
    pub(crate) figures: bool,
    /// Write the table as Parquet too (run.parquet); not readable before the run ends
    #[arg(long, conflicts_with = "no_files")]
    pub(crate) parquet: bool,
    /// Write nothing, only print the figures
    #[arg(long, conflicts_with_all = ["output", "force", "figures"])]
    pub(crate) no_files: bool,
    /// Run although the trajectory passes joint limits
    #[arg(long)]
    pub(crate) ignore_limits: bool,
}

#[derive(Debug, Args)]
pub(crate) struct InspectArgs {
    /// robot.toml, a folder with one, a .urdf or .xacro file, or the name of a shipped robot
    pub(crate) robot: PathBuf,
    /// Joint values in coordinate order, or name=value pairs (rad or m; 30deg for degrees)
    #[arg(long, value_name = "Q1,Q2,...", allow_hyphen_values = true)]
    pub(crate) at: Option<String>,
    /// Joint velocities, likewise (rad/s, m/s)
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
    #[command(flatten)]
    pub(crate) load: RobotArgs,
}

/// Steppers of this version.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StepperName {
    GeneralizedAlpha,
    Spook,
    Rk4,
    Reference,
}

fn parse_stepper(text: &str) -> Result<StepperName, String> {
    match text {
        "generalized-alpha" | "generalised-alpha" => Ok(StepperName::GeneralizedAlpha),
        "spook" => Ok(StepperName::Spook),
        "rk4" => Ok(StepperName::Rk4),
        "reference" => Ok(StepperName::Reference),
        _ => Err("this version has generalized-alpha, spook, rk4 and reference".into()),
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum LinksName {
    /// No link bends
    Rigid,
    /// Rigid parts with coupled 6x6 springs
    Lumped,
    /// Bodies that bend in modes (floating frame, Craig-Bampton)
    Modal,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum DrivesName {
    /// Every joint exactly along the trajectory, no springs
    Rigid,
    /// Gearboxes give way, motors exactly along the trajectory
    Elastic,
    /// Motors by torque under servos
    Servo,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum StartName {
    /// The springs carry the weight
    Equilibrium,
    /// The springs are relaxed: the arm falls into its sag and rings
    Undeformed,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum FormName {
    /// Relative motion in the proximal frame
    Local,
    /// Relative motion in world axes
    Global,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum PresetName {
    /// Physical damping time
    Exact,
    /// Damping time of two steps
    Source,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum MethodName {
    /// Implicit, order 1 to 5: well damped high modes
    Bdf,
    /// Implicit, order 3: lightly damped modes in the kHz, loose tolerances
    Esdirk34,
    /// Explicit, order 5: no stiff modes
    Tsit45,
}
