//! `flexarm report`: arguments and answer.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use flexarm::report::{ReportFiles, ReportOptions};

use crate::failure::Failure;
use crate::terminal::{Terminal, answer, to_json, working};

const EXAMPLES: &str = "\
Examples:
  The page of a run again, from its recording, with figures for a paper:
      flexarm report out/run.mcap -o again/report.html --figures
  Two runs in one page:
      flexarm report out/before out/after -o compared.html";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ReportArgs {
    #[arg(required = true, value_name = "RECORDING", help = crate::formats::help_report())]
    pub(crate) recordings: Vec<PathBuf>,
    /// Page to write [default: report.html next to the first recording]
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Also write a folder "figures" for papers next to the page
    #[arg(long)]
    pub(crate) figures: bool,
    /// Overwrite existing files
    #[arg(long)]
    pub(crate) force: bool,
}

pub(crate) fn run(terminal: &Terminal, args: &ReportArgs) -> Result<ExitCode, Failure> {
    let options = ReportOptions { output: args.output.clone(), figures: args.figures, overwrite: args.force };
    let files = working(terminal, "drawing the report", || flexarm::report::report(&args.recordings, &options))?;
    crate::print::warnings(terminal, &files.warnings);
    answer(terminal, || to_json(&files), || text(&files));
    Ok(ExitCode::SUCCESS)
}

fn text(files: &ReportFiles) -> String {
    let mut out = format!("report   {}\n", files.report);
    if let Some(folder) = &files.figures {
        out += &format!("figures  {folder}\n");
    }
    out
}
