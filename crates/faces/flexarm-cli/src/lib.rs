//! The `flexarm` command line: arguments, progress, tables, exit codes. The crate `flexarm` does
//! the work.
//!
//! Start at [`run`], which the program `flexarm` and the command of the Python package call.
//! [`shipped_robot`] and [`shipped_motion`] find shipped files by name.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "printing is what this face is for")]

mod args;
mod compensate;
mod convert;
mod exchange;
mod exchange_args;
mod failure;
mod flags;
mod fmu;
mod formats;
mod identify;
mod later;
mod lobes;
mod map;
mod motion;
mod new;
mod posed;
mod posed_args;
mod print;
mod reduce;
mod reduce_args;
mod report;
mod sensitivity;
mod shipped;
mod signals;
mod study;
mod summary_table;
mod sweep;
mod values;
mod verify;
mod view;

use std::ffi::OsString;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use args::{CheckArgs, Cli, Command, FormName, InspectArgs, MethodName, PresetName, RobotArgs, RunArgs, StartName};
use clap::error::{ContextKind, ContextValue};
use clap::{CommandFactory, Parser};
use failure::Failure;
use flexarm::written::{message, visible};
use flexarm::{
    AlphaSettings, Arm, ConstraintForm, FlexibleRobot, InertiaEstimate, Keep, LoadOptions, Modelling, ReadOptions,
    ReferenceMethod, ReferenceSettings, Robot, RunOptions, RunRequest, Scenario, SpookPreset, SpookSettings, Start,
    StepperOptions, Variant,
};
use indicatif::{ProgressBar, ProgressStyle};
use shipped::OutputFolder;

/// Runs a command line, program name first, and returns the exit code of the process: 0 success, 1
/// failed run, 2 bad input.
///
/// This function assumes that it owns the process: messages name settings by its flags, and signals
/// stop the current command.
pub fn run(line: Vec<OsString>) -> u8 {
    signals::turn_into_errors();
    flexarm::name_settings(flags::NAMES);
    let code = match Cli::try_parse_from(&line) {
        Ok(cli) => command(&cli, &line).unwrap_or_else(|failure| {
            failure.print();
            failure.exit_code()
        }),
        Err(usage) => {
            let usage = with_visible_words(with_number_tip(usage));
            let _ = usage.print(); // a closed pipe
            return usage.exit_code().try_into().unwrap_or(2);
        }
    };
    [0, 1].into_iter().find(|number| ExitCode::from(*number) == code).unwrap_or(2)
}

/// Escapes control characters in the quoted user input, which a terminal would execute.
fn with_visible_words(mut usage: clap::Error) -> clap::Error {
    let shown = |value: &ContextValue| match value {
        ContextValue::String(text) => Some(ContextValue::String(message(text))),
        ContextValue::Strings(texts) => Some(ContextValue::Strings(texts.iter().map(|text| message(text)).collect())),
        _ => None,
    };
    let typed: Vec<_> = usage.context().filter_map(|(kind, value)| Some((kind, shown(value)?))).collect();
    for (kind, value) in typed {
        usage.insert(kind, value);
    }
    usage
}

/// Adds a hint on the number format if a word was given instead of a number.
fn with_number_tip(mut usage: clap::Error) -> clap::Error {
    let tip = match std::error::Error::source(&usage) {
        Some(cause) if cause.is::<std::num::ParseFloatError>() => {
            "numbers have a decimal point and no unit, such as 500, 0.002 or 2e-3"
        }
        Some(cause) if cause.is::<std::num::ParseIntError>() => "a whole number is expected, such as 8",
        _ => return usage,
    };
    usage.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
    usage
}

/// Adds a folder with `robots/` and `trajectories/` to the places that are searched. Only the first
/// call has an effect.
pub fn ship_from(folder: PathBuf) {
    shipped::ship_from(folder);
}

/// Returns the path of a robot, given by path or by the name of a shipped robot.
///
/// # Errors
/// [`flexarm::Error::File`] for an unknown name; the message lists the known names.
pub fn shipped_robot(given: &Path) -> Result<PathBuf, flexarm::Error> {
    shipped::robot(Some(given))
}

/// Returns the path of a motion, given by path or by shipped name; the path itself if neither
/// exists.
pub fn shipped_motion(given: &Path) -> PathBuf {
    shipped::trajectory_file(given)
}

