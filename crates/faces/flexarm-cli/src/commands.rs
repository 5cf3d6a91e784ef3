//! Commands of the program and its help.
//!
//! Start at [`Command`]: each variant has the arguments of a command, [`run`] calls its function.
//! Not here: arguments and tables of a command (a file of its name), errors and exit codes
//! (`failure.rs`, `lib.rs`).

use std::ffi::OsString;
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

use crate::args::{CheckArgs, InspectArgs, PageName, RunArgs};
use crate::compensate::CompensateArgs;
use crate::convert::ConvertArgs;
use crate::exchange_args::{ExportArgs, ImportArgs};
use crate::failure::Failure;
use crate::fmu::ExportFmuArgs;
use crate::identify::IdentifyArgs;
use crate::later::Later;
use crate::lobes::LobesArgs;
use crate::map::MapArgs;
use crate::motion::MotionArgs;
use crate::new::NewArgs;
use crate::posed_args::{ModesArgs, ResponseArgs, StaticsArgs};
use crate::reduce_args::ReduceArgs;
use crate::report::ReportArgs;
use crate::sensitivity::SensitivityArgs;
#[cfg(not(target_family = "wasm"))]
use crate::serve::{self, ServeArgs};
use crate::sweep::SweepArgs;
use crate::terminal::{Terminal, written};
use crate::view::ViewArgs;
use crate::{
    compensate, convert, exchange, fmu, formats, identify, inspect, lobes, map, motion, new, posed, reduce, report,
    sensitivity, simulate, sweep, view,
};

/// Help of the program without a command; a line for every command.
pub const HELP: &str = "\
{about}

{usage-heading} {usage}

Start:
  flexarm compare                             the shipped arm and its report
  flexarm new my_arm.urdf --payload 8         a robot file from a URDF
  flexarm compare my_arm my_motion.csv        your arm on your motion

Runs:
  compare      Run the flexible robot beside its rigid twin: TCP error, report
  run          Run one model along a motion and log it
  report       Write the HTML report of recorded runs
  convert      Write a recording in another format
  view         Open a recording in the Rerun viewer
  serve        Open the web page on which the program runs

Robots and motions:
  new          Create a robot file, a motion and a first run from a URDF
  check        List all problems of a robot and a motion
  inspect      Show a robot with its kinematics and dynamics at a pose
  motion       Show a motion against the limits of a robot, convert it
  format       Print the page of a file format

One pose:
  statics      Equilibrium under weight and load, compliance of the TCP
  modes        Natural frequencies, damping and shapes
  response     Frequency response of the TCP
  lobes        Depth of cut without chatter over the spindle speed

Studies:
  map          Sag, stiffness and frequencies over the workspace
  sweep        Many runs with varied payloads, stiffness, speeds, options
  sensitivity  Derivatives of the TCP error by every parameter
  identify     Stiffness from measurements; poses worth measuring
  compensate   Motion with which the TCP follows the rigid one's

Flexible links:
  reduce       Create a flexible link from a finite element mesh
  import       Create a flexible link from matrices of another program
  export       Write an arm, or the matrices of a link, for other programs

Other programs:
  export-fmu   Write the arm as an FMU, a plant for control programs

Program:
  completions  Print a shell completion script
  man          Print the manual page
  help         Print the help of a command

{options}
";

