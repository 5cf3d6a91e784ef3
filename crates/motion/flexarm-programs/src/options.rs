//! Options of a reader.
//!
//! They state what a program does not say: where it begins, values of the controller, files beside
//! it, the kinematics of the robot. Units: m and rad, except the texts of `given`, which are in the
//! language.

use std::path::PathBuf;

use flexarm_spatial::Pose;
use nalgebra::{Rotation3, Vector3};

/// A language of robot programs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Language {
    /// KUKA's KRL (`.src` with `.dat`).
    Krl,
    /// ABB's RAPID (`.mod`, `.prg`, `.sys`).
    Rapid,
    /// Universal Robots' URScript (`.script`, `.urscript`).
    UrScript,
    /// G-code of milling machines, RS274/NGC (`.nc`, `.ngc`, `.tap`, `.gcode`).
    GCode,
}

impl Language {
    /// Display name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Krl => "KUKA KRL",
            Self::Rapid => "ABB RAPID",
            Self::UrScript => "URScript",
            Self::GCode => "G-code",
        }
    }
}

/// Pose `X_WF` of the flange in the controller's world for joint values (rad or m); `None` if their
/// number is not that of the robot's joints.
pub type ForwardKinematics<'a> = &'a dyn Fn(&[f64]) -> Option<Pose>;

/// Options of a reader; all have defaults.
#[derive(Clone)]
pub struct ReadOptions<'a> {
    /// Language; `None`: recognised from the content.
    pub language: Option<Language>,
    /// Routine with which the program starts; `None`: the language's default (`main`, the first
    /// `DEF`).
    pub entry: Option<String>,
    /// Joint values at the start, rad or m; they allow a program to begin with a line.
    pub start: Option<Vec<f64>>,
    /// Names and values that the file leaves open, in its language:
    /// `("BASE_DATA[1]", "{X 1000, Y 0, Z 500, A 0, B 0, C 0}")`, `("di1", "1")`.
    pub given: Vec<(String, String)>,
    /// Further files of the program with their bytes: KUKA's `$config.dat`, other modules.
    pub companions: Vec<(PathBuf, Vec<u8>)>,
    /// Whether to search next to the file for companions: KUKA's `.dat`, and `.src` of called
    /// routines.
    pub find_companions: bool,
    /// Whether waiting for external events (`WAIT FOR`, `WaitDI`) ends at once.
    pub waits_are_over: bool,
    /// Number of passes of an endless loop; `None`: such a loop is an error.
    pub endless_passes: Option<usize>,
    /// Maximum number of moves and dwells.
    pub most_moves: usize,
    /// Maximum number of executed statements.
    pub most_steps: usize,
    /// Kinematics of the robot, for moves relative to a position given in joint values.
    pub forward: Option<ForwardKinematics<'a>>,
    /// The robot's own tool centre point on its flange, `X_FT`, for the same purpose.
    pub own_tool: Option<Pose>,
    /// Options for G-code only.
    pub gcode: GCodeOptions,
}

impl Default for ReadOptions<'_> {
    fn default() -> Self {
        Self {
            language: None,
            entry: None,
            start: None,
            given: Vec::new(),
            companions: Vec::new(),
            find_companions: true,
            waits_are_over: false,
            endless_passes: None,
            most_moves: 500_000,
            most_steps: 5_000_000,
            forward: None,
            own_tool: None,
            gcode: GCodeOptions::default(),
        }
    }
}

/// Interpretation of rotary words in G-code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Rotary {
    /// Rejected, unless they are 0.
    #[default]
    Refused,
    /// The tool is rotated about the axes of the work frame: `R_BT = Rz(C) Ry(B) Rx(A) R`, with `R`
    /// the orientation at A = B = C = 0.
    Tilt,
}

/// Machine properties that G-code leaves open.
#[derive(Debug, Clone, PartialEq)]
pub struct GCodeOptions {
    /// Orientation of the tool in the work frame, `R_BT`; by default its z axis is opposite to the
    /// work frame's z axis, and its x axis along the work frame's x axis.
    pub R_BT: Rotation3<f64>,
    /// Interpretation of A, B and C.
    pub rotary: Rotary,
    /// Work frames in the controller's world, by their code: `("G54", X_WB)`; those not given are
    /// at the robot's base, with a note.
    pub offsets: Vec<(String, Pose)>,
    /// Frame of the machine coordinates (G53) in the controller's world.
    pub machine: Pose,
    /// Target of G28 in machine coordinates, mm; `None`: G28 is rejected. G30 likewise.
    pub reference_mm: Option<[f64; 3]>,
    /// Speed of rapids (G0) as straight lines, m/s; `None`: they are joint moves.
    pub rapid_m_s: Option<f64>,
    /// Whether the tool centre point is the tip of the tool, so that G43 with a tool length has no
    /// effect. `false`: G43 is rejected.
    pub tip_is_known: bool,
}

impl Default for GCodeOptions {
    fn default() -> Self {
        Self {
            R_BT: Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI),
            rotary: Rotary::Refused,
            offsets: Vec::new(),
            machine: Pose::identity(),
            reference_mm: None,
            rapid_m_s: None,
            tip_is_known: false,
        }
    }
}
