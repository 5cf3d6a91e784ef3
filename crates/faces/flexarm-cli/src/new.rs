//! `flexarm new`: a robot file, a sample motion and a first run from a robot description.
//!
//! [`run`] writes the folder, then makes a first run with it. Not here: estimates and classes of
//! reducers (`flexarm::new`).

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use flexarm::new::{NewLink, Reducer};
use flexarm::robots::{NewOptions, NewRobot, ReadOptions};
use flexarm::settings::gathered;
use flexarm::{Keep, LoadOptions, Modelling, Motion, Outputs, Robot, RunOptions, RunRequest, Severity, Summary};

use crate::args::RobotArgs;
use crate::failure::Failure;
use crate::layout::{lines, table};
use crate::print::{counted, warnings};
use crate::terminal::{Bar, Terminal, answer_as_is, columns, readable, to_json};
use crate::{signals, summary_table};

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Reducers {
    Cycloidal,
    StrainWave,
}

impl From<Reducers> for Reducer {
    fn from(kind: Reducers) -> Self {
        match kind {
            Reducers::Cycloidal => Self::Cycloidal,
            Reducers::StrainWave => Self::StrainWave,
        }
    }
}

#[derive(Clone, Debug, Args)]
pub(crate) struct NewArgs {
    /// URDF or xacro file of the robot
    pub(crate) urdf: PathBuf,
    /// Folder for robot.toml, motion.toml, README.md and, unless it is in the same folder, a copy
    /// of the description with its meshes [default: a new folder named after the robot]
    #[arg(short, long, help_heading = "Files", value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Overwrite existing files
    #[arg(long, help_heading = "Files")]
    pub(crate) force: bool,
    /// Write the files but skip the first run
    #[arg(long, help_heading = "Files")]
    pub(crate) no_run: bool,
    /// Link at which the arm begins [default: the first of the description]; joints before it are
    /// held
    #[arg(long, help_heading = "Robot", value_name = "LINK")]
    pub(crate) base: Option<String>,
    /// Link that is the tool [default: tool0, tcp, flange, ... at the end of the arm with the
    /// largest number of joints]
    #[arg(long, help_heading = "Robot", value_name = "LINK", alias = "tcp")]
    pub(crate) tool: Option<String>,
    /// Joints that the sample motion moves, separated by commas; all others are held [default:
    /// those from base to tool]
    #[arg(long, help_heading = "Robot", value_name = "JOINT,...", value_delimiter = ',')]
    pub(crate) joints: Option<Vec<String>>,
    /// Mass of the payload (kg), 0 for none [default: about 15 % of the moving mass; it is
    /// reported]
    #[arg(long, help_heading = "Robot", value_name = "KG", allow_hyphen_values = true)]
    pub(crate) payload: Option<f64>,
    /// Kind of all reducers [default: cycloidal from a rated torque of 200 N m, strain-wave below]
    #[arg(long, help_heading = "Robot", value_name = "KIND")]
    pub(crate) reducers: Option<Reducers>,
    /// Total mass of the arm's links without <inertial>, or with a placeholder (kg): distributed by
    /// mesh volume or by length
    #[arg(
        long = "inertia-from-total-mass",
        help_heading = "Robot",
        value_name = "KG",
        alias = "mass",
        conflicts_with = "density",
        allow_hyphen_values = true
    )]
    pub(crate) mass: Option<f64>,
    /// Density of links without <inertial>, taken as solid (kg/m^3)
    #[arg(
        long = "inertia-from-density",
        help_heading = "Robot",
        value_name = "KG_PER_M3",
        alias = "density",
        allow_hyphen_values = true
    )]
    pub(crate) density: Option<f64>,
    /// Folder of package://NAME/ (may be repeated)
    #[arg(long = "package", help_heading = "Robot", value_name = "NAME=FOLDER")]
    pub(crate) packages: Vec<String>,
    /// Argument of a xacro file (may be repeated)
    #[arg(long = "arg", help_heading = "Robot", value_name = "NAME=VALUE")]
    pub(crate) arguments: Vec<String>,
}

impl NewArgs {
    fn options(&self) -> Result<NewOptions, Failure> {
        let robot = RobotArgs {
            tcp: None,
            packages: self.packages.clone(),
            arguments: self.arguments.clone(),
            waive_inertia: Vec::new(),
            inertia_from_density: self.density,
            inertia_from_total_mass: self.mass,
        };
        let LoadOptions { urdf, .. } = robot.options()?;
        let (base, tool, joints) = (self.base.clone(), self.tool.clone(), self.joints.clone());
        Ok(NewOptions { base, tool, joints, payload_kg: self.payload, reducers: self.reducers.map(Into::into), urdf })
    }

    /// Returns the requested folder, or one in the current folder named after the description.
    fn folder(&self, urdf: &ReadOptions) -> PathBuf {
        let stem = || {
            let name = self.urdf.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
            let name = name.split('.').next().unwrap_or_default().to_owned();
            // If one file describes several robots, an argument selects the robot.
            let which = urdf.arguments.iter().find(|(name, _)| name == "name" || name.ends_with("_type"));
            which.map_or(name, |(_, value)| value.clone())
        };
        self.output.clone().unwrap_or_else(|| {
            let name: String =
                stem().chars().map(|c| if c.is_alphanumeric() || "-_".contains(c) { c } else { '_' }).collect();
            PathBuf::from(if name.is_empty() { "robot".to_owned() } else { name })
        })
    }
}