/// Computes how far the links' flexibility moves a robot's tool from where the rigid model puts it
#[derive(Debug, Parser)]
#[command(name = "flexarm", version, arg_required_else_help = true, help_template = HELP)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
    #[command(flatten)]
    pub(crate) terminal: Terminal,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Run the flexible robot and its rigid twin, log both, measure the TCP error
    ///
    /// Without arguments: the shipped arm fanuc_r2000_210f on its handling cycle.
    Compare(Later<RunArgs>),
    /// Run one model along a trajectory and log it
    Run(Later<RunArgs>),
    /// Show what was loaded, and kinematics and dynamics at a pose
    Inspect(Later<InspectArgs>),
    /// Check a robot and a trajectory and list all problems
    Check(Later<CheckArgs>),
    /// Create a robot file, a sample motion and a first run from a URDF or xacro file
    New(Later<NewArgs>),
    /// Show the contents of a motion, check it against a robot's limits, and convert it to other
    /// formats
    Motion(Later<MotionArgs>),
    /// Identify a robot's stiffness from measurements, and plan the poses to measure
    Identify(Later<IdentifyArgs>),
    /// Find the motion with which the flexible arm's TCP follows the rigid one's, and evaluate it
    /// on other plants
    Compensate(Later<CompensateArgs>),
    /// Derivatives of the TCP error along a motion with respect to all parameters of the robot, by
    /// central differences of runs
    Sensitivity(Later<SensitivityArgs>),
    /// Sag, stiffness and frequencies over the workspace, over joints or along a motion, and where
    /// to put a workpiece
    Map(Later<MapArgs>),
    /// Run a study: many runs with varied payloads, stiffness, speeds, options; tables,
    /// sensitivities, shards
    Sweep(Box<SweepArgs>),
    /// Equilibrium under gravity and load at a pose, and the compliance of the TCP
    Statics(Later<StaticsArgs>),
    /// Natural frequencies, damping and shapes at a pose, drives locked
    Modes(Later<ModesArgs>),
    /// Frequency response of the TCP to forces on it and to motions of joints
    Response(Later<ResponseArgs>),
    /// Limits of depth of cut for chatter of a cutting tool on the arm, over the spindle speed
    Lobes(Later<LobesArgs>),
    /// Write the HTML report of recorded runs
    Report(Later<ReportArgs>),
    #[command(about = formats::about_convert())]
    Convert(Later<ConvertArgs>),
    /// Create a flexible link from a finite element mesh, with checks
    Reduce(Later<ReduceArgs>),
    /// Create a flexible link from matrices of another FE program
    Import(Later<ImportArgs>),
    /// Write an elastic arm for MuJoCo, Pinocchio or Drake, or the matrices of a link for an FE program
    Export(Later<ExportArgs>),
    /// Write the arm as an FMU, a plant for control programs
    ///
    /// The FMU (FMI 3.0 or 2.0, co-simulation and model exchange) holds the robot, its links, drives
    /// and payload. Its inputs are joint targets, motor torques, a wrench on the TCP, and whether the
    /// payload is carried; its outputs are encoders, drive torques, the TCP and its error.
    ExportFmu(Later<ExportFmuArgs>),
    /// Open a recording in the Rerun viewer
    View(Later<ViewArgs>),
    /// Open the web page on which the program runs, by a server that only this machine reaches
    #[cfg(not(target_family = "wasm"))]
    Serve(ServeArgs),
    /// Print the page of a file format: keys, units, defaults, examples
    Format {
        /// Format to describe
        #[arg(value_enum)]
        page: PageName,
    },
    /// Print a shell completion script
    Completions {
        /// Shell to complete for
        shell: clap_complete::Shell,
    },
    /// Print the manual page (roff)
    Man,
}

/// Runs a command.
///
/// * `line`: the command line as given.
pub(crate) fn run(cli: &Cli, line: &[OsString]) -> Result<ExitCode, Failure> {
    let terminal = &cli.terminal;
    match &cli.command {
        Command::Compare(args) => simulate::run(terminal, args, true, line),
        Command::Run(args) => simulate::run(terminal, args, false, line),
        Command::Inspect(args) => inspect::inspect(terminal, args),
        Command::Check(args) => inspect::check(terminal, args),
        Command::Motion(args) => motion::run(terminal, args),
        Command::Identify(args) => identify::run(terminal, args),
        Command::Compensate(args) => compensate::run(terminal, args),
        Command::Sensitivity(args) => sensitivity::run(terminal, args),
        Command::Map(args) => map::run(terminal, args),
        Command::Sweep(args) => sweep::run(terminal, args),
        Command::New(args) => new::run(terminal, args),
        Command::Statics(args) => posed::statics(terminal, args),
        Command::Modes(args) => posed::modes(terminal, args),
        Command::Response(args) => posed::response(terminal, args),
        Command::Lobes(args) => lobes::run(terminal, args),
        Command::Report(args) => report::run(terminal, args),
        Command::Convert(args) => convert::run(terminal, args),
        Command::Reduce(args) => reduce::run(terminal, args),
        Command::Import(args) => exchange::import(terminal, args),
        Command::Export(args) => exchange::export(terminal, args),
        Command::ExportFmu(args) => fmu::run(terminal, args),
        Command::View(args) => view::run(terminal, args),
        #[cfg(not(target_family = "wasm"))]
        Command::Serve(args) => serve::run(terminal, args),
        // Pages and scripts that are only printed.
        Command::Format { page } => Ok(written(terminal, "page", page.text().into())),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut Cli::command(), "flexarm", &mut script);
            Ok(written(terminal, "script", script))
        }
        Command::Man => {
            let mut page = Vec::new();
            clap_mangen::Man::new(Cli::command()).render(&mut page).expect("memory takes what is written");
            Ok(written(terminal, "page", page))
        }
    }
}
