//! Arguments of `flexarm reduce`.
//!
//! Words such as `NAME=SET` and `x,y,z` are parsed here to the types of a job, with the units of
//! the mesh. Not here: the job that is made of them (`reduce.rs`).

use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;
use flexarm::links::reduce::{
    FrameEntry, MaterialChoice, NodeSelector, OrderingChoice, QuadratureChoice, SplitChoice, Tie, Units, numbers,
};

use crate::args::word_of;

const EXAMPLES: &str = "\
Examples:
  What is in a mesh (groups, sizes, materials), to see what to type:
      flexarm reduce lower_arm.msh --list
  Two named surfaces, frames at given points (unit of the mesh, link frame):
      flexarm reduce lower_arm.msh --units mm-t-s --material aluminium \\
          --interface A=interface_A --at A=0,-75,0 \\
          --interface B=interface_B --at B=40,110,1100
  Surfaces by place; a softer tie at the far end; frames from the robot's URDF:
      flexarm reduce arm.inp.gz --units m-kg-s --urdf arm.urdf --link link_2 \\
          --interface 'A=plane(0,0,0; 0,1,0)' \\
          --interface 'B=cylinder(0,0,1.1; 0,1,0; 0.06)' --tie B=distributing
  The same again, with other modes, from the job that the first run wrote:
      flexarm reduce out/lower_arm-001/reduce.toml --modes-up-to 500 \\
          --chains 3,4,8
  With the stiffness by load, for modal links with geometric_stiffening = true:
      flexarm reduce lower_arm.reduce.toml --geometric
  Straight into a robot's folder:
      flexarm reduce lower_arm.reduce.toml --flex robots/mine/lower_arm.flex