/// Returns the path of a robot file, given by path or by shipped name; the path itself if neither
/// exists.
pub fn shipped_robot_file(given: &Path) -> PathBuf {
    shipped::robot_file(given)
}

/// Returns the path of a cutting tool file, given by path or by shipped name; the path itself if
/// neither exists.
pub fn shipped_tool(given: &Path) -> PathBuf {
    shipped::find(given, "robots/tools", &["", ".toml"])
}

/// Prints text for people or JSON for programs, with control characters escaped; a closed pipe is
/// not an error.
fn answer(cli: &Cli, json: impl FnOnce() -> String, text: impl FnOnce() -> String) {
    answer_styled(cli, json, || print::plain_zeros(&visible(&text())));
}

/// The same for styled text, whose names are already [`visible`].
fn answer_styled(cli: &Cli, json: impl FnOnce() -> String, text: impl FnOnce() -> String) {
    let out = if cli.json { visible_json(&json()) + "\n" } else { text() };
    // Colours go only to terminals, and not if NO_COLOR is set.
    let mut stdout = anstream::stdout().lock();
    match stdout.write_all(out.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            // A lost answer must not look like success.
            print::complaint("error", &format!("standard output cannot be written: {error}"));
            std::process::exit(1);
        }
        _ => {}
    }
}

/// Escapes the control characters that the JSON writer leaves; they occur only in strings.
fn visible_json(text: &str) -> String {
    let is_left = |c: &char| ('\u{7f}'..='\u{9f}').contains(c);
    let escaped = |c: char| if is_left(&c) { format!("\\u{:04x}", u32::from(c)) } else { c.to_string() };
    if text.chars().any(|c| is_left(&c)) { text.chars().map(escaped).collect() } else { text.to_owned() }
}

/// Prints text generated in memory; in JSON under the given key.
fn written(cli: &Cli, key: &str, bytes: Vec<u8>) -> ExitCode {
    let text = String::from_utf8_lossy(&bytes);
    answer(cli, || to_json(&serde_json::json!({ key: text })), || text.to_string());
    ExitCode::SUCCESS
}

fn to_json(value: &impl serde::Serialize) -> String {
    serde_json::to_string(value).expect("plain numbers and strings")
}

fn command(cli: &Cli, line: &[OsString]) -> Result<ExitCode, Failure> {
    match &cli.command {
        Command::Compare(args) => simulate(cli, args, true, line),
        Command::Run(args) => simulate(cli, args, false, line),
        Command::Inspect(args) => inspect(cli, args),
        Command::Check(args) => check(cli, args),
        Command::Motion(args) => motion::run(cli, args),
        Command::Identify(args) => identify::run(cli, args),
        Command::Compensate(args) => compensate::run(cli, args),
        Command::Sensitivity(args) => sensitivity::run(cli, args),
        Command::Map(args) => map::run(cli, args),
        Command::Sweep(args) => sweep::run(cli, args),
        Command::New(args) => new::run(cli, args),
        Command::Statics(args) => posed::statics(cli, args),
        Command::Modes(args) => posed::modes(cli, args),
        Command::Response(args) => posed::response(cli, args),
        Command::Lobes(args) => lobes::run(cli, args),
        Command::Report(args) => report::run(cli, args),
        Command::Convert(args) => convert::run(cli, args),
        Command::Reduce(args) => reduce::run(cli, args),
        Command::Import(args) => exchange::import(cli, args),
        Command::Export(args) => exchange::export(cli, args),
        Command::ExportFmu(args) => fmu::run(cli, args),
        Command::Verify(args) => verify::run(cli, args),
        Command::View(args) => view::run(cli, args),
        Command::Format { page } => {
            answer(cli, || to_json(&serde_json::json!({ "page": page.text() })), || page.text().to_owned());
            Ok(ExitCode::SUCCESS)
        }
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut Cli::command(), "flexarm", &mut script);
            Ok(written(cli, "script", script))
        }
        Command::Man => {
            let mut page = Vec::new();
            clap_mangen::Man::new(Cli::command()).render(&mut page).expect("memory takes what is written");
            Ok(written(cli, "page", page))
        }
    }
}

