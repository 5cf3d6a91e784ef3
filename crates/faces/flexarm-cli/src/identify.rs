//! `flexarm identify`: parameters from measurements, and plans of poses to measure.
//!
//! [`run`] turns flags into a request and prints the answer; lengths in mm, rotations in mrad. Not
//! here: least squares and the file of measurements (`flexarm::identify`).

use std::cell::{Cell, RefCell};
use std::io::IsTerminal;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::Args;
use flexarm::Robot;
use flexarm::identify::{
    EncoderFigures, Identification, IdentifyRequest, MeasurementPlan, ModelError, PlanRequest, Progress,
    identify_robot_watched, plan_measurements,
};

use crate::args::{ModellingArgs, RobotArgs};
use crate::failure::Failure;
use crate::layout::{lines, table};
use crate::print::{file_lines, say};
use crate::shipped::OutputFolder;
use crate::signals::stop_when_asked;
use crate::terminal::{Terminal, answer, to_json, working};

const EXAMPLES: &str = "\
Examples:
  Twelve poses that determine the gearboxes best, with a table to fill in:
      flexarm identify kr210_identified --plan 12 --std 0.00003
  The stiffness identified from the filled table, a new robot file and a page:
      flexarm identify kr210_identified \\
          out/kr210_identified_plan-001/measurements.toml
  Only two of the parameters, figures alone:
      flexarm identify kr210_identified measurements.toml --no-files \\
          --fit 'drive.joint_2.*' --fit 'drive.joint_3.*'
The file of measurements: flexarm format measurements";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct IdentifyArgs {
    /// robot.toml, a folder with one, or the name of a shipped robot; its stiffnesses are the
    /// initial values
    pub(crate) robot: PathBuf,
    /// File of measurements (.toml)
    #[arg(required_unless_present = "plan")]
    pub(crate) measurements: Option<PathBuf>,
    /// Parameters to identify, * as a wildcard (may be repeated) [default: those of the file, else
    /// all stiffnesses]
    #[arg(long, value_name = "NAME")]
    pub(crate) fit: Vec<String>,
    #[command(flatten)]
    pub(crate) modelling: ModellingArgs,
    #[command(flatten)]
    pub(crate) load: RobotArgs,
    /// Choose the N most informative poses instead of reading measurements
    #[arg(long, help_heading = "Plan", value_name = "N", conflicts_with = "measurements")]
    pub(crate) plan: Option<usize>,
    /// Candidate forces of the plan, world axes (N; may be repeated) [default: down, along x and
    /// along y, as large as the effort limits allow, 500 N at most]
    #[arg(
        long = "pull",
        help_heading = "Plan",
        value_name = "FX,FY,FZ",
        requires = "plan",
        allow_hyphen_values = true
    )]
    pub(crate) forces: Vec<String>,
    /// Candidate points on the tool at which the forces act, tool axes (m; may be repeated)
    /// [default: the TCP]
    #[arg(long = "lever", help_heading = "Plan", value_name = "X,Y,Z", requires = "plan", allow_hyphen_values = true)]
    pub(crate) levers: Vec<String>,
    /// Candidate points on the tool to observe, tool axes (m; may be repeated) [default: the TCP]
    #[arg(long = "point", help_heading = "Plan", value_name = "X,Y,Z", requires = "plan", allow_hyphen_values = true)]
    pub(crate) points: Vec<String>,
    /// Candidate directions of a dial gauge, world axes (may be repeated) [default: all three
    /// components are measured]
    #[arg(long = "gauge", help_heading = "Plan", value_name = "X,Y,Z", requires = "plan", allow_hyphen_values = true)]
    pub(crate) gauges: Vec<String>,
    /// Standard deviation of a measured displacement (m)
    #[arg(long, help_heading = "Plan", value_name = "M", requires = "plan", default_value_t = 3e-5)]
    pub(crate) std: f64,
    /// Candidate poses of the plan (.csv, a column per joint, rad or m) [default: spread over the
    /// joint ranges]
    #[arg(long, help_heading = "Plan", value_name = "FILE", requires = "plan")]
    pub(crate) poses: Option<PathBuf>,
    /// Poses of the later work (.csv): the plan minimises the uncertainty of the TCP error there
    #[arg(long, help_heading = "Plan", value_name = "FILE", requires = "plan")]
    pub(crate) work: Option<PathBuf>,
    /// Folder of the new robot file and the page, or of the plan [default: a new one in out/]
    #[arg(short, long, help_heading = "Files", value_name = "FOLDER")]
    pub(crate) output: Option<PathBuf>,
    /// Write no files
    #[arg(long, help_heading = "Files", conflicts_with = "output")]
    pub(crate) no_files: bool,
    /// Overwrite files in the output folder
    #[arg(long, help_heading = "Files", requires = "output")]
    pub(crate) force: bool,
}