Node selectors (lengths in the unit and the frame of the mesh file):
  NAME                               a node set or a physical group; in quotes
                                     if it has & or ( in it
  plane(x,y,z; nx,ny,nz)             nodes of the surface in a plane
  cylinder(x,y,z; ax,ay,az; radius)  wall of an endless cylinder, such as a bore
  box(x,y,z; x,y,z)                  in a box; all three take a tolerance as
                                     last argument
  S & T                              nodes that both choose

Ties: rigid (RBE2) stiffens the seat, distributing (RBE3) adds no stiffness; the\ntruth lies between.
Everything can stand in a job file (TOML, with mesh = \"...\"); flags override it.";

#[derive(Debug, Args)]
#[command(after_long_help = EXAMPLES, after_help = "More, with examples: flexarm reduce --help")]
pub(crate) struct ReduceArgs {
    /// Mesh (.msh of Gmsh, .inp of CalculiX or Abaqus, also .gz), or a job file (.toml with mesh =
    /// "...")
    #[arg(value_name = "MESH_OR_JOB")]
    pub(crate) mesh: PathBuf,
    /// List the contents of the mesh and stop: groups, node sets, regions, materials, sizes
    #[arg(long, alias = "dry-run", help_heading = "Mesh")]
    pub(crate) list: bool,
    /// Units of the mesh: m-kg-s (N, Pa), mm-t-s (N, MPa), in-slinch-s, ...
    #[arg(long, value_name = "LENGTH-MASS-TIME", help_heading = "Mesh")]
    pub(crate) units: Option<Units>,
    /// steel, aluminium, cast_iron, ductile_iron or E,nu,rho in SI; of one region with REGION= (may
    /// be repeated)
    #[arg(long = "material", value_name = "[REGION=]MATERIAL", value_parser = NamedValue::<MaterialChoice>::parse, help_heading = "Mesh")]
    pub(crate) materials: Vec<NamedValue<MaterialChoice>>,
    /// Nodes of an interface, the proximal one first (repeat); named A, B, C in order unless NAME
    /// is given
    #[arg(long = "interface", value_name = "[NAME=]SELECTOR", value_parser = NamedValue::<NodeSelector>::parse, help_heading = "Interfaces")]
    pub(crate) interfaces: Vec<NamedValue<NodeSelector>>,
    /// Frame of an interface in the link frame: x,y,z or x,y,z,roll,pitch,yaw (unit of the mesh,
    /// rad), centroid, or joint:NAME with --urdf (repeat)
    #[arg(long, value_name = "NAME=PLACE", value_parser = NamedValue::<PlaceWord>::parse, help_heading = "Interfaces")]
    pub(crate) at: Vec<NamedValue<PlaceWord>>,
    /// rigid or distributing, for all interfaces or for one with NAME= (may be repeated) [default:
    /// rigid]
    #[arg(long = "tie", value_name = "[NAME=]TIE", value_parser = NamedValue::<TieWord>::parse, help_heading = "Interfaces")]
    pub(crate) ties: Vec<NamedValue<TieWord>>,
    /// URDF or xacro whose joints define the interfaces: A at the origin of the link, B at that of
    /// the next joint
    #[arg(long, value_name = "FILE", requires = "link", help_heading = "Mesh")]
    pub(crate) urdf: Option<PathBuf>,
    /// The link in the URDF
    #[arg(long, value_name = "NAME", requires = "urdf", help_heading = "Mesh")]
    pub(crate) link: Option<String>,
    /// The joint at B, if several follow the link
    #[arg(long, value_name = "NAME", requires = "urdf", help_heading = "Mesh", hide_short_help = true)]
    pub(crate) joint: Option<String>,

    /// With --urdf: add the mass of the URDF's link that the mesh lacks (motors, gears) to the two
    /// parts
    #[arg(long, requires = "urdf", help_heading = "Mesh", hide_short_help = true)]
    pub(crate) rest: bool,
    /// Pose of the mesh frame in the link frame: x,y,z or x,y,z,roll,pitch,yaw (unit of the mesh,
    /// rad)
    #[arg(long, value_name = "POSE", allow_hyphen_values = true, value_parser = parse_frame, help_heading = "Mesh", hide_short_help = true)]
    pub(crate) mesh_frame: Option<FrameEntry>,
    /// Fixed-interface modes to keep (Craig-Bampton); 0 for Guyan [default: 10]
    #[arg(long, value_name = "N", help_heading = "Reduction")]
    pub(crate) modes: Option<usize>,
    /// Keep all fixed-interface modes up to this frequency (Hz); use twice the highest frequency of
    /// interest
    #[arg(
        long,
        value_name = "HZ",
        conflicts_with = "modes",
        allow_hyphen_values = true,
        help_heading = "Reduction",
        hide_short_help = true
    )]
    pub(crate) modes_up_to: Option<f64>,
    /// Position of the elastic joint between the two parts: elastic-centre, mid, a fraction of the
    /// distance from A to B, or x,y,z
    #[arg(long, value_name = "WHERE", allow_hyphen_values = true, help_heading = "Reduction", hide_short_help = true)]
    pub(crate) split: Option<SplitChoice>,
    /// Numbers of parts of longer chains to store in the link file, such as 3,4,8
    #[arg(long, value_name = "N,N,...", value_delimiter = ',', help_heading = "Reduction", hide_short_help = true)]
    pub(crate) chains: Option<Vec<usize>>,
    /// Store the load-dependent stiffness of the modal link (12 more solves), for
    /// geometric_stiffening = true of a robot file
    #[arg(long, help_heading = "Reduction", hide_short_help = true)]
    pub(crate) geometric: bool,
    /// Store the stress at the nodes of the surface beside the link file, as NAME.stress (12 more
    /// solves): runs then report the largest stress of the link
    #[arg(long, help_heading = "Reduction")]
    pub(crate) stress: bool,
    /// Merge nodes closer to each other than this (unit of the mesh), to close seams and cracks
    #[arg(long, value_name = "DISTANCE", allow_hyphen_values = true)]
    pub(crate) merge: Option<f64>,
    /// Quadrature of the elements
    #[arg(long, value_parser = word_of::<QuadratureChoice>(), help_heading = "Reduction", hide_short_help = true)]
    pub(crate) quadrature: Option<QuadratureChoice>,
    /// Order of elimination
    #[arg(long, value_parser = word_of::<OrderingChoice>(), help_heading = "Reduction", hide_short_help = true)]
    pub(crate) ordering: Option<OrderingChoice>,
    /// Name of the link [default: that of --link, or of the mesh file]
    #[arg(long, value_name = "NAME", help_heading = "Mesh")]
    pub(crate) name: Option<String>,
    /// Output folder for link file, job, figures and report [default: a new one in out/, or none
    /// with --flex]
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

/// `NAME=VALUE`, or a value without a name.
#[derive(Clone, Debug)]
pub(crate) struct NamedValue<T> {
    pub(crate) name: Option<String>,
    pub(crate) value: T,
}

impl<T: FromStr<Err: ToString>> NamedValue<T> {
    fn parse(text: &str) -> Result<Self, String> {
        // An = inside quotes or brackets is part of the value.
        let name = text.split_once('=').filter(|(name, _)| !name.contains(['"', '(']));
        let (name, value) = match name {
            Some((name, _)) if name.trim().is_empty() => return Err("there is no name before the =".into()),
            Some((name, value)) => (Some(name.trim().to_owned()), value),
            None => (None, text),
        };
        let value = value.parse().map_err(|error: T::Err| error.to_string())?;
        Ok(Self { name, value })
    }
}

/// Position of an interface.
#[derive(Clone, Debug)]
pub(crate) enum PlaceWord {
    Centroid,
    Joint(String),
    Frame(FrameEntry),
}

impl FromStr for PlaceWord {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text.trim(), text.trim().strip_prefix("joint:")) {
            ("centroid", _) => Ok(Self::Centroid),
            (_, Some(joint)) => Ok(Self::Joint(joint.to_owned())),
            (other, None) => parse_frame(other)
                .map(Self::Frame)
                .map_err(|error| format!("{error}; expected x,y,z, x,y,z,roll,pitch,yaw, centroid or joint:NAME")),
        }
    }
}

fn parse_frame(text: &str) -> Result<FrameEntry, String> {
    match numbers(text).map_err(|error| error.to_string())?.as_slice() {
        [x, y, z] => Ok(FrameEntry { xyz: [*x, *y, *z], rpy: [0.0; 3] }),
        [x, y, z, roll, pitch, yaw] => Ok(FrameEntry { xyz: [*x, *y, *z], rpy: [*roll, *pitch, *yaw] }),
        other => Err(format!("{} numbers in {text:?}, 3 or 6 are expected", other.len())),
    }
}

/// A tie, given by its name.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TieWord(pub(crate) Tie);

impl FromStr for TieWord {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim() {
            "rigid" => Ok(Self(Tie::Rigid)),
            "distributing" => Ok(Self(Tie::Distributing)),
            other => Err(format!("{other:?} is not a tie; expected rigid or distributing")),
        }
    }
}
