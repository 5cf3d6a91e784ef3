//! `flexarm lobes`: from flags to a request, and a table for people.
//!
//! Speeds in rpm, depths in mm. Not here: the stability of milling (`flexarm::lobes`).

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use flexarm::Motion;
use flexarm::lobes::{CuttingPlace, CuttingTool, LobePoint, Lobes, LobesRequest, lobes, rounded_down};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::failure::Failure;
use crate::layout::{lines, table};
use crate::posed_args::PoseArgs;
use crate::print::file_lines;
use crate::shipped::OutputFolder;
use crate::terminal::{Terminal, answer, to_json};
use crate::{shipped, values};

const EXAMPLES: &str = "\
Examples:
  Limits of depth of a shipped end mill on kr210, diagram and table:
      flexarm lobes kr210 --at 0,-60deg,90deg,0,60deg,0 --tool endmill_20mm
  The same over other speeds, with all unstable depths, figures alone:
      flexarm lobes kr210 --at 0,-60deg,90deg,0,60deg,0 --tool endmill_20mm \\
          --rpm 2000,2500,3000 --ranges --no-files
  Along a path: the lowest limit over 12 places of it:
      flexarm lobes kr210 --along milling_square --places 12 --tool endmill_20mm
The file of a tool: flexarm format tool";

/// Maximum number of speeds in the table on a terminal.
const SHOWN: usize = 25;

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct LobesArgs {
    #[command(flatten)]
    pub(crate) pose: PoseArgs,
    /// Tool: a .toml file, or the name of a shipped one
    #[arg(long, help_heading = "Cut", value_name = "TOOL")]
    pub(crate) tool: PathBuf,
    /// Evaluate along this motion instead of at one pose: lowest limit over its positions
    #[arg(long, help_heading = "Cut", value_name = "MOTION", conflicts_with = "at")]
    pub(crate) along: Option<PathBuf>,
    /// Number of positions along the motion
    #[arg(long, help_heading = "Cut", value_name = "N", default_value_t = 12, requires = "along")]
    pub(crate) places: usize,
    /// Spindle speeds (1/min) [default: those of the tool's file]
    #[arg(long, help_heading = "Cut", value_name = "RPM,...", value_delimiter = ',', allow_hyphen_values = true)]
    pub(crate) rpm: Vec<f64>,
    /// Maximum depth of cut to examine (m) [default: that of the tool's file]
    #[arg(long, help_heading = "Cut", value_name = "METRES", allow_hyphen_values = true)]
    pub(crate) deepest: Option<f64>,
    /// List all unstable ranges of depth, not only the lowest limit
    #[arg(long, help_heading = "Cut", conflicts_with = "along")]
    pub(crate) ranges: bool,
    /// Output folder [default: a new one in out/]
    #[arg(short, long, help_heading = "Files", value_name = "FOLDER")]
    pub(crate) output: Option<PathBuf>,
    /// Overwrite files in the output folder
    #[arg(long, help_heading = "Files")]
    pub(crate) force: bool,
    /// Write no files, only print the figures
    #[arg(long, help_heading = "Files", conflicts_with_all = ["output", "force"])]
    pub(crate) no_files: bool,
}

/// Loads a tool from a file or a shipped one; `rpm` replaces its speeds unless it is empty.
pub(crate) fn cutting_tool(given: &Path, rpm: &[f64]) -> Result<CuttingTool, Failure> {
    let tool = CuttingTool::load(shipped::tool(given)?)?;
    Ok(if rpm.is_empty() { tool } else { tool.at_speeds(rpm.to_vec()) })
}

pub(crate) fn run(terminal: &Terminal, args: &LobesArgs) -> Result<ExitCode, Failure> {
    let robot = args.pose.load.load(&args.pose.robot)?;
    let tool = cutting_tool(&args.tool, &args.rpm)?;
    let at = values::joint_values(args.pose.at.as_deref(), &robot)?;
    let motion = args.along.as_deref().map(shipped::trajectory).transpose()?;
    let motion = motion.map(|path| Motion::load(path, &robot)).transpose()?;
    let place = match &motion {
        Some(motion) => CuttingPlace::Along(motion, args.places),
        None => CuttingPlace::At(at.as_deref()),
    };
    let folder = OutputFolder::of(args.output.as_deref(), &format!("{}-lobes", robot.name), !args.no_files)?;
    let request = LobesRequest {
        modelling: args.pose.modelling.modelling(),
        deepest_m: args.deepest,
        ranges: args.ranges,
        output: folder.path(),
        overwrite: args.force,
    };
    let bar = progress(terminal);
    let found = lobes(&robot, &tool, &place, &request, &|done, all| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
        true
    });
    bar.finish_and_clear();
    let found = found?;
    crate::print::caveats(terminal, &found.caveats);
    answer(terminal, || to_json(&found), || text(&found));
    Ok(ExitCode::SUCCESS)
}