/// Time between two lines about the progress where there is no terminal.
const TOLD_EVERY: Duration = Duration::from_secs(10);

pub(crate) fn run(terminal: &Terminal, args: &IdentifyArgs) -> Result<ExitCode, Failure> {
    let robot = args.load.load(&args.robot)?;
    match (args.plan, &args.measurements) {
        (Some(count), _) => plan(terminal, args, &robot, count),
        (None, Some(measurements)) => {
            let folder =
                OutputFolder::of(args.output.as_deref(), &format!("{}_identified", robot.name), !args.no_files)?;
            let request = IdentifyRequest {
                modelling: args.modelling.modelling(),
                fit: args.fit.clone(),
                output: folder.path(),
                overwrite: args.force,
            };
            // Output that is no terminal gets a line every few seconds instead of a bar.
            let stop = RefCell::new(stop_when_asked());
            let told = Cell::new(Instant::now());
            let watch = |progress: &Progress| {
                if !terminal.quiet && !std::io::stderr().is_terminal() && told.get().elapsed() >= TOLD_EVERY {
                    told.set(Instant::now());
                    let Progress { iteration, rms, step } = progress;
                    say(&format!("iteration {iteration}: residuals {rms:.3} and last step {step:.1e} deviations"));
                }
                stop.borrow_mut()().is_continue()
            };
            let found = working(terminal, "fitting the parameters", || {
                identify_robot_watched(&robot, measurements, &request, &watch)
            })?;
            crate::print::caveats(terminal, &found.caveats);
            answer(terminal, || to_json(&found), || text(&found));
            Ok(ExitCode::SUCCESS)
        }
        (None, None) => Err(Failure::Usage("give a file of measurements, or --plan N".into())),
    }
}

/// Parses three numbers from each text.
fn threes(flag: &str, what: &str, texts: &[String]) -> Result<Vec<[f64; 3]>, Failure> {
    let triple = |text: &String| match flexarm::links::reduce::numbers(text).as_deref() {
        Ok([x, y, z]) => Ok([*x, *y, *z]),
        _ => Err(Failure::Usage(format!("{flag} {text:?}: expected {what}"))),
    };
    texts.iter().map(triple).collect()
}

/// Plans measurements.
fn plan(terminal: &Terminal, args: &IdentifyArgs, robot: &Robot, count: usize) -> Result<ExitCode, Failure> {
    let folder = OutputFolder::of(args.output.as_deref(), &format!("{}_plan", robot.name), !args.no_files)?;
    let forces = threes("--pull", "a force of three numbers", &args.forces)?;
    let mut request = PlanRequest {
        modelling: args.modelling.modelling(),
        fit: args.fit.clone(),
        std_m: args.std,
        poses: args.poses.clone(),
        work: args.work.clone(),
        levers: threes("--lever", "a point of three numbers", &args.levers)?,
        points: threes("--point", "a point of three numbers", &args.points)?,
        directions: threes("--gauge", "a direction of three numbers", &args.gauges)?,
        output: folder.path(),
        overwrite: args.force,
        ..PlanRequest::new(count)
    };
    request.forces = forces;
    let found = working(terminal, "planning the measurements", || plan_measurements(robot, &request))?;
    crate::print::warnings(terminal, &found.warnings);
    answer(terminal, || to_json(&found), || plan_text(&found));
    Ok(ExitCode::SUCCESS)
}

