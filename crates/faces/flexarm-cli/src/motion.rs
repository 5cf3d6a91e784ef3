//! `flexarm motion`: contents of a motion, compared with the limits of a robot.
//!
//! [`text`] prints peaks against limits in units of the joints (deg or mm, per s). Not here: how
//! peaks are found (`flexarm::motions`).

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use flexarm::motions::{ColumnMap, MotionCurve, MotionOptions, MotionPeak, MotionReport};
use flexarm::{Motion, Robot, Scenario};

use crate::args::RobotArgs;
use crate::failure::Failure;
use crate::layout::{lines, table};
use crate::print::counted;
use crate::shipped;
use crate::terminal::{Terminal, answer, to_json};

/// Width of a curve in the terminal (characters).
const WIDTH: usize = 60;
const LEVELS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

/// Options for reading a motion file.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Motion")]
pub(crate) struct MotionInputArgs {
    /// Topic of a bag that holds the motion [default: the one that moves the largest number of the
    /// robot's joints, and it is reported]
    #[arg(long, value_name = "TOPIC")]
    pub(crate) topic: Option<String>,
    /// Columns of a table: t=Time[s],joint_1=A1[deg]; a column by its name, with another unit, or
    /// by number (#2[rad])
    #[arg(long, value_name = "JOINT=COLUMN,...")]
    pub(crate) columns: Option<ColumnMap>,
}

impl MotionInputArgs {
    pub(crate) fn options(&self) -> MotionOptions {
        MotionOptions { topic: self.topic.clone(), columns: self.columns.clone() }
    }

