//! Arguments of `flexarm import` and `flexarm export`.
//!
//! Not here: the jobs that are made of them (`exchange.rs`).

use std::path::PathBuf;

use clap::Args;

use crate::args::{ModellingArgs, RobotArgs, word_of};
use flexarm::links::export::ExportFormat;
use flexarm::links::import::{FrameAt, ImportFormat, ImportMap, RigidPart, UnitsOfFile, parse_part};
use flexarm::links::reduce::SplitChoice;
use flexarm::robots::RobotFormat;

const IMPORT_EXAMPLES: &str = "\
Examples:
  Nastran punch file with GRIDs (positions), millimetres:
      flexarm import arm.pch --units mm-t-s --map A=1001,B=1002
  CalculiX, full model; the rotations of a rigid body are on its ROT NODE:
      flexarm import arm.sti --units m-kg-s \\
          --map A=947:1-3+948:1-3,B=949:1-3+950:1-3 --at A=0,0,0 --at B=1,0,0
  Matrix Market with the .toml that flexarm export writes, which has all else:
      flexarm import arm_K.mtx
  Nastran, full model with GRIDs, interfaces by planes (unit of the file):
      flexarm import arm.pch --units m-kg-s \\
          --map \"A=plane(0,0,0;1,0,0),B=plane(1,0,0;1,0,0)\"
  Modal body (SID), for modal links of a robot file:
      flexarm import arm.SID_FEM --units m-kg-s --map A=1,B=2
  Stiffness only, with the mass of the link:
      flexarm import arm.mtx --units m-kg-s --map A=1001,B=1002 \\
          --at A=0,0,0 --at B=1,0,0 \\
          --mass 18.8 --com 0.5,0,0 --inertia 0.01,1.6,1.6,0,0,0

Maps (proximal interface first; six rows each, ux uy uz rx ry rz):
  A=1001                  components 1 to 6 of a node
  A=947:1-3+948:1-3       rotations: components 1 to 3 of a second node
  A=#1-6                  rows of the file, from 1
  modal=#13-22            which other rows are modal coordinates
  A=1,B=2,C=3             nodes of a SID, the interfaces of the modal link
  A=plane(x,y,z;nx,ny,nz) nodes of a full model with positions (DMIG with GRIDs)

Lengths are in the unit of the file, masses and inertias in SI.";

