//! `flexarm compensate`: finds a motion with which the flexible arm's TCP follows the rigid one's.
//!
//! [`run`] turns flags into a request, [`text`] prints errors before and after (mm). Not here: the
//! inverse model and input shapers (`flexarm::compensate`).

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use flexarm::RunOptions;
use flexarm::compensate::{
    CompensateRequest, Compensation, ErrorFigures, LimitRule, Method, ShaperKind, Shaping, compensate_motion,
};

use crate::args::{ModellingArgs, RobotArgs, word_of};
use crate::failure::Failure;
use crate::layout::{lines, table};
use crate::motion::MotionInputArgs;
use crate::print::file_lines;
use crate::shipped::OutputFolder;
use crate::terminal::{Terminal, answer, to_json, working};

const EXAMPLES: &str = "\
Examples:
  The motion with which the tool of kr210 follows the rigid arm:
      flexarm compensate kr210 pick_and_place
  Sag alone, and the position of the tool alone:
      flexarm compensate kr210 pick_and_place --method static --components x,y,z
  Under the force of a cutter, as JointTrajectory besides:
      flexarm compensate kr210 milling_square --method static --loads cut.toml \\
          --write compensated.yaml
  Found with one model, judged with another:
      flexarm compensate my_robot motion.csv --plant my_other_robot
  The result on the arm, as any motion:
      flexarm compare kr210 out/kr210_compensated-001/compensated.csv";

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum ShaperName {
    /// Two copies half a period apart
    Zv,
    /// Three copies: robust against frequency errors, twice as long
    Zvd,
    /// Minimises the residual vibration of all modes that the motion excites, within --delay, for
    /// frequency errors up to --band
    Optimal,
}

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct CompensateArgs {
    /// robot.toml, a folder with one, or the name of a shipped robot
    pub(crate) robot: PathBuf,
    /// Motion of any format (flexarm format motion), or the name of a shipped one [default: the
    /// robot's own]
    pub(crate) motion: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) input: MotionInputArgs,
    /// Method of compensation
    #[arg(long, value_parser = word_of::<Method>(), default_value = "dynamic")]
    pub(crate) method: Method,
    /// Components of the TCP error to correct, of x, y, z, rx, ry, rz (world axes) [default: all]
    #[arg(long, value_name = "X,Y,...", value_delimiter = ',')]
    pub(crate) components: Vec<String>,
    /// Maximum number of iterations
    #[arg(long, value_name = "N", default_value_t = 5)]
    pub(crate) iterations: usize,
    /// Highest frequency to correct (Hz) [default: up to the limit of the arm's inversion]
    #[arg(long, value_name = "HZ")]
    pub(crate) cutoff: Option<f64>,
    /// Filter the motion first by an input shaper for the modes at its end
    #[arg(long, value_enum)]
    pub(crate) shape: Option<ShaperName>,
    /// Maximum delay of the optimal shaper (s) [default: a period of the first mode]
    #[arg(long, value_name = "S")]
    pub(crate) delay: Option<f64>,
    /// Relative frequency error that the optimal shaper tolerates [default: 0.1]
    #[arg(long, value_name = "PART")]
    pub(crate) band: Option<f64>,
    /// File of loads and payloads over time that act on the arm, such as process forces (TOML, see
    /// docs/loads.md)
    #[arg(long, value_name = "FILE")]
    pub(crate) loads: Option<PathBuf>,
    /// Response to commands that exceed a limit of position, velocity, acceleration or torque which
    /// the motion itself respects
    #[arg(long, value_parser = word_of::<LimitRule>(), default_value = "slow")]
    pub(crate) limits: LimitRule,
    /// Maximum acceleration of each joint in order (rad/s² or m/s²) [default: not checked]
    #[arg(long, value_name = "A1,A2,...", value_delimiter = ',', allow_hyphen_values = true)]
    pub(crate) accelerations: Vec<f64>,
    /// Another robot to evaluate on, with stiffness, links or drives that the first does not model
    #[arg(long, value_name = "ROBOT")]
    pub(crate) plant: Option<PathBuf>,
    /// Skip the evaluation on plants with perturbed stiffness, damping and drives
    #[arg(long)]
    pub(crate) no_sweep: bool,
    /// Step size of the simulation (s)
    #[arg(long, value_name = "S", default_value_t = 1e-3)]
    pub(crate) step: f64,
    #[command(flatten)]
    pub(crate) modelling: ModellingArgs,
    #[command(flatten)]
    pub(crate) load: RobotArgs,
    /// Folder of the new motion and the page [default: a new one in out/]
    #[arg(short, long, help_heading = "Files", value_name = "FOLDER")]
    pub(crate) output: Option<PathBuf>,
    /// Also write the new motion to this file, format by extension: .csv (samples), .toml, .yaml or
    /// .json (JointTrajectory of ROS); may be repeated
    #[arg(long, help_heading = "Files", value_name = "FILE")]
    pub(crate) write: Vec<PathBuf>,
    /// Do not record the arm before and after
    #[arg(long, help_heading = "Files")]
    pub(crate) no_recording: bool,
    /// Write no files
    #[arg(long, help_heading = "Files", conflicts_with_all = ["output", "write"])]
    pub(crate) no_files: bool,
    /// Overwrite existing files
    #[arg(long, help_heading = "Files")]
    pub(crate) force: bool,
}

const COMPONENTS: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];

