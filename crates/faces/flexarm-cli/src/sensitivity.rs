//! `flexarm sensitivity`: derivatives of the TCP error along a motion with respect to the
//! parameters of the robot.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use flexarm::RunOptions;
use flexarm::sensitivity::{PoseSensitivity, Sensitivity, SensitivityRequest, pose_sensitivity, sensitivity};

use crate::args::{ModellingArgs, RobotArgs};
use crate::failure::Failure;
use crate::layout::{lines, table};
use crate::motion::MotionInputArgs;
use crate::terminal::{Terminal, answer, to_json, working};
use crate::values;

const EXAMPLES: &str = "\
Examples:
  What the error of kr210 on its pick-and-place cycle depends on:
      flexarm sensitivity kr210 pick_and_place
  On the gearboxes alone, with the derivatives over time as a table:
      flexarm sensitivity kr210 pick_and_place --by 'drive.*' --table slopes.csv
  On friction and gains of joints under servos:
      flexarm sensitivity kr300 --drives servo \\
          --by 'drive.*.friction.*' --by 'drive.*.servo.*'
  On shifts of the joints:
      flexarm sensitivity kr210 milling_square --by 'motion.*'
  What sag, compliance and frequencies at a pose depend on:
      flexarm sensitivity kr210 --at 0,-60deg,60deg,0,30deg,0";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct SensitivityArgs {
    /// robot.toml, a folder with one, or the name of a shipped robot
    pub(crate) robot: PathBuf,
    /// Motion of any format (flexarm format motion), or the name of a shipped one [default: the
    /// robot's own]
    pub(crate) motion: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) input: MotionInputArgs,
    /// Names of parameters, * as a wildcard: drive.joint_2.gearbox.stiffness, drive.*.friction.*,
    /// drive.*.servo.*, link.*, motion.joint_1, tcp.x (may be repeated) [default: all]
    #[arg(long = "by", value_name = "NAME")]
    pub(crate) by: Vec<String>,
    /// Evaluate a pose instead of a motion: static TCP error, compliance, natural frequencies.
    /// Joint values in coordinate order, or name=value pairs (rad or m; 30deg for degrees)
    #[arg(long, value_name = "Q1,Q2,...", allow_hyphen_values = true, conflicts_with_all = ["motion", "loads", "table"])]
    pub(crate) at: Option<String>,
    /// File of loads and payloads over time that act on the arm (TOML, see docs/loads.md)
    #[arg(long, value_name = "FILE")]
    pub(crate) loads: Option<PathBuf>,
    /// Step size of the run (s)
    #[arg(long, value_name = "S", default_value_t = 1e-3)]
    pub(crate) step: f64,
    /// Continue even if the motion exceeds joint limits
    #[arg(long)]
    pub(crate) ignore_limits: bool,
    #[command(flatten)]
    pub(crate) modelling: ModellingArgs,
    #[command(flatten)]
    pub(crate) load: RobotArgs,
    /// Write error and derivatives at every step (CSV)
    #[arg(long, help_heading = "Files", value_name = "FILE")]
    pub(crate) table: Option<PathBuf>,
    /// Overwrite existing files
    #[arg(long, help_heading = "Files")]
    pub(crate) force: bool,
}

pub(crate) fn run(terminal: &Terminal, args: &SensitivityArgs) -> Result<ExitCode, Failure> {
    let robot = args.load.load(&args.robot)?;
    if args.at.is_some() {
        let at = values::joint_values(args.at.as_deref(), &robot)?;
        let modelling = args.modelling.modelling();
        let found = working(terminal, "derivatives at the pose", || {
            pose_sensitivity(&robot, modelling, at.as_deref(), &args.by)
        })?;
        crate::print::caveats(terminal, &found.caveats);
        answer(terminal, || to_json(&found), || pose_text(&found));
        return Ok(ExitCode::SUCCESS);
    }
    let scenario = args.input.scenario(&robot, args.motion.as_deref(), args.loads.as_deref())?;
    let request = SensitivityRequest {
        modelling: args.modelling.modelling(),
        run: RunOptions { step_s: args.step, ignore_limits: args.ignore_limits, ..RunOptions::default() },
        parameters: args.by.clone(),
        table: args.table.clone(),
        overwrite: args.force,
    };
    let found = working(terminal, "derivatives along the motion", || sensitivity(&robot, scenario, &request))?;
    crate::print::caveats(terminal, &found.caveats);
    answer(terminal, || to_json(&found), || text(&found));
    Ok(ExitCode::SUCCESS)
}

