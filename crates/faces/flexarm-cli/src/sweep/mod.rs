//! `flexarm sweep`: studies of many runs, their shards, and their results.
//!
//! [`run`] chooses between a study, `merge` of its shards, and `plan` (`plan.rs`). Not here:
//! samples, indices and files of a study (`flexarm::sweep`).

pub(crate) mod plan;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use clap::{Args, Subcommand};
use flexarm::settings::written::visible;
use flexarm::sweep::{
    BestRun, Finders, MetricFigures, ParameterFigures, ParameterRole, ParameterValue, Replay, Shard, Sweep, SweepError,
    SweepRequest, SweepSummary, merge,
};

use self::plan::PlanArgs;
use crate::failure::Failure;
use crate::layout::{lines, table};
use crate::print::warnings;
use crate::terminal::{Bar, Terminal, answer_as_is, readable, to_json};
use crate::{shipped, signals};

const EXAMPLES: &str = "\
Examples:
  All runs of a study on all cores; after a stop the same command continues:
      flexarm sweep payload_speed.toml
  A quarter of them here, the others elsewhere, and all of them joined:
      flexarm sweep payload_speed.toml --shard 1/4 -o shard1
      flexarm sweep merge payload_speed.toml shard1 shard2 shard3 shard4 -o all
  Eight shards for HyperQueue, as scripts:
      flexarm sweep plan payload_speed.toml -n 8 --engine hyperqueue
The file of a study: flexarm format study";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES, args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(crate) struct SweepArgs {
    #[command(subcommand)]
    pub(crate) command: Option<SweepCommand>,
    #[command(flatten)]
    pub(crate) run: SweepRunArgs,
}

#[derive(Debug, Args)]
pub(crate) struct SweepRunArgs {
    /// The study: parameters and metrics (.toml)
    #[arg(required = true)]
    pub(crate) study: Option<PathBuf>,
    /// Run only this shard of the runs, number/count
    #[arg(long, value_name = "I/N", value_parser = parse_shard)]
    pub(crate) shard: Option<Shard>,
    /// Number of concurrent runs [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) threads: Option<u16>,
    /// Folder of the results; existing results of the same study are not run again [default: out/
    /// and the name of the study]
    #[arg(short, long, help_heading = "Files", value_name = "FOLDER")]
    pub(crate) output: Option<PathBuf>,
    /// Replace results of another study in the folder
    #[arg(long, help_heading = "Files")]
    pub(crate) force: bool,
}

#[derive(Debug, Subcommand)]
pub(crate) enum SweepCommand {
    /// Write the scripts with which Slurm, HyperQueue or a shell runs the shards of a study
    Plan(PlanArgs),
    /// Merge the results of shards into one table
    Merge(MergeArgs),
}

#[derive(Debug, Args)]
pub(crate) struct MergeArgs {
    /// The study (.toml)
    pub(crate) study: PathBuf,
    /// Folders with the results of its shards
    #[arg(required = true)]
    pub(crate) folders: Vec<PathBuf>,
    /// Folder of the table [default: the first one]
    #[arg(short, long, help_heading = "Files", value_name = "FOLDER")]
    pub(crate) output: Option<PathBuf>,
    /// Replace an existing table
    #[arg(long, help_heading = "Files")]
    pub(crate) force: bool,
}

fn parse_shard(text: &str) -> Result<Shard, String> {
    let pair = text.split_once('/').and_then(|(number, of)| Some((number.parse().ok()?, of.parse().ok()?)));
    match pair {
        Some((number, of)) if (1..=of).contains(&number) => Ok(Shard { number, of }),
        _ => Err(format!("expected a shard and their number, such as 1/4, found {text:?}")),
    }
}

/// Shipped robots and motions by their names.
const FINDERS: Finders = Finders { robot: shipped::robot_file, motion: shipped::trajectory_file };

pub(crate) fn run(terminal: &Terminal, args: &SweepArgs) -> Result<ExitCode, Failure> {
    match (&args.command, &args.run.study) {
        (Some(SweepCommand::Plan(args)), _) => plan::run(terminal, args),
        (Some(SweepCommand::Merge(args)), _) => {
            let sweep = Sweep::load(&args.study, &FINDERS)?;
            let output = args.output.clone().unwrap_or_else(|| args.folders[0].clone());
            let summary = merge(&sweep, &args.folders, &output, args.force, Some(command))?;
            warn(terminal, &summary);
            answer_as_is(terminal, || to_json(&summary), || text(&summary));
            Ok(ExitCode::SUCCESS)
        }
        (None, Some(study)) => sweep(terminal, &args.run, study),
        (None, None) => Err(Failure::Usage("give the file of a study".into())),
    }
}

