//! `flexarm map`: from flags to a request, and a table for people.
//!
//! [`region`] parses a box or ranges of joints (m, or rad and m of the joints, with units as
//! typed); [`text`] prints quantiles and extremes. Not here: poses and quantities (`flexarm::map`).

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use flexarm::links::reduce::numbers;
use flexarm::map::{
    JointRange, KeptPoses, Map, MapPose, MapRegion, MapRequest, ToolDirections, WorkspaceGrid, map, quantity_text,
    quantity_title, read_poses, readable_quantity,
};
use flexarm::{Motion, Robot};

use crate::args::{ModellingArgs, RobotArgs, word_of};
use crate::failure::Failure;
use crate::layout::{lines, table};
use crate::lobes::cutting_tool;
use crate::motion::MotionInputArgs;
use crate::print::{counted, file_lines};
use crate::shipped::OutputFolder;
use crate::terminal::{Bar, Terminal, answer, to_json};
use crate::{shipped, signals, values};

const EXAMPLES: &str = "\
Examples:
  Where kr210 is stiff with its tool pointing down:
      flexarm map kr210
  Where to put a workpiece of 0.8 x 0.6 x 0.4 m for milling with 500 N sideways:
      flexarm map kr210 --box 1:2.6,-1.2:1.2,0:1.6 --grid 0.05 \\
          --wrench 500,0,0 --workpiece 0.8,0.6,0.4
  The tool may tilt by 20 degrees and turn about its axis:
      flexarm map kr210 --cone 20 --tilts 9 --rolls 6
  In joints 2 and 3, the others at zero:
      flexarm map kr210 --over joint_2=-120deg:0deg:61 \\
          --over joint_3=0deg:120deg:61
  At poses of a file, with the 6x6 compliance of each:
      flexarm map kr210 --poses poses.csv
  Along a motion:
      flexarm map kr210 --along pick_and_place --points 500
  How deep an end mill may cut before it chatters, over a table:
      flexarm map kr210 --box 1.2:2.4,-0.6:0.6,0.6:0.6 --grid 0.1 \\
          --tool endmill_20mm --rpm 8000";

