//! `flexarm export-fmu`: from flags to an FMU.
//!
//! The library in an FMU is the one beside the program. Not here: the file (`flexarm-fmu`).

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use flexarm::steppers::{STEPPERS, StepRule, StepperEntry, StepperOptions};
use flexarm_fmu::{Fmi, FmuJob, FmuSettings, FmuSummary, export_fmu};

use crate::args::stepper_words;
use crate::failure::Failure;
use crate::posed_args::PoseArgs;
use crate::terminal::{Terminal, answer, to_json};
use crate::{print, shipped, values};

const EXAMPLES: &str = "\
Examples:
  The shipped arm for FMI 3.0, as kr210.fmu:
      flexarm export-fmu kr210
  For FMI 2.0, with servos, in a working pose, in steps of 0.5 ms:
      flexarm export-fmu my_arm --fmi 2.0 --drives servo \\
          --at 0,-60deg,60deg,0,0,0 --step 5e-4
  Simulated by FMPy (pip install fmpy), which draws the outputs:
      fmpy simulate kr210.fmu --show-plot";

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum FmiName {
    #[value(name = "2.0", alias = "2")]
    V2,
    #[value(name = "3.0", alias = "3")]
    V3,
}

#[derive(Debug, Args)]
#[command(after_long_help = EXAMPLES, after_help = "More, with examples: flexarm export-fmu --help")]
pub(crate) struct ExportFmuArgs {
    #[command(flatten)]
    pub(crate) pose: PoseArgs,
    /// Version of the standard
    #[arg(long, value_enum, default_value_t = FmiName::V3)]
    pub(crate) fmi: FmiName,
    /// Time stepper, one with a fixed step size
    #[arg(long, help_heading = "Stepper", value_parser = stepper_words(), default_value = STEPPERS[0].name)]
    pub(crate) stepper: &'static StepperEntry,
    /// Step size of the stepper (s) [default: the stepper's own]
    #[arg(long, help_heading = "Stepper", value_name = "SECONDS", allow_hyphen_values = true)]
    pub(crate) step: Option<f64>,
    /// The FMU to write [default: the name of the robot and .fmu]
    #[arg(short, long, value_name = "FILE", help_heading = "Files")]
    pub(crate) output: Option<PathBuf>,
    /// Overwrite an existing file
    #[arg(long, help_heading = "Files")]
    pub(crate) force: bool,
    /// Library that the FMU contains [default: the one built with this program]
    #[arg(long, value_name = "FILE", help_heading = "Files", hide_short_help = true)]
    pub(crate) library: Option<PathBuf>,
}

pub(crate) fn run(terminal: &Terminal, args: &ExportFmuArgs) -> Result<ExitCode, Failure> {
    if args.stepper.steps == StepRule::ByErrorControl {
        let text = format!("--stepper {}: an FMU needs a stepper with a fixed step size", args.stepper.name);
        return Err(Failure::Usage(text));
    }
    let (path, load) = (shipped::robot(Some(&args.pose.robot))?, args.pose.load.options()?);
    let robot = args.pose.load.load(&path)?;
    let settings = FmuSettings {
        load,
        modelling: args.pose.modelling.modelling(),
        stepper: (args.stepper.with)(&StepperOptions::default()),
        step_s: args.step,
        pose: Some(values::joint_values(args.pose.at.as_deref(), &robot)?.map_or_else(|| robot.start_pose(), Ok)?),
    };
    let fmi = if args.fmi == FmiName::V2 { Fmi::V2 } else { Fmi::V3 };
    let library = match &args.library {
        Some(library) => library.clone(),
        None => built_library()?,
    };
    let output = args.output.clone().unwrap_or_else(|| format!("{}.fmu", file_stem(&robot.name)).into());
    let job = FmuJob { robot: path, settings, fmi, library, output, overwrite: args.force };
    let summary = export_fmu(&job)?;
    print::caveats(terminal, &summary.caveats);
    answer(terminal, || to_json(&summary), || text(&summary));
    Ok(ExitCode::SUCCESS)
}

/// Returns a name with characters that every file system takes.
fn file_stem(name: &str) -> String {
    name.chars().map(|c| if c.is_alphanumeric() || c == '-' || c == '_' { c } else { '_' }).collect()
}

/// Returns the library that was built with the program: beside it, among its dependencies, in the
/// folder `lib`, or among the files that come with it.
fn built_library() -> Result<PathBuf, Failure> {
    use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
    let name = format!("{DLL_PREFIX}flexarm_fmu{DLL_SUFFIX}");
    let program = std::env::current_exe().unwrap_or_default();
    let places = ["", "deps", "../lib"].map(|place| program.with_file_name(place).join(&name));
    let beside = places.into_iter().find(|place| place.is_absolute() && place.is_file());
    beside.or_else(|| shipped::library(&name)).ok_or_else(|| {
        Failure::Usage(format!(
            "{name}, the library that an FMU contains, is not beside the program {}: build it with cargo build \
             --release -p flexarm-fmu, or give it with --library",
            program.display()
        ))
    })
}

fn text(summary: &FmuSummary) -> String {
    let exchange = if summary.states > 0 { " and model exchange" } else { "" };
    let mut out = format!(
        "{}: FMI {} for co-simulation{exchange}, {}, {:.1} MB\n",
        summary.file.display(),
        summary.fmi_version,
        summary.platform,
        summary.bytes as f64 / 1e6
    );
    out += &format!(
        "{} parameters, {} inputs, {} outputs, {} states; solver step {} s\n",
        summary.parameters, summary.inputs, summary.outputs, summary.states, summary.step_s
    );
    if summary.meshes > 0 {
        out += &format!("{} meshes are in it, because masses are computed from them\n", summary.meshes);
    }
    out
}