#[derive(Debug, Args)]
#[command(after_long_help = IMPORT_EXAMPLES, after_help = "More, with examples: flexarm import --help")]
pub(crate) struct ImportArgs {
    /// Files of one structure (stiffness, mass, list of rows); companion files in the same folder
    /// are found
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// Required format of the files; auto: by content
    #[arg(long, value_parser = word_of::<ImportFormat>(), default_value = "auto", help_heading = "Matrices")]
    pub(crate) format: ImportFormat,
    /// Units of the files: m-kg-s (N, Pa), mm-t-s (N, MPa), in-slinch-s, ...
    #[arg(long, value_name = "LENGTH-MASS-TIME", help_heading = "Matrices")]
    pub(crate) units: Option<UnitsOfFile>,
    /// Rows or nodes of each interface, proximal first, such as A=1001,B=1002
    #[arg(long, value_name = "NAME=ROWS,...", help_heading = "Interfaces")]
    pub(crate) map: Option<ImportMap>,
    /// Frame of an interface in the link frame: x,y,z or x,y,z,roll,pitch,yaw (unit of the file,
    /// rad; repeat)
    #[arg(long, value_name = "NAME=PLACE", help_heading = "Interfaces")]
    pub(crate) at: Vec<FrameAt>,
    /// File of the mass matrix, if its name does not show it
    #[arg(long, value_name = "FILE", help_heading = "Matrices", hide_short_help = true)]
    pub(crate) mass_file: Option<PathBuf>,
    /// Name of the stiffness in a file with several matrices
    #[arg(long, value_name = "NAME", help_heading = "Matrices", hide_short_help = true)]
    pub(crate) k_name: Option<String>,
    /// Name of the mass in a file with several matrices
    #[arg(long, value_name = "NAME", help_heading = "Matrices", hide_short_help = true)]
    pub(crate) m_name: Option<String>,
    /// Axes of the matrices in link axes: roll,pitch,yaw (rad)
    #[arg(long, value_name = "R,P,Y", allow_hyphen_values = true, help_heading = "Matrices", hide_short_help = true)]
    pub(crate) axes_rpy: Option<String>,
    /// Fixed-interface modes to keep of a full model; 0 for Guyan [default: 10]
    #[arg(long, value_name = "N", help_heading = "Matrices")]
    pub(crate) modes: Option<usize>,
    /// Mass of the link (kg), if the matrices have none or a different one
    #[arg(long, value_name = "KG", requires_all = ["com", "inertia"], allow_hyphen_values = true, help_heading = "Mass of the link")]
    pub(crate) mass: Option<f64>,
    /// Centre of mass in the link frame: x,y,z (m)
    #[arg(
        long,
        value_name = "X,Y,Z",
        requires = "mass",
        allow_hyphen_values = true,
        help_heading = "Mass of the link"
    )]
    pub(crate) com: Option<String>,
    /// Inertia about the centre of mass: ixx,iyy,izz,ixy,ixz,iyz (kg m2, link axes)
    #[arg(
        long,
        value_name = "IXX,IYY,...",
        requires = "mass",
        allow_hyphen_values = true,
        help_heading = "Mass of the link"
    )]
    pub(crate) inertia: Option<String>,
    /// Proximal rigid part: mass;x,y,z;ixx,iyy,izz,ixy,ixz,iyz (kg, m, kg m2, link axes)
    #[arg(long, value_name = "PART", value_parser = parse_part, requires = "part_b", conflicts_with = "mass", help_heading = "Mass of the link", hide_short_help = true)]
    pub(crate) part_a: Option<RigidPart>,
    /// Distal rigid part, in the same form
    #[arg(long, value_name = "PART", value_parser = parse_part, requires = "part_a", conflicts_with = "mass", help_heading = "Mass of the link", hide_short_help = true)]
    pub(crate) part_b: Option<RigidPart>,
    /// Position of the elastic joint between the two parts: elastic-centre, mid, a fraction of the
    /// distance from A to B, or x,y,z
    #[arg(
        long,
        value_name = "WHERE",
        allow_hyphen_values = true,
        help_heading = "Mass of the link",
        hide_short_help = true
    )]
    pub(crate) split: Option<SplitChoice>,
    /// Name of the link [default: that of the file]
    #[arg(long, value_name = "NAME", help_heading = "Files")]
    pub(crate) name: Option<String>,
    /// Output folder for link file, figures and report [default: a new one in out/, or none with
    /// --flex]
    #[arg(short, long, value_name = "FOLDER", help_heading = "Files")]
    pub(crate) output: Option<PathBuf>,
    /// Write the link file (also) to this path
    #[arg(long, value_name = "FILE", help_heading = "Files")]
    pub(crate) flex: Option<PathBuf>,
    /// Overwrite existing files
    #[arg(long, help_heading = "Files")]
    pub(crate) force: bool,
    /// Write no files, only print the figures
    #[arg(long, conflicts_with_all = ["output", "flex", "force"], help_heading = "Files")]
    pub(crate) no_files: bool,
}

#[derive(Debug, Args)]
pub(crate) struct ExportArgs {
    /// A link file (.flex) for --format, or a robot for --to: robot.toml, a folder with one, a .urdf
    /// or .xacro file, or the name of a shipped robot
    #[arg(value_name = "LINK.flex|ROBOT")]
    pub(crate) input: PathBuf,
    /// Simulator's format of a robot
    #[arg(long, value_parser = word_of::<RobotFormat>(), help_heading = "Robots", required_unless_present = "format")]
    pub(crate) to: Option<RobotFormat>,
    /// Joint values of the pose at which the robot rests, as for statics
    #[arg(long, value_name = "Q1,Q2,...", help_heading = "Robots", allow_hyphen_values = true, requires = "to")]
    pub(crate) at: Option<String>,
    #[command(flatten)]
    pub(crate) modelling: ModellingArgs,
    #[command(flatten)]
    pub(crate) load: RobotArgs,
    /// Format of the matrices of a link
    #[arg(long, value_parser = word_of::<ExportFormat>(), help_heading = "Matrices", requires = "units", conflicts_with = "to")]
    pub(crate) format: Option<ExportFormat>,
    /// Units to write: m-kg-s (N), mm-t-s (N, MPa), ...
    #[arg(long, value_name = "LENGTH-MASS-TIME", help_heading = "Matrices", requires = "format")]
    pub(crate) units: Option<UnitsOfFile>,
    /// Node numbers of the interfaces in formats that use them, proximal first [default:
    /// 1001,1002,...]
    #[arg(long, value_name = "N,N,...", value_delimiter = ',', help_heading = "Interfaces")]
    pub(crate) nodes: Vec<i64>,
    /// Output folder [default: a new one in out/]
    #[arg(short, long, value_name = "FOLDER", help_heading = "Files")]
    pub(crate) output: Option<PathBuf>,
    /// Overwrite existing files
    #[arg(long, help_heading = "Files")]
    pub(crate) force: bool,
}
