//! Arguments of `flexarm statics`, `flexarm modes` and `flexarm response`.
//!
//! Not here: requests and tables (`posed.rs`), values of joints and wrenches (`values.rs`).

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::args::{ModellingArgs, RobotArgs};

const RESPONSE_EXAMPLES: &str = "\
Examples:
  Dynamic compliance of the tool in all directions, table and plot:
      flexarm response kr210 --at 0,-60deg,60deg,0,0,0
  How the tool shakes when joint 2 does, up to 100 Hz, as acceleration:
      flexarm response kr210 --at 0,-60deg,60deg,0,0,0 --input joint_2 \\
          --output x,z --quantity acceleration --from 1 --to 100
  Rotations under moments, figures only:
      flexarm response kr210 --at 0,-60deg,60deg,0,0,0 \\
          --input torque-x,torque-y,torque-z --output rx,ry,rz --no-files

Inputs: force-x, force-y, force-z, torque-x, torque-y, torque-z on the TCP\n(world axes), or names of joints.
Outputs: x, y, z, rx, ry, rz of the TCP (world axes).";

/// A robot at a pose.
#[derive(Debug, Args)]
pub(crate) struct PoseArgs {
    /// robot.toml, a folder with one, a .urdf or .xacro file, or the name of a shipped robot
    pub(crate) robot: PathBuf,
    /// Joint values in coordinate order, or name=value pairs (rad or m; 30deg for degrees)
    /// [default: where the robot's own motion begins, else all zero]
    #[arg(long, value_name = "Q1,Q2,...", allow_hyphen_values = true)]
    pub(crate) at: Option<String>,
    #[command(flatten)]
    pub(crate) modelling: ModellingArgs,
    #[command(flatten)]
    pub(crate) load: RobotArgs,
}

#[derive(Debug, Args)]
pub(crate) struct StaticsArgs {
    #[command(flatten)]
    pub(crate) pose: PoseArgs,
    /// Force and moment on the TCP in addition to gravity, world axes (N, N m)
    #[arg(long, value_name = "FX,FY,FZ[,TX,TY,TZ]", allow_hyphen_values = true)]
    pub(crate) wrench: Option<String>,
    /// Folder for the figures and a picture of the arm with magnified deflections next to the rigid
    /// arm
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) output: Option<PathBuf>,
    /// Overwrite files in the output folder
    #[arg(long, requires = "output")]
    pub(crate) force: bool,
}

#[derive(Debug, Args)]
pub(crate) struct ModesArgs {
    #[command(flatten)]
    pub(crate) pose: PoseArgs,
    /// Modes of the turning arm: speeds of the joints in coordinate order, or name=value pairs (rad/s
    /// or m/s; 500rpm, 30deg per second)
    #[arg(long, value_name = "V1,V2,...", allow_hyphen_values = true)]
    pub(crate) speeds: Option<String>,
    /// Number of modes, from the lowest
    #[arg(long, value_name = "N", default_value_t = 10)]
    pub(crate) count: usize,
    /// Write a recording to this folder that shows one mode after the other
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) output: Option<PathBuf>,
    /// Overwrite files in the output folder
    #[arg(long, requires = "output")]
    pub(crate) force: bool,
    /// Duration of each mode in the recording (s)
    #[arg(long, value_name = "SECONDS", default_value_t = 3.0, requires = "output", allow_hyphen_values = true)]
    pub(crate) seconds: f64,
    /// Amplitude of the TCP in the recording (m) [default: a twentieth of the arm's reach]
    #[arg(long, value_name = "METRES", requires = "output", allow_hyphen_values = true)]
    pub(crate) tool_motion: Option<f64>,
}

#[derive(Debug, Args)]
#[command(after_long_help = RESPONSE_EXAMPLES, after_help = "More, with examples: flexarm response --help")]
pub(crate) struct ResponseArgs {
    #[command(flatten)]
    pub(crate) pose: PoseArgs,
    /// Input: force-x ... torque-z on the TCP, or joints
    #[arg(
        long,
        help_heading = "Response",
        value_name = "NAME,...",
        value_delimiter = ',',
        default_value = "force-x,force-y,force-z"
    )]
    pub(crate) input: Vec<String>,
    /// Output: x, y, z, rx, ry, rz of the TCP
    #[arg(long, help_heading = "Response", value_name = "NAME,...", value_delimiter = ',', default_value = "x,y,z")]
    pub(crate) output: Vec<String>,
    /// Quantity of the outputs
    #[arg(long, help_heading = "Response", hide_short_help = true, value_enum, default_value_t = QuantityName::Displacement)]
    pub(crate) quantity: QuantityName,
    /// Lowest frequency (Hz) [default: a tenth of the first mode's]
    #[arg(long, help_heading = "Response", value_name = "HZ", allow_hyphen_values = true)]
    pub(crate) from: Option<f64>,
    /// Highest frequency (Hz) [default: twice the sixth mode's]
    #[arg(long, help_heading = "Response", value_name = "HZ", allow_hyphen_values = true)]
    pub(crate) to: Option<f64>,
    /// Number of frequencies; more are added around resonances
    #[arg(long, help_heading = "Response", hide_short_help = true, value_name = "N", default_value_t = 500)]
    pub(crate) points: usize,
    /// Spacing of the frequencies
    #[arg(long, help_heading = "Response", hide_short_help = true, value_enum, default_value_t = SpacingName::Log)]
    pub(crate) spacing: SpacingName,
    /// Output folder [default: a new one in out/]
    #[arg(short = 'o', long = "output-folder", help_heading = "Files", value_name = "FOLDER")]
    pub(crate) folder: Option<PathBuf>,
    /// Overwrite files in the output folder
    #[arg(long, help_heading = "Files")]
    pub(crate) force: bool,
    /// Write no files, only print the figures
    #[arg(long, help_heading = "Files", conflicts_with_all = ["folder", "force"])]
    pub(crate) no_files: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum QuantityName {
    /// m, rad
    Displacement,
    /// m/s, rad/s
    Velocity,
    /// m/s², rad/s²
    Acceleration,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum SpacingName {
    /// Equal ratios
    Log,
    /// Equal steps
    Linear,
}