/// Progress bar over the limits found; only on a terminal.
fn progress(terminal: &Terminal) -> ProgressBar {
    let target =
        if terminal.quiet || terminal.json { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
    let style = ProgressStyle::with_template("{bar:40} {pos} of {len} limits, {eta} left");
    let bar = ProgressBar::with_draw_target(Some(1), target);
    bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

fn mm(x: Option<f64>) -> String {
    x.map_or_else(|| "-".into(), |x| rounded_down(1e3 * x, 3))
}

fn text(found: &Lobes) -> String {
    let mut out = format!("{} on {}: limits of depth, up to {} mm\n", found.tool, found.robot, 1e3 * found.deepest_m);
    out += &match (found.stable_below_m, found.stable_below_at_rpm) {
        (Some(depth), Some(rpm)) => format!(
            "stable at every speed below {} mm (at {rpm:.0} 1/min); deepest at {:.0} 1/min: {} mm\n\n",
            rounded_down(1e3 * depth, 3),
            found.best_rpm,
            rounded_down(1e3 * found.best_depth_m, 3)
        ),
        _ => "no chatter at any of the speeds\n\n".to_owned(),
    };
    let ranges = found.points.iter().any(|p| !p.unstable_m.is_empty());
    let along = found.poses.len() > 1;
    let mut head = vec!["spindle [1/min]", "limit [mm]", "chatter [Hz]", "kind"];
    head.extend(along.then_some("at [s]"));
    head.extend(ranges.then_some("unstable [mm]"));
    let mut t = table(&head);
    // Thin out evenly if there are too many.
    let every = found.points.len().div_ceil(SHOWN).max(1);
    for point in found.points.iter().step_by(every) {
        t.add_row(row(found, point, along, ranges));
    }
    out += &lines(&t);
    if every > 1 {
        out +=
            &format!("every {every}th of {} speeds; the others are in the files and in --json\n", found.points.len());
    }
    if along {
        out += &poses(found);
    }
    let files = [
        ("CSV", &found.files.csv),
        ("plot", &found.files.plot),
        ("page", &found.files.page),
        ("figures", &found.files.json),
    ];
    out += &file_lines(7, &files);
    out
}

fn row(found: &Lobes, point: &LobePoint, along: bool, ranges: bool) -> Vec<String> {
    let mut row = vec![
        format!("{:.0}", point.spindle_rpm),
        mm(point.depth_m),
        point.chatter_hz.map_or_else(|| "-".into(), |hz| format!("{hz:.1}")),
        point.kind.unwrap_or("-").to_owned(),
    ];
    if along {
        row.push(found.poses[point.pose].time_s.map_or_else(|| "-".into(), |t| format!("{t:.2}")));
    }
    if ranges {
        let all: Vec<String> =
            point.unstable_m.iter().map(|[a, b]| format!("{} to {:.3}", rounded_down(1e3 * a, 3), 1e3 * b)).collect();
        row.push(if all.is_empty() { "-".into() } else { all.join(", ") });
    }
    row
}

/// Table of the lowest limit and the compliance at each position.
fn poses(found: &Lobes) -> String {
    let mut t =
        table(&["time [s]", "lowest limit [mm]", "at [1/min]", "feed [um/N]", "across", "along the tool", "f1 [Hz]"]);
    for pose in &found.poses {
        let mut row = vec![
            pose.time_s.map_or_else(|| "-".into(), |t| format!("{t:.2}")),
            mm(pose.stable_below_m),
            pose.stable_below_at_rpm.map_or_else(|| "-".into(), |rpm| format!("{rpm:.0}")),
        ];
        row.extend(pose.compliance.iter().map(|c| format!("{:.3}", 1e6 * c)));
        row.push(pose.frequencies_hz.first().map_or_else(|| "-".into(), |hz| format!("{hz:.2}")));
        t.add_row(row);
    }
    let left_out = match found.left_out {
        0 => String::new(),
        n => format!("{n} places are left out: the tool is at rest there, or moves along its axis\n"),
    };
    format!("\n{}{left_out}", lines(&t))
}