pub(crate) fn run(terminal: &Terminal, args: &NewArgs) -> Result<ExitCode, Failure> {
    let options = args.options()?;
    let folder = args.folder(&options.urdf);
    let mut made = flexarm::robots::new_robot(&args.urdf, &folder, args.force, &options)?;
    if !args.no_run {
        made.summary = Some(Box::new(first_run(terminal, &made, &folder, args.force)?));
    }
    let findings = made.findings.iter().filter(|f| f.severity != Severity::Note);
    warnings(terminal, &findings.map(|f| format!("{}: {}", f.location, f.message)).collect::<Vec<_>>());
    answer_as_is(terminal, || to_json(&made), || text(&made));
    let wrong = made.findings.iter().any(|f| f.is_error());
    Ok(if wrong { ExitCode::from(1) } else { ExitCode::SUCCESS })
}

/// Runs the flexible arm and its rigid twin on the sample motion, with a report in the folder
/// `first_run`.
fn first_run(terminal: &Terminal, made: &NewRobot, folder: &Path, overwrite: bool) -> Result<Summary, Failure> {
    let robot = Robot::load(&made.robot)?;
    let motion = Motion::load(&made.motion, &robot)?;
    let options = RunOptions::default();
    let outputs = Outputs { overwrite, ..Outputs::everything(folder.join("first_run")) };
    let mut stop = signals::stop_when_asked();
    let mut bar = Bar::new(terminal);
    let mut progress = |t: f64, total: f64| {
        bar.show(t, total);
        stop()
    };
    let request =
        RunRequest { outputs: Some(&outputs), progress: Some(&mut progress), ..RunRequest::keeping(Keep::Figures) };
    let result = robot.model(&Modelling::default()).and_then(|arm| arm.simulate_with(&motion, &options, request));
    bar.clear();
    Ok(result?.summary)
}

/// Returns the table of the joints with the drives that were chosen for their torques.
fn joints(made: &NewRobot) -> String {
    let mut t = table(&["joint", "torque of weight", "with speeding up", "limit", "reducer, N m/rad", "range"]);
    for joint in &made.joints {
        let drive = made.drives.iter().find(|d| d.joint == joint.name);
        let limit = joint.effort.map_or_else(|| "none".to_owned(), |e| format!("{e:.1}"));
        t.add_row(vec![
            joint.name.clone(),
            format!("{:.1}", joint.weight_torque),
            format!("{:.1}", joint.needed_torque),
            if joint.effort_fault.is_some() && joint.effort.is_some() { format!("({limit})") } else { limit },
            drive.map_or_else(String::new, |d| format!("{:.3e}", d.stiffness)),
            drive.map_or_else(String::new, |d| format!("{:.1e} to {:.1e}", d.low, d.high)),
        ]);
    }
    lines(&t)
}

fn text(made: &NewRobot) -> String {
    let mut out = format!(
        "{}: {} from {:?} to the tool {:?}\n",
        made.name,
        counted(made.joints.len(), "joint"),
        made.base,
        made.tool
    );
    out += &format!(
        "{:.2} m reach, {:.2} kg that move, payload {} kg{}\n\n",
        made.reach_m,
        made.moving_mass_kg,
        made.payload.mass,
        if made.payload.assumed { " (assumed)" } else { "" }
    );
    out += &joints(made);
    out += "torques in N m with payload; limits in brackets are implausible and not used\n\n";
    // Links with their sections.
    let mut t = table(&["link", "mm", "kg", "section"]);
    for link in &made.links {
        let mass = link.mass.map_or_else(|| "-".to_owned(), |m| format!("{m:.2}"));
        t.add_row(vec![link.name.clone(), format!("{:.0}", 1e3 * link.length), mass, section(link)]);
    }
    out += &lines(&t);
    // Assumptions and files.
    for held in &made.held {
        out += &format!("held     {} at {}: {}\n", held.joint, held.at, held.why);
    }
    let masses = made.assumptions.iter().filter(|assumed| assumed.about == "masses");
    for doubt in gathered(&masses.map(|a| format!("{}; better: {}", a.text, a.mend)).collect::<Vec<_>>()) {
        out += &format!("masses   {doubt}\n");
    }
    out += &format!(
        "\n{} assumptions (each marked in robot.toml and listed in README.md with what to ask of the maker)\n",
        made.assumptions.len()
    );
    out += &format!("{}\n", made.placed);
    for file in [&made.robot, &made.motion] {
        out += &format!("wrote    {file}\n");
    }
    let mut out = readable(&out);
    if let Some(summary) = &made.summary {
        out += "\nfirst run\n";
        out += &summary_table::summary(summary, columns());
    }
    out
}

fn section(link: &NewLink) -> String {
    let mm = |x: Option<f64>| format!("{:.0}", 1e3 * x.unwrap_or(0.0));
    let Some(shape) = link.section else {
        return format!("none: {}", link.reason.as_deref().unwrap_or_default());
    };
    let size = match shape {
        "tube" | "circle" => format!("{shape} {} mm", mm(link.width)),
        _ => format!("{shape} {} x {} mm", mm(link.width), mm(link.height)),
    };
    let wall = link.wall.map_or_else(String::new, |wall| format!(", wall {:.1} mm", 1e3 * wall));
    format!("{size}{wall}, {} (assumed)", link.material.unwrap_or_default())
}