/// Returns a readable unit and its conversion factor.
fn readable(unit: &str) -> (&str, f64) {
    match unit {
        "m" => ("mm", 1e3),
        "rad" => ("mrad", 1e3),
        "std" => ("deviations", 1.0),
        other => (other, 1.0),
    }
}

/// Maximum number of groups of undetermined parameters in the terminal.
const MAX_COMBINATIONS: usize = 6;

fn text(found: &Identification) -> String {
    let Identification { robot, measurements, readings, numbers, .. } = found;
    let mut out = format!("{robot}: {readings} readings with {numbers} numbers of {measurements}\n\n");
    out += &parameter_table(found);
    out += &residual_lines(found);
    // Encoders, mode shapes, parameters that are known only together.
    out.extend(found.encoders.iter().map(encoder_line));
    for shape in &found.shapes {
        out += &format!(
            "{}: like mode {} by {:.4} (assurance), {:.4} before\n",
            shape.reading, shape.mode, shape.assurance, shape.assurance_before
        );
    }
    found.combinations.iter().take(MAX_COMBINATIONS).for_each(|text| out += &format!("{text}\n"));
    if let Some(more) = found.combinations.len().checked_sub(MAX_COMBINATIONS).filter(|more| *more > 0) {
        out += &format!("only together: {more} more groups (--json and the page list them)\n");
    }
    // Readings that contradict the others, and what was found beside the parameters.
    for s in &found.suspicious {
        out += &format!(
            "contradicts the others: {}, measured {}, expected {} ({:.1} deviations)\n",
            s.reading,
            number(s.measured),
            number(s.expected),
            s.normalised
        );
    }
    for frame in &found.instruments {
        let [x, y, z] = frame.xyz;
        out += &format!("instrument {} at {x:.5}, {y:.5}, {z:.5} m\n", frame.name);
    }
    for point in &found.targets {
        let [x, y, z] = point.xyz;
        out += &format!("target {} is at {x:.5}, {y:.5}, {z:.5} m on {}\n", point.name, point.link);
    }
    for caveat in found.caveats.iter().filter(|caveat| !caveat.warns()) {
        out += &format!("note: {}\n", caveat.message);
    }
    out += &file_lines(8, &[("robot", &found.file), ("page", &found.page)]);
    out
}

fn parameter_table(found: &Identification) -> String {
    let mut t = table(&["parameter", "before", "value", "std", "", "unit"]);
    for p in &found.parameters {
        let (value, part) = match (p.identifiable, p.rigid) {
            (true, _) => (number(p.value), part_of(p.std, p.value, p.initial)),
            // The bound of a clearance or compliance is its largest value.
            (false, true) if p.interval[1].is_finite() => (format!("<= {}", number(p.interval[1])), "rigid".to_owned()),
            (false, true) => (format!(">= {}", number(p.interval[0])), "rigid".to_owned()),
            (false, false) => (number(p.value), "not alone".to_owned()),
        };
        t.add_row(vec![p.name.clone(), number(p.initial), value, deviation(p.std), part, p.unit.clone()]);
    }
    lines(&t)
}

/// States the residual of the readings, and that of the readings held out of the fit.
fn residual_lines(found: &Identification) -> String {
    let (unit, factor) = readable(found.residual.unit);
    let mut out = format!(
        "\nresidual (RMS): {} {unit} before, {} {unit} after\n",
        number(factor * found.residual.before),
        number(factor * found.residual.after)
    );
    if let Some(held) = &found.held_out {
        out += &format!(
            "readings held out of the fit: {} {unit} (before {})\n",
            number(factor * held.rms),
            number(factor * held.rms_before)
        );
        if held.skipped > 0 {
            out += &format!("{} of {} parts of the readings cannot be held out\n", held.skipped, held.folds);
        }
    }
    for error in &found.model_errors {
        out += &format!("error of the model in {}: {}\n", error.kind, model_error(error));
    }
    out
}