fn components(words: &[String]) -> Result<[bool; 6], Failure> {
    if words.is_empty() {
        return Ok([true; 6]);
    }
    let mut chosen = [false; 6];
    for word in words {
        let k = COMPONENTS.iter().position(|name| name == word);
        let k = k.ok_or_else(|| Failure::Usage(format!("--components {word:?}: expected some of {COMPONENTS:?}")))?;
        chosen[k] = true;
    }
    Ok(chosen)
}

fn shaping(args: &CompensateArgs) -> Result<Option<Shaping>, Failure> {
    let optimal = matches!(args.shape, Some(ShaperName::Optimal));
    for (flag, given) in [("--delay", args.delay.is_some()), ("--band", args.band.is_some())] {
        if given && !optimal {
            return Err(Failure::Usage(format!("{flag} is for --shape optimal alone: the others have their own")));
        }
    }
    Ok(args.shape.map(|shape| match shape {
        ShaperName::Zv => ShaperKind::Zv.into(),
        ShaperName::Zvd => ShaperKind::Zvd.into(),
        ShaperName::Optimal => Shaping::Optimal { delay_s: args.delay, band: args.band.unwrap_or(Shaping::BAND) },
    }))
}

pub(crate) fn run(terminal: &Terminal, args: &CompensateArgs) -> Result<ExitCode, Failure> {
    let robot = args.load.load(&args.robot)?;
    let scenario = args.input.scenario(&robot, args.motion.as_deref(), args.loads.as_deref())?;
    // The robot that is commanded, if it differs from the one that is known.
    let plant = match &args.plant {
        Some(given) => {
            let plant = args.load.load(given)?;
            Some((plant.name.clone(), plant))
        }
        None => None,
    };
    let shaper = shaping(args)?;
    let folder = OutputFolder::of(args.output.as_deref(), &format!("{}_compensated", robot.name), !args.no_files)?;
    let request = CompensateRequest {
        modelling: args.modelling.modelling(),
        run: RunOptions { step_s: args.step, ..RunOptions::default() },
        method: args.method,
        components: components(&args.components)?,
        iterations: args.iterations,
        cutoff_hz: args.cutoff,
        shaper,
        plant,
        sweep: !args.no_sweep,
        accelerations: args.accelerations.clone(),
        limits: args.limits,
        output: folder.path(),
        motions: args.write.clone(),
        recording: !args.no_recording,
        overwrite: args.force,
    };
    let found = working(terminal, "compensating", || compensate_motion(&robot, scenario, &request))?;
    crate::print::caveats(terminal, &found.caveats);
    answer(terminal, || to_json(&found), || text(&found));
    Ok(ExitCode::SUCCESS)
}

/// Lists the modes that the motion excites, and their residual vibration after the shaper.
fn shaper_text(found: &Compensation) -> String {
    let Some(shaper) = &found.shaper else { return String::new() };
    let mut t = table(&["mode Hz", "damping ratio", "swings behind the motion mm", "shaped mm"]);
    for mode in &shaper.modes {
        t.add_row(vec![
            format!("{:.2}", mode.frequency_hz),
            format!("{:.4}", mode.damping_ratio),
            format!("{:.4}", 1e3 * mode.before_m),
            format!("{:.4}", 1e3 * mode.after_m),
        ]);
    }
    format!("{}\n\n", lines(&t))
}

/// Lists the errors before and after, on the arm and on the other plants.
fn plants_text(found: &Compensation) -> String {
    let mut t = table(&["mm", "peak before", "after", "RMS before", "after", "taken away", "end before", "after"]);
    let mut row = |name: &str, before: &ErrorFigures, after: &ErrorFigures| {
        let mm = |x: f64| format!("{:.4}", 1e3 * x);
        t.add_row(vec![
            name.to_owned(),
            mm(before.peak_m),
            mm(after.peak_m),
            mm(before.rms_m),
            mm(after.rms_m),
            before.reduction_to(after),
            mm(before.end_m),
            mm(after.end_m),
        ]);
    };
    row("as given", &found.before, &found.after);
    found.plants.iter().for_each(|plant| row(&plant.plant, &plant.before, &plant.after));
    lines(&t)
}

/// Formats a compensation: method, peaks, limits, files.
fn text(found: &Compensation) -> String {
    let mut out =
        format!("{} on {}: {} method, {} iterations", found.motion, found.robot, found.method, found.iterations);
    if let Some(hz) = found.cutoff_hz {
        out += &format!(", up to {hz:.1} Hz");
    }
    if found.shaper_delay_s > 0.0 {
        out += &format!("; the shaper takes {:.3} s", found.shaper_delay_s);
    }
    out += "\n\n";
    out += &shaper_text(found);
    out += &plants_text(found);
    // Iterations on the model, and what limits cost.
    let peaks: Vec<String> = found.model_peaks_m.iter().map(|peak| format!("{:.4}", 1e3 * peak)).collect();
    out += &format!("\npeak on the model after each iteration (mm): {}\n", peaks.join(", "));
    if found.slowed > 1.0 {
        out += &format!("the motion takes {:.4} times as long, so that limits are kept\n", found.slowed);
    }
    for limit in &found.limits {
        out += &format!("limit passed: {}\n", limit.message);
    }
    for file in &found.files {
        out += &format!("motion   {file}\n");
    }
    if let Some(program) = &found.program {
        out += &format!(
            "program: {} of {} targets corrected; at rest the tool is off by up to {:.4} mm before and {:.6} mm after\n",
            program.corrected,
            program.targets,
            1e3 * program.before_m,
            1e3 * program.residual_m
        );
        program.files.iter().for_each(|file| out += &format!("program  {file}\n"));
    }
    out += &file_lines(8, &[("motion", &found.file), ("view", &found.recording), ("page", &found.page)]);
    out
}