fn text(found: &Sensitivity) -> String {
    let motion = Path::new(&found.motion).file_stem().unwrap_or_default().to_string_lossy();
    let mut out = format!("{motion} on {}: {} steps of {} s\n", found.robot, found.steps, found.step_s);
    out += &format!(
        "error of the tool: peak {:.4} mm at {:.3} s, RMS {:.4} mm; peak {:.4} mrad, RMS {:.4} mrad\n\n",
        1e3 * found.peak_m,
        found.t_peak_s,
        1e3 * found.rms_m,
        1e3 * found.peak_rad,
        1e3 * found.rms_rad
    );
    let mut t = table(&["what a change does", "value", "change", "peak, um", "RMS, um", "peak, urad", "RMS, urad"]);
    for own in &found.parameters {
        let is_shift = own.name.starts_with("motion.") || own.name.starts_with("tcp.");
        t.add_row(vec![
            own.name.clone(),
            if is_shift { String::new() } else { value(own.value, &own.unit) },
            format!("+{}", own.per),
            micro(own.peak_m),
            micro(own.rms_m),
            micro(own.peak_rad),
            micro(own.rms_rad),
        ]);
    }
    out += &lines(&t);
    if let Some(file) = &found.table {
        out += &format!("\ntable    {file}\n");
    }
    out
}

fn micro(x: f64) -> String {
    format!("{:+.4}", 1e6 * x)
}

fn value(value: f64, unit: &str) -> String {
    // Computed gains have all digits of a double; values from a file have few.
    let short = format!("{value:.6e}").parse().unwrap_or(value);
    if unit == "1" { short.to_string() } else { format!("{short} {unit}") }
}

/// Number of frequencies shown for each parameter.
const FREQUENCIES: usize = 3;

/// Formats the derivatives at a pose.
fn pose_text(found: &PoseSensitivity) -> String {
    let at: Vec<String> = found.joints.iter().zip(&found.at).map(|(joint, q)| format!("{joint} = {q:.4}")).collect();
    let mut out = format!("{} at {}\n", found.robot, at.join(", "));
    let hz: Vec<String> = found.frequencies_hz.iter().take(FREQUENCIES).map(|hz| format!("{hz:.4}")).collect();
    out += &format!("lowest frequencies {} Hz\n\n", hz.join(", "));
    let axes = ["x", "y", "z"];
    let mut heads: Vec<String> = vec!["what a change does".into(), "value".into(), "change".into()];
    heads.extend(axes.map(|axis| format!("tool {axis}, um")));
    heads.extend(axes.map(|axis| format!("C_{axis}{axis}, um/kN")));
    heads.extend((1..=hz.len()).map(|k| format!("mode {k}, mHz")));
    let mut t = table(&heads.iter().map(String::as_str).collect::<Vec<_>>());
    for own in &found.parameters {
        let mut row = vec![own.name.clone(), value(own.value, &own.unit), format!("+{}", own.per)];
        row.extend(own.tcp_m.map(micro));
        row.extend((0..3).map(|k| format!("{:+.4}", 1e9 * own.compliance[k][k])));
        row.extend(own.frequencies_hz.iter().take(hz.len()).map(|hz| format!("{:+.4}", 1e3 * hz)));
        t.add_row(row);
    }
    out + &lines(&t)
}