/// States the error of the model in a kind of readings with its unit.
fn model_error(error: &ModelError) -> String {
    match error.kind {
        "displacements" | "places" => format!("{} mm", number(1e3 * error.error)),
        "rotations" => format!("{} mrad", number(1e3 * error.error)),
        "frequencies" => format!("{} %", number(100.0 * error.error)),
        _ => number(error.error),
    }
}

fn encoder_line(gear: &EncoderFigures) -> String {
    let unseen: Vec<String> = gear.unseen_r2.iter().map(|r2| format!("{r2:.2}")).collect();
    format!(
        "encoders of {}: {} +- {}, late by {:.1} ms, rest {:.1} of {:.1} urad (noise {:.1}), R2 of unseen runs {}{}\n",
        gear.joint,
        number(gear.stiffness),
        number(gear.std),
        1e3 * gear.delay_s,
        1e6 * gear.rest_rms,
        1e6 * gear.deflection_rms,
        1e6 * gear.noise_rms,
        unseen.join(", "),
        if gear.told { "" } else { ": not determined" }
    )
}

/// Table of the planned readings.
fn plan_text(found: &MeasurementPlan) -> String {
    let mut out =
        format!("{}: {} readings of {} candidate poses\n\n", found.robot, found.poses.len(), found.candidates);
    // Columns that are the same in all rows are left out.
    let mut header = vec!["pose"];
    header.extend(found.joints.iter().map(String::as_str));
    let levers = found.poses.iter().any(|pose| pose.at != [0.0; 3]);
    let gauges = found.poses.iter().any(|pose| pose.direction.is_some());
    header.push("force (N)");
    header.extend(levers.then_some("at (mm, tool)"));
    let points = found.poses.iter().any(|pose| pose.point != [0.0; 3]);
    header.extend(points.then_some("watched (mm, tool)"));
    header.extend(gauges.then_some("gauge along"));
    header.push("expected (mm)");
    let mut t = table(&header);
    let three = |v: [f64; 3], digits: usize| v.map(|x| format!("{x:.digits$}")).join(" ");
    for (k, pose) in found.poses.iter().enumerate() {
        let mut row = vec![(k + 1).to_string()];
        row.extend(pose.joints.iter().map(|q| format!("{:.1}", q.to_degrees())));
        row.push(three(pose.force, 0));
        row.extend(levers.then(|| three(pose.at.map(|x| 1e3 * x), 1)));
        row.extend(points.then(|| three(pose.point.map(|x| 1e3 * x), 1)));
        row.extend(pose.direction.map(|direction| three(direction, 2)));
        row.push(three(pose.expected_m.map(|x| 1e3 * x), 3));
        t.add_row(row);
    }
    out += &lines(&t);
    out += "\n";
    // Expected uncertainty of each parameter.
    let mut t = table(&["parameter", "now", "expected std", "", "unit"]);
    for p in &found.parameters {
        let part = part_of(p.std, p.initial, p.initial);
        t.add_row(vec![p.name.clone(), number(p.initial), number(p.std), part, p.unit.clone()]);
    }
    out += &lines(&t);
    if let Some(std) = found.work_std_m {
        out += &format!("\nthe tool's displacement where the work is done will be known to {:.4} mm\n", 1e3 * std);
    }
    out += &file_lines(8, &[("file", &found.file), ("table", &found.table)]);
    out
}

/// Formats a number with readable digits.
fn number(x: f64) -> String {
    match x.abs() {
        0.0 => "0".into(),
        a if (1e-3..1e5).contains(&a) => {
            let digits = (3 - a.log10().floor() as i32).clamp(0, 6) as usize;
            format!("{x:.digits$}")
        }
        _ => format!("{x:.3e}"),
    }
}

/// Formats a standard deviation, "-" if there is none.
fn deviation(std: f64) -> String {
    if std.is_nan() { "-".to_owned() } else { number(std) }
}

/// Formats a standard deviation relative to its value; "-" for parameters whose initial value is
/// zero, such as the position of the tool.
fn part_of(std: f64, value: f64, initial: f64) -> String {
    if initial == 0.0 { "-".to_owned() } else { format!("{:.1} %", 100.0 * std / value.abs()) }
}
