//! `flexarm convert`: arguments and table.
//!
//! Start at [`run`]. Not here: words of the formats (`formats.rs`), the conversion (`flexarm`).

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use flexarm::recordings::{ConvertOptions, ConvertSummary, RecordingFormat, parse_recording_format};

use crate::failure::Failure;
use crate::formats;
use crate::terminal::{Terminal, answer, to_json, working};

const EXAMPLES: &str = "\
Examples:
  A table for pandas or a spreadsheet, from a recording for viewers:
      flexarm convert out/run.mcap run.parquet
      flexarm convert out/run.mcap run.csv
  The Rerun view of a run recorded as MCAP only (needs the feature rerun):
      flexarm convert out/run.mcap run.rrd
  What a killed run left, as a whole file:
      flexarm convert out/run.mcap whole.mcap";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ConvertArgs {
    #[arg(value_name = "IN", help = formats::help_input())]
    pub(crate) input: PathBuf,
    /// Recording to write, format by extension
    #[arg(value_name = "OUT")]
    pub(crate) output: PathBuf,
    #[arg(long, value_name = "FORMAT", value_parser = parse_recording_format, help = formats::help_from())]
    pub(crate) from: Option<RecordingFormat>,
    /// Format of OUT, regardless of its extension
    #[arg(long, value_name = "FORMAT", value_parser = parse_recording_format)]
    pub(crate) to: Option<RecordingFormat>,
    /// Overwrite OUT
    #[arg(long)]
    pub(crate) force: bool,
}

pub(crate) fn run(terminal: &Terminal, args: &ConvertArgs) -> Result<ExitCode, Failure> {
    let options = ConvertOptions { from: args.from, to: args.to, overwrite: args.force };
    let summary = convert(terminal, &args.input, &args.output, &options)?;
    crate::print::warnings(terminal, &summary.warnings);
    answer(terminal, || to_json(&summary), || text(&summary));
    Ok(ExitCode::SUCCESS)
}

/// Converts a recording until the command is stopped.
pub(crate) fn convert(
    terminal: &Terminal,
    input: &Path,
    output: &Path,
    options: &ConvertOptions,
) -> Result<ConvertSummary, flexarm::Error> {
    let mut stop = crate::signals::stop_when_asked();
    working(terminal, "converting", || flexarm::recordings::convert_until(input, output, options, &mut |_| stop()))
}

fn text(summary: &ConvertSummary) -> String {
    let mut out = format!("{} -> {}\n", summary.input, summary.output);
    let mut table = crate::layout::table::<&str>(&[]);
    table.add_row(["samples", &summary.samples.to_string()]);
    table.add_row(["duration", &format!("{:.3} s", summary.duration_s)]);
    out += &crate::layout::lines(&table);
    for sentence in &summary.lost {
        out += &format!("lost: {sentence}\n");
    }
    out
}