#[derive(Debug, Args)]
#[command(after_long_help = EXAMPLES, after_help = "More, with examples: flexarm map --help")]
pub(crate) struct MapArgs {
    /// robot.toml, a folder with one, a .urdf or .xacro file, or the name of a shipped robot
    pub(crate) robot: PathBuf,
    /// Box of TCP positions (m, world) [default: the whole workspace]
    #[arg(long = "box", help_heading = "Where", value_name = "X0:X1,Y0:Y1,Z0:Z1", allow_hyphen_values = true)]
    pub(crate) bounds: Option<String>,
    /// Spacing of the positions (m) [default: about 32 along the longest edge]
    #[arg(long, help_heading = "Where", value_name = "M", allow_hyphen_values = true)]
    pub(crate) grid: Option<f64>,
    /// Exclude positions nearer than this to the vertical line through the first joint (m), where
    /// the arm itself is [default: 0 with --box, else the radius of base and first link]
    #[arg(long, help_heading = "Where", value_name = "M", allow_hyphen_values = true)]
    pub(crate) keep_out: Option<f64>,
    /// Direction of the tool's z axis in the world
    #[arg(long, help_heading = "Where", value_name = "X,Y,Z", default_value = "0,0,-1", allow_hyphen_values = true)]
    pub(crate) tool_axis: String,
    /// Rotation of the tool about that axis (degrees); at 0 its x axis points along world x
    #[arg(long, help_heading = "Where", value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true)]
    pub(crate) roll: f64,
    /// Half angle of a cone within which the tool may tilt (degrees)
    #[arg(long, help_heading = "Where", value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true)]
    pub(crate) cone: f64,
    /// Number of tool directions in the cone [default: 9 with a cone, else 1]
    #[arg(long, help_heading = "Where", value_name = "N")]
    pub(crate) tilts: Option<usize>,
    /// Number of tool rotations about its axis, evenly over a turn
    #[arg(long, help_heading = "Where", value_name = "N", default_value_t = 1)]
    pub(crate) rolls: usize,
    /// Scan values of a joint instead of positions (may be repeated; rad or m, 30deg for degrees)
    #[arg(long, help_heading = "Where", value_name = "JOINT=FROM:TO:N", allow_hyphen_values = true, conflicts_with_all = ["bounds", "grid", "along"])]
    pub(crate) over: Vec<String>,
    /// Evaluate along a motion instead of at positions
    #[arg(long, help_heading = "Where", value_name = "MOTION", conflicts_with_all = ["bounds", "grid"])]
    pub(crate) along: Option<PathBuf>,
    /// Number of instants along that motion
    #[arg(long, help_heading = "Where", value_name = "N", default_value_t = 1000, requires = "along")]
    pub(crate) points: usize,
    /// Evaluate the poses of a file: a table with a column for each joint (_deg after its name for
    /// degrees), or a .toml file with poses = [[...], ...]; the table of the map then has the 6x6
    /// compliance of each
    #[arg(long, help_heading = "Where", value_name = "FILE", conflicts_with_all = ["bounds", "grid", "over", "along"])]
    pub(crate) poses: Option<PathBuf>,
    /// Values of the joints that the map does not move; also selects the inverse kinematics
    /// branches [default: zero]
    #[arg(long, help_heading = "Where", value_name = "Q1,Q2,...", allow_hyphen_values = true)]
    pub(crate) at: Option<String>,
    /// Force and moment on the TCP in addition to gravity, world axes (N, N m)
    #[arg(long, help_heading = "What", value_name = "FX,FY,FZ[,TX,TY,TZ]", allow_hyphen_values = true)]
    pub(crate) wrench: Option<String>,
    /// Cutting tool for which to compute the chatter-free depth of cut; a .toml file, or the name
    /// of a shipped one (flexarm format tool)
    #[arg(long, help_heading = "What", value_name = "TOOL", requires = "rpm")]
    pub(crate) tool: Option<PathBuf>,
    /// Spindle speeds of the tool; their lowest limit is used (1/min)
    #[arg(
        long,
        help_heading = "What",
        value_name = "RPM,...",
        value_delimiter = ',',
        allow_hyphen_values = true,
        requires = "tool"
    )]
    pub(crate) rpm: Vec<f64>,
    /// Quantity by which poses are compared [default: depth_m with a tool, error_m with a wrench,
    /// else compliance_worst_m_per_n]
    #[arg(long, help_heading = "What", value_name = "NAME")]
    pub(crate) by: Option<String>,
    /// Poses to keep at each position, of all directions and branches
    #[arg(long, help_heading = "What", value_parser = word_of::<KeptPoses>(), default_value = "best")]
    pub(crate) keep: KeptPoses,
    /// Number of natural frequencies
    #[arg(long, help_heading = "What", value_name = "N", default_value_t = 3)]
    pub(crate) frequencies: usize,
    /// Find the best position for a box with these edges (m, along world axes)
    #[arg(long, help_heading = "What", value_name = "DX,DY,DZ", allow_hyphen_values = true, conflicts_with_all = ["over", "along", "poses"])]
    pub(crate) workpiece: Option<String>,
    #[command(flatten)]
    pub(crate) input: MotionInputArgs,
    #[command(flatten)]
    pub(crate) modelling: ModellingArgs,
    #[command(flatten)]
    pub(crate) load: RobotArgs,
    /// Folder of table, page and recording [default: a new one in out/]
    #[arg(short, long, help_heading = "Files", value_name = "FOLDER")]
    pub(crate) output: Option<PathBuf>,
    /// Write no files
    #[arg(long, help_heading = "Files", conflicts_with = "output")]
    pub(crate) no_files: bool,
    /// Overwrite files in the output folder
    #[arg(long, help_heading = "Files", requires = "output")]
    pub(crate) force: bool,
}