fn load_options(args: &RobotArgs) -> Result<LoadOptions, Failure> {
    let mut urdf = ReadOptions { search_paths: flexarm::search_paths_from_environment(), ..ReadOptions::default() };
    for package in &args.packages {
        let (name, folder) = package
            .split_once('=')
            .ok_or_else(|| Failure::Usage(format!("--package {package:?}: expected NAME=FOLDER")))?;
        urdf.packages.push((name.to_owned(), folder.into()));
    }
    for argument in &args.arguments {
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
    if let Some(density) = args.inertia_from_density {
        urdf.inertia_from_mesh = Some(InertiaEstimate::Density(positive(density, "--inertia-from-density")?));
    }
    if let Some(mass) = args.inertia_from_total_mass {
        urdf.inertia_from_mesh = Some(InertiaEstimate::TotalMass(positive(mass, "--inertia-from-total-mass")?));
    }
    urdf.waive.extend(args.waive_inertia.iter().cloned());
    Ok(LoadOptions { tcp: args.tcp.clone(), urdf })
}

fn run_options(args: &RunArgs, with_twin: bool) -> RunOptions {
    let stepper_options = StepperOptions {
        alpha: AlphaSettings { rho: args.rho_inf, dispersion_correction: !args.no_dispersion_correction },
        spook: SpookSettings {
            form: if args.spook_form == FormName::Local { ConstraintForm::Local } else { ConstraintForm::Global },
            preset: if args.spook_preset == PresetName::Exact { SpookPreset::Exact } else { SpookPreset::Source },
        },
        reference: ReferenceSettings {
            method: match args.reference_method {
                MethodName::Bdf => ReferenceMethod::Bdf,
                MethodName::Esdirk34 => ReferenceMethod::Esdirk34,
                MethodName::Tsit45 => ReferenceMethod::Tsit45,
            },
            ..ReferenceSettings::new(args.rtol)
        },
    };
    RunOptions {
        stepper: (args.stepper.with)(&stepper_options),
        step_s: args.step.unwrap_or(args.stepper.default_step_s),
        modelling: args.modelling.modelling(),
        log_rate_hz: args.log_rate,
        ignore_limits: args.ignore_limits,
        with_twin,
        settling_band_m: args.settling_band,
        magnification: args.magnify,
        start_ns: args.start_time,
        embed_meshes: args.embed_meshes,
    }
}

/// Returns robot, motion and options of a run, and the robot modelled as its file specifies.
fn variant(label: String, args: &RunArgs, with_twin: bool) -> Result<(Variant, FlexibleRobot), Failure> {
    let (robot, as_filed) = Robot::load_modelled(&shipped::robot(args.robot.as_deref())?, &load_options(&args.load)?)?;
    let trajectory = match (&args.trajectory, &robot.default_trajectory) {
        (Some(given), _) => shipped::trajectory(given)?,
        (None, Some(own)) => own.clone(),
        (None, None) => {
            let text = "the robot has no default_trajectory: give a .csv or .toml trajectory after the robot";
            return Err(Failure::Usage(text.into()));
        }
    };
    let motion =
        flexarm::Motion::load_with(&trajectory, &robot, &args.motion.options()).map_err(|error| match error {
            flexarm::Error::File { path, what } if args.trajectory.is_none() => {
                let what = format!("{what} (it is the default_trajectory of {})", robot.path.display());
                flexarm::Error::File { path, what }
            }
            other => other,
        })?;
    let motion = match args.round_corners {
        Some(seconds) => motion.with_rounded_corners(seconds, &*robot.rigid_model()?)?,
        None => motion,
    };
    let start = if args.from_rest == StartName::Equilibrium { Start::Equilibrium } else { Start::Undeformed };
    let scenario = Scenario::new(motion).with_start(start);
    let scenario = args.loads.iter().try_fold(scenario, |scenario, path| scenario.with_loads_file(path))?;
    Ok((Variant { label, robot, scenario, options: run_options(args, with_twin) }, as_filed))
}

/// `line`: the command line as given.
fn simulate(cli: &Cli, args: &RunArgs, with_twin: bool, line: &[OsString]) -> Result<ExitCode, Failure> {
    if !with_twin && !args.with.is_empty() {
        return Err(Failure::Usage("--with belongs to compare: run has one run only".into()));
    }
    let parts = study::parts(args, line)?;
    let variants = parts.iter().map(|part| {
        variant(part.label.clone(), &part.args, with_twin).map_err(|error| match parts.len() {
            1 => error,
            _ => Failure::InStudy { label: part.label.clone(), source: Box::new(error) },
        })
    });
    let (variants, mut as_filed): (Vec<Variant>, Vec<FlexibleRobot>) =
        variants.collect::<Result<Vec<_>, Failure>>()?.into_iter().unzip();
    let Some(Variant { robot, scenario, options, .. }) = variants.first() else {
        return Err(Failure::Usage("there is nothing to run".into()));
    };
    let stem = format!("{}-{}", robot.name, scenario.motion.name);
    let folder = OutputFolder::of(args.output.as_deref(), &stem, !args.no_files)?;
    let outputs = folder.path().map(|folder| formats::outputs(args, folder)).transpose()?;

    let mut stop = signals::stop_when_asked();
    let mut bar = Bar::new(cli);
    let mut progress = |t: f64, total: f64| {
        bar.show(t, total);
        stop()
    };
    let as_filed = as_filed.pop().filter(|_| options.modelling == Modelling::default());
    let result = if variants.len() == 1 {
        let arm = match as_filed {
            Some(flexible) => Ok(Arm::new(robot.clone(), options.modelling, flexible)),
            None => robot.flexible(options.modelling),
        };
        let request = RunRequest {
            outputs: outputs.as_ref(),
            progress: Some(&mut progress),
            ..RunRequest::keeping(Keep::Figures)
        };
        arm.and_then(|arm| arm.simulate_with(scenario, options, request)).map(|run| run.summary)
    } else {
        flexarm::compare_study(&variants, outputs.as_ref(), &mut progress).map(|(summary, _)| summary)
    };
    bar.clear();
    let summary = result?;
    print::caveats(cli, &study::caveats(&summary));
    answer_styled(cli, || to_json(&summary), || summary_table::summary(&summary, summary_table::terminal_width()));
    Ok(ExitCode::SUCCESS)
}

fn inspect(cli: &Cli, args: &InspectArgs) -> Result<ExitCode, Failure> {
    let robot = Robot::load_with(&shipped::robot(Some(&args.robot))?, &load_options(&args.load)?)?;
    let at = values::pose(args.at.as_deref(), &robot)?;
    let velocity = values::joint_values(args.velocity.as_deref(), &robot)?;
    let inspection = flexarm::inspect(&robot, at.as_deref(), velocity.as_deref())?;
    if !cli.quiet {
        inspection.warnings.iter().for_each(|text| print::warning(text));
    }
    answer(cli, || to_json(&inspection), || print::inspection(&inspection));
    Ok(ExitCode::SUCCESS)
}

fn check(cli: &Cli, args: &CheckArgs) -> Result<ExitCode, Failure> {
    let trajectory = args.trajectory.as_deref().map(shipped::trajectory).transpose()?;
    let robot = shipped::robot(Some(&args.robot))?;
    let (motion, options) = (args.motion.options(), load_options(&args.load)?);
    let loads = args.loads.as_deref();
    let findings = flexarm::check_with_motion(&robot, trajectory.as_deref(), &motion, loads, &options);
    let json = || serde_json::json!({ "findings": findings }).to_string();
    answer(cli, json, || print::findings(&findings));
    let wrong = findings.iter().any(|f| f.severity == "error");
    Ok(if wrong { ExitCode::from(2) } else { ExitCode::SUCCESS })
}

/// A progress bar that appears only on a terminal and only for runs longer than two seconds.
struct Bar {
    bar: Option<ProgressBar>,
    wanted: bool,
    started: Instant,
}

impl Bar {
    fn new(cli: &Cli) -> Self {
        Self { bar: None, wanted: !cli.quiet && std::io::stderr().is_terminal(), started: Instant::now() }
    }

    fn show(&mut self, t: f64, total: f64) {
        self.show_as(t, total, || format!("{t:.2} of {total:.2} s simulated"));
    }

    fn show_as(&mut self, t: f64, total: f64, message: impl FnOnce() -> String) {
        if !self.wanted {
            return;
        }
        if self.bar.is_none() && self.started.elapsed() > Duration::from_secs(1) && t < 0.5 * total {
            let style = ProgressStyle::with_template("{msg} {wide_bar} {percent}% {eta} left");
            let bar = ProgressBar::new(1000).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            self.bar = Some(bar);
        }
        if let Some(bar) = &self.bar {
            bar.set_message(message());
            bar.set_position((1000.0 * t / total.max(1e-9)) as u64);
        }
    }

    fn clear(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