/// Runs a study, or a shard of it.
fn sweep(terminal: &Terminal, args: &SweepRunArgs, study: &Path) -> Result<ExitCode, Failure> {
    let mut sweep = Sweep::load(study, &FINDERS)?;
    let request = SweepRequest {
        output: args.output.clone().unwrap_or_else(|| Path::new("out").join(clean(sweep.name()))),
        overwrite: args.force,
        shard: args.shard.unwrap_or(Shard::ALL),
        threads: args.threads.map(usize::from),
        command: Some(command),
    };
    let mut stop = signals::stop_when_asked();
    let mut bar = Bar::new(terminal);
    // Every finished run is in a file: nothing is lost if the process ends during another one.
    let counts = Arc::new([AtomicUsize::new(0), AtomicUsize::new(0)]);
    let (seen, folder) = (counts.clone(), request.output.clone());
    let watch = signals::end_if_not_stopped(move || {
        let [done, runs] = [0, 1].map(|k| seen[k].load(Ordering::Relaxed));
        let stopped = SweepError::Stopped { done, runs, folder: folder.clone() };
        let failure = Failure::from(flexarm::Error::from(stopped));
        failure.print();
        failure.exit_code()
    });
    let mut progress = |done: usize, all: usize| -> ControlFlow<()> {
        counts.iter().zip([done, all]).for_each(|(count, n)| count.store(n, Ordering::Relaxed));
        bar.show_as(done as f64, all as f64, || format!("{done} of {all} runs"));
        stop()
    };
    let result = sweep.run(&request, &mut progress);
    drop(watch);
    bar.clear();
    let summary = result?;
    warn(terminal, &summary);
    answer_as_is(terminal, || to_json(&summary), || text(&summary));
    // Some runs of a study may fail; the study fails only if no run succeeds.
    Ok(if summary.failed > 0 && summary.done == 0 { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

fn warn(terminal: &Terminal, summary: &SweepSummary) {
    warnings(terminal, &summary.warnings);
}

/// Returns the command that reproduces a run from its files.
fn command(replay: &Replay) -> String {
    let mut words = vec!["flexarm compare".to_owned(), plan::quoted(&replay.robot)];
    words.extend(replay.motion.as_deref().map(plan::quoted));
    if let Some(loads) = &replay.loads {
        words.push(format!("--loads {}", plan::quoted(loads)));
    }
    for (key, value) in &replay.options {
        let flag = key.replace('_', "-");
        match value {
            ParameterValue::Truth(true) if key == "dispersion_correction" => {}
            ParameterValue::Truth(false) if key == "dispersion_correction" => {
                words.push("--no-dispersion-correction".into())
            }
            ParameterValue::Truth(true) => words.push(format!("--{flag}")),
            ParameterValue::Truth(false) => {}
            other => words.push(format!("--{flag} {other}")),
        }
    }
    words.join(" ")
}

/// Turns a name into a valid folder name.
fn clean(name: &str) -> String {
    name.chars().map(|c| if c.is_alphanumeric() || c == '-' || c == '_' { c } else { '_' }).collect()
}

fn text(found: &SweepSummary) -> String {
    let shard = found.shard.as_ref().map_or_else(String::new, |shard| format!(" (shard {shard})"));
    let mut out = format!(
        "{}{shard}: {} of {} runs done, {} failed; {:.1} s, {:.1} s of processor time\n\n",
        found.study, found.done, found.runs, found.failed, found.wall_s, found.cpu_s
    );
    out += &metric_table(&found.metrics);
    out.extend(found.best.as_ref().map(|best| best_lines(best, &found.parameters)));
    for failure in &found.failures {
        out += &format!("\nfailed: {} runs, first {}: {}\n", failure.runs, failure.first, failure.reason);
    }
    if found.doubles > 0 {
        out += &format!("\n{} runs were there twice, with the same result: they count once\n", found.doubles);
    }
    out += "\n";
    let again = found.best.as_ref().and_then(|best| best.command.as_ref());
    for (what, file) in [("runs", Some(&found.file)), ("page", found.page.as_ref())] {
        if let Some(file) = file {
            out += &format!("{what:<8} {file}\n");
        }
    }
    let again = again.map_or_else(String::new, |command| format!("again    {}\n", visible(command)));
    readable(&out) + &again
}

/// Table of the metrics: range, quantiles, mean.
fn metric_table(metrics: &[MetricFigures]) -> String {
    let mut t =
        table(&["metric", "runs", "least", "5 %", "median", "95 %", "largest", "mean", "std", "varies most with"]);
    for metric in metrics {
        let quantile = |k: usize| number(metric.quantiles.map(|q| q[k]));
        t.add_row(vec![
            metric.name.clone(),
            metric.count.to_string(),
            number(metric.min),
            quantile(0),
            quantile(1),
            quantile(2),
            number(metric.max),
            number(metric.mean),
            number(metric.std),
            strongest(metric),
        ]);
    }
    lines(&t)
}

/// Lists the best run with the values of its parameters.
fn best_lines(best: &BestRun, parameters: &[ParameterFigures]) -> String {
    let (most, value) = (best.better.most(), number(Some(best.value)));
    let mut out = format!("\nbest: run {}, {most} {} {value}\n", best.run, best.metric);
    for (name, value) in &best.parameters {
        let role = parameters.iter().find(|parameter| parameter.name == *name).map(|p| p.role);
        out += &match (role, value.number()) {
            (Some(ParameterRole::Factor), Some(x)) => {
                format!("    {name} = {} % of the file\n", number(Some(100.0 * x)))
            }
            (Some(ParameterRole::Offset), Some(x)) => format!("    {name} = the file {x:+}\n"),
            _ => format!("    {name} = {value}\n"),
        };
    }
    out
}

/// Returns the parameter with the largest share in a metric's variance, if the share is
/// statistically significant.
fn strongest(metric: &MetricFigures) -> String {
    match (metric.matters.first(), metric.std) {
        (Some(name), _) => {
            let share = metric.shares.get(name).copied().flatten().unwrap_or(f64::NAN);
            format!("{name} ({:.0} %)", 100.0 * share)
        }
        (None, Some(std)) if std > 0.0 && metric.chance.is_some() => "no significant effect".into(),
        _ => String::new(),
    }
}

/// Formats a number with readable digits.
fn number(x: Option<f64>) -> String {
    match x {
        None => "-".into(),
        Some(0.0) => "0".into(),
        Some(x) if (1e-3..1e5).contains(&x.abs()) => {
            let digits = (4 - x.abs().log10().floor() as i32).clamp(0, 7) as usize;
            format!("{x:.digits$}")
        }
        Some(x) => format!("{x:.4e}"),
    }
}