/// Parses the three numbers of a flag.
fn three(flag: &str, text: &str, unit: &str) -> Result<[f64; 3], Failure> {
    let found = numbers(text).map_err(|what| Failure::Usage(format!("{flag}: {what}{unit}")))?;
    <[f64; 3]>::try_from(found.as_slice())
        .map_err(|_| Failure::Usage(format!("{flag} has {} numbers; expected three{unit}", found.len())))
}

/// Parses `x0:x1,y0:y1,z0:z1`.
fn bounds(text: &str) -> Result<[[f64; 3]; 2], Failure> {
    let wrong =
        || Failure::Usage(format!("--box {text:?}: expected X0:X1,Y0:Y1,Z0:Z1 in m, world, such as 1:2,-0.5:0.5,0:1"));
    let parts: Vec<[f64; 2]> = text
        .split(',')
        .map(|part| {
            let (low, high) = part.split_once(':')?;
            Some([low.trim().parse().ok()?, high.trim().parse().ok()?])
        })
        .collect::<Option<_>>()
        .ok_or_else(wrong)?;
    let [x, y, z] = <[[f64; 2]; 3]>::try_from(parts).map_err(|_| wrong())?;
    Ok([[x[0], y[0], z[0]], [x[1], y[1], z[1]]])
}

/// Parses `joint=from:to:n`.
fn joint_range(text: &str, robot: &Robot) -> Result<JointRange, Failure> {
    let wrong = || {
        Failure::Usage(format!(
            "--over {text:?}: expected JOINT=FROM:TO:N, rad or m, or degrees as in joint_2=-90deg:0deg:46"
        ))
    };
    let (joint, rest) = text.rsplit_once('=').ok_or_else(wrong)?;
    let parts: Vec<&str> = rest.split(':').map(str::trim).collect();
    let [from, to, points] = parts[..] else { return Err(wrong()) };
    let slides = robot.rigid_model()?.coordinates().iter().any(|c| c.joint == joint.trim() && c.slides());
    if slides && (from.ends_with("deg") || to.ends_with("deg")) {
        return Err(Failure::Usage(format!("--over {text:?}: joint {:?} slides; give it in m", joint.trim())));
    }
    let number = |text: &str| -> Option<f64> {
        match text.strip_suffix("deg") {
            Some(digits) => digits.trim().parse::<f64>().ok().map(f64::to_radians),
            None => text.parse().ok(),
        }
    };
    let (from, to) = (number(from).ok_or_else(wrong)?, number(to).ok_or_else(wrong)?);
    let points = points.parse().map_err(|_| wrong())?;
    Ok(JointRange { joint: joint.trim().to_owned(), range: [from, to], points })
}

/// Returns the places of the map: a motion, poses, joint ranges or a box.
fn region(args: &MapArgs, robot: &Robot) -> Result<MapRegion, Failure> {
    if let Some(motion) = &args.along {
        let motion = Motion::load_with(shipped::trajectory(motion)?, robot, &args.input.options())?;
        return Ok(MapRegion::Along { motion: Box::new(motion), points: args.points });
    }
    if let Some(file) = &args.poses {
        let at = values::joint_values(args.at.as_deref(), robot)?;
        return Ok(MapRegion::Poses(read_poses(file, robot, at.as_deref())?));
    }
    if !args.over.is_empty() {
        return Ok(MapRegion::Joints(args.over.iter().map(|text| joint_range(text, robot)).collect::<Result<_, _>>()?));
    }
    let tool = ToolDirections {
        axis: three("--tool-axis", &args.tool_axis, " (world)")?,
        roll_rad: args.roll.to_radians(),
        cone_rad: args.cone.to_radians(),
        tilts: args.tilts.unwrap_or(if args.cone > 0.0 { 9 } else { 1 }),
        rolls: args.rolls,
    };
    let bounds = args.bounds.as_deref().map(bounds).transpose()?;
    Ok(MapRegion::Workspace(WorkspaceGrid { bounds, spacing_m: args.grid, keep_out_m: args.keep_out, tool }))
}

