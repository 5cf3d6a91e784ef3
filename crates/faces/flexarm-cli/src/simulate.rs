//! `flexarm run` and `compare`: from flags to runs.
//!
//! Start at [`run`]: one run, or a study of several with `--with`. Not here: parsing of variants
//! (`study.rs`), the table of figures (`summary_table.rs`).

use std::ffi::OsString;
use std::process::ExitCode;

use flexarm::runs::Variant;
use flexarm::steppers::{AlphaSettings, ReferenceSettings, SpookSettings, StepperOptions};
use flexarm::{Keep, Modelling, RobotSource, RunOptions, RunRequest, Scenario, sweep::Change};

use crate::args::RunArgs;
use crate::failure::Failure;
use crate::shipped::OutputFolder;
use crate::terminal::{Bar, Terminal, answer_as_is, columns, to_json};
use crate::{formats, print, shipped, signals, study, summary_table};

/// Runs `flexarm run` and `flexarm compare`.
///
/// * `line`: the command line as given.
pub(crate) fn run(
    terminal: &Terminal,
    args: &RunArgs,
    with_twin: bool,
    line: &[OsString],
) -> Result<ExitCode, Failure> {
    if !with_twin && !args.with.is_empty() {
        return Err(Failure::Usage("--with belongs to compare: run has one run only".into()));
    }
    // Every run is loaded before the first one starts.
    let parts = study::parts(args, line)?;
    let variants = parts.iter().map(|part| {
        variant(part.label.clone(), &part.args, with_twin).map_err(|error| match parts.len() {
            1 => error,
            _ => Failure::In { context: format!("run {:?} of the study", part.label), source: Box::new(error) },
        })
    });
    let variants: Vec<Variant> = variants.collect::<Result<_, Failure>>()?;
    let Some(Variant { arm, scenario, options, .. }) = variants.first() else {
        return Err(Failure::Usage("there is nothing to run".into()));
    };
    let stem = format!("{}-{}", arm.robot().name, scenario.motion.name);
    let folder = OutputFolder::of(args.output.as_deref(), &stem, !args.no_files)?;
    let outputs = folder.path().map(|folder| formats::outputs(args, folder)).transpose()?;

    let mut stop = signals::stop_when_asked();
    let mut bar = Bar::new(terminal);
    let mut progress = |t: f64, total: f64| {
        bar.show(t, total);
        stop()
    };
    let result = if variants.len() == 1 {
        let request = RunRequest {
            outputs: outputs.as_ref(),
            progress: Some(&mut progress),
            ..RunRequest::keeping(Keep::Figures)
        };
        arm.simulate_with(scenario, options, request).map(|run| run.summary)
    } else {
        flexarm::runs::compare_study(&variants, outputs.as_ref(), &mut progress).map(|(summary, _)| summary)
    };
    bar.clear();
    let summary = result?;
    print::caveats(terminal, &study::caveats(&summary));
    answer_as_is(terminal, || to_json(&summary), || summary_table::summary(&summary, columns()));
    Ok(ExitCode::SUCCESS)
}

/// Returns arm, motion and options of a run.
fn variant(label: String, args: &RunArgs, with_twin: bool) -> Result<Variant, Failure> {
    // The robot, with values changed by --set, and its arm.
    let path = shipped::robot(args.robot.as_deref())?;
    let (filed, speed) = if args.set.is_empty() {
        (RobotSource::new(&path, &args.load.options()?).load()?, 1.0)
    } else {
        let changed = flexarm::sweep::load_changed(&path, &args.load.options()?, &args.set);
        changed.map_err(|error| Failure::In {
            context: format!("with {}", args.set.iter().map(Change::to_string).collect::<Vec<_>>().join(", ")),
            source: Box::new(error.into()),
        })?
    };
    let modelling = args.modelling.modelling();
    let arm = if modelling == Modelling::default() { filed } else { filed.robot().model(&modelling)? };
    let robot = arm.robot();
    // The motion: given, or that of the robot file; then rounded and slowed down.
    let trajectory = match (&args.trajectory, &robot.default_trajectory) {
        (Some(given), _) => shipped::trajectory(given)?,
        (None, Some(own)) => own.clone(),
        (None, None) => {
            let text = "the robot has no default_trajectory: give a .csv or .toml trajectory after the robot";
            return Err(Failure::Usage(text.into()));
        }
    };
    let motion =
        flexarm::Motion::load_with(&trajectory, robot, &args.motion.options()).map_err(|error| match error {
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
    let motion = if speed == 1.0 { motion } else { motion.scaled(1.0 / speed, &*robot.rigid_model()?)? };
    let scenario = Scenario::new(motion).with_start(args.from_rest);
    let scenario = args.loads.iter().try_fold(scenario, |scenario, path| scenario.with_loads_file(path))?;
    Ok(Variant { label, scenario, options: run_options(args, with_twin), arm })
}

fn run_options(args: &RunArgs, with_twin: bool) -> RunOptions {
    let stepper_options = StepperOptions {
        alpha: AlphaSettings { rho: args.rho_inf, dispersion_correction: !args.no_dispersion_correction },
        spook: SpookSettings { form: args.spook_form, preset: args.spook_preset },
        reference: ReferenceSettings { method: args.reference_method, ..ReferenceSettings::new(args.rtol) },
    };
    RunOptions {
        stepper: (args.stepper.with)(&stepper_options),
        step_s: args.step.unwrap_or(args.stepper.default_step_s),
        log_rate_hz: args.log_rate,
        ignore_limits: args.ignore_limits,
        with_twin,
        settling_band_m: args.settling_band,
        magnification: args.magnify,
        start_ns: args.start_time,
        embed_meshes: args.embed_meshes,
    }
}