    /// Loads a motion, that of the robot file if none is given, with a file of loads.
    pub(crate) fn scenario(
        &self,
        robot: &Robot,
        motion: Option<&Path>,
        loads: Option<&Path>,
    ) -> Result<Scenario, Failure> {
        let motion = match (motion, &robot.default_trajectory) {
            (Some(given), _) => shipped::trajectory(given)?,
            (None, Some(own)) => own.clone(),
            (None, None) => return Err(Failure::Usage("the robot has no motion of its own: give one".into())),
        };
        let scenario = Scenario::new(Motion::load_with(&motion, robot, &self.options())?);
        match loads {
            Some(loads) => Ok(scenario.with_loads_file(loads)?),
            None => Ok(scenario),
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct MotionArgs {
    /// Motion file of any format (flexarm format motion), or the name of a shipped one
    pub(crate) motion: PathBuf,
    /// robot.toml, a folder with one, a .urdf or .xacro file, or the name of a shipped robot, for
    /// its limits, torques and TCP path [default: only the joint values]
    pub(crate) robot: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) input: MotionInputArgs,
    #[command(flatten)]
    pub(crate) load: RobotArgs,
    /// Write the motion to this file, format by extension: .csv (samples), .toml (waypoints), .yaml
    /// or .json (JointTrajectory of ROS), .svg (curves); may be repeated
    #[arg(short, long, help_heading = "Files", value_name = "FILE")]
    pub(crate) output: Vec<PathBuf>,
    /// Draw positions, speeds and torques over time (SVG)
    #[arg(long, help_heading = "Files", value_name = "FILE")]
    pub(crate) svg: Option<PathBuf>,
    /// Rows or points per second in the written files
    #[arg(long, help_heading = "Files", value_name = "HZ", default_value_t = 500.0, allow_hyphen_values = true)]
    pub(crate) rate: f64,
    /// Overwrite existing files
    #[arg(long, help_heading = "Files")]
    pub(crate) force: bool,
}

pub(crate) fn run(terminal: &Terminal, args: &MotionArgs) -> Result<ExitCode, Failure> {
    let mut outputs = args.output.clone();
    if let Some(svg) = &args.svg {
        let is_svg = svg.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("svg"));
        if !is_svg {
            return Err(Failure::Usage(format!("--svg writes a file .svg, found {}", svg.display())));
        }
        outputs.push(svg.clone());
    }
    let robot = match &args.robot {
        Some(given) => Some(args.load.load(given)?),
        None => None,
    };
    let motion = shipped::trajectory(&args.motion)?;
    let options = args.input.options();
    let report = flexarm::motions::motion_report(&motion, robot.as_ref(), &options, &outputs, args.rate, args.force)?;
    crate::print::warnings(terminal, &report.warnings);
    answer(terminal, || to_json(&report), || text(&report));
    Ok(ExitCode::SUCCESS)
}

fn text(report: &MotionReport) -> String {
    let robot = report.robot.as_ref().map_or_else(String::new, |robot| format!(" on {robot}"));
    let mut out = format!("{}{robot}: {}", report.motion, report.format);
    out += &report.topic.as_ref().map_or_else(String::new, |topic| format!(", topic {topic}"));
    out += &format!("\n{} s, {}", rounded(report.duration_s), counted(report.joints.len(), "joint"));
    out += &report.samples.map_or_else(String::new, |samples| format!(", {}", counted(samples, "sample")));
    if let (Some(length), Some(speed)) = (report.tcp_length_m, report.tcp_speed_m_s) {
        out += &format!("; path of the tool {length:.4} m, up to {:.1} mm/s", 1e3 * speed);
    }
    out += "\n\n";
    out += &peaks(&report.peaks);
    out += "\n";
    out += &curves(&report.curves, &report.peaks);
    // Limits, notes and files.
    if report.robot.is_some() {
        match report.violations.len() {
            0 => out += "\nall limits are kept\n",
            n => out += &format!("\n{n} limits are passed\n"),
        }
    }
    for violation in &report.violations {
        out += &format!("  {}\n", violation.message);
    }
    for note in &report.notes {
        out += &format!("note: {note}\n");
    }
    for file in &report.files.motions {
        out += &format!("motion   {file}\n");
    }
    for file in &report.files.plots {
        out += &format!("plot     {file}\n");
    }
    out
}

/// Formats a number with readable digits.
fn rounded(value: f64) -> String {
    let text = format!("{value:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Table of peak values; angles in degrees, with the used share of the limit.
fn peaks(peaks: &[MotionPeak]) -> String {
    let with_torque = peaks.iter().any(|peak| peak.torque.is_some());
    let mut header = vec!["joint", "", "from", "to", "speed", "acceleration", "jerk"];
    if with_torque {
        header.push("torque");
    }
    let mut t = table(&header);
    // Angles in degrees; each peak with the part of its limit that it uses.
    for peak in peaks {
        let (unit, factor) = if peak.unit == "rad" { ("deg", 1f64.to_degrees()) } else { (peak.unit, 1.0) };
        let used = |value: f64, limit: Option<f64>| match limit {
            Some(limit) if limit > 0.0 => format!(" ({:.0} %)", 100.0 * value.abs() / limit),
            _ => String::new(),
        };
        let mut row = vec![
            peak.joint.clone(),
            unit.to_owned(),
            rounded(factor * peak.lower),
            rounded(factor * peak.upper),
            format!("{}{}", rounded(factor * peak.speed), used(peak.speed, peak.speed_limit)),
            format!("{}{}", rounded(factor * peak.acceleration), used(peak.acceleration, peak.acceleration_limit)),
            format!("{}{}", rounded(factor * peak.jerk), used(peak.jerk, peak.jerk_limit)),
        ];
        if with_torque {
            let torque = peak.torque.unwrap_or(0.0);
            row.push(format!("{torque:.1}{}", used(torque, peak.torque_limit)));
        }
        t.add_row(row);
    }
    let note = if with_torque {
        "peaks per s, s², s³; in brackets the part of the limit; torque in N m (forces in N) of the rigid robot with payload\n"
    } else {
        "peaks per s, s², s³\n"
    };
    lines(&t) + note
}

/// One line per joint: its position over time, scaled from its minimum to its maximum.
fn curves(curves: &[MotionCurve], peaks: &[MotionPeak]) -> String {
    let longest = curves.iter().map(|curve| curve.joint.chars().count()).max().unwrap_or(0);
    let mut out = String::new();
    for (curve, peak) in curves.iter().zip(peaks) {
        let (low, range) = (peak.lower, peak.upper - peak.lower);
        let letter = |i: usize| {
            let place = i * (curve.position.len() - 1) / (WIDTH - 1);
            let part = if range > 0.0 { (curve.position[place] - low) / range } else { 0.0 };
            LEVELS[((part * LEVELS.len() as f64) as usize).min(LEVELS.len() - 1)]
        };
        let drawn: String = if curve.position.is_empty() { String::new() } else { (0..WIDTH).map(letter).collect() };
        out += &format!("{:<longest$}  {drawn}\n", curve.joint);
    }
    out
}