pub(crate) fn run(terminal: &Terminal, args: &MapArgs) -> Result<ExitCode, Failure> {
    let robot = args.load.load(&args.robot)?;
    let region = region(args, &robot)?;
    let workpiece_m = args.workpiece.as_deref().map(|text| three("--workpiece", text, " (m)")).transpose()?;
    let wrench = args.wrench.as_deref().map_or(Ok([0.0; 6]), |text| values::wrench("--wrench", text))?;
    let at = values::joint_values(args.at.as_deref(), &robot)?;
    let folder = OutputFolder::of(args.output.as_deref(), &format!("{}-map", robot.name), !args.no_files)?;
    let request = MapRequest {
        modelling: args.modelling.modelling(),
        region,
        at,
        wrench,
        tool: args.tool.as_ref().map(|given| cutting_tool(given, &args.rpm)).transpose()?,
        frequencies: Some(args.frequencies),
        keep: args.keep,
        by: args.by.clone(),
        workpiece_m,
        output: folder.path(),
        overwrite: args.force,
    };
    let (mut stop, mut bar) = (signals::stop_when_asked(), Bar::new(terminal));
    let found = map(&robot, &request, &mut |done, all| {
        bar.show_as(done, all, || format!("{done:.0} of {all:.0} places"));
        stop()
    });
    bar.clear();
    let found = found?;
    crate::print::caveats(terminal, &found.caveats);
    answer(terminal, || to_json(&found), || text(&found));
    Ok(ExitCode::SUCCESS)
}

fn text(map: &Map) -> String {
    let mut out = match &map.grid {
        Some(grid) => format!(
            "{}: {} of {} places within reach, {} m apart, {} of the tool; {} in {:.2} s",
            map.robot,
            map.reachable,
            map.points,
            grid.spacing_m,
            counted(grid.directions, "direction"),
            counted(map.poses, "pose"),
            map.wall_s
        ),
        None => format!("{}: {} in {:.2} s", map.robot, counted(map.poses, "pose"), map.wall_s),
    };
    out.push('\n');
    // Each quantity over all poses, and at the best and the worst one.
    let mut t = table(&["", "min", "median", "max", "best", "worst"]);
    for column in map.table.columns.iter().filter(|column| column.quantity) {
        let Some(spread) = map.quantities.get(&column.name) else { continue };
        let median = spread.quantiles.get("0.5").copied().unwrap_or(f64::NAN);
        let pose = |pose: &MapPose| pose.quantities.get(&column.name).copied().unwrap_or(f64::NAN);
        let numbers = [spread.min, median, spread.max, pose(&map.best), pose(&map.worst)];
        let mut row = vec![quantity_title(&column.name)];
        row.extend(numbers.map(|x| quantity_text(&column.name, x)));
        t.add_row(row);
    }
    out += &lines(&t);
    // Places of these two, and the best place of a workpiece.
    out += &format!("\nbest and worst by {}:\n", quantity_title(&map.by));
    for (name, pose) in [("best", &map.best), ("worst", &map.worst)] {
        let place = pose.place_m.map(|x| format!("{x:.3}")).join(", ");
        let joints: Vec<String> = pose.q.iter().map(|q| format!("{q:.4}")).collect();
        out += &format!("  {name:<5} at {place} m, joints {}\n", joints.join(", "));
    }
    if let Some(placement) = &map.placement {
        let unit = readable_quantity(&map.by).1;
        let centre = placement.centre_m.map(|x| format!("{x:.3}")).join(", ");
        out += &format!(
            "workpiece: centre best at {centre} m, worst in it {} {unit} ({} places)\n",
            quantity_text(&map.by, placement.worst),
            placement.points
        );
    }
    out += &file_lines(
        7,
        &[
            ("table", &map.files.table),
            ("page", &map.files.page),
            ("Rerun", &map.files.rrd),
            ("figures", &map.files.json),
        ],
    );
    out
}
